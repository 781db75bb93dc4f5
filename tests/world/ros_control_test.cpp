// Drives that the YAML files of ros_control and ros2_control define, and drives that no file
// defines.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "text_world.h"
#include "world/document/controller_files.h"
#include "world/document/yaml.h"
#include "world/load.h"
#include "world/model/body_layout.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using Steering = DriveDescription::Steering;

// A box on four wheels of radius 0.1 m, 0.6 m apart to the side and 0.5 m along. Wheels' names
// begin with `prefix`.
std::string four_wheels(const std::string& more, const std::string& prefix = "") {
  std::string text =
      "<robot name='bot'><link name='base'><inertial><mass value='9'/><inertia ixx='0.3' iyy='0.3' "
      "izz='0.3' ixy='0' ixz='0' iyz='0'/></inertial></link>";
  const std::pair<const char*, const char*> places[] = {{"front_left", "0.25 0.3 0.1"},
                                                        {"rear_left", "-0.25 0.3 0.1"},
                                                        {"front_right", "0.25 -0.3 0.1"},
                                                        {"rear_right", "-0.25 -0.3 0.1"}};
  for (const auto& [place, xyz] : places) {
    const std::string name = prefix + place;
    text += "<link name='" + name +
            "_link'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' "
            "ixz='0' iyz='0'/></inertial>"
            "<collision><origin rpy='1.5707963 0 0'/><geometry><cylinder radius='0.1' "
            "length='0.05'/></geometry></collision></link>"
            "<joint name='" +
            name + "' type='continuous'><parent link='base'/><child link='" + name +
            "_link'/><origin xyz='" + xyz + "'/><axis xyz='0 1 0'/></joint>";
  }
  return text + more + "</robot>";
}

std::string transmission(const std::string& joint) {
  return "<transmission name='t_" + joint +
         "'><type>transmission_interface/SimpleTransmission</type><joint name='" + joint +
         "'><hardwareInterface>hardware_interface/VelocityJointInterface</hardwareInterface></"
         "joint></transmission>";
}

const char* const kPackage = "<package><name>%</name></package>";
std::string package(const std::string& name) {
  return std::string(kPackage).replace(std::string(kPackage).find('%'), 1, name);
}

const DriveDescription& drive_of(const WorldModel& world) {
  const auto& drive = world.models.back().model->drive;
  if (!drive) throw std::runtime_error("no drive");
  return *drive;
}

std::vector<std::string> names(const WorldModel& world,
                               const std::vector<ModelJointIndex>& joints) {
  std::vector<std::string> list;
  for (const ModelJointIndex joint : joints)
    list.push_back(world.models.back().model->joints[joint].name);
  return list;
}

