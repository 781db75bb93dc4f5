// Our own worlds, read by libsdformat: users load them with other programs too, so it must not
// complain about them.
#include <gtest/gtest.h>

#include <filesystem>
#include <sdf/sdf.hh>
#include <sstream>
#include <string>
#include <vector>

#include "world/edit/world_text.h"
#include "world/load.h"

namespace {

const std::string kWorlds = std::string(RUEDO_SOURCE_DIR) + "/worlds/";

std::string find_model(const std::string& uri) {
  const std::string name = uri.substr(uri.find("://") + 3);
  for (const char* folder : {"robots/", "models/"}) {
    if (std::filesystem::exists(kWorlds + folder + name)) return kWorlds + folder + name;
  }
  return "";
}

class Libsdformat : public testing::TestWithParam<std::string> {};

TEST_P(Libsdformat, LoadsOurFileCleanly) {
  std::ostringstream console;  // unknown elements are reported there only
  sdf::Console::Instance()->GetMsgStream().SetStream(&console);
  sdf::ParserConfig config;
  config.SetFindCallback(find_model);
  config.SetWarningsPolicy(sdf::EnforcementPolicy::ERR);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::ERR);
  sdf::Root root;
  for (const auto& error : root.Load(kWorlds + GetParam(), config)) {
    // It reports elements of other namespaces under this policy; ours are intended.
    if (error.Message().find("ruedo:") == std::string::npos) ADD_FAILURE() << error.Message();
  }
  EXPECT_TRUE(root.WorldCount() == 1 || root.Model() || root.Light());
  sdf::Console::Instance()->GetMsgStream().SetStream(nullptr);
}

// A world as `ruedo edit` saves it: with moved, added and removed models.
TEST(LibsdformatText, ReadsSavedWorldsOfTheEditor) {
  using ruedo::Pose;
  const auto world = ruedo::world::load_world(kWorlds + "arena.sdf");
  std::vector<ruedo::world::ModelNow> models;
  for (const auto& model : world->models) {
    if (model.name != "box_2") models.push_back({model.name, model.X_WM, "", false});
    if (model.name == "box_1")
      models.back().X_WM = Pose::from_xyz_rpy({1.5, -2.5, 0.35}, {0, 0, 0.75});
  }
  const std::string include =
      "<sdf version='1.9'>\n<include>\n      <uri>model://p3dx</uri>\n    </include>\n</sdf>";
  models.push_back({"guest", Pose::from_xyz_rpy({3, 3, 0}, {0, 0, -1}), include, true});
  const std::string text =
      ruedo::world::WorldText(ruedo::world::world_text_of(*world), *world).with(models).text;
  sdf::ParserConfig config;
  config.SetFindCallback(find_model);
  sdf::Root root;
  for (const auto& error : root.LoadSdfString(text, config)) ADD_FAILURE() << error.Message();
  ASSERT_EQ(root.WorldCount(), 1u);
  const sdf::World& saved = *root.WorldByIndex(0);
  EXPECT_FALSE(saved.ModelNameExists("box_2"));
  ASSERT_TRUE(saved.ModelNameExists("box_1") && saved.ModelNameExists("guest"));
  EXPECT_EQ(saved.ModelByName("box_1")->RawPose(),
            ignition::math::Pose3d(1.5, -2.5, 0.35, 0, 0, 0.75));
  EXPECT_EQ(saved.ModelByName("guest")->RawPose(), ignition::math::Pose3d(3, 3, 0, 0, 0, -1));
  EXPECT_EQ(saved.ModelCount(), world->models.size());  // one went, one came
}

INSTANTIATE_TEST_SUITE_P(All, Libsdformat,
                         testing::Values("arena.sdf", "office.sdf", "fleet.sdf",
                                         "robots/p3at/model.sdf", "robots/p3dx/model.sdf",
                                         "models/sun/model.sdf", "models/ground_plane/model.sdf",
                                         "models/desk/model.sdf"),
                         [](const auto& info) {
                           std::string name = info.param;
                           for (char& c : name)
                             c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
                           return name;
                         });

}  // namespace
