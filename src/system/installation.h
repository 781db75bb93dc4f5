// Finds the files that are installed with this program or library.
#pragma once

#include <string>

namespace ruedo {

// The file or folder of that path ("share/ruedo/worlds") in the installation, or build, of the
// program or shared library that this code is linked into: below its folder, or below the nearest
// of the four above it. "" when none of them has it.
std::string find_installed(const std::string& path);

}  // namespace ruedo