// ROS 1: the file is in a neighbouring package and nothing names it; radius and separation are the
// robot's own, times the multipliers.
TEST(RosControl, DiffDriveOfRos1) {
  TemporaryFolder folder;
  folder.write("bot_description/package.xml", package("bot_description"));
  folder.write("bot_control/package.xml", package("bot_control"));
  folder.write("bot_control/config/other.yaml", "not: [what, is, looked, for]\n");
  folder.write("bot_control/config/control.yaml", R"(bot_joints:
  type: "joint_state_controller/JointStateController"
bot_velocity_controller:
  type: "diff_drive_controller/DiffDriveController"
  left_wheel: ['front_left', 'rear_left']
  right_wheel: ['front_right', 'rear_right']
  publish_rate: 40
  cmd_vel_timeout: 0.25
  wheel_separation_multiplier: 1.5
  wheel_radius_multiplier: 0.9
  linear:
    x:
      has_velocity_limits: true
      max_velocity: 1.0
      has_acceleration_limits: true
      max_acceleration: 3.0
  angular:
    z:
      has_velocity_limits: true
      max_velocity: 2.0
      has_acceleration_limits: false
      max_acceleration: 6.0
)");
  const auto world = load_world(folder.write(
      "bot_description/urdf/bot.urdf",
      four_wheels(transmission("front_left") +
                  "<gazebo><plugin name='c' filename='libgazebo_ros_control.so'/></gazebo>")));
  EXPECT_THAT(texts(*world),
              ElementsAre("it drives as the controller 'bot_velocity_controller' of control.yaml "
                          "says, which has its joints; no plugin names the file"));
  EXPECT_EQ(world->findings[0].source.line, 4);  // yaml-cpp marks a map by its first entry
  const DriveDescription& drive = drive_of(*world);
  EXPECT_THAT(names(*world, drive.left_joints), ElementsAre("front_left", "rear_left"));
  EXPECT_THAT(names(*world, drive.right_joints), ElementsAre("front_right", "rear_right"));
  EXPECT_FALSE(drive.guessed);
  EXPECT_NEAR(drive.track, 0.6 * 1.5, 1e-12);
  EXPECT_EQ(drive.max_speed, 1.0);
  EXPECT_EQ(drive.acceleration, 3.0);
  EXPECT_EQ(drive.max_turn_rate, 2.0);
  EXPECT_TRUE(std::isinf(drive.turn_acceleration));  // its switch is off
  EXPECT_EQ(drive.watchdog_us, 250'000);
  EXPECT_DOUBLE_EQ(drive.odometry_rate.hz(), 40.0);
}

// ROS 2: the plugin names the file by its path on the author's machine; names and types are
// separate; keys contain dots.
TEST(RosControl, DiffDriveOfRos2) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", package("bot"));
  folder.write("bot/config/controllers.yaml", R"(controller_manager:
  ros__parameters:
    update_rate: 100
    joint_state_broadcaster:
      type: joint_state_broadcaster/JointStateBroadcaster
    strange:
      type: maker/StrangeController
    base:
      type: diff_drive_controller/DiffDriveController
base:
  ros__parameters:
    left_wheel_names: ["front_left", "rear_left"]
    right_wheel_names: ["front_right", "rear_right"]
    wheel_separation: 0.61
    wheel_radius: 0.11
    linear.x.max_velocity: 0.8
    linear.x.min_velocity: -0.4
    linear.x.max_acceleration: .NaN
    angular.z.max_velocity: 1.5
)");
  const std::string control =
      "<ros2_control name='s' type='system'><joint name='front_left'><command_interface "
      "name='velocity'/></joint></ros2_control>";
  const auto world = load_world(folder.write(
      "bot/urdf/bot.urdf",
      four_wheels(control + "<gazebo><plugin name='gz_ros2_control::GazeboSimROS2ControlPlugin' "
                            "filename='libgz_ros2_control-system.so'>"
                            "<parameters>/opt/ros/jazzy/share/bot/config/controllers.yaml</"
                            "parameters></plugin></gazebo>")));
  EXPECT_THAT(
      texts(*world),
      ElementsAre(
          "controllers of type 'maker/StrangeController' are not known; 'strange' does nothing",
          "controller 'base': min_velocity is not kept: it is as fast both ways as max_velocity "
          "says"));
  const DriveDescription& drive = drive_of(*world);
  EXPECT_EQ(drive.wheel_radius, 0.11);
  EXPECT_EQ(drive.track, 0.61);
  EXPECT_EQ(drive.max_speed, 0.8);
  EXPECT_TRUE(std::isinf(drive.acceleration));
  EXPECT_EQ(drive.max_turn_rate, 1.5);
  EXPECT_EQ(drive.watchdog_us, 500'000);  // diff_drive_controller's own
}

TEST(RosControl, MecanumAndSteeringControllers) {
  TemporaryFolder folder;
  folder.write("package.xml", package("bot"));
  folder.write("config/c.yaml", R"(/**:
  mecanum:
    ros__parameters:
      type: mecanum_drive_controller/MecanumDriveController
      front_left_wheel_command_joint_name: front_left
      front_right_wheel_command_joint_name: front_right
      rear_left_wheel_command_joint_name: rear_left
      rear_right_wheel_command_joint_name: rear_right
      kinematics:
        wheels_radius: 0.1
        sum_of_robot_center_projection_on_X_Y_axis: 0.55
)");
  const auto world = load_world(folder.write("bot.urdf", four_wheels(transmission("front_left"))));
  EXPECT_EQ(drive_of(*world).steering, Steering::mecanum);
  EXPECT_NEAR(drive_of(*world).track, 0.6, 1e-12);
  EXPECT_NEAR(drive_of(*world).wheelbase, 0.5, 1e-12);
}

// Rear wheels, and front wheels on knuckles: 0.8 m apart along, 0.6 m across. `more`: of the model.
std::string car(const std::string& more) {
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' "
      "iyz='0'/></inertial>";
  const auto wheel = [&](const std::string& name, const std::string& parent,
                         const std::string& xyz) {
    return "<link name='" + name + "_link'>" + inertial +
           "<collision><origin rpy='1.5707963 0 0'/><geometry><cylinder radius='0.15' "
           "length='0.06'/></geometry></collision></link><joint name='" +
           name + "' type='continuous'><parent link='" + parent + "'/><child link='" + name +
           "_link'/><origin xyz='" + xyz + "'/><axis xyz='0 1 0'/></joint>";
  };
  std::string text = "<robot name='car'><link name='base'>" + inertial + "</link>";
  for (const auto& [side, y] : {std::pair("left", "0.3"), std::pair("right", "-0.3")}) {
    const std::string name = side, knuckle = name + "_steer";
    text += wheel("rear_" + name, "base", "0 " + std::string(y) + " 0.15") + "<link name='" +
            knuckle + "_link'>" + inertial + "</link><joint name='" + knuckle +
            "' type='revolute'><parent link='base'/><child link='" + knuckle +
            "_link'/><origin xyz='0.8 " + y +
            " 0.15'/><axis xyz='0 0 1'/><limit lower='-0.7' upper='0.7' effort='9' "
            "velocity='9'/></joint>" +
            wheel("front_" + name, knuckle + "_link", "0 0 0");
  }
  return text + more + "</robot>";
}

// In Humble, the steered joints are the front "wheels"; Jazzy has names of its own.
TEST(RosControl, TheWheelsOfACarAreLeftAndRight) {
  for (const char* joints :
       {"front_steering: true\n    rear_wheels_names: [rear_right, rear_left]\n"
        "    front_wheels_names: [right_steer, left_steer]\n"
        "    rear_wheel_track: 0.6\n    rear_wheels_radius: 0.15",
        "traction_joints_names: [rear_right, rear_left]\n"
        "    steering_joints_names: [right_steer, left_steer]\n"
        "    traction_track_width: 0.6\n    traction_wheels_radius: 0.15"}) {
    TemporaryFolder folder;
    folder.write("car.yaml",
                 "controller_manager:\n  ros__parameters:\n    drive:\n      type: "
                 "ackermann_steering_controller/AckermannSteeringController\ndrive:\n  "
                 "ros__parameters:\n    wheelbase: 0.8\n    " +
                     std::string(joints) + "\n");
    const auto world = load_world(folder.write(
        "car.urdf", car("<gazebo><plugin filename='gz_ros2_control-system' "
                        "name='gz_ros2_control::GazeboSimROS2ControlPlugin'><parameters>car.yaml"
                        "</parameters></plugin></gazebo>")));
    const DriveDescription& drive = drive_of(*world);
    EXPECT_EQ(drive.steering, Steering::ackermann);
    EXPECT_THAT(names(*world, drive.left_joints), ElementsAre("rear_left"));
    EXPECT_THAT(names(*world, drive.right_joints), ElementsAre("rear_right"));
    EXPECT_THAT(names(*world, drive.steer_joints), ElementsAre("right_steer", "left_steer"));
    EXPECT_NEAR(drive.track, 0.6, 1e-9);
    for (const std::string& text : texts(*world)) EXPECT_THAT(text, Not(HasSubstr("way round")));
    for (const WheelPlacement& wheel : BodyLayout(*world).wheels) {
      const std::string& name = world->models.back().model->joints[wheel.joint].name;
      EXPECT_EQ(wheel.left, name.find("left") != std::string::npos) << name;
    }
  }
}

// steer_bot_hardware_gazebo: the controller turns two joints in the middle that carry nothing; a
// second file names the wheels.
TEST(RosControl, WheelsBehindTheJointsOfACarsController) {
  const auto dummy = [](const std::string& name, const std::string& type, const std::string& x,
                        const std::string& axis) {
    return "<link name='" + name + "_link'/><joint name='" + name + "' type='" + type +
           "'><parent link='base'/><child link='" + name + "_link'/><origin xyz='" + x +
           " 0 0.3'/><axis xyz='" + axis +
           "'/><limit lower='-0.7' upper='0.7' effort='9' velocity='9'/></joint>";
  };
  TemporaryFolder folder;
  folder.write("bot/package.xml", package("bot"));
  folder.write("bot/config/controller.yaml",
               "drive:\n  type: 'ackermann_steering_controller/AckermannSteeringController'\n  "
               "rear_wheel: 'rear_wheel'\n  front_steer: 'front_steer'\n  wheel_radius: 0.15\n  "
               "linear: {x: {has_velocity_limits: true, max_velocity: 4.0}}\n");
  folder.write("bot/config/hardware.yaml",
               "steer_bot_hardware_gazebo:\n  rear_wheel: 'rear_wheel'\n  front_steer: "
               "'front_steer'\n  virtual_rear_wheels: ['rear_left', 'rear_right']\n  "
               "virtual_front_wheels: ['front_left', 'front_right']\n  virtual_front_steers: "
               "['left_steer', 'right_steer']\n");
  const auto world = load_world(folder.write(
      "bot/urdf/car.urdf",
      car(dummy("rear_wheel", "continuous", "0", "0 1 0") +
          dummy("front_steer", "revolute", "0.8", "0 0 1") +
          "<gazebo><plugin name='c' filename='libgazebo_ros_control.so'><robotSimType>"
          "steer_bot_hardware_gazebo/SteerBotHardwareGazebo</robotSimType></plugin></gazebo>")));
  const DriveDescription& drive = drive_of(*world);
  EXPECT_EQ(drive.steering, Steering::ackermann);
  EXPECT_THAT(names(*world, drive.left_joints), ElementsAre("front_left", "rear_left"));
  EXPECT_THAT(names(*world, drive.right_joints), ElementsAre("front_right", "rear_right"));
  EXPECT_THAT(names(*world, drive.steer_joints), ElementsAre("left_steer", "right_steer"));
  EXPECT_NEAR(drive.wheelbase, 0.8, 1e-9);
  EXPECT_EQ(drive.max_speed, 4.0);
}

// Launch files load such files below a name, and put arguments into them.
TEST(RosControl, AControllerAtTheRootOfItsFileAndArguments) {
  for (const char* prefix : {"", "robot_"}) {
    TemporaryFolder folder;
    folder.write("bot/package.xml", package("bot"));
    folder.write("bot/config/drive.yaml",
                 "type: diff_drive_controller/DiffDriveController\n"
                 "left_wheel: ['$(arg prefix)front_left', '$(arg prefix)rear_left']\n"
                 "right_wheel: [$(arg prefix)front_right, $(arg prefix)rear_right]\n"
                 "wheel_separation: 0.6\nwheel_radius: 0.1\n"
                 "linear: {x: {has_velocity_limits: true, max_velocity: 1.5}}\n");
    const auto world = load_world(folder.write(
        "bot/urdf/bot.urdf", four_wheels(transmission(prefix + std::string("front_left")) +
                                             transmission(prefix + std::string("front_right")),
                                         prefix)));
    EXPECT_EQ(drive_of(*world).max_speed, 1.5) << prefix;
    EXPECT_EQ(drive_of(*world).left_joints.size(), 2u) << prefix;
  }
}

// As PAL's robots have it: one file names the types, another holds the rest; and the type may stand
// among the parameters.
TEST(RosControl, SeveralFilesAreReadAsOne) {
  TemporaryFolder folder;
  const std::string plugin =
      "<gazebo><plugin name='c' filename='libgz_ros2_control-system.so'>"
      "<parameters>base.yaml</parameters><parameters>manager.yaml</parameters></plugin></gazebo>";
  const std::string base =
      "base_controller:\n  ros__parameters:\n    left_wheel_names: [front_left, rear_left]\n"
      "    right_wheel_names: [front_right, rear_right]\n    wheel_radius: 0.11\n"
      "    wheel_separation: 0.7\n";
  const std::string type = "type: diff_drive_controller/DiffDriveController\n";
  folder.write("base.yaml", base);
  folder.write("manager.yaml",
               "controller_manager:\n  ros__parameters:\n    base_controller:\n      " + type);
  const auto apart = load_world(folder.write("bot.urdf", four_wheels(plugin)));
  folder.write("base.yaml", base + "    " + type);
  folder.write("manager.yaml", "controller_manager:\n  ros__parameters:\n    update_rate: 100\n");
  const auto among = load_world(folder.write("bot.urdf", four_wheels(plugin)));
  for (const auto& world : {apart, among}) {
    EXPECT_THAT(texts(*world), IsEmpty());
    EXPECT_EQ(drive_of(*world).track, 0.7);
    EXPECT_EQ(drive_of(*world).wheel_radius, 0.11);
  }
}

// A controller of other joints is another robot's.
TEST(RosControl, IgnoresControllersOfMissingJoints) {
  TemporaryFolder folder;
  folder.write("package.xml", package("bot"));
  folder.write("config/c.yaml",
               "c:\n  type: diff_drive_controller/DiffDriveController\n  left_wheel: port\n  "
               "right_wheel: starboard\n");
  const auto world = load_world(folder.write("bot.urdf", four_wheels(transmission("front_left"))));
  EXPECT_TRUE(drive_of(*world).guessed);
}

TEST(RosControl, ReportsAMissingFile) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write(
      "bot.urdf",
      four_wheels(
          "<gazebo><plugin name='c' filename='libgazebo_ros2_control.so'><parameters>$(find "
          "x)/y.yaml</parameters></plugin></gazebo>")));
  EXPECT_THAT(texts(*world),
              testing::Contains("the controllers' file '$(find x)/y.yaml' is not found"));
}

