// Plugins of Gazebo Classic and gz-sim by what they do: which of them Ruedo's own parts stand in
// for.
//
// gz-sim's are known by the class that `name` has ("gz::sim::systems::DiffDrive",
// "ignition::gazebo::systems::...") or by their library; Classic's by their library alone, for
// their names are free.
#pragma once

#include <string>

#include "ruedo/element.h"

namespace ruedo::model {

struct PluginKind {
  enum class Does {
    drive,       // drives a robot: drive_from_plugin() translates it, or says why not
    joints,      // moves a model's joints: ROBOT/joint_command does
    control,     // ros_control or ros2_control: a file of controllers says what it does
    served,      // Ruedo's own part does its job
    irrelevant,  // nothing of what is simulated depends on it
    dead,        // its job is not done: `would` says which
    unknown,
  };
  std::string name;  // "DiffDrive", "gazebo_ros_planar_move"; of an unknown one its filename
  Does does = Does::unknown;
  const char* would = "";  // what it would have done: "the wind would blow"
};

PluginKind kind_of(const Element& plugin);

}  // namespace ruedo::model
