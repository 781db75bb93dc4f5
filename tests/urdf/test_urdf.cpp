// robot_description as urdfdom and libsdformat read it: cleanly, with the links and joints that
// move.
#include <algorithm>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>
#include <sdf/sdf.hh>

#include "bridges/ros2/messages/robot_frames.h"
#include "world/load.h"

namespace ruedo::ros2 {
namespace {

const std::string kRobots = std::string(RUEDO_SOURCE_DIR) + "/worlds/robots/";

class Urdf : public testing::TestWithParam<std::string> {};

TEST_P(Urdf, IsReadCleanly) {
  const auto world = world::load_world(GetParam());
  for (const auto& [name, robot] : robot_frames(*world)) {
    std::ostringstream console;
    sdf::Console::Instance()->GetMsgStream().SetStream(&console);
    sdf::Root root;
    for (const auto& error : root.LoadSdfString(robot.description))
      ADD_FAILURE() << name << ": " << error.Message();
    sdf::Console::Instance()->GetMsgStream().SetStream(nullptr);
    const sdf::Model* read = root.Model();
    ASSERT_TRUE(read) << robot.description;
    // Links that fixed joints tie together become one there.
    size_t joints = 0;
    for (const LinkFrame& frame : robot.frames) {
      if (frame.motion == LinkFrame::Motion::none) continue;
      EXPECT_TRUE(read->LinkNameExists(frame.name)) << frame.name;
      ++joints;
    }
    size_t moving = 0;
    for (uint64_t i = 0; i < read->JointCount(); ++i)
      moving += read->JointByIndex(i)->Type() != sdf::JointType::FIXED;
    EXPECT_EQ(moving, joints) << name;
  }
}

std::vector<std::string> robots() {
  std::vector<std::string> files{std::string(RUEDO_SOURCE_DIR) + "/tests/bridges/ros2/links.sdf"};
  for (const auto& each : std::filesystem::directory_iterator(kRobots)) {
    if (std::filesystem::exists(each.path() / "model.sdf"))
      files.push_back((each.path() / "model.sdf").string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

INSTANTIATE_TEST_SUITE_P(OurRobots, Urdf, testing::ValuesIn(robots()), [](const auto& info) {
  const std::filesystem::path path(info.param);
  return path.filename() == "model.sdf" ? path.parent_path().filename().string()
                                        : path.stem().string();
});

}  // namespace
}  // namespace ruedo::ros2
