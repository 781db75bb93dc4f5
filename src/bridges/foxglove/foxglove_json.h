// Parts of Foxglove's types as JSON, and the types that take a page to write.
#pragma once

#include <cstdint>
#include <string>

#include "base/json.h"
#include "ruedo/markers_t.hpp"
#include "ruedo/pose.h"

namespace ruedo::foxglove {

void write_time(JsonWriter& json, const char* name, uint64_t time_ns);
void write_xyz(JsonWriter& json, const char* name, double x, double y, double z);
void write_rotation(JsonWriter& json, const char* name, double w, double x, double y, double z);
void write_pose(JsonWriter& json, const Pose& X);
// Values without a name.
void write_point(JsonWriter& json, const Vec3& at);
void write_color(JsonWriter& json, const float* rgba);

// foxglove.SceneUpdate: an entity by the layer's name, in the robot's frame or the world's; or its
// deletion.
std::string markers_json(const markers_t& markers, uint64_t time_ns);

}  // namespace ruedo::foxglove
