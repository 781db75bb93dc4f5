// Creates the devices of all robots from the kinds of sensors that are linked in.
#include "engine/fleet.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <set>
#include <span>
#include <thread>

#include "base/channel_names.h"
#include "base/whole.h"
#include "engine/world_state.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/markers_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"
#include "world/read/read_context.h"

namespace ruedo::engine {
namespace {

const Element& no_element() {
  static const Element element;
  return element;
}

// A device to be created.
struct Wanted {
  const SensorKind* kind;
  RobotIndex robot;
  std::string name;
  const Element* element;
  LinkIndex link;
  Pose X_LS;
  std::optional<Rate> rate;  // empty: as in its element
};

class FleetMaker {
 public:
  FleetMaker(const world::WorldModel& world, const world::BodyLayout& layout,
             const FleetOptions& options, Channels& channels, Findings& findings)
      : world_(world),
        layout_(layout),
        options_(options),
        channels_(channels),
        findings_(findings),
        disabled_(world.disabled.begin(), world.disabled.end()),
        devices_of_(layout.robots.size()) {
    disabled_.insert(options.disabled.begin(), options.disabled.end());
  }

  Fleet make() {
    const std::vector<SensorKind>& kinds = sensor_kinds();  // those of a module are adjacent
    for (auto first = kinds.begin(); first != kinds.end();) {
      const auto last = std::find_if(
          first, kinds.end(), [&](const SensorKind& kind) { return kind.module != first->module; });
      add_module({first, last}, static_cast<int>(first - kinds.begin()));
      first = last;
    }
    name_unserved(kinds);
    add_inputs();
    if (!options_.only_robot.valid()) {
      fleet_.modules.push_back(world_state_module(world_, layout_, options_.epoch, channels_));
      add_markers();
    }
    for (auto& devices : devices_of_) {
      for (device_info_t& device : devices) fleet_.devices.push_back(std::move(device));
    }
    return std::move(fleet_);
  }

 private:
  // The robots whose devices are created.
  std::vector<RobotIndex> robots() const {
    if (options_.only_robot.valid()) return {options_.only_robot};
    std::vector<RobotIndex> all;
    for (const RobotIndex robot : layout_.robots.indices()) all.push_back(robot);
    return all;
  }

  const world::ModelInstance& instance(RobotIndex robot) const {
    return world_.models[layout_.robots[robot].instance];
  }

  bool disabled(RobotIndex robot, const std::string& device) const {
    return disabled_.contains(instance(robot).name + "/" + device);
  }

  // The devices of a kind on a robot, in file order.
  void collect(const SensorKind& kind, RobotIndex robot, std::vector<Wanted>& wanted) const {
    const world::Model& model = *instance(robot).model;
    if (kind.attach_to.empty()) {
      for (const world::SensorDescription& sensor : model.sensors) {
        if (std::find(kind.types.begin(), kind.types.end(), sensor.type) == kind.types.end() ||
            disabled(robot, sensor.name))
          continue;
        const Element& element = sensor.element ? *sensor.element : no_element();
        wanted.push_back({&kind,
                          robot,
                          sensor.name,
                          &element,
                          layout_.link_of(layout_.robots[robot].instance, sensor.link),
                          sensor.X_LS,
                          {}});
      }
      return;
    }
    const bool attached = kind.attach_to == "robot" || (kind.attach_to == "drive" && model.drive) ||
                          (kind.attach_to == "joints" && !layout_.robots[robot].joints.empty());
    if (!attached || disabled(robot, kind.device_name)) return;
    const Element* element = &no_element();
    Rate rate = kind.default_rate;
    if (model.drive) {
      const world::DriveDescription& drive = *model.drive;
      if (drive.odometry && drive.odometry->name == "ruedo:" + kind.device_name)
        element = drive.odometry.get();
      if (kind.drive_rate) rate = kind.drive_rate(drive);
    }
    const world::RobotPlacement& placement = layout_.robots[robot];
    const LinkIndex link = placement.body.valid()  // it is at base_link
                               ? layout_.bodies[placement.body].links.front()
                               : layout_.first_link[placement.instance];
    wanted.push_back({&kind, robot, kind.device_name, element, link,
                      initial_pose(layout_, link).inverse() * X_WBase(robot), rate});
  }

