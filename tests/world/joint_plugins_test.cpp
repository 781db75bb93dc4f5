// How joint controllers in Gazebo's and ROS's files are read.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "text_world.h"
#include "world/load.h"

namespace ruedo::world {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string arm(const std::string& plugins) {
  return "<model name='arm'><link name='base'/><link name='a'/><link name='b'/>"
         "<joint name='one' type='revolute'><parent>base</parent><child>a</child><axis><xyz>0 0 1"
         "</xyz></axis></joint><joint name='two' type='revolute'><parent>a</parent><child>b</child>"
         "<axis><xyz>0 0 1</xyz></axis></joint>" +
         plugins + "</model>";
}

std::string plugin(const std::string& system, const std::string& inside) {
  return "<plugin name='gz::sim::systems::" + system + "' filename='f'>" + inside + "</plugin>";
}

const JointAxis& axis(const WorldModel& world, size_t joint) {
  return world.models.back().model->joints.at(joint).axis;
}

// The defaults of gz-sim's JointPositionController.
TEST(JointPlugins, APositionControllersDefaults) {
  const auto world =
      world_of(arm(plugin("JointPositionController", "<joint_name>one</joint_name>")));
  EXPECT_THAT(texts(*world), IsEmpty());
  const Pid pid = axis(*world, 0).position_pid.value();
  EXPECT_EQ(pid.p, 1.0);
  EXPECT_EQ(pid.i, 0.1);
  EXPECT_EQ(pid.d, 0.01);
  EXPECT_EQ(pid.i_min, -1.0);
  EXPECT_EQ(pid.i_max, 1.0);
  EXPECT_EQ(pid.least, -1000.0);
  EXPECT_EQ(pid.most, 1000.0);
  EXPECT_EQ(axis(*world, 0).start.mode, JointStart::Mode::position);
  EXPECT_FALSE(axis(*world, 1).position_pid);
  EXPECT_EQ(axis(*world, 1).start.mode, JointStart::Mode::free);
}

TEST(JointPlugins, SeveralJointsOfOneAndLimitsTheWrongWayRound) {
  const auto world = world_of(
      arm(plugin("JointPositionController",
                 "<joint_name>one</joint_name><joint_name>two</joint_name><p_gain>7</p_gain>"
                 "<cmd_max>-1</cmd_max><cmd_min>0</cmd_min><initial_position>0.2"
                 "</initial_position>")));
  for (const size_t joint : {0u, 1u}) {
    EXPECT_EQ(axis(*world, joint).position_pid.value().p, 7.0);
    EXPECT_EQ(axis(*world, joint).position_pid.value().most, Pid::kNone);
    EXPECT_EQ(axis(*world, joint).start.value, 0.2);
  }
}

TEST(JointPlugins, ATrajectoryControllersGainsAreOfEachJoint) {
  const auto world = world_of(
      arm(plugin("JointTrajectoryController",
                 "<joint_name>two</joint_name><position_p_gain>20</position_p_gain>"
                 "<position_d_gain>2</position_d_gain><velocity_p_gain>0.5</velocity_p_gain>"
                 "<joint_name>one</joint_name><position_p_gain>30</position_p_gain>"
                 "<position_cmd_min>-9</position_cmd_min><position_cmd_max>9</position_cmd_max>")));
  EXPECT_EQ(axis(*world, 1).position_pid.value().p, 20.0);
  EXPECT_EQ(axis(*world, 1).position_pid.value().d, 2.5);
  EXPECT_EQ(axis(*world, 1).position_pid.value().most, 9.0);
  EXPECT_EQ(axis(*world, 1).rate_pid.value().p, 0.5);
  EXPECT_EQ(axis(*world, 0).position_pid.value().p, 30.0);
  EXPECT_EQ(axis(*world, 0).position_pid.value().most, Pid::kNone);
  EXPECT_FALSE(axis(*world, 0).rate_pid);
}

TEST(JointPlugins, ReportsErrorsAndUnsupportedElements) {
  const auto world = world_of(
      arm(plugin("JointPositionController", "<joint_name>three</joint_name>") +
          plugin("JointController",
                 "<joint_name>one</joint_name><joint_index>1</joint_index>"
                 "<use_force_commands>1</use_force_commands>"
                 "<d_gain>0.1</d_gain>") +
          plugin("JointPositionController", "<joint_name>two</joint_name><p_gain>much</p_gain>")));
  EXPECT_THAT(texts(*world),
              Contains("the plugin JointPositionController names the joint 'three', which the "
                       "model does not have"));
  EXPECT_THAT(texts(*world), Contains(HasSubstr("<joint_index> of the plugin JointController")));
  EXPECT_THAT(texts(*world), Contains(HasSubstr("<d_gain> of the plugin JointController")));
  EXPECT_THAT(texts(*world), Contains(HasSubstr("'much'")));
  EXPECT_FALSE(axis(*world, 1).position_pid);
}

TEST(JointPlugins, ReportsJointsThatAnythingElseMoves) {
  const auto of = [](const std::string& joint, const std::string& more) {
    return texts(*world_of(
        arm(plugin("JointPositionController", "<joint_name>" + joint + "</joint_name>") + more)));
  };
  const std::string prefix = "the joint '", name = "' of the plugin JointPositionController ";
  const std::string still =
      "<link name='s'/><joint name='still' type='fixed'><parent>base</parent><child>s</child>"
      "</joint>";
  const std::string led =
      "<link name='f'/><joint name='led' type='revolute'><parent>base</parent><child>f</child>"
      "<axis><xyz>0 0 1</xyz><mimic joint='one'/></axis></joint>";
  EXPECT_THAT(of("still", still), ElementsAre(prefix + "still" + name + "is fixed"));
  EXPECT_THAT(of("led", led),
              ElementsAre(prefix + "led" + name + "follows 'one', and takes no commands"));
  EXPECT_THAT(of("one", plugin("JointPositionController",
                               "<joint_name>one</joint_name><p_gain>9</p_gain>")),
              ElementsAre(prefix + "one" + name +
                          "has another controller already; this one counts where they differ"));
  EXPECT_THAT(of("two", plugin("JointStatePublisher", "<joint_name>two</joint_name>")), IsEmpty());
}

// Only a limit may be infinite, and only on the side where that means unlimited.
TEST(JointPlugins, GainsAreFinite) {
  const auto with = [](const std::string& element) {
    return world_of(
        arm(plugin("JointPositionController", "<joint_name>one</joint_name>" + element)));
  };
  for (const char* name : {"p_gain", "i_gain", "d_gain", "cmd_offset"}) {
    const std::string is = name;
    EXPECT_THAT(texts(*with("<" + is + ">inf</" + is + ">")),
                ElementsAre(HasSubstr("<" + is + ">: 'inf' is not finite")));
  }
  for (const char* wrong : {"<i_max>-inf</i_max>", "<i_min>inf</i_min>", "<cmd_max>-inf</cmd_max>",
                            "<cmd_min>inf</cmd_min>"})
    EXPECT_THAT(texts(*with(wrong)), ElementsAre(HasSubstr("inf' is not allowed"))) << wrong;
  const auto unlimited =
      with("<i_max>inf</i_max><i_min>-inf</i_min><cmd_max>inf</cmd_max><cmd_min>-inf</cmd_min>");
  EXPECT_THAT(texts(*unlimited), IsEmpty());
  EXPECT_EQ(axis(*unlimited, 0).position_pid.value().most, Pid::kNone);
}

struct Named {
  std::string library, name, inside, text;
};

// Systems of gz-sim and plugins of Gazebo Classic that act in Gazebo but not here.
TEST(PluginParameters, WarnsAboutParametersWithoutEffect) {
  const std::string gz = "gz::sim::systems::";
  const Named cases[] = {
      {"f", gz + "PosePublisher", "<update_frequency>10</update_frequency>", "50 times a second"},
      {"f", gz + "PosePublisher", "<update_rate>10</update_rate>", "is not known"},
      {"f", gz + "JointStatePublisher", "<update_rate>10</update_rate>", "has its own rate"},
      {"f", gz + "Imu", "<topic>imu</topic>", "is not known"},
      {"f", gz + "Magnetometer", "<use_units_gauss>true</use_units_gauss>", "is in T"},
      {"f", gz + "LogRecord", "<path>/tmp/log</path>", "--record does"},
      {"libgazebo_ros_velodyne_laser.so", "p", "<min_range>0.9</min_range>", "<range>"},
      {"libgazebo_ros_camera.so", "p", "<updateRate>5</updateRate>", "<update_rate>"},
      {"libgazebo_ros_camera.so", "p", "<focalLength>500</focalLength>", "<camera>"},
      {"libgazebo_ros_imu_sensor.so", "p",
       "<initial_orientation_as_reference>true</initial_orientation_as_reference>",
       "relative to the world"},
      {"libgazebo_ros_planar_move.so", "p", "<covariance_x>0.1</covariance_x>", "no covariance"},
      {"libgazebo_ros_planar_move.so", "p", "<cmdTimeout>0.5</cmdTimeout>", "watchdog"},
      {"libgazebo_ros_diff_drive.so", "p", "<odometrySource>world</odometrySource>", "its wheels"},
  };
  for (const Named& each : cases) {
    const auto world = world_of(arm("<plugin filename='" + each.library + "' name='" + each.name +
                                    "'>" + each.inside + "</plugin>"));
    EXPECT_THAT(texts(*world), Contains(HasSubstr(each.text))) << each.name << each.inside;
  }
}

TEST(PluginParameters, NoWarningForParametersWithTheUsualValue) {
  const std::string gz = "gz::sim::systems::";
  const Named cases[] = {
      {"f", gz + "PosePublisher", "<update_frequency>50</update_frequency>", ""},
      {"f", gz + "Magnetometer", "<use_units_gauss>false</use_units_gauss>", ""},
      {"libgazebo_ros_camera.so", "p", "<updateRate>0.0</updateRate><CxPrime>0</CxPrime>", ""},
  };
  for (const Named& each : cases) {
    const auto world = world_of(arm("<plugin filename='" + each.library + "' name='" + each.name +
                                    "'>" + each.inside + "</plugin>"));
    EXPECT_THAT(texts(*world), IsEmpty()) << each.name << each.inside;
  }
}

// ---- ROS

std::string bot(const std::string& more) {
  const std::string inertial =
      "<inertial><mass value='1'/><inertia ixx='0.1' iyy='0.1' izz='0.1' ixy='0' ixz='0' iyz='0'/>"
      "</inertial>";
  return "<robot name='bot'><link name='base'>" + inertial + "</link><link name='a'>" + inertial +
         "</link><link name='b'>" + inertial +
         "</link><joint name='one' type='continuous'><parent link='base'/><child link='a'/><axis "
         "xyz='0 0 1'/></joint><joint name='two' type='continuous'><parent link='a'/><child "
         "link='b'/><axis xyz='0 0 1'/></joint>" +
         more + "</robot>";
}

std::string transmission(const std::string& joint, const std::string& interface) {
  return "<transmission name='t_" + joint +
         "'><type>transmission_interface/SimpleTransmission"
         "</type><joint name='" +
         joint + "'><hardwareInterface>hardware_interface/" + interface +
         "JointInterface</hardwareInterface></joint></transmission>";
}

TEST(RosGains, OfGazeboRosControl) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", "<package><name>bot</name></package>");
  folder.write("bot/config/control.yaml", R"(controllers: none
/gazebo_ros_control:
  pid_gains:
    one: {p: 100.0, i: 1.0, d: 10.0, i_clamp: 3.0}
    two: {p: 5.0, i: 1.0, d: 0.0}
    other: {p: 1.0, i: 0.0, d: 0.0}
)");
  const auto world = load_world(folder.write(
      "bot/urdf/bot.urdf", bot(transmission("one", "Position") + transmission("two", "Velocity"))));
  EXPECT_THAT(texts(*world), Contains("no plugin names control.yaml; its gains hold these joints: "
                                      "one, two"));
  const Pid one = axis(*world, 0).position_pid.value(), two = axis(*world, 1).rate_pid.value();
  EXPECT_EQ(one.p, 100.0);
  EXPECT_EQ(one.d, 10.0);
  EXPECT_EQ(one.i_max, 3.0);
  EXPECT_EQ(one.i_min, -3.0);
  EXPECT_EQ(two.p, 5.0);
  EXPECT_EQ(two.i_max, 0.0);  // without a clamp nothing is left of the integral
  EXPECT_FALSE(axis(*world, 0).rate_pid);
}

