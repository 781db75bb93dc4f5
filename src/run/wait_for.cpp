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
namespace {

// The input of a channel, by its own name or the one on the bus; none if it is not an input now.
engine::InputIndex find_input(const std::string& name, const engine::Channels& channels,
                              const engine::CommandInbox& inbox) {
  for (const engine::Channel& channel : channels.list()) {
    if (channel.gone || channel.robot.empty()) continue;
    if (name != channel.name && name != channel.bus_name) continue;
    for (const engine::InputIndex i : inbox.inputs().indices())
      if (inbox.inputs()[i].channel == channel.bus_name) return i;
  }
  return {};
}

}  // namespace

WaitFor::WaitFor(std::vector<WaitForOption> options, int64_t step_us) {
  for (WaitForOption& option : options) {
    const SampleClock clock(option.rate, step_us);
    waited_.push_back({std::move(option), clock, {}, {}, 0, false});
  }
}

void WaitFor::attach(const engine::Channels& channels, engine::CommandInbox& inbox, Gate& gate,
                     int64_t step) {
  if (!inbox_) check(channels, inbox);
  inbox_ = &inbox;
  gate_ = &gate;
  for (Waited& waited : waited_)
    begin(waited, find_input(waited.option.channel, channels, inbox), step);
  limit();
}

// Later a robot may be gone; at the start the option is wrong.
void WaitFor::check(const engine::Channels& channels, const engine::CommandInbox& inbox) const {
  std::vector<std::string> names;
  for (const engine::Channel& channel : channels.list())
    if (channel.input && !channel.gone && !channel.robot.empty()) names.push_back(channel.name);
  for (const Waited& waited : waited_) {
    if (find_input(waited.option.channel, channels, inbox).valid()) continue;
    const std::string near = nearest_word(waited.option.channel, names);
    throw InputError({}, "--wait-for: there is no input channel '" + waited.option.channel + "'" +
                             (near.empty() ? "" : "; did you mean '" + near + "'?"));
  }
}

void WaitFor::models_changed(const engine::Channels& channels, int64_t step) {
  for (Waited& waited : waited_) {
    const engine::InputIndex input = find_input(waited.option.channel, channels, *inbox_);
    if (input != waited.input) begin(waited, input, step);
  }
  limit();
}

void WaitFor::begin(Waited& waited, engine::InputIndex input, int64_t step) {
  if (waited.input.valid() && !input.valid()) {
    spdlog::info(
        "{}: its robot was removed: the run does not wait until a robot of that name appears",
        waited.channel);
  }
  waited.input = input;
  if (input.valid()) waited.channel = inbox_->inputs()[input].channel;
  waited.next = waited.clock.samples_before(std::max<int64_t>(step, 0));
}

bool WaitFor::on_message(const std::string& channel, const uint8_t* data, size_t size) {
  const auto waited = std::find_if(waited_.begin(), waited_.end(), [&](const Waited& w) {
    return w.input.valid() && w.channel == channel;
  });
  if (waited == waited_.end()) return false;
  if (waited->next - waited->clock.samples_before(inbox_->next_step()) >= kMostAhead) {
    if (!waited->told) {
      spdlog::warn(
          "{}: its messages arrive faster than the {:g} Hz of --wait-for; the surplus is ignored, "
          "and the run cannot be repeated (shown once)",
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
  for (const Waited& waited : waited_)
    if (waited.input.valid()) last = std::min(last, waited.clock.step_of(waited.next));
  gate_->set_limit(last);
}

std::string WaitFor::waits_for(int64_t step) const {
  std::string text;
  for (const Waited& waited : waited_) {
    if (!waited.input.valid() || waited.clock.step_of(waited.next) > step) continue;
    text +=
        fmt::format("{}message {} on {}", text.empty() ? "" : ", ", waited.next, waited.channel);
  }
  return text;
}

}  // namespace ruedo::run
