// <ruedo:drive steering="">: what each kind needs, and what follows from its joints; plugins of
// Gazebo that mean the same.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "text_world.h"
#include "world/compat/plugins.h"
#include "world/model/body_layout.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Steering = DriveDescription::Steering;

std::string link(const std::string& name, const std::string& pose) {
  return "<link name='" + name + "'><pose>" + pose +
         "</pose><collision name='c'><pose>0 0 0 1.5707963267948966 0 "
         "0</pose><geometry><cylinder><radius>0.1</radius><length>0.04</length>"
         "</cylinder></geometry></collision></link>";
}
std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& axis = "0 1 0", const std::string& limit = "") {
  return "<joint name='" + name + "' type='revolute'><parent>" + parent + "</parent><child>" +
         child + "</child><axis><xyz>" + axis + "</xyz>" + limit + "</axis></joint>";
}
std::string wheel(const std::string& name, const std::string& pose, const std::string& on = "base",
                  const std::string& axis = "0 1 0") {
  return link(name, pose) + joint("j_" + name, on, name, axis);
}

// Wheels at x = 0 and x = 0.5 m, 0.4 m apart; those ahead hang on knuckles.
std::string car(const std::string& drive) {
  const std::string limit = "<limit><lower>-0.6</lower><upper>0.5</upper></limit>";
  return "<model name='m'><link name='base'/>" + wheel("rl", "0 0.2 0.1 0 0 0") +
         wheel("rr", "0 -0.2 0.1 0 0 0") +
         "<link name='kl'><pose>0.5 0.2 0.1 0 0 0</pose></link><link name='kr'><pose>0.5 -0.2 0.1 "
         "0 0 0</pose></link>" +
         joint("sl", "base", "kl", "0 0 1", limit) + joint("sr", "base", "kr", "0 0 -1", limit) +
         wheel("fl", "0.5 0.2 0.1 0 0 0", "kl") + wheel("fr", "0.5 -0.2 0.1 0 0 0", "kr") + drive +
         "</model>";
}
const char* const kCar =
    "<ruedo:drive "
    "steering='ackermann'><ruedo:left_joint>j_fl</ruedo:left_joint><ruedo:left_joint>j_rl</"
    "ruedo:left_joint><ruedo:right_joint>j_fr</ruedo:right_joint>"
    "<ruedo:right_joint>j_rr</ruedo:right_joint><ruedo:steer_joint>sl</"
    "ruedo:steer_joint><ruedo:steer_joint>sr</ruedo:steer_joint></ruedo:drive>";

// A model with wheels that look driven: a sensor makes it a robot, whose drive is guessed, unless
// the file says that its joints take commands, or that it does not drive.
TEST(DriveKinds, AFileMayDeclareThatThereIsNoDrive) {
  const std::string robot =
      "<model name='m'><link name='base'><sensor name='s' type='imu'/></link>" +
      wheel("left_wheel", "0 0.2 0.1 0 0 0") + wheel("right_wheel", "0 -0.2 0.1 0 0 0");
  const auto guessed = world_of(robot + "</model>");
  ASSERT_TRUE(guessed->models[0].model->drive);
  EXPECT_TRUE(guessed->models[0].model->drive->guessed);
  const std::string plugin =
      "<plugin filename='libgazebo_ros_diff_drive.so' name='d'><leftJoint>j_left_wheel</leftJoint>"
      "<rightJoint>j_right_wheel</rightJoint></plugin>";
  ASSERT_TRUE(world_of(robot + "<ruedo:joints/>" + plugin + "</model>")->models[0].model->drive);
  for (const std::string& none :
       {std::string("<ruedo:joints/>"), std::string("<ruedo:drive type='none'/>"),
        "<ruedo:drive type='none'/><ruedo:joints/>" + plugin}) {
    const auto world = world_of(robot + none + "</model>");
    EXPECT_FALSE(world->models[0].model->drive) << none;
    EXPECT_TRUE(world->models[0].is_robot()) << none;
    EXPECT_EQ(world->models[0].model->commanded, none.find("joints") != std::string::npos);
    EXPECT_THAT(world->findings, IsEmpty()) << none;
  }
}