TEST(RosControl, ReportsParametersWithoutEffectOnce) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", package("bot"));
  folder.write("bot/config/control.yaml", R"(drive:
  type: diff_drive_controller/DiffDriveController
  left_wheel: [front_left, rear_left]
  right_wheel: [front_right, rear_right]
  publish_rate: 50
  pose_covariance_diagonal: [0.001, 0.001, 0.001, 0.001, 0.001, 0.03]
  open_loop: true
  position_feedback: false
  linear: {x: {max_velocity: 1.0, startup_boost: 2.0}}
)");
  const auto world =
      load_world(folder.write("bot/urdf/bot.urdf", four_wheels(transmission("front_left"))));
  EXPECT_THAT(texts(*world),
              testing::Contains("controller 'drive': without effect here: "
                                "pose_covariance_diagonal, open_loop, linear.x.startup_boost"));
}

// A robot whose plugin names a file of that text.
std::shared_ptr<const WorldModel> named_world(const std::string& yaml) {
  TemporaryFolder folder;
  folder.write("c.yaml", yaml);
  return load_world(
      folder.write("bot.urdf", four_wheels("<gazebo><plugin name='c' "
                                           "filename='libgazebo_ros2_control.so'><parameters>"
                                           "c.yaml</parameters></plugin></gazebo>")));
}

