// Lifts that are called by floor, and doors that open on command: of gz-sim, Gazebo Classic and
// RMF.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ruedo/joint_command_t.hpp>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

constexpr int8_t kFloor = joint_command_t::FLOOR, kOpen = joint_command_t::OPEN;

std::string box(const std::string& name, const std::string& pose, const std::string& size,
                double mass) {
  const std::string m = std::to_string(mass);
  return "<link name='" + name + "'><pose>" + pose + "</pose><inertial><mass>" + m +
         "</mass><inertia><ixx>" + m + "</ixx><iyy>" + m + "</iyy><izz>" + m +
         "</izz></inertia></inertial><collision name='c'><geometry><box><size>" + size +
         "</size></box></geometry></collision></link>";
}

std::string slider(const std::string& name, const std::string& parent, const std::string& child,
                   const std::string& axis, double lower, double upper) {
  return "<joint name='" + name + "' type='prismatic'><parent>" + parent + "</parent><child>" +
         child + "</child><axis><xyz>" + axis + "</xyz><limit><lower>" + std::to_string(lower) +
         "</lower><upper>" + std::to_string(upper) + "</upper></limit></axis></joint>";
}

std::string controller(const std::string& joint, double p, double d) {
  return "<plugin filename='gz-sim-joint-position-controller-system' "
         "name='gz::sim::systems::JointPositionController'><joint_name>" +
         joint + "</joint_name><p_gain>" + std::to_string(p) +
         "</p_gain><i_gain>0</i_gain><d_gain>" + std::to_string(d) +
         "</d_gain><cmd_max>100000</cmd_max><cmd_min>-100000</cmd_min></plugin>";
}

// gz-sim's: a cabin whose floor is at the joint's height, three floors 2 m apart, and on each a
// leaf of 1 m across the entrance at x = 0.6, which slides aside along y.
std::string elevator(const std::string& more = "") {
  std::string text = "<model name='lift'>" + box("cabin", "0 0 -0.05 0 0 0", "1 1 0.1", 100) +
                     slider("lift", "world", "cabin", "0 0 1", -0.1, 5) +
                     controller("lift", 20000, 8000);
  for (int i = 0; i < 3; ++i) {
    const std::string n = std::to_string(i), z = std::to_string(2 * i);
    text += "<link name='floor_" + n + "'><pose>0.6 0 " + z +
            " 0 0 0</pose></link><joint name='fixed_" + n +
            "' type='fixed'><parent>world</parent><child>floor_" + n + "</child></joint>" +
            box("leaf_" + n, "0.6 0 " + std::to_string(2 * i + 0.9) + " 0 0 0", "0.05 1 1.6", 10) +
            slider("door_" + n, "floor_" + n, "leaf_" + n, "0 1 0", 0, 0.9) +
            controller("door_" + n, 200, 120);
  }
  return text +
         "<plugin filename='gz-sim-elevator-system' name='gz::sim::systems::Elevator'>"
         "<open_door_wait_duration>2</open_door_wait_duration>" +
         more + "</plugin></model>";
}

double joint(const Sim& sim, const std::string& name) {
  for (const JointIndex i : sim.layout.joints.indices()) {
    const auto& placed = sim.layout.joints[i];
    if (sim.world->models[placed.instance].model->joints[placed.joint].name == name)
      return sim.state.joint_positions[i];
  }
  ADD_FAILURE() << name;
  return 0.0;
}

void tell(Sim& sim, const std::string& name, int8_t mode, double value,
          RobotIndex robot = RobotIndex(0)) {
  sim.robots.apply({robot, JointCommand{{name}, {mode}, {value}}});
}

int8_t refusal(const Sim& sim) {
  return sim.state.motion_ends.empty() ? Status::REASON_NONE
                                       : sim.state.motion_ends.front().state.reason;
}

