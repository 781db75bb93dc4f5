// Typed indices: what compiles, and what must not.
#include "ruedo/index.h"

#include <type_traits>

#include <gtest/gtest.h>

namespace ruedo {
namespace {

using Bodies = IndexedVector<BodyIndex, double>;

template <typename List, typename Key>
concept Subscript = requires(List list, Key key) { list[key]; };
template <typename A, typename B>
concept Comparable = requires(A a, B b) { a == b; };
template <typename A, typename B>
concept Ordered = requires(A a, B b) { a < b; };

TEST(Index, AnIndexOfAnotherKindDoesNotCompile) {
  static_assert(Subscript<Bodies, BodyIndex>);
  static_assert(!Subscript<Bodies, LinkIndex>);
  static_assert(!Subscript<const Bodies, LinkIndex>);
  static_assert(Comparable<BodyIndex, BodyIndex>);
  static_assert(!Comparable<BodyIndex, LinkIndex>);
  static_assert(Ordered<BodyIndex, BodyIndex>);
  static_assert(!std::is_constructible_v<BodyIndex, LinkIndex>);
  static_assert(!std::is_assignable_v<BodyIndex&, LinkIndex>);
}

TEST(Index, ConvertsFromNumbersOnlyExplicitly) {
  static_assert(!std::is_convertible_v<int, BodyIndex>);
  static_assert(std::is_constructible_v<BodyIndex, int>);
  static_assert(std::is_constructible_v<BodyIndex, size_t>);
  static_assert(!std::is_constructible_v<BodyIndex, double>);
  static_assert(std::is_convertible_v<BodyIndex, int>);
  static_assert(!std::is_constructible_v<bool, BodyIndex>);  // 0 is an index
}

TEST(Index, DefaultsToMinusOne) {
  EXPECT_FALSE(BodyIndex().valid());
  EXPECT_EQ(static_cast<int>(BodyIndex()), -1);
  EXPECT_TRUE(BodyIndex(0).valid());
  EXPECT_LT(BodyIndex(), BodyIndex(0));
}

TEST(IndexedVector, IteratesByItsIndex) {
  Bodies list{1.0, 2.0, 3.0};
  double sum = 0;
  for (const BodyIndex body : list.indices()) sum += list[body] * (body + 1);
  EXPECT_EQ(sum, 14.0);
  EXPECT_EQ(list.next(), BodyIndex(3));
  EXPECT_TRUE(list.has(BodyIndex(2)));
  EXPECT_FALSE(list.has(BodyIndex(3)));
  EXPECT_FALSE(list.has(BodyIndex()));
  for (const BodyIndex body : Bodies().indices()) FAIL() << body;
}

TEST(IndexedVector, HoldsBooleans) {
  IndexedVector<LinkIndex, bool> list(2);
  list[LinkIndex(1)] = true;
  EXPECT_FALSE(list[LinkIndex(0)]);
  EXPECT_TRUE(list[LinkIndex(1)]);
}

}  // namespace
}  // namespace ruedo
