// The one file that is compiled again when the version changes.
#include "base/version.h"

namespace ruedo {

const char* version() { return RUEDO_VERSION; }

}  // namespace ruedo
