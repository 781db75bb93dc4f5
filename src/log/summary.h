// The summary of a log: its channels with types, counts, sizes and times, its sources, and its
// damage.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ruedo/log_header_t.hpp"
#include "ruedo/sim_time.h"

namespace ruedo::log {

struct ChannelSummary {
  std::string name;
  int64_t fingerprint = 0;  // of its first message
  std::string type;         // "" where Ruedo has none with that fingerprint
  int64_t messages = 0;
  int64_t bytes = 0;  // of the messages, without the log's heads
  SimTime first_us = 0, last_us = 0;

  // Messages per second between the first and the last; 0: fewer than two, or at one time.
  double rate() const;
};

struct Summary {
  static constexpr size_t kMostChannels = 65'536;  // messages on others are only counted

  int64_t size = 0;                    // bytes of the file
  int64_t readable = 0;                // of them, up to where it is damaged or cut off
  std::string fault;                   // how; "" in a whole log
  std::optional<log_header_t> header;  // the first; none: not recorded by ruedo run
  SimTime begin_us = 0, end_us = 0;
  int64_t messages = 0;
  std::vector<ChannelSummary> channels;  // by name
};

// Whether a file begins as an LCM log does. False where it cannot be read.
bool is_log(const std::string& path);

// Reads the log once, in constant memory. Throws InputError if the file is not a log.
Summary summarize(const std::string& path);

}  // namespace ruedo::log
