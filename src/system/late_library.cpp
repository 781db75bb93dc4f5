// A name without a folder is searched where the program says (its RUNPATH), since this code is part
// of the program, or of the shared library in its place.
#include "system/late_library.h"

#include <algorithm>
#include <string_view>

#include <dlfcn.h>
#include <link.h>
#include <sys/auxv.h>
#include <unistd.h>

#include "system/program_output.h"

namespace ruedo {
namespace {

constexpr LateLibrary kAll[] = {LateLibrary::codecs, LateLibrary::osmesa};

const char* file_of(LateLibrary library) {
  switch (library) {
    case LateLibrary::codecs: return "libruedo_codecs.so";
    case LateLibrary::osmesa: return "libruedo_osmesa.so";
  }
  return "";
}

// The program's dynamic loader, as a program.
std::string loader() {
  std::string path;
  dl_iterate_phdr(
      [](dl_phdr_info* info, size_t, void* data) {
        if (info->dlpi_addr != getauxval(AT_BASE)) return 0;
        *static_cast<std::string*>(data) = info->dlpi_name;
        return 1;
      },
      &path);
  return path;
}

// Where dlopen finds it: in the folders that the program, or the shared library that this code is
// part of, names.
std::string path_of(const char* name) {
  static const int here = 0;
  Dl_info info;
  link_map* self = nullptr;
  Dl_serinfo size;
  if (::dladdr1(&here, &info, reinterpret_cast<void**>(&self), RTLD_DL_LINKMAP) == 0 ||
      ::dlinfo(self, RTLD_DI_SERINFOSIZE, &size) != 0)
    return "";
  std::vector<Dl_serinfo> room(size.dls_size / sizeof(Dl_serinfo) + 1);
  Dl_serinfo* folders = room.data();
  *folders = size;
  if (::dlinfo(self, RTLD_DI_SERINFO, folders) != 0) return "";
  for (unsigned i = 0; i < folders->dls_cnt; ++i) {
    std::string path = std::string(folders->dls_serpath[i].dls_name) + "/" + name;
    if (::access(path.c_str(), R_OK) == 0) return path;
  }
  return "";
}

// lines: what the loader prints of a library's dependencies, NAME => PATH (ADDRESS) of each.
void add_files(std::string_view lines, std::vector<std::string>& files) {
  constexpr std::string_view kArrow = " => ";
  for (size_t begin = 0; begin < lines.size();) {
    const size_t end = std::min(lines.find('\n', begin), lines.size());
    const std::string_view line = lines.substr(begin, end - begin);
    begin = end + 1;
    const size_t arrow = line.find(kArrow), address = line.rfind(" (0x");
    if (arrow == line.npos || address == line.npos || address < arrow) continue;
    const size_t path = arrow + kArrow.size();
    files.emplace_back(line.substr(path, address - path));
  }
}

// By its path: a sanitizer's dlopen() would search where the sanitizer's own library says.
void* load(LateLibrary library) {
  const char* name = file_of(library);
  const std::string path = path_of(name);
  return ::dlopen(path.empty() ? name : path.c_str(), RTLD_NOW | RTLD_LOCAL);
}

}  // namespace

void* late_symbol(LateLibrary library, const char* name, std::string& why) {
  void* loaded = load(library);
  void* symbol = loaded == nullptr ? nullptr : ::dlsym(loaded, name);
  if (symbol == nullptr) {
    const char* error = ::dlerror();
    why = error == nullptr ? "it cannot be loaded" : error;
  }
  return symbol;
}

void load_late_libraries() {
  for (const LateLibrary library : kAll) load(library);
}

const std::vector<std::string>& files_of_late_libraries() {
  static const std::vector<std::string> files = [] {
    std::vector<std::string> found;
    for (const LateLibrary library : kAll) {
      if (::dlopen(file_of(library), RTLD_LAZY | RTLD_NOLOAD) != nullptr) continue;
      const std::string path = path_of(file_of(library));
      if (path.empty()) continue;
      if (const auto lines = output_of({loader(), "--list", path}, ItsErrors::dropped))
        add_files(*lines, found);
    }
    return found;
  }();
  return files;
}

}  // namespace ruedo
