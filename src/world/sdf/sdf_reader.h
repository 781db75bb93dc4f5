// Reads SDF 1.3 to 1.12: worlds and models, includes, nested models, joints. Turns the element tree
// into models.
//
// Errors throw InputError; recoverable faults go to the context's findings. One reader serves one
// load; a file that is included a thousand times is read once.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "world/document/sdf_version.h"
#include "world/model/world_model.h"
#include "world/read/frames.h"
#include "world/read/read_context.h"

namespace ruedo::world {

class SdfReader {
 public:
  explicit SdfReader(ReadContext& context) : context_(context) {}

  // The file's <sdf> element, after checking its name and version.
  SdfVersion version_of(const Element& root);

  // Adds the world's physics, scene, lights and models.
  void read_world(const Element& world, SdfVersion version, WorldModel& result);

  // A model from its own element. nullptr: it has no link (reported as a finding).
  std::shared_ptr<const ScopedModel> read_model(const Element& element, SdfVersion version);

  // The model in a file, or in the folder that holds one: for --spawn and includes.
  struct Included {
    std::shared_ptr<const ScopedModel> model;  // null: it is a `light`, or an actor
    std::shared_ptr<const Element> document;
    const Element* light = nullptr;
    const Element* actor = nullptr;
    SdfVersion version;
    std::string name;  // the <include>'s name, or the file's
  };
  Included read_file(const std::string& path, const Element& asker);

  // Files being read, outermost first: naming one of them again would be a cycle.
  void enter(const std::string& path, const Element& asker);
  void leave() { files_.pop_back(); }

  static std::shared_ptr<const Model> actor_model(const Element& actor, Pose& X_WM,
                                                  ReadContext& context);

 private:
  std::optional<Included> include(const Element& element, const std::string& where);
  std::shared_ptr<const ScopedModel> read_overridden(const Element& model, const Element& include,
                                                     SdfVersion version);
  // Adds the instances of a <ruedo:fleet> after the world's existing models.
  void read_fleet(const Element& element, WorldModel& world, size_t most_models);
  class ModelReader;  // of one <model>
  class WorldReader;  // of one <world>

  // A <model> or <include> of a world.
  struct Member {
    const Element* element;
    std::string name;
    bool is_robot;
  };
  std::vector<Member> members(const Element& world, SdfVersion version);
  // Rewrites a world with joints of its own to one without: connected models become one.
  std::unique_ptr<Element> with_joined_models(const Element& world, SdfVersion version);
  std::unique_ptr<Element> join(const std::vector<Member>& all, const std::vector<int>& group,
                                int which,
                                const std::vector<std::pair<const Element*, int>>& joints);

  ReadContext& context_;
  std::vector<std::string> files_;
  std::map<std::string, Included> cache_;
  std::vector<const Element*> performers_;  // of the world
};

// The frame in <pose relative_to=""> (SDF 1.7 on) or <pose frame=""> (before); "": none.
std::string relative_to(const Element& owner);

// A name without '/', spaces and control characters: each becomes '_', and '?' replaces bytes that
// are not UTF-8 and UTF-8's control characters.
std::string made_fit_for_channel(const std::string& name);

// Makes the devices' names unique and usable in channel names: sensors with the same name become
// LINK-SENSOR. Throws InputError for names reserved for Ruedo's own channels, and for names that
// stay equal.
void make_sensor_names_unique(Model& model, const std::string& where, Findings& findings);

// Checks that the names of an instance and of its devices are usable in channel names.
void check_channel_names(const ModelInstance& instance, const Source& source);

// The frame of a joint: by its name, or by a substitute name if a link has the same name.
std::string joint_frame(FrameGraph& frames, const std::string& joint);
std::string beside_link(const std::string& joint);

// The name in a joint's <parent> or <child>, which old files write in <link_name>; "" without
// one.
std::string joint_end(const Element& joint, const char* which);

// Reads <joint>; its frames are those of the model.
Joint read_joint(const Element& element, SdfVersion version, FrameGraph& frames,
                 const IndexedVector<ModelLinkIndex, Link>& links, const std::string& where,
                 ReadContext& context);
// Reads its <mimic>, once all joints of the model are read.
void read_mimic(const Element& element, const IndexedVector<ModelJointIndex, Joint>& joints,
                Joint& joint);

}  // namespace ruedo::world
