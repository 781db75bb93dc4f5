#include "cli/support/sandboxed.h"

#include <cstdlib>
#include <filesystem>

#include <CLI/CLI.hpp>

#include "cli/support/progress_line.h"
#include "ruedo/errors.h"
#include "system/late_library.h"
#include "system/plugins.h"
#include "system/sandbox.h"
#include "world/document/resources.h"
#include "world/mesh/mesh_loader.h"
#include "world/urdf/xacro.h"

namespace fs = std::filesystem;

namespace ruedo::cli {

void add_sandbox_argument(CLI::App& command, bool& sandboxed) {
  command.add_flag(
      "--sandbox", sandboxed,
      "for untrusted files: reach only their folder and the model folders (see ruedo doctor)");
}

namespace {

// The cache of meshes, and in it what would go to /tmp, where files of others are. Without a cache,
// /tmp.
std::string own_folder() {
  const std::string cache = world::mesh_cache_folder();
  const fs::path temporary = fs::path(cache) / "tmp";
  std::error_code error;
  if (cache.empty() || (fs::create_directories(temporary, error), error))
    return fs::temp_directory_path().string();
  setenv("TMPDIR", temporary.c_str(), 1);
  return cache;
}

}  // namespace

void enter_sandbox(const std::string& file, const std::vector<std::string>& written,
                   const std::string& other) {
  if (const std::string missing = missing_for_sandbox(); !missing.empty())
    throw EnvironmentError("--sandbox: " + missing);
  load_late_libraries();  // they may lie where files cannot be reached any more
  Sandbox sandbox;
  sandbox.readable = world::ResourceFinder::for_strangers(file).folders();
  sandbox.readable.push_back(fs::absolute(file).parent_path().string());
  if (!other.empty()) {
    for (std::string& folder : world::ResourceFinder::for_strangers(other).folders())
      sandbox.readable.push_back(std::move(folder));
    sandbox.readable.push_back(fs::absolute(other).parent_path().string());
  }
  for (std::string& folder : plugin_folders()) sandbox.readable.push_back(std::move(folder));
  sandbox.runnable = world::xacro_parts();
  sandbox.writable.push_back(own_folder());
  std::error_code error;
  for (const std::string& path : written) {
    if (path.empty()) continue;
    const bool itself =
        fs::exists(path, error) && !fs::is_regular_file(path, error);  // a folder, a device
    sandbox.writable.push_back(itself ? path : fs::absolute(path).parent_path().string());
  }
  const bool is_drawn = end_progress_line();  // its thread would stay outside
  enter(sandbox);
  if (is_drawn) begin_progress_line();
}

}  // namespace ruedo::cli
