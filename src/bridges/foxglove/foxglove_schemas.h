// Foxglove's message types that a log is exported to, as JSON Schemas with the names by which
// Foxglove knows them.
#pragma once

#include <string>

namespace ruedo::foxglove {

struct Type {
  std::string name;    // "foxglove.LaserScan"
  std::string schema;  // JSON Schema
};

const Type& laser_scan();
const Type& compressed_image();
const Type& raw_image();
const Type& camera_calibration();
const Type& pose_in_frame();
const Type& location_fix();
const Type& frame_transforms();
const Type& scene_update();

}  // namespace ruedo::foxglove
