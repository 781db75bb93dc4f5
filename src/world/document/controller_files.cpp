// The folders of packages where controllers' parameters lie by custom.
#include "world/document/controller_files.h"

#include <algorithm>
#include <filesystem>

#include "base/input_file.h"
#include "world/document/yaml.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

constexpr size_t kMostFiles = 300,
                 kMostFolders = 200;  // limit of parameter folders searched for one robot

bool is_yaml(const fs::path& path) {
  return path.extension() == ".yaml" || path.extension() == ".yml";
}

// The folders of a package that may hold parameters.
void add_parameter_files(const fs::path& package, std::vector<std::string>& files) {
  std::vector<fs::path> found;
  for (const char* name :
       {"config", "configs", "params", "param", "control", "controllers", "yaml"}) {
    std::error_code error;
    size_t looked = 0;
    for (auto at = fs::recursive_directory_iterator(
             package / name, fs::directory_options::skip_permission_denied, error);
         !error && at != fs::recursive_directory_iterator() && ++looked < kMostFiles;
         at.increment(error)) {
      if (at.depth() > 2) at.disable_recursion_pending();
      std::error_code none;
      if (is_yaml(at->path()) && at->is_regular_file(none) &&
          at->file_size(none) <= ControllerFiles::kLargestFile)
        found.push_back(at->path());
    }
  }
  std::sort(found.begin(), found.end());
  for (const fs::path& path : found) {
    if (files.size() < kMostFiles) files.push_back(path.string());
  }
}

std::vector<std::string> files_beside(const fs::path& folder) {
  std::vector<std::string> files;
  fs::path package = folder;
  std::error_code error;
  constexpr int kHighest = 5;
  for (int up = 0;
       up < kHighest && package.has_relative_path() && !fs::exists(package / "package.xml", error);
       ++up)
    package = package.parent_path();
  if (!fs::exists(package / "package.xml", error)) {
    add_parameter_files(folder, files);
    add_parameter_files(folder.parent_path(), files);
    return files;
  }
  add_parameter_files(package, files);
  std::vector<fs::path> beside;
  for (const auto& entry : fs::directory_iterator(
           package.parent_path(), fs::directory_options::skip_permission_denied, error)) {
    if (beside.size() >= kMostFolders) break;
    if (entry.path() != package && fs::exists(entry.path() / "package.xml", error))
      beside.push_back(entry.path());
  }
  std::sort(beside.begin(), beside.end());
  for (const fs::path& each : beside) add_parameter_files(each, files);
  return files;
}

size_t count(const Element& element) {
  size_t entries = 1;
  for (const auto& child : element.children) entries += count(*child);
  return entries;
}

}  // namespace

const std::vector<std::string>& ControllerFiles::beside(const std::string& from) {
  const fs::path folder = fs::path(from).parent_path();
  const auto [at, is_new] = beside_.try_emplace(folder.string());
  if (is_new) {
    at->second = files_beside(folder);
    std::erase_if(at->second, [&](const std::string& file) { return !resources_.may_read(file); });
  }
  return at->second;
}

std::shared_ptr<const Element> ControllerFiles::read(const std::string& path, bool named) {
  const auto [at, is_new] = files_.try_emplace({path, named});
  File& file = at->second;
  if (is_new) {
    try {
      load(path, named, file);
    } catch (const InputError& error) {
      file.error = error;
    }
  }
  if (file.error) throw *file.error;
  entries_ += file.entries;
  if (entries_ > kMostEntries)
    throw InputError({path, 0}, "the robots of a world look at no more than " +
                                    std::to_string(kMostEntries) + " entries of such files");
  return file.root;
}

void ControllerFiles::load(const std::string& path, bool named, File& file) {
  const std::string text = read_input(path, kLargestFile);
  const auto has = [&](const char* word) { return text.find(word) != std::string::npos; };
  if (!named && !has("ontroller") && !has("steer_bot")) return;
  bytes_ += text.size();
  if (bytes_ > kMostBytes)
    throw InputError({path, 0}, "the controller files of a world hold more than " +
                                    std::to_string(kMostBytes >> 20) + " MiB");
  file.root = parse_yaml(text, path);
  file.entries = count(*file.root);
}

}  // namespace ruedo::world
