// A robot: its devices by what ruedo/info says of them, and its commands.
#include <algorithm>
#include <cmath>
#include <set>

#include "core.h"
#include "joint.h"
#include "ruedo/move_command_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"

namespace ruedo::client {
namespace {

// By what ruedo/info says, since names on the bus may be remapped.
const std::vector<ChannelInfo>& channels_of(const WorldInfo& info, const std::string& robot) {
  static const std::vector<ChannelInfo> none;
  const auto found = info.channels.find(robot);
  return found == info.channels.end() ? none : found->second;
}

const std::vector<DeviceInfo>& devices_of(const WorldInfo& info, const std::string& robot) {
  static const std::vector<DeviceInfo> none;
  const auto found = info.devices.find(robot);
  return found == info.devices.end() ? none : found->second;
}

std::string names_of(const std::vector<DeviceInfo>& devices) {
  std::string names;
  for (const DeviceInfo& device : devices) names += (names.empty() ? "" : ", ") + device.name;
  return names.empty() ? "none" : names;
}

std::shared_ptr<StreamCore> stream_of(Core& core, const std::string& robot,
                                      const std::string& channel) {
  const auto info = core.info();
  for (const ChannelInfo& found : channels_of(*info, robot)) {
    if (found.name == channel) return core.stream(found);
  }
  throw UnknownName(robot + " has no channel '" + channel + "'");
}

template <class SampleType>
Device<SampleType> first_device(Core& core, const std::string& robot, const char* what) {
  core.robot_info(robot);
  const auto info = core.info();
  for (const DeviceInfo& device : devices_of(*info, robot)) {
    if (device.type == message_type<SampleType>())
      return {stream_of(core, robot, device.channel), device};
  }
  throw UnknownName(robot + " has no " + what + "; it has " + names_of(devices_of(*info, robot)));
}

template <class SampleType>
Stream<SampleType> first_stream(Core& core, const std::string& robot, const char* what) {
  core.robot_info(robot);
  const auto info = core.info();
  for (const ChannelInfo& channel : channels_of(*info, robot)) {
    if (channel.type == message_type<SampleType>() && !channel.input)
      return Stream<SampleType>(core.stream(channel));
  }
  throw UnknownName(robot + " publishes no " + what);
}

template <class SampleType>
Stream<SampleType> camera_part(Core& core, const DeviceInfo& camera, const std::string& part) {
  const auto info = core.info();
  for (const ChannelInfo& channel : channels_of(*info, camera.robot)) {
    const bool named = channel.device == camera.name + "/" + part ||
                       (channel.device == camera.name && channel.name.ends_with("/" + part));
    if (named && channel.type == message_type<SampleType>()) {
      return Stream<SampleType>(core.stream(channel));
    }
  }
  throw UnknownName(camera.robot + "/" + camera.name + " publishes no " + part +
                    "; <ruedo:" + part + "> in the world file switches it on");
}

std::string input_channel(Core& core, const std::string& robot, const std::string& type,
                          const std::string& lack = "") {
  const bool drives = !core.robot_info(robot).drive.empty();
  const auto info = core.info();
  for (const ChannelInfo& channel : channels_of(*info, robot)) {
    if (channel.input && channel.type == type) return channel.name;
  }
  if (!lack.empty()) throw NotSupported(robot + " takes no " + type + ": " + lack);
  if (!drives)
    throw NotSupported(robot + " cannot be driven: its model has no drive; --drive " + robot +
                       "=LEFT+...,RIGHT+... gives it one, by its wheel joints");
  throw NotSupported(robot + " takes no " + type);
}

double finite(const char* name, double value) {
  if (!std::isfinite(value)) {
    throw std::invalid_argument(std::string(name) + " is " + text_of(value) +
                                ": it must be a finite number");
  }
  return value;
}

double limit(const char* name, double value) {
  if (!std::isfinite(value) || value < 0.0) {
    throw std::invalid_argument(std::string(name) + " is " + text_of(value) +
                                ": it must be a finite number >= 0; 0 is the robot's own limit");
  }
  return value;
}

void listen(Core& core, const std::string& robot, Driver& driver) {
  const auto info = core.info();
  std::shared_ptr<StreamCore> motion, collisions;
  for (const ChannelInfo& channel : channels_of(*info, robot)) {
    if (channel.input) continue;
    if (!motion && channel.type == message_type<MotionStatus>()) motion = core.stream(channel);
    if (!collisions && channel.type == message_type<Collisions>())
      collisions = core.stream(channel);
  }
  if (!motion) throw NotSupported(robot + " publishes no motion status");
  driver.listen(motion, collisions);
}

// in_steps: the call to make in lockstep, where what is sent beside the steps would act at whatever
// step the run has reached.
void check_acts_at_once(const Core& core, const std::string& in_steps) {
  if (core.in_lockstep())
    throw NotSupported(
        "in lockstep a command acts at a step that its client chooses: sim.step(n, {robot." +
        in_steps + "})");
}

std::shared_ptr<Driver> driver_of(Core& core, const std::string& robot,
                                  const std::string& in_steps) {
  const auto driver = core.driver(robot);
  check_acts_at_once(core, in_steps);
  return driver;
}

void keep_sending(Core& core, const std::string& robot, Command command,
                  const std::string& in_steps) {
  const auto driver = driver_of(core, robot, in_steps);
  listen(core, robot, *driver);
  driver->keep_sending(core.bus(), command.channel, std::move(command.bytes));
  core.keep_repeating(driver);
}

move_command_t move_message(Core& core, int8_t kind, double value, double radius,
                            const Limits& limits) {
  move_command_t command{};
  command.utime = core.utime();
  command.kind = kind;
  command.value = finite("value", value);
  command.radius = finite("radius", radius);
  command.speed = limit("speed", limits.speed);
  command.acceleration = limit("acceleration", limits.acceleration);
  command.deceleration = limit("deceleration", limits.deceleration);
  return command;
}

Motion move(Core& core, const std::string& robot, const char* name, int8_t kind, double value,
            double radius, const Limits& limits) {
  move_command_t command = move_message(core, kind, value, radius, limits);
  const std::string channel = input_channel(core, robot, "move_command_t");
  const std::string primitive = to_string(static_cast<MotionKind>(kind));
  const auto driver = driver_of(core, robot, "move_command(MotionKind::" + primitive + ", ...)");
  listen(core, robot, *driver);
  command.id = core.next_id();
  Motion motion(driver->move(core.bus(), channel, command, name));
  core.keep_repeating(driver);
  return motion;
}

velocity_command_t velocity_message(Core& core, double v, double omega, double vy) {
  velocity_command_t command{};
  command.utime = core.utime();
  command.vx = finite("v", v);
  command.omega = finite("omega", omega);
  command.vy = finite("vy", vy);
  return command;
}

wheel_command_t wheel_message(Core& core, double left, double right) {
  wheel_command_t command{};
  command.utime = core.utime();
  command.rate = {finite("left", left), finite("right", right)};
  command.n = 2;
  return command;
}

}  // namespace

Camera::Camera(std::shared_ptr<Core> core, std::shared_ptr<StreamCore> stream, DeviceInfo info)
    : Device<Image>(std::move(stream), std::move(info)), connection_(std::move(core)) {}
Stream<Image> Camera::depth() const { return camera_part<Image>(*connection_, info(), "depth"); }
Stream<Image> Camera::labels() const { return camera_part<Image>(*connection_, info(), "labels"); }
Stream<CameraInfo> Camera::intrinsics() const {
  return camera_part<CameraInfo>(*connection_, info(), "info");
}

RobotInfo Robot::info() const { return core_->robot_info(name_); }

Stream<RawSample> Robot::raw_stream(const std::string& name) const {
  core_->robot_info(name_);
  const auto info = core_->info();
  std::string there;
  for (const ChannelInfo& channel : channels_of(*info, name_)) {
    if (channel.input) continue;
    if (channel.device == name || channel.name == name || channel.name == name_ + "/" + name)
      return Stream<RawSample>(core_->stream(channel, true));
    there += (there.empty() ? "" : ", ") + (channel.device.empty() ? channel.name : channel.device);
  }
  throw UnknownName(name_ + " publishes no '" + name + "'; it publishes " +
                    (there.empty() ? "nothing" : there));
}

std::vector<DeviceInfo> Robot::devices() const {
  core_->robot_info(name_);
  return devices_of(*core_->info(), name_);
}

template <class SampleType>
Device<SampleType> Robot::device(const std::string& name) const {
  const std::vector<DeviceInfo> all = devices();
  for (const DeviceInfo& device : all) {
    if (device.name != name) continue;
    if (device.type != message_type<SampleType>()) {
      throw TypeMismatch(name_ + "/" + name + " sends " + device.type + ", not " +
                         message_type<SampleType>());
    }
    return {stream_of(*core_, name_, device.channel), device};
  }
  throw UnknownName(name_ + " has no device '" + name + "'; it has " + names_of(all));
}

#define RUEDO_DEVICE(SampleType, type) \
  template Device<SampleType> Robot::device(const std::string&) const;
RUEDO_SAMPLE_TYPES(RUEDO_DEVICE)
#undef RUEDO_DEVICE

Device<Scan> Robot::lrf() const { return first_device<Scan>(*core_, name_, "laser range finder"); }
Device<LidarScan> Robot::lidar() const {
  return first_device<LidarScan>(*core_, name_, "laser scanner with several layers");
}
Device<SonarReading> Robot::sonar() const {
  return first_device<SonarReading>(*core_, name_, "sonar");
}
Device<Odometry> Robot::odometry() const {
  return first_device<Odometry>(*core_, name_, "odometry");
}
Stream<OdometryTwist> Robot::odometry_twist() const {
  return first_stream<OdometryTwist>(*core_, name_, "velocity of odometry");
}
Camera Robot::camera(const std::string& name) const {
  const Device<Image> found = device<Image>(name);
  return {core_, stream_of(*core_, name_, found.channel()), found.info()};
}
Device<Boxes2D> Robot::boxes_2d() const {
  return first_device<Boxes2D>(*core_, name_, "bounding box camera");
}
Device<Boxes3D> Robot::boxes_3d() const {
  return first_device<Boxes3D>(*core_, name_, "bounding box camera in space");
}
Device<Imu> Robot::imu() const { return first_device<Imu>(*core_, name_, "IMU"); }
Device<NavSat> Robot::gps() const {
  return first_device<NavSat>(*core_, name_, "satellite receiver");
}
Device<Magnetometer> Robot::magnetometer() const {
  return first_device<Magnetometer>(*core_, name_, "magnetometer");
}
Device<Altimeter> Robot::altimeter() const {
  return first_device<Altimeter>(*core_, name_, "altimeter");
}
Device<AirPressure> Robot::air_pressure() const {
  return first_device<AirPressure>(*core_, name_, "barometer");
}
Device<AirSpeed> Robot::air_speed() const {
  return first_device<AirSpeed>(*core_, name_, "air speed sensor");
}
Device<ForceTorque> Robot::force_torque() const {
  return first_device<ForceTorque>(*core_, name_, "force-torque sensor");
}
Device<LogicalCamera> Robot::logical_camera() const {
  return first_device<LogicalCamera>(*core_, name_, "logical camera");
}
Device<Contact> Robot::contact() const {
  return first_device<Contact>(*core_, name_, "contact sensor");
}
Stream<Collisions> Robot::collisions() const {
  return first_stream<Collisions>(*core_, name_, "collisions");
}
Subscription Robot::on_collision(std::function<void(const Collisions&)> callback) const {
  if (!callback) return collisions().on_sample({});
  return collisions().on_sample([callback = std::move(callback), touched = std::set<std::string>()](
                                    const Collisions& sample) mutable {
    std::set<std::string> now;
    for (const ContactPoint& point : sample.points) now.insert(point.body);
    const bool news = !std::includes(touched.begin(), touched.end(), now.begin(), now.end());
    touched = std::move(now);
    if (news) callback(sample);
  });
}
Stream<Pose> Robot::pose() const { return first_stream<Pose>(*core_, name_, "true pose"); }
Stream<MotionStatus> Robot::motion() const {
  return first_stream<MotionStatus>(*core_, name_, "motion status");
}
Stream<Joints> Robot::joints() const { return first_stream<Joints>(*core_, name_, "joints"); }

Joint Robot::joint(const std::string& name) const { return {core_, name_, name}; }

void Robot::command_joints(const std::map<std::string, double>& values, JointMode mode) const {
  core_->check_open();
  check_acts_at_once(*core_, "joint_command({...})");
  const Command command = joint_command(values, mode);
  core_->bus().publish(command.channel, command.bytes.data(), command.bytes.size());
}

Command Robot::joint_command(const std::map<std::string, double>& values, JointMode mode) const {
  const std::string channel = input_channel(*core_, name_, "joint_command_t", "it has no joints");
  joint_command_t command = joint_message(name_, core_->joint_limits(name_), values, mode);
  command.utime = core_->utime();
  return {channel, encoded(command)};
}

Camera Robot::camera() const {
  const DeviceInfo camera = first_device<Image>(*core_, name_, "camera").info();
  return Camera(core_, stream_of(*core_, name_, camera.channel), camera);
}

void Robot::set_velocity(double v, double omega, double vy) const {
  keep_sending(*core_, name_, velocity_command(v, omega, vy), "velocity_command(v, omega)");
}

Driving Robot::driving(double v, double omega, double vy) const {
  set_velocity(v, omega, vy);
  return {core_, name_};
}

Driving::~Driving() {
  if (!core_) return;
  try {
    Robot(core_, robot_).stop();
  } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): closed, or the robot is gone
  }
}

