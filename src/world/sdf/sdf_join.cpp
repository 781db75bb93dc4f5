// <joint> in <world>: the models that it connects are read as one model that contains them.
#include <algorithm>
#include <set>

#include "world/sdf/sdf_reader.h"

namespace ruedo::world {
namespace {

// "post" for "post::link"; "" for "world" and for names that are not a model's link.
std::string model_in(const std::string& scoped) {
  const size_t colons = scoped.find("::");
  return colons == std::string::npos ? "" : scoped.substr(0, colons);
}

// The name of a joint's end in a merged model, where the model's parts have no scope of their own.
void leave_scope(Element& joint, const char* end, const std::string& model) {
  Element* written = joint.child(end);
  if (written && model_in(written->text) == model) written->text.erase(0, model.size() + 2);
}

}  // namespace

// The names of the world's models and includes, in order; "" for those that cannot be read: the
// error is reported when they are.
std::vector<SdfReader::Member> SdfReader::members(const Element& world, SdfVersion version) {
  std::vector<Member> list;
  for (const auto& child : world.children) {
    if (child->name != "model" && child->name != "include") continue;
    Member member{child.get(), "", false};
    const size_t open_files = files_.size();
    const bool read = read_or_leave_out("world", "the model is left out", context_.findings, [&] {
      std::shared_ptr<const ScopedModel> scope;
      if (child->name == "model") {
        scope = read_model(*child, version);
        member.name = required_name(*child);
      } else if (const auto included = include(*child, "world/include")) {
        scope = included->model;
        member.name = included->name;
      }
      if (scope) member.is_robot = ModelInstance{member.name, {}, scope->model}.is_robot();
    });
    if (!read) files_.resize(open_files);
    list.push_back(member);
  }
  return list;
}

std::unique_ptr<Element> SdfReader::with_joined_models(const Element& world, SdfVersion version) {
  const std::vector<Member> all = members(world, version);
  const auto member = [&](const std::string& name) {
    const auto found =
        std::find_if(all.begin(), all.end(), [&](const Member& each) { return each.name == name; });
    return found == all.end() || name.empty() ? -1 : static_cast<int>(found - all.begin());
  };
  std::vector<int> group(all.size());  // for each, the first member of its group
  for (size_t i = 0; i < all.size(); ++i) group[i] = static_cast<int>(i);
  std::vector<std::pair<const Element*, int>> joints;  // with their group's first member, set later
  for (const Element* joint : world.all("joint")) {
    read_or_leave_out("world", "the joint is left out", context_.findings, [&] {
      const std::string parent = joint_end(*joint, "parent"), child = joint_end(*joint, "child");
      const int b = member(model_in(child));
      const int a = parent == "world" ? b : member(model_in(parent));
      if (a < 0 || b < 0)
        joint->fail("joins '" + parent + "' and '" + child +
                    "'; in a <world> it joins links of its models, as MODEL::LINK");
      joints.emplace_back(joint, b);
      const int to = std::min(group[a], group[b]), from = std::max(group[a], group[b]);
      std::replace(group.begin(), group.end(), from, to);
    });
  }

  auto joined = std::make_unique<Element>();
  joined->name = world.name;
  joined->attributes = world.attributes;
  joined->source = world.source;
  std::set<int> made;
  size_t next = 0;
  for (const auto& child : world.children) {
    if (child->name == "joint") continue;
    if (child->name != "model" && child->name != "include") {
      joined->children.push_back(child->clone());
      continue;
    }
    const size_t index = next++;
    const bool tied = std::any_of(joints.begin(), joints.end(), [&](const auto& each) {
      return group[each.second] == group[index];
    });
    if (!tied)
      joined->children.push_back(child->clone());
    else if (made.insert(group[index]).second)
      joined->children.push_back(join(all, group, group[index], joints));
  }
  return joined;
}

std::unique_ptr<Element> SdfReader::join(
    const std::vector<Member>& all, const std::vector<int>& group, int which,
    const std::vector<std::pair<const Element*, int>>& joints) {
  std::vector<const Member*> members;
  for (size_t i = 0; i < all.size(); ++i) {
    if (group[i] == which) members.push_back(&all[i]);
  }
  const auto robot = std::find_if(members.begin(), members.end(),
                                  [](const Member* each) { return each->is_robot; });
  const Member& first = robot == members.end() ? *members.front() : **robot;
  auto model = std::make_unique<Element>();
  model->name = "model";
  model->attributes = {{"name", first.name}};
  model->source = first.element->source;
  std::string names;
  for (const Member* each : members) {
    model->children.push_back(each->element->clone());
    if (each == &first)
      model->children.back()->attributes.emplace_back("merge", "true");
    else
      names += (names.empty() ? "'" : ", '") + each->name + "'";
  }
  for (const auto& [joint, of] : joints) {
    if (group[of] != which) continue;
    model->children.push_back(joint->clone());
    leave_scope(*model->children.back(), "parent", first.name);
    leave_scope(*model->children.back(), "child", first.name);
  }
  if (!names.empty())
    context_.findings.repaired(first.element->source, "model " + first.name,
                               "joints of the world tie it to " + names +
                                   ": together they are one model, called '" + first.name + "'");
  return model;
}

}  // namespace ruedo::world