const std::string kManager =
    "controller_manager:\n  ros__parameters:\n"
    "    base: {type: diff_drive_controller/DiffDriveController}\n"
    "    hold: {type: effort_controllers/JointTrajectoryController}\n";
const std::string kBase =
    "base:\n  ros__parameters:\n    left_wheel_names: [front_left, rear_left]\n"
    "    right_wheel_names: [front_right, rear_right]\n    wheel_separation: 0.61\n"
    "    wheel_radius: 0.11\n    linear.x.max_velocity: 1.0\n    publish_rate: 50.0\n";
const std::string kHold =
    "hold:\n  ros__parameters:\n    joints: [front_left]\n"
    "    gains: {front_left: {p: 10.0, i: 1.0, d: 0.5, i_clamp: 1.0}}\n";

std::string with(std::string text, const std::string& old, const std::string& by) {
  return text.replace(text.find(old), old.size(), by);
}

struct Wrong {
  std::string old, by, text;
  bool drives = false;  // as the file says
};

TEST(RosControl, ReportsFaultsOfAReferencedFile) {
  const std::string good = kManager + kBase + kHold;
  ASSERT_THAT(texts(*named_world(good)), IsEmpty());
  const Wrong table[] = {
      {"wheel_radius: 0.11", "wheel_radius: 0.11\n    wheel_radius: 0.3",
       "a second 'wheel_radius'; the first is in line 10"},
      {"radius: 0.11", "radius: -0.11", "<wheel_radius>: '-0.11' is not allowed"},
      {"separation: 0.61", "separation: -0.61", "<wheel_separation>: '-0.61' is not allowed"},
      {"radius: 0.11", "radius: .inf", "<wheel_radius>: '.inf'"},
      {"max_velocity: 1.0", "max_velocity: -1.0", "<max_velocity>: '-1.0'"},
      {"right_wheel_names: [front_right", "right_wheel_names: [xx",
       "controller 'base' names the joint 'xx', which the model does not have"},
      {"left_wheel_names: [front_left, rear_left]", "left_wheel_names: [rear_left, rear_left]",
       "the joint 'rear_left' is named twice"},
      {"publish_rate: 50.0", "publish_rate: -50.0", "<publish_rate>: '-50.0' is not allowed", true},
      {"publish_rate: 50.0", "publish_rate: fast", "<publish_rate>: 'fast' is not a number", true},
      {"publish_rate: 50.0", "publish_rate: 33.33333333333333", "it is 33.333333333", true},
      {"publish_rate: 50.0", "publish_rate: 1e9", "it is 1000000", true},
      {"joints: [front_left]", "joints: [nope]",
       "controller 'hold' names the joint 'nope', which the model does not have", true},
      {"gains: {front_left", "gains: {other",
       "controller 'hold': gains of the joint 'other', which is not one of its joints", true},
      {"{p: 10", "{pp: 10", "gains of the joint 'front_left': without effect here: pp", true},
      {"i_clamp: 1.0", "i_clamp_min: 5, i_clamp_max: -5",
       "gains of the joint 'front_left': i_clamp_min '5' is above 0; it counts as 0", true},
      {"i_clamp: 1.0", "i_clamp_min: -5, i_clamp_max: -5",
       "gains of the joint 'front_left': i_clamp_max '-5' is below 0; it counts as 0", true},
  };
  for (const Wrong& each : table) {
    const auto world = named_world(with(good, each.old, each.by));
    EXPECT_THAT(texts(*world), testing::Contains(HasSubstr(each.text))) << each.by;
    EXPECT_EQ(drive_of(*world).guessed, !each.drives) << each.by;
  }
}

