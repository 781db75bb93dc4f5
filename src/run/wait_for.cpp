// Each message is given the step at which it acts as it comes, and the slowest channel sets the
// pacer's limit.
#include "run/wait_for.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "ruedo/element.h"
#include "ruedo/errors.h"

namespace ruedo::run {

WaitFor::WaitFor(std::vector<WaitForOption> options, int64_t step_us) {
  for (WaitForOption& option : options) {
    const SampleClock clock(option.rate, step_us);
    waited_.push_back({std::move(option), clock, {}, {}, 0, false});
  }
}

void WaitFor::attach(const engine::Channels& channels, engine::CommandInbox& inbox, Gate& gate,
                     int64_t step) {
  inbox_ = &inbox;
  gate_ = &gate;
  for (Waited& waited : waited_) {
    std::vector<std::string> names;
    waited.channel.clear();
    for (const engine::Channel& channel : channels.list()) {
      if (!channel.input || channel.robot.empty()) continue;
      names.push_back(channel.name);
      if (waited.option.channel == channel.name || waited.option.channel == channel.bus_name)
        waited.channel = channel.bus_name;
    }
    const auto& inputs = inbox.inputs();
    const auto found = std::find_if(inputs.begin(), inputs.end(), [&](const engine::Input& input) {
      return input.kind != engine::Input::Kind::reset_odometry && input.channel == waited.channel;
    });
    if (waited.channel.empty() || found == inputs.end()) {
      const std::string near = nearest_word(waited.option.channel, names);
      throw InputError({}, "--wait-for: there is no input channel '" + waited.option.channel + "'" +
                               (near.empty() ? "" : "; did you mean '" + near + "'?"));
    }
    waited.input = engine::InputIndex(found - inputs.begin());
    waited.next = waited.clock.samples_before(std::max<int64_t>(step, 0));
  }
  limit();
}

bool WaitFor::receive(const std::string& channel, const uint8_t* data, size_t size) {
  const auto waited = std::find_if(waited_.begin(), waited_.end(),
                                   [&](const Waited& w) { return w.channel == channel; });
  if (waited == waited_.end()) return false;
  if (!inbox_) return true;
  if (waited->next - waited->clock.samples_before(inbox_->next_step()) >= kMostAhead) {
    if (!waited->told) {
      spdlog::warn(
          "{}: its messages come faster than the {:g} Hz of --wait-for; those that find no room "
          "are ignored, and the run "
          "cannot be repeated that way (this is said once)",
          channel, waited->option.rate.hz());
    }
    waited->told = true;
    return true;
  }
  if (inbox_->schedule(waited->clock.step_of(waited->next), waited->input, data, size) ==
      engine::CommandInbox::Scheduled::kept) {
    ++waited->next;
    limit();
    return true;
  }
  return false;  // a faulty one: the inbox counts it
}

void WaitFor::limit() {
  int64_t last = std::numeric_limits<int64_t>::max();
  for (const Waited& waited : waited_) last = std::min(last, waited.clock.step_of(waited.next));
  gate_->set_limit(last);
}

std::string WaitFor::waits_for(int64_t step) const {
  std::string text;
  for (const Waited& waited : waited_) {
    if (waited.clock.step_of(waited.next) > step) continue;
    text +=
        fmt::format("{}message {} on {}", text.empty() ? "" : ", ", waited.next, waited.channel);
  }
  return text;
}

}  // namespace ruedo::run
