// Plugins that provide a sensor without a <sensor> element: translated to an equivalent <sensor>.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ruedo/element.h"

namespace ruedo::world {

struct PluginSensor {
  std::unique_ptr<Element> sensor;  // null: the plugin provides no sensor supported here
  std::string link;                 // that carries it; "": the model's first link
  std::string joint;                // for a sensor in a joint, in place of a link
};

// Parameters without effect go to `findings`. performers: the world's <performer>s.
PluginSensor sensor_from_plugin(const Element& plugin, const std::string& where,
                                const std::vector<const Element*>& performers, Findings& findings);

}  // namespace ruedo::world
