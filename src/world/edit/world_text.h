// Writes a world file with models moved, removed and added. Unchanged parts stay byte for byte as
// they were written: comments, order, whitespace.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "world/document/xml_text.h"
#include "world/model/world_model.h"

namespace ruedo::world {

// A model's current state.
struct ModelNow {
  std::string name;
  Pose X_WM;
  std::string spawned;  // the SDF or URDF that it came from; "": the file
  // placed by a user: kept to a micrometre; otherwise displacements below a millimetre are the
  // solver's
  bool put = false;
};

class WorldText {
 public:
  // text: SDF with a <world>, from which `first` was loaded. Throws InputError.
  WorldText(std::string text, const WorldModel& first);

  // SDF of a model in the file, as SPAWN takes it; "": it has no element of its own.
  std::string model_text(const std::string& name) const;

  struct Written {
    std::string text;
    std::vector<std::string> left_out;  // what the file cannot express, one sentence each
  };
  // Throws InputError for a model whose text cannot be part of a world.
  Written with(const std::vector<ModelNow>& models) const;

 private:
  struct Entry {  // a model and its element
    std::string name;
    Pose X_WM;
    const TextElement* place;
    const Element* element;
  };

  void match(const WorldModel& first);
  std::set<std::string> moved_with(std::set<std::string> changed) const;
  void drop(const TextElement& element, TextPatch& patch) const;
  void drop_states(const std::set<std::string>& names, TextPatch& patch) const;

  std::string text_;
  std::unique_ptr<const Element> root_;
  TextElement places_;
  const Element* world_ = nullptr;
  const TextElement* world_place_ = nullptr;
  std::vector<Entry> entries_;
  std::vector<ModelInstance> others_;  // without an element of their own: those of a fleet, actors
};

// The text of the world that a file is loaded as: the file's own text; for a robot or model, a
// world with a floor and the model.
std::string world_text_of(const WorldModel& world);

// A floor and a sun.
extern const char* const kEmptyWorld;

struct Moved {
  std::string text;
  std::set<std::string> out_of_reach;  // folders of files that a world there does not find
};
// The same text for a file in another folder: what names a file leads to the same one from there.
Moved moved_to(const std::string& text, const std::string& from_file, const std::string& to_file);

}  // namespace ruedo::world
