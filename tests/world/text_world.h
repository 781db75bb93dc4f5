// Worlds from text, and what tests ask of them.
#pragma once

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "world/load.h"

namespace ruedo::world {

inline std::shared_ptr<const WorldModel> world_of(const std::string& inside) {
  return load_world_text("<sdf version='1.9'><world name='w'>" + inside + "</world></sdf>",
                         "/nowhere/world.sdf");
}

inline const Link& link_of(const Model& model, const char* name) {
  const auto at = std::find_if(model.links.begin(), model.links.end(),
                               [&](const Link& link) { return link.name == name; });
  if (at == model.links.end()) throw std::runtime_error(std::string("no link ") + name);
  return *at;
}

inline std::vector<std::string> texts(const WorldModel& world) {
  std::vector<std::string> list;
  for (const Finding& finding : world.findings) list.push_back(finding.text);
  return list;
}

}  // namespace ruedo::world
