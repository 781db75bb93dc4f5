// Any text as a robot, with <robot> around it where it does not begin so, to keep the mutations
// within the URDF reader.
#include <string>

#include "budget.h"
#include "world/load.h"
#include "world/model/body_layout.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const Budget budget;
  std::string text(reinterpret_cast<const char*>(data), size);
  if (text.find("<robot") == std::string::npos)
    text = "<robot name='r'><link name='base'/>" + text + "</robot>";
  try {
    const auto world = ruedo::world::load_world_text(text, "/nowhere/in/a/robot.urdf");
    const ruedo::world::BodyLayout layout(*world);
  } catch (const ruedo::InputError&) {
  }
  return 0;
}