  Pose X_WBase(RobotIndex robot) const {
    const world::RobotPlacement& placement = layout_.robots[robot];
    return placement.body.valid() ? layout_.bodies[placement.body].X_WB * placement.X_BBase
                                  : placement.X_BBase;
  }

  void add_module(std::span<const SensorKind> kinds, int rank) {
    std::vector<Wanted> wanted;
    for (const RobotIndex robot : robots()) {
      for (const SensorKind& kind : kinds) collect(kind, robot, wanted);
    }
    if (wanted.empty()) return;
    ModuleSetup setup;
    setup.name = kinds.front().module;
    setup.step_us = world_.step_us;
    setup.rank = rank;
    for (const SensorKind& kind : kinds) {
      setup.wants_rays |= kind.needs_rays;
      setup.wants_visual_rays |= kind.needs_visual_rays;
      setup.wants_renderer |= kind.needs_renderer;
    }
    setup.piece_size = setup.wants_rays || setup.wants_visual_rays ? 4 : 16;
    // Pictures: each renderer has a thread of its own, with a stretch of the cameras. Which
    // renderer draws which camera changes no pixel.
    static const size_t cores = std::max(1u, std::thread::hardware_concurrency());  // reads a file
    const size_t threads = setup.wants_renderer && !options_.only_robot.valid()
                               ? std::min({wanted.size(), cores, size_t{8}})
                               : 1;
    for (size_t i = 0; i < threads; ++i) {
      const size_t first = wanted.size() * i / threads, last = wanted.size() * (i + 1) / threads;
      ModuleSetup module = setup.without_devices();
      for (size_t k = first; k < last; ++k) add_device(wanted[k], module);
      for (const Device& device : module.devices) module.wants_visual_rays |= device.visual_rays;
      if (!module.devices.empty()) fleet_.modules.push_back(std::move(module));
    }
  }

  // As everywhere: an error in a standard element leaves out the sensor and is reported; an error
  // in one of Ruedo's own elements, or in names and options, is thrown.
  void add_device(const Wanted& wanted, ModuleSetup& module) {
    const std::string& robot = instance(wanted.robot).name;
    const std::string where = robot + "/" + wanted.name;
    channel_refused_ = nullptr;
    device_channels_.clear();
    try {
      if (world::read_or_leave_out(where, "the sensor is left out", findings_,
                                   [&] { module.devices.push_back(make_device(wanted)); }))
        return;
      if (channel_refused_) std::rethrow_exception(channel_refused_);
    } catch (const InputError& error) {
      if (!options_.keep_going) throw;
      findings_.error(error.source(), where, error.message());
      fleet_.refused = true;
    }
    channels_.remove(robot, wanted.name);  // those announced already
  }

  Device make_device(const Wanted& wanted) {
    const std::string& robot = instance(wanted.robot).name;
    const Rate rate =
        wanted.rate ? *wanted.rate : wanted.element->rate("update_rate", wanted.kind->default_rate);
    const double phase_s =
        wanted.element->number("ruedo:phase", 0.0, Allowed::not_negative(quantity::kTime));
    if (!rate.every_step() && rate.hz() * static_cast<double>(world_.step_us) > 1e6) {
      findings_.repaired(wanted.element->source, robot + "/" + wanted.name,
                         "its rate is above the step rate: it samples at every step");
    }
    SensorSetup setup{.world = world_,
                      .layout = layout_,
                      .element = *wanted.element,
                      .robot = robot,
                      .device = wanted.name,
                      .robot_index = wanted.robot,
                      .link = wanted.link,
                      .X_LS = wanted.X_LS,
                      .random = RandomSource(options_.seed, robot, wanted.name),
                      .noise = options_.noise,
                      .rate = rate,
                      .findings = &findings_,
                      .add_channel = {}};
    setup.add_channel = [&](const std::string& suffix, const std::string& type,
                            int64_t fingerprint) {
      const std::string device = suffix.empty() ? wanted.name : wanted.name + "/" + suffix;
      try {
        device_channels_.push_back(channels_.add(
            {robot + "/" + device, "", robot, wanted.name, type, fingerprint, rate, false}));
        return device_channels_.back();
      } catch (const InputError&) {
        channel_refused_ = std::current_exception();
        throw;
      }
    };
    Device device{wanted.kind->make(setup),
                  rate,
                  microseconds(phase_s),
                  wanted.kind->needs_visual_rays,
                  wanted.robot,
                  options_.first_step,
                  wanted.name};
    device.visual_rays |= device.sensor->wants_visual_rays();
    device.channels = device_channels_;
    device.random = setup.random;
    describe(wanted, rate, *device.sensor);
    return device;
  }