TEST(RosControl, ReportsZeroSizes) {
  const auto world = named_world(kManager + with(kBase, "separation: 0.61", "separation: 0.0"));
  EXPECT_THAT(texts(*world),
              ElementsAre("controller 'base': wheel_separation '0.0' is not allowed; allowed is a "
                          "number above 0; it counts as if it was not there"));
  EXPECT_FALSE(drive_of(*world).guessed);
  EXPECT_NEAR(drive_of(*world).track, 0.6, 1e-12);
}

TEST(RosControl, ReportsMisspelledTypes) {
  const std::string good = kManager + kBase + kHold, type = "diff_drive_controller/DiffDrive";
  EXPECT_THAT(texts(*named_world(with(good, type + "Controller", type + "Contoller"))),
              ElementsAre("controllers of type 'diff_drive_controller/DiffDriveContoller' are not "
                          "known; 'base' drives as its name says; did you mean "
                          "'diff_drive_controller/DiffDriveController'?"));
  EXPECT_THAT(texts(*named_world(
                  with(good, type + "Controller", "diff_drive_controler/DiffDriveControler"))),
              testing::Contains("controllers of type 'diff_drive_controler/DiffDriveControler' are "
                                "not known; 'base' does nothing; did you mean "
                                "'diff_drive_controller/DiffDriveController'?"));
  EXPECT_THAT(texts(*named_world(with(good, "effort_controllers", "my_efforts_controllers"))),
              IsEmpty());  // a maker's own
}

// ROS would run one of them at a time.
TEST(RosControl, ReportsASecondDriveAndSecondGains) {
  const std::string more =
      "    base2: {type: diff_drive_controller/DiffDriveController}\n"
      "    hold2: {type: effort_controllers/JointPositionController}\n";
  const auto world = named_world(
      kManager + more + kBase + kHold + with(kBase, "base", "base2") +
      "hold2:\n  ros__parameters: {joint: front_left, pid: {p: 3.0, i: 0.0, d: 0.0}}\n");
  EXPECT_THAT(
      texts(*world),
      ElementsAre("controller 'base2' drives, too, and is left out: 'base' of c.yaml drives "
                  "the robot",
                  "gains of the joint 'front_left' are left out: it has those of another "
                  "controller already"));
}

