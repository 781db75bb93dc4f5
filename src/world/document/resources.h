// Finds the files that a world names: model://, package://, file://, Fuel addresses, absolute and
// relative paths. Nothing is ever fetched from a network, and no address leads out of the search
// folders.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ruedo/errors.h"

namespace ruedo::world {

// Not thread-safe.
class ResourceFinder {
 public:
  // `top_file` is the file on the command line; its folder, and the `models` folders in and beside
  // it, are searched first. allow_absolute: absolute paths and file:// may lead anywhere; otherwise
  // only into the search folders.
  ResourceFinder(const std::string& top_file, bool allow_absolute);

  // For input from the network or from a log. It reaches the folder of the world file, the `models`
  // folders in and beside it, and those in the user's environment variables; no folders or files
  // whose names begin with a dot, and nothing outside through links. Files elsewhere are not found,
  // and no message reveals that they exist.
  static ResourceFinder for_strangers(const std::string& world_file);
  // Whether a file lies in the search folders after following links, and not below a folder whose
  // name begins with a dot.
  bool reaches(const std::string& path) const;
  // Whether a file that is found by a search, without a reference to it, may be read.
  bool may_read(const std::string& path) const { return !for_strangers_ || reaches(path); }

  // The absolute path of the file or folder that `uri`, written in the file `from`, names.
  std::optional<std::string> find(const std::string& uri, const std::string& from) const;

  // The SDF file of the model that `uri` names: a file itself, or a folder's newest by its
  // model.config. Throws InputError if model.config names no existing file.
  std::optional<std::string> find_model(const std::string& uri, const std::string& from) const;

  // The same for a file or folder given by the user, wherever it lies.
  static std::optional<std::string> model_file(const std::string& path);

  // Why find() found nothing, for messages: "is not found", or that it leads out of the search
  // folders.
  std::string why_not(const std::string& uri, const std::string& from) const;

  // The folders that are searched for any file.
  std::vector<std::string> folders() const;

  // The folders that a xacro file may read: those that are searched for it, but not the user's home
  // because it lies above; the packages above it and beside those, and two folders above its own.
  std::vector<std::string> folders_of(const std::string& xacro) const;

  // A texture, named in `from`: like find(), then by its file name in the usual folders nearby.
  std::optional<std::string> find_texture(const std::string& name, const std::string& from) const;

 private:
  std::vector<std::string> roots_for(const std::string& from) const;
  std::optional<std::string> in_package(const std::string& package, const std::string& rest,
                                        const std::string& from) const;
  bool allowed(const std::string& path, const std::string& from) const;
  std::optional<std::string> find_anything(const std::string& uri, const std::string& from) const;
  std::optional<std::string> find_fuel(const std::string& uri, const std::string& from) const;
  std::optional<std::string> find_by_name(const std::string& path, const std::string& from) const;
  std::optional<std::string> find_above(const std::string& path, const std::string& from) const;
  std::optional<std::string> find_path(const std::string& path, const std::string& from) const;
  std::optional<std::string> find_in_roots(const std::string& path, const std::string& from) const;

  std::vector<std::string> near_,
      far_;  // folders searched before and after those of the naming file
  bool allow_absolute_;
  bool for_strangers_ = false;
  mutable std::map<std::string, std::optional<std::string>> models_;  // by uri and naming file
  mutable std::map<std::string, std::map<std::string, std::string>>
      packages_;  // by folder: packages by name, filled on first use
};

// The folder of the worlds and robots that come with Ruedo; "" if not installed.
std::string shipped_worlds();

}  // namespace ruedo::world
