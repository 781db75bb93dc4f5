// Parameter names follow the plugin's documentation.
#include "world/drives/holds.h"

#include <algorithm>

#include "world/compat/plugins.h"
#include "world/model/body_layout.h"

namespace ruedo::world {
namespace {

const std::string& required(const Element& plugin, const char* name) {
  const Element* child = plugin.child(name);
  if (!child || child->text.empty())
    plugin.fail("DetachableJoint has no <" + std::string(name) + ">");
  return child->text;
}

bool has_link(const Model& model, const std::string& name) {
  return std::any_of(model.links.begin(), model.links.end(),
                     [&](const Link& link) { return link.name == name; });
}

// The links of a nested model belong to the model that contains it.
void resolve(Hold& hold, const Model& model) {
  const std::string nested = hold.other_model + "." + hold.other_link;
  if (hold.other_model == model.name || hold.other_model == "__model__") {
    hold.other_model.clear();
  } else if (has_link(model, nested)) {
    hold.other_model.clear();
    hold.other_link = nested;
  }
}

Hold read_hold(const Element& plugin, const Model& model) {
  Hold hold;
  const std::string parent = dotted(required(plugin, "parent_link"));
  const auto link = std::find_if(model.links.begin(), model.links.end(),
                                 [&](const Link& each) { return each.name == parent; });
  if (link == model.links.end())
    plugin.fail("DetachableJoint: <parent_link> '" + parent + "' is not a link of the model");
  hold.link = ModelLinkIndex(link - model.links.begin());
  hold.other_model = dotted(required(plugin, "child_model"));
  hold.other_link = dotted(required(plugin, "child_link"));
  hold.source = plugin.source;
  hold.name = hold.other_model;
  for (int n = 2; std::any_of(model.holds.begin(), model.holds.end(),
                              [&](const Hold& each) { return each.name == hold.name; });
       ++n)
    hold.name = hold.other_model + "_" + std::to_string(n);
  resolve(hold, model);
  return hold;
}

}  // namespace

void read_holds(const std::vector<const Element*>& plugins, const std::string& where,
                Findings& findings, Model& model) {
  for (const Element* plugin : plugins) {
    if (kind_of(*plugin).name != "DetachableJoint") continue;
    read_or_leave_out(where, "it holds nothing", findings, [&] {
      model.holds.push_back(read_hold(*plugin, model));
      model.commanded = true;
    });
  }
}

namespace {

// The error in a hold; "": none.
std::string fault_of(const Hold& hold, InstanceIndex holder, const WorldModel& world,
                     const BodyLayout& layout) {
  const auto other = std::find_if(world.models.begin(), world.models.end(), [&](const auto& each) {
    return each.name == (hold.other_model.empty() ? world.models[holder].name : hold.other_model);
  });
  if (other == world.models.end())
    return "the world has no model '" + hold.other_model + "'; it is held when it comes";
  const auto& links = other->model->links;
  const auto link = std::find_if(links.begin(), links.end(),
                                 [&](const Link& each) { return each.name == hold.other_link; });
  if (link == links.end())
    return "the model '" + other->name + "' has no link '" + hold.other_link + "'; nothing is held";
  const auto body_of = [&](InstanceIndex instance, ModelLinkIndex of) {
    return layout.links[layout.link_of(instance, of)].body;
  };
  const BodyIndex body = body_of(holder, hold.link);
  if (body !=
      body_of(InstanceIndex(other - world.models.begin()), ModelLinkIndex(link - links.begin())))
    return "";
  const std::string both =
      "'" + world.models[holder].model->links[hold.link].name + "' and '" + hold.other_link + "' ";
  return both + (body.valid() ? "are one body" : "do not move") + "; nothing is held";
}

}  // namespace

void check_holds(const WorldModel& world, Findings& findings) {
  if (std::all_of(world.models.begin(), world.models.end(),
                  [](const ModelInstance& each) { return each.model->holds.empty(); }))
    return;
  const BodyLayout layout(world);
  for (const InstanceIndex i : world.models.indices()) {
    for (const Hold& hold : world.models[i].model->holds) {
      const std::string fault = fault_of(hold, i, world, layout);
      if (!fault.empty())
        findings.error(hold.source, "model " + world.models[i].name, "DetachableJoint: " + fault);
    }
  }
}

}  // namespace ruedo::world
