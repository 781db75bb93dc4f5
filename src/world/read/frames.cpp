// The graph of frames, resolved on demand, each frame once.
#include "world/read/frames.h"

#include <algorithm>

namespace ruedo::world {
namespace {

// The names of the scope's own frame.
bool is_scope(const std::string& name) {
  return name.empty() || name == "__model__" || name == "world";
}

}  // namespace

void FrameGraph::add(Node node) {
  if (const auto taken = by_name_.find(node.name); taken != by_name_.end()) {
    node.element->fail("the name '" + node.name + "' is taken by <" +
                       nodes_[taken->second].element->name + "> in " +
                       nodes_[taken->second].element->source.str() + "; names are unique in " +
                       scope_name_);
  }
  if (node.merged) {
    for (const auto& [name, frame] : node.scope->frames) {
      Found other;
      if (name.find("::") == std::string::npos && find(name, other)) {
        node.element->fail("merges '" + name + "', a name that is taken in " + scope_name_);
      }
    }
    merged_.push_back(nodes_.size());
  } else {
    for (const size_t m : merged_) {
      if (nodes_[m].scope->frames.count(node.name)) {
        node.element->fail("the name '" + node.name + "' is taken by what <include> merges in " +
                           nodes_[m].element->source.str());
      }
    }
  }
  by_name_[node.name] = nodes_.size();
  nodes_.push_back(std::move(node));
  states_.push_back(State::unknown);
  poses_.emplace_back();
  links_.emplace_back();
}

bool FrameGraph::find(const std::string& name, Found& found) const {
  if (const auto at = by_name_.find(name); at != by_name_.end()) {
    found = {at->second};
    return true;
  }
  // "::" in a nested model's own name comes from nesting only, so the first one ends the node's
  // name.
  if (const size_t colons = name.find("::"); colons != std::string::npos) {
    const auto at = by_name_.find(name.substr(0, colons));
    if (at != by_name_.end() && nodes_[at->second].scope) {
      const std::string rest = name.substr(colons + 2);
      const auto& frames = nodes_[at->second].scope->frames;
      if (rest == "__model__") {
        found = {at->second};
        return true;
      }
      if (const auto inner = frames.find(rest); inner != frames.end()) {
        found = {at->second, &inner->second};
        return true;
      }
    }
  }
  for (const size_t m : merged_) {
    const auto inner = nodes_[m].scope->frames.find(name);
    if (inner != nodes_[m].scope->frames.end()) {
      found = {m, &inner->second};
      return true;
    }
  }
  return false;
}

FrameGraph::Found FrameGraph::require(const std::string& name, const Element& asker) const {
  Found found;
  if (find(name, found)) return found;
  const std::string near = nearest_word(name, names());
  std::string help = near.empty() ? "" : "; did you mean '" + near + "'?";
  if (near.empty() && name.find("::") != std::string::npos)
    help = "; it can be of this model or of one that is nested in it";
  asker.fail("there is no frame '" + name + "' in " + scope_name_ + help);
}

std::vector<std::string> FrameGraph::names() const {
  std::vector<std::string> list;
  for (const Node& node : nodes_) {
    if (!by_name_.count(node.name)) continue;  // dropped
    if (!node.merged) list.push_back(node.name);
    if (node.scope) {
      for (const auto& [name, frame] : node.scope->frames)
        list.push_back(node.merged ? name : node.name + "::" + name);
    }
  }
  return list;
}

bool FrameGraph::has(const std::string& name) {
  Found found;
  return find(name, found);
}

bool FrameGraph::is_from(const std::string& name, const Element& element) const {
  const auto at = by_name_.find(name);
  return at != by_name_.end() && nodes_[at->second].element == &element;
}

// Where a frame is whose <pose> leads to X in the scope.
Pose FrameGraph::placed(const Node& node, Pose X) {
  if (node.scope && !node.placement_frame.empty()) {
    const auto& frames = node.scope->frames;
    const auto inner = frames.find(node.placement_frame);
    if (inner != frames.end()) {
      X = X * inner->second.X_MF.inverse();
    } else if (node.placement_frame != "__model__" &&
               node.placement_frame != node.scope->model->name &&
               node.placement_frame != node.name) {
      node.element->fail("placement_frame '" + node.placement_frame +
                         "' is not a frame of the model '" + node.scope->model->name + "'");
    }
  }
  return X.normalized();
}

// Without recursion: a file may have any number of frames, each relative to the next.
Pose FrameGraph::node_pose(size_t index) {
  std::vector<std::pair<size_t, std::optional<Found>>> chain;  // with what each is relative to
  for (size_t at = index; states_[at] != State::known;) {
    const Node& node = nodes_[at];
    if (states_[at] == State::asked)
      node.element->fail("'" + node.name + "' is placed relative to itself, through other frames");
    states_[at] = State::asked;
    chain.emplace_back(at, std::nullopt);
    if (is_scope(node.relative_to)) break;
    at = chain.back().second.emplace(require(node.relative_to, *node.element)).node;
  }
  for (; !chain.empty(); chain.pop_back()) {
    const auto& [at, reference] = chain.back();
    Pose X = nodes_[at].pose;
    if (reference) {
      const Pose& outer = poses_[reference->node];
      X = (reference->inner ? outer * reference->inner->X_MF : outer) * X;
    }
    poses_[at] = placed(nodes_[at], X);
    states_[at] = State::known;
  }
  return poses_[index];
}

Pose FrameGraph::pose(const std::string& name, const Element& asker) {
  if (is_scope(name)) return {};
  const Found found = require(name, asker);
  const Pose outer = node_pose(found.node);
  return found.inner ? outer * found.inner->X_MF : outer;
}

ModelLinkIndex FrameGraph::node_link(size_t index) {
  std::vector<size_t> chain;
  std::optional<ModelLinkIndex> link;
  for (size_t at = index; !link;) {
    const Node& node = nodes_[at];
    if (links_[at]) {
      link = links_[at];
    } else if (node.scope) {
      link = node.first_link;  // a model moves with its canonical link
    } else if (node.link.valid() || is_scope(node.attached_to)) {
      link = node.link;
    } else {
      if (chain.size() > nodes_.size())
        node.element->fail("'" + node.name + "' is attached to itself, through other frames");
      chain.push_back(at);
      const Found found = require(node.attached_to, *node.element);
      if (found.inner) link = ModelLinkIndex(nodes_[found.node].first_link + found.inner->link);
      at = found.node;
    }
  }
  for (const size_t at : chain) links_[at] = link;
  return *link;
}

ModelLinkIndex FrameGraph::link(const std::string& name, const Element& asker) {
  if (is_scope(name)) return {};
  const Found found = require(name, asker);
  return found.inner
             ? ModelLinkIndex(nodes_[found.node].first_link + std::max<int>(found.inner->link, 0))
             : node_link(found.node);
}

}  // namespace ruedo::world
