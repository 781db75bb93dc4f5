// Where the files lie that come with this program or library.
#pragma once

#include <string>

namespace ruedo {

// The folder of the program, or of the shared library, that this code is linked into: absolute, without links.
std::string own_folder();

}  // namespace ruedo
