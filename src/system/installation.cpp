// The dynamic linker knows which object an address belongs to; the kernel knows the program.
#include "system/installation.h"

#include <filesystem>

#include <dlfcn.h>

namespace ruedo {

namespace fs = std::filesystem;

namespace {

constexpr int kMostAbove = 4;  // PREFIX/lib/ruedo/python/ruedo, of the Python module

// The folder of the program or library: absolute, without links.
fs::path own_folder() {
  static const int here = 0;
  std::error_code error;
  Dl_info object{};
  fs::path file;
  // Of the program itself the linker has the name as it was typed; of a library, the path.
  if (dladdr(&here, &object) != 0 && object.dli_fname != nullptr &&
      fs::path(object.dli_fname).filename().string().find(".so") != std::string::npos) {
    file = fs::canonical(object.dli_fname, error);
  } else {
    file = fs::read_symlink("/proc/self/exe", error);
  }
  return error ? fs::path() : file.parent_path();
}

}  // namespace

std::string find_installed(const std::string& path) {
  fs::path folder = own_folder();
  if (folder.empty()) return "";
  std::error_code error;
  for (int above = 0; above <= kMostAbove; ++above, folder = folder.parent_path()) {
    if (fs::exists(folder / path, error)) return (folder / path).string();
  }
  return "";
}

}  // namespace ruedo
