// A bench for sensors that cast rays: an inline world, its ray scenes, and one device.
#pragma once

#include <string>
#include <vector>

#include "scene/rays/ray_scene.h"
#include "sensors/sensor_bench.h"

namespace ruedo::test {

// <sdf> of a world with what is given, and a robot "r" at a pose whose link "base" holds the
// sensor's XML.
inline std::string robot_world(const std::string& things, const std::string& sensors,
                               const std::string& robot_pose = "0 0 0 0 0 0",
                               const std::string& robot_shape = "") {
  return "<sdf version='1.9' xmlns:ruedo='http://ruedo'><world name='w'>" + things +
         "<model name='r'><pose>" + robot_pose + "</pose><link name='base'>" + robot_shape +
         sensors + "</link></model></world></sdf>";
}

// A static model of one collision.
inline std::string solid(const std::string& name, const std::string& pose, const std::string& shape,
                         const std::string& surface = "") {
  return "<model name='" + name + "'><static>true</static><pose>" + pose +
         "</pose><link name='l'><collision name='c'><geometry>" + shape + "</geometry><surface>" +
         surface + "</surface></collision></link></model>";
}

inline std::string box(double x, double y, double z) {
  return "<box><size>" + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) +
         "</size></box>";
}

struct RayBench {
  explicit RayBench(const std::string& sdf, const std::string& device_name,
                    SensorBench::Options options = {})
      : bench(sdf), device(bench.make("r", device_name, options)), now(bench.snapshot()) {
    scene = scene::make_ray_scene(scene::make_static_ray_scene(*bench.world, bench.layout,
                                                               device.sensor->wants_visual_rays()));
  }

  template <class Message>
  Message sample(int64_t index = 0) {
    Outbox out;
    out.begin_step(now.step);
    scene->update(now);
    if (device.sensor->observes()) device.sensor->observe(now, out);
    device.sensor->sample({now, index, scene.get(), nullptr}, out);
    return Device::decode<Message>(out).at(0);
  }
  // A step without a sample.
  void observe() {
    Outbox out;
    if (device.sensor->observes()) device.sensor->observe(now, out);
  }
  void advance(int64_t dt_us) {
    ++now.step;
    now.time += dt_us;
  }

  SensorBench bench;
  Device device;
  Snapshot now;
  std::unique_ptr<scene::RayScene> scene;
};

}  // namespace ruedo::test
