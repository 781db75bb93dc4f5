// Fair turns and a limited rate, with times set by hand.
#include "bridges/ros2/fair_queue.h"

#include <chrono>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ruedo::ros2 {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Queue = FairQueue<int>;
using std::chrono::milliseconds;

constexpr Queue::Clock::time_point kStart{std::chrono::hours(1)};
constexpr auto kAnybody = [](uint64_t) { return true; };

template <class May>
std::vector<int> all_that_may(Queue& queue, Queue::Clock::time_point now, May may) {
  std::vector<int> items;
  while (const auto next = queue.next(now, may)) items.push_back(next->second);
  return items;
}

TEST(FairQueue, ClientsTakeTurnsAndTheirOwnStayInOrder) {
  Queue queue;
  for (const int item : {11, 12, 13, 14}) queue.push(1, item);
  for (const int item : {31, 32}) queue.push(3, item);
  queue.push(2, 21);
  EXPECT_EQ(queue.size(), 7U);
  EXPECT_THAT(all_that_may(queue, kStart, kAnybody), ElementsAre(11, 21, 31, 12, 32, 13, 14));
  EXPECT_TRUE(queue.empty());
}

TEST(FairQueue, ABlockedClientDelaysNoOther) {
  Queue queue;
  queue.push(1, 11);
  queue.push(2, 21);
  queue.push(1, 12);
  EXPECT_THAT(all_that_may(queue, kStart, [](uint64_t client) { return client == 2; }),
              ElementsAre(21));
  EXPECT_THAT(all_that_may(queue, kStart, kAnybody), ElementsAre(11, 12));
}

TEST(FairQueue, NoMoreThanThePace) {
  Queue queue({.per_second = 1000.0, .at_once = 3.0});
  for (int i = 0; i < 20; ++i) queue.push(1, i);
  EXPECT_THAT(all_that_may(queue, kStart, kAnybody), ElementsAre(0, 1, 2));
  EXPECT_THAT(all_that_may(queue, kStart, kAnybody), IsEmpty());
  EXPECT_THAT(all_that_may(queue, kStart + milliseconds(2), kAnybody), ElementsAre(3, 4));
  EXPECT_THAT(all_that_may(queue, kStart + milliseconds(1002), kAnybody), ElementsAre(5, 6, 7));
}

TEST(FairQueue, TheNextClientIsNextHoweverManyWait) {
  Queue queue({.per_second = 1000.0, .at_once = 1.0});
  for (int i = 0; i < 100; ++i) queue.push(1, i);
  EXPECT_THAT(all_that_may(queue, kStart, kAnybody), ElementsAre(0));
  queue.push(2, -1);
  EXPECT_THAT(all_that_may(queue, kStart + milliseconds(1), kAnybody), ElementsAre(-1));
}

TEST(FairQueue, CrowdsAreAnsweredMoreSlowly) {
  Queue queue({.per_second = 1e6, .at_once = 1e6}, {.per_second = 100.0, .at_once = 2.0});
  for (int i = 0; i < 60; ++i) queue.push(1, i);
  for (int i = 0; i < 3; ++i) queue.push(2, -i);
  EXPECT_THAT(all_that_may(queue, kStart, kAnybody), ElementsAre(0, 0, 1, -1, -2));
  EXPECT_THAT(all_that_may(queue, kStart + milliseconds(10), kAnybody), ElementsAre(2));
  EXPECT_THAT(all_that_may(queue, kStart + milliseconds(30), kAnybody), ElementsAre(3, 4));
  // The rest is within the limit.
  for (int ms = 50; ms <= 150; ms += 20) all_that_may(queue, kStart + milliseconds(ms), kAnybody);
  EXPECT_TRUE(queue.empty());
}

}  // namespace
}  // namespace ruedo::ros2
