// Values that are readable but impossible: they are reported, and the world is loaded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "text_world.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

std::string wheel(const std::string& name, const std::string& y, const std::string& axis,
                  const std::string& more = "") {
  return "<link name='" + name + "'><pose>0 " + y +
         " 0.1 0 0 0</pose><collision name='c'><geometry><sphere><radius>0.1</radius></sphere>"
         "</geometry></collision></link><joint name='j" +
         name + "' type='revolute'><parent>base</parent><child>" + name + "</child><axis><xyz>" +
         axis + "</xyz>" + more + "</axis></joint>";
}

// Two wheels, of which the right one is as told.
std::string robot(const std::string& drive, const std::string& axis = "0 1 0",
                  const std::string& of_axis = "") {
  return "<model name='m'><link name='base'/>" + wheel("l", "0.2", "0 1 0") +
         wheel("r", "-0.2", axis, of_axis) + drive + "</model>";
}

std::string drive(const std::string& inside = "", const std::string& attributes = "") {
  return "<ruedo:drive" + attributes +
         "><ruedo:left_joint>jl</ruedo:left_joint><ruedo:right_joint>jr</ruedo:right_joint>" +
         inside + "</ruedo:drive>";
}

std::string plugin(const std::string& kind, const std::string& inside) {
  return "<plugin filename='f' name='gz::sim::systems::" + kind + "'>" + inside + "</plugin>";
}

std::vector<std::string> named(const std::string& inside) { return texts(*world_of(inside)); }

TEST(OddDrives, OfAModelThatCannotMove) {
  EXPECT_THAT(named(robot(drive())), IsEmpty());
  EXPECT_THAT(named(robot(drive() + "<static>true</static>")),
              ElementsAre("the model is static: its drive moves nothing"));
  EXPECT_THAT(
      named(robot(plugin("DiffDrive", "<left_joint>jl</left_joint><right_joint>jr</right_joint>") +
                  "<static>true</static>")),
      ElementsAre("the model is static: its drive moves nothing"));
  EXPECT_THAT(named(robot(drive() + "<ruedo:path><ruedo:waypoint>0 0 0 0 0 0 0</ruedo:waypoint>"
                                    "<ruedo:waypoint>1 1 0 0 0 0 0</ruedo:waypoint></ruedo:path>")),
              ElementsAre("the model moves by its <ruedo:path>: its drive moves nothing"));
}

TEST(OddDrives, WithSwappedSides) {
  const std::string other = "<left_joint>jr</left_joint><right_joint>jl</right_joint>";
  const auto world = world_of(robot(plugin("DiffDrive", other)));
  EXPECT_THAT(texts(*world),
              ElementsAre("the left wheels stand on the right, seen along the model's x: left and "
                          "right are taken the other way round"));
  const Model& model = *world->models.at(0).model;
  EXPECT_EQ(model.joints[model.drive->left_joints.at(0)].name, "jl");
}

// --drive makes it one of the other type.
TEST(OddDrives, MayHaveElementsOfAnotherType) {
  const std::string gear = "<ruedo:gear>3</ruedo:gear>";
  EXPECT_THAT(named(robot(drive(gear))), IsEmpty());
  EXPECT_THAT(named(robot(drive(gear, " type='wheels'"))), IsEmpty());
}

TEST(OddDrives, WithWheelsThatCannotRoll) {
  const std::string cannot = "the joint 'jr' cannot roll a wheel: ",
                    anyhow = "; the kinematic drive moves the robot regardless";
  EXPECT_THAT(named(robot(drive(), "0 0 1")), ElementsAre(cannot + "its axis is upright" + anyhow));
  EXPECT_THAT(named(robot(drive(), "1 0 0")),
              ElementsAre(cannot + "its axis points ahead" + anyhow));
  EXPECT_THAT(named(robot(drive(), "0 1 0", "<limit><lower>-1</lower><upper>2</upper></limit>")),
              ElementsAre(cannot + "it turns from -1 to 2 rad only" + anyhow));
  // Where the wheels drive it, it stands.
  EXPECT_THAT(named(robot(drive("", " type='wheels'"), "0 0 -1")),
              ElementsAre(cannot + "its axis is upright"));
  EXPECT_THAT(named(robot(drive(), "0 -1 0.3")), IsEmpty());
  EXPECT_THAT(named(robot(drive(), "0 1 0", "<mimic joint='jl'/>")),
              ElementsAre("the drive turns the joint 'jr': that it follows 'jl' does nothing"));
}

