// The elements of SDF 1.12 outside of its sensors.
#include "sdf_elements.h"

#include <gtest/gtest.h>

namespace ruedo::world {
namespace {

TEST(SdfElements, EveryElementOfAWorldActsOrIsReported) {
  const auto of_the_world = [](const std::string& path) {
    return path.find("/sensor") == std::string::npos;
  };
  const auto load = [](const std::string& text, std::multiset<std::string>& found) {
    const auto world = load_world_text(text, "/nowhere/w.sdf");
    for (const Finding& finding : world->findings) found.insert(finding.text);
  };
  ASSERT_GT(test::rows().size(), 1000u);
  EXPECT_EQ(test::silent_ones(of_the_world, load), "");
}

}  // namespace
}  // namespace ruedo::world
