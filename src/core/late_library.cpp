// A name without a folder is searched where the program says (its RUNPATH), since this code is part
// of the program, or of the shared library in its place.
#include "core/late_library.h"

#include <dlfcn.h>

namespace ruedo {
namespace {

const char* file_of(LateLibrary library) {
  switch (library) {
    case LateLibrary::codecs: return "libruedo_codecs.so";
    case LateLibrary::osmesa: return "libruedo_osmesa.so";
  }
  return "";
}

}  // namespace

void* late_symbol(LateLibrary library, const char* name, std::string& why) {
  void* loaded = ::dlopen(file_of(library), RTLD_NOW | RTLD_LOCAL);
  void* symbol = loaded == nullptr ? nullptr : ::dlsym(loaded, name);
  if (symbol == nullptr) {
    const char* error = ::dlerror();
    why = error == nullptr ? "it cannot be loaded" : error;
  }
  return symbol;
}

void load_late_libraries() {
  for (const LateLibrary library : {LateLibrary::codecs, LateLibrary::osmesa})
    ::dlopen(file_of(library), RTLD_NOW | RTLD_LOCAL);
}

}  // namespace ruedo
