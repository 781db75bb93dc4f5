// <ruedo:crowd> in <world>: people who walk to goals, of their own accord. What the file says; how
// they walk is robot/crowd.h.
#pragma once

#include <string>
#include <vector>

#include "model/floor_plan.h"
#include "model/world_model.h"

namespace ruedo::model {

struct CrowdDescription {
  enum class AtEnd { loop, stop, again };
  std::string name;
  int count = 1;
  Rect area;                // where they are at the start
  std::vector<Rect> goals;  // one after another; empty: places of the area, drawn for each person
  AtEnd at_end = AtEnd::loop;
  double speed = 1.34, speed_deviation = 0.26;  // m/s, that they like to walk at
  double radius = 0.25, height = 1.7;           // m
  double fluctuation = 0.1;                     // m/s^2
  bool avoids_robots = true;
  Source source;
};

// Throws InputError.
CrowdDescription read_crowd(const Element& element);

// A link of a person: a cylinder that walks and is pushed by nothing.
Link person_link(double radius_m, double height_m, const Source& source);

// What of the world stands still and is in people's way, on the floor at that height.
FloorPlan walls_for(const WorldModel& world, const CrowdDescription& crowd, double floor_m);

// Adds them to the world: NAME_1, NAME_2, ... on the floor of their area, where they have room.
// Throws InputError where there is no room.
void add_crowd(const Element& element, WorldModel& world, size_t most_models);

// The places of a crowd's people for a seed, none nearer to another, to a wall or to a circle in
// `taken` than there is room. Throws InputError when they do not fit.
struct Circle {
  Eigen::Vector2d at;
  double radius;
};
std::vector<Eigen::Vector2d> places_of(const CrowdDescription& crowd, const FloorPlan& walls,
                                       std::vector<Circle> taken, uint64_t seed);

}  // namespace ruedo::model
