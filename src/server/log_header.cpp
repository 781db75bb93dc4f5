// Versions and features are read from the process itself, so that no other layer is asked for them.
#include "server/log_header.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>

#include <gnu/libc-version.h>
#include <link.h>

#include "server/sha256.h"
#include "server/version.h"

namespace ruedo::server {
namespace {

// Libraries that compute what goes into messages: arithmetic, physics, rays, pictures, readers of files. Others are
// loaded as the machine and the options have it, and change nothing.
constexpr std::string_view kThatMatter[] = {"libc.so",      "libm.so",   "libstdc++", "libBullet", "libLinearMath",
                                            "libembree",    "libOSMesa", "libEGL",    "libLLVM",   "libgallium",
                                            "libopencv_im", "libjpeg",   "libassimp", "libtinyxml2", "liburdfdom"};

bool matters(std::string_view name) {
  return std::any_of(std::begin(kThatMatter), std::end(kThatMatter), [&](std::string_view start) { return name.starts_with(start); });
}

}  // namespace

std::string cpu_features() {
#if defined(__x86_64__) || defined(__i386__)
  std::string text;
  const auto add = [&](bool present, const char* name) {
    if (present) text += (text.empty() ? "" : " ") + std::string(name);
  };
  __builtin_cpu_init();
  add(__builtin_cpu_supports("sse4.2"), "sse4.2");
  add(__builtin_cpu_supports("avx"), "avx");
  add(__builtin_cpu_supports("fma"), "fma");
  add(__builtin_cpu_supports("avx2"), "avx2");
  add(__builtin_cpu_supports("avx512f"), "avx512f");
  return text;
#else
  return "unknown";
#endif
}

std::string libc_version() { return std::string("glibc ") + gnu_get_libc_version(); }

std::vector<std::string> libraries_that_matter() {
  std::set<std::string> names;
  dl_iterate_phdr(
      [](dl_phdr_info* info, size_t, void* data) {
        std::error_code error;
        const std::filesystem::path path = std::filesystem::canonical(info->dlpi_name, error);
        const std::string name = path.filename().string();
        if (!error && matters(name)) static_cast<std::set<std::string>*>(data)->insert(name);
        return 0;
      },
      &names);
  return {names.begin(), names.end()};
}

log_header_t make_log_header(const model::WorldModel& world, uint64_t seed, const std::vector<std::string>& options) {
  log_header_t header;
  header.utime = 0;
  header.version = version();
  header.world = world.name;
  header.world_file = world.file;
  header.seed = static_cast<int64_t>(seed);
  header.step_us = world.step_us;
  header.options = options;
  header.noptions = static_cast<int32_t>(options.size());
  for (const std::string& path : world.files_read) header.files.push_back({path, sha256_of_file(path)});
  header.nfiles = static_cast<int32_t>(header.files.size());
  header.cpu = cpu_features();
  header.libc = libc_version();
  header.libraries = libraries_that_matter();
  header.nlibraries = static_cast<int32_t>(header.libraries.size());
  return header;
}

}  // namespace ruedo::server
