// Runs the child process and reads its output.
#include "model/xacro.h"

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <vector>

#include "model/child_process.h"

namespace fs = std::filesystem;

namespace ruedo::model {
namespace {

constexpr ProcessLimits kLimits{
    .cpu_s = 10, .output_bytes = 64 << 20, .memory_bytes = rlim_t{1} << 30, .wall_s = 60};

std::string script() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path().parent_path() / "share/ruedo/xacro/expand.py";
  return !error && fs::exists(installed, error) ? installed.string() : RUEDO_XACRO_DIR "/expand.py";
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
  std::error_code error;
  return fs::exists(RUEDO_PYTHON, error) ? RUEDO_PYTHON : "python3";
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

// What expand.py prints.
std::string output_of(const std::string& path, const ReadContext& context) {
  std::vector<std::string> words{xacro_python(), script(), path};
  const std::string python = words[0];
  for (const std::string& root : context.resources.folders())
    words.insert(words.end(), {"--folder", root});
  if (context.resources.find("/", path)) words.push_back("--anywhere");
  for (const std::string& argument : context.xacro_arguments)
    words.insert(words.end(), {"--argument", argument});
  ProcessResult result = run_limited(std::move(words), kLimits);
  const bool ended = result.status && WIFEXITED(*result.status);
  const int code = ended ? WEXITSTATUS(*result.status) : -1;
  if (code == 0) return std::move(result.output);
  std::string why = last_line(result.messages);  // xacro's warnings come before
  if (code == 127) why = "Python is missing (" + python + "); xacro needs it";
  if (!ended) why = "it needs more than " + std::to_string(kLimits.cpu_s) + " s, or more than 1 GB";
  throw InputError({path, 0}, "the xacro file cannot be expanded: " +
                                  (why.empty() ? "it does not say why" : why));
}

// A line of what expand.py prints before the robot.
void take_note(const std::string& line, ReadContext& context) {
  std::istringstream words(line);
  std::string kind, file, include;
  std::getline(std::getline(std::getline(words, kind, '\t'), file, '\t'), include);
  if (kind == "read") context.documents.note(file);
  if (kind == "missing")
    context.findings.error({file, 0}, "xacro",
                           "the include '" + include + "' is not found; it is passed over");
}

}  // namespace

std::shared_ptr<const Element> expand_xacro(const std::string& path, ReadContext& context) {
  const std::string output = output_of(path, context);
  size_t at = 0;
  for (;;) {
    const size_t end = std::min(output.find('\n', at), output.size());
    const std::string line = output.substr(at, end - at);
    at = std::min(end + 1, output.size());
    if (line.empty()) break;
    take_note(line, context);
  }
  std::unique_ptr<Element> root = parse_document(output.substr(at), path);
  take_lines(*root, {path, 1});
  return root;
}

}  // namespace ruedo::model