TEST(Lifts, MoveToTheCommandedFloorAndOpenThere) {
  Sim sim(elevator(), 1000);
  EXPECT_TRUE(sim.world->findings.empty()) << sim.world->findings.front().text;
  sim.run(1.0);
  EXPECT_NEAR(joint(sim, "lift"), 0.0, 0.06);  // m g / p = 49 mm below, as in Gazebo
  tell(sim, "lift", kFloor, 2);
  double widest_below = 0.0, open_while_it_moves = 0.0;
  for (int i = 0; i < 60 && joint(sim, "door_2") < 0.85; ++i) {
    sim.run(0.1);
    widest_below = std::max({widest_below, joint(sim, "door_0"), joint(sim, "door_1")});
    if (joint(sim, "lift") < 3.8)
      open_while_it_moves = std::max(open_while_it_moves, joint(sim, "door_2"));
  }
  EXPECT_NEAR(joint(sim, "lift"), 4.0, 0.06);
  EXPECT_NEAR(joint(sim, "door_2"), 0.9, 0.05);
  EXPECT_LT(widest_below, 0.01);
  EXPECT_LT(open_while_it_moves, 0.01);
  sim.run(1.5);  // it waits 2 s
  EXPECT_NEAR(joint(sim, "door_2"), 0.9, 0.05);
  sim.run(5.0);
  EXPECT_NEAR(joint(sim, "door_2"), 0.0, 0.02);
}

TEST(Lifts, ServeCallsInTheirOrder) {
  Sim sim(elevator(), 1000);
  tell(sim, "lift", kFloor, 2);
  tell(sim, "lift", kFloor, 1);
  tell(sim, "lift", kFloor, 2);  // it is called already
  std::vector<int> opened;
  for (int i = 0; i < 300; ++i) {
    sim.run(0.1);
    for (int floor = 0; floor < 3; ++floor) {
      if (joint(sim, "door_" + std::to_string(floor)) > 0.8 &&
          (opened.empty() || opened.back() != floor))
        opened.push_back(floor);
    }
  }
  EXPECT_THAT(opened, ::testing::ElementsAre(2, 1));
}

TEST(Lifts, RefuseUnknownFloorsAndDoors) {
  Sim sim(elevator());
  const auto reason = [&](const std::string& name, int8_t mode, double value) {
    tell(sim, name, mode, value);
    sim.step();
    return refusal(sim);
  };
  EXPECT_EQ(reason("lift", kFloor, 3), Status::REASON_BAD_VALUE);
  EXPECT_EQ(reason("lift", kFloor, -1), Status::REASON_BAD_VALUE);
  EXPECT_EQ(reason("lift", kFloor, 0.5), Status::REASON_BAD_VALUE);
  EXPECT_EQ(reason("door_1", kFloor, 1), Status::REASON_BAD_VALUE);
  EXPECT_EQ(reason("lift", kOpen, 1), Status::REASON_BAD_VALUE);
  EXPECT_EQ(reason("door_1", kOpen, 2), Status::REASON_BAD_VALUE);
}

// A case of 30 kg in the doorway: the leaf comes back, and closes when the case is gone.
TEST(Lifts, ADoorThatIsBlockedDoesNotClose) {
  Sim sim(elevator() + box_sdf("ground", "5 0 -0.5 0 0 0", "8.9 4 1") +
              box_sdf("case", "3 0 0.4 0 0 0", "0.3 0.3 0.8", 30.0),
          1000);
  const auto put = [&](double x) {
    sim.robots.set_pose(InstanceIndex(2), {Quat::Identity(), {x, 0.0, 0.4}});
  };
  tell(sim, "lift", kFloor, 0);
  sim.run(4.0);
  ASSERT_GT(joint(sim, "door_0"), 0.85);
  put(0.6);
  double narrowest = 1.0, widest = 0.0;
  for (int i = 0; i < 120; ++i) {
    sim.run(0.1);
    narrowest = std::min(narrowest, joint(sim, "door_0"));
    if (i > 60) widest = std::max(widest, joint(sim, "door_0"));
  }
  EXPECT_NEAR(narrowest, 0.65, 0.02);  // the case reaches to y = 0.15, the closed leaf to -0.5
  EXPECT_GT(widest, 0.8);
  put(3.0);
  sim.run(8.0);
  EXPECT_NEAR(joint(sim, "door_0"), 0.0, 0.02);
}

