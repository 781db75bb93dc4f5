// Runs the child process and reads its output.
#include "world/urdf/xacro.h"

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <sstream>
#include <vector>

#include "system/child_process.h"
#include "system/installation.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

constexpr int kCpu_s = 10;

ProcessLimits limits() {
  return {.cpu_s = kCpu_s, .output_bytes = 64 << 20, .memory_bytes = rlim_t{1} << 30, .wall_s = 60};
}

std::string script() {
  for (const char* path : {"share/ruedo/xacro/expand.py", "src/world/urdf/xacro/expand.py"}) {
    if (std::string found = find_installed(path); !found.empty()) return found;
  }
  return RUEDO_SOURCE_TREE "/src/world/urdf/xacro/expand.py";  // built outside of the source tree
}

// "FILE:LINE", added to each element by expand.py.
void take_lines(Element& element, const Source& above) {
  element.source = above;
  const auto at = std::find_if(element.attributes.begin(), element.attributes.end(),
                               [](const auto& each) { return each.first == "ruedo_at"; });
  if (at != element.attributes.end()) {
    const size_t colon = at->second.rfind(':');
    element.source = {at->second.substr(0, colon), std::atoi(at->second.c_str() + colon + 1)};
    element.attributes.erase(at);
  }
  const Source own = element.source;
  for (const auto& child : element.children) take_lines(*child, own);
}

}  // namespace

// Ruedo's own if it exists, since it has the package.
std::string xacro_python() {
  if (const char* chosen = std::getenv("RUEDO_PYTHON")) return chosen;
  if (std::string own = find_installed(".venv/bin/python"); !own.empty()) return own;
  std::error_code error;
  const char* const python = RUEDO_SOURCE_TREE "/.venv/bin/python";
  return fs::exists(python, error) ? python : "python3";
}

bool is_xacro(const std::string& path, const Element* root) {
  std::error_code error;  // a text from a request does not get here: only files are expanded
  if (!fs::is_regular_file(path, error)) return false;
  if (fs::path(path).extension() == ".xacro") return true;
  if (!root || root->name != "robot") return false;
  return std::any_of(root->children.begin(), root->children.end(),
                     [](const auto& child) { return child->name.rfind("xacro:", 0) == 0; });
}

namespace {

std::string last_line(std::string text) {
  text.erase(text.find_last_not_of('\n') + 1);
  text.erase(0, text.rfind('\n') + 1);
  return text;
}

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw InputError({path, 0}, "the xacro file cannot be expanded: " +
                                  (why.empty() ? "it does not say why" : why));
}

// The output of expand.py.
std::string output_of(const std::string& path, std::vector<std::string> words,
                      const ProcessLimits& limits) {
  const std::string python = words[0];
  ProcessResult result = run_limited(std::move(words), limits);
  const bool ended = result.status && WIFEXITED(*result.status);
  const int code = ended ? WEXITSTATUS(*result.status) : -1;
  if (code == 0) return std::move(result.output);
  if (code == 126) fail(path, "its sandbox cannot be entered");
  if (code == 127) fail(path, "Python is missing (" + python + "); xacro needs it");
  if (!ended) fail(path, "it needs more than " + std::to_string(kCpu_s) + " s, or more than 1 GB");
  const char* home = std::getenv("PYTHONHOME");
  if (home && result.messages.find("<no Python frame>") != std::string::npos)
    fail(path, "Python (" + python + ") does not start with PYTHONHOME=" + home + ": unset it");
  fail(path, last_line(result.messages));  // xacro's warnings come before
}

// The interpreter, and what it reads of its own. It says so itself, once: it may be a script that
// looks for the interpreter, and may lie anywhere.
std::vector<std::string> interpreter_for(const std::string& path) {
  static std::mutex mutex;
  static std::map<std::string, std::vector<std::string>> known;
  const std::lock_guard lock(mutex);
  std::vector<std::string>& parts = known[xacro_python()];
  if (parts.empty()) {
    std::istringstream lines(output_of(path, {xacro_python(), script(), "--parts"}, limits()));
    for (std::string line; std::getline(lines, line);) parts.push_back(line);
    if (parts.empty()) fail(path, xacro_python() + " is not a Python interpreter");
  }
  return parts;
}

bool lies_in(const std::string& path, const std::vector<std::string>& folders) {
  std::error_code error;
  const std::string full = fs::weakly_canonical(path, error).string();
  return std::any_of(folders.begin(), folders.end(), [&](const std::string& folder) {
    return full.starts_with(folder == "/" ? folder : folder + "/");
  });
}

// A line of what expand.py prints before the robot.
void take_note(const std::string& line, const std::vector<std::string>& readable,
               ReadContext& context) {
  std::istringstream words(line);
  std::string kind, file, include;
  std::getline(std::getline(std::getline(words, kind, '\t'), file, '\t'), include);
  if (kind == "read" && lies_in(file, readable)) context.documents.note(file);
  if (kind == "missing")
    context.findings.error({file, 0}, "xacro",
                           "the include '" + include + "' is not found; it is passed over");
}

}  // namespace

std::vector<std::string> xacro_parts() {
  try {
    return interpreter_for("");
  } catch (const InputError&) {
    return {};
  }
}

std::shared_ptr<const Element> expand_xacro(const std::string& path, ReadContext& context) {
  const std::vector<std::string> parts = interpreter_for(path);
  const std::vector<std::string> folders = context.resources.folders_of(path);
  ProcessLimits confined = limits();
  confined.sandbox = {.readable = folders, .alone = true};
  std::vector<std::string>& readable = confined.sandbox->readable;
  readable.insert(readable.end(), parts.begin() + 1, parts.end());
  readable.push_back(fs::path(script()).parent_path());
  confined.sandbox->runnable = {parts.front()};
  std::vector<std::string> words{parts.front(), script(), path};
  for (const std::string& root : context.resources.folders())
    words.insert(words.end(), {"--folder", root});
  context.has_xacro = true;
  for (const std::string& argument : context.xacro_arguments)
    words.insert(words.end(), {"--argument", argument});
  const std::string output = output_of(path, std::move(words), confined);
  size_t at = 0;
  for (;;) {
    const size_t end = std::min(output.find('\n', at), output.size());
    const std::string line = output.substr(at, end - at);
    at = std::min(end + 1, output.size());
    if (line.empty()) break;
    take_note(line, folders, context);
  }
  std::unique_ptr<Element> root = parse_document(output.substr(at), path);
  take_lines(*root, {path, 1});
  return root;
}

}  // namespace ruedo::world
