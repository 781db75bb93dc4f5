// Loading: files in, an immutable WorldModel out.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

// --spawn MODEL[:NAME]@X,Y[,YAW]
struct Spawn {
  std::string model;  // a file, or the name of a model that the search path finds ("p3at")
  std::string name;   // empty: the model's own name, with _2, _3, ... if it exists
  double x = 0, y = 0, yaw = 0;  // m, m, rad; the height follows from the ground below
};

// --set ROBOT/DEVICE.KEY=VALUE. KEY is a path of elements, separated by dots, below the <sensor>
// ("update_rate", "lidar.range.max"), or below <ruedo:drive> for the devices velocity, wheels and
// odometry.
struct Setting {
  std::string robot, device, key, value;
};

// --drive ROBOT=LEFT[+LEFT...],RIGHT[+RIGHT...]: gives a model without a drive a kinematic one, by
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
  bool allow_absolute = false;  // absolute paths in files may lead out of the search folders
};

// Options as written on the command line and in calls of the engine. Each throws an InputError that
// shows the expected form.
Spawn parse_spawn(const std::string& text);        // MODEL[:NAME]@X,Y[,YAW]
DriveOption parse_drive(const std::string& text);  // ROBOT=LEFT[+LEFT...],RIGHT[+RIGHT...]
Setting parse_setting(const std::string& text);    // ROBOT/DEVICE.KEY=VALUE

// Loads an SDF world, or an SDF model or URDF robot (plain or xacro) in an empty world with a
// ground plane. Takes a file, or the name of a world that comes with Ruedo or lies in a folder of
// RUEDO_PATH ("arena"). Throws InputError for what cannot be loaded; recoverable faults are in
// WorldModel::findings.
std::shared_ptr<const WorldModel> load_world(const std::string& name,
                                             const LoadOptions& options = {});

// Loads a text. `path` names it in messages and gives the folder to search from. For tests, and for
// models sent in requests.
std::shared_ptr<const WorldModel> load_world_text(const std::string& text, const std::string& path,
                                                  const LoadOptions& options = {});

// Loads one text after another like load_world_text(), each with the same options; the files that
// they name are read once. Not thread-safe.
class TextLoader {
 public:
  TextLoader(std::string path, LoadOptions options);
  ~TextLoader();
  std::shared_ptr<const WorldModel> load(const std::string& text);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::world
