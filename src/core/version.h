// The version of Ruedo, as CMakeLists.txt has it.
#pragma once

namespace ruedo {

const char* version();  // "0.1.0"

}  // namespace ruedo
