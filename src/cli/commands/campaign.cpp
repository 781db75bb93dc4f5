// ruedo campaign, hunt and why: written in Python, in the package `ruedo` of this installation,
// which this hands over to.
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

#include "cli/support/commands.h"
#include "ruedo/errors.h"
#include "system/installation.h"

namespace ruedo::cli {
namespace {

namespace fs = std::filesystem;

// One line for a missing package, instead of a traceback.
constexpr const char* kStart = R"py(import sys
try:
    from ruedo.campaign.cli import main
except ImportError as error:
    print(f"ruedo: {error}: this Python ({sys.executable}) needs pip install 'ruedo[campaign]' (for hunts 'ruedo[hunt]', for clusters 'ruedo[ray]')", file=sys.stderr)
    sys.exit(4)
sys.exit(main(sys.argv[1:]))
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

int hand_over(const char* command, const std::vector<std::string>& arguments) {
  const std::string package = package_folder(), interpreter = python();
  const char* before = std::getenv("PYTHONPATH");
  if (!package.empty())
    ::setenv("PYTHONPATH", (package + (before && *before ? ":" + std::string(before) : "")).c_str(),
             1);
  std::error_code error;
  if (const fs::path self = fs::read_symlink("/proc/self/exe", error); !error)
    ::setenv("RUEDO", self.c_str(), 0);
  std::vector<std::string> words{interpreter, "-c", kStart, command};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execvp(interpreter.c_str(), pointers.data());
  throw EnvironmentError(
      fmt::format("ruedo {} needs Python 3.10 or newer: '{}' cannot be started ({}); install it "
                  "(apt-get install python3), "
                  "or name one in RUEDO_PYTHON",
                  command, interpreter, std::strerror(errno)));
}

void add(CLI::App& app, Action& chosen, const char* name, const char* description) {
  CLI::App* command = app.add_subcommand(name, description);
  command->prefix_command();  // Python reads what follows
  command->set_help_flag();
  command->callback([command, name, &chosen] {
    chosen = [command, name] { return hand_over(name, command->remaining()); };
  });
}

void add_campaign(CLI::App& app, Action& chosen) {
  add(app, chosen, "campaign",
      "many runs: worlds, parameters, seeds and controllers of one file, judged and reported");
  add(app, chosen, "hunt",
      "search for the case that breaks a controller, and shrink it to a regression test");
  add(app, chosen, "why",
      "until when a failed run could have been saved, and which single change would have saved it");
}

const RegisterCommand kRegister{56, add_campaign};

}  // namespace
}  // namespace ruedo::cli
