// Versions and features are read from the process itself, so that this depends on no other layer.
#include "log/header.h"

#include <algorithm>
#include <climits>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <set>
#include <string_view>
#include <utility>

#include <gnu/libc-version.h>
#include <link.h>

#include "base/sha256.h"
#include "base/version.h"
#include "log/reader.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "system/late_library.h"
#include "world/document/resources.h"

namespace ruedo::log {
namespace {

// Libraries that compute what goes into messages: arithmetic, physics, rays, pictures, readers of
// files. Others are loaded as the machine and the options have it, and change nothing.
constexpr std::string_view kThatMatter[] = {
    "libstdc++", "libBullet",   "libLinearMath", "libembree",    "libOSMesa",
    "libEGL",    "libLLVM",     "libgallium",    "libopencv_im", "libjpeg",
    "libassimp", "libtinyxml2", "liburdfdom"};

bool matters(std::string_view name) {
  return std::any_of(std::begin(kThatMatter), std::end(kThatMatter),
                     [&](std::string_view start) { return name.starts_with(start); });
}

std::string joined(const std::vector<std::string>& texts) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : " ") + text;
  return all.empty() ? "none" : all;
}

bool holds_this_code(const dl_phdr_info& object) {
  static const int here = 0;
  const auto address = reinterpret_cast<ElfW(Addr)>(&here);
  return std::any_of(object.dlpi_phdr, object.dlpi_phdr + object.dlpi_phnum,
                     [&](const ElfW(Phdr) & header) {
                       return header.p_type == PT_LOAD &&
                              address - (object.dlpi_addr + header.p_vaddr) < header.p_memsz;
                     });
}

// Of the program or shared library that this is linked into: what the linker made of its bytes. ""
// where it makes nothing.
std::string build_id() {
  std::string id;
  dl_iterate_phdr(
      [](dl_phdr_info* info, size_t, void* data) {
        if (!holds_this_code(*info)) return 0;
        constexpr size_t kAlign = 4;
        for (int i = 0; i < info->dlpi_phnum; ++i) {
          const ElfW(Phdr)& header = info->dlpi_phdr[i];
          if (header.p_type != PT_NOTE) continue;
          const auto* at = reinterpret_cast<const char*>(info->dlpi_addr + header.p_vaddr);
          for (const char* end = at + header.p_memsz; at + sizeof(ElfW(Nhdr)) <= end;) {
            const auto* note = reinterpret_cast<const ElfW(Nhdr)*>(at);
            const char* name = at + sizeof *note;
            const auto* bytes = reinterpret_cast<const unsigned char*>(
                name + (note->n_namesz + kAlign - 1) / kAlign * kAlign);
            if (note->n_type == NT_GNU_BUILD_ID &&
                std::string_view(name, note->n_namesz) == std::string_view("GNU", 4)) {
              char digits[3];
              for (size_t k = 0; k < note->n_descsz; ++k) {
                std::snprintf(digits, sizeof digits, "%02x", bytes[k]);
                *static_cast<std::string*>(data) += digits;
              }
            }
            at = reinterpret_cast<const char*>(bytes) +
                 (note->n_descsz + kAlign - 1) / kAlign * kAlign;
          }
        }
        return 1;
      },
      &id);
  return id;
}

constexpr const char* kBuild = ", build ";

// Programs of one build have different ones. An older log names nothing but a build.
std::string without_build(const std::string& version) {
  const size_t at = version.find(kBuild);
  return at == std::string::npos ? version : version.substr(0, at) + ")";
}

// Those that acted on pictures.
std::string mesas_variables(const log_header_t& header) {
  std::vector<std::string> variables;
  for (const std::string& option : header.options) {
    if (option.starts_with(kMesaOption)) variables.push_back(option.substr(kMesaOption.size()));
  }
  return variables.empty() ? "none" : joined(variables);
}

// These differ from machine to machine.
std::vector<std::string> without_mesas_variables(std::vector<std::string> options) {
  std::erase_if(options, [](const std::string& one) { return one.starts_with(kMesaOption); });
  return options;
}

}  // namespace

std::string cpu_features() {
#if defined(__x86_64__) || defined(__i386__)
  std::string text;
  const auto add = [&](bool present, const char* name) {
    if (present) text += (text.empty() ? "" : " ") + std::string(name);
  };
  text = "x86-64";
  __builtin_cpu_init();
  add(__builtin_cpu_supports("sse4.2"), "sse4.2");
  add(__builtin_cpu_supports("avx"), "avx");
  add(__builtin_cpu_supports("fma"), "fma");
  add(__builtin_cpu_supports("avx2"), "avx2");
  add(__builtin_cpu_supports("avx512f"), "avx512f");
  return text;
#elif defined(__aarch64__)
  return "aarch64";
#else
  return "unknown";
#endif
}

std::string own_version() {
  const std::string id = build_id();
  return std::string(version()) + " (source " + own_sources() + (id.empty() ? "" : kBuild + id) +
         ")";
}