TEST(RosGains, ReportsNegativeGains) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", "<package><name>bot</name></package>");
  folder.write("bot/config/control.yaml",
               "controllers: none\n/gazebo_ros_control:\n  pid_gains:\n    one: {p: -100.0, i: "
               "1.0, d: 10.0}\n");
  const auto world =
      load_world(folder.write("bot/urdf/bot.urdf", bot(transmission("one", "Position"))));
  EXPECT_THAT(texts(*world), Contains(HasSubstr("-100")));
  EXPECT_FALSE(axis(*world, 0).position_pid);
}

TEST(RosGains, OfControllersOfEffortAndVelocity) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", "<package><name>bot</name></package>");
  folder.write("bot/config/control.yaml", R"(controller_manager:
  ros__parameters:
    arm_controller:
      type: joint_trajectory_controller/JointTrajectoryController
    turn_controller:
      type: velocity_controllers/JointPositionController
arm_controller:
  ros__parameters:
    joints: [one]
    command_interfaces: [effort]
    gains:
      one: {p: 12000.0, d: 50.0, i: 0.0, i_clamp: 10000.0}
turn_controller:
  ros__parameters:
    joint: two
    pid: {p: 7.0, i: 0.0, d: 0.0}
)");
  const auto world = load_world(folder.write(
      "bot/urdf/bot.urdf", bot("<ros2_control name='s' type='system'><joint name='one'>"
                               "<command_interface name='effort'/></joint></ros2_control>")));
  EXPECT_EQ(axis(*world, 0).position_pid.value().p, 12000.0);
  EXPECT_EQ(axis(*world, 0).start.mode, JointStart::Mode::stay);
  EXPECT_EQ(axis(*world, 1).position_gain, 7.0);
}

