// What SDF 1.12 has in a <sensor>: the devices read that when a world is made.
#include <gtest/gtest.h>

#include "engine/world.h"
#include "sdf_elements.h"

namespace ruedo {
namespace {

TEST(SdfElements, NoneOfASensorIsSilent) {
  const auto of_sensors = [](const std::string& path) {
    return path.find("/sensor") != std::string::npos;
  };
  const auto load = [](const std::string& text, std::multiset<std::string>& found) {
    const auto world = model::load_world_text(text, "/nowhere/w.sdf");
    for (const Finding& finding : world->findings) found.insert(finding.text);
    engine::Channels channels;
    Findings of_devices;
    engine::FleetOptions options;
    options.keep_going = true;
    const engine::World made(world, options, channels, of_devices);
    for (const Finding& finding : of_devices.list()) found.insert(finding.text);
  };
  EXPECT_EQ(test::silent_ones(of_sensors, load), "");
}

}  // namespace
}  // namespace ruedo