TEST(OddDrives, WithElementsOfAnotherSteering) {
  EXPECT_THAT(named(robot(drive("<ruedo:wheelbase>1</ruedo:wheelbase><ruedo:max_side_speed>1"
                                "</ruedo:max_side_speed>"))),
              UnorderedElementsAre("<ruedo:wheelbase> does nothing with steering 'differential'",
                                   "<ruedo:max_side_speed> does nothing with steering "
                                   "'differential'"));
}

TEST(OddDrives, WithParametersOfAPluginThatLimitNothing) {
  const auto with = [](const std::string& inside) {
    return named(robot(
        plugin("DiffDrive", "<left_joint>jl</left_joint><right_joint>jr</right_joint>" + inside)));
  };
  const auto refused = [](const std::string& parameter, const std::string& value,
                          const std::string& allowed) {
    return "<" + parameter + "> of the plugin DiffDrive: '" + value +
           "' is not allowed; allowed is " + allowed;
  };
  for (const char* each : {"max_velocity", "max_linear_velocity", "max_angular_velocity",
                           "max_linear_acceleration", "max_angular_acceleration"}) {
    const std::string name = each;
    EXPECT_THAT(with("<" + name + ">-1</" + name + ">"),
                ElementsAre(refused(name, "-1", "a number of at least 0; there is no limit")));
  }
  for (const char* each : {"max_velocity", "max_linear_velocity", "max_angular_velocity"}) {
    const std::string name = each;
    EXPECT_THAT(with("<" + name + ">0</" + name + ">"),
                ElementsAre(refused(name, "0", "a number above 0; there is no limit")));
  }
  EXPECT_THAT(with("<max_linear_acceleration>0</max_linear_acceleration>"), IsEmpty());
  EXPECT_THAT(with("<min_linear_acceleration>0.5</min_linear_acceleration>"),
              ElementsAre(refused("min_linear_acceleration", "0.5",
                                  "a number of at most 0; its magnitude counts")));
  EXPECT_THAT(
      with("<wheel_radius>0</wheel_radius>"),
      ElementsAre(refused("wheel_radius", "0", "a number above 0; it is measured instead")));
  EXPECT_THAT(
      with("<odom_publish_frequency>-3</odom_publish_frequency>"),
      ElementsAre(refused("odom_publish_frequency", "-3", "0 to 1000; the usual rate is taken")));
  // Several pairs of wheels have a radius each; here it is one for all.
  EXPECT_THAT(with("<wheel_radius>0.1</wheel_radius><wheel_radius>0.1</wheel_radius>"), IsEmpty());
  EXPECT_THAT(
      with("<wheel_radius>0.1</wheel_radius><wheel_radius>0.2</wheel_radius>"),
      ElementsAre("a second <wheel_radius> of the plugin DiffDrive is left out; the first one "
                  "counts"));
}

TEST(OddValues, OfControllersOfJoints) {
  const auto with = [](const std::string& kind, const std::string& inside) {
    return named(robot(plugin(kind, inside)));
  };
  EXPECT_THAT(with("JointPositionController",
                   "<joint_name>jl</joint_name><p_gain>1</p_gain>"
                   "<p_gain>2</p_gain>"),
              ElementsAre("a second <p_gain> of the plugin JointPositionController is left out; "
                          "the first one counts"));
  EXPECT_THAT(with("JointController", ""),
              ElementsAre("the plugin JointController has no <joint_name>; it holds nothing"));
  EXPECT_THAT(with("JointPositionController",
                   "<joint_name>jl</joint_name><use_velocity_commands>true</use_velocity_commands>"
                   "<cmd_max>-2</cmd_max>"),
              ElementsAre("<cmd_max> of the plugin JointPositionController: '-2' is not allowed; "
                          "allowed is a number of at least 0; it stands still"));
  EXPECT_THAT(with("JointStatePublisher", "<joint_name>jx</joint_name>"),
              ElementsAre("the plugin JointStatePublisher names the joint 'jx', which the model "
                          "does not have"));
}

