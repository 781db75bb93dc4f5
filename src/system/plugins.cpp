// The file is looked at before any of its code runs: what it was built for stands in it as text.
#include "system/plugins.h"

#include <algorithm>
#include <array>
#include <cfenv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <string_view>

#include <dlfcn.h>
#include <elf.h>
#include <link.h>
#include <sys/stat.h>

#include "base/input_file.h"
#include "base/sha256.h"
#include "base/utf8.h"
#include "ruedo/errors.h"
#include "ruedo/plugin.h"
#include "ruedo/plugin_abi.h"
#include "system/plugin_guard.h"

namespace fs = std::filesystem;

namespace ruedo {
namespace {

constexpr std::string_view kElf =
    "\x7f"
    "ELF";
constexpr std::string_view kMark = RUEDO_PLUGIN_MARK;
constexpr const char* kAbi = RUEDO_PLUGIN_ABI;
constexpr size_t kLargest = 1'000'000'000;  // bytes

std::mutex& mutex() {
  static std::mutex one;
  return one;
}

std::vector<Plugin>& plugins() {
  static std::vector<Plugin> list;
  return list;
}

// A file whose end is missing, such as a copy that was broken off, would end the process with
// SIGBUS as the dynamic linker reads it.
void check_whole(const std::string& bytes, const std::string& path) {
  const auto read = [&](auto& head, size_t at) {
    if (at > bytes.size() || bytes.size() - at < sizeof head) return false;
    std::memcpy(&head, &bytes[at], sizeof head);
    return true;
  };
  ElfW(Ehdr) file{};
  bool whole = read(file, 0);
  if (whole && file.e_ident[EI_CLASS] != (sizeof(void*) == 8 ? ELFCLASS64 : ELFCLASS32))
    return;  // the linker refuses it
  for (size_t i = 0; whole && i < file.e_phnum; ++i) {
    ElfW(Phdr) part{};
    whole = read(part, file.e_phoff + i * sizeof part) &&
            (part.p_type != PT_LOAD ||
             (part.p_offset <= bytes.size() && part.p_filesz <= bytes.size() - part.p_offset));
  }
  if (!whole)
    throw InputError({path}, "is a shared library whose end is missing, as in a broken off copy");
}

// Changes when another file comes to that path, and when other bytes come into the file.
std::array<int64_t, 4> state_of(const std::string& path) {
  struct stat file{};
  ::stat(path.c_str(), &file);
  return {static_cast<int64_t>(file.st_dev), static_cast<int64_t>(file.st_ino),
          int64_t{file.st_ctim.tv_sec}, int64_t{file.st_ctim.tv_nsec}};
}

// The version that the plugin was built for, by its bytes.
std::string built_for(const std::string& bytes, const std::string& path) {
  if (!std::string_view(bytes).starts_with(kElf))
    throw InputError({path},
                     "is not a shared library; a plugin is built by CMake's target ruedo::plugin");
  check_whole(bytes, path);
  const size_t at = bytes.find(kMark);
  const size_t begin = at + kMark.size();
  if (at == std::string::npos || begin >= bytes.size() || bytes[begin] == '\0')
    throw InputError(
        {path}, "is not a plugin of Ruedo: it was not linked with CMake's target ruedo::plugin");
  return bytes.substr(begin, bytes.find('\0', begin) - begin);
}

void check_abi(const std::string& theirs, const std::string& path) {
  if (theirs == kAbi) return;
  throw InputError({path}, "was built for another Ruedo (" + for_terminal(theirs) + "; this is " +
                               kAbi + "): build it again against this installation");
}

// Code of a plugin that is built with -ffast-math switches this thread to flushing small numbers to
// zero as it is loaded, which would change everybody's results.
class SameArithmetic {
 public:
  SameArithmetic() { std::fegetenv(&before_); }
  ~SameArithmetic() { std::fesetenv(&before_); }
  SameArithmetic(const SameArithmetic&) = delete;
  SameArithmetic& operator=(const SameArithmetic&) = delete;

 private:
  std::fenv_t before_;
};

// No handler catches an exception of an object at namespace scope, since the dynamic linker makes
// it: the process ends, with a message and the exit code of bad input.
class EndsWithItsError {
 public:
  explicit EndsWithItsError(const std::string& path) {
    path_ = path.c_str(), before_ = std::set_terminate(end);
  }
  ~EndsWithItsError() { std::set_terminate(before_); }
  EndsWithItsError(const EndsWithItsError&) = delete;
  EndsWithItsError& operator=(const EndsWithItsError&) = delete;

 private:
  [[noreturn]] static void end() {
    constexpr int kBadInput = 3;
    try {
      if (const std::exception_ptr thrown = std::current_exception())
        std::rethrow_exception(thrown);
      std::fprintf(stderr, "ruedo: %s: the plugin ended the process while it was loaded\n", path_);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "ruedo: %s: the plugin threw while it was loaded: %s\n", path_,
                   for_terminal(error.what()).c_str());
    } catch (...) {
      std::fprintf(stderr, "ruedo: %s: the plugin threw while it was loaded\n", path_);
    }
    std::_Exit(kBadInput);
  }

