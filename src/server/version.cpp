// The one file that is compiled again when the version changes.
#include "server/version.h"

namespace ruedo::server {

const char* version() { return RUEDO_VERSION; }

}  // namespace ruedo::server
