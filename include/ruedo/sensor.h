// The interface for authors of sensors. A sensor is one source file in src/sensors: a class
// derived from Sensor, and one registration at its end. docs/adding-a-sensor.md is the story.
//
// Life of a sensor: made once from its element; then, in its module's thread, observe() for every
// step (only if it requests that) and sample() at the steps of its rate. Devices of one
// module may run in parallel with each other, never with themselves. A sensor reads the snapshot,
// its configuration and its own state, and nothing else: no clock, no other device, no shared
// generator.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "ruedo/element.h"
#include "ruedo/random.h"
#include "ruedo/sim_time.h"
#include "ruedo/snapshot.h"
#include "ruedo/state_archive.h"

/// The engine in the process, and what sensors and drives of one's own are written against.
namespace ruedo {

namespace world {
struct WorldModel;
struct BodyLayout;
struct DriveDescription;
}  // namespace world
namespace scene {
class RayScene;
class Renderer;
}  // namespace scene
class device_info_t;

/// The buffer of a sensor's messages. Buffers are reused: nothing is allocated in the
/// steady state.
class Outbox {
 public:
  /// One message.
  struct Entry {
    int64_t step;   ///< number of the state that it is of
    int channel;    ///< index that SensorSetup::add_channel gave
    size_t offset;  ///< bytes before it
    size_t size;    ///< bytes
  };

  /// Encodes an LCM message.
  /// @param channel index that SensorSetup::add_channel gave
  /// @param message of the channel's type; its counts are those of its arrays
  /// @throws std::length_error for a message that has no encoding
  template <class Message>
  void publish(int channel, const Message& message) {
    const int size = message.getEncodedSize();
    if (size < 8)
      throw std::length_error("a message with a negative count of elements, or of 2 GiB and more");
    uint8_t* bytes = append(channel, static_cast<size_t>(size));
    if (message.encode(bytes, 0, size) != size)
      throw std::length_error("a message whose counts of elements are not those of its arrays");
  }

  /// Forgets all messages, and keeps the room.
  void clear() {
    entries_.clear();
    bytes_.clear();
  }
  /// @param step that messages are of from now on
  void begin_step(int64_t step) { step_ = step; }
  /// @return the messages, in the order of publish()
  const std::vector<Entry>& entries() const { return entries_; }
  /// @param entry of this outbox
  /// @return its bytes
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

/// The description with which a sensor is made.
struct SensorSetup {
  const world::WorldModel& world;   ///< as the files say it
  const world::BodyLayout& layout;  ///< what lies at which index of a Snapshot
  /// Its `<sensor>`, or `<ruedo:odometry>`, ...; an empty element without one.
  const Element& element;
  std::string robot;       ///< name
  std::string device;      ///< name; the main channel is robot + "/" + device
  RobotIndex robot_index;  ///< of the robot in a Snapshot
  LinkIndex link;          ///< that carries it
  Pose X_LS;               ///< the device's frame in that link
  RandomSource random;     ///< its own
  bool noise;              ///< false: --no-noise
  Rate rate;               ///< `<update_rate>`, or the module's default
  Findings* findings;      ///< for what is not supported

  /// Announces a channel and returns its index for Outbox::publish. suffix "": robot/device;
  /// "depth": robot/device/depth.
  std::function<int(const std::string& suffix, const std::string& type, int64_t fingerprint)>
      add_channel;

