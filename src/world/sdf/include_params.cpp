// Finds elements by their scoped names, and applies the four actions.
#include "world/sdf/include_params.h"

#include <algorithm>

namespace ruedo::world {
namespace {

std::string name_of(const Element& element) {
  const std::string* name = element.attribute("name");
  return name ? *name : "";
}

// The child with that scoped name, and of that kind if one is given. Names may contain "::"
// themselves.
Element* find(Element& in, const std::string& id, const std::string& kind) {
  for (const auto& child : in.children) {
    const std::string name = name_of(*child);
    if (name.empty() || !id.starts_with(name)) continue;
    if (id == name && (kind.empty() || child->name == kind)) return child.get();
    if (id.compare(name.size(), 2, "::") != 0) continue;
    if (Element* found = find(*child, id.substr(name.size() + 2), kind)) return found;
  }
  return nullptr;
}

// The child that a change refers to: of the same kind, and of the same name if it has one.
Element* same_child(Element& in, const Element& change) {
  const std::string name = name_of(change);
  for (const auto& child : in.children) {
    if (child->name == change.name && (name.empty() || name_of(*child) == name)) return child.get();
  }
  return nullptr;
}

// A copy without the elements and attributes that only say how to change something.
std::unique_ptr<Element> as_written(const Element& change) {
  auto copy = change.clone();
  std::erase_if(copy->attributes, [](const auto& each) {
    return each.first == "action" || each.first == "element_id";
  });
  return copy;
}

// Whether it was there.
bool remove(Element& from, const Element* what) {
  for (const auto& child : from.children) {
    if (child.get() == what || remove(*child, what)) {
      std::erase_if(from.children, [&](const auto& each) { return each.get() == what; });
      return true;
    }
  }
  return false;
}

// Values in `change` replace existing ones; missing ones are added.
void modify(Element& element, const Element& change) {
  const auto values = as_written(change);  // outlives the loop over what it holds
  for (const auto& [name, value] : values->attributes) {
    const auto same = [&, key = name](const auto& each) { return each.first == key; };
    std::erase_if(element.attributes, same);
    element.attributes.emplace_back(name, value);
  }
  if (!change.text.empty()) element.text = change.text;
  element.source = change.source;
  for (const auto& child : change.children) {
    if (Element* there = same_child(element, *child))
      modify(*there, *child);
    else
      element.children.push_back(as_written(*child));
  }
}

class Changes {
 public:
  Changes(Element& model, const std::string& where, Findings& findings)
      : model_(model), where_(where), findings_(findings) {}

  void apply(const Element& change) {
    const std::string* id = change.attribute("element_id");
    const std::string* action = change.attribute("action");
    if (action && *action == "add" && (!id || id->empty())) return add(change, model_);
    if (!id) return skip(change, "has no element_id");
    const bool adds = action && *action == "add";
    Element* element = find(model_, *id, adds ? "" : change.name);
    if (!element) return skip(change, "'" + *id + "' is not in the included model");
    if (action) return act(change, *element, *action);
    for (const auto& child : change.children) act_on_child(*child, *element);
  }

 private:
  void skip(const Element& change, const std::string& why) {
    findings_.error(
        change.source, where_,
        "<" + change.name + "> in <experimental:params>: " + why + "; the change is left out");
  }

  void add(const Element& change, Element& to) {
    if (name_of(change).empty() && change.attribute("element_id"))
      return skip(change, "the element to add has no name");
    if (!name_of(change).empty() && same_child(to, change))
      return skip(change, "'" + name_of(change) + "' is there already");
    to.children.push_back(as_written(change));
  }

  void act(const Element& change, Element& element, const std::string& action) {
    if (action == "add") return add(change, element);
    if (action == "modify") return modify(element, change);
    if (action == "replace") return replace(change, element);
    if (action != "remove")
      return skip(change, "action '" + action +
                              "' is not allowed; allowed are add, modify, remove, replace");
    if (change.children.empty()) {
      remove(model_, &element);
      return;
    }
    for (const auto& child : change.children) {  // only these of its children are removed
      if (const Element* there = same_child(element, *child))
        remove(element, there);
      else
        skip(*child, "there is no such element to remove");
    }
  }

  void act_on_child(const Element& child, Element& element) {
    const std::string* action = child.attribute("action");
    if (!action) return skip(child, "has no action, nor has the element around it");
    if (*action == "add") return add(child, element);
    Element* there = same_child(element, child);
    if (!there) return skip(child, "'" + name_of(element) + "' has no such element");
    if (*action == "remove")
      remove(element, there);
    else
      act(child, *there, *action);
  }

  static void replace(const Element& change, Element& element) {
    auto fresh = as_written(change);
    if (name_of(*fresh).empty() && !name_of(element).empty())
      fresh->attributes.emplace_back("name", name_of(element));
    element.name = fresh->name;
    element.text = fresh->text;
    element.attributes = fresh->attributes;
    element.children = std::move(fresh->children);
    element.source = fresh->source;
  }

  Element& model_;
  const std::string& where_;
  Findings& findings_;
};

}  // namespace

void apply_params(const Element& params, Element& model, const std::string& where,
                  Findings& findings) {
  Changes changes(model, where, findings);
  for (const auto& change : params.children) changes.apply(*change);
}

}  // namespace ruedo::world
