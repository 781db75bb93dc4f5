// Any text as the model of a SPAWN request: it loads, or gives one InputError.
#include <string>

#include "budget.h"
#include "world/load_model.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const Budget budget;
  try {
    ruedo::world::load_model_text({reinterpret_cast<const char*>(data), size},
                                  "/nowhere/in/a/world.sdf");
  } catch (const ruedo::InputError&) {
  }
  return 0;
}
