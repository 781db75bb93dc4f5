// Places in a file against the same in memory.
#include "log/places.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace ruedo::log {
namespace {

TEST(Places, FindsEveryAddedPlace) {
  for (const size_t count : {0, 1, 3, 4, 5, 8, 1000}) {  // of pages of four
    const auto file = std::make_shared<PlacesFile>();
    Places places(file, 4), others(file, 4);  // two channels share the file
    std::vector<SimTime> times;
    for (size_t i = 0; i < count; ++i) {
      const auto n = static_cast<int64_t>(i);
      times.push_back(n / 7 * 10);  // seven of each time, over the ends of pages
      places.push_back({times.back(), 100 * n, static_cast<uint32_t>(i)});
      if (i % 3 == 0) others.push_back({-1, -1, 1});
    }
    ASSERT_EQ(places.size(), count);
    Places::Cursor cursor(places);
    for (size_t i = 0; i < count; ++i) {
      const Place* next = cursor.next();
      ASSERT_NE(next, nullptr);
      for (const Place& place : {places[i], *next}) {
        EXPECT_EQ(place.time_us, times[i]);
        EXPECT_EQ(place.offset, 100 * static_cast<int64_t>(i));
        EXPECT_EQ(place.size, i);
      }
    }
    EXPECT_EQ(cursor.next(), nullptr);
    for (SimTime time_us = -5; time_us < 1500; time_us += 5)
      EXPECT_EQ(places.count_until(time_us),
                static_cast<size_t>(std::ranges::upper_bound(times, time_us) - times.begin()))
          << count << " places, " << time_us << " us";
  }
}

}  // namespace
}  // namespace ruedo::log