TEST(DriveKinds, ACarTurnsAboutItsRearAxle) {
  const auto world = world_of(car(kCar));
  const DriveDescription& drive = *world->models[0].model->drive;
  EXPECT_EQ(drive.steering, Steering::ackermann);
  EXPECT_NEAR(drive.wheelbase, 0.5, 1e-12);
  EXPECT_NEAR(drive.track, 0.4, 1e-12);
  EXPECT_NEAR(drive.max_steering_angle, 0.5, 1e-12);  // of the tighter limit
  EXPECT_LT(drive.X_MBase.translation.norm(), 1e-12);
  const BodyLayout layout(*world);
  ASSERT_EQ(layout.wheels.size(), 6u);
  EXPECT_EQ(layout.bodies.size(), 1u);
  EXPECT_TRUE(layout.wheels[4].steers);
  EXPECT_EQ(layout.wheels[0].on, 4);  // the front left one hangs on the left knuckle
  EXPECT_EQ(layout.wheels[1].on, -1);
  // Turned by a quarter and then rolled: the wheel's axle points ahead, however far it has rolled;
  // both knuckles turn the same way.
  std::vector<double> angles(6, 0.0);
  angles[4] = angles[5] = M_PI / 2;
  angles[0] = angles[2] = 1.0;
  const Model& model = *world->models[0].model;
  for (size_t l = 0; l < model.links.size(); ++l) {
    if (model.links[l].name != "fl" && model.links[l].name != "fr") continue;
    const Vec3 axle = layout.link_in_body(LinkIndex(l), angles).rotation * Vec3::UnitY();
    EXPECT_LT((axle - Vec3(-1, 0, 0)).norm(), 1e-12) << model.links[l].name;
  }
}

TEST(DriveKinds, MecanumRims) {
  std::string text = "<model name='m'><link name='base'/>" + wheel("fl", "0.2 0.15 0.1 0 0 0") +
                     wheel("fr", "0.2 -0.15 0.1 0 0 0") + wheel("rl", "-0.2 0.15 0.1 0 0 0") +
                     wheel("rr", "-0.2 -0.15 0.1 0 0 0");
  for (const char* each :
       {"left_joint>j_fl", "left_joint>j_rl", "right_joint>j_fr", "right_joint>j_rr"}) {
    const std::string tag = std::string(each).substr(0, std::string(each).find('>'));
    text +=
        (text.find("<ruedo:drive") == std::string::npos ? "<ruedo:drive steering='mecanum'>" : "") +
        std::string("<ruedo:") + each + "</ruedo:" + tag + ">";
  }
  const auto world = world_of(text + "</ruedo:drive></model>");
  const BodyLayout layout(*world);
  // (1, -1, -(lx + ly)) and so on: Muir and Neuman 1987, of rollers whose axes meet in the middle;
  // lx + ly = 0.35 m.
  const Vec3 wanted[] = {{1, -1, -0.35}, {1, 1, -0.35}, {1, 1, 0.35}, {1, -1, 0.35}};
  for (size_t i = 0; i < 4; ++i) EXPECT_LT((layout.wheels[i].rim - wanted[i]).norm(), 1e-12) << i;
}

TEST(DriveKinds, OmniRimsAreAlongTheirWheels) {
  // Three wheels on a circle of 0.2 m, whose axles point outwards.
  std::string text = "<model name='m'><link name='base'/>", joints;
  for (const double degrees : {0.0, 120.0, 240.0}) {
    const double a = degrees * M_PI / 180;
    const std::string name = "w" + std::to_string(static_cast<int>(degrees));
    text += wheel(name,
                  std::to_string(0.2 * std::cos(a)) + " " + std::to_string(0.2 * std::sin(a)) +
                      " 0.1 0 0 " + std::to_string(a - M_PI / 2),
                  "base");
    joints += "<ruedo:wheel_joint>j_" + name + "</ruedo:wheel_joint>";
  }
  const auto world =
      world_of(text + "<ruedo:drive steering='omni'>" + joints + "</ruedo:drive></model>");
  const BodyLayout layout(*world);
  ASSERT_EQ(layout.wheels.size(), 3u);
  for (const WheelPlacement& wheel : layout.wheels) {
    // Turning to the left alone, every wheel rolls backwards about the axle that points outwards:
    // -0.2 m for 1 rad.
    EXPECT_NEAR(wheel.rim.z(), -0.2, 1e-5);
    EXPECT_NEAR(wheel.rim.head<2>().norm(), 1.0, 1e-6);
  }
}

