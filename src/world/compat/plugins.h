// Plugins of Gazebo Classic and gz-sim by what they do, and which of them parts of Ruedo replace.
//
// gz-sim's are recognised by the class in `name` ("gz::sim::systems::DiffDrive",
// "ignition::gazebo::systems::...") or by their library; Classic's by their library only, because
// their names are arbitrary.
#pragma once

#include <string>
#include <vector>

#include "ruedo/element.h"

namespace ruedo::world {

struct PluginKind {
  enum class Does {
    drive,       // drives a robot: drive_from_plugin() translates it, or says why it cannot
    joints,      // moves a model's joints, as ROBOT/joint_command does
    control,     // ros_control or ros2_control: a file of controllers defines what it does
    served,      // a part of Ruedo replaces it
    irrelevant,  // nothing that is simulated depends on it
    dead,        // not supported: `would` says what is missing
    unknown,
  };
  std::string name;  // "DiffDrive", "gazebo_ros_planar_move"; the filename of an unknown one
  Does does = Does::unknown;
  const char* would = "";  // what it would have done: "the wind would blow"
  // It acts on the model, link or sensor that it stands in, and on nothing in a <world>.
  bool is_in_model = false;
};

PluginKind kind_of(const Element& plugin);

// The <plugin> elements of a model, and of the links, sensors, visuals and cameras in it.
void collect_plugins(const Element& element, std::vector<const Element*>& plugins);

}  // namespace ruedo::world
