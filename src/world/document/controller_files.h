// The YAML files that may hold a robot's controllers, for one load: folders are listed and files
// read once, however many robots ask for them, within bounds for all of them together.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/element.h"
#include "world/document/resources.h"

namespace ruedo::world {

class ControllerFiles {
 public:
  static constexpr size_t kLargestFile = 1 << 18;    // bytes
  static constexpr size_t kMostBytes = 4 << 20;      // of YAML of all files
  static constexpr size_t kMostEntries = 1'000'000;  // of files, counted at each request

  explicit ControllerFiles(const ResourceFinder& resources) : resources_(resources) {}
  // For another load: files may have changed.
  void begin() {
    beside_.clear();
    files_.clear();
    bytes_ = entries_ = 0;
  }

  // The files in the parameter folders of the package that contains `from`, then of neighbouring
  // packages, sorted by name.
  const std::vector<std::string>& beside(const std::string& from);
  // Null: it has no controller, and no plugin refers to it. Throws InputError if it is not YAML, or
  // exceeds the limits.
  std::shared_ptr<const Element> read(const std::string& path, bool named = false);

 private:
  struct File {
    std::shared_ptr<const Element> root;
    size_t entries = 0;
    std::optional<InputError> error;
  };
  void load(const std::string& path, bool named, File& file);

  const ResourceFinder& resources_;
  std::map<std::string, std::vector<std::string>> beside_;  // by folder
  std::map<std::pair<std::string, bool>, File> files_;      // by path, and whether it is referenced
  size_t bytes_ = 0, entries_ = 0;
};

}  // namespace ruedo::world
