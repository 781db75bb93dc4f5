// Limits the incomplete and the early samples that Cyclone DDS holds, over all
// writers.
//
// Cyclone's own limits are for each writer, of which any sender can make any number. So samples
// older than the last kMostHeld bytes that stayed with Cyclone are announced as dropped by their
// writer: Cyclone then drops incomplete ones and delivers those that waited for them. A writer
// whose samples come in order loses nothing by that.
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

// The samples in an RTPS message. Submessages of too many writers, or with impossible sequence
// numbers, are removed in place.
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
