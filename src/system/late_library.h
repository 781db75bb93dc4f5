// Our own shared libraries, loaded when they are first needed. The libraries behind them take a
// tenth of a second to load: a picture's codecs, the renderer. They lie where the program's
// own copies of libraries lie.
#pragma once

#include <string>
#include <vector>

namespace ruedo {

enum class LateLibrary { codecs, osmesa };

// A function of such a library, which stays loaded. Null where it cannot be loaded, with the reason
// in `why`. May be called by several threads at once.
void* late_symbol(LateLibrary library, const char* name, std::string& why);

template <class Function>
Function* late_function(LateLibrary library, const char* name, std::string& why) {
  return reinterpret_cast<Function*>(late_symbol(library, name, why));
}

// Loads all that there are: before files are out of reach.
void load_late_libraries();

// The shared libraries that would come in with those that are not loaded yet, by path. The loader
// lists them, once in a process: to load a hundred libraries for their names would take longer than
// all else that a run begins with.
const std::vector<std::string>& files_of_late_libraries();

}  // namespace ruedo