std::string libc_version() { return std::string("glibc ") + gnu_get_libc_version(); }

std::vector<std::string> libraries_that_matter() {
  std::vector<std::string> files;
  dl_iterate_phdr(
      [](dl_phdr_info* info, size_t, void* data) {
        static_cast<std::vector<std::string>*>(data)->emplace_back(info->dlpi_name);
        return 0;
      },
      &files);
  const std::vector<std::string>& late = files_of_late_libraries();
  files.insert(files.end(), late.begin(), late.end());  // whether or not a picture was drawn by now
  std::set<std::string> names;
  for (const std::string& file : files) {
    std::error_code error;
    const std::filesystem::path path = std::filesystem::canonical(file, error);
    const std::string name = path.filename().string();
    if (!error && matters(name)) names.insert(name);
  }
  return {names.begin(), names.end()};
}

log_header_t make_log_header(const world::WorldModel& world, uint64_t seed,
                             const std::vector<std::string>& options) {
  log_header_t header;
  header.utime = 0;
  header.epoch = 0;
  header.version = own_version();
  header.world = world.name;
  header.world_file = world.file;
  header.seed = static_cast<int64_t>(seed);
  header.step_us = world.step_us;
  header.options = options;
  header.noptions = static_cast<int32_t>(options.size());
  header.files = hashed_files(world.files_read);
  header.nfiles = static_cast<int32_t>(header.files.size());
  header.cpu = cpu_features();
  header.libc = libc_version();
  header.libraries = libraries_that_matter();
  header.nlibraries = static_cast<int32_t>(header.libraries.size());
  return header;
}

std::vector<log_file_t> hashed_files(const std::vector<std::string>& paths) {
  std::vector<log_file_t> files;
  for (const std::string& path : paths) files.push_back({path, sha256_of_file(path)});
  return files;
}

namespace {

namespace fs = std::filesystem;

constexpr size_t kMostFiles = 10'000, kLongestName = PATH_MAX - 1;  // of a log's header
constexpr size_t kMostParts = 64;  // of a path's end that is looked for

// The ends of a path that stay below a folder, the longest first: of a/b/c these are a/b/c, b/c
// and c.
std::vector<std::string> ends_of(const std::string& path) {
  const std::string tidied = fs::path(path).lexically_normal().string();
  std::vector<std::string> ends;
  for (size_t at = tidied.size(); at-- > 0 && ends.size() < kMostParts;) {
    if (tidied[at] == '/' || (at > 0 && tidied[at - 1] != '/')) continue;
    ends.push_back(tidied.substr(at));
    if (ends.back() == ".." || ends.back().starts_with("../"))
      return {ends.rbegin() + 1, ends.rend()};
  }
  return {ends.rbegin(), ends.rend()};
}

// A file of that content in those folders whose path ends as the given one's does; "" without one.
// A link may lead out of a folder: the finder limits the reach of a log.
std::string found_again(const log_file_t& file, const std::vector<fs::path>& folders,
                        const world::ResourceFinder& finder, Digests& digests) {
  std::error_code error;
  for (const std::string& end : ends_of(file.path)) {
    for (const fs::path& folder : folders) {
      const std::string here = (folder / end).string();
      if (fs::is_regular_file(here, error) && finder.reaches(here) &&
          digests.of(here) == file.sha256)
        return here;
    }
  }
  return "";
}

}  // namespace

const std::string& Digests::of(const std::string& path) {
  std::error_code error;
  const std::string file = fs::canonical(path, error).string();
  const auto [at, is_new] = known_.try_emplace(error ? path : file);
  if (is_new) at->second = sha256_of_file(path);
  return at->second;
}

std::string fault_of_names(const log_header_t& header) {
  if (header.files.size() > kMostFiles)
    return "was made from " + std::to_string(header.files.size()) + " files; allowed are " +
           std::to_string(kMostFiles);
  const auto is_long = [](const std::string& name) { return name.size() > kLongestName; };
  if (is_long(header.world_file) ||
      std::any_of(header.files.begin(), header.files.end(),
                  [&](const log_file_t& file) { return is_long(file.path); }))
    return "names a file by a path of more than " + std::to_string(kLongestName) +
           " bytes, which no file has";
  return "";
}

