// Hashes against those of ROS 2's own packages; test_bag.py compares all of them with rosbags.
#include "bridges/ros2/interfaces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/ros2/names.h"
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

// From descriptions that rosidl generated (rosidl_generator_c) in others' builds of Jazzy.
TEST(Interfaces, HashesAreThoseOfGeneratedDescriptions) {
  const std::pair<const char*, const char*> kHashes[] = {
      {"vision_msgs/msg/ObjectHypothesis",
       "51da43cec11c01957a64d1e05a24acd18aae7745ec30b74348ad5f6d634f7f90"},
      {"vision_msgs/msg/Detection2D",
       "0d12b69df5c593b3455b7346fac8205437a7d4bcb09b9e0e0b2dde787ded38ea"},
      {"vision_msgs/msg/Detection2DArray",
       "214274120007f4a683866481336b70310268cfa107aebe9d594a6acf75bda968"},
      {"vision_msgs/msg/BoundingBox3D",
       "bbb73a65c163d7f9bb29009c7bde9f7faa576bd2d23299c4511d19230dab4698"},
      {"vision_msgs/msg/Detection3DArray",
       "793f5eab9595ac1c0da07873cc859db42eae51f0ee76056db8562515d830e018"},
      {"ros_gz_interfaces/msg/Entity",
       "266a26f377057ebb0a1f08f7fb9dc435a841d9ec4fa3ab8fa0085e66e653504e"},
      {"ros_gz_interfaces/msg/Contact",
       "ba5acbac280b8650f9ad7caf995888ff8aca861742e0159d8d36efe8460d0db3"},
      {"unique_identifier_msgs/msg/UUID",
       "1b8e8aca958cbea28fe6ef60bf6c19b683c97a9ef60bb34752067d0f2f7ab437"},
      {"action_msgs/srv/CancelGoal",
       "573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a"},
  };
  for (const auto& [type, hash] : kHashes)
    EXPECT_EQ(type_hash(type, Distro::jazzy), std::string("RIHS01_") + hash) << type;
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

TEST(Names, OfTwoRobotsAreNeverOne) {
  Names names("", {});
  names.update({"a-b", "a_b", "a.b"});
  EXPECT_EQ(names.topic("a_b", "scan"), "/a_b/scan");  // ROS allows its own name
  EXPECT_EQ(names.topic("a-b", "scan"), "/a_b_2/scan");
  EXPECT_EQ(names.frame("a.b", "base_link"), "a_b_3/base_link");
  names.update({"a-b", "a.b", "a_b_2"});
  EXPECT_EQ(names.topic("a-b", "scan"), "/a_b_2/scan");  // whoever comes or goes
  EXPECT_EQ(names.topic("a_b_2", "scan"), "/a_b_2_2/scan");
  names.update({});
  names.update({"a-b"});
  EXPECT_EQ(names.topic("a-b", "scan"), "/a_b/scan");
}

TEST(Names, ARemapOfNothingIsRefused) {
  Names names("p3at", {{"/scam", "/x"}});
  names.topic("p3at", "scan");
  EXPECT_THROW(names.check_remaps(), InputError);
}

}  // namespace
}  // namespace ruedo::ros2
