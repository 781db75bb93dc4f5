// ruedo/tick: the beat of the simulation, with the list of a step's sensor messages.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "engine/channels.h"
#include "ruedo/tick_t.hpp"

namespace ruedo::run {

// Collects a step's messages and cuts the tick into parts.
class TickWriter {
 public:
  void begin(int64_t utime, int64_t run_id, int32_t epoch, int64_t step);
  void add_applied(const std::string& client, int64_t sequence);
  void add_message(engine::ChannelIndex channel, int64_t sequence, const uint8_t* data,
                   size_t size);

  // Calls publish for each part.
  void finish(int64_t state_hash, const std::function<void(const tick_t&)>& publish);

 private:
  tick_t head_, part_;
  std::vector<tick_applied_t> applied_;
  std::vector<tick_message_t> manifest_;
};

}  // namespace ruedo::run
