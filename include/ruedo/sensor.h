// What a sensor's author writes against. A sensor is one source file in src/sensors: a class
// derived from Sensor, and one registration at its end. docs/adding-a-sensor.md is the story.
//
// Life of a sensor: made once from its element; then, in its module's thread, observe() for every
// step (only when it asks for that) and sample() at the steps that its rate says. Devices of one
// module may run in parallel with each other, never with themselves. A sensor reads the snapshot,
// its configuration and its own state, and nothing else: no clock, no other device, no shared
// generator.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ruedo/element.h"
#include "ruedo/random.h"
#include "ruedo/sim_time.h"
#include "ruedo/snapshot.h"

namespace ruedo {

namespace model {
struct WorldModel;
struct BodyLayout;
struct DriveDescription;
}  // namespace model
namespace scene {
class RayScene;
class Renderer;
}  // namespace scene
class device_info_t;

// Where the bytes of a sensor's messages go. Buffers are reused: nothing is allocated in the steady
// state.
class Outbox {
 public:
  struct Entry {
    int64_t step;
    int channel;  // index that SensorSetup::add_channel gave
    size_t offset, size;
  };

  // Encodes an LCM message for `channel`.
  template <class Message>
  void publish(int channel, const Message& message) {
    const int size = message.getEncodedSize();
    uint8_t* bytes = append(channel, static_cast<size_t>(size));
    message.encode(bytes, 0, size);
  }

  void clear() {
    entries_.clear();
    bytes_.clear();
  }
  void begin_step(int64_t step) { step_ = step; }
  const std::vector<Entry>& entries() const { return entries_; }
  const uint8_t* data(const Entry& entry) const { return bytes_.data() + entry.offset; }

 private:
  uint8_t* append(int channel, size_t size) {
    const size_t offset = bytes_.size();
    bytes_.resize(offset + size);
    entries_.push_back({step_, channel, offset, size});
    return bytes_.data() + offset;
  }
  std::vector<Entry> entries_;
  std::vector<uint8_t> bytes_;
  int64_t step_ = 0;
};

// What a sensor is told when it is made.
struct SensorSetup {
  const model::WorldModel& world;
  const model::BodyLayout& layout;
  const Element&
      element;  // its <sensor>, or <ruedo:odometry>, ...; an empty element when there is none
  std::string robot, device;  // names; the main channel is robot + "/" + device
  RobotIndex robot_index;
  LinkIndex link;  // that carries it
  Pose X_LS;       // the device's frame in that link
  RandomSource random;
  bool noise;          // false: --no-noise
  Rate rate;           // <update_rate>, or the module's default
  Findings* findings;  // for what is not supported

  // Announces a channel and returns its index for Outbox::publish. suffix "": robot/device;
  // "depth": robot/device/depth.
  std::function<int(const std::string& suffix, const std::string& type, int64_t fingerprint)>
      add_channel;

  template <class Message>
  int channel(const std::string& suffix = "") const {
    return add_channel(suffix, Message::getTypeName(), Message::getHash());
  }
};

// What a sensor is given for a sample.
struct SampleInput {
  const Snapshot& snapshot;
  int64_t sample;               // its index, from 0
  const scene::RayScene* rays;  // at this snapshot's poses; null unless the module asks for rays
  scene::Renderer* renderer;    // null unless the module asks for pictures
};

class Sensor {
 public:
  virtual ~Sensor() = default;
  // For every step in order, the initial state included, before sample() of the same step; only
  // when observes() is true. It may publish what cannot wait for the next sample.
  virtual void observe(const Snapshot&, Outbox&) {}
  virtual bool observes() const { return false; }
  virtual void sample(const SampleInput& input, Outbox& out) = 0;
  // True: SampleInput::rays is the scene of the visuals, for a kind that has it from the file.
  virtual bool wants_visual_rays() const { return false; }
  // Sim time was set back by `us` between two steps (a reset of the time alone): what the sensor
  // keeps of times goes with it. The step that follows shows the same state as the last one, at
  // time 0, and samples count from 0 again.
  virtual void shift_time(SimTime us) { static_cast<void>(us); }
  // For snapshots of an engine: becomes what `other` is, the same device's in another copy of the
  // world. False: it cannot; then a world with this device has no snapshots. SensorOf does it. Not
  // asked of pictures, which depend on no other sample (SensorKind::needs_renderer).
  virtual bool take(const Sensor& other) { return static_cast<void>(other), false; }
  // Fills in what ruedo/info says of the device; robot, name, kind, rate and pose are filled in
  // already.
  virtual void describe(device_info_t&) const {}
};

// A sensor all of whose members are values, or Bound to its world: class Sonar : public
// SensorOf<Sonar>.
template <class Self>
class SensorOf : public Sensor {
 public:
  bool take(const Sensor& other) final {
    static_cast<Self&>(*this) = static_cast<const Self&>(other);
    return true;
  }
};

// A kind of sensor. A module is a thread: it serves the devices of its kinds on all robots. Kinds
// that cost little share one: odometry, pose, motion and joints are all of the module "odometry"
// (they have the same order, and within a robot they come in the order of sensor_kinds()).
struct SensorKind {
  std::string module;              // the thread: "lrf"
  int order;                       // of the modules in the schedule, then by name
  std::vector<std::string> types;  // SDF sensor types that it serves: "ray", "gpu_lidar", "lidar"
  // "": from <sensor> elements. "drive": one on each robot with a drive, "robot": one on each
  // robot, "joints": one on each robot with joints; with this device name.
  std::string attach_to;
  std::string device_name;
  Rate default_rate;
  bool needs_rays = false;
  bool needs_visual_rays = false;
  // Pictures: a sample depends on no other one, for those that nobody reads are not taken. A sensor
  // whose samples do observes().
  bool needs_renderer = false;
  std::function<std::unique_ptr<Sensor>(const SensorSetup&)> make;
  // As ruedo/info names it; empty: the module's name.
  std::string kind = {};
  // Attached kinds only: the rate that the robot's drive asks for; where it is null, or the robot
  // has no drive, default_rate holds.
  std::function<Rate(const model::DriveDescription&)> drive_rate = {};
  // For --set: what a <sensor> of that type may have below it besides what the file has written, as
  // paths: "lidar.range.max".
  std::function<std::vector<std::string>(const std::string& type)> settings = {};

  const std::string& name() const { return kind.empty() ? module : kind; }
};

// All registered kinds, sorted by (order, module, kind): never in the order of registration, which
// no one fixes.
const std::vector<SensorKind>& sensor_kinds();

// Put one at namespace scope in the sensor's file: static const RegisterSensor kRegister{{...}};
struct RegisterSensor {
  explicit RegisterSensor(SensorKind kind);
};

}  // namespace ruedo
