// Plugins of Gazebo Classic that make a sensor without a <sensor>: the <sensor> that says the same.
#pragma once

#include <memory>
#include <string>

#include "ruedo/element.h"

namespace ruedo::model {

struct PluginSensor {
  std::unique_ptr<Element> sensor;  // null: the plugin makes none that there is here
  std::string link;                 // whose it is; "": the model's first
};

PluginSensor sensor_from_plugin(const Element& plugin);

}  // namespace ruedo::model