// To ROS 2, dots in the names of parameters are levels; some files have one line for each value.
TEST(RosGains, OfNamesWithDots) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", "<package><name>bot</name></package>");
  folder.write("bot/config/control.yaml", R"(controller_manager:
  ros__parameters:
    arm_controller.type: joint_trajectory_controller/JointTrajectoryController
    turn_controller.type: velocity_controllers/JointPositionController
arm_controller:
  ros__parameters:
    joints: [one]
    command_interfaces: [effort]
    gains.one.p: 12000.0
    gains.one.d: 50.0
    gains.three.p: 1.0
turn_controller:
  ros__parameters: {joint: two, pid.p: 7.0}
)");
  const auto world = load_world(folder.write(
      "bot/urdf/bot.urdf",
      bot("<ros2_control name='s' type='system'><joint name='one'><command_interface "
          "name='effort'/></joint></ros2_control><gazebo><plugin name='c' "
          "filename='libgazebo_ros2_control.so'><parameters>package://bot/config/control.yaml"
          "</parameters></plugin></gazebo>")));
  EXPECT_EQ(axis(*world, 0).position_pid.value().p, 12000.0);
  EXPECT_EQ(axis(*world, 0).position_pid.value().d, 50.0);
  EXPECT_EQ(axis(*world, 1).position_gain, 7.0);
  EXPECT_THAT(texts(*world), ElementsAre("controller 'arm_controller': gains of the joint 'three', "
                                         "which is not one of its joints"));
}

