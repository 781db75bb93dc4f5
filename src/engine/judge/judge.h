// Holds a run against what is expected of it: by the true state of every step, what the robot says
// of itself, and what acted on the run.
//
// The world may change meanwhile: the judge follows what comes and goes.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/judge/odometry_check.h"
#include "engine/judge/verdict.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/pose.h"
#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"

namespace ruedo::physics {
class Distances;
}

namespace ruedo::judge {

struct Goal {
  double x = 0.0, y = 0.0, radius = 0.0;  // m, world: base_link within this circle
  double by_s = 0.0;                      // sim time
};
Goal parse_goal(const std::string& text);  // X,Y,RADIUS,BY; throws InputError

struct Expectations {
  std::string robot;  // its name; "": the first of the world
  std::vector<Goal> goals;
  bool no_contact = false;  // with anything but what its wheels stand on
  // m, at least, from the robot's collision shapes to all that does not carry it; a touch fails
  std::optional<double> clearance;
  std::optional<double> odometry_error;  // m, at most, between odometry and truth
  double clearance_reach =
      0.0;  // m: clearances below this are measured, whether or not one is required
  bool allow_requests = false;  // the robot may be moved by a request of the program's

  bool any() const { return !goals.empty() || no_contact || clearance || odometry_error; }
};

class Judge {
 public:
  // Throws InputError when the world has no such robot.
  Judge(std::shared_ptr<const world::WorldModel> world, Expectations expected);
  ~Judge();

  // Models were added or removed, or the world was reset. The layout is that of the next states.
  void see_world(std::shared_ptr<const world::WorldModel> world, const world::BodyLayout& layout);

  void see(const Snapshot& snapshot);
  // A message of the run, on a channel by its own name. Only the odometry of the robot matters.
  void see(const std::string& channel, std::span<const uint8_t> message);
  // A command or a request that acted on the run.
  void see(const applied_t& applied);

  // After the run: the checks "run", "requests", "fall", and what was expected. Metrics: time_s,
  // x_m, y_m and path_m of the end; goal_distance_m, the smallest to the last goal, and
  // goal_time_s, when all were reached; contact_time_s of the first contact; clearance_m and
  // odometry_error_m where they were measured. The track has base_link every quarter of a second.
  Verdict verdict() const;

 private:
  void fail(const std::string& what, SimTime time, const std::string& text);
  void see_fall(SimTime time, const RobotState& robot);
  void see_goals(SimTime time, const Vec3& position);
  void see_contacts(const Snapshot& snapshot);
  void see_clearance(const Snapshot& snapshot);
  // A fault that a program has injected.
  void see_fault(const std::string& robot, const applied_t& applied);
  std::string name_of(LinkIndex link) const;

  void add_run(Verdict& verdict) const;
  void add_goals(Verdict& verdict) const;
  void add_kept(Verdict& verdict, const std::string& what, const std::string& evidence) const;
  void add_odometry(Verdict& verdict) const;
  std::vector<Metric> metrics() const;

  std::shared_ptr<const world::WorldModel> world_;
  Expectations expected_;
  std::optional<world::BodyLayout> layout_;
  RobotIndex robot_;  // none: it is not in the world now
  IndexedVector<LinkIndex, bool> own_;
  std::unique_ptr<physics::Distances> distances_;  // none: clearance is not measured
  int64_t steps_ = 0, judged_ = 0;  // of the run, and those with the robot in the world
  std::vector<std::optional<SimTime>> reached_;
  double last_goal_distance_m_ = std::numeric_limits<double>::infinity();
  SimTime first_contact_ = -1;
  double smallest_clearance_m_ = std::numeric_limits<double>::infinity();
  SimTime seen_ = -1;
  Vec3 position_ = Vec3::Zero();
  double path_m_ = 0.0;
  std::vector<Place> track_;
  OdometryCheck odometry_;
  std::vector<std::string> changes_;  // requests that changed the world
  std::vector<Check> failures_;       // the first of each kind
};

}  // namespace ruedo::judge
