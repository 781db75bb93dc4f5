// Loading: files in, one immutable WorldModel out.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/world_model.h"

namespace ruedo::model {

// --spawn MODEL[:NAME]@X,Y[,YAW]
struct Spawn {
  std::string model;  // a file, or the name of a model that the search path finds ("p3at")
  std::string name;   // empty: the model's own, with _2, _3, ... when taken
  double x = 0, y = 0, yaw = 0;  // m, m, rad; the height is found: on the ground below
};

// --set ROBOT/DEVICE.KEY=VALUE; KEY is a path of elements with dots below the <sensor>
// ("update_rate", "lidar.range.max"), or below <ruedo:drive> for the devices velocity, wheels and
// odometry.
struct Setting {
  std::string robot, device, key, value;
};

// --drive ROBOT=LEFT[+LEFT...],RIGHT[+RIGHT...]: a kinematic drive for a model that has none, by
// its wheel joints.
struct DriveOption {
  std::string robot;
  std::vector<std::string> left_joints, right_joints;
};

struct LoadOptions {
  std::vector<Spawn> spawns;
  std::vector<Setting> settings;
  std::vector<std::string> disabled;  // "ROBOT/DEVICE"
  std::vector<DriveOption> drives;
  std::vector<std::string> xacro_arguments;  // "NAME:=VALUE", for xacro files
  std::vector<Fault> faults;
  bool allow_absolute = false;  // absolute paths in the files may lead out of the search folders
};

// The options as they are written on the command line and in calls of the engine. Each throws
// InputError, which shows what it should look like.
Spawn parse_spawn(const std::string& text);        // MODEL[:NAME]@X,Y[,YAW]
DriveOption parse_drive(const std::string& text);  // ROBOT=LEFT[+LEFT...],RIGHT[+RIGHT...]
Setting parse_setting(const std::string& text);    // ROBOT/DEVICE.KEY=VALUE

// Loads an SDF world, an SDF model or a URDF robot, as it is or as xacro (the latter in an empty
// world with a ground plane): a file, or the name of a world that comes with Ruedo or lies in a
// folder of RUEDO_PATH ("arena"). Throws InputError for what cannot be loaded; what can be gone on
// from is in WorldModel::findings.
std::shared_ptr<const WorldModel> load_world(const std::string& name,
                                             const LoadOptions& options = {});

// The same from text, with `path` naming it in messages and giving the folder to search from; for
// tests and models sent along in a request.
std::shared_ptr<const WorldModel> load_world_text(const std::string& text, const std::string& path,
                                                  const LoadOptions& options = {});

// Loads one text after another as load_world_text() does, each with the same options; the files
// that they name are read once. Not for several threads at once.
class TextLoader {
 public:
  TextLoader(std::string path, LoadOptions options);
  ~TextLoader();
  std::shared_ptr<const WorldModel> load(const std::string& text);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::model