TEST(RosGains, ReadsPidControllersAndWarnsAboutConstraints) {
  TemporaryFolder folder;
  folder.write("bot/package.xml", "<package><name>bot</name></package>");
  folder.write("bot/config/control.yaml", R"(controller_manager:
  ros__parameters:
    hold: {type: pid_controller/PidController}
    spin: {type: pid_controller/PidController}
    arm: {type: joint_trajectory_controller/JointTrajectoryController}
hold:
  ros__parameters:
    dof_names: [one]
    command_interface: effort
    reference_and_state_interfaces: [position, velocity]
    gains: {one: {p: 40.0, i: 0.0, d: 3.0}}
spin:
  ros__parameters:
    dof_names: [two]
    command_interface: effort
    reference_and_state_interfaces: [velocity]
    gains: {two: {p: 6.0, i: 0.0, d: 0.0}}
arm:
  ros__parameters:
    joints: [one, two]
    constraints: {goal_time: 0.5, one: {goal: 0.01}}
)");
  const auto world = load_world(folder.write(
      "bot/urdf/bot.urdf", bot("<ros2_control name='s' type='system'><joint name='one'>"
                               "<command_interface name='effort'/></joint></ros2_control>")));
  EXPECT_EQ(axis(*world, 0).position_pid.value().p, 40.0);
  EXPECT_EQ(axis(*world, 0).position_pid.value().d, 3.0);
  EXPECT_EQ(axis(*world, 1).rate_pid.value().p, 6.0);
  EXPECT_THAT(texts(*world),
              Contains("controller 'arm': constraints are not supported: joints go where "
                       "ROBOT/joint_command says, and no tolerance or goal time is watched"));
}

TEST(RosGains, OfAJointsOwnParameters) {
  const auto world = world_of(
      arm("<ros2_control name='s' type='system'><joint name='one'><command_interface "
          "name='position'/><param name='pos_kp'>10</param><param name='pos_kd'>2</param><param "
          "name='pos_max_integral_error'>5</param></joint></ros2_control>"));
  EXPECT_EQ(axis(*world, 0).position_pid.value().p, 10.0);
  EXPECT_EQ(axis(*world, 0).position_pid.value().d, 2.0);
  EXPECT_EQ(axis(*world, 0).position_pid.value().i_max, 5.0);
}

// Arms do not fall before the first command, whatever the interface of their drives is.
TEST(RosGains, JointsWithATransmissionStayWhereTheyBegin) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write(
      "bot.urdf", bot(transmission("one", "Position") + transmission("two", "Effort"))));
  EXPECT_EQ(axis(*world, 0).start.mode, JointStart::Mode::stay);
  EXPECT_EQ(axis(*world, 1).start.mode, JointStart::Mode::stay);
}

TEST(RosGains, JointsWithoutAControllerAreFree) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write("bot.urdf", bot(transmission("one", "Position"))));
  EXPECT_EQ(axis(*world, 1).start.mode, JointStart::Mode::free);
}

}  // namespace
}  // namespace ruedo::world
