// Frames by name: links, joints, <frame>s and nested models of one model, or the models and frames
// of a world, each placed relative to another.
//
// Poses are those of the file, at the start. As every frame is fixed relative to every other then,
// one pose in the scope's own frame describes it. Names with "::" reach into nested models.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

// A frame of a model that has been read: X_MF, and the link it moves with (none: it belongs to a
// static scope or to the world).
struct FrameInModel {
  Pose X_MF;
  ModelLinkIndex link;
};

// A model as its own file sees it, before it is placed.
struct ScopedModel {
  std::shared_ptr<const Model> model;
  std::map<std::string, FrameInModel, std::less<>> frames;  // by SDF's scoped names, "arm::wrist"
  Pose pose;                                                // <pose>, relative to
  // this frame, in the scope that places the model; "": that scope's own frame
  std::string relative_to;
  std::string placement_frame;  // the frame that <pose> places; "": the model's own
};

class FrameGraph {
 public:
  // `scope_name` is what messages call the scope: "model p3at", "the world".
  explicit FrameGraph(std::string scope_name) : scope_name_(std::move(scope_name)) {}

  struct Node {
    std::string name;
    const Element* element = nullptr;  // for messages
    Pose pose;
    std::string relative_to;  // "": the scope's own frame
    std::string attached_to;  // "": what `link` says, or the scope itself
    ModelLinkIndex link;
    std::shared_ptr<const ScopedModel> scope;  // a nested model: its frames are reached by "name::"
    std::string placement_frame;               // of that model: the frame that `pose` places
    ModelLinkIndex first_link{0};              // of that model's links in this scope
    bool merged = false;                       // its frames are reached by their own names
  };

  // Throws InputError if the name exists.
  void add(Node node);

  // The pose of a frame in the scope, and the link it moves with. The error for a missing frame or
  // a cycle of frames names `asker`.
  Pose pose(const std::string& name, const Element& asker);
  ModelLinkIndex link(const std::string& name, const Element& asker);
  bool has(const std::string& name);
  // Whether that frame was declared by this element.
  bool is_from(const std::string& name, const Element& element) const;
  // Removes a frame that cannot be placed.
  void drop(const std::string& name) { by_name_.erase(name); }
  // The names that exist, for error messages.
  std::vector<std::string> names() const;

 private:
  struct Found {
    size_t node;
    const FrameInModel* inner = nullptr;  // within the node's nested model
  };
  bool find(const std::string& name, Found& found) const;
  Found require(const std::string& name, const Element& asker) const;
  static Pose placed(const Node& node, Pose X);
  Pose node_pose(size_t index);
  ModelLinkIndex node_link(size_t index);

  enum class State { unknown, asked, known };
  std::string scope_name_;
  std::vector<Node> nodes_;
  std::vector<State> states_;
  std::vector<Pose> poses_;
  std::vector<std::optional<ModelLinkIndex>> links_;  // of the requested frames
  std::map<std::string, size_t, std::less<>> by_name_;
  std::vector<size_t> merged_;
};

}  // namespace ruedo::world
