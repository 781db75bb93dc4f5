// Hashes against those of ROS 2's own packages; test_bag.py compares all of them with rosbags.
#include "bridges/ros2/messages/interfaces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bridges/ros2/messages/names.h"
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

// From rosidl_generator_type_description of Jazzy, over the files of simulation_interfaces 1.5.1;
// and that of its package.
TEST(Interfaces, HashesAreThoseOfTheStandardOfSimulation) {
  const std::pair<const char*, const char*> kHashes[] = {
      {"simulation_interfaces/srv/DeleteEntity",
       "ff7e96a5b83dc8e2bb34b8b034480028b3a24d9f8376b2c0590bac3704be3e28"},
      {"simulation_interfaces/srv/GetAvailableWorlds",
       "ce5589b5523f2732d1969a3c5a7e6b17a387091df8190c62f78d7fdd1109e3e3"},
      {"simulation_interfaces/srv/GetCurrentWorld",
       "79ed4e910e1b7a1c9f7950ff758bfba3535bf0dec669054e8af115a099724ddd"},
      {"simulation_interfaces/srv/GetEntities",
       "cb90004c48cd50f37732fb008e22c34c261dd680a723bf0f85d8437ea4498bf7"},
      {"simulation_interfaces/srv/GetEntitiesStates",
       "0a76170d0c1c90e1eaf805cfab78ea801d1f82df309a28c1f0fae4b570f19754"},
      {"simulation_interfaces/srv/GetEntityBounds",
       "17be8d36231178a5eed0de0344b55c19975581627a9aec30a4fee9926a35deed"},
      {"simulation_interfaces/srv/GetEntityInfo",
       "953b7ab6bfc35063f5c9a72463c6ce489baa10249a7fa510926d342a34b0d29e"},
      {"simulation_interfaces/srv/GetEntityState",
       "749c91f2a2353d98367b64f2995a0f5842ce92a08ec1ffb3e185540a91557fb5"},
      {"simulation_interfaces/srv/GetNamedPoseBounds",
       "59fa8dd2c68ba6771160cc66a628ac99fa95e2748fa0a43c2cc62a2e5f3f6fdc"},
      {"simulation_interfaces/srv/GetNamedPoses",
       "c3d12ab920115bfd4733f6d20516adc3968fb438538540997c37e200e02b04e3"},
      {"simulation_interfaces/srv/GetSimulationState",
       "3362dcebee4b1afebbf9c4beee5c79c1455385aded62092a892d61fde8644f30"},
      {"simulation_interfaces/srv/GetSimulatorFeatures",
       "abb9439c8cf196722a469fb6c68b44b484f198c2a1356ac38849a29c2a20a794"},
      {"simulation_interfaces/srv/GetSpawnables",
       "3bc0266bf8236058ff589c44512e013afe4f295427c39d44cff363d1c956bf36"},
      {"simulation_interfaces/srv/LoadWorld",
       "f210682338f195f6f06191b46b20ec4992bddf485d33e2cffab2dd15341b4e3e"},
      {"simulation_interfaces/srv/ResetSimulation",
       "4ce285d7ff9b8ac70dcc95161f32bf54c05a6f4b13427990e41ab40c36c39646"},
      {"simulation_interfaces/srv/SetEntityInfo",
       "867fe2b6812f3e021859171f9b788560d66bb7079d640030baf6c0bb2dd2631e"},
      {"simulation_interfaces/srv/SetEntityState",
       "ca210e7d2b66629ae133c8e1edf5246e618106d75c78ed0556c0e7a33c59ee5e"},
      {"simulation_interfaces/srv/SetSimulationState",
       "a868b916dce49974f637ba252141258c4b07b0c06858b88af560e3eb6bfbcb30"},
      {"simulation_interfaces/srv/SpawnEntities",
       "41703a359ee032bf4fc230f144f531705ba039a2e97edeae1f7997dd83b04857"},
      {"simulation_interfaces/srv/SpawnEntity",
       "d4c086345d4194a5fc4c9ae45095736ca4062b5cdac4d06a42dec93d683e03cf"},
      {"simulation_interfaces/srv/StepSimulation",
       "913fe0653690ce6bf8f09f316e6a626747012e9fca31e26719910d417aa8565c"},
      {"simulation_interfaces/srv/UnloadWorld",
       "ac7f9a73df1b5b15015d854c5ac552b7726506e22f886c6792804f0b7f88b30b"},
      {"diagnostic_msgs/msg/DiagnosticArray",
       "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e"},
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

TEST(Interfaces, TextsListEachUsedTypeOnce) {
  const std::string text = full_text("geometry_msgs/msg/TwistStamped", Distro::jazzy);
  EXPECT_TRUE(text.starts_with("std_msgs/Header header\nTwist twist\n====")) << text;
  const std::string once = "MSG: geometry_msgs/Vector3\n";
  EXPECT_NE(text.find(once), std::string::npos);
  EXPECT_EQ(text.find(once), text.rfind(once));
}

TEST(Interfaces, RejectsAnUnknownRelease) {
  EXPECT_EQ(parse_distro("kilted"), Distro::kilted);
  EXPECT_THROW(parse_distro("noetic"), InputError);
}

TEST(Names, AreConvertedToRosNames) {
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
  EXPECT_EQ(one.topic("bob", "odom"), "/bob/odom");  // added later
  EXPECT_EQ(one.frame("bob", "base_link"), "bob/base_link");
  EXPECT_EQ(many.topic("alice", "scan"), "/alice/scan");
  EXPECT_EQ(many.topic("", "clock"), "/clock");
  EXPECT_EQ(many.frame("alice", "base_link"), "alice/base_link");
  EXPECT_NO_THROW(one.check_remaps());
}

TEST(Names, TfHasARobotsFramesWithItsNameOrInItsNamespace) {
  const auto trees = [](TfLayout layout, const std::string& robot) {
    std::string found;
    for (const Names::TfTree& tree : Names("bob", {}, layout).tf_trees(robot))
      found += "(" + tree.robot + "," + tree.prefix + ")";
    return found;
  };
  EXPECT_EQ(trees(TfLayout::prefixed, "alice"), "(,alice/)");
  EXPECT_EQ(trees(TfLayout::namespaced, "alice"), "(alice,)");
  EXPECT_EQ(trees(TfLayout::both, "alice"), "(,alice/)(alice,)");
  EXPECT_EQ(trees(TfLayout::both, "bob"), "(,)");  // without a namespace
  EXPECT_EQ(Names("", {}, TfLayout::namespaced).frame("alice", "lrf"), "lrf");
  EXPECT_EQ(Names("", {}, TfLayout::both).frame("alice", "lrf"), "alice/lrf");
  EXPECT_THROW(parse_tf_layout("none"), InputError);
}

TEST(Names, OfTwoRobotsAlwaysDiffer) {
  Names names("", {});
  names.update({"a-b", "a_b", "a.b"});
  EXPECT_EQ(names.topic("a_b", "scan"), "/a_b/scan");  // ROS allows its own name
  EXPECT_EQ(names.topic("a-b", "scan"), "/a_b_2/scan");
  EXPECT_EQ(names.frame("a.b", "base_link"), "a_b_3/base_link");
  names.update({"a-b", "a.b", "a_b_2"});
  EXPECT_EQ(names.topic("a-b", "scan"), "/a_b_2/scan");  // whichever robot is added or removed
  EXPECT_EQ(names.topic("a_b_2", "scan"), "/a_b_2_2/scan");
  names.update({});
  names.update({"a-b"});
  EXPECT_EQ(names.topic("a-b", "scan"), "/a_b/scan");
}

TEST(Names, ARemapOfAnActionMovesItsParts) {
  Names names("p3at", {{"/simulate_steps", "/sim/steps"}});
  EXPECT_EQ(names.topic("", "simulate_steps/_action/send_goal"), "/sim/steps/_action/send_goal");
  EXPECT_EQ(names.topic("", "simulate_steps_2"), "/simulate_steps_2");
}

TEST(Names, NewNamesAreValidRosNames) {
  for (const char* name : {"scan2", "/1x//y", "/a b", "/", "", "/a/", "/a__b", "/odom", "/a/2"}) {
    Names names("p3at", {{"/scan", name}});
    names.topic("p3at", "scan");
    names.topic("p3at", "odom");
    EXPECT_THROW(names.check_remaps(), InputError) << name;
  }
  Names swapped("p3at", {{"/scan", "/odom"}, {"/odom", "/scan"}});
  swapped.topic("p3at", "scan");
  swapped.topic("p3at", "odom");
  EXPECT_NO_THROW(swapped.check_remaps());
}

TEST(Names, RefusesARemapWithoutEffect) {
  Names names("p3at", {{"/scam", "/x"}});
  names.topic("p3at", "scan");
  EXPECT_THROW(names.check_remaps(), InputError);
}

}  // namespace
}  // namespace ruedo::ros2