void Robot::set_wheels(double left, double right) const {
  keep_sending(*core_, name_, wheel_command(left, right), "wheel_command(left, right)");
}

Command Robot::velocity_command(double v, double omega, double vy) const {
  Command command{input_channel(*core_, name_, "velocity_command_t"),
                  encoded(velocity_message(*core_, v, omega, vy))};
  const std::string drive = info().drive;
  const bool sideways =
      drive.ends_with(" mecanum") || drive.ends_with(" omni") || drive.ends_with(" holonomic");
  if (vy != 0.0 && !sideways)
    throw NotSupported("vy is " + text_of(vy) + " m/s, but " + name_ +
                       " cannot move sideways: its drive is '" + drive + "'");
  return command;
}

Command Robot::wheel_command(double left, double right) const {
  return {input_channel(*core_, name_, "wheel_command_t"),
          encoded(wheel_message(*core_, left, right))};
}

Command Robot::move_command(MotionKind kind, double value, Limits limits, double radius) const {
  if (kind < MotionKind::advance || kind > MotionKind::stop) {
    throw std::invalid_argument(std::string("kind is ") + to_string(kind) +
                                ": it must be advance, rotate, heading, arc or stop");
  }
  move_command_t command = move_message(*core_, static_cast<int8_t>(kind), value, radius, limits);
  command.id = core_->next_id();
  return {input_channel(*core_, name_, "move_command_t"), encoded(command)};
}

Motion Robot::stop(double deceleration) const {
  return move(*core_, name_, "stop", move_command_t::STOP, 0.0, 0.0, {0.0, 0.0, deceleration});
}
Motion Robot::advance(double distance, Limits limits) const {
  return move(*core_, name_, "advance", move_command_t::ADVANCE, distance, 0.0, limits);
}
Motion Robot::rotate(double angle, Limits limits) const {
  return move(*core_, name_, "rotate", move_command_t::ROTATE, angle, 0.0, limits);
}
Motion Robot::turn_to(double heading, Limits limits) const {
  return move(*core_, name_, "turn_to", move_command_t::HEADING, heading, 0.0, limits);
}
Motion Robot::arc(double angle, double radius, Limits limits) const {
  if (!(radius > 0.0)) {
    throw std::invalid_argument("radius is " + text_of(radius) +
                                ": it must be > 0 m; the sign of the angle says left or right");
  }
  return move(*core_, name_, "arc", move_command_t::ARC, angle, radius, limits);
}

}  // namespace ruedo::client
