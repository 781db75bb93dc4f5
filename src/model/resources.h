// Where the files that a world names are: model://, package://, file://, Fuel addresses, absolute
// and relative paths. Nothing is ever fetched from a network, and no address leads out of the
// folders that are searched.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ruedo/errors.h"

namespace ruedo::model {

// Not for several threads at once.
class ResourceFinder {
 public:
  // `top_file` is the file on the command line; its folder, the `models` folder in and beside it
  // are searched first. allow_absolute: absolute paths and file:// may lead anywhere; else only
  // into the folders that are searched.
  ResourceFinder(const std::string& top_file, bool allow_absolute);

  // For what comes over a network, or stands in a log: it reaches the folder of the world's file,
  // the `models` folders in and beside it, and those that the user's variables name; nothing in
  // folders or files whose names begin with a dot, and nothing that a link leads out of them. What
  // lies elsewhere is not found, and no message says that it is there.
  static ResourceFinder for_strangers(const std::string& world_file);
  // Whether a file lies in the folders that are searched, wherever links lead, and below none whose
  // name begins with a dot.
  bool reaches(const std::string& path) const;

  // The absolute path of what `uri`, written in the file `from`, names: a file or a folder.
  std::optional<std::string> find(const std::string& uri, const std::string& from) const;

  // The SDF file of the model that `uri` names: a file itself, or a folder's newest by its
  // model.config. Throws InputError for a folder with a model.config that names no file that is
  // there.
  std::optional<std::string> find_model(const std::string& uri, const std::string& from) const;

  // The same of a file or folder that the user named, wherever it is.
  static std::optional<std::string> model_file(const std::string& path);

  // Why find() gave nothing, for messages: "is not found", or that it leads out of the folders that
  // are searched.
  std::string why_not(const std::string& uri, const std::string& from) const;

  // The folders that are searched wherever a file lies.
  std::vector<std::string> folders() const;

  // A texture, named in `from`: as find(), then by its file name in the usual folders beside.
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
      packages_;  // in each folder: by name, once looked for
};

// The folder of the worlds and robots that come with Ruedo; "" when there is none.
std::string shipped_worlds();

}  // namespace ruedo::model