struct BadDrive {
  const char* drive;
  const char* error;
};

TEST(DriveKinds, ReportsMissingElements) {
  const BadDrive table[] = {
      {"<ruedo:drive steering='crab'/>",
       "<ruedo:drive>: steering 'crab' is not allowed; allowed are differential, tracked, "
       "ackermann, tricycle, mecanum, omni, holonomic"},
      {"<ruedo:drive "
       "steering='mecanum'><ruedo:left_joint>j_rl</ruedo:left_joint><ruedo:right_joint>j_rr</"
       "ruedo:right_joint></ruedo:drive>",
       "<ruedo:drive>: a mecanum drive has two left and two right wheels"},
      {"<ruedo:drive steering='omni'><ruedo:wheel_joint>j_rl</ruedo:wheel_joint></ruedo:drive>",
       "<ruedo:drive>: an omni drive has three wheels or more"},
      {"<ruedo:drive steering='ackermann'><ruedo:left_joint>j_rl</ruedo:left_joint></ruedo:drive>",
       "<ruedo:drive>: has no <ruedo:steer_joint>"},
      {"<ruedo:drive steering='tracked'/>",
       "<ruedo:drive>: has no <ruedo:track>, and no wheels to take it from"},
      {"<ruedo:drive type='wheels' steering='holonomic'/>",
       "<ruedo:drive>: type 'wheels' is not allowed with steering 'holonomic', which has "
       "no wheels that could drive it; allowed is kinematic"},
      {"<ruedo:drive "
       "steering='ackermann'><ruedo:left_joint>j_rl</ruedo:left_joint><ruedo:steer_joint>j_rl</"
       "ruedo:steer_joint></ruedo:drive>",
       "<ruedo:drive>: the joint 'j_rl' is named twice"},
  };
  for (const BadDrive& each : table) {
    try {
      world_of(car(each.drive));
      ADD_FAILURE() << each.error;
    } catch (const InputError& error) {
      EXPECT_EQ(error.message(), each.error);
    }
  }
}

TEST(DrivePlugins, OfEveryKindAreTranslated) {
  const auto steering = [](const std::string& plugin) {
    const auto world = world_of(car(plugin));
    return world->models[0].model->drive ? std::optional(world->models[0].model->drive->steering)
                                         : std::nullopt;
  };
  EXPECT_EQ(
      steering(
          "<plugin name='gz::sim::systems::AckermannSteering' "
          "filename='gz-sim-ackermann-steering-system'><left_joint>j_fl</"
          "left_joint><left_joint>j_rl</left_joint>"
          "<right_joint>j_fr</right_joint><right_joint>j_rr</right_joint><left_steering_joint>sl</"
          "left_steering_joint><right_steering_joint>sr</right_steering_joint>"
          "<wheel_base>0.5</wheel_base><steering_limit>0.4</steering_limit></plugin>"),
      Steering::ackermann);
  EXPECT_EQ(steering("<plugin name='move' filename='libgazebo_ros_planar_move.so'/>"),
            Steering::holonomic);
  EXPECT_EQ(
      steering("<plugin name='ignition::gazebo::systems::VelocityControl' filename='whatever'/>"),
      Steering::holonomic);
  EXPECT_EQ(steering("<plugin name='gz::sim::systems::TrackedVehicle' "
                     "filename='gz-sim-tracked-vehicle-system'><tracks_separation>0.4</"
                     "tracks_separation></plugin>"),
            Steering::tracked);
  EXPECT_EQ(steering("<plugin name='gz::sim::systems::MecanumDrive' "
                     "filename='gz-sim-mecanum-drive-system'><front_left_joint>j_fl</"
                     "front_left_joint><front_right_joint>j_fr</front_right_joint>"
                     "<back_left_joint>j_rl</back_left_joint><back_right_joint>j_rr</"
                     "back_right_joint></plugin>"),
            Steering::mecanum);
}