TEST(RosControl, ReportsReferencedFilesWithoutControllers) {
  for (const std::string& text : {std::string(), std::string("hello"), std::string("- a\n- b\n"),
                                  std::string("\1\2"), std::string("a: {b: 1}\n"), kBase})
    EXPECT_THAT(texts(*named_world(text)),
                testing::Contains(testing::AnyOf(HasSubstr("holds no controller with a type"),
                                                 HasSubstr("is not YAML"))))
        << text;
  const std::string broadcaster =
      "m:\n  ros__parameters:\n    b: {type: joint_state_broadcaster/JointStateBroadcaster}\n";
  EXPECT_THAT(texts(*named_world(broadcaster)),
              testing::Not(testing::Contains(HasSubstr("holds no controller"))));
}

// Also beside others that have one, and where ROS 2's manager says nothing of a node.
TEST(RosControl, ReportsControllersWithoutAType) {
  const std::string broadcaster = "    b: {type: joint_state_broadcaster/JointStateBroadcaster}\n";
  const auto ros2 = named_world("controller_manager:\n  ros__parameters:\n" + broadcaster + kBase);
  EXPECT_THAT(texts(*ros2),
              testing::Contains("'base' names wheels or joints as a controller does, but no type "
                                "says which: it does nothing"));
  const auto ros1 = named_world("bot:\n" + broadcaster + "    arm: {joints: [front_left]}\n");
  EXPECT_THAT(texts(*ros1), testing::Contains(HasSubstr("'arm' names wheels or joints")));
  EXPECT_THAT(texts(*named_world(kManager + kBase)), IsEmpty());
}

TEST(RosControl, ReportsADriveWithoutWheels) {
  const auto world = named_world(kManager + with(kBase, "left_wheel_names", "left_wheels_names"));
  EXPECT_THAT(texts(*world), testing::Contains(HasSubstr("names no wheels: it drives nothing")));
}

// NaN and infinity in all spellings that ROS 2 reads, and its wildcard for the names of nodes,
// which counts where a node of the name says nothing.
TEST(RosControl, ReadsInfiniteLimitsAndWildcards) {
  for (const char* none : {".nan", ".NaN", ".NAN", ".inf", ".Inf", "+.INF"}) {
    const auto world = named_world(
        kManager + with(kBase, "max_velocity: 1.0", "max_velocity: " + std::string(none)));
    EXPECT_THAT(texts(*world), IsEmpty()) << none;
    EXPECT_FALSE(drive_of(*world).guessed) << none;
    EXPECT_TRUE(std::isinf(drive_of(*world).max_speed)) << none;
  }
  const auto braked = named_world(
      kManager + with(kBase, "publish_rate", "linear.x.max_deceleration: -2.0\n    publish_rate"));
  EXPECT_THAT(texts(*braked), IsEmpty());
  EXPECT_EQ(drive_of(*braked).deceleration, 2.0);
  const auto wild = named_world(
      "/**:\n  ros__parameters:\n    wheel_radius: 0.3\n    max_torque: 7\n    "
      "cmd_vel_timeout: 0.25\n" +
      kManager + kBase);
  EXPECT_THAT(texts(*wild), IsEmpty());
  EXPECT_EQ(drive_of(*wild).wheel_radius, 0.11);
  EXPECT_EQ(drive_of(*wild).watchdog_us, 250'000);
  const auto all_wild = named_world(kManager + with(kBase, "base:", "/**:"));
  EXPECT_THAT(texts(*all_wild), IsEmpty());
  EXPECT_EQ(drive_of(*all_wild).track, 0.61);
}

TEST(Yaml, NamesASecondKey) {
  EXPECT_THROW(parse_yaml("a: 1\nb: {c: 1, d: 2, c: 3}\n", "f"), InputError);
  EXPECT_NO_THROW(parse_yaml("a: {c: 1}\nb: {c: 1}\n", "f"));
}

TEST(Yaml, IsBounded) {
  EXPECT_THROW(parse_yaml("a: [", "f"), InputError);
  EXPECT_THROW(parse_yaml(std::string(2000, '['), "f"), InputError);
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string last = "*a" + std::to_string(i - 1) + ", ";
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 9; ++k) bomb += last;
    bomb += "x]\n";
  }
  EXPECT_THROW(parse_yaml(bomb, "f"), InputError);
  const std::string text = "a: &a " + std::string(200'000, 'x') + "\nb: ";
  EXPECT_NO_THROW(parse_yaml(text + "[*a, *a]", "f"));
  EXPECT_THROW(parse_yaml(text + "[*a, *a, *a, *a, *a]", "f"), InputError);
  EXPECT_THROW(parse_yaml(text + "{*a : {*a : {*a : {*a : {*a : 1}}}}}", "f"), InputError);
  EXPECT_EQ(parse_yaml("a:\n  b: [1, 2]\n", "f")->child("a/b/item")->source.line, 2);
}

