// Parameter names follow the plugin's documentation.
#include "model/holds.h"

#include <algorithm>

#include "model/plugins.h"

namespace ruedo::model {
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
    plugin.fail("DetachableJoint: <parent_link> '" + parent + "' is no link of the model");
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

void check_holds(const WorldModel& world, Findings& findings) {
  for (const ModelInstance& instance : world.models) {
    for (const Hold& hold : instance.model->holds) {
      const auto other =
          std::find_if(world.models.begin(), world.models.end(), [&](const ModelInstance& each) {
            return each.name == (hold.other_model.empty() ? instance.name : hold.other_model);
          });
      const std::string where = "model " + instance.name;
      if (other == world.models.end())
        findings.error(hold.source, where,
                       "DetachableJoint: the world has no model '" + hold.other_model +
                           "'; it is held when it comes");
      else if (!has_link(*other->model, hold.other_link))
        findings.error(hold.source, where,
                       "DetachableJoint: the model '" + other->name + "' has no link '" +
                           hold.other_link + "'; nothing is held");
    }
  }
}

}  // namespace ruedo::model