// AgileX's plugin names what it steers by "hinges".
TEST(DrivePlugins, HingesSteer) {
  const auto world = world_of(car(
      "<plugin name='d' filename='libgazebo_ros_ackerman.so'><leftFrontJoint>j_fl</leftFrontJoint>"
      "<rightFrontJoint>j_fr</rightFrontJoint><leftRearJoint>j_rl</leftRearJoint><rightRearJoint>"
      "j_rr</rightRearJoint><leftHingeJoint>sl</leftHingeJoint><rightHingeJoint>sr"
      "</rightHingeJoint><wheelSeparation>0.4</wheelSeparation></plugin>"));
  const auto& drive = world->models[0].model->drive;
  ASSERT_TRUE(drive);
  EXPECT_EQ(drive->steering, Steering::ackermann);
  EXPECT_EQ(drive->steer_joints.size(), 2u);
}

// A planar move sets the model's velocity, whatever the wheels that it names do.
TEST(DrivePlugins, APlanarMoveNeedsNoWheels) {
  for (const char* z : {"0.1", "0.13"}) {
    const std::string at = z;
    const auto world = world_of(
        "<model name='m'><link name='base'><collision name='c'><pose>0 0 0.1 0 0 0</pose>"
        "<geometry><box><size>0.4 0.3 0.2</size></box></geometry></collision></link>" +
        wheel("l", "0 0.2 " + at + " 0 0 0") + wheel("r", "0 -0.2 " + at + " 0 0 0") +
        "<plugin name='p' filename='libgazebo_ros_planar_move.so'><leftFrontJoint>j_l"
        "</leftFrontJoint><rightFrontJoint>j_r</rightFrontJoint></plugin></model>");
    const auto& drive = world->models[0].model->drive;
    ASSERT_TRUE(drive);
    EXPECT_EQ(drive->steering, Steering::holonomic);
    EXPECT_EQ(drive->left_joints.size(), at == "0.1" ? 1u : 0u);
    EXPECT_THAT(texts(*world), at == "0.1" ? testing::Matcher<std::vector<std::string>>(IsEmpty())
                                           : testing::SizeIs(2));
    EXPECT_NEAR(drive->X_MBase.translation.z(), 0.0, 1e-9);
  }
}

TEST(DrivePlugins, APlanarMoveIgnoresItsJoints) {
  const auto world = world_of(
      "<model name='m'><link name='base'/><plugin name='p' filename='libgazebo_ros_planar_move.so'>"
      "<leftFrontJoint>j_l</leftFrontJoint></plugin></model>");
  ASSERT_TRUE(world->models[0].model->drive);
  EXPECT_THAT(texts(*world), testing::ElementsAre("there is no joint 'j_l': the drive moves the "
                                                  "model without it"));
}

// It moves along the model's x, also where a wheel is a little ahead of the others.
TEST(DrivePlugins, APlanarMoveHeadsAsTheModel) {
  const auto world =
      world_of("<model name='m'><link name='base'/>" + wheel("l", "0.03 0.2 0.1 0 0 0") +
               wheel("r", "0 -0.2 0.1 0 0 0") +
               "<plugin name='p' filename='libgazebo_ros_planar_move.so'><leftFrontJoint>j_l"
               "</leftFrontJoint><rightFrontJoint>j_r</rightFrontJoint></plugin></model>");
  const auto& drive = world->models[0].model->drive;
  ASSERT_TRUE(drive);
  EXPECT_EQ(drive->left_joints.size(), 1u);
  EXPECT_DOUBLE_EQ(heading(drive->X_MBase.rotation), 0.0);
}

