// Commands from the bus to the robots: decoded with every length checked, kept in order of arrival.
#include "engine/command_inbox.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <span>
#include <tuple>
#include <variant>

#include <spdlog/spdlog.h>

#include "engine/faults/faults.h"
#include "engine/markers.h"
#include "ruedo/decode.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"

namespace ruedo::engine {

namespace {

template <class Message>
DecodeFault try_decoding(const uint8_t* data, size_t size) {
  Message message;
  return decode_checked(data, size, message);
}

// A fault's values are checked on arrival; whether its robot has that device, when it acts.
std::string check_fault_message(const uint8_t* data, size_t size, world::Fault& fault) {
  fault_t message;
  if (decode_checked(data, size, message) != DecodeFault::none) return "it is not a fault_t";
  fault = fault_of(message);
  return world::check_fault(fault);
}

}  // namespace

std::string check_values(Input::Kind kind, const uint8_t* data, size_t size) {
  if (kind == Input::Kind::fault) {
    world::Fault asked;
    return check_fault_message(data, size, asked);
  }
  markers_t markers;
  if (kind != Input::Kind::markers) return "";
  if (decode_checked(data, size, markers) != DecodeFault::none) return "it is not a markers_t";
  return check_markers(markers);
}

DecodeFault decode_command(Input::Kind kind, const uint8_t* data, size_t size,
                           robot::Command& command) {
  DecodeFault fault = DecodeFault::none;
  switch (kind) {
    case Input::Kind::velocity: {
      // Programs that only know bot_core's types send a velocity as pose_t.
      if (fingerprint_of({data, size}) == pose_t::getHash()) {
        pose_t pose;
        fault = decode_checked(data, size, pose);
        if (fault == DecodeFault::none)
          command.what = robot::VelocityCommand{pose.vel[0], pose.vel[1], pose.rotation_rate[2]};
        break;
      }
      velocity_command_t message;
      fault = decode_checked(data, size, message);
      if (fault == DecodeFault::none)
        command.what = robot::VelocityCommand{message.vx, message.vy, message.omega};
      break;
    }
    case Input::Kind::wheels: {
      wheel_command_t message;
      fault = decode_checked(data, size, message);
      if (fault == DecodeFault::none) command.what = robot::WheelCommand{std::move(message.rate)};
      break;
    }
    case Input::Kind::move: {
      move_command_t message;
      fault = decode_checked(data, size, message);
      if (fault == DecodeFault::none) {
        command.what = robot::MoveCommand{message.id,          message.kind,  message.value,
                                          message.radius,      message.speed, message.acceleration,
                                          message.deceleration};
      }
      break;
    }
    case Input::Kind::joints: {
      joint_command_t message;
      fault = decode_checked(data, size, message);
      if (fault == DecodeFault::none) {
        command.what = robot::JointCommand{std::move(message.name),
                                           {message.mode.begin(), message.mode.end()},
                                           std::move(message.value)};
      }
      break;
    }
    // Not commands to a robot: apply() takes the bytes.
    case Input::Kind::fault: return try_decoding<fault_t>(data, size);
    case Input::Kind::markers: return try_decoding<markers_t>(data, size);
    case Input::Kind::reset_odometry: {
      name_request_t message;
      fault = decode_checked(data, size, message);
      if (fault == DecodeFault::none) command.what = robot::ResetOdometry{};
      break;
    }
  }
  return fault;
}

bool is_finite(const robot::Command& command) {
  const auto all = [](std::span<const double> values) {
    return std::all_of(values.begin(), values.end(),
                       [](double value) { return std::isfinite(value); });
  };
  struct Values {
    decltype(all)& finite;
    bool operator()(const robot::VelocityCommand& c) const {
      return finite({{c.vx, c.vy, c.omega}});
    }
    bool operator()(const robot::WheelCommand& c) const { return finite(c.rates); }
    bool operator()(const robot::MoveCommand& c) const {
      return finite({{c.value, c.radius, c.speed, c.acceleration, c.deceleration}});
    }
    bool operator()(const robot::JointCommand& c) const { return finite(c.values); }
    bool operator()(const robot::ResetOdometry&) const { return true; }
  };
  return std::visit(Values{all}, command.what);
}

CommandInbox::CommandInbox(std::vector<Input> inputs, int robots)
    : inputs_(std::move(inputs)), reset_input_(static_cast<size_t>(robots)) {
  waits_.slots.resize(static_cast<size_t>(robots));
  for (const InputIndex input : inputs_.indices()) listen(input);
  waits_.robots.reserve(waits_.slots.size() + 1);
}

void CommandInbox::listen(InputIndex index) {
  const Input& input = inputs_[index];
  if (input.kind == Input::Kind::reset_odometry) {
    reset_input_[input.robot] = index;
  } else {
    by_channel_.insert_or_assign(input.channel, index);
  }
}

void CommandInbox::add(const std::vector<Input>& inputs, int robots) {
  std::lock_guard lock(mutex_);
  reset_input_.resize(static_cast<size_t>(robots));
  waits_.slots.resize(static_cast<size_t>(robots));
  for (const Input& input : inputs) {
    // A robot that takes the place of a removed one has the same inputs.
    auto at = std::find_if(inputs_.begin(), inputs_.end(), [&](const Input& old) {
      return old.robot == input.robot && old.kind == input.kind;
    });
    if (at == inputs_.end()) at = inputs_.insert(at, input);
    at->channel = input.channel;
    listen(InputIndex(at - inputs_.begin()));
  }
}

void CommandInbox::remove(RobotIndex robot) {
  std::lock_guard lock(mutex_);
  for (Input& input : inputs_) {
    if (input.robot != robot) continue;
    by_channel_.erase(input.channel);
    input.channel.clear();
  }
  waits_.slots[robot].size = 0;
  std::erase(waits_.robots, robot);
  const auto is_of = [robot](const Entry& entry) { return entry.command.robot == robot; };
  const auto end = waits_.scheduled.begin() + static_cast<std::ptrdiff_t>(waits_.scheduled_count);
  const auto kept = std::stable_partition(waits_.scheduled.begin(), end,
                                          [&](const Entry& entry) { return !is_of(entry); });
  for (auto entry = kept; entry != end; ++entry) waits_.scheduled_bytes -= entry->bytes.size();
  waits_.scheduled_count = static_cast<size_t>(kept - waits_.scheduled.begin());
  std::make_heap(waits_.scheduled.begin(), kept, later);
}

void CommandInbox::reset_time() {
  std::lock_guard lock(mutex_);
  waits_.scheduled_count = waits_.scheduled_bytes = 0;
  waits_.next_step = 0;
  for (Slots& slots : waits_.slots) slots.primitives.clear();
}

void CommandInbox::put(const std::string& channel, const uint8_t* data, size_t size) {
  const auto found = by_channel_.find(channel);
  if (found == by_channel_.end()) return;
  if (size > kMaxMessageSize) return refuse(channel, "more than 64 kB");
  const Input& input = inputs_[found->second];
  robot::Command command;
  command.robot = input.robot;
  const DecodeFault fault = decode_command(input.kind, data, size, command);
  if (fault != DecodeFault::none) return refuse(channel, describe(fault));
  if (const std::string why = check_values(input.kind, data, size); !why.empty())
    return refuse(channel, why.c_str());
  if (!is_repeated(command, data, size)) keep(found->second, command, data, size);
}

// Clients send a primitive until a status shows it, since messages may be lost; and a network may
// double them, and exchange two.
bool CommandInbox::is_repeated(const robot::Command& command, const uint8_t* data, size_t size) {
  const auto* move = std::get_if<robot::MoveCommand>(&command.what);
  if (!move || move->id == 0) return false;
  const std::lock_guard lock(mutex_);
  auto& known = slots_of(command.robot).primitives;
  const std::vector<uint8_t> bytes(data, data + size);
  if (std::find(known.begin(), known.end(), bytes) != known.end()) return true;
  known.push_back(bytes);
  if (known.size() > kKnownPrimitives) known.pop_front();
  return false;
}

void CommandInbox::reset_odometry(RobotIndex robot, const std::vector<uint8_t>& body) {
  robot::Command command{robot, robot::ResetOdometry{}};
  keep(reset_input_[robot], command, body.data(), body.size());
}

CommandInbox::Entry& CommandInbox::next_entry(RobotIndex robot) {
  Slots& slots = slots_of(robot);
  const size_t most = slots.most;
  slots.entries.resize(most);
  if (slots.size == 0) waits_.robots.push_back(robot);
  if (slots.size == most) {
    slots.first = (slots.first + 1) % most;
    --slots.size;
    ++displaced_;
  }
  return slots.entries[(slots.first + slots.size++) % most];
}

void CommandInbox::keep(InputIndex input, robot::Command& command, const uint8_t* data,
                        size_t size) {
  std::lock_guard lock(mutex_);
  Entry& entry = next_entry(command.robot);
  entry.arrival = waits_.arrivals++;
  entry.input = input;
  std::swap(entry.command, command);
  entry.bytes.assign(data, data + size);
}

bool CommandInbox::later(const Entry& a, const Entry& b) {
  return std::tie(a.step, a.arrival) > std::tie(b.step, b.arrival);
}

CommandInbox::Scheduled CommandInbox::schedule(int64_t step, InputIndex input, const uint8_t* data,
                                               size_t size) {
  if (!inputs_.has(input) || size > kMaxMessageSize) return Scheduled::faulty;
  robot::Command command;
  command.robot = inputs_[input].robot;
  if (decode_command(inputs_[input].kind, data, size, command) != DecodeFault::none)
    return Scheduled::faulty;
  if (!check_values(inputs_[input].kind, data, size).empty()) return Scheduled::faulty;
  std::lock_guard lock(mutex_);
  if (step < waits_.next_step) return Scheduled::late;
  if (waits_.scheduled_count == kMostScheduled ||
      waits_.scheduled_bytes + size > kMostScheduledBytes)
    return Scheduled::full;
  if (waits_.scheduled_count == waits_.scheduled.size()) waits_.scheduled.emplace_back();
  Entry& entry = waits_.scheduled[waits_.scheduled_count++];
  entry.step = step;
  entry.arrival = waits_.arrivals++;
  entry.input = input;
  std::swap(entry.command, command);
  entry.bytes.assign(data, data + size);
  waits_.scheduled_bytes += size;
  std::push_heap(waits_.scheduled.begin(),
                 waits_.scheduled.begin() + static_cast<std::ptrdiff_t>(waits_.scheduled_count),
                 later);
  return Scheduled::kept;
}

void CommandInbox::refuse(const std::string& channel, const char* why) {
  ++refused_;
  const int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch().count();
  if (last_warning_ns_ != 0 && now_ns - last_warning_ns_ < 1'000'000'000) return;
  last_warning_ns_ = now_ns;
  spdlog::warn("{}: a message was ignored: {} ({} ignored so far)", channel, why, refused_.load());
}

CommandInbox::Entry& CommandInbox::next_taken(size_t& count) {
  if (count == taken_.size()) taken_.emplace_back();
  return taken_[count++];
}

void CommandInbox::apply(robot::Robots& robots, Faults& faults, int64_t step, Batch& batch) {
  size_t scheduled = 0, count = 0;
  {
    std::lock_guard lock(mutex_);
    waits_.next_step = step + 1;
    // Buffers are swapped, never copied; those taken are replaced by empty ones.
    for (; waits_.scheduled_count > 0 && waits_.scheduled.front().step <= step; ++scheduled) {
      std::pop_heap(waits_.scheduled.begin(),
                    waits_.scheduled.begin() + static_cast<std::ptrdiff_t>(waits_.scheduled_count),
                    later);
      Entry& entry = waits_.scheduled[--waits_.scheduled_count];
      waits_.scheduled_bytes -= entry.bytes.size();
      std::swap(next_taken(count), entry);
    }
    for (const RobotIndex robot : waits_.robots) {
      Slots& slots = slots_of(robot);
      for (size_t i = 0; i < slots.size; ++i)
        std::swap(next_taken(count), slots.entries[(slots.first + i) % slots.entries.size()]);
      slots.size = 0;
    }
    waits_.robots.clear();
  }
  std::sort(taken_.begin() + static_cast<std::ptrdiff_t>(scheduled),
            taken_.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Entry& a, const Entry& b) { return a.arrival < b.arrival; });
  for (size_t i = 0; i < count; ++i) {
    const Input::Kind kind = inputs_[taken_[i].input].kind;
    if (kind == Input::Kind::fault) {
      world::Fault fault;
      if (check_fault_message(taken_[i].bytes.data(), taken_[i].bytes.size(), fault).empty())
        faults.begin(fault, taken_[i].command.robot, step);
    } else if (kind != Input::Kind::markers) {
      faults.command(taken_[i].command, taken_[i].bytes.size(), step, robots);
    }
    if (static_cast<size_t>(batch.applied_count) == batch.applied.size())
      batch.applied.emplace_back();
    AppliedCommand& applied = batch.applied[batch.applied_count++];
    applied.step = step;
    applied.input = taken_[i].input;
    std::swap(applied.bytes, taken_[i].bytes);
  }
}

void CommandInbox::clear() {
  std::lock_guard lock(mutex_);
  for (Slots& slots : waits_.slots) slots.size = 0;
  waits_.world_slots.size = 0;
  waits_.robots.clear();
  waits_.scheduled_count = waits_.scheduled_bytes = 0;
}

}  // namespace ruedo::engine