  static inline const char* path_ = "";
  std::terminate_handler before_;
};

const PluginEntry& open(const std::string& path) {
  const SameArithmetic same;
  const EndsWithItsError ends(path);
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const char* why = dlerror();
    std::string text = why ? why : "unknown";
    if (text.starts_with(path + ": ")) text.erase(0, path.size() + 2);
    throw InputError({path}, "the plugin cannot be loaded: " + text);
  }
  const auto* entry = static_cast<const PluginEntry*>(dlsym(library, "ruedo_plugin_entry"));
  if (entry == nullptr || !entry->abi || !entry->sensors || !entry->drives)
    throw InputError({path}, "is not a plugin of Ruedo: it has no ruedo_plugin_entry");
  check_abi(entry->abi, path);
  return *entry;
}

void check_name(const std::string& name, const char* what, const std::string& path) {
  const auto printable = [](unsigned char c) { return c > ' ' && c < 0x7f; };
  if (!name.empty() && std::all_of(name.begin(), name.end(), printable)) return;
  throw InputError({path}, "has '" + for_terminal(name) + "' as the name of " + what +
                               "; one or more printable ASCII characters are allowed, no spaces");
}

// Two of a name would hide each other; a module has one place in the schedule.
void check_new(const PluginEntry& entry, const std::string& path) {
  std::set<std::string> types, drives{"kinematic", "wheels"};
  std::map<std::string, int> orders;
  for (const SensorKind& kind : sensor_kinds()) {
    types.insert(kind.types.begin(), kind.types.end());
    orders.emplace(kind.module, kind.order);
  }
  for (const DriveKind& kind : drive_kinds()) drives.insert(kind.type);
  for (const SensorKind& kind : entry.sensors()) {
    check_name(kind.module, "a module", path);
    check_name(kind.name(), "a kind of sensor", path);
    for (const std::string& type : kind.types) check_name(type, "a type of sensor", path);
    if (!kind.make)
      throw InputError({path},
                       "has a sensor '" + kind.name() + "' without a function that makes it");
    if (const int order = orders.emplace(kind.module, kind.order).first->second;
        order != kind.order) {
      throw InputError({path}, "has a sensor of the module '" + kind.module + "' with the order " +
                                   std::to_string(kind.order) + "; that module has the order " +
                                   std::to_string(order));
    }
    for (const std::string& type : kind.types) {
      if (!types.insert(type).second)
        throw InputError({path}, "has a sensor of type '" + type + "', which there is already");
    }
  }
  for (const DriveKind& kind : entry.drives()) {
    check_name(kind.type, "a type of drive", path);
    if (!drives.insert(kind.type).second)
      throw InputError({path}, "has a drive of type '" + kind.type + "', which there is already");
    if (!kind.make)
      throw InputError({path}, "has a drive '" + kind.type + "' without a function that makes it");
  }
  if (entry.sensors().empty() && entry.drives().empty())
    throw InputError({path}, "registers no sensor and no drive");
}

}  // namespace

Plugin load_plugin(const std::string& given) {
  const std::lock_guard lock(mutex());
  std::error_code error;
  const fs::path resolved = fs::canonical(given, error);
  if (error) throw InputError({given}, "there is no such plugin");
  const std::string path = resolved.string();
  for (const Plugin& plugin : plugins()) {
    if (plugin.path == path) return plugin;
  }
  const auto as_read = state_of(path);
  const std::string bytes = read_input(path, kLargest);
  check_abi(built_for(bytes, path), path);
  Plugin plugin{fs::path(given).filename().string(), path,
                sha256(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size())};
  const PluginEntry& entry = open(path);
  if (state_of(path) != as_read)
    throw InputError({path}, "was written anew while it was loaded: start again");
  check_new(entry, path);
  watch_plugin_calls();
  for (const SensorKind& kind : entry.sensors()) RegisterSensor{guarded(kind, plugin.name)};
  for (const DriveKind& kind : entry.drives()) RegisterDrive{guarded(kind, plugin.name)};
  const auto place =
      std::upper_bound(plugins().begin(), plugins().end(), plugin,
                       [](const Plugin& a, const Plugin& b) { return a.name < b.name; });
  plugins().insert(place, plugin);
  return plugin;
}

std::vector<std::string> plugin_folders() {
  std::vector<std::string> folders;
  const char* path = std::getenv("RUEDO_PLUGIN_PATH");
  std::string_view rest = path ? path : "";
  while (!rest.empty()) {
    const size_t colon = std::min(rest.find(':'), rest.size());
    if (colon > 0) folders.emplace_back(rest.substr(0, colon));
    rest.remove_prefix(std::min(colon + 1, rest.size()));
  }
  return folders;
}

std::string find_plugin(const std::string& name) {
  if (name.empty() || name.find('/') != std::string::npos) return "";
  const std::string names[] = {name, "lib" + name + ".so"};
  for (const Plugin& plugin : loaded_plugins()) {
    if (plugin.name == names[0] || plugin.name == names[1]) return plugin.path;
  }
  std::error_code error;
  for (const std::string& folder : plugin_folders()) {
    for (const std::string& file : names) {
      if (fs::is_regular_file(fs::path(folder) / file, error))
        return (fs::path(folder) / file).string();
    }
  }
  return "";
}

std::vector<Plugin> loaded_plugins() {
  const std::lock_guard lock(mutex());
  return plugins();
}

}  // namespace ruedo
