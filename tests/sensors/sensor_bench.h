// A bench that tests one sensor without physics and server: an inline world, a snapshot that the
// test fills in, and the sensor's messages, decoded.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "ruedo/sensor.h"
#include "world/load.h"
#include "world/model/body_layout.h"

namespace ruedo::test {

// The messages of a sensor: decoded, of one type on one channel, in order.
struct Device {
  const SensorKind* kind = nullptr;
  Rate rate;
  std::unique_ptr<Sensor> sensor;
  std::vector<std::string> channels;  // by the index that the sensor publishes with

  template <class Message>
  static std::vector<Message> decode(const Outbox& out, int channel = 0) {
    std::vector<Message> messages;
    for (const Outbox::Entry& entry : out.entries()) {
      if (entry.channel != channel) continue;
      Message message;
      if (message.decode(out.data(entry), 0, static_cast<int>(entry.size)) !=
          static_cast<int>(entry.size)) {
        throw std::logic_error("a message does not decode");
      }
      messages.push_back(std::move(message));
    }
    return messages;
  }
};

class SensorBench {
 public:
  struct Options {
    uint64_t seed = 1;
    bool noise = true;
    std::string named_robot;  // other than the model's instance, for the random numbers
    std::string named_device;
  };

  // `sdf` is a complete SDF file, as if it were in the folder for temporary files.
  explicit SensorBench(const std::string& sdf)
      : world(world::load_world_text(sdf, testing::TempDir() + "/bench.sdf")), layout(*world) {}

  // The state at the start: everything where the file has it, at rest.
  Snapshot snapshot() const {
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
      s.robots[i].X_WBase = robot.body < 0 ? robot.X_BBase : s.bodies[robot.body] * robot.X_BBase;
    }
    return s;
  }

  // The index of a robot in the layout, by its name in the world.
  int robot(const std::string& name) const {
    for (size_t i = 0; i < layout.robots.size(); ++i) {
      if (world->models[layout.robots[i].instance].name == name) return static_cast<int>(i);
    }
    throw std::logic_error("no robot " + name);
  }

  // Makes a device as the server would: a <sensor> of that name, or an attached one.
  Device make(const std::string& robot_name, const std::string& device, const Options& options) {
    Device made;
    const RobotIndex index(robot(robot_name));
    const world::RobotPlacement& placement = layout.robots[index];
    const world::Model& model = *world->models[placement.instance].model;
    std::shared_ptr<const Element> element;
    LinkIndex link = layout.first_link[placement.instance];
    Pose X_LS;
    for (const world::SensorDescription& sensor : model.sensors) {
      if (sensor.name != device) continue;
      for (const SensorKind& kind : sensor_kinds()) {
        for (const std::string& type : kind.types) {
          if (type == sensor.type) made.kind = &kind;
        }
      }
      element = sensor.element;
      link += sensor.link;
      X_LS = sensor.X_LS;
    }
    for (const SensorKind& kind : sensor_kinds()) {
      if (made.kind || kind.attach_to.empty() || kind.device_name != device) continue;
      made.kind = &kind;
      if (device == "odometry" && model.drive) element = model.drive->odometry;
    }
    if (!made.kind) throw std::logic_error("no sensor " + device);
    made.rate = made.kind->default_rate;
    if (model.drive && made.kind->drive_rate) made.rate = made.kind->drive_rate(*model.drive);
    static const Element kNothing;
    const std::string robot_key = options.named_robot.empty() ? robot_name : options.named_robot;
    const std::string device_key = options.named_device.empty() ? device : options.named_device;
    const SensorSetup setup{
        *world,
        layout,
        element ? *element : kNothing,
        robot_name,
        device,
        RobotIndex(index),
        link,
        X_LS,
        RandomSource(options.seed, robot_key, device_key),
        options.noise,
        made.rate,
        &findings,
        [&made, &robot_name, &device](const std::string& suffix, const std::string&, int64_t) {
          made.channels.push_back(robot_name + "/" + device + (suffix.empty() ? "" : "/" + suffix));
          return static_cast<int>(made.channels.size()) - 1;
        }};
    made.sensor = made.kind->make(setup);
    return made;
  }
  Device make(const std::string& robot_name, const std::string& device) {
    return make(robot_name, device, Options{});
  }

  std::shared_ptr<const world::WorldModel> world;
  world::BodyLayout layout;
  Findings findings;
};

// One step of a sensor as the module does it; `sample` < 0: none is due.
inline void step(Device& device, const Snapshot& snapshot, Outbox& out, int64_t sample) {
  out.begin_step(snapshot.step);
  if (device.sensor->observes()) device.sensor->observe(snapshot, out);
  if (sample >= 0) device.sensor->sample({snapshot, sample, nullptr, nullptr}, out);
}

}  // namespace ruedo::test
