// The faults of a world's robots and their times: from its file, and from messages on
// ROBOT/fault.
//
// For the simulation thread. Sensor faults travel with the batches to the modules
// (sensor_faults.h); faults of wheels and commands act here, on the commands of drives and on the
// wheel angles of encoders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "engine/batch.h"
#include "engine/faults/sensor_faults.h"
#include "robot/robots.h"
#include "ruedo/bound.h"
#include "ruedo/device_info_t.hpp"
#include "ruedo/fault_t.hpp"
#include "ruedo/random.h"
#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"
#include "world/model/fault.h"

namespace ruedo::engine {

// A message's fault, as from a file; the robot is the channel's.
world::Fault fault_of(const fault_t& message);

class Faults {
 public:
  // Takes the world's own faults. The arguments must outlive it. Throws InputError for a fault that
  // names no device of its robot.
  Faults(const world::WorldModel& world, const world::BodyLayout& layout,
         const std::vector<device_info_t>& devices, uint64_t seed);

  // The error in a fault of that robot, or "".
  std::string check(const world::Fault& fault, RobotIndex robot) const;
  // Acts on the state `step`: samples of later states show it. An invalid one changes nothing.
  void begin(const world::Fault& fault, RobotIndex robot, int64_t step);

  // Before the commands on the state `step`: delayed commands act, kidnapped robots are moved.
  void before_commands(int64_t step, robot::Robots& robots);
  // A command on the state `step`, as changed by faults. bytes: the size of its message. Warns,
  // once per robot and kind of command, of one that its robot can never execute.
  void command(const robot::Command& command, size_t bytes, int64_t step, robot::Robots& robots);
  // The wheel angles of a new state as encoders see them.
  void show_wheels(Snapshot& snapshot);
  // For the modules; null if there are none.
  const std::shared_ptr<const std::vector<SensorFault>>& of_sensors() const { return of_sensors_; }

  // The seed for draws from that state on, if it changes there.
  std::optional<uint64_t> new_seed(int64_t step);
  // For the modules; null if there are none.
  const std::shared_ptr<const std::vector<Reseeding>>& reseedings() const { return reseedings_; }

  // Whether no fault has ever acted, and no seed changed: then there is no state.
  bool none() const { return !ever_; }

  void remove(RobotIndex robot);
  void reset_time();  // steps count from 0: current faults end

 private:
  enum class Kind {
    encoder_stuck,
    wheel_slip,
    weak_motor,
    commands_lost,
    commands_late,
    commands_doubled,
    kidnapped
  };
  struct RobotFault {
    Kind kind;
    RobotIndex robot;
    bool left, right;    // which wheels
    int64_t begin, end;  // in steps
    int64_t delay_steps;
    double value;
    world::Fault asked;
    bool done = false;  // a kidnapped robot has been moved
    bool acts(int of_robot, int64_t step) const {
      return robot == of_robot && step >= begin && step < end;
    }
  };

  struct Late {
    int64_t step;  // on which it acts
    robot::Command command;
    size_t bytes;
  };

  int64_t steps(double seconds) const;
  void begin_at(const world::Fault& fault, RobotIndex robot, int64_t begin, bool message);
  void forget_ended(int64_t step);  // they make room for others
  void begin_reseeding(uint64_t seed, int64_t begin);
  void begin_of_device(const world::Fault& fault, RobotIndex robot, int64_t begin, int64_t end);
  const device_info_t* find_device(RobotIndex robot, const std::string& name) const;
  const std::string& name_of(RobotIndex robot) const;
  double left_of(RobotIndex robot, bool left,
                 int64_t step) const;  // applied to the commanded speed of a side
  robot::Command weakened(robot::Command command, int64_t step) const;
  bool is_lost(RobotIndex robot, int64_t step);
  void warn_of_impossible(const robot::Command& command);

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  Bound<const std::vector<device_info_t>> devices_;
  uint64_t seed_;  // currently in use
  std::shared_ptr<const std::vector<Reseeding>> reseedings_;
  std::shared_ptr<const std::vector<SensorFault>> of_sensors_;
  int64_t sensor_faults_ = 0;
  std::vector<RobotFault> of_robots_;
  std::deque<Late> late_;  // by step
  size_t late_bytes_ = 0;
  std::vector<uint64_t> draws_;                     // for each robot
  std::set<std::pair<int, size_t>> warned_;         // robots, and kinds of commands
  bool ever_ = false, wheels_ever_ = false;         // whether anything was faulty, and any wheel
  std::vector<double> true_angles_, shown_angles_;  // for each wheel, while encoders may be wrong
};

}  // namespace ruedo::engine
