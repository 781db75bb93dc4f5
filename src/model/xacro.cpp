// Runs the child process and reads its output.
#include "model/xacro.h"

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <vector>

#include "core/input_file.h"
#include "model/child_process.h"

namespace fs = std::filesystem;

namespace ruedo::model {
namespace {

constexpr rlim_t kCpu_s = 20, kMemory_bytes = rlim_t{2} << 30, kFile_bytes = rlim_t{64} << 20;
constexpr int kWall_s = 60;
constexpr size_t kLargest_bytes = size_t{64} << 20;

std::string script() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path installed = program.parent_path().parent_path() / "share/ruedo/xacro/expand.py";
  return !error && fs::exists(installed, error) ? installed.string() : RUEDO_XACRO_DIR "/expand.py";
}

// Exit code, or -1 for a child that was killed.
int run(std::vector<std::string> words, const std::string& log) {
  const std::optional<int> status =
      run_limited(std::move(words), log, {kCpu_s, kFile_bytes, kMemory_bytes, kWall_s});
  return status && WIFEXITED(*status) ? WEXITSTATUS(*status) : -1;
}

std::string text_or_nothing(const std::string& path) {
  try {
    return read_input(path, kLargest_bytes);
  } catch (const InputError&) {
    return "";
  }
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

std::shared_ptr<const Element> expand(const std::string& path, ReadContext& context) {
  const TemporaryFolder folder("xacro");
  const std::string out = folder / "robot.urdf", log = folder / "messages";
  std::vector<std::string> words{xacro_python(), script(), path, out};
  for (const std::string& root : context.resources.folders())
    words.insert(words.end(), {"--folder", root});
  for (const std::string& argument : context.xacro_arguments)
    words.insert(words.end(), {"--argument", argument});
  const int code = run(words, log);
  if (code != 0) {
    std::string why = text_or_nothing(log);
    why.erase(why.find_last_not_of('\n') + 1);
    why.erase(0, why.rfind('\n') + 1);  // xacro's warnings come before
    if (code == 127) why = "Python is missing (" + words[0] + "); xacro needs it";
    if (code == -1) why = "it needs more than " + std::to_string(kCpu_s) + " s, or more than 2 GB";
    throw InputError({path, 0}, "the xacro file cannot be expanded: " +
                                    (why.empty() ? "it does not say why" : why));
  }
  std::string line;
  for (std::istringstream files(text_or_nothing(out + ".files")); std::getline(files, line);)
    context.documents.note(line);
  for (std::istringstream lines(text_or_nothing(out + ".missing")); std::getline(lines, line);) {
    const size_t tab = line.find('\t');
    context.findings.error({line.substr(0, tab), 0}, "xacro",
                           "the include '" + line.substr(std::min(tab, line.size() - 1) + 1) +
                               "' is not found; it is passed over");
  }
  std::unique_ptr<Element> root = parse_document(read_input(out, kLargest_bytes), path);
  take_lines(*root, {path, 1});
  return root;
}

}  // namespace

std::shared_ptr<const Element> expand_xacro(const std::string& path, ReadContext& context) {
  try {
    return expand(path, context);
  } catch (const InputError&) {
    throw;
  } catch (const std::runtime_error& error) {  // from the folder or the process
    throw InputError({path, 0}, std::string("the xacro file cannot be expanded: ") + error.what());
  }
}

}  // namespace ruedo::model
