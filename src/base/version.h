// The version of Ruedo, as the file VERSION has it.
#pragma once

namespace ruedo {

const char* version();

}  // namespace ruedo