// A value that is not a number leaves out the drive, not the model.
TEST(DrivePlugins, WithAnOddNumberLeaveTheModel) {
  for (const char* odd : {"wide", "-0.4"}) {
    const auto world = world_of(
        "<model name='m'><link name='base'/>" + wheel("l", "0 0.2 0.1 0 0 0") +
        wheel("r", "0 -0.2 0.1 0 0 0") +
        "<plugin name='p' filename='libgazebo_ros_diff_drive.so'><leftJoint>j_l</leftJoint>"
        "<rightJoint>j_r</rightJoint><wheelSeparation>" +
        odd + "</wheelSeparation></plugin></model>");
    ASSERT_EQ(world->models.size(), 1u);
    EXPECT_THAT(texts(*world), testing::Contains(testing::HasSubstr(
                                   "the drive plugin cannot be used: <wheelSeparation>: '" +
                                   std::string(odd) + "'")));
  }
}

// RMF's robots: the plugin's own numbers, its wheels where the model has them, and its defaults.
TEST(DrivePlugins, TheSlotcarOfRmfDrives) {
  const auto robot = [](const std::string& wheels, const std::string& inside) {
    return world_of("<model name='m'><link name='base'/>" + wheels +
                    "<plugin name='slotcar' filename='libslotcar.so'>" + inside +
                    "</plugin></model>");
  };
  std::string tires = wheel("l", "0 0.16 0.1 0 0 0") + wheel("r", "0 -0.16 0.1 0 0 0");
  for (const auto& [from, to] :
       {std::pair("'j_l'", "'joint_tire_left'"), std::pair("'j_r'", "'joint_tire_right'")})
    tires.replace(tires.find(from), 5, to);
  const auto tiny = robot(
      tires,
      "<nominal_drive_speed>0.5</nominal_drive_speed><nominal_drive_acceleration>0.25"
      "</nominal_drive_acceleration><max_drive_acceleration>0.75</max_drive_acceleration>"
      "<nominal_turn_speed>0.6</nominal_turn_speed><nominal_turn_acceleration>1.5"
      "</nominal_turn_acceleration><tire_radius>0.1</tire_radius><base_width>0.3206"
      "</base_width><stop_distance>0.75</stop_distance><nominal_voltage>12</nominal_voltage>");
  EXPECT_THAT(
      texts(*tiny),
      testing::UnorderedElementsAre(
          "the paths of a fleet manager are not driven; ROBOT/velocity and ROBOT/move drive "
          "it",
          "<stop_distance> of the plugin slotcar is not supported: nothing stops it before "
          "an obstacle",
          "<nominal_voltage> of the plugin slotcar is not supported: batteries do not run "
          "down"));
  const auto& drive = *tiny->models[0].model->drive;
  EXPECT_EQ(drive.steering, Steering::differential);
  EXPECT_EQ(drive.left_joints.size(), 1u);
  EXPECT_EQ(drive.track, 0.3206);
  EXPECT_EQ(drive.max_speed, 0.5);
  EXPECT_EQ(drive.acceleration, 0.25);
  EXPECT_EQ(drive.deceleration, 0.75);
  EXPECT_EQ(drive.max_turn_rate, 0.6);
  EXPECT_EQ(drive.turn_acceleration, 1.5);
  const auto whole = robot("", "");
  ASSERT_TRUE(whole->models[0].model->drive);
  EXPECT_EQ(whole->models[0].model->drive->steering, Steering::tracked);
  EXPECT_EQ(whole->models[0].model->drive->track, 0.52);
  EXPECT_EQ(whole->models[0].model->drive->acceleration, 0.05);
}

