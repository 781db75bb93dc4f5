// Pictures and maps: heightmaps, bitmaps, map_server's YAML and ArMap. The first byte says which.
#include <stdexcept>

#include "budget.h"
#include "scratch_file.h"
#include "world/maps/occupancy.h"
#include "world/read/height_maps.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace ruedo::world;
  static const ScratchFolder folder;
  static const std::string picture = [] {
    const uint8_t pgm[] = "P5\n2 2\n255\nabcd";
    return folder.write("map.pgm", pgm, sizeof pgm - 1);
  }();
  if (size < 1) return 0;
  const Budget budget;
  const std::string path =
      folder.write(data[0] % 4 == 2 ? "map.yaml" : "map.map", data + 1, size - 1);
  try {
    std::string left_out;
    ruedo::Findings findings;
    switch (data[0] % 4) {
      case 0: heightmap(path, {1, 1, 1}); break;
      case 1: walls_of(read_bitmap(path, 0.1)); break;
      case 2: walls_of(read_map(path, findings)); break;
      default: world_of_walls("w", read_armap(path, 0.1, left_out), 1);
    }
  } catch (const std::runtime_error&) {  // InputError is one
  }
  return 0;
}
