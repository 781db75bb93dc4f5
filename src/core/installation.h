// Where the files lie that come with this program or library.
#pragma once

#include <string>

namespace ruedo {

// The file or folder of that path ("share/ruedo/worlds") in the installation, or build, that the
// program or shared library lies in which this code is linked into: below its own folder, or the
// nearest of the four above it. "" when it is in none of them.
std::string find_installed(const std::string& path);

}  // namespace ruedo