TEST(Yaml, DotsOfRos2AreLevels) {
  const auto root = parse_yaml("ros__parameters:\n  a.b: 1\n  a.c.d: [2, 3]\nv1.2: 4\n", "f");
  EXPECT_EQ(root->child("ros__parameters/a/b")->text, "1");
  EXPECT_EQ(root->child("ros__parameters/a/c/d/item")->source.line, 3);
  EXPECT_EQ(root->child("ros__parameters")->children.size(), 1u);
  EXPECT_EQ(root->child("v1.2")->text, "4");
  EXPECT_THROW(parse_yaml("ros__parameters: {" + std::string(40, '.') + ": 1}", "f"), InputError);
  std::string many = "ros__parameters:\n";
  for (int i = 0; i < 11'000; ++i) many += "  a" + std::to_string(i) + ".b: 1\n";
  EXPECT_THROW(parse_yaml(many, "f"), InputError);
}

// A file costs once, however many robots ask for it, and all files together are bounded.
TEST(ControllerFiles, AreReadOnceAndAreBounded) {
  TemporaryFolder folder;
  const ResourceFinder resources(folder / "w.sdf", false);
  const std::string remark = "\n#" + std::string(250'000, 'x');
  const auto text = [&](const std::string& entries) { return "a_controller: [" + entries + "]"; };
  ControllerFiles files(resources);
  const std::string one = folder.write("one.yaml", text("1") + remark);
  const auto read = files.read(one);
  std::filesystem::remove(one);
  EXPECT_EQ(files.read(one), read);
  for (int i = 1; i < 16; ++i)
    EXPECT_NO_THROW(files.read(folder.write(std::to_string(i) + ".yaml", text("1") + remark))) << i;
  const std::string last = folder.write("last.yaml", text("1") + remark + remark.substr(0, 10'000));
  for (int i = 0; i < 2; ++i) {
    try {
      files.read(last);
      FAIL();
    } catch (const InputError& error) {
      EXPECT_EQ(error.message(), "the controller files of a world hold more than 4 MiB");
    }
  }

  ControllerFiles many(resources);
  std::string entries = "1";  // with the list and the map that hold them 10 002
  for (int i = 1; i < 10'000; ++i) entries += ",1";
  const std::string large = folder.write("large.yaml", text(entries));
  for (int i = 0; i < 99; ++i) EXPECT_NO_THROW(many.read(large)) << i;
  EXPECT_THROW(many.read(large), InputError);
}

TEST(ControllerFiles, ARepeatedReferenceIsReadOnce) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", package("bot"));
  std::string entries = "1";
  for (int i = 1; i < 2000; ++i) entries += ",1";
  folder.write("bot/config/c.yaml", "a_controller: [" + entries + "]");
  std::string named;
  for (int i = 0; i < 1000; ++i) named += "<parameters>package://bot/config/c.yaml</parameters>";
  const auto world = load_world(
      folder.write("bot/urdf/bot.urdf",
                   four_wheels("<gazebo><plugin name='c' filename='libgazebo_ros2_control.so'>" +
                               named + "</plugin></gazebo>")));
  EXPECT_THAT(texts(*world), testing::Not(testing::Contains(HasSubstr("look at no more than"))));
}

// Of a robot only so many are looked at: each looks in the parameters of all with its name.
TEST(ControllerFiles, HoldManyControllersInVain) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", package("bot"));
  std::string text = "all:\n";
  for (int i = 0; i < 100; ++i) text += "  c" + std::to_string(i) + ": {type: some/Controller}\n";
  folder.write("bot/config/c.yaml", text +
                                        "  last: {type: diff_drive_controller/DiffDriveController, "
                                        "left_wheel: front_left, right_wheel: front_right}\n");
  const auto world =
      load_world(folder.write("bot/urdf/bot.urdf", four_wheels(transmission("front_left"))));
  EXPECT_THAT(texts(*world), testing::Not(testing::Contains(HasSubstr("'last'"))));
}

// ---- Guesses.

TEST(Guess, FourWheelsByNameAndPlace) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write("bot.urdf", four_wheels("", "wheel_")));
  EXPECT_THAT(
      texts(*world),
      ElementsAre(
          "no file says how it drives; guessed from its wheels: differential, left "
          "wheel_front_left+wheel_rear_left, right "
          "wheel_front_right+wheel_rear_right (--drive bot=LEFT+...,RIGHT+... says it otherwise)"));
  EXPECT_TRUE(drive_of(*world).guessed);
  EXPECT_EQ(drive_of(*world).steering, Steering::differential);
  EXPECT_NEAR(drive_of(*world).track, 0.6, 1e-12);
  EXPECT_NEAR(drive_of(*world).wheel_radius, 0.1, 1e-12);
}

// A wheel whose mesh is smaller than the one on the other end of its axle stands as well.
TEST(Guess, AnAxleHasTwoWheels) {
  std::string text = four_wheels(transmission("a_wheel_front_left"), "a_wheel_");
  const std::string small =
      "length='0.05'/></geometry></collision></link><joint "
      "name='a_wheel_front_left'";
  const size_t at = text.rfind("radius='0.1'", text.find(small));
  text.replace(at, 12, "radius='0.06'");
  const auto world = load_world_text(text, "bot.urdf");
  EXPECT_EQ(drive_of(*world).left_joints.size(), 2u);
  EXPECT_EQ(drive_of(*world).right_joints.size(), 2u);
}

// Powered casters drive in all directions. A round link that hangs in the air is not a wheel.
TEST(Guess, PoweredCastersAndArms) {
  const std::string arm =
      "<link name='upper'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' "
      "ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><cylinder radius='0.1' "
      "length='0.3'/></geometry></collision></link><joint name='roll' type='continuous'><parent "
      "link='base'/><child link='upper'/><origin xyz='0.3 0.2 0.9'/><axis xyz='1 0 0'/></joint>"
      "<link name='fore'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' "
      "ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><cylinder radius='0.1' "
      "length='0.3'/></geometry></collision></link><joint name='fore' type='continuous'><parent "
      "link='base'/><child link='fore'/><origin xyz='0.3 -0.2 0.9'/><axis xyz='1 0 0'/></joint>";
  const auto idle = load_world_text(
      four_wheels(arm + transmission("roll") + transmission("fore"), "caster_wheel_"), "bot.urdf");
  EXPECT_FALSE(idle->models.back().model->drive);
  for (const std::string& text : texts(*idle)) EXPECT_THAT(text, Not(HasSubstr("roll")));
  const auto driven = load_world_text(
      four_wheels(arm + transmission("caster_wheel_front_left") +
                      transmission("caster_wheel_front_right") + transmission("roll"),
                  "caster_wheel_"),
      "bot.urdf");
  EXPECT_THAT(names(*driven, drive_of(*driven).left_joints),
              ElementsAre("caster_wheel_front_left"));
}

// PR2: four powered casters with two wheels each. It stood still, since each steering joint was in
// the guess twice.
TEST(Guess, CastersOfTwoWheels) {
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' "
      "iyz='0'/></inertial>";
  std::string robot = "<robot name='bot'><link name='base'>" + inertial + "</link>";
  for (const std::string caster : {"fl_caster", "fr_caster", "bl_caster", "br_caster"}) {
    const std::string at = std::string(caster[0] == 'f' ? "0.2 " : "-0.2 ") +
                           (caster[1] == 'l' ? "0.2" : "-0.2") + " 0.1";
    robot += "<link name='" + caster + "'>" + inertial + "</link><joint name='" + caster +
             "_rotation' type='continuous'><parent link='base'/><child link='" + caster +
             "'/><origin xyz='" + at + "'/><axis xyz='0 0 1'/></joint>" +
             transmission(caster + "_rotation");
    for (const std::string wheel : {"_l_wheel", "_r_wheel"}) {
      const std::string name = caster + wheel;
      robot += "<link name='" + name + "'>" + inertial +
               "<collision><geometry><sphere radius='0.08'/></geometry></collision></link>"
               "<joint name='" +
               name + "' type='continuous'><parent link='" + caster + "'/><child link='" + name +
               "'/><origin xyz='0 " + (wheel[1] == 'l' ? "0.05" : "-0.05") +
               " 0'/><axis xyz='0 1 0'/></joint>" + transmission(name);
    }
  }
  const auto world = load_world_text(robot + "</robot>", "bot.urdf");
  ASSERT_TRUE(world->models.back().model->drive);
  EXPECT_EQ(drive_of(*world).steering, Steering::holonomic);
  EXPECT_THAT(names(*world, drive_of(*world).steer_joints),
              ElementsAre("fl_caster_rotation", "fr_caster_rotation", "bl_caster_rotation",
                          "br_caster_rotation"));
  EXPECT_EQ(drive_of(*world).left_joints.size(), 4u);
  EXPECT_EQ(drive_of(*world).right_joints.size(), 4u);
}

TEST(Guess, MecanumByName) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write("bot.urdf", four_wheels("", "mecanum_wheel_")));
  EXPECT_EQ(drive_of(*world).steering, Steering::mecanum);
}

