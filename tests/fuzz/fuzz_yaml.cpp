// Any text as the YAML of a map, beside a small picture: it is read and made into walls, or gives
// one InputError.
#include <stdexcept>

#include "budget.h"
#include "scratch_file.h"
#include "world/maps/occupancy.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace ruedo::world;
  static const ScratchFolder folder;
  static const std::string picture = [] {
    const uint8_t pgm[] = "P5\n2 2\n255\nabcd";
    return folder.write("map.pgm", pgm, sizeof pgm - 1);
  }();
  const Budget budget;
  const std::string path = folder.write("map.yaml", data, size);
  try {
    ruedo::Findings findings;
    world_of_walls("w", walls_of(read_map(path, findings)), 1);
  } catch (const std::runtime_error&) {  // InputError is one
  }
  return 0;
}
