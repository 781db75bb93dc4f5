// No limit but that of --wait-for, and a line on the terminal when the run waits for long.
#include "run/live.h"

#include <limits>

#include <spdlog/spdlog.h>

namespace ruedo::run {
namespace {

constexpr auto kPatience = std::chrono::seconds(1);

}  // namespace

Live::Live(const std::vector<WaitForOption>& wait_for, int64_t step_us) : step_us_(step_us) {
  if (!wait_for.empty()) wait_for_ = std::make_unique<WaitFor>(wait_for, step_us);
}

void Live::begin(const Stage& stage, int64_t step) {
  gate_ = stage.gate;
  if (wait_for_) return wait_for_->attach(*stage.channels, *stage.inbox, *stage.gate, step);
  gate_->set_limit(std::numeric_limits<int64_t>::max());
}

bool Live::receive(const std::string& channel, const uint8_t* data, size_t size) {
  return wait_for_ && wait_for_->receive(channel, data, size);
}

Mode::Attended Live::attend(const std::vector<Session>&, int64_t step, Time now) {
  if (!wait_for_) return {};
  if (step != wait_step_ || gate_->paused()) {
    wait_step_ = step;
    wait_begin_ = now;
    told_ = false;
  }
  if (told_) return {};
  if (now < wait_begin_ + kPatience) return {wait_begin_ + kPatience, {}};
  const std::string missing = wait_for_->waits_for(step);
  if (missing.empty()) return {};
  told_ = true;
  spdlog::warn(
      "the run waits at step {} ({:g} s): --wait-for wants {}, and nothing came for a second. Does "
      "its sender run, and did it "
      "before this server started?",
      step, static_cast<double>(step * step_us_) * 1e-6, missing);
  return {};
}

}  // namespace ruedo::run
