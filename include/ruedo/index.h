// Typed indices: an index into one kind of list does not convert to an index into another.
//
// Bodies, links, joints, wheels, robots and models lie in lists and are identified by their
// indices: a BodyIndex, a LinkIndex and so on. A list that is an IndexedVector takes only its own
// kind:
//
//   IndexedVector<BodyIndex, Pose> poses;
//   poses[link.body];   // a BodyIndex
//   poses[link.index];  // a LinkIndex: does not compile
//
// As Drake's TypeSafeIndex, an index converts to an int implicitly, for messages and arrays, and an
// int to an index only explicitly.
#pragma once

#include <compare>
#include <concepts>
#include <cstddef>
#include <type_traits>
#include <utility>
#include <vector>

namespace ruedo {

template <typename Kind>
class Index {
 public:
  constexpr Index() = default;  // of nothing: -1
  template <std::integral Integer>
  constexpr explicit Index(Integer value) : value_(static_cast<int>(value)) {}
  template <typename Other>
  explicit Index(Index<Other>) = delete;

  [[nodiscard]] constexpr bool valid() const { return value_ >= 0; }
  constexpr operator int() const { return value_; }  // NOLINT(google-explicit-constructor)
  explicit operator bool() const = delete;           // 0 is an index

  constexpr Index& operator++() { return *this += 1; }
  constexpr Index& operator+=(int offset) {
    value_ += offset;
    return *this;
  }
  friend constexpr auto operator<=>(Index a, Index b) = default;
  template <typename Other>
    requires(!std::is_same_v<Other, Kind>)
  friend bool operator==(Index, Index<Other>) = delete;
  template <typename Other>
    requires(!std::is_same_v<Other, Kind>)
  friend bool operator<=>(Index, Index<Other>) = delete;

 private:
  int value_ = -1;
};

/// A list whose elements have an index of one kind. Loops may still count in size_t.
template <typename ItsIndex, typename T>
class IndexedVector : public std::vector<T> {
  using Base = std::vector<T>;

 public:
  using Base::Base;
  IndexedVector() = default;
  IndexedVector(Base list) : Base(std::move(list)) {}  // NOLINT(google-explicit-constructor)

  using Base::operator[];
  typename Base::reference operator[](ItsIndex index) { return Base::operator[](place(index)); }
  typename Base::const_reference operator[](ItsIndex index) const {
    return Base::operator[](place(index));
  }
  template <typename Other>
  void operator[](Index<Other>) const = delete;

  /// The index that the next push_back() will have.
  [[nodiscard]] ItsIndex next() const { return ItsIndex(Base::size()); }
  [[nodiscard]] bool has(ItsIndex index) const {
    return index.valid() && place(index) < Base::size();
  }
  /// All of them, in order: for (const BodyIndex body : bodies.indices())
  [[nodiscard]] auto indices() const {
    struct Iterator {
      ItsIndex index;
      ItsIndex operator*() const { return index; }
      Iterator& operator++() { return ++index, *this; }
      bool operator!=(const Iterator& other) const { return !(index == other.index); }
    };
    struct Range {
      ItsIndex past;
      Iterator begin() const { return {ItsIndex(0)}; }
      Iterator end() const { return {past}; }
    };
    return Range{next()};
  }

 private:
  static size_t place(ItsIndex index) { return static_cast<size_t>(static_cast<int>(index)); }
};

using InstanceIndex = Index<struct InstanceKind>;      // into WorldModel::models
using LinkIndex = Index<struct LinkKind>;              // into BodyLayout::links
using BodyIndex = Index<struct BodyKind>;              // into BodyLayout::bodies
using WheelIndex = Index<struct WheelKind>;            // into BodyLayout::wheels
using JointIndex = Index<struct JointKind>;            // into BodyLayout::joints
using RobotIndex = Index<struct RobotKind>;            // into BodyLayout::robots
using ContactIndex = Index<struct ContactKind>;        // into Snapshot::contacts
using ShapeIndex = Index<struct ShapeKind>;            // into a link's collisions or visuals
using ModelLinkIndex = Index<struct ModelLinkKind>;    // into Model::links
using ModelJointIndex = Index<struct ModelJointKind>;  // into Model::joints

}  // namespace ruedo
