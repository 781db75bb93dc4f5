// Plugins that make a sensor without a <sensor>: the <sensor> that says the same.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ruedo/element.h"

namespace ruedo::model {

struct PluginSensor {
  std::unique_ptr<Element> sensor;  // null: the plugin makes none that there is here
  std::string link;                 // whose it is; "": the model's first
  std::string joint;                // of a sensor in a joint, instead
};

// What of the plugin has no effect goes to `findings`. performers: the world's <performer>s.
PluginSensor sensor_from_plugin(const Element& plugin, const std::string& where,
                                const std::vector<const Element*>& performers, Findings& findings);

}  // namespace ruedo::model
