// Limits on untrusted parts of ruedo/info that a client keeps.
#include "samples/world_info.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "ruedo/world_info_t.hpp"
#include "session.h"

using namespace ruedo;
using namespace ruedo::client;

namespace {

// The number of accepted parts of this size, and the reason why no more.
std::pair<int, std::string> taken(int nparts, size_t size) {
  WorldInfoAssembler assembler;
  world_info_t info{};
  info.nparts = static_cast<int16_t>(nparts);
  for (; info.part < nparts - 1; ++info.part) {
    std::vector<uint8_t> bytes = encoded(info);
    bytes.resize(size);
    try {
      assembler.add(bytes.data(), bytes.size());
    } catch (const TypeMismatch& error) {
      return {info.part, error.what()};
    }
  }
  return {info.part, ""};
}

TEST(WorldInfo, LimitsUnfinishedParts) {
  EXPECT_EQ(taken(1024, 60'000), std::make_pair(1023, std::string()));
  const auto [many, too_many] = taken(32767, 100);
  EXPECT_EQ(many, 0);
  EXPECT_THAT(too_many, testing::StartsWith("ruedo/info has 32767 parts of "));
  const auto [large, too_large] = taken(100, 1 << 20);
  EXPECT_EQ(large, 64);
  EXPECT_THAT(too_large, testing::EndsWith("bytes so far: a client takes 1024 parts of 67108864 "
                                           "bytes together at most"));
}

}  // namespace