TEST(OddValues, OfLights) {
  const auto world = world_of(
      "<light name='a' type='spot'><diffuse>255 0 -1 1</diffuse><spot><inner_angle>1</inner_angle>"
      "<outer_angle>0.5</outer_angle><falloff>1</falloff></spot></light>");
  EXPECT_THAT(texts(*world),
              ElementsAre("<diffuse>: '255 0 -1 1' is not allowed; allowed are numbers from 0 to "
                          "1; the nearest of these are taken",
                          "the <inner_angle> 1 is above the <outer_angle> 0.5; they are taken the "
                          "other way round"));
  EXPECT_EQ(world->lights.at(0).diffuse, Rgba({1, 0, 0, 1}));
  EXPECT_EQ(world->lights.at(0).outer_angle, 1.0);
}

TEST(OddValues, PluginsOfModelsInAWorld) {
  EXPECT_THAT(named(plugin("DiffDrive", "") + plugin("JointPositionController", "") +
                    plugin("DetachableJoint", "") + plugin("Physics", "") + plugin("Imu", "") +
                    "<plugin filename='libgazebo_ros_control.so' name='c'/>"
                    "<plugin filename='libgazebo_ros_factory.so' name='f'/>"),
              ElementsAre("the plugin DiffDrive does nothing in <world>: it belongs into a model",
                          "the plugin JointPositionController does nothing in <world>: it belongs "
                          "into a model",
                          "the plugin DetachableJoint does nothing in <world>: it belongs into a "
                          "model",
                          "the plugin gazebo_ros_control does nothing in <world>: it belongs into "
                          "a model"));
}

TEST(OddValues, MissingFrames) {
  EXPECT_THAT(named("<frame name='a' attached_to='b'/><frame name='b' attached_to='a'/>"),
              ElementsAre("<frame>: 'a' is placed relative to itself, through other frames; the "
                          "frame is left out",
                          "<frame>: 'b' is placed relative to itself, through other frames; the "
                          "frame is left out"));
}

TEST(OddValues, StatesOfMissingModels) {
  EXPECT_THAT(
      named("<model name='m'><link name='l'/></model><state world_name='w'><model name='m'>"
            "<pose>0 0 0 0 0 0</pose><link name='k'><pose>0 0 0 0 0 0</pose></link><joint name='j'>"
            "<angle axis='0'>1</angle></joint></model><model name='n'><pose>0 0 0 0 0 0</pose>"
            "</model><light name='o'><pose>0 0 0 0 0 0</pose></light></state>"),
      ElementsAre("the model has no joint 'j'; its position is left out",
                  "the model has no link 'k'; its pose is left out",
                  "the world has no model 'n'; its state is left out",
                  "the world has no light 'o'; its state is left out"));
}

TEST(OddValues, StartsBeyondTheLimits) {
  const auto world = world_of(
      "<model name='m'><link name='a'/><link name='b'/><joint name='j' type='prismatic'><parent>a"
      "</parent><child>b</child><axis><xyz>1 0 0</xyz><limit><lower>0</lower><upper>0.5</upper>"
      "</limit><dynamics><spring_stiffness>-3</spring_stiffness></dynamics><initial_position>2"
      "</initial_position></axis></joint></model>");
  EXPECT_THAT(texts(*world),
              ElementsAre("<spring_stiffness>: '-3' is not allowed; allowed is a number of at "
                          "least 0; there is no spring",
                          "it begins at 2 of its file, beyond its limits of 0 to 0.5; it is 0.5 "
                          "instead",
                          "it begins at 0.5 m of its file, and its positions count from there"));
  EXPECT_EQ(link_of(*world->models.at(0).model, "b").X_ML.translation.x(), 0.5);
}

