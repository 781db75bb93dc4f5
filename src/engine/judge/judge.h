// What a regression or a case of a campaign expects of a run, held against the true state of every
// step; and how well the run went, in numbers.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "ruedo/odometry_t.hpp"
#include "ruedo/pose.h"
#include "ruedo/pose_t.hpp"
#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"

namespace ruedo::judge {

class JudgeHull;

struct Goal {
  double x = 0.0, y = 0.0, radius = 0.0;  // m, world: base_link within this circle
  double by_s = 0.0;                      // sim time
};
Goal parse_goal(const std::string& text);  // X,Y,RADIUS,BY; throws InputError

struct Expectations {
  std::string robot;  // its name; "": the first of the world
  std::vector<Goal> goals;
  bool no_contact = false;               // with anything but what its wheels stand on
  std::optional<double> clearance;       // m, at least, from the robot's hull to everything else
  std::optional<double> odometry_error;  // m, at most, between odometry and truth
  double clearance_reach =
      0.0;  // m: clearances below this are measured, whether or not one is asked for
};

struct Failure {
  std::string what;  // "goal 0", "contact", "clearance", "odometry"
  SimTime time = 0;
  std::string text;
};

std::string to_line(const Failure& failure);  // "12.500 s: p3at touched wall/link at ..."

// A number that says how well a run went: SI units, in the name's end.
struct Metric {
  std::string name;
  double value = 0.0;
};

class Judge {
 public:
  // Throws InputError when the world has no such robot. The world must outlive it.
  Judge(const world::WorldModel& world, Expectations expected);
  ~Judge();

  void see(const Snapshot& snapshot);
  // A message of the run, in its order: pose and odometry are compared.
  void see(const std::string& channel, std::span<const uint8_t> message);

  // After the run: what did not hold, the first of each kind, the earliest first.
  std::vector<Failure> failures();
  // After the run: time_s, x_m, y_m and path_m of the end; goal_distance_m, the smallest to the
  // last goal, and goal_time_s, when all were reached; contact_time_s of the first contact;
  // clearance_m and odometry_error_m where they were measured.
  std::vector<Metric> metrics() const;
  // Where base_link was every quarter of a second: s, m, m.
  struct Place {
    double time_s, x, y;
  };
  const std::vector<Place>& track() const { return track_; }

 private:
  void fail(const std::string& what, SimTime time, const std::string& text);
  void see_contacts(const Snapshot& snapshot);
  void see_clearance(const Snapshot& snapshot);
  void compare_odometry();
  std::string name_of(LinkIndex link) const;

  const world::WorldModel& world_;
  Expectations expected_;
  world::BodyLayout layout_;
  RobotIndex robot_;
  IndexedVector<LinkIndex, bool> own_, wheel_;
  std::unique_ptr<JudgeHull> hull_;
  std::vector<bool> reached_;
  double last_goal_distance_m_ = std::numeric_limits<double>::infinity();
  SimTime last_goal_ = -1, first_contact_ = -1;
  double smallest_clearance_m_ = std::numeric_limits<double>::infinity();
  SimTime seen_ = -1;
  Vec3 position_ = Vec3::Zero();
  double path_m_ = 0.0;
  std::vector<Place> track_;
  std::optional<pose_t> first_pose_, pose_;
  std::optional<odometry_t> odometry_;
  double odometry_error_m_ = -1.0;  // the largest so far; below 0: nothing was compared
  std::vector<Failure> failures_;   // the first of each kind
};

}  // namespace ruedo::judge
