// Degrees in place of radians are reported with their line; other values are not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "text_world.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kRadians = " reads as degrees, and is taken as radians, which angles are: ";

std::vector<std::string> of_pose(const std::string& attributes, const std::string& text) {
  return texts(*world_of("<model name='m'><link name='l'><pose" + attributes + ">" + text +
                         "</pose></link></model>"));
}

std::vector<std::string> of_joint(const std::string& type, const std::string& lower,
                                  const std::string& upper) {
  return texts(
      *world_of("<model name='m'><link name='a'/><link name='b'/><joint name='j' type='" + type +
                "'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz><limit><lower>" + lower +
                "</lower><upper>" + upper + "</upper></limit></axis></joint></model>"));
}

TEST(Degrees, WarnWithTheLineOfAPose) {
  const auto world =
      world_of("\n<model name='m'>\n<link name='l'>\n<pose>0 0 0.5 0 0 90</pose></link></model>");
  ASSERT_EQ(world->findings.size(), 1u);
  const Finding& finding = world->findings[0];
  EXPECT_EQ(finding.source.line, 4);
  EXPECT_EQ(finding.source.file, "/nowhere/world.sdf");
  EXPECT_EQ(finding.element, "world w/model m/link l");
  EXPECT_EQ(finding.text, std::string("the rotation of <pose>0 0 0.5 0 0 90</pose>") + kRadians +
                              "write radians or degrees=\"true\"");
  EXPECT_EQ(of_pose("", "1 2 3 -45 0 0").size(), 1u);
  EXPECT_EQ(of_pose("", "1 2 3 0 1e1 0").size(), 1u);
}

TEST(Degrees, NoWarningForDeclaredDegreesAndRadians) {
  for (const char* degrees : {" degrees='true'", " degrees='1'", " degrees='True'"})
    EXPECT_THAT(of_pose(degrees, "0 0 0.5 0 0 90"), IsEmpty()) << degrees;
  EXPECT_EQ(of_pose(" degrees='false'", "0 0 0.5 0 0 90").size(), 1u);
  EXPECT_THAT(of_pose(" rotation_format='quat_xyzw'", "90 45 10 0 0 0 1"), IsEmpty());
  // Positions may be any number; a turn is 6.28 rad, and multiples of 5 below it are plausible.
  for (const char* text : {"90 45 180 0 0 0", "0 0 0 5 -5 0", "0 0 0 0 0 6.283185307179586",
                           "0 0 0 0 0 7.853981633974483", "0 0 0 0 0 91.5", "0 0 0 0 0 7"})
    EXPECT_THAT(of_pose("", text), IsEmpty()) << text;
}

TEST(Degrees, WarnForLimitsOfRevoluteJointsOnly) {
  EXPECT_THAT(of_joint("revolute", "-180", "135"),
              ElementsAre(std::string("<lower>-180</lower>") + kRadians + "write radians",
                          std::string("<upper>135</upper>") + kRadians + "write radians"));
  EXPECT_THAT(of_joint("prismatic", "-180", "135"), IsEmpty());
  // Limits that do not look like degrees.
  for (const char* far : {"1e16", "1000", "100", "50", "10", "360.5", "3.14", "inf"})
    EXPECT_THAT(of_joint("revolute", std::string("-") + far, far), IsEmpty()) << far;
}

TEST(Degrees, WarnInAUrdf) {
  const auto world = load_world_text(
      R"(<robot name="r"><link name="a"/><link name="b"/><link name="c"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<origin xyz="90 0 0" rpy="0 0 90"/>
<limit lower="-90" upper="1.57" effort="100" velocity="180"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="c"/>
<limit lower="-90" upper="90" effort="1" velocity="1"/></joint></robot>)",
      "/nowhere/r.urdf");
  std::vector<std::string> found;
  std::vector<int> lines;
  for (const Finding& finding : world->findings) {
    if (finding.text.find("degrees") == std::string::npos) continue;
    found.push_back(finding.text);
    lines.push_back(finding.source.line);
    EXPECT_EQ(finding.element, "joint j");
  }
  EXPECT_THAT(found,
              ElementsAre(std::string("rpy=\"0 0 90\"") + kRadians + "write radians",
                          std::string("lower=\"-90\" of <limit>") + kRadians + "write radians"));
  EXPECT_THAT(lines, ElementsAre(3, 4));
}

}  // namespace
}  // namespace ruedo::world