  void describe(const Wanted& wanted, Rate rate, const Sensor& sensor) {
    device_info_t info;
    info.robot = instance(wanted.robot).name;
    info.name = wanted.name;
    info.kind = wanted.kind->name();
    info.rate = rate.hz();
    const Pose X_BaseS =
        X_WBase(wanted.robot).inverse() * initial_pose(layout_, wanted.link) * wanted.X_LS;
    for (int i = 0; i < 3; ++i) info.position[i] = X_BaseS.translation[i];
    info.orientation[0] = X_BaseS.rotation.w();
    info.orientation[1] = X_BaseS.rotation.x();
    info.orientation[2] = X_BaseS.rotation.y();
    info.orientation[3] = X_BaseS.rotation.z();
    info.range_min = info.range_max = info.fov_horizontal = info.fov_vertical = 0.0;
    info.width = info.height = info.nelements = 0;
    sensor.describe(info);
    devices_of_[wanted.robot].push_back(std::move(info));
  }

  void name_unserved(const std::vector<SensorKind>& kinds) {
    std::set<const world::Model*> seen;
    for (const RobotIndex robot : robots()) {
      const world::Model* model = instance(robot).model.get();
      if (!seen.insert(model).second) continue;
      for (const world::SensorDescription& sensor : model->sensors) {
        const bool served = std::any_of(kinds.begin(), kinds.end(), [&](const SensorKind& kind) {
          return std::find(kind.types.begin(), kind.types.end(), sensor.type) != kind.types.end();
        });
        if (served) continue;
        findings_.unsupported(
            sensor.element ? sensor.element->source : model->source,
            "model " + model->name + "/sensor " + sensor.name,
            "sensors of type '" + sensor.type + "' are not supported; the robot runs without it");
      }
    }
  }

  template <class Message>
  void add_input(RobotIndex robot, const std::string& suffix, Input::Kind kind) {
    const std::string& name = instance(robot).name;
    const ChannelIndex channel =
        channels_.add<Message>(name + "/" + suffix, name, "", Rate{}, true);
    fleet_.inputs.push_back({channels_[channel].bus_name, robot, kind});
  }

  void add_markers() {
    const ChannelIndex channel = channels_.add<markers_t>(kMarkersChannel, "", "", Rate{}, true);
    fleet_.inputs.push_back({channels_[channel].bus_name, RobotIndex(), Input::Kind::markers});
  }

  void add_inputs() {
    for (const RobotIndex robot : robots()) {
      if (instance(robot).model->drive) {
        add_input<velocity_command_t>(robot, "velocity", Input::Kind::velocity);
        add_input<wheel_command_t>(robot, "wheels", Input::Kind::wheels);
        add_input<move_command_t>(robot, "move", Input::Kind::move);
      }
      if (!layout_.robots[robot].joints.empty() || !instance(robot).model->holds.empty()) {
        add_input<joint_command_t>(robot, "joint_command", Input::Kind::joints);
      }
      add_input<fault_t>(robot, "fault", Input::Kind::fault);
      fleet_.inputs.push_back({"", robot, Input::Kind::reset_odometry});
    }
  }

  const world::WorldModel& world_;
  const world::BodyLayout& layout_;
  const FleetOptions& options_;
  Channels& channels_;
  Findings& findings_;
  std::exception_ptr channel_refused_;  // why the device being created cannot have a channel
  std::vector<int> device_channels_;    // of the device being created
  Fleet fleet_;
  std::set<std::string> disabled_;  // "ROBOT/DEVICE"
  IndexedVector<RobotIndex, std::vector<device_info_t>> devices_of_;
};

}  // namespace

Pose initial_pose(const world::BodyLayout& layout, LinkIndex link) {
  const world::LinkPlacement& placement = layout.links[link];
  return placement.body.valid() ? layout.bodies[placement.body].X_WB * placement.X_BL
                                : placement.X_BL;
}

Fleet make_fleet(const world::WorldModel& world, const world::BodyLayout& layout,
                 const FleetOptions& options, Channels& channels, Findings& findings) {
  return FleetMaker(world, layout, options, channels, findings).make();
}

}  // namespace ruedo::engine
