// No limit but that of --wait-for.
#include "run/live.h"

#include <limits>

namespace ruedo::run {
Live::Live(const std::vector<WaitForOption>& wait_for, int64_t step_us) {
  if (!wait_for.empty()) wait_for_ = std::make_unique<WaitFor>(wait_for, step_us);
}

void Live::begin(const Stage& stage, int64_t step) {
  if (wait_for_) return wait_for_->attach(*stage.channels, *stage.inbox, *stage.gate, step);
  stage.gate->set_limit(std::numeric_limits<int64_t>::max());
}

void Live::models_changed(const Stage& stage, int64_t step) {
  if (wait_for_) wait_for_->models_changed(*stage.channels, step);
}

bool Live::on_message(const std::string& channel, const uint8_t* data, size_t size) {
  return wait_for_ && wait_for_->on_message(channel, data, size);
}

std::string Live::waits_for(int64_t step) const {
  const std::string missing = wait_for_ ? wait_for_->waits_for(step) : "";
  if (missing.empty()) return "";
  return "the input of --wait-for, " + missing +
         ". Does its sender run, and did it before this server started?";
}

}  // namespace ruedo::run
