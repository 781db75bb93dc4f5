// ruedo nav2-params: what Nav2 and slam_toolbox have to know of a robot, as a file of ROS
// parameters. Names and defaults are those of Nav2 1.3 (Jazzy) and 1.4 (Kilted).
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "bridges/ros2/messages/conversions.h"
#include "cli/support/commands.h"
#include "cli/support/find_all.h"
#include "engine/fleet.h"
#include "engine/world_info.h"
#include "ruedo/element.h"
#include "ruedo/errors.h"
#include "ruedo/math.h"
#include "world/model/footprint.h"

namespace ruedo::cli {
namespace {

struct Nav2Arguments {
  WorldArguments world;
  std::string robot, name;
};

// Nav2 takes no integer where it declares a number.
std::string number(double value) {
  std::string text = fmt::format("{:.6g}", value + 0.0);  // not -0
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

struct LaserTopic {
  std::string source, topic, type;  // a name for Nav2, "/scan", "LaserScan" or "PointCloud2"
  double nearest, furthest;         // m
};

struct Robot {
  std::string name;
  const world::DriveDescription* drive;
  world::Footprint footprint;
  std::string odometry;  // its topic
  std::vector<LaserTopic> lasers;

  bool moves_sideways() const {
    using Steering = world::DriveDescription::Steering;
    return drive->steering == Steering::mecanum || drive->steering == Steering::omni ||
           drive->steering == Steering::holonomic;
  }
  double turning_radius() const {  // m; 0: it turns on the spot
    return drive->max_steering_angle > 0 ? drive->wheelbase / math::tan(drive->max_steering_angle)
                                         : 0.0;
  }
};

// Limits that the robot does not have are Nav2's.
struct Limits {
  double speed, side_speed, turn_rate, acceleration, deceleration, turn_acceleration;

  explicit Limits(const Robot& robot) {
    const auto or_else = [](double value, double nav2) {
      return std::isfinite(value) ? value : nav2;
    };
    const world::DriveDescription& drive = *robot.drive;
    speed = or_else(drive.max_speed, 0.5);
    side_speed = robot.moves_sideways() ? or_else(drive.max_side_speed, speed) : 0.0;
    turn_rate = or_else(drive.max_turn_rate, 1.9);
    if (const double radius = robot.turning_radius(); radius > 0)
      turn_rate = std::min(turn_rate, speed / radius);
    acceleration = or_else(drive.acceleration, 2.5);
    deceleration = or_else(drive.deceleration, acceleration);
    turn_acceleration = or_else(drive.turn_acceleration, 3.2);
  }
};

class Yaml {
 public:
  Yaml& node(const std::string& name) {
    text_ += "\n" + name + ":\n  ros__parameters:\n";
    return in(4);
  }
  Yaml& in(size_t indent) {
    indent_ = indent;
    return *this;
  }
  Yaml& put(const std::string& line) {
    text_ += std::string(indent_, ' ') + line + "\n";
    return *this;
  }
  Yaml& put(const char* name, double value) {
    return put(std::string(name) + ": " + number(value));
  }
  Yaml& open(const std::string& name) {
    put(name + ":");
    return in(indent_ + 2);
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  size_t indent_ = 0;
};

std::string triple(double x, double y, double turn) {
  return fmt::format("[{}, {}, {}]", number(x), number(y), number(turn));
}

void put_controller(Yaml& yaml, const Robot& robot, const Limits& limits) {
  yaml.node("controller_server").put("odom_topic: " + robot.odometry).open("FollowPath");
  yaml.put("# Model predictive path integral (MPPI)");
  const char* motion = robot.moves_sideways()       ? "Omni"
                       : robot.turning_radius() > 0 ? "Ackermann"
                                                    : "DiffDrive";
  yaml.put(std::string("motion_model: ") + motion);
  yaml.put("vx_max", limits.speed).put("vx_min", -std::min(0.35, limits.speed));
  yaml.put("vy_max", limits.side_speed).put("wz_max", limits.turn_rate);
  yaml.put("ax_max", limits.acceleration).put("ax_min", -limits.deceleration);
  yaml.put("ay_max", limits.acceleration).put("az_max", limits.turn_acceleration);
  if (robot.turning_radius() > 0)
    yaml.put("AckermannConstraints: {min_turning_r: " + number(robot.turning_radius()) + "}");
  yaml.put("# Regulated pure pursuit");
  yaml.put("desired_linear_vel", limits.speed);
  yaml.put("rotate_to_heading_angular_vel", limits.turn_rate);
  yaml.put("max_angular_accel", limits.turn_acceleration);
  yaml.put("# DWB");
  yaml.put("max_vel_x", limits.speed).put("max_speed_xy", limits.speed);
  yaml.put("max_vel_y", limits.side_speed).put("max_vel_theta", limits.turn_rate);
  yaml.put("acc_lim_x", limits.acceleration).put("decel_lim_x", -limits.deceleration);
  yaml.put("acc_lim_theta", limits.turn_acceleration);
  yaml.put("decel_lim_theta", -limits.turn_acceleration);
}

void put_costmap(Yaml& yaml, const Robot& robot, const char* costmap, const char* layer,
                 const char* frame) {
  yaml.in(0).put("").put(std::string(costmap) + ":").in(2).put(std::string(costmap) + ":");
  yaml.in(4).put("ros__parameters:").in(6);
  yaml.put(std::string("global_frame: ") + frame).put("robot_base_frame: base_link");
  if (robot.footprint.is_round || robot.footprint.corners.empty()) {
    yaml.put("robot_radius", robot.footprint.radius);
  } else {
    std::string corners;
    for (const Eigen::Vector2d& corner : robot.footprint.corners)
      corners +=
          fmt::format("{}[{:.4f}, {:.4f}]", corners.empty() ? "" : ", ", corner.x(), corner.y());
    yaml.put("footprint: \"[" + corners + "]\"");
  }
  if (robot.lasers.empty()) return;
  std::string sources;
  for (const LaserTopic& laser : robot.lasers)
    sources += (sources.empty() ? "" : " ") + laser.source;
  yaml.open(layer).put("observation_sources: " + sources);
  for (const LaserTopic& laser : robot.lasers) {
    yaml.in(8).open(laser.source).put("topic: " + laser.topic).put("data_type: " + laser.type);
    yaml.put("clearing: true").put("marking: true").put("max_obstacle_height", 2.0);
    yaml.put("obstacle_min_range", laser.nearest).put("raytrace_min_range", laser.nearest);
    yaml.put("obstacle_max_range", std::min(2.5, laser.furthest));
    yaml.put("raytrace_max_range", std::min(3.0, laser.furthest));
  }
}

void put_rest(Yaml& yaml, const Robot& robot, const Limits& limits) {
  yaml.node("behavior_server").put("robot_base_frame: base_link");
  yaml.put("max_rotational_vel", limits.turn_rate);
  yaml.put("min_rotational_vel", std::min(0.4, limits.turn_rate / 2));
  yaml.put("rotational_acc_lim", limits.turn_acceleration);
  yaml.node("velocity_smoother").put("odom_topic: " + robot.odometry);
  yaml.put("max_velocity: " + triple(limits.speed, limits.side_speed, limits.turn_rate));
  yaml.put("min_velocity: " + triple(-limits.speed, -limits.side_speed, -limits.turn_rate));
  const double sideways = limits.side_speed > 0 ? 1.0 : 0.0;
  yaml.put("max_accel: " +
           triple(limits.acceleration, sideways * limits.acceleration, limits.turn_acceleration));
  yaml.put("max_decel: " + triple(-limits.deceleration, -sideways * limits.deceleration,
                                  -limits.turn_acceleration));
  // Relative, since each robot of several has its own.
  yaml.node("collision_monitor").put("base_frame_id: base_link").open("FootprintApproach");
  yaml.put("footprint_topic: local_costmap/published_footprint").in(4);
  std::vector<std::string> sources;
  for (const LaserTopic& laser : robot.lasers) sources.push_back('"' + laser.source + '"');
  if (!sources.empty())
    yaml.put(fmt::format("observation_sources: [{}]", fmt::join(sources, ", ")));
  for (const LaserTopic& laser : robot.lasers) {
    yaml.in(4).open(laser.source).put("topic: " + laser.topic);
    yaml.put(laser.type == "LaserScan" ? "type: scan" : "type: pointcloud");
  }
  yaml.node("docking_server").put("base_frame: base_link").open("controller");
  yaml.put("costmap_topic: local_costmap/costmap_raw");
  yaml.put("footprint_topic: local_costmap/published_footprint");
}

std::string parameters_of(const Robot& robot) {
  const Limits limits(robot);
  const auto scan = std::find_if(robot.lasers.begin(), robot.lasers.end(),
                                 [](const LaserTopic& each) { return each.type == "LaserScan"; });
  Yaml yaml;
  yaml.put("# What Nav2 and slam_toolbox have to know of " + robot.name +
           "; made by `ruedo nav2-params`. m, rad, s.");
  yaml.put("# ruedo_ros's nav2.launch.py merges them into nav2_bringup's nav2_params.yaml.");
  yaml.node("amcl").put("base_frame_id: base_link").put("odom_frame_id: odom");
  yaml.put(fmt::format("robot_model_type: nav2_amcl::{}MotionModel",
                       robot.moves_sideways() ? "Omni" : "Differential"));
  if (scan != robot.lasers.end()) {
    yaml.put("scan_topic: " + scan->topic).put("laser_min_range", scan->nearest);
    yaml.put("laser_max_range", scan->furthest);
  }
  yaml.node("bt_navigator").put("robot_base_frame: base_link").put("odom_topic: " + robot.odometry);
  yaml.put("default_server_timeout: 500  # ms; Nav2's 20 fail on a machine that also simulates");
  put_controller(yaml, robot, limits);
  put_costmap(yaml, robot, "local_costmap", "voxel_layer", "odom");
  put_costmap(yaml, robot, "global_costmap", "obstacle_layer", "map");
  if (const double radius = robot.turning_radius(); radius > 0) {
    yaml.node("planner_server").open("GridBased");
    yaml.put("plugin: nav2_smac_planner::SmacPlannerHybrid");
    yaml.put("motion_model_for_search: REEDS_SHEPP").put("minimum_turning_radius", radius);
  }
  put_rest(yaml, robot, limits);
  yaml.node("slam_toolbox").put("base_frame: base_link").put("odom_frame: odom");
  if (scan != robot.lasers.end()) {
    yaml.put("scan_topic: " + scan->topic).put("max_laser_range", scan->furthest);
  }
  return yaml.text();
}

// Its topics are those of `ruedo run --ros2`.
void find_topics(Robot& robot, const std::vector<world_info_t>& info, size_t robots) {
  ros2::ConversionOptions options;
  options.root = robots == 1 ? robot.name : "";
  ros2::Names names(options.root, {});
  const ros2::Conversions conversions(info, options, names);
  for (const world_info_t& part : info) {
    for (const channel_info_t& channel : part.channels) {
      if (channel.robot != robot.name) continue;
      for (const size_t index : conversions.topics_of(channel.name)) {
        const ros2::Topic& topic = conversions.topics()[index];
        const std::string type = topic.type.substr(topic.type.rfind('/') + 1);
        if (type == "Odometry" && topic.name.ends_with("/odom")) robot.odometry = topic.name;
        if (topic.type == "sensor_msgs/msg/LaserScan" ||
            topic.type == "sensor_msgs/msg/PointCloud2")
          robot.lasers.push_back({ros2::ros_name(channel.device), topic.name, type, 0.0, 0.0});
      }
    }
  }
  for (const world_info_t& part : info) {
    for (const device_info_t& device : part.devices) {
      for (LaserTopic& laser : robot.lasers) {
        if (device.robot == robot.name && ros2::ros_name(device.name) == laser.source)
          laser.nearest = device.range_min, laser.furthest = device.range_max;
      }
    }
  }
}

std::vector<world_info_t> info_of(const WorldArguments& arguments, const world::WorldModel& world) {
  const world::BodyLayout layout(world);
  engine::Channels channels;
  Findings findings;
  engine::FleetOptions options;
  options.disabled = arguments.disabled;
  const engine::Fleet fleet = engine::make_fleet(world, layout, options, channels, findings);
  return engine::make_world_info({}, world, layout, fleet.devices, channels);
}

Robot choose(const Nav2Arguments& arguments, const world::WorldModel& world, size_t& robots) {
  std::vector<std::string> names;
  Robot chosen{};
  for (const world::ModelInstance& model : world.models) {
    if (!model.is_robot() || model.removed || !model.model->drive) continue;
    names.push_back(model.name);
    if (arguments.name.empty() ? names.size() == 1 : model.name == arguments.name)
      chosen = {model.name, &*model.model->drive, world::footprint(*model.model), "/odom", {}};
  }
  robots = names.size();
  if (names.empty()) throw InputError({}, arguments.robot + ": has no robot with a drive");
  if (arguments.name.empty() && names.size() > 1)
    throw InputError({}, fmt::format("{}: has several robots; choose one by --robot: {}",
                                     arguments.robot, fmt::join(names, ", ")));
  if (!chosen.drive)
    throw InputError({}, fmt::format("--robot: there is no '{}' in {}; there are {}",
                                     arguments.name, arguments.robot, fmt::join(names, ", ")));
  return chosen;
}

int nav2_params(Nav2Arguments arguments) {
  std::error_code error;
  arguments.world.world = arguments.robot;
  if (!std::filesystem::exists(arguments.robot, error) &&
      arguments.robot.find_first_of("./") == std::string::npos)
    arguments.world.world = "empty", arguments.world.spawns = {arguments.robot + "@0,0"};
  const auto world = load(arguments.world);
  check_options(arguments.world, *world);
  size_t robots = 0;
  Robot robot = choose(arguments, *world, robots);
  find_topics(robot, info_of(arguments.world, *world), robots);
  fmt::print("{}", parameters_of(robot));
  return kGood;
}

void add_nav2_params(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "nav2-params", "print the parameters of Nav2 and slam_toolbox that depend on a robot");
  const auto arguments = std::make_shared<Nav2Arguments>();
  command
      ->add_option("ROBOT", arguments->robot,
                   "one of Ruedo's (p3at), or a file with a robot: SDF, URDF or a world")
      ->required();
  command->add_option("--robot", arguments->name, "which robot of a world that has several")
      ->type_name("NAME");
  command->callback(
      [arguments, &chosen] { chosen = [arguments] { return nav2_params(*arguments); }; });
}

const RegisterCommand kRegister{47, add_nav2_params};

}  // namespace
}  // namespace ruedo::cli
