// Sensors made outside of a server, for a picture of what they see at the start: a camera's own
// picture, the rays of laser scanners and the cones of sonars.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ruedo/device_info_t.hpp"
#include "ruedo/sensor.h"
#include "scene/pictures/render_scene.h"
#include "world/model/body_layout.h"

namespace ruedo::report {

struct LoneDevice {
  const SensorKind* kind = nullptr;
  std::unique_ptr<Sensor> sensor;
  device_info_t info{};
  std::vector<std::string> channels, types;  // by the index that it publishes with
  Pose X_WS;                                 // at the start
};

// The state of the world before the first step.
Snapshot initial_snapshot(const world::BodyLayout& layout);

// Robots' names and their devices of <sensor> elements that some kind serves: "ROBOT/DEVICE".
std::vector<std::string> device_names(const world::WorldModel& world,
                                      const world::BodyLayout& layout);

// Makes ROBOT/DEVICE; null for an unknown one.
std::unique_ptr<LoneDevice> make_lone_device(const world::WorldModel& world,
                                             const world::BodyLayout& layout,
                                             const std::string& name, bool noise);

// The rays and cones of all devices, up to what they hit.
std::vector<scene::Line> device_rays(const world::WorldModel& world,
                                     const world::BodyLayout& layout);

}  // namespace ruedo::report
