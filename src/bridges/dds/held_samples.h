// Bounds what Cyclone DDS holds of samples that are not whole, or whose turn has not come, over all
// writers.
//
// Cyclone's own limits are for each writer, of which strangers can make any number. So whose
// samples are older than the last kMostHeld bytes that stayed with Cyclone is told to have been
// dropped by its writer: Cyclone then drops what is not whole and hands over what waited for it. A
// writer whose samples come in order has nothing to lose by that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bridges/ros2/transport.h"

namespace ruedo::dds {

// A writer's samples up to that sequence number.
struct Samples {
  ros2::Gid writer;
  int64_t last;
};

inline constexpr size_t kMostHeld = size_t{128} << 20;  // bytes
// Writers whose samples may be in one datagram. Samples of other writers are requested again.
inline constexpr size_t kMostWritersInDatagram = 16;

// Those in an RTPS message. What is of too many writers, or has no possible sequence number,
// becomes nothing, in place.
std::vector<Samples> samples_in(std::span<uint8_t> message);

// The RTPS message by which a writer says that it has dropped them: a heartbeat. Returns its size.
size_t write_dropped(const Samples& samples, std::span<uint8_t> out);

class HeldSamples {
 public:
  // A datagram with samples of these writers has taken so many bytes that Cyclone may hold.
  void add(size_t bytes, std::span<const Samples> samples);

  // Whose samples have been held for long enough: in turn, until there is room again.
  std::optional<Samples> overdue();

 private:
  struct Share {
    size_t bytes = 0;
    std::map<ros2::Gid, int64_t> last_of;
  };

  std::deque<Share> shares_;  // in the order in which they came
  size_t bytes_ = 0;
};

}  // namespace ruedo::dds
