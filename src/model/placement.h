// Putting a model into a world by hand: on the ground, and not into something else.
#pragma once

#include <string>

#include "model/world_model.h"

namespace ruedo::model {

// The height of the ground at (x, y), metres: the highest static surface that lies at most 0.5 m above the lowest
// one there, so that ramps and steps count and tables, walls and roofs do not. 0 where there is nothing.
double ground_height(const WorldModel& world, double x, double y);

// The pose of a model at (x, y) with that yaw, its lowest collision point on the ground.
Pose standing_on(const WorldModel& world, const Model& model, double x, double y, double yaw);

// The name of a model of the world whose collisions the model would share space with, 2 cm of it from the ground up
// left out; "" when there is room. Meshes of the placed model count as their convex hulls.
std::string overlapped(const WorldModel& world, const Model& model, const Pose& X_WM);

}  // namespace ruedo::model
