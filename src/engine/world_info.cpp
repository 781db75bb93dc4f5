// Fills in world_info_t from the loaded world and the channel table.
#include "engine/world_info.h"

#include <string>

#include "engine/world_state.h"
#include "world/drives/drive.h"

namespace ruedo::engine {
namespace {

class Parts {
 public:
  explicit Parts(const world_info_t& head) : head_(head) { begin(); }

  // Adds an entry to that list of the current part, or of a new one when it has no room.
  template <class Entry>
  void add(std::vector<Entry> world_info_t::* list, int32_t world_info_t::* count, Entry entry) {
    const size_t size = static_cast<size_t>(entry._getEncodedSizeNoHash());
    if (size_ + size > kMaxPartSize) begin();
    size_ += size;
    (parts_.back().*list).push_back(std::move(entry));
    ++(parts_.back().*count);
  }

  std::vector<world_info_t> take() {
    for (size_t i = 0; i < parts_.size(); ++i) {
      parts_[i].part = static_cast<int16_t>(i);
      parts_[i].nparts = static_cast<int16_t>(parts_.size());
    }
    return std::move(parts_);
  }

 private:
  void begin() {
    parts_.push_back(head_);
    world_info_t& part = parts_.back();
    part.nrobots = part.ndevices = part.nchannels = part.nbodies = 0;
    size_ = static_cast<size_t>(part.getEncodedSize());
  }

  const world_info_t& head_;
  std::vector<world_info_t> parts_;
  size_t size_ = 0;
};

robot_info_t robot_info(const world::WorldModel& world, const world::BodyLayout& layout,
                        const world::RobotPlacement& placement) {
  const world::ModelInstance& instance = world.models[placement.instance];
  const world::Model& model = *instance.model;
  robot_info_t info;
  info.name = instance.name;
  info.model = model.name;
  info.body = placement.body;
  info.wheel_radius = info.track = info.max_speed = info.max_turn_rate = 0.0;
  info.acceleration = info.deceleration = info.turn_acceleration = 0.0;
  info.watchdog_us = 0;
  if (model.drive) {
    const world::DriveDescription& drive = *model.drive;
    info.drive = drive.kind == world::DriveDescription::Kind::kinematic ? "kinematic" : "wheels";
    if (drive.steering != world::DriveDescription::Steering::differential)
      info.drive += " " + world::name_of(drive.steering);
    info.wheel_radius = drive.wheel_radius;
    info.track = drive.track;
    info.max_speed = drive.max_speed;
    info.max_turn_rate = drive.max_turn_rate;
    info.acceleration = drive.acceleration;
    info.deceleration = drive.deceleration;
    info.turn_acceleration = drive.turn_acceleration;
    info.watchdog_us = drive.watchdog_us;
  }
  for (WheelIndex wheel : placement.wheels) {
    const world::WheelPlacement& description = layout.wheels[wheel];
    info.wheels.push_back(model.joints[description.joint].name);
    info.left.push_back(description.left);
  }
  info.nwheels = static_cast<int32_t>(info.wheels.size());
  return info;
}

const world::Link& link_of(const world::WorldModel& world, const world::LinkPlacement& placement) {
  return world.models[placement.instance].model->links[placement.link];
}

}  // namespace

std::vector<world_info_t> make_world_info(const world_info_t& head, const world::WorldModel& world,
                                          const world::BodyLayout& layout,
                                          const std::vector<device_info_t>& devices,
                                          const Channels& channels) {
  Parts parts(head);
  const auto removed = [&](InstanceIndex instance) { return world.models[instance].removed; };
  for (const world::RobotPlacement& robot : layout.robots) {
    if (removed(robot.instance)) continue;
    parts.add(&world_info_t::robots, &world_info_t::nrobots, robot_info(world, layout, robot));
  }
  for (const device_info_t& device : devices)
    parts.add(&world_info_t::devices, &world_info_t::ndevices, device);
  for (const Channel& channel : channels.list()) {
    channel_info_t info{};
    if (channel.gone) {  // its place counts: ticks name channels by it
      parts.add(&world_info_t::channels, &world_info_t::nchannels, info);
      continue;
    }
    info.name = channel.bus_name;
    info.robot = channel.robot;
    info.device = channel.device;
    info.type = channel.type;
    info.fingerprint = channel.fingerprint;
    info.rate = channel.rate.hz();
    info.input = channel.input;
    parts.add(&world_info_t::channels, &world_info_t::nchannels, info);
  }
  for (const world::ListedBody& listed :
       layout.listed) {  // their places count: pictures label by them
    const world::LinkPlacement& link = layout.links[listed.link];
    body_info_t info{};
    info.index = -1;
    info.is_static = !listed.body.valid();
    if (removed(link.instance)) {
      // no name
    } else if (!listed.body.valid()) {
      info.name = world.models[link.instance].name + "/" + link_of(world, link).name;
    } else {
      const world::BodyPlacement& body = layout.bodies[listed.body];
      info.index = listed.body;
      info.name = body.name;
      for (int each : body.links) info.mass += link_of(world, layout.links[each]).inertial.mass;
    }
    parts.add(&world_info_t::bodies, &world_info_t::nbodies, info);
  }
  return parts.take();
}

}  // namespace ruedo::engine
