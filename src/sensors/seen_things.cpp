// Labels and temperatures of bodies.
#include "sensors/seen_things.h"

#include <algorithm>
#include <map>

namespace ruedo {

SeenThings::Thing SeenThings::thing_of(const world::ListedBody& listed) {
  Thing thing;
  const std::vector<LinkIndex> alone{listed.link};
  const std::vector<LinkIndex>& links =
      listed.body.valid() ? layout_.bodies[listed.body].links : alone;
  for (const LinkIndex index : links) {
    const world::LinkPlacement& placement = layout_.links[index];
    thing.instance = placement.instance;
    const world::Model& model = *world_.models[placement.instance].model;
    for (const world::Visual& visual : model.links[placement.link].visuals) {
      if (thing.label == 0) thing.label = visual.label;
      if (thing.temperature == 0.0) thing.temperature = visual.temperature;
    }
  }
  return thing;
}

void SeenThings::update() {
  if (things_.size() == layout_.listed.size() + 1) return;
  things_.assign(1, Thing{});
  std::map<int, std::vector<InstanceIndex>> of_label;  // instances with each label, in world order
  for (const world::ListedBody& listed : layout_.listed) {
    Thing& thing = things_.emplace_back(thing_of(listed));
    if (thing.label == 0) continue;
    std::vector<InstanceIndex>& known = of_label[thing.label];
    const auto at = std::find(known.begin(), known.end(), thing.instance);
    thing.number = static_cast<int>(at - known.begin()) + 1;
    if (at == known.end()) known.push_back(thing.instance);
  }
}

}  // namespace ruedo