namespace {

void find_files_again(log_header_t& header, const std::string& log, Digests& digests) {
  if (!fault_of_names(header).empty()) return;
  std::error_code error;
  const fs::path beside = fs::absolute(log, error).parent_path(), shipped = world::shipped_worlds();
  const world::ResourceFinder near(log, false);
  const auto move = [&](log_file_t& file, const std::vector<fs::path>& folders) {
    const std::string found = found_again(file, folders, near, digests);
    if (found.empty()) return;
    if (header.world_file == file.path) header.world_file = found;
    file.path = found;
  };
  for (log_file_t& file : header.files) {
    if (!fs::is_regular_file(file.path, error)) move(file, {beside, shipped});
  }
  // The file there may be another installation's: ours is as good, and is readable.
  const world::ResourceFinder finder(header.world_file, false);
  for (log_file_t& file : header.files) {
    if (!finder.reaches(file.path)) move(file, {shipped});
  }
}

// The file of that name among Ruedo's own worlds; "" without one.
std::string shipped_as(const std::string& path) {
  std::error_code error;
  for (const std::string& end : ends_of(path)) {
    const fs::path ours = fs::path(world::shipped_worlds()) / end;
    if (end.find('/') != std::string::npos && fs::is_regular_file(ours, error)) return ours;
  }
  return "";
}

// The log may be untrusted: it must not reveal which files are on this machine, not even by a
// hash.
void check_files(const log_header_t& header, const std::string& log, Digests& digests) {
  if (const std::string fault = fault_of_names(header); !fault.empty())
    throw InputError({log}, fault);
  const world::ResourceFinder finder(header.world_file, false);
  for (const log_file_t& file : header.files) {
    if (!finder.reaches(file.path)) {
      if (const std::string ours = shipped_as(file.path); !ours.empty()) {
        throw InputError({ours}, "was changed since " + log + " was made from " + file.path +
                                     " (its sha256 was " + file.sha256 + ")");
      }
      throw InputError({log}, "was made from " + file.path +
                                  ", which is neither near its world nor in a model folder "
                                  "(RUEDO_PATH); such files are not looked at");
    }
    if (digests.of(file.path) == file.sha256) continue;
    std::error_code error;
    throw InputError({file.path}, std::filesystem::is_regular_file(file.path, error)
                                      ? "was changed since " + log +
                                            " was made from it (its sha256 was " + file.sha256 + ")"
                                      : "cannot be read; " + log +
                                            " was made from it, and it lies neither beside the log "
                                            "nor among Ruedo's own worlds");
  }
}

}  // namespace

void find_files_again(log_header_t& header, const std::string& log) {
  Digests digests;
  find_files_again(header, log, digests);
}

void check_files(const log_header_t& header, const std::string& log) {
  Digests digests;
  check_files(header, log, digests);
}

void check_files_of_spawned(const std::string& log) {
  Digests digests;
  Reader reader(log);
  Event event;
  bool first = true;
  while (reader.next(event, [](const std::string& channel) { return channel == kHeaderChannel; })) {
    log_header_t header;
    if (event.channel != kHeaderChannel || std::exchange(first, false)) continue;
    if (decode_checked(event.data.data(), event.data.size(), header) != DecodeFault::none) continue;
    find_files_again(header, log, digests);
    check_files(header, log, digests);
  }
}

std::vector<std::string> machine_differences(const log_header_t& log, const log_header_t& here) {
  std::vector<std::string> lines;
  const auto compare = [&](const char* what, const std::string& then, const std::string& now) {
    if (then != now)
      lines.push_back(std::string(what) + ": the log has " + then + ", here: " + now);
  };
  compare("Ruedo", without_build(log.version), without_build(here.version));
  const auto architecture = [](const std::string& cpu) { return cpu.substr(0, cpu.find(' ')); };
  compare("processor", architecture(log.cpu), architecture(here.cpu));
  // Computed results are the same on all of them, and with every C library; so are pictures, unless
  // drawn fast.
  if (std::find(log.options.begin(), log.options.end(), "--fast-pixels") != log.options.end())
    compare("CPU features", log.cpu, here.cpu);
  compare("Mesa's environment", mesas_variables(log), mesas_variables(here));
  std::vector<std::string> only_log, only_here;
  std::set_difference(log.libraries.begin(), log.libraries.end(), here.libraries.begin(),
                      here.libraries.end(), std::back_inserter(only_log));
  std::set_difference(here.libraries.begin(), here.libraries.end(), log.libraries.begin(),
                      log.libraries.end(), std::back_inserter(only_here));
  compare("libraries", joined(only_log), joined(only_here));
  return lines;
}

void check_same_run(const log_header_t& log, const log_header_t& here, const std::string& path) {
  const auto refuse = [&](const std::string& text) {
    throw InputError({path}, "is of another run: " + text);
  };
  for (size_t i = 0; i < std::max(log.files.size(), here.files.size()); ++i) {
    if (i >= here.files.size()) refuse("it was made from " + log.files[i].path + ", too");
    if (i >= log.files.size()) refuse("it was not made from " + here.files[i].path);
    if (log.files[i].sha256 == here.files[i].sha256) continue;  // wherever it lies
    if (log.files[i].path != here.files[i].path)
      refuse("it was made from " + log.files[i].path + ", not from " + here.files[i].path);
    refuse(here.files[i].path + " was changed since");
  }
  if (without_mesas_variables(log.options) != without_mesas_variables(here.options))
    refuse("its options are " + joined(log.options) + "; here they are " + joined(here.options));
  if (log.step_us != here.step_us)
    refuse("its steps are " + std::to_string(log.step_us) + " us long");
}

}  // namespace ruedo::log
