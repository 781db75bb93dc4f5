// Any text as a world: it loads, or gives one InputError. Nothing else may come out.
#include <string>

#include "budget.h"
#include "world/load.h"
#include "world/model/body_layout.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const Budget budget;
  try {
    const auto world = ruedo::world::load_world_text({reinterpret_cast<const char*>(data), size},
                                                     "/nowhere/in/a/world.sdf");
    const ruedo::world::BodyLayout layout(*world);
  } catch (const ruedo::InputError&) {
  }
  return 0;
}
