// The robot's state is where its base_link is, whatever carries its wheels: on both drives, for our
// own robots and for one whose wheels hang on springs.
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

std::string with_drive(std::string text, const std::string& type) {
  const size_t drive = text.find("<ruedo:drive"), end = text.find('>', drive);
  const size_t written = text.find(" type=", drive);
  if (written < end) text.erase(written, text.find_first_of("\"'", written + 7) + 1 - written);
  return text.insert(drive + 12, " type='" + type + "'");
}

std::string robot_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  const std::string all = text.str();
  const size_t begin = all.find("<model");
  return all.substr(begin, all.rfind("</model>") + 8 - begin);
}

std::string hung(const std::string& side, const std::string& y, const std::string& z) {
  return "<link name='drop_" + side + "'><pose>0 " + y + " " + z +
         " 0 0 0</pose><inertial><mass>0.05</mass><inertia><ixx>2e-5</ixx><iyy>2e-5</iyy>"
         "<izz>2e-5</izz></inertia></inertial></link><link name='wheel_" +
         side + "'><pose>0 " + y + " " + z +
         " -1.5707963267948966 0 0</pose><inertial><mass>0.2</mass><inertia><ixx>1e-4</ixx>"
         "<iyy>1e-4</iyy><izz>1.3e-4</izz></inertia></inertial><collision name='c'><geometry>"
         "<cylinder><radius>0.036</radius><length>0.02</length></cylinder></geometry></collision>"
         "</link><joint name='spring_" +
         side + "' type='prismatic'><parent>base_link</parent><child>drop_" + side +
         "</child><axis><xyz>0 0 1</xyz><limit><lower>-0.01</lower><upper>0.01</upper></limit>"
         "<dynamics><damping>50</damping><spring_stiffness>450</spring_stiffness>"
         "<spring_reference>-0.02</spring_reference></dynamics></axis></joint>"
         "<joint name='" +
         side + "' type='revolute'><parent>drop_" + side + "</parent><child>wheel_" + side +
         "</child><axis><xyz>0 0 1</xyz></axis></joint>";
}

// A round robot of 3 kg whose wheels are pressed down by springs, and that slides on two balls.
std::string hung_robot(const std::string& z = "0.036") {
  const auto slider = [](const std::string& name, const std::string& x) {
    return "<collision name='" + name + "'><pose>" + x +
           " 0 -0.04 0 0 0</pose><geometry><sphere><radius>0.02</radius></sphere></geometry>"
           "<surface><friction><ode><mu>0</mu><mu2>0</mu2></ode></friction></surface></collision>";
  };
  return "<model name='hung'><link name='base_link'><pose>0 0 0.06 0 0 0</pose><inertial>"
         "<mass>2.5</mass><inertia><ixx>0.02</ixx><iyy>0.02</iyy><izz>0.03</izz></inertia>"
         "</inertial><collision name='c'><pose>0 0 0.02 0 0 0</pose><geometry><cylinder><radius>"
         "0.16</radius><length>0.06</length></cylinder></geometry></collision>" +
         slider("ahead", "0.12") + slider("behind", "-0.12") + "</link>" +
         hung("left", "0.117", z) + hung("right", "-0.117", z) +
         "<ruedo:drive><ruedo:left_joint>left</ruedo:left_joint><ruedo:right_joint>right"
         "</ruedo:right_joint><ruedo:watchdog>0</ruedo:watchdog></ruedo:drive></model>";
}

// Drives ahead and turns, and compares at each step.
void watch(const std::string& model, const std::string& what) {
  Sim sim(plane_sdf() + model);
  ASSERT_EQ(sim.state.robots.size(), 1u) << what;
  const auto& links = sim.world->models[InstanceIndex(1)].model->links;
  ModelLinkIndex base(0);
  for (const ModelLinkIndex each : links.indices())
    if (links[each].name == "base_link") base = each;
  const auto& link = sim.layout.links[sim.layout.link_of(InstanceIndex(1), base)];
  ASSERT_TRUE(link.body.valid()) << what;
  const auto X_WBaseLink = [&] { return sim.state.bodies[link.body] * link.X_BL; };
  const Pose apart = sim.robot().X_WBase.inverse() * X_WBaseLink();
  for (int i = 0; i < 600; ++i) {
    if (i % 50 == 0) sim.velocity(i < 300 ? 0.3 : 0.2, i < 300 ? 0.0 : 0.4);
    sim.step();
    const Pose off = (sim.robot().X_WBase * apart).inverse() * X_WBaseLink();
    ASSERT_LT(off.translation.norm(), 1e-6) << what << " at step " << i;
    ASSERT_LT(off.rotation.vec().norm(), 1e-6) << what << " at step " << i;
  }
  EXPECT_GT(sim.position().norm(), 0.3) << what;
}

TEST(BaseLink, IsAtThePublishedPose) {
  int robots = 0;
  for (const auto& entry : std::filesystem::directory_iterator(RUEDO_SOURCE_DIR "/worlds/robots")) {
    const auto file = entry.path() / "model.sdf";
    if (!std::filesystem::exists(file)) continue;
    const std::string model = robot_of(file), name = entry.path().filename();
    watch(with_drive(model, "kinematic"), name);
    ++robots;
    // A track, or what moves without wheels, has no wheels drive.
    if (name != "puck" && name != "crawler")
      watch(with_drive(model, "wheels"), name + " on wheels");
  }
  EXPECT_GE(robots, 10);
}

// Springs press down wheels that are drawn above the ground (RMF's DeliveryRobot).
TEST(BaseLink, MovesOnSlidersBelowTheWheelsOnSprings) {
  Sim sim(plane_sdf() + with_drive(hung_robot("0.056"), "kinematic"));
  sim.velocity(0.3, 0.0);
  sim.run(2.0);
  EXPECT_NEAR(sim.position().x(), 0.6, 0.005);
}

TEST(BaseLink, IsCarriedByWheelsOnSprings) {
  for (const char* type : {"kinematic", "wheels"}) {
    watch(with_drive(hung_robot(), type), type);
    Sim sim(plane_sdf() + with_drive(hung_robot(), type));
    sim.velocity(0.3, 0.0);
    sim.run(2.0);
    EXPECT_NEAR(sim.position().x(), 0.6, 0.02) << type;
    EXPECT_NEAR(sim.position().y(), 0.0, 0.01) << type;
    EXPECT_NEAR(sim.yaw(), 0.0, 0.02) << type;
    sim.velocity(0.0, 0.5);
    sim.run(2.0);
    EXPECT_NEAR(sim.yaw(), 1.0, 0.05) << type;
  }
}

}  // namespace
}  // namespace ruedo::robot::testing
