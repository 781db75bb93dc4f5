// Our own worlds, read by our own reader: it reports nothing, and the robots' numbers are those of
// the sources that they cite (masses, axles, devices, limits).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>

#include "world/load.h"

namespace ruedo::world {
namespace {

const std::string kWorlds = std::string(RUEDO_SOURCE_DIR) + "/worlds/";

std::string all_findings(const WorldModel& world) {
  std::string text;
  for (const auto& finding : world.findings) text += finding.text + "\n";
  return text;
}

const ModelInstance& instance(const WorldModel& world, const std::string& name) {
  for (const auto& each : world.models) {
    if (each.name == name) return each;
  }
  throw std::runtime_error("no model " + name);
}

int link_of(const Model& model, const std::string& name) {
  for (size_t i = 0; i < model.links.size(); ++i) {
    if (model.links[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

double mass(const Model& model) {
  double sum = 0;
  for (const auto& link : model.links) sum += link.inertial.mass;
  return sum;
}

class OurWorlds : public testing::TestWithParam<std::string> {};

TEST_P(OurWorlds, LoadWithNothingToReport) {
  const auto world = load_world(kWorlds + GetParam());
  EXPECT_EQ(all_findings(*world), "");
  EXPECT_EQ(world->step_us, 5000);
}

INSTANTIATE_TEST_SUITE_P(All, OurWorlds, testing::Values("arena.sdf", "office.sdf", "fleet.sdf"),
                         [](const auto& info) {
                           return info.param.substr(0, info.param.find('.'));
                         });

TEST(P3at, HasTheSourcesNumbers) {
  const auto world = load_world(kWorlds + "arena.sdf");
  const Model& p3at = *instance(*world, "p3at").model;
  EXPECT_DOUBLE_EQ(mass(p3at), 14 + 4 * 1.5);

  const std::map<std::string, Vec3> axles{{"front_left_wheel", {0.135, 0.197, 0.111}},
                                          {"front_right_wheel", {0.135, -0.197, 0.111}},
                                          {"rear_left_wheel", {-0.134, 0.197, 0.111}},
                                          {"rear_right_wheel", {-0.134, -0.197, 0.111}}};
  for (const auto& [name, at] : axles) {
    const int link = link_of(p3at, name);
    ASSERT_GE(link, 0) << name;
    EXPECT_LT((p3at.links[link].X_ML.translation - at).norm(), 1e-12) << name;
    EXPECT_EQ(p3at.links[link].collisions.at(0).geometry.size.x(), 0.111);
  }

  std::set<std::string> devices;
  for (const auto& sensor : p3at.sensors) devices.insert(sensor.name);
  EXPECT_THAT(devices, testing::ElementsAre("camera", "lrf", "sonar_front", "sonar_rear"));

  ASSERT_TRUE(p3at.drive);
  EXPECT_EQ(p3at.drive->kind, DriveDescription::Kind::kinematic);
  EXPECT_EQ(p3at.drive->wheel_radius, 0.111);
  EXPECT_EQ(p3at.drive->track, 0.394);
  EXPECT_EQ(p3at.drive->left_joints.size(), 2u);
  EXPECT_EQ(p3at.drive->right_joints.size(), 2u);
  EXPECT_EQ(p3at.drive->max_speed, 0.6);
}

// Nothing of the robot may stand in the scan plane, other than the LRF's own link.
TEST(P3at, ScanPlaneIsFree) {
  const auto world = load_world(kWorlds + "arena.sdf");
  const Model& p3at = *instance(*world, "p3at").model;
  for (const auto& sensor : p3at.sensors) {
    if (sensor.name != "lrf") continue;
    const double plane = (p3at.links[sensor.link].X_ML * sensor.X_LS).translation.z();
    for (size_t i = 0; i < p3at.links.size(); ++i) {
      if (static_cast<int>(i) == sensor.link) continue;
      for (const auto& collision : p3at.links[i].collisions) {
        const double top =
            (p3at.links[i].X_ML * collision.X_LC).translation.z() + collision.geometry.size.x();
        EXPECT_LT(top, plane) << p3at.links[i].name;
      }
    }
  }
}

TEST(Fleet, HasRobotsWithDifferentModules) {
  const auto world = load_world(kWorlds + "fleet.sdf");
  const Model& at = *instance(*world, "alice").model;
  const Model& dx = *instance(*world, "carol").model;
  EXPECT_EQ(instance(*world, "bob").model.get(), &at) << "one model is read once";
  EXPECT_EQ(at.sensors.size(), 4u);
  EXPECT_EQ(dx.sensors.size(), 2u);
  ASSERT_TRUE(dx.drive);
  EXPECT_EQ(dx.drive->track, 0.3);
}

}  // namespace
}  // namespace ruedo::world