TEST(Guess, TheOptionOverridesTheGuess) {
  TemporaryFolder folder;
  LoadOptions options;
  options.drives.push_back({"bot", {"wheel_front_left"}, {"wheel_front_right"}});
  const auto world = load_world(folder.write("bot.urdf", four_wheels("", "wheel_")), options);
  EXPECT_FALSE(drive_of(*world).guessed);
  EXPECT_EQ(drive_of(*world).left_joints.size(), 1u);
}

// An arm has no wheels, and a cart that is furniture has no drive.
TEST(Guess, MakesNoRobotOfAnArmOrACart) {
  TemporaryFolder folder;
  const auto arm = load_world(folder.write(
      "arm.urdf",
      "<robot name='arm'><link name='a'/><link name='b'/><joint name='shoulder' "
      "type='continuous'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/></joint></robot>"));
  EXPECT_FALSE(arm->models.back().model->drive);
  EXPECT_THAT(texts(*arm), IsEmpty());
  std::string cart = "<model name='cart'><link name='base'/>";
  for (const char* side : {"left", "right"}) {
    const std::string name = std::string(side) + "_wheel";
    cart += "<link name='" + name + "'><pose>0 " + (side[0] == 'l' ? "0.2" : "-0.2") +
            " 0.1 0 0 0</pose><collision "
            "name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link>"
            "<joint name='" +
            name + "_joint' type='revolute'><parent>base</parent><child>" + name +
            "</child><axis><xyz>0 1 0</xyz></axis></joint>";
  }
  EXPECT_FALSE(world_of(cart + "</model>")->models[0].model->drive);
  EXPECT_TRUE(world_of(cart + "<plugin name='c' filename='libgazebo_ros_control.so'/></model>")
                  ->models[0]
                  .model->drive);
}

}  // namespace
}  // namespace ruedo::world
