#include "report/render_devices.h"

#include <algorithm>
#include <cmath>

#include "ruedo/lidar_t.hpp"
#include "ruedo/math.h"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/sonar_t.hpp"
#include "scene/rays/ray_scene.h"

namespace ruedo::report {
namespace {

using Colour = std::array<float, 4>;
constexpr Colour kLaser{0.90f, 0.16f, 0.10f, 0.55f}, kLaserOpen{0.90f, 0.16f, 0.10f, 0.16f};
constexpr Colour kSonar{0.06f, 0.36f, 0.85f, 0.85f}, kSonarOpen{0.06f, 0.36f, 0.85f, 0.35f};
constexpr size_t kMaxRaysDrawn = 2000;  // of one device
constexpr int kArcSegments = 8;

Vec3 direction(double azimuth, double elevation) {
  return {math::cos(elevation) * math::cos(azimuth), math::cos(elevation) * math::sin(azimuth),
          math::sin(elevation)};
}

void add_ray(const Pose& X_WS, const Vec3& d_S, double range, double range_max,
             std::vector<scene::Line>& lines) {
  const bool hit = std::isfinite(range);
  const double length = hit ? range : range < 0 ? 0.0 : range_max;
  lines.push_back({X_WS.translation, X_WS * (length * d_S), hit ? kLaser : kLaserOpen});
}

void add_scan(const LoneDevice& device, const planar_lidar_t& scan,
              std::vector<scene::Line>& lines) {
  for (size_t i = 0; i < scan.ranges.size(); ++i) {
    const double angle =
        static_cast<double>(scan.rad0) + static_cast<double>(i) * static_cast<double>(scan.radstep);
    add_ray(device.X_WS, direction(angle, 0.0), static_cast<double>(scan.ranges[i]),
            device.info.range_max, lines);
  }
}

void add_scan(const LoneDevice& device, const lidar_t& scan, std::vector<scene::Line>& lines) {
  const size_t columns = static_cast<size_t>(std::max(scan.ncolumns, 1));
  const size_t stride = 1 + scan.ranges.size() / kMaxRaysDrawn;
  for (size_t i = 0; i < scan.ranges.size(); i += stride) {
    const size_t column = i % columns, layer = i / columns;
    const double azimuth = static_cast<double>(scan.azimuth0) +
                           static_cast<double>(column) * static_cast<double>(scan.azimuth_step);
    const double elevation = static_cast<double>(scan.elevation0) +
                             static_cast<double>(layer) * static_cast<double>(scan.elevation_step);
    add_ray(device.X_WS, direction(azimuth, elevation), static_cast<double>(scan.ranges[i]),
            device.info.range_max, lines);
  }
}

// A cone as its two edges in the transducer's plane and the arc at the measured range.
void add_cones(const LoneDevice& device, const sonar_t& sonar, std::vector<scene::Line>& lines) {
  const double half = 0.5 * device.info.fov_horizontal;
  const size_t count = std::min(sonar.range.size(), device.info.element_pose.size());
  for (size_t i = 0; i < count; ++i) {
    const std::vector<double>& e = device.info.element_pose[i];
    const Pose X_WT = device.X_WS * Pose::from_xyz_rpy({e[0], e[1], e[2]}, {e[3], e[4], e[5]});
    const double range = static_cast<double>(sonar.range[i]);
    if (!std::isfinite(range)) continue;
    const Colour& colour = range < device.info.range_max - 1e-6 ? kSonar : kSonarOpen;
    Vec3 before = X_WT * (range * direction(-half, 0.0));
    lines.push_back({X_WT.translation, before, colour});
    for (int k = 1; k <= kArcSegments; ++k) {
      const Vec3 now = X_WT * (range * direction(half * (2.0 * k / kArcSegments - 1.0), 0.0));
      lines.push_back({before, now, colour});
      before = now;
    }
    lines.push_back({X_WT.translation, before, colour});
  }
}

const SensorKind* kind_of(const std::string& type) {
  for (const SensorKind& kind : sensor_kinds()) {
    if (std::find(kind.types.begin(), kind.types.end(), type) != kind.types.end()) return &kind;
  }
  return nullptr;
}

template <class Message>
bool decode(const Outbox& out, const Outbox::Entry& entry, Message& message) {
  return message.decode(out.data(entry), 0, static_cast<int>(entry.size)) >= 0;
}

}  // namespace

Snapshot initial_snapshot(const world::BodyLayout& layout) {
  Snapshot s;
  for (const world::BodyPlacement& body : layout.bodies) s.bodies.push_back(body.X_WB);
  s.body_twists.resize(layout.bodies.size());
  s.body_accelerations.resize(layout.bodies.size(), Vec3::Zero());
  s.wheel_angles.resize(layout.wheels.size());
  s.wheel_rates.resize(layout.wheels.size());
  s.joint_positions.resize(layout.joints.size());
  s.joint_velocities.resize(layout.joints.size());
  s.joint_efforts.resize(layout.joints.size());
  s.robots.resize(layout.robots.size());
  for (size_t i = 0; i < layout.robots.size(); ++i) {
    const world::RobotPlacement& robot = layout.robots[i];
    s.robots[i].X_WBase = robot.body.valid() ? s.bodies[robot.body] * robot.X_BBase : robot.X_BBase;
  }
  return s;
}

std::vector<std::string> device_names(const world::WorldModel& world,
                                      const world::BodyLayout& layout) {
  std::vector<std::string> names;
  for (const world::RobotPlacement& robot : layout.robots) {
    const world::ModelInstance& instance = world.models[robot.instance];
    for (const world::SensorDescription& sensor : instance.model->sensors) {
      if (kind_of(sensor.type)) names.push_back(instance.name + "/" + sensor.name);
    }
  }
  return names;
}

std::unique_ptr<LoneDevice> make_lone_device(const world::WorldModel& world,
                                             const world::BodyLayout& layout,
                                             const std::string& name, bool noise) {
  static const Element kNothing;
  for (const RobotIndex robot : layout.robots.indices()) {
    const InstanceIndex instance_index = layout.robots[robot].instance;
    const world::ModelInstance& instance = world.models[instance_index];
    for (const world::SensorDescription& sensor : instance.model->sensors) {
      const SensorKind* kind = kind_of(sensor.type);
      if (!kind || instance.name + "/" + sensor.name != name) continue;
      auto device = std::make_unique<LoneDevice>();
      device->kind = kind;
      const LinkIndex link = layout.link_of(instance_index, sensor.link);
      const world::LinkPlacement& placement = layout.links[link];
      const Pose X_WL = placement.body.valid() ? layout.bodies[placement.body].X_WB * placement.X_BL
                                               : placement.X_BL;
      device->X_WS = X_WL * sensor.X_LS;
      const Element& element = sensor.element ? *sensor.element : kNothing;
      SensorSetup setup{world,
                        layout,
                        element,
                        instance.name,
                        sensor.name,
                        robot,
                        link,
                        sensor.X_LS,
                        RandomSource(1, instance.name, sensor.name),
                        noise,
                        element.rate("update_rate", kind->default_rate),
                        nullptr,
                        {}};
      setup.add_channel = [&device, &name](const std::string& suffix, const std::string& type,
                                           int64_t) {
        device->channels.push_back(suffix.empty() ? name : name + "/" + suffix);
        device->types.push_back(type);
        return static_cast<int>(device->channels.size()) - 1;
      };
      device->sensor = kind->make(setup);
      device->sensor->describe(device->info);
      return device;
    }
  }
  return nullptr;
}

std::vector<scene::Line> device_rays(const world::WorldModel& world,
                                     const world::BodyLayout& layout) {
  const Snapshot snapshot = initial_snapshot(layout);
  std::unique_ptr<scene::RayScene> scenes[2];  // collisions, visuals
  const auto scene = [&](bool visuals) {
    auto& rays = scenes[visuals ? 1 : 0];
    if (!rays) {
      rays = scene::make_ray_scene(scene::make_static_ray_scene(world, layout, visuals));
      rays->update(snapshot);
    }
    return rays.get();
  };
  std::vector<scene::Line> lines;
  for (const std::string& name : device_names(world, layout)) {
    const auto device = make_lone_device(world, layout, name, false);
    if (!device || !(device->kind->needs_rays || device->kind->needs_visual_rays)) continue;
    Outbox out;
    // A sonar array may fire one transducer a sample: as many samples as it has.
    const int samples = std::max(device->info.nelements, 1);
    for (int64_t k = 0; k < samples; ++k) {
      out.clear();
      if (device->sensor->observes()) device->sensor->observe(snapshot, out);
      device->sensor->sample(
          {snapshot, k,
           scene(device->kind->needs_visual_rays || device->sensor->wants_visual_rays()), nullptr},
          out);
    }
    for (const Outbox::Entry& entry : out.entries()) {
      const std::string& type = device->types[entry.channel];
      planar_lidar_t scan;
      lidar_t layers;
      sonar_t sonar;
      if (type == planar_lidar_t::getTypeName() && decode(out, entry, scan))
        add_scan(*device, scan, lines);
      if (type == lidar_t::getTypeName() && decode(out, entry, layers))
        add_scan(*device, layers, lines);
      if (type == sonar_t::getTypeName() && decode(out, entry, sonar))
        add_cones(*device, sonar, lines);
    }
  }
  return lines;
}

}  // namespace ruedo::report
