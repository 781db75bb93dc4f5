// Worlds by name: files beside Ruedo's own worlds, or in a folder of RUEDO_PATH.
#include "world/world_name.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <vector>

#include "ruedo/errors.h"
#include "world/document/resources.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

constexpr const char* kEndings[] = {".sdf", ".world"};

std::vector<fs::path> folders() {
  std::vector<fs::path> found;
  if (const std::string worlds = shipped_worlds(); !worlds.empty()) found.emplace_back(worlds);
  const char* variable = std::getenv("RUEDO_PATH");
  std::string rest = variable ? variable : "";
  while (!rest.empty()) {
    const size_t colon = std::min(rest.find(':'), rest.size());
    if (colon > 0) found.emplace_back(rest.substr(0, colon));
    rest.erase(0, colon + 1);
  }
  return found;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

std::vector<std::string> world_names() {
  std::set<std::string> known;
  std::error_code error;
  for (const fs::path& folder : folders()) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
      const std::string extension = entry.path().extension().string();
      if (std::find(std::begin(kEndings), std::end(kEndings), extension) != std::end(kEndings))
        known.insert(entry.path().stem().string());
    }
  }
  return {known.begin(), known.end()};
}

std::string world_file(const std::string& name) {
  std::error_code error;
  if (fs::exists(name, error) || error) return name;  // opening it reports an error
  if (name.empty() || name.find('/') != std::string::npos || fs::path(name).has_extension())
    throw InputError({name, 0}, "no such file");
  std::vector<std::string> searched;
  for (const fs::path& folder : folders()) {
    searched.push_back(folder.string());
    for (const char* ending : kEndings) {
      const fs::path file = folder / (name + ending);
      if (fs::is_regular_file(file, error)) return file.string();
    }
  }
  if (searched.empty())
    throw InputError({name, 0},
                     "no such file, and no world of that name: Ruedo's own worlds lie neither "
                     "beside this program nor where it was built");
  throw InputError({name, 0}, "no such file, and no world of that name; there are " +
                                  joined(world_names()) + " (searched in " + joined(searched) +
                                  ")");
}

}  // namespace ruedo::world