// A vendor's plugin library drives if it has the usual elements; one without wheels of the model
// does not.
TEST(DrivePlugins, AnUnknownPluginDrivesByItsWheels) {
  const auto robot = [](const std::string& file, const std::string& inside) {
    return world_of("<model name='m'><link name='base'/>" + wheel("l", "0 0.2 0.1 0 0 0") +
                    wheel("r", "0 -0.2 0.1 0 0 0") + "<plugin name='p' filename='" + file + "'>" +
                    inside + "</plugin></model>");
  };
  const std::string kobuki =
      "<left_wheel_joint_name>j_l</left_wheel_joint_name><right_wheel_joint_name>j_r"
      "</right_wheel_joint_name><wheel_separation>0.5</wheel_separation>"
      "<wheel_diameter>0.18</wheel_diameter>";
  const auto known = robot("libgazebo_ros_kobuki.so", kobuki);
  EXPECT_THAT(texts(*known), IsEmpty());
  const auto vendors = robot("libacme_wheels.so", kobuki);
  EXPECT_THAT(texts(*vendors), ElementsAre("the plugin libacme_wheels.so is not known; as it names "
                                           "wheels, it is read as a drive"));
  for (const auto& world : {known, vendors}) {
    const auto& drive = world->models[0].model->drive;
    ASSERT_TRUE(drive);
    EXPECT_FALSE(drive->guessed);
    EXPECT_EQ(drive->track, 0.5);
    EXPECT_EQ(drive->wheel_radius, 0.09);
  }
  const auto other = robot("libacme_doors.so",
                           "<left_joint>port</left_joint><right_joint>starboard</right_joint>");
  EXPECT_FALSE(other->models[0].model->drive);
  EXPECT_THAT(texts(*other), ElementsAre("plugins are not loaded: libacme_doors.so"));
}

// A name alone makes no drive, and each plugin has its own class.
TEST(DrivePlugins, AreKnownByTheirLibraryOrTheirClass) {
  const auto kind = [](const std::string& name, const std::string& filename) {
    Element plugin;
    plugin.attributes = {{"name", name}, {"filename", filename}};
    return kind_of(plugin);
  };
  using Does = PluginKind::Does;
  EXPECT_EQ(kind("omni_camera", "libmy_omnicam.so").does, Does::unknown);
  EXPECT_EQ(kind("diff_drive", "libother.so").does, Does::unknown);
  EXPECT_EQ(kind("x", "/opt/lib/libgazebo_ros_diff_drive.so").does, Does::drive);
  EXPECT_EQ(kind("x", "ignition-gazebo6-diff-drive-system").name, "DiffDrive");
  EXPECT_EQ(kind("gz::sim::systems::Physics", "gz-sim-physics-system").does, Does::served);
  EXPECT_EQ(kind("gz::sim::systems::Buoyancy", "gz-sim-buoyancy-system").does, Does::dead);
  EXPECT_EQ(kind("gz_ros2_control::GazeboSimROS2ControlPlugin", "gz_ros2_control-system").does,
            Does::control);
  EXPECT_EQ(kind("x", "gz-sim-imu-system").does, Does::served);
}

TEST(DrivePlugins, WarnsAboutPluginsWithoutEffect) {
  const auto world = world_of(
      "<model name='m'><link name='l'/><plugin name='a' "
      "filename='libBuoyancyPlugin.so'/><plugin name='b' filename='libRayPlugin.so'/>"
      "<plugin name='c' filename='libgazebo_ros_p3d.so'/><plugin name='d' "
      "filename='libmine.so'/></model>");
  EXPECT_THAT(texts(*world), ElementsAre("the plugin BuoyancyPlugin does nothing here: things "
                                         "would float",
                                         "plugins are not loaded: libmine.so"));
}

// hector's IMU has no <sensor>: it becomes one, on its body, with its rate and its noise.
TEST(SensorPlugins, AnImuWithoutASensor) {
  const auto world = world_of(
      "<model name='m'><link name='a'/><link name='b'><pose>0 0 1 0 0 0</pose></link><plugin "
      "name='imu_controller' filename='libhector_gazebo_ros_imu.so'>"
      "<updateRate>50</updateRate><bodyName>b</bodyName><rateGaussianNoise>0.01 0.02 "
      "0.03</rateGaussianNoise></plugin></model>");
  EXPECT_THAT(texts(*world), testing::IsEmpty());
  const Model& model = *world->models[0].model;
  ASSERT_EQ(model.sensors.size(), 1u);
  EXPECT_EQ(model.sensors[0].name, "imu_controller");
  EXPECT_EQ(model.links[model.sensors[0].link].name, "b");
  EXPECT_EQ(model.sensors[0].element->number("update_rate", 0, Allowed::any(quantity::kRange)),
            50.0);
  EXPECT_EQ(model.sensors[0].element->number("imu/angular_velocity/y/noise/stddev", 0,
                                             Allowed::any(quantity::kRange)),
            0.02);
}

}  // namespace
}  // namespace ruedo::world
