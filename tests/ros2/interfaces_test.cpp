// Hashes against those that ROS 2's own packages have; test_bag.py holds all of them against
// rosbags.
#include "ros2/interfaces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ros2/names.h"
#include "ruedo/errors.h"

namespace ruedo::ros2 {
namespace {

TEST(Interfaces, HashesAreThoseOfRosPackages) {
  EXPECT_EQ(type_hash("sensor_msgs/msg/LaserScan", Distro::jazzy),
            "RIHS01_64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828");
  // As rmw_cyclonedds and the Zenoh bridge have it: .msg's char is a uint8.
  EXPECT_EQ(type_hash("rmw_dds_common/msg/ParticipantEntitiesInfo", Distro::jazzy),
            "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e");
}

TEST(Interfaces, HumbleHasItsOwn) {
  EXPECT_NE(type_hash("sensor_msgs/msg/Range", Distro::humble),
            type_hash("sensor_msgs/msg/Range", Distro::jazzy));
  EXPECT_EQ(type_hash("sensor_msgs/msg/Imu", Distro::humble),
            type_hash("sensor_msgs/msg/Imu", Distro::lyrical));
}

TEST(Interfaces, TypesHaveTheirNamesInDds) {
  EXPECT_EQ(dds_type("sensor_msgs/msg/LaserScan"), "sensor_msgs::msg::dds_::LaserScan_");
  EXPECT_EQ(dds_type("std_srvs/srv/SetBool_Request"), "std_srvs::srv::dds_::SetBool_Request_");
}

TEST(Interfaces, TextsNameWhatTheyUseOnce) {
  const std::string text = full_text("geometry_msgs/msg/TwistStamped", Distro::jazzy);
  EXPECT_TRUE(text.starts_with("std_msgs/Header header\nTwist twist\n====")) << text;
  const std::string once = "MSG: geometry_msgs/Vector3\n";
  EXPECT_NE(text.find(once), std::string::npos);
  EXPECT_EQ(text.find(once), text.rfind(once));
}

TEST(Interfaces, AnUnknownReleaseIsNamed) {
  EXPECT_EQ(parse_distro("kilted"), Distro::kilted);
  EXPECT_THROW(parse_distro("noetic"), InputError);
}

TEST(Names, AreMadeFitForRos) {
  EXPECT_EQ(ros_name("p3at"), "p3at");
  EXPECT_EQ(ros_name("3dx"), "r3dx");
  EXPECT_EQ(ros_name("front-left..laser"), "front_left_laser");
  EXPECT_EQ(ros_name(""), "r");
}

TEST(Names, OneRobotHasTheRootAndManyHaveNamespaces) {
  Names one("p3at", {{"/scan", "/front/scan"}}), many("", {});
  EXPECT_EQ(one.topic("p3at", "odom"), "/odom");
  EXPECT_EQ(one.topic("p3at", "scan"), "/front/scan");
  EXPECT_EQ(one.frame("p3at", "base_link"), "base_link");
  EXPECT_EQ(one.topic("bob", "odom"), "/bob/odom");  // who comes later
  EXPECT_EQ(one.frame("bob", "base_link"), "bob/base_link");
  EXPECT_EQ(many.topic("alice", "scan"), "/alice/scan");
  EXPECT_EQ(many.topic("", "clock"), "/clock");
  EXPECT_EQ(many.frame("alice", "base_link"), "alice/base_link");
  EXPECT_NO_THROW(one.check_remaps());
}

TEST(Names, ARemapOfNothingIsRefused) {
  Names names("p3at", {{"/scam", "/x"}});
  names.topic("p3at", "scan");
  EXPECT_THROW(names.check_remaps(), InputError);
}

}  // namespace
}  // namespace ruedo::ros2
