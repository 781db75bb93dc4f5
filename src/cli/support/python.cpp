#include "cli/support/python.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

#include "ruedo/errors.h"
#include "system/installation.h"

namespace ruedo::cli {
namespace {

namespace fs = std::filesystem;

// One line for a missing package, instead of a traceback.
constexpr const char* kStart = R"py(import importlib, sys
try:
    main = importlib.import_module(sys.argv[1]).main
except ImportError as error:
    print(f"ruedo: {error}: this Python ({sys.executable}) needs pip install {sys.argv[2]}", file=sys.stderr)
    sys.exit(4)
sys.exit(main(sys.argv[3:]))
)py";

// The folder that holds the package: of an installation, of a build, or "" where Python has to know
// it by itself.
std::string package_folder() {
  for (const char* path : {"lib/ruedo/python/ruedo", "python/ruedo"}) {
    if (const std::string found = find_installed(path); !found.empty())
      return fs::path(found).parent_path().string();
  }
  return "";
}

// RUEDO_PYTHON, or the virtual environment of a build in its source tree, or python3 of the PATH.
std::string python() {
  if (const char* named = std::getenv("RUEDO_PYTHON"); named && *named) return named;
  if (const char* active = std::getenv("VIRTUAL_ENV"); active && *active)
    return std::string(active) + "/bin/python3";
  const std::string own = find_installed(".venv/bin/python3");
  return own.empty() ? "python3" : own;
}

}  // namespace

int hand_over_to_python(const std::string& module, const std::string& extras,
                        const std::vector<std::string>& words) {
  const std::string package = package_folder(), interpreter = python();
  const char* before = std::getenv("PYTHONPATH");
  if (!package.empty())
    ::setenv("PYTHONPATH", (package + (before && *before ? ":" + std::string(before) : "")).c_str(),
             1);
  std::error_code error;
  if (const fs::path self = fs::read_symlink("/proc/self/exe", error); !error)
    ::setenv("RUEDO", self.c_str(), 0);
  std::vector<std::string> all{interpreter, "-c", kStart, module, extras};
  all.insert(all.end(), words.begin(), words.end());
  std::vector<char*> pointers;
  for (std::string& word : all) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execvp(interpreter.c_str(), pointers.data());
  throw EnvironmentError(
      fmt::format("ruedo {} needs Python 3.10 or newer: '{}' cannot be started ({}); install it "
                  "(apt-get install python3), "
                  "or name one in RUEDO_PYTHON",
                  words.front(), interpreter, std::strerror(errno)));
}

}  // namespace ruedo::cli
