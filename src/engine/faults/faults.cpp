// Faults as intervals of steps, looked up when something happens to their robot.
#include "engine/faults/faults.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "base/whole.h"
#include "engine/command_check.h"
#include "ruedo/math.h"

namespace ruedo::engine {
namespace {

constexpr size_t kMostFaults = 1000;          // at once; more are refused
constexpr size_t kMostLate = 65536;           // commands; more are lost
constexpr size_t kMostLateBytes = 32u << 20;  // likewise
constexpr double kMostSlip = 1e6;  // turns for one that moves anything, by many faults at once

bool same_name(const std::string& a, const std::string& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

SensorFault::Kind sensor_kind(const std::string& name) {
  using Kind = SensorFault::Kind;
  const std::pair<const char*, Kind> kinds[] = {
      {"freeze", Kind::freeze}, {"lag", Kind::lag},         {"bias", Kind::bias},
      {"scale", Kind::scale},   {"blocked", Kind::blocked}, {"clock_drift", Kind::clock_drift}};
  for (const auto& [known, kind] : kinds)
    if (name == known) return kind;
  return Kind::dropout;
}

}  // namespace

world::Fault fault_of(const fault_t& message) {
  world::Fault fault;
  fault.kind = message.kind;
  fault.target = message.target;
  fault.duration_s = message.duration;
  fault.value = message.value;
  fault.from = message.view_begin;
  fault.to = message.view_end;
  fault.x = message.x;
  fault.y = message.y;
  fault.heading = message.heading;
  return fault;
}

Faults::Faults(const world::WorldModel& world, const world::BodyLayout& layout,
               const std::vector<device_info_t>& devices, uint64_t seed)
    : world_(world), layout_(layout), devices_(devices), seed_(seed) {
  for (const world::Fault& fault : world.faults) {
    for (const RobotIndex robot : layout.robots.indices()) {
      if (name_of(robot) != fault.robot) continue;
      if (const std::string why = check(fault, robot); !why.empty())
        throw InputError(fault.source, "a fault of " + fault.robot + ": " + why);
      begin_at(fault, robot,
               rounded_up(fault.at_s * 1e6 / static_cast<double>(world.step_us) - 1e-6), false);
    }
  }
}

const std::string& Faults::name_of(RobotIndex robot) const {
  return world_->models[layout_->robots[robot].instance].name;
}

int64_t Faults::steps(double seconds) const {
  return std::max<int64_t>(1, rounded(seconds * 1e6 / static_cast<double>(world_->step_us)));
}

const device_info_t* Faults::find_device(RobotIndex robot, const std::string& name) const {
  for (const bool by_kind : {false, true}) {
    for (const device_info_t& device : *devices_) {
      if (device.robot == name_of(robot) && same_name(by_kind ? device.kind : device.name, name))
        return &device;
    }
  }
  return nullptr;
}

std::string Faults::check(const world::Fault& fault, RobotIndex robot) const {
  if (std::string why = world::check_fault(fault); !why.empty()) return why;
  if (of_robots_.size() + (of_sensors_ ? of_sensors_->size() : 0) +
          (reseedings_ ? reseedings_->size() : 0) >=
      kMostFaults)
    return fmt::format("there are {} faults already", kMostFaults);
  const world::FaultKind& kind = *world::find_fault_kind(fault.kind);
  if (kind.of == world::FaultKind::Of::device) {
    const device_info_t* device = find_device(robot, fault.target);
    const std::vector<std::string>& disabled = world_->disabled;
    if (!device && std::find(disabled.begin(), disabled.end(),
                             name_of(robot) + "/" + fault.target) != disabled.end())
      return "";
    if (!device) {
      std::vector<std::string> names;
      for (const device_info_t& one : *devices_)
        if (one.robot == name_of(robot)) names.push_back(one.name);
      return fmt::format("there is no device '{}' to be faulty; {} has {}", fault.target,
                         name_of(robot), fmt::join(names, ", "));
    }
    if (!applies_to(sensor_kind(fault.kind), device->kind))
      return fmt::format("{} is not a fault of {} {}", fault.kind,
                         device->kind.find_first_of("aeio") == 0 ? "an" : "a", device->kind);
  } else if (kind.of != world::FaultKind::Of::world &&
             !world_->models[layout_->robots[robot].instance].model->drive) {
    return fmt::format("{} is a fault of robots that drive", fault.kind);
  }
  return "";
}

void Faults::begin(const world::Fault& fault, RobotIndex robot, int64_t step) {
  forget_ended(step);
  if (const std::string why = check(fault, robot); !why.empty()) {
    spdlog::warn("{}/fault was ignored: {}", name_of(robot), why);
    return;
  }
  begin_at(fault, robot, step, true);
}

// A batch has one list for all of its steps, so that some that have ended are still needed.
void Faults::forget_ended(int64_t step) {
  const int64_t before = step - kMaxBatchSteps;  // no batch that is still computed begins there
  std::erase_if(of_robots_,
                [=](const RobotFault& fault) { return fault.done || fault.end <= step; });
  const auto is_over = [=](const SensorFault& fault) { return fault.end <= before; };
  if (of_sensors_ && std::any_of(of_sensors_->begin(), of_sensors_->end(), is_over)) {
    auto rest = std::make_shared<std::vector<SensorFault>>(*of_sensors_);
    std::erase_if(*rest, is_over);
    of_sensors_ = std::move(rest);
  }
  const Reseeding* first = reseedings_ ? reseeding_at(*reseedings_, before) : nullptr;
  if (first && first != reseedings_->data()) {
    const Reseeding* end = reseedings_->data() + reseedings_->size();
    reseedings_ = std::make_shared<const std::vector<Reseeding>>(first, end);
  }
}

void Faults::begin_at(const world::Fault& fault, RobotIndex robot, int64_t begin, bool message) {
  ever_ = true;
  const int64_t end = fault.duration_s > 0.0 ? begin + steps(fault.duration_s) : INT64_MAX;
  const world::FaultKind& kind = *world::find_fault_kind(fault.kind);
  if (kind.of == world::FaultKind::Of::device) {
    return begin_of_device(fault, robot, message ? begin + 1 : begin,
                           message && end != INT64_MAX ? end + 1 : end);
  }
  if (kind.of == world::FaultKind::Of::world)
    return begin_reseeding(static_cast<uint64_t>(fault.value), message ? begin + 1 : begin);
  const std::pair<const char*, Kind> kinds[] = {
      {"encoder_stuck", Kind::encoder_stuck}, {"wheel_slip", Kind::wheel_slip},
      {"weak_motor", Kind::weak_motor},       {"commands_lost", Kind::commands_lost},
      {"commands_late", Kind::commands_late}, {"commands_doubled", Kind::commands_doubled},
      {"kidnapped", Kind::kidnapped}};
  for (const auto& [name, robot_kind] : kinds) {
    if (fault.kind != name) continue;
    of_robots_.push_back({robot_kind, robot, fault.target != "right", fault.target != "left", begin,
                          end, steps(fault.value), fault.value, fault});
    wheels_ever_ |= robot_kind == Kind::encoder_stuck || robot_kind == Kind::wheel_slip;
  }
}

// A message acts after those of the same step.
void Faults::begin_reseeding(uint64_t seed, int64_t begin) {
  auto all = reseedings_ ? std::make_shared<std::vector<Reseeding>>(*reseedings_)
                         : std::make_shared<std::vector<Reseeding>>();
  const auto after =
      std::upper_bound(all->begin(), all->end(), begin,
                       [](int64_t step, const Reseeding& one) { return step < one.step; });
  all->insert(after, {begin, seed});
  reseedings_ = std::move(all);
}

std::optional<uint64_t> Faults::new_seed(int64_t step) {
  const Reseeding* now = reseedings_ ? reseeding_at(*reseedings_, step) : nullptr;
  if (!now || now->seed == seed_) return std::nullopt;
  return seed_ = now->seed;
}

void Faults::begin_of_device(const world::Fault& fault, RobotIndex robot, int64_t begin,
                             int64_t end) {
  const device_info_t* device = find_device(robot, fault.target);
  if (!device) return;  // it is switched off
  SensorFault made;
  made.id = ++sensor_faults_;
  made.kind = sensor_kind(fault.kind);
  made.robot = robot;
  made.device = device->name;
  made.begin = begin;
  made.end = end;
  made.lag_steps = steps(fault.value);
  made.value = fault.value;
  made.from = fault.from;
  made.to = fault.to;
  auto all = of_sensors_ ? std::make_shared<std::vector<SensorFault>>(*of_sensors_)
                         : std::make_shared<std::vector<SensorFault>>();
  all->push_back(std::move(made));
  of_sensors_ = std::move(all);
}

void Faults::before_commands(int64_t step, robot::Robots& robots) {
  while (!late_.empty() && late_.front().step <= step) {
    robots.apply(weakened(late_.front().command, step));
    late_bytes_ -= late_.front().bytes;
    late_.pop_front();
  }
  for (RobotFault& fault : of_robots_) {
    if (fault.kind != Kind::kidnapped || fault.done || step < fault.begin) continue;
    fault.done = true;
    const InstanceIndex instance = layout_->robots[fault.robot].instance;
    Pose X_WM = robots.model_pose(instance);
    X_WM.translation.x() = fault.asked.x;
    X_WM.translation.y() = fault.asked.y;
    X_WM.rotation =
        Quat(math::cos(0.5 * fault.asked.heading), 0.0, 0.0, math::sin(0.5 * fault.asked.heading));
    robots.set_pose(instance, X_WM);
  }
}

bool Faults::is_lost(RobotIndex robot, int64_t step) {
  bool lost = false;
  for (const RobotFault& fault : of_robots_) {
    if (fault.kind != Kind::commands_lost || !fault.acts(robot, step)) continue;
    draws_.resize(layout_->robots.size());
    lost |= RandomSource(seed_, name_of(robot), "commands_lost").stream(draws_[robot]++).uniform() <
            fault.value;
  }
  return lost;
}

void Faults::warn_of_impossible(const robot::Command& command) {
  const std::string why = check_possible(*world_, *layout_, command);
  if (why.empty() || !warned_.emplace(command.robot, command.what.index()).second) return;
  spdlog::warn("{}: a command was refused: {} (shown once)", name_of(command.robot), why);
}

void Faults::command(const robot::Command& command, size_t bytes, int64_t step,
                     robot::Robots& robots) {
  warn_of_impossible(command);
  if (of_robots_.empty() || std::holds_alternative<robot::ResetOdometry>(command.what))
    return robots.apply(command);
  if (is_lost(command.robot, step)) return;
  int64_t delay = 0;
  const auto later = [&](int64_t steps) {
    if (late_.size() >= kMostLate || late_bytes_ + bytes > kMostLateBytes) return;
    const auto after = std::upper_bound(late_.begin(), late_.end(), step + steps,
                                        [](int64_t at, const Late& one) { return at < one.step; });
    late_.insert(after, {step + steps, command, bytes});
    late_bytes_ += bytes;
  };
  for (const RobotFault& fault : of_robots_) {
    if (!fault.acts(command.robot, step)) continue;
    if (fault.kind == Kind::commands_late) delay += fault.delay_steps;
    if (fault.kind == Kind::commands_doubled) later(fault.delay_steps);
  }
  if (delay > 0) return later(delay);
  robots.apply(weakened(command, step));
}

double Faults::left_of(RobotIndex robot, bool left, int64_t step) const {
  double rest = 1.0;
  for (const RobotFault& fault : of_robots_) {
    if (!fault.acts(robot, step) || !(left ? fault.left : fault.right)) continue;
    if (fault.kind == Kind::weak_motor) rest *= fault.value;
    if (fault.kind == Kind::wheel_slip) rest *= 1.0 - fault.value;
  }
  return rest;
}

// A weak motor or a slipping wheel executes less than commanded. A primitive gets the limits of its
// slower side.
robot::Command Faults::weakened(robot::Command command, int64_t step) const {
  const double left = left_of(command.robot, true, step),
               right = left_of(command.robot, false, step), least = std::min(left, right);
  if (left == 1.0 && right == 1.0) return command;
  const world::DriveDescription& drive =
      *world_->models[layout_->robots[command.robot].instance].model->drive;
  if (auto* velocity = std::get_if<robot::VelocityCommand>(&command.what)) {
    const double half = 0.5 * drive.track;
    velocity->vy *= least;
    if (half > 0.0) {
      const double of_left = left * (velocity->vx - half * velocity->omega),
                   of_right = right * (velocity->vx + half * velocity->omega);
      velocity->vx = 0.5 * (of_left + of_right);
      velocity->omega = 0.5 * (of_right - of_left) / half;
    } else {
      velocity->vx *= least;
      velocity->omega *= least;
    }
  } else if (auto* wheels = std::get_if<robot::WheelCommand>(&command.what)) {
    for (size_t i = 0; i < wheels->rates.size(); ++i)
      wheels->rates[i] *= wheels->rates.size() == 2 ? (i == 0 ? left : right) : least;
  } else if (auto* move = std::get_if<robot::MoveCommand>(&command.what)) {
    move->share = least;
  }
  return command;
}

void Faults::show_wheels(Snapshot& snapshot) {
  if (!wheels_ever_) return;
  for (std::vector<double>* angles : {&true_angles_, &shown_angles_}) {  // others may have joined
    const auto known = static_cast<std::ptrdiff_t>(angles->size());
    angles->insert(angles->end(), snapshot.wheel_angles.begin() + known,
                   snapshot.wheel_angles.end());
  }
  for (size_t i = 0; i < snapshot.wheel_angles.size(); ++i) {
    const world::WheelPlacement& wheel = layout_->wheels[i];
    double factor = 1.0;
    for (const RobotFault& fault : of_robots_) {
      if (!fault.acts(wheel.robot, snapshot.step) || !(wheel.left ? fault.left : fault.right) ||
          wheel.steers)
        continue;
      if (fault.kind == Kind::encoder_stuck) factor = 0.0;
      if (fault.kind == Kind::wheel_slip)
        factor = std::min(factor / (1.0 - fault.value), kMostSlip);
    }
    shown_angles_[i] += factor * (snapshot.wheel_angles[i] - true_angles_[i]);
    true_angles_[i] = snapshot.wheel_angles[i];
    snapshot.wheel_angles[i] = shown_angles_[i];
    snapshot.wheel_rates[i] *= factor;
  }
}

void Faults::remove(RobotIndex robot) {
  std::erase_if(of_robots_, [&](const RobotFault& fault) { return fault.robot == robot; });
  std::erase_if(late_, [&](const Late& one) {
    if (one.command.robot != robot) return false;
    late_bytes_ -= one.bytes;
    return true;
  });
  // Another robot in its place has a fresh state, with wheels that have not turned.
  draws_.resize(layout_->robots.size());
  draws_[robot] = 0;
  std::erase_if(warned_, [&](const auto& one) { return one.first == robot; });
  for (size_t i = 0; i < shown_angles_.size(); ++i)
    if (layout_->wheels[i].robot == robot) true_angles_[i] = shown_angles_[i] = 0.0;
  if (!of_sensors_) return;
  auto rest = std::make_shared<std::vector<SensorFault>>(*of_sensors_);
  std::erase_if(*rest, [&](const SensorFault& fault) { return fault.robot == robot; });
  of_sensors_ = std::move(rest);
}

void Faults::reset_time() {
  of_robots_.clear();
  late_.clear();
  late_bytes_ = 0;
  of_sensors_.reset();
  if (!reseedings_) return;
  // The seed is kept, also for modules that have not reached it yet.
  reseedings_ = std::make_shared<const std::vector<Reseeding>>(1, Reseeding{0, seed_});
}

}  // namespace ruedo::engine
