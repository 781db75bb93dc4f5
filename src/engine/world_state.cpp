// World state in parts that fit a datagram, and the hash of all of it.
#include "engine/world_state.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "base/channel_names.h"

namespace ruedo::engine {
namespace {

constexpr Rate kWorldRate{30, 1};
constexpr size_t kBytesOfBody = 4 + 3 * 8 + 4 * 8;
constexpr size_t kBodiesInPart = (kMaxPartSize - 64) / kBytesOfBody;

class WorldState : public SensorOf<WorldState> {
 public:
  WorldState(const std::vector<int32_t>& indices, int epoch, ChannelIndex channel)
      : channel_(channel) {
    const size_t bodies = indices.size();
    const size_t nparts = std::max<size_t>(1, (bodies + kBodiesInPart - 1) / kBodiesInPart);
    for (size_t part = 0; part < nparts; ++part) {
      const size_t first = part * kBodiesInPart, last = std::min(bodies, first + kBodiesInPart);
      world_state_t& message = parts_.emplace_back();
      message.epoch = epoch;
      message.part = static_cast<int16_t>(part);
      message.nparts = static_cast<int16_t>(nparts);
      message.n = static_cast<int32_t>(last - first);
      for (size_t body = first; body < last; ++body) message.index.push_back(indices[body]);
      message.position.assign(last - first, std::vector<double>(3));
      message.orientation.assign(last - first, std::vector<double>(4));
    }
  }

  void sample(const SampleInput& input, Outbox& out) override {
    for (const world_state_t& message : shown(input.snapshot)) out.publish(channel_, message);
  }

  void exchange(StateArchive&) {}

  const std::vector<world_state_t>& shown(const Snapshot& state) {
    for (world_state_t& message : parts_) {
      message.utime = state.time;
      for (size_t i = 0; i < message.index.size(); ++i) {
        const Pose& X_WB = state.bodies[message.index[i]];
        for (int k = 0; k < 3; ++k) message.position[i][k] = X_WB.translation[k];
        message.orientation[i] = {X_WB.rotation.w(), X_WB.rotation.x(), X_WB.rotation.y(),
                                  X_WB.rotation.z()};
      }
    }
    return parts_;
  }

 private:
  ChannelIndex channel_;
  std::vector<world_state_t> parts_;
};

// FNV-1a over 64-bit words, with a stronger last mix: the order of the words counts.
class Hash {
 public:
  void add(double value) { add(std::bit_cast<uint64_t>(value)); }
  void add(uint64_t word) {
    hash_ = (hash_ ^ word) * 0x100000001b3ull;
    hash_ ^= hash_ >> 29;
  }
  void add(const Vec3& v) { add(v.x()), add(v.y()), add(v.z()); }
  void add(const Pose& X) {
    add(X.translation), add(X.rotation.w()), add(X.rotation.x()), add(X.rotation.y()),
        add(X.rotation.z());
  }
  void add(const Twist& twist) { add(twist.linear), add(twist.angular); }
  void add(const std::vector<double>& values) {
    for (double value : values) add(value);
  }
  uint64_t value() const { return (hash_ ^ hash_ >> 32) * 0x9e3779b97f4a7c15ull; }

 private:
  uint64_t hash_ = 0xcbf29ce484222325ull;
};

}  // namespace

namespace {

// The bodies of models that are there.
std::vector<int32_t> bodies_of(const world::WorldModel& world, const world::BodyLayout& layout) {
  std::vector<int32_t> there;
  for (size_t i = 0; i < layout.bodies.size(); ++i) {
    if (!world.models[layout.bodies[i].instance].removed) there.push_back(static_cast<int32_t>(i));
  }
  return there;
}

}  // namespace

std::unique_ptr<Sensor> world_state_sensor(const world::WorldModel& world,
                                           const world::BodyLayout& layout, int epoch,
                                           ChannelIndex channel) {
  return std::make_unique<WorldState>(bodies_of(world, layout), epoch, channel);
}

std::vector<world_state_t> world_states(const world::WorldModel& world,
                                        const world::BodyLayout& layout, int epoch,
                                        const Snapshot& state) {
  return WorldState(bodies_of(world, layout), epoch, ChannelIndex()).shown(state);
}

ModuleSetup world_state_module(const world::WorldModel& world, const world::BodyLayout& layout,
                               int epoch, Channels& channels) {
  const ChannelIndex channel = channels.add<world_state_t>(kWorldChannel, "", "", kWorldRate);
  ModuleSetup module;
  module.name = "world";
  module.step_us = world.step_us;
  module.rank = std::numeric_limits<int>::max();
  module.devices.push_back({world_state_sensor(world, layout, epoch, channel), kWorldRate});
  return module;
}

int64_t state_hash(const Snapshot& snapshot) {
  Hash hash;
  hash.add(static_cast<uint64_t>(snapshot.step));
  for (const Pose& pose : snapshot.bodies) hash.add(pose);
  for (const Twist& twist : snapshot.body_twists) hash.add(twist);
  hash.add(snapshot.wheel_angles);
  hash.add(snapshot.wheel_rates);
  hash.add(snapshot.joint_positions);
  hash.add(snapshot.joint_velocities);
  for (const RobotState& robot : snapshot.robots) {
    hash.add(robot.X_WBase);
    hash.add(robot.twist);
    hash.add(static_cast<uint64_t>(robot.motion.id));
    hash.add(static_cast<uint64_t>(robot.motion.changes));
    hash.add(static_cast<uint64_t>(robot.odometry_resets));
  }
  return static_cast<int64_t>(hash.value());
}

}  // namespace ruedo::engine
