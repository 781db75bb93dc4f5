// What a regression expects of a run, held against the true state of every step.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "model/body_layout.h"
#include "ruedo/pose.h"
#include "ruedo/snapshot.h"

namespace ruedo::cli {

class JudgeHull;

struct Goal {
  double x = 0.0, y = 0.0, radius = 0.0;    // m, world: base_link within this circle
  double by_s = 0.0;                        // sim time
};
Goal parse_goal(const std::string& text);   // X,Y,RADIUS,BY; throws InputError

struct Expectations {
  std::string robot;                        // its name; "": the first of the world
  std::vector<Goal> goals;
  bool no_contact = false;                  // with anything but what its wheels stand on
  std::optional<double> clearance;          // m, at least, from the robot's hull to everything else
  std::optional<double> odometry_error;     // m, at most, between odometry and truth
};

class Judge {
 public:
  // Throws InputError when the world has no such robot. The world must outlive it.
  Judge(const model::WorldModel& world, Expectations expected);
  ~Judge();

  void see(const Snapshot& snapshot);
  // After the run; `record` is its log. One line for each expectation that did not hold, the earliest first.
  std::vector<std::string> failures(const std::string& record);

 private:
  void fail(const std::string& what, SimTime time, const std::string& text);
  void see_contacts(const Snapshot& snapshot);
  void check_odometry(const std::string& record);
  std::string name_of(int link) const;

  const model::WorldModel& world_;
  Expectations expected_;
  model::BodyLayout layout_;
  int robot_ = -1;                          // index into BodyLayout::robots
  std::vector<bool> own_, wheel_;           // of each link
  std::unique_ptr<JudgeHull> hull_;
  std::vector<bool> reached_;
  SimTime seen_ = -1;
  struct Failure {
    std::string what;
    SimTime time;
    std::string text;
  };
  std::vector<Failure> failures_;           // the first of each kind
};

}  // namespace ruedo::cli
