// Our own worlds as libsdformat sees them: users load them with other programs too, so they must be
// clean there.
#include <gtest/gtest.h>

#include <filesystem>
#include <sdf/sdf.hh>
#include <sstream>
#include <string>

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
  std::ostringstream console;  // unknown elements are said there only
  sdf::Console::Instance()->GetMsgStream().SetStream(&console);
  sdf::ParserConfig config;
  config.SetFindCallback(find_model);
  config.SetWarningsPolicy(sdf::EnforcementPolicy::ERR);
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::ERR);
  sdf::Root root;
  for (const auto& error : root.Load(kWorlds + GetParam(), config)) {
    // It reads elements of other namespaces, and reports them under this policy: ours are meant to
    // be there.
    if (error.Message().find("ruedo:") == std::string::npos) ADD_FAILURE() << error.Message();
  }
  EXPECT_TRUE(root.WorldCount() == 1 || root.Model() || root.Light());
  sdf::Console::Instance()->GetMsgStream().SetStream(nullptr);
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
