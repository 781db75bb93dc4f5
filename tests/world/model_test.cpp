// Models and worlds from text: poses by hand, includes, drives, names, findings, body layout,
// fleets.
#include <algorithm>
#include <cmath>

#include <ctime>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "text_world.h"
#include "world/load.h"
#include "world/model/body_layout.h"

namespace ruedo::world {
namespace {

// A cart: base 0.4 m up; wheels of radius 0.1 at x 0.2, y +-0.25, on joints that are not at their
// links' origins.
std::string cart(const std::string& extra, const std::string& name = "cart") {
  const auto wheel = [](const std::string& side, const std::string& y) {
    return "<link name='" + side +
           "'><pose>0 0 0.1 0 0 0</pose><inertial><mass>1</mass></inertial><collision "
           "name='c'><pose>0.2 " +
           y +
           " 0 1.5707963267948966 0 "
           "0</pose><geometry><cylinder><radius>0.1</radius><length>0.05</length></cylinder></"
           "geometry></collision></link>"
           "<joint name='" +
           side + "_joint' type='revolute'><pose>0.2 " + y +
           " 0 0 0 0</pose><parent>base</parent><child>" + side +
           "</child><axis><xyz>0 1 0</xyz></axis></joint>";
  };
  return "<model name='" + name +
         "'><link name='base'><pose>0 0 0.4 0 0 "
         "0</pose><inertial><mass>10</mass></inertial></link>" +
         wheel("left", "0.25") + wheel("right", "-0.25") + extra + "</model>";
}
const char* kDrive =
    "<ruedo:drive><ruedo:left_joint>left_joint</ruedo:left_joint><ruedo:right_joint>right_joint</"
    "ruedo:right_joint>";

TEST(Poses, RelativeFramesByHand) {
  // frame f: 1 m ahead of a, turned left by a right angle; b is 2 m ahead of f, so 2 m to the left
  // of it.
  const auto world = world_of(
      "<model name='m'><pose>10 0 0 0 0 1.5707963267948966</pose><link name='a'><pose>0 0 1 0 0 "
      "0</pose></link>"
      "<frame name='f' attached_to='a'><pose>1 0 0 0 0 1.5707963267948966</pose></frame>"
      "<link name='b'><pose relative_to='f'>2 0 0 0 0 0</pose></link></model>");
  const ModelInstance& m = world->models.at(0);
  const Link& b = link_of(*m.model, "b");
  EXPECT_LT((b.X_ML.translation - Vec3(1, 2, 1)).norm(), 1e-12);
  EXPECT_NEAR(heading(b.X_ML.rotation), M_PI / 2, 1e-12);
  // The model itself is turned: its (1, 2) is (-2, 1) in the world.
  EXPECT_LT(((m.X_WM * b.X_ML).translation - Vec3(8, 1, 1)).norm(), 1e-12);
}

// 100 000 frames, each relative to the next: they are followed neither by recursion nor each from
// its own end.
TEST(Poses, AChainOfFramesMayBeOfAnyLength) {
  constexpr int kFrames = 100'000;
  std::string frames;
  for (int i = 0; i < kFrames; ++i) {
    const std::string next = i + 1 < kFrames ? "f" + std::to_string(i + 1) : "base";
    frames += "<frame name='f" + std::to_string(i) + "' attached_to='" + next +
              "'><pose>0.5 0 0 0 0 0</pose></frame>";
  }
  const auto world = load_world_text(
      "<sdf version='1.9'><world name='w'><model name='m'><link name='base'/>" + frames +
          "<link name='tip'><pose relative_to='f0'>0 2 0 0 0 0</pose></link>"
          "<joint name='j' type='fixed'><parent>base</parent><child>f0</child></joint>"
          "</model></world></sdf>",
      "/nowhere/w.sdf");
  ASSERT_EQ(world->models.size(), 1u);
  const Model& model = *world->models[InstanceIndex(0)].model;
  EXPECT_NEAR(model.links[ModelLinkIndex(1)].X_ML.translation.x(), 0.5 * kFrames, 1e-6);
  EXPECT_NEAR(model.links[ModelLinkIndex(1)].X_ML.translation.y(), 2.0, 1e-12);
}

TEST(Poses, OldFrameAttributeMeansRelativeTo) {
  const auto world = load_world_text(
      "<sdf version='1.4'><world name='w'><model name='m'><link name='a'><pose>0 0 1 0 0 "
      "0</pose></link>"
      "<link name='b'><pose frame='a'>0 0 1 0 0 0</pose></link></model></world></sdf>",
      "/nowhere/world.sdf");
  EXPECT_DOUBLE_EQ(link_of(*world->models.at(0).model, "b").X_ML.translation.z(), 2.0);
}

TEST(Poses, CanonicalLinkComesFirstAndIndicesFollow) {
  const auto world = world_of(
      "<model name='m' canonical_link='c'><link name='a'/><link name='b'/><link name='c'><sensor "
      "name='s' type='imu'/></link>"
      "<joint name='j' type='gearbox'><parent>b</parent><child>c</child>"
      "<gearbox_reference_body>a</gearbox_reference_body>"
      "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 0 1</xyz></axis2></joint></model>");
  const Model& m = *world->models.at(0).model;
  EXPECT_EQ(m.links[0].name, "c");
  EXPECT_EQ(m.links[m.joints[0].parent].name, "b");
  EXPECT_EQ(m.links[m.joints[0].child].name, "c");
  EXPECT_EQ(m.links[m.joints[0].gear_reference].name, "a");
  EXPECT_EQ(m.sensors[0].link, 0);
}

TEST(Includes, OverridesAndNames) {
  TemporaryFolder folder;
  folder.write("models/cone/model.config",
               "<model><sdf version='1.4'>old.sdf</sdf><sdf version='1.9'>new.sdf</sdf></model>");
  folder.write("models/cone/new.sdf",
               "<sdf version='1.9'><model name='cone'><pose>0 0 5 0 0 0</pose><link "
               "name='l'/></model></sdf>");
  folder.write("models/cone/old.sdf",
               "<sdf version='1.4'><model name='old'><link name='l'/></model></sdf>");
  const std::string file =
      folder.write("worlds/w.sdf",
                   "<sdf version='1.9'><world name='w'><include><uri>model://cone</uri></include>"
                   "<include><uri>model://cone</uri><name>second</name><pose>1 2 3 0 0 "
                   "0</pose><static>true</static></include>"
                   "<include><uri>model://cone</uri><name>robot</name><sensor name='eye' "
                   "type='imu'/><plugin filename='libx.so' name='x'/></include>"
                   "<include><uri>https://fuel.gazebosim.org/1.0/Somebody/models/Cone</"
                   "uri><name>fuel</name></include>"
                   "<include><uri>model://none</uri></include></world></sdf>");
  const auto world = load_world(file);
  ASSERT_EQ(world->models.size(), 4u);
  EXPECT_EQ(world->models[0].name, "cone");
  EXPECT_EQ(world->models[0].X_WM.translation.z(), 5);
  EXPECT_EQ(world->models[1].X_WM.translation, Vec3(1, 2, 3));
  EXPECT_TRUE(world->models[1].model->is_static);
  EXPECT_FALSE(world->models[0].model->is_static);
  ASSERT_EQ(world->models[2].model->sensors.size(), 1u);
  EXPECT_EQ(world->models[2].model->sensors[0].name, "eye");
  EXPECT_TRUE(world->models[0].model->sensors.empty());
  EXPECT_EQ(world->models[3].model, world->models[0].model);
  EXPECT_EQ(texts(*world),
            (std::vector<std::string>{"plugins are not loaded: libx.so",
                                      "'model://none' is not found; the world runs without it"}));
  EXPECT_EQ(world->findings.back().source.line, 1);
  EXPECT_EQ(world->files_read.size(), 3u);  // its model.config says which file is the model's
}

// The mast's frame is 1 m ahead of the cart's and turned left by a right angle: its sensor is 1.2 m
// ahead, looking left.
// The first one counts, of a file as of an element.
TEST(Includes, WarnsAboutFurtherModelsOfAFile) {
  const TemporaryFolder folder;
  const std::string link = "<link name='l'/></model>";
  folder.write("m.sdf", "<sdf version='1.9'><model name='a'>" + link + "<model name='b'>" + link +
                            "<light name='c'/></sdf>");
  const auto world = load_world_text(
      "<sdf version='1.9'><world name='w'><include><uri>m.sdf</uri></include></world><model "
      "name='d'>" +
          link + "</sdf>",
      folder / "w.sdf");
  EXPECT_THAT(texts(*world),
              testing::ElementsAre("<model> beside a <world> is left out",
                                   "<model> 'b' beside the <model> of a file that is included is "
                                   "left out: the first one counts",
                                   "<light> 'c' beside the <model> of a file that is included is "
                                   "left out: the first one counts"));
  ASSERT_EQ(world->models.size(), 1u);
  EXPECT_EQ(world->models[0].name, "a");
}

TEST(Includes, MergedModelsBringTheirSensors) {
  TemporaryFolder folder;
  folder.write("models/mast/model.sdf",
               "<sdf version='1.9'><model name='mast'><link name='pole'><pose>0 -0.2 0.5 0 0 "
               "0</pose><sensor name='LRF' type='lidar'><pose>0 0 0.1 0 0 0</pose>"
               "<update_rate>7</update_rate></sensor></link></model></sdf>");
  const auto world = load_world(folder.write(
      "w.sdf",
      "<sdf version='1.9'><world name='w'><model name='cart'><link name='base'/><include "
      "merge='true'><uri>model://mast</uri>"
      "<pose>1 0 0 0 0 1.5707963267948966</pose></include><joint name='j' "
      "type='fixed'><parent>base</parent><child>pole</child></joint></model></world></sdf>"));
  const Model& cart = *world->models.at(0).model;
  ASSERT_EQ(cart.sensors.size(), 1u);
  const SensorDescription& lrf = cart.sensors[0];
  EXPECT_EQ(lrf.name, "LRF");
  EXPECT_EQ(lrf.element->string("update_rate", ""), "7");
  const Link& pole = cart.links[lrf.link];
  EXPECT_EQ(pole.name, "pole");
  const Pose X_MS = pole.X_ML * lrf.X_LS;
  EXPECT_LT((X_MS.translation - Vec3(1.2, 0, 0.6)).norm(), 1e-12);
  EXPECT_NEAR(heading(X_MS.rotation), M_PI / 2, 1e-12);
  EXPECT_EQ(BodyLayout(*world).bodies.size(), 1u);
  EXPECT_TRUE(texts(*world).empty());
}

TEST(Includes, PackagesGoByTheirManifests) {
  TemporaryFolder folder;
  folder.write("models/somebodys-checkout/package.xml",
               "<package format='2'><name>cart_description</name></package>");
  folder.write("models/somebodys-checkout/sdf/cart.sdf",
               "<sdf version='1.9'><model name='cart'><link name='l'/></model></sdf>");
  folder.write("models/broken/package.xml", "<package><name>cart_desc");
  const auto world = load_world(folder.write(
      "w.sdf",
      "<sdf version='1.9'><world "
      "name='w'><include><uri>package://cart_description/sdf/cart.sdf</uri></include>"
      "<include><uri>model://cart_description/sdf/cart.sdf</uri><name>second</name></include>"
      "<include><uri>package://cart_description/sdf/none.sdf</uri></include><include><uri>package:/"
      "/cart_desc/sdf/cart.sdf</uri></include></world></sdf>"));
  ASSERT_EQ(world->models.size(), 2u);
  EXPECT_EQ(world->models[0].model, world->models[1].model);
  EXPECT_EQ(texts(*world),
            (std::vector<std::string>{
                "'package://cart_description/sdf/none.sdf' is not found; the world runs without it",
                "'package://cart_desc/sdf/cart.sdf' is not found; the world runs without it"}));
}

TEST(Includes, AThousandShareOneModel) {
  TemporaryFolder folder;
  folder.write("robot.sdf",
               "<sdf version='1.9'>" + cart(std::string(kDrive) + "</ruedo:drive>") + "</sdf>");
  std::string text = "<sdf version='1.9'><world name='w'>";
  for (int i = 0; i < 1000; ++i) {
    text += "<include><uri>robot.sdf</uri><name>r" + std::to_string(i) + "</name><pose>" +
            std::to_string(i) + " 0 0 0 0 0</pose><static>false</static></include>";
  }
  const auto world = load_world(folder.write("fleet.sdf", text + "</world></sdf>"));
  ASSERT_EQ(world->models.size(), 1000u);
  for (const ModelInstance& each : world->models) EXPECT_EQ(each.model, world->models[0].model);
  EXPECT_EQ(world->files_read.size(), 2u);
  const BodyLayout layout(*world);
  EXPECT_EQ(layout.bodies.size(), 1000u);
  EXPECT_EQ(layout.wheels.size(), 2000u);
}

TEST(Names, OfSensors) {
  const auto world = world_of(
      "<model name='m'><link name='a'><sensor name='eye' type='imu'/><sensor name='x::y' "
      "type='imu'/></link><link name='b'><sensor name='eye' type='imu'/></link>"
      "<model name='arm'><link name='hand'><sensor name='eye' type='imu'/></link></model></model>");
  std::vector<std::string> names;
  for (const auto& sensor : world->models.at(0).model->sensors) names.push_back(sensor.name);
  EXPECT_EQ(names, (std::vector<std::string>{"a-eye", "x.y", "b-eye", "arm.eye"}));
  EXPECT_NO_THROW(link_of(*world->models.at(0).model, "arm.hand"));
}

TEST(Names, RenamesDuplicatesWithAFinding) {
  const auto world = world_of(
      "<model name='box'><link name='l'/></model><model name='box'><link name='l'/></model>");
  ASSERT_EQ(world->models.size(), 2u);
  EXPECT_EQ(world->models[1].name, "box_2");
  EXPECT_EQ(
      texts(*world),
      (std::vector<std::string>{"a second thing of the name 'box'; this one is called 'box_2'"}));
}

// An algorithm that is quadratic in their number would take minutes.
TEST(Names, ManyThingsOfOneNameLoadAtOnce) {
  std::string boxes;
  for (int i = 0; i < 20'000; ++i) boxes += "<model name='box'><link name='l'/></model>";
  const std::clock_t before = std::clock();
  const auto world = world_of(boxes);
  EXPECT_LT(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC, 20.0);
  ASSERT_EQ(world->models.size(), 20'000u);
  EXPECT_EQ(world->models.back().name, "box_20000");
}

TEST(Model, SpringsOfJointsAreRead) {
  const auto world = world_of(
      "<model name='m'><link name='a'/><link name='b'/><joint name='j' "
      "type='prismatic'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz>"
      "<dynamics><spring_reference>0.2</spring_reference><spring_stiffness>100</spring_stiffness></"
      "dynamics></axis></joint></model>");
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
  const JointAxis& axis = world->models.at(0).model->joints.at(0).axis;
  EXPECT_EQ(axis.spring_stiffness, 100.0);
  EXPECT_EQ(axis.spring_reference, 0.2);
}

// A surface with all its elements.
TEST(Model, SurfacesAreRead) {
  const auto world = world_of(
      "<model name='m'><link name='a'><collision "
      "name='c'><geometry><sphere><radius>1</radius></sphere></"
      "geometry><surface><friction><ode><mu>0.7</mu>"
      "<mu2>0.2</mu2><fdir1>0 1 "
      "0</fdir1><slip1>0.01</slip1><slip2>0.02</slip2></ode><torsional><coefficient>0.3</"
      "coefficient>"
      "<patch_radius>0.04</patch_radius></torsional></friction><contact><ode><kp>5e4</kp><kd>30</"
      "kd></ode></contact></surface></collision></link></model>");
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
  const Surface& surface = world->models.at(0).model->links.at(0).collisions.at(0).surface;
  EXPECT_EQ(surface.friction, 0.7);
  EXPECT_EQ(surface.friction2, 0.2);
  EXPECT_EQ(surface.friction_direction, Vec3(0, 1, 0));
  EXPECT_EQ(surface.slip, 0.01);
  EXPECT_EQ(surface.slip2, 0.02);
  EXPECT_EQ(surface.torsional, 0.3);
  EXPECT_EQ(surface.patch_radius, 0.04);
  EXPECT_EQ(surface.stiffness, 5e4);
  EXPECT_EQ(surface.damping, 30.0);
}

TEST(Model, TheSolverOfTheWorldIsRead) {
  const auto solver_of = [](const std::string& bullet) {
    return world_of("<physics type='x'><bullet>" + bullet + "</bullet></physics>")->solver;
  };
  const SolverDescription given = solver_of(
      "<solver><iters>70</iters></solver><constraints><erp>0.3</erp></"
      "constraints><ruedo:substeps>4</ruedo:substeps><ruedo:tolerance>1e-7</ruedo:tolerance>");
  EXPECT_EQ(given.iterations, 70);
  EXPECT_EQ(given.error_reduction, 0.3);
  EXPECT_EQ(given.substeps, 4);
  EXPECT_EQ(given.tolerance, 1e-7);
  EXPECT_EQ(solver_of("").iterations, SolverDescription().iterations);
  const auto wrong =
      world_of("<physics type='x'><bullet><solver><iters>0</iters></solver></bullet></physics>");
  EXPECT_EQ(texts(*wrong).size(), 1u);
  EXPECT_EQ(wrong->solver.iterations, SolverDescription().iterations);
  EXPECT_THROW(solver_of("<ruedo:substep>4</ruedo:substep>"), InputError);
  EXPECT_EQ(
      texts(
          *world_of(
              "<physics type='x'><bullet><solver><type>dantzig</type></solver></bullet></physics>"))
          .size(),
      1u);
}

TEST(Findings, ReportsUnsupportedElementsOnce) {
  const auto world = world_of(
      "<gui><camera name='c'/></gui><road name='r'/><physics "
      "type='ode'><max_step_size>0.0033333333</max_step_size></physics>"
      "<model name='m'><link "
      "name='l'><colision/><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>5</izz></"
      "inertia></inertial>"
      "<collision name='c'><geometry><box><size>1 2 3</size></box></geometry></collision>"
      "<visual "
      "name='v'><geometry><mesh><uri>model://x/y.dae</uri></mesh></geometry></visual></link></"
      "model>");
  EXPECT_EQ(world->step_us, 3333);
  EXPECT_EQ(
      texts(*world),
      (std::vector<std::string>{
          "<road> is not supported and left out",
          "the step 0.0033333333 s is not a whole number of microseconds; it is 3333 us instead",
          "<colision> is not known and left out; did you mean <collision>?",
          "the mesh 'model://x/y.dae' is not found; the shape is left out",
          "one moment of inertia is larger than the sum of the two others; the inertia of a box of "
          "1 x 2 x 3 m is taken instead"}));
  // A box of 1 kg: m/12 (b^2 + c^2).
  const Eigen::Matrix3d I = world->models.at(0).model->links[0].inertial.inertia;
  EXPECT_NEAR(I(0, 0), 13.0 / 12, 1e-12);
  EXPECT_NEAR(I(2, 2), 5.0 / 12, 1e-12);
}

TEST(Drive, DefaultsComeFromTheWheels) {
  const auto world = world_of(
      cart(std::string(kDrive) +
           "<ruedo:max_speed>1.5</ruedo:max_speed><ruedo:acceleration>2</ruedo:acceleration>"
           "<ruedo:watchdog>0.25</ruedo:watchdog></ruedo:drive><ruedo:odometry><ruedo:rate>12.5</"
           "ruedo:rate></ruedo:odometry>"));
  const DriveDescription& d = *world->models.at(0).model->drive;
  EXPECT_DOUBLE_EQ(d.wheel_radius, 0.1);
  EXPECT_DOUBLE_EQ(d.track, 0.5);
  EXPECT_LT((d.X_MBase.translation - Vec3(0.2, 0, 0)).norm(), 1e-12);
  EXPECT_EQ(d.max_speed, 1.5);
  EXPECT_EQ(d.deceleration, 2);  // as the acceleration
  EXPECT_EQ(d.watchdog_us, 250'000);
  EXPECT_EQ(d.odometry_rate, (Rate{25, 2}));
  EXPECT_NEAR(d.max_force, 12 * 9.80665, 1e-9);
}

TEST(Drive, RepairsSwappedSides) {
  const auto world = world_of(cart(
      "<plugin filename='libgazebo_ros_diff_drive.so' "
      "name='d'><leftJoint>right_joint</leftJoint><rightJoint>left_joint</rightJoint></plugin>"));
  const Model& m = *world->models.at(0).model;
  EXPECT_EQ(m.joints[m.drive->left_joints[0]].name, "left_joint");
  EXPECT_NEAR(heading(m.drive->X_MBase.rotation), 0, 1e-12);
}

TEST(Drive, GazeboPlugins) {
  struct Plugin {
    const char* attributes;
    const char* inside;
    double radius, track, speed;
  };
  const double none = std::numeric_limits<double>::infinity();
  const Plugin plugins[] = {
      {"filename='gz-sim-diff-drive-system' name='gz::sim::systems::DiffDrive'",
       "<left_joint>left_joint</left_joint><right_joint>right_joint</"
       "right_joint><wheel_separation>0.6</wheel_separation><wheel_radius>0.2</wheel_radius>"
       "<max_linear_velocity>0.7</max_linear_velocity>",
       0.2, 0.6, 0.7},
      {"filename='libignition-gazebo6-diff-drive-system.so' "
       "name='ignition::gazebo::systems::DiffDrive'",
       "<left_joint>left_joint</left_joint><right_joint>right_joint</right_joint>", 0.1, 0.5, none},
      {"filename='libgazebo_ros_diff_drive.so' name='d'",
       "<left_joint>left_joint</left_joint><right_joint>right_joint</"
       "right_joint><wheel_separation>0.55</wheel_separation><wheel_diameter>0.3</wheel_diameter>",
       0.15, 0.55, none},
      {"filename='libDiffDrivePlugin.so' name='d'",
       "<left_joint>cart::left_joint</left_joint><right_joint>right_joint</right_joint><torque>5</"
       "torque>",
       0.1, 0.5, none},
      {"filename='libSkidSteerDrivePlugin.so' name='d'",
       "<left_front>left_joint</left_front><right_front>right_joint</right_front><MaxForce>5</"
       "MaxForce>",
       0.1, 0.5, none},
      {"filename='libgazebo_ros_skid_steer_drive.so' name='d'",
       "<leftFrontJoint>left_joint</leftFrontJoint><rightFrontJoint>right_joint</"
       "rightFrontJoint><wheelSeparation>0.4</wheelSeparation><wheelDiameter>0.215</wheelDiameter>",
       0.1075, 0.4, none},
  };
  for (const Plugin& plugin : plugins) {
    SCOPED_TRACE(plugin.attributes);
    const auto world = world_of(
        cart(std::string("<plugin ") + plugin.attributes + ">" + plugin.inside + "</plugin>"));
    EXPECT_TRUE(world->findings.empty());
    ASSERT_TRUE(world->models.at(0).model->drive);
    const DriveDescription& d = *world->models[0].model->drive;
    EXPECT_DOUBLE_EQ(d.wheel_radius, plugin.radius);
    EXPECT_DOUBLE_EQ(d.track, plugin.track);
    EXPECT_EQ(d.max_speed, plugin.speed);
  }
  const auto other = world_of(cart("<plugin filename='libgazebo_ros_wheel_slip.so' name='p'/>"));
  EXPECT_FALSE(other->models.at(0).model->drive);
  EXPECT_EQ(
      texts(*other),
      (std::vector<std::string>{
          "the plugin gazebo_ros_wheel_slip does nothing here: wheels would slip as it says"}));
}

TEST(Layout, KinematicRobotIsOneBody) {
  const std::string caster =
      "<link name='caster'><pose>-0.3 0 0.05 0 0 0</pose><collision "
      "name='c'><geometry><sphere><radius>0.05</radius></sphere></geometry></collision></link>"
      "<joint name='caster_joint' type='ball'><parent>base</parent><child>caster</child></joint>"
      "<link name='pan'><pose>0 0 0.8 0 0 0</pose><collision name='c'><geometry><box><size>0.1 0.1 "
      "0.1</size></box></geometry></collision></link>"
      "<joint name='pan_joint' "
      "type='continuous'><parent>base</parent><child>pan</child><axis><xyz>0 0 "
      "1</xyz></axis></joint>";
  const auto world = world_of(
      "<model name='wall'><static>true</static><pose>0 0 7 0 0 0</pose><link name='w'/></model>" +
      cart(std::string(kDrive) + "</ruedo:drive>" + caster));
  const BodyLayout layout(*world);
  // The base with both wheels and the caster; the pan on its joint.
  ASSERT_EQ(layout.bodies.size(), 2u);
  EXPECT_EQ(layout.bodies[0].name, "cart/base");
  EXPECT_EQ(layout.bodies[1].name, "cart/pan");
  EXPECT_EQ(layout.bodies[0].links.size(), 4u);
  ASSERT_EQ(layout.joints.size(), 1u);
  EXPECT_EQ(layout.joints[0].parent_body, 0);
  EXPECT_EQ(layout.joints[0].child_body, 1);
  EXPECT_EQ(layout.links[0].body, -1);
  EXPECT_EQ(layout.links[0].X_BL.translation.z(), 7);  // static: in the world
  ASSERT_EQ(layout.robots.size(), 1u);
  EXPECT_EQ(layout.robots[0].body, 0);
  EXPECT_LT((layout.robots[0].X_BBase.translation - Vec3(0.2, 0, -0.4)).norm(), 1e-12);
  ASSERT_EQ(layout.wheels.size(), 2u);
  EXPECT_TRUE(layout.wheels[0].left);
  EXPECT_EQ(layout.wheels[0].axis_in_L, Vec3(0, 1, 0));
  EXPECT_LT((layout.wheels[0].center_in_L - Vec3(0.2, 0.25, 0)).norm(), 1e-12);
  // A wheel's axle keeps its direction however far the wheel turns.
  const int left = layout.wheels[0].link;
  for (const double angle : {0.0, 1.0, 10.0}) {
    const Pose X_BL = layout.link_in_body(LinkIndex(left), {angle, 0});
    EXPECT_LT((X_BL * Vec3(0.2, 0.25, 0) - Vec3(0.2, 0.25, -0.3)).norm(), 1e-12);
  }
  // A quarter turn ahead brings the foremost point to the bottom.
  const Pose X_BL = layout.link_in_body(LinkIndex(left), {M_PI / 2, 0});
  EXPECT_LT((X_BL * Vec3(0.3, 0.25, 0) - Vec3(0.2, 0.25, -0.4)).norm(), 1e-12);
}

TEST(Layout, WheelsDriveHasABodyForEachWheel) {
  std::string drive = kDrive;
  drive.insert(drive.find('>'), " type='wheels'");
  const auto world = world_of(cart(drive + "</ruedo:drive>"));
  const BodyLayout layout(*world);
  EXPECT_EQ(layout.bodies.size(), 3u);
  EXPECT_TRUE(layout.joints.empty());
  EXPECT_EQ(layout.wheels.size(), 2u);
  EXPECT_EQ(layout.links[layout.wheels[0].link].wheel, -1);
}

TEST(Layout, StaticPartOfAMovingModelStays) {
  const auto world = world_of(
      "<model name='gate'><link name='bar'/><model name='post'><static>true</static><link "
      "name='p'/></model>"
      "<joint name='hinge' type='revolute'><parent>post::p</parent><child>bar</child><axis><xyz>0 "
      "0 1</xyz></axis></joint></model>");
  const BodyLayout layout(*world);
  ASSERT_EQ(layout.bodies.size(), 1u);
  EXPECT_EQ(layout.bodies[0].name, "gate/bar");
  ASSERT_EQ(layout.joints.size(), 1u);
  EXPECT_EQ(layout.joints[0].parent_body, -1);
}

TEST(Layout, AJointOfTheOuterModelTiesLinksOfTwoNestedOnes) {
  const auto world = world_of(
      "<model name='crane'><model name='tower'><link name='top'/></model><model name='arm'><pose>1 "
      "0 2 0 0 0</pose><link name='beam'/></model>"
      "<joint name='slew' "
      "type='continuous'><parent>tower::top</parent><child>arm::beam</child><axis><xyz>0 0 "
      "1</xyz></axis></joint></model>");
  const BodyLayout layout(*world);
  ASSERT_EQ(layout.bodies.size(), 2u);
  ASSERT_EQ(layout.joints.size(), 1u);
  EXPECT_EQ(layout.bodies[layout.joints[0].parent_body].name, "crane/tower.top");
  EXPECT_EQ(layout.bodies[layout.joints[0].child_body].name, "crane/arm.beam");
  const Joint& joint = world->models[0].model->joints[0];
  EXPECT_NEAR((joint.X_MJ.translation - Vec3(1, 0, 2)).norm(), 0, 1e-12);  // at its child
}

TEST(Corpus, TheTwoWorldsLoadWithTheirMeshes) {
  const std::string corpus = std::string(RUEDO_SOURCE_DIR) + "/../shared/corpus";
  if (!std::filesystem::exists(corpus))
    GTEST_SKIP() << "the corpus of real worlds is not here: " << corpus;
  const auto house = load_world(corpus + "/turtlebot3/worlds/turtlebot3_house.world");
  ASSERT_EQ(house->models.size(), 2u);
  EXPECT_EQ(house->models[0].name, "ground_plane");
  EXPECT_EQ(house->models[1].model->links.size(), 34u);
  EXPECT_TRUE(house->models[1].model->is_static);
  const auto warehouse =
      load_world(corpus + "/small_warehouse/worlds/no_roof_small_warehouse.world");
  EXPECT_EQ(warehouse->models.size(), 25u);
  ASSERT_EQ(warehouse->findings.size(), 1u);
  EXPECT_EQ(warehouse->findings[0].kind, Finding::Kind::repaired);
  // The authors' boxes say how large their shelves are: COLLADA's centimetres have become metres.
  for (const ModelInstance& each : warehouse->models) {
    for (const Visual& visual : each.model->links[0].visuals) {
      Eigen::AlignedBox3f box;
      for (const auto& p : visual.geometry.mesh->positions) box.extend(p);
      EXPECT_LT(box.sizes().maxCoeff(), 25.0f) << each.name;
      EXPECT_GT(box.sizes().maxCoeff(), 0.2f) << each.name;
    }
  }
}

}  // namespace
}  // namespace ruedo::world
