// The last states that this process saved, beside their files: RESTORE puts one back as it is, in
// microseconds, and runs no past again.
//
// Used by the publisher's thread alone.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "engine/world.h"
#include "ruedo/snapshot.h"
#include "run/journal.h"

namespace ruedo::run {

// A run as it stood at some step.
struct SavedState {
  std::unique_ptr<engine::World> world;  // which is never stepped
  uint64_t seed = 1;                     // that the world was made with
  Snapshot state;
  std::vector<int64_t> sequences;  // Publisher::sequences()
  std::set<std::string> put;       // EditedWorld::put()
  Journal::Extent journal;
};

class SavedStates {
 public:
  // The oldest go when there are more; the newest is kept, whatever its size. A link with its share
  // of devices takes about 10 kB: together 200 MB at most.
  static constexpr size_t kMost = 16;
  static constexpr size_t kMostLinks = 20'000;

  // path: the snapshot's file, which is written.
  void keep(const std::string& path, SavedState state);
  // Null: not in memory, or the file has changed.
  const SavedState* find(const std::string& path);
  void forget(const std::string& path);

 private:
  // Which file it is, and when it was written last.
  struct Identity {
    uint64_t device = 0, inode = 0;
    int64_t size = -1, changed_ns = 0;
    bool operator==(const Identity&) const = default;
  };
  static Identity identity_of(const std::string& path);

  struct Kept {
    std::string path;
    Identity identity;
    SavedState state;
  };
  std::list<Kept> kept_;  // in the order in which they were saved
};

}  // namespace ruedo::run
