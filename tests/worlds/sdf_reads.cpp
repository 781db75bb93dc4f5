// sdf_reads FILE: a world as libsdformat reads it: a line "NAME<tab>x y z roll pitch yaw" for each
// model. Exits with 1, and says why, if libsdformat complains.
#include <cstdio>
#include <filesystem>
#include <sdf/sdf.hh>
#include <sstream>
#include <string>

namespace {

std::string find_model(const std::string& uri) {
  const std::string name = uri.substr(uri.find("://") + 3);
  for (const char* folder : {"robots/", "models/"}) {
    const std::string path = std::string(RUEDO_SOURCE_DIR) + "/worlds/" + folder + name;
    if (std::filesystem::exists(path)) return path;
  }
  return "";
}

}  // namespace

int main(int, char** arguments) {
  std::ostringstream console;  // where it says what it passes over
  sdf::Console::Instance()->GetMsgStream().SetStream(&console);
  sdf::ParserConfig config;
  config.SetFindCallback(find_model);
  config.SetWarningsPolicy(sdf::EnforcementPolicy::ERR);
  sdf::Root root;
  bool good = true;
  for (const auto& error : root.Load(arguments[1], config)) {
    good = false;
    std::printf("error: %s\n", error.Message().c_str());
  }
  if (root.WorldCount() != 1) return 1;
  const sdf::World& world = *root.WorldByIndex(0);
  for (uint64_t i = 0; i < world.ModelCount(); ++i) {
    const sdf::Model& model = *world.ModelByIndex(i);
    const ignition::math::Pose3d& pose = model.RawPose();
    std::printf("%s\t%.9g %.9g %.9g %.9g %.9g %.9g\n", model.Name().c_str(), pose.X(), pose.Y(),
                pose.Z(), pose.Roll(), pose.Pitch(), pose.Yaw());
  }
  return good ? 0 : 1;
}