// ---- URDF

std::vector<std::string> of_urdf(const std::string& joint, const std::string& more = "",
                                 const std::string& visual = "") {
  return texts(*load_world_text(
      "<robot name='r'><link name='a'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' "
      "ixy='0' ixz='0' iyz='0'/></inertial><collision><geometry><box size='1 1 1'/></geometry>"
      "</collision><visual><geometry><box size='1 1 1'/></geometry>" +
          visual + "</visual></link><link name='b'/><joint name='j' type='" + joint +
          "<parent link='a'/><child link='b'/></joint>" + more + "</robot>",
      "/nowhere/r.urdf"));
}
const std::string kFixed = "fixed'>",
                  kLimit = "<limit lower='-1' upper='1' effort='1' velocity='1'/>";

TEST(OddValuesOfUrdf, NumbersBelowZero) {
  EXPECT_THAT(of_urdf("revolute'><limit lower='-1' upper='1' effort='-5' velocity='-2'/>"
                      "<dynamics damping='-3' friction='-4'/>"),
              UnorderedElementsAre(
                  "effort=\"-5\" of <limit> is not allowed; allowed is a number of at least 0; "
                  "there is no limit",
                  "velocity=\"-2\" of <limit> is not allowed; allowed is a number of at least 0; "
                  "there is no limit",
                  "damping=\"-3\" of <dynamics> is not allowed; allowed is a number of at least 0; "
                  "0 is used",
                  "friction=\"-4\" of <dynamics> is not allowed; allowed is a number of at least "
                  "0; 0 is used"));
  EXPECT_THAT(of_urdf("continuous'>" + kLimit),
              ElementsAre("a continuous joint has no limits: those of -1 to 1 are left out"));
  const auto world = load_world_text(
      "<robot name='r'><link name='a'><inertial><mass value='-2'/><inertia ixx='1' iyy='1' izz='1' "
      "ixy='0' ixz='0' iyz='0'/></inertial></link></robot>",
      "/nowhere/r.urdf");
  EXPECT_THAT(texts(*world),
              ElementsAre("<mass>: '-2' is not allowed; allowed is a number of at least 0; it is "
                          "taken for a frame without mass"));
}

// As in Gazebo, the last one counts, in whichever block it is.
TEST(OddValuesOfUrdf, ASecondInGazebosBlocks) {
  const auto second = [](const std::string& what) {
    return "a second <" + what + "> in <gazebo reference=\"a\">; the last one counts";
  };
  EXPECT_THAT(of_urdf(kFixed,
                      "<gazebo reference='a'><mu1>0.1</mu1><mu1>0.9</mu1>"
                      "<material>Gazebo/Red</material></gazebo><gazebo reference='a'>"
                      "<kp value='3'/><material value='Gazebo/Blue'/></gazebo>"),
              ElementsAre(second("mu1"), second("material")));
  EXPECT_THAT(of_urdf(kFixed, "<gazebo reference='a'><kd>1</kd><kd value='1'/></gazebo>"),
              IsEmpty());
}