std::string rmf_door(const std::string& name, bool component) {
  const std::string inside =
      "<v_max_door>0.5</v_max_door><a_max_door>0.5</a_max_door><a_nom_door>0.5</a_nom_door>"
      "<dx_min_door>0.001</dx_min_door><f_max_door>500</f_max_door><door name='" +
      name +
      "' type='DoubleSlidingDoor' left_joint_name='left_joint' right_joint_name='right_joint'/>";
  return "<model name='" + name + "_model'>" + box("right", "0.5 0 1 0 0 0", "0.98 0.03 2", 50) +
         slider("right_joint", "world", "right", "1 0 0", 0, 1) +
         box("left", "-0.5 0 1 0 0 0", "0.98 0.03 2", 50) +
         slider("left_joint", "world", "left", "1 0 0", -1, 0) +
         (component ? "<plugin name='register_component' filename='libregister_component.so'>"
                      "<component name='Door'>" +
                          inside + "</component></plugin>"
                    : "<plugin name='door' filename='libdoor.so'>" + inside + "</plugin>") +
         "</model>";
}

// A trapezoid: 1 m at 0.5 m/s and 0.5 m/s^2 takes 1 / 0.5 + 0.5 / 0.5 = 3 s.
TEST(Doors, OfRmfFollowTheirCommands) {
  for (const bool component : {false, true}) {
    Sim sim(rmf_door("gate", component), 1000);
    EXPECT_TRUE(sim.world->findings.empty()) << sim.world->findings.front().text;
    tell(sim, "gate", kOpen, 1);
    sim.run(1.0);
    EXPECT_NEAR(joint(sim, "right_joint"), 0.25, 0.01);
    sim.run(2.05);
    EXPECT_NEAR(joint(sim, "right_joint"), 1.0, 0.005);
    EXPECT_NEAR(joint(sim, "left_joint"), -1.0, 0.005);
    tell(sim, "gate", kOpen, 0);
    sim.run(3.1);
    EXPECT_NEAR(joint(sim, "right_joint"), 0.0, 0.005);
    EXPECT_NEAR(joint(sim, "left_joint"), 0.0, 0.005);
  }
}

// As RMF's map tools write it: the cabin's door is a model within the lift's, the shaft's door is a
// separate model, and the doors stay open until the next call.
TEST(Lifts, OfRmfMoveTheDoorsOfCabinAndShaft) {
  const std::string cabin_door =
      "<model name='CabinDoor'><pose>0.6 0 0 0 0 1.5707963</pose>" +
      box("right_door", "0.25 0 1 0 0 0", "0.5 0.03 2", 10) +
      "<plugin name='register_component' filename='libregister_component.so'><component "
      "name='Door'><v_max_door>0.5</v_max_door><a_nom_door>0.5</a_nom_door><f_max_door>100"
      "</f_max_door><door left_joint_name='empty_joint' name='CabinDoor' "
      "right_joint_name='CabinDoor_right_joint' type='SlidingDoor'/></component></plugin></model>";
  const std::string shaft_door =
      "<model name='ShaftDoor'><pose>0.7 0 3 0 0 1.5707963</pose>" +
      box("right_door", "0.25 0 1 0 0 0", "0.5 0.03 2", 10) +
      slider("right_joint", "world", "right_door", "1 0 0", 0, 0.5) +
      "<plugin name='door' filename='libdoor.so'><v_max_door>0.5</v_max_door><a_nom_door>0.5"
      "</a_nom_door><f_max_door>100</f_max_door><door left_joint_name='empty_joint' "
      "name='ShaftDoor' right_joint_name='right_joint' type='SlidingDoor'/></plugin></model>";
  const std::string lift =
      "<model name='Lift1'>" + box("platform", "0 0 -0.05 0 0 0", "1 1 0.1", 1200) +
      slider("cabin_joint", "world", "platform", "0 0 1", -10, 10) + cabin_door +
      slider("CabinDoor_right_joint", "platform", "CabinDoor::right_door", "0 1 0", 0, 0.5) +
      "<plugin name='register_component' filename='libregister_component.so'><component "
      "name='Lift'><lift_name>Lift1</lift_name><floor name='L1' elevation='0'/><floor name='L2' "
      "elevation='3'><door_pair cabin_door='CabinDoor' shaft_door='ShaftDoor'/></floor>"
      "<v_max_cabin>2</v_max_cabin><a_nom_cabin>1</a_nom_cabin><f_max_cabin>25323</f_max_cabin>"
      "<cabin_joint_name>cabin_joint</cabin_joint_name></component></plugin></model>";
  Sim sim(lift + shaft_door, 1000);
  EXPECT_TRUE(sim.world->findings.empty()) << sim.world->findings.front().text;
  tell(sim, "cabin_joint", kFloor, 1);
  sim.run(1.0);
  EXPECT_NEAR(joint(sim, "cabin_joint"), 0.5, 0.01);  // a t^2 / 2
  sim.run(2.6);                                       // 2 sqrt(3) s in all
  EXPECT_NEAR(joint(sim, "cabin_joint"), 3.0, 0.005);
  sim.run(2.2);
  EXPECT_NEAR(joint(sim, "CabinDoor_right_joint"), 0.5, 0.005);
  EXPECT_NEAR(joint(sim, "right_joint"), 0.5, 0.005);
  sim.run(20.0);
  EXPECT_NEAR(joint(sim, "right_joint"), 0.5, 0.005);
  tell(sim, "cabin_joint", kFloor, 0);
  sim.run(6.0);
  EXPECT_NEAR(joint(sim, "right_joint"), 0.0, 0.005);
  EXPECT_NEAR(joint(sim, "cabin_joint"), 0.0, 0.005);
}

