// The current world of a run as text: single models for SPAWN, and the whole for the file that SAVE
// writes.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "ruedo/spawn_request_t.hpp"
#include "world/edit/world_text.h"
#include "world/model/world_model.h"

namespace ruedo::run {

class EditedWorld {
 public:
  // file: what save() writes; "": nothing. The world as it was loaded must outlive it.
  EditedWorld(const world::WorldModel& first, std::string file);

  // The run reports the effects of requests.
  void begin(std::set<std::string> put = {});  // the world is rebuilt; what put() was then
  void spawned(const std::string& name, const spawn_request_t& body);
  void put(const std::string& name);
  void removed(const std::string& name);

  std::set<std::string> put() const;  // that were put somewhere
  bool saves() const { return !file_.empty(); }
  // SDF or URDF of a model, for SPAWN; "" without one. Any thread.
  std::string model_text(const std::string& name) const;

  struct Saved {
    std::string fault;  // "": it is on the disk
    std::string note;   // what the file cannot say
    std::string file;   // the name of the copy; "" for none
  };
  // To the file, unless another program has changed it since; in spite of that; or to a copy beside
  // it whose name is not taken yet.
  enum class How { kept, overwritten, copied };
  // X_WM: of a model now, by its place in the list.
  Saved save(const world::WorldModel& now, const std::function<Pose(size_t)>& X_WM,
             How how = How::kept);

 private:
  const world::WorldText& text() const;
  std::string overwritten() const;

  const world::WorldModel& first_;
  const std::string file_;
  std::string source_;                              // the text that the world was loaded from
  std::string fault_;                               // why it has no text
  std::optional<std::string> known_;                // the file's content; nothing without a file
  mutable std::unique_ptr<world::WorldText> text_;  // made on first use
  mutable std::mutex mutex_;                        // of that, and of what follows
  std::map<std::string, std::string> spawned_;      // texts, by name
  std::set<std::string> put_;
};

}  // namespace ruedo::run
