// simulation_interfaces/msg/Result: the codes of all services, and what some services add.
#pragma once

#include <cstdint>
#include <string>

#include "ruedo/reply_t.hpp"

namespace ruedo::ros2 {

enum ResultCode : uint8_t {
  kUnsupported = 0,
  kOk = 1,
  kNotFound = 2,
  kIncorrectState = 3,
  kFailed = 4,
  // SetSimulationState
  kAlreadyThere = 101,
  kTransitionError = 102,
  kIncorrectTransition = 103,
  // SpawnEntity and SpawnEntities
  kNameNotUnique = 101,
  kNameInvalid = 102,
  kUnsupportedFormat = 103,
  kNoResource = 104,
  kNamespaceInvalid = 105,
  kParseError = 106,
  kMissingAssets = 107,
  kUnsupportedAssets = 108,
  kInvalidPose = 109,
  kSpawnFailed = 150,  // of at least one of several
  // SetEntityState
  kInvalidState = 101,
  // GetCurrentWorld
  kNoWorld = 101,
};

struct Result {
  uint8_t code = kOk;
  std::string text;
};

inline Result result_of(const reply_t& reply) {
  switch (reply.code) {
    case reply_t::OK: return {kOk, reply.text};
    case reply_t::UNKNOWN_NAME: return {kNotFound, reply.text};
    case reply_t::NOT_SUPPORTED: return {kUnsupported, reply.text};
    default: return {kFailed, reply.text};
  }
}

}  // namespace ruedo::ros2