// Gazebo Classic's: one door in the cabin, PIDs of the plugin's own, floors 3 m apart.
TEST(Lifts, OfGazeboClassicGoByFloors) {
  Sim sim("<model name='m'><model name='car'>" + box("cabin", "0 0 -0.05 0 0 0", "1 1 0.1", 100) +
              slider("lift", "world", "cabin", "0 0 1", 0, 10) +
              box("leaf", "0.6 0 0.9 0 0 0", "0.05 1 1.6", 1) +
              slider("door", "cabin", "leaf", "0 1 0", 0, 1) +
              "</model><plugin filename='libElevatorPlugin.so' name='e'><lift_joint>m::car::lift"
              "</lift_joint><door_joint>m::car::door</door_joint><floor_height>3</floor_height>"
              "<door_wait_time>1</door_wait_time><topic>~/elevator1</topic></plugin></model>",
          1000);
  EXPECT_TRUE(sim.world->findings.empty()) << sim.world->findings.front().text;
  tell(sim, "car.lift", kFloor, 1);
  sim.run(20.0);
  EXPECT_NEAR(joint(sim, "car.lift"), 3.0, 0.02);
  tell(sim, "car.lift", kFloor, 4);  // the joint ends at 10 m
  sim.step();
  EXPECT_EQ(refusal(sim), Status::REASON_BAD_VALUE);
}

TEST(Lifts, ReportMissingDoorsAndJoints) {
  Sim sim(rmf_door("gate", false) + "<model name='l'>" +
          box("platform", "0 5 0 0 0 0", "1 1 0.1", 10) +
          slider("cabin_joint", "world", "platform", "0 0 1", -10, 10) +
          "<plugin name='lift' filename='liblift.so'><floor name='L1' elevation='0'><door_pair "
          "cabin_door='nowhere' shaft_door='gate'/></floor><cabin_joint_name>cabin_joint"
          "</cabin_joint_name></plugin></model>"
          "<model name='e'><link name='a'/><plugin filename='gz-sim-elevator-system' "
          "name='gz::sim::systems::Elevator'/></model>");
  std::vector<std::string> texts;
  for (const auto& finding : sim.world->findings) texts.push_back(finding.text);
  EXPECT_THAT(texts,
              ::testing::UnorderedElementsAre(
                  "the lift 'cabin_joint' names the door 'nowhere', which the world does not have; "
                  "it does not wait for it",
                  "<plugin>: the joint 'lift' is not one of the model's joints; it ignores calls"));
}

// A reset goes back to the start: the same motion, bit for bit.
TEST(Lifts, AreResetWithTheirWorld) {
  Sim sim(elevator(), 1000);
  const auto way = [&] {
    tell(sim, "lift", kFloor, 1);
    sim.run(4.0);
    return joint(sim, "lift");
  };
  const double first = way();
  sim.robots.reset(InstanceIndex(0));
  EXPECT_EQ(way(), first);
}

}  // namespace
}  // namespace ruedo::robot::testing
