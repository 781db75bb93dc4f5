// <ruedo:crowd> in <world>: people who walk to goals on their own. This has the file's values; the
// walking is in robot/crowd.h.
#pragma once

#include <string>
#include <vector>

#include "world/maps/floor_plan.h"
#include "world/model/world_model.h"

namespace ruedo::world {

struct CrowdDescription {
  enum class AtEnd { loop, stop, again };
  std::string name;
  int count = 1;
  Rect area;                // where they start
  std::vector<Rect> goals;  // visited in order; empty: places in the area, drawn for each person
  AtEnd at_end = AtEnd::loop;
  // m/s, preferred walking speed: mean and standard deviation
  double speed = 1.34, speed_deviation = 0.26;
  double radius = 0.25, height = 1.7;  // m
  double fluctuation = 0.1;            // m/s^2
  bool avoids_robots = true;
  Source source;
};

// Throws InputError.
CrowdDescription read_crowd(const Element& element);

// A person's link: a cylinder that walks and that nothing can push.
Link person_link(double radius_m, double height_m, const Source& source);

// The static obstacles for people on a floor at that height.
FloorPlan walls_for(const WorldModel& world, const CrowdDescription& crowd, double floor_m);

// Adds them to the world as NAME_1, NAME_2, ... on the floor of their area, where there is room.
// Throws InputError if there is not.
void add_crowd(const Element& element, WorldModel& world, size_t most_models);

// The start places of a crowd's people for a seed, with the necessary distance to each other, to
// walls and to the circles in `taken`. Throws InputError if they do not fit.
struct Circle {
  Eigen::Vector2d at;
  double radius;
};
std::vector<Eigen::Vector2d> places_of(const CrowdDescription& crowd, const FloorPlan& walls,
                                       const std::vector<Circle>& taken, uint64_t seed);

}  // namespace ruedo::world