  /// Announces a channel of a type that lcm-gen made.
  /// @param suffix "": robot/device; "depth": robot/device/depth
  /// @return its index for Outbox::publish
  template <class Message>
  int channel(const std::string& suffix = "") const {
    return add_channel(suffix, Message::getTypeName(), Message::getHash());
  }
};

/// The input of a sensor for a sample.
struct SampleInput {
  const Snapshot& snapshot;     ///< the state that it measures
  int64_t sample;               ///< its index, from 0
  const scene::RayScene* rays;  ///< at this snapshot's poses; null unless the module asks for rays
  scene::Renderer* renderer;    ///< null unless the module asks for pictures
};

/// A sensor of one robot.
class Sensor {
 public:
  virtual ~Sensor() = default;
  /// Called for every step in order, the initial state included, before sample() of the same step;
  /// only when observes() is true. It may publish what cannot wait for the next sample.
  /// @param snapshot the step's state
  /// @param out takes messages
  virtual void observe(const Snapshot& snapshot, Outbox& out) {
    static_cast<void>(snapshot);
    static_cast<void>(out);
  }
  /// @return whether observe() is called
  virtual bool observes() const { return false; }
  /// Measures, and publishes what it measured.
  /// @param input the state, and what sees it
  /// @param out takes messages
  virtual void sample(const SampleInput& input, Outbox& out) = 0;
  /// @return true: SampleInput::rays is the scene of the visuals, for a kind that has it from the
  ///   file
  virtual bool wants_visual_rays() const { return false; }
  /// Sim time was reset between two steps (a reset of the time alone): what the sensor keeps of
  /// times goes with it. The step that follows shows the same state as the last one, at time 0, and
  /// samples count from 0 again.
  /// @param us by how much time went back
  virtual void shift_time(SimTime us) { static_cast<void>(us); }
  /// For snapshots of an engine: becomes what `other` is. SensorOf does it. Not asked of pictures,
  /// which depend on no other sample (SensorKind::needs_renderer).
  /// @param other the same device's in another copy of the world
  /// @return false: it cannot; then a world with this device has no snapshots
  virtual bool copy_from(const Sensor& other) { return static_cast<void>(other), false; }
  /// For snapshots in files: writes the state of later samples, or reads it. SensorOf does it
  /// for a class with a function `void exchange(StateArchive&)`. Not asked of pictures, either.
  /// @param archive that writes or reads
  /// @return false: it cannot; then a snapshot's file leads to the state by running there again
  virtual bool exchange_state(StateArchive& archive) { return static_cast<void>(archive), false; }
  /// Fills in what ruedo/info says of the device.
  /// @param info with robot, name, kind, rate and pose already
  virtual void describe(device_info_t& info) const { static_cast<void>(info); }
};

/// A sensor all of whose members are values, or Bound to its world: class Sonar : public
/// SensorOf<Sonar>.
template <class Self>
class SensorOf : public Sensor {
 public:
  bool copy_from(const Sensor& other) final {
    static_cast<Self&>(*this) = static_cast<const Self&>(other);
    return true;
  }
  bool exchange_state(StateArchive& archive) final {
    constexpr bool can = requires(Self& self) { self.exchange(archive); };
    if constexpr (can) static_cast<Self&>(*this).exchange(archive);
    return can;
  }
};

/// A kind of sensor. A module is a thread: it serves the devices of its kinds on all robots. Kinds
/// that cost little share one: odometry, pose, motion and joints are all of the module "odometry"
/// (they have the same order, and within a robot they come in the order of sensor_kinds()).
struct SensorKind {
  std::string module;              ///< the thread: "lrf"
  int order;                       ///< of the modules in the schedule, then by name
  std::vector<std::string> types;  ///< SDF sensor types that it serves: "ray", "gpu_lidar", "lidar"
  /// "": from `<sensor>` elements. "drive": one on each robot with a drive, "robot": one on each
  /// robot, "joints": one on each robot with joints.
  std::string attach_to;
  std::string device_name;         ///< of attached kinds
  Rate default_rate;               ///< where the file says none
  bool needs_rays = false;         ///< SampleInput::rays of the collisions
  bool needs_visual_rays = false;  ///< SampleInput::rays of the visuals
  /// Pictures: a sample depends on no other one, since samples without a reader are not taken. A
  /// sensor whose samples depend on each other observes().
  bool needs_renderer = false;
  std::function<std::unique_ptr<Sensor>(const SensorSetup&)> make;  ///< may throw InputError
  std::string kind = {};  ///< as ruedo/info names it; empty: the module's name
  /// Attached kinds only: the rate that the robot's drive asks for; where it is null, or the robot
  /// has no drive, default_rate holds.
  std::function<Rate(const world::DriveDescription&)> drive_rate = {};
  /// For --set: what a `<sensor>` of that type may have below it besides what the file has written,
  /// as paths: "lidar.range.max".
  std::function<std::vector<std::string>(const std::string& type)> settings = {};

  /// @return kind, or else module
  const std::string& name() const { return kind.empty() ? module : kind; }
};

/// All registered kinds.
/// @return sorted by order, module and kind: never in the order of registration, which is not fixed
const std::vector<SensorKind>& sensor_kinds();

/// Put one at namespace scope in the sensor's file: static const RegisterSensor kRegister{{...}};
struct RegisterSensor {
  /// @param kind one of its own name
  explicit RegisterSensor(SensorKind kind);
};

}  // namespace ruedo