TEST(OddValuesOfUrdf, MaterialsAndColours) {
  EXPECT_THAT(of_urdf(kFixed, "", "<material name='m'/>"),
              ElementsAre("the material 'm' is not defined; the colour is grey instead"));
  EXPECT_THAT(of_urdf(kFixed, "<gazebo reference='a'><material>Gazebo/Red</material></gazebo>",
                      "<material name='m'/>"),
              IsEmpty());
  EXPECT_THAT(of_urdf(kFixed, "<material name='m'><color rgba='0 1 0 1'/></material>",
                      "<material name='m'><color rgba='1 0 0 1'/></material>"),
              ElementsAre("the material 'm' has another colour already, 0 1 0 1, which counts"));
  EXPECT_THAT(of_urdf(kFixed, "<material name='m'><color rgba='0.3 1 0 1'/></material>",
                      "<material name='m'><color rgba='0.3 1.0 0 1'/></material>"),
              IsEmpty());
  const std::string none = "\" of <color> is not four numbers from 0 to 1; ";
  EXPECT_THAT(of_urdf(kFixed, "", "<material name='m'><color rgba='1 0 0'/></material>"),
              ElementsAre("rgba=\"1 0 0" + none + "it is opaque"));
  EXPECT_THAT(of_urdf(kFixed, "", "<material name='m'><color rgba='255 0 0 1'/></material>"),
              ElementsAre("rgba=\"255 0 0 1" + none + "each counts as the nearest of these"));
  EXPECT_THAT(of_urdf(kFixed, "", "<material name='m'><color rgba='red'/></material>"),
              ElementsAre("rgba=\"red" + none + "it is grey instead"));
}

// <ros2_control> can say it as well as <mimic>.
TEST(OddValuesOfUrdf, MimicOfRos2Control) {
  const auto follows = [](const std::string& leader, const std::string& mimic) {
    return load_world_text(
        "<robot name='r'><link name='a'/><link name='b'/><link name='c'/><joint name='j' "
        "type='continuous'><parent link='a'/><child link='b'/></joint><joint name='k' "
        "type='continuous'><parent link='a'/><child link='c'/>" +
            mimic +
            "</joint><ros2_control name='s' type='system'><joint name='k'><param name='mimic'>" +
            leader +
            "</param><param name='multiplier'>-2</param><param name='offset'>0.5</param>"
            "</joint></ros2_control></robot>",
        "/nowhere/r.urdf");
  };
  const auto world = follows("j", "");
  EXPECT_THAT(texts(*world), IsEmpty());
  const Joint& k = world->models.back().model->joints.back();
  ASSERT_TRUE(k.leader.valid());
  EXPECT_EQ(k.mimic_multiplier, -2.0);
  EXPECT_EQ(k.mimic_offset, 0.5);
  EXPECT_THAT(texts(*follows("x", "")),
              ElementsAre("<mimic>: joint 'x' is not one of the model's joints; the joint moves on "
                          "its own"));
  EXPECT_THAT(texts(*follows("x", "<mimic joint='j'/>")),
              ElementsAre("its param mimic is left out: by its <mimic> it follows 'j'"));
}

TEST(OddValuesOfUrdf, InterfacesOfJoints) {
  const auto control = [](const std::string& joint, const std::string& state) {
    return "<ros2_control name='s' type='system'><joint name='" + joint +
           "'><state_interface name='position'>" + state +
           "</state_interface></joint>"
           "</ros2_control>";
  };
  const auto at = [](const std::string& value) {
    return "<param name='initial_value'>" + value + "</param>";
  };
  const std::string revolute = "revolute'>" + kLimit;
  EXPECT_THAT(of_urdf(revolute, control("j", at("3"))),
              ElementsAre("it begins at 3 of its file, beyond its limits of -1 to 1; it is 1 "
                          "instead",
                          "it begins at 1 rad of its file, and its positions count from there"));
  EXPECT_THAT(of_urdf(revolute, control("j", at("0.5") + at("0.25"))),
              ElementsAre("a second initial_value of its position; this one counts",
                          "it begins at 0.25 rad of its file, and its positions count from there"));
  EXPECT_THAT(of_urdf(revolute, control("k", at("0"))),
              ElementsAre("<joint> names the joint 'k', which the model does not have"));
  EXPECT_THAT(of_urdf(revolute,
                      "<transmission name='t'><joint name='k'><hardwareInterface>"
                      "PositionJointInterface</hardwareInterface></joint></transmission>"),
              ElementsAre("<joint> names the joint 'k', which the model does not have"));
}

}  // namespace
}  // namespace ruedo::world
