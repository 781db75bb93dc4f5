// Messages from the network: what decodes encodes to the same bytes again, and no bytes do harm.
// The fingerprint is filled in, so that every input reaches the decoders.
#include <cstdlib>
#include <cstring>
#include <vector>

#include "budget.h"
#include "ruedo/decode.h"
#include "ruedo/grant_request_t.hpp"
#include "ruedo/join_t.hpp"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/log_header_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/rate_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/resend_request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"
#include "ruedo/step_request_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"
#include "ruedo/world_info_t.hpp"

namespace {

template <class Message>
void try_as(std::vector<uint8_t> bytes) {
  const uint64_t fingerprint = static_cast<uint64_t>(Message::getHash());
  for (size_t i = 0; i < 8; ++i) bytes[i] = static_cast<uint8_t>(fingerprint >> (56 - 8 * i));
  Message message;
  if (ruedo::decode_checked(bytes.data(), bytes.size(), message) != ruedo::DecodeFault::none)
    return;
  std::vector<uint8_t> again(static_cast<size_t>(message.getEncodedSize()));
  if (again.size() != bytes.size()) std::abort();
  message.encode(again.data(), 0, static_cast<int>(again.size()));
  if (std::memcmp(again.data(), bytes.data(), bytes.size()) != 0) std::abort();
}

template <class... Messages>
void try_one(size_t which, const std::vector<uint8_t>& bytes) {
  using Try = void (*)(std::vector<uint8_t>);
  constexpr Try kAll[] = {try_as<Messages>...};
  kAll[which % sizeof...(Messages)](bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 9) return 0;
  const Budget budget;
  using namespace ruedo;
  try_one<velocity_command_t, wheel_command_t, move_command_t, joint_command_t, request_t, join_t,
          name_request_t, rate_request_t, reset_request_t, set_pose_request_t, set_twist_request_t,
          spawn_request_t, step_request_t, grant_request_t, resend_request_t, log_header_t,
          world_info_t>(data[0], {data + 1, data + size});
  return 0;
}
