// Where the world lies, its air and its magnetic field.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "text_world.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(Environment, IsReadAsWritten) {
  const auto world = world_of(
      "<spherical_coordinates><surface_model>EARTH_WGS84</surface_model>"
      "<world_frame_orientation>ENU</world_frame_orientation><latitude_deg>45</latitude_deg>"
      "<longitude_deg>-90</longitude_deg><elevation>12.5</elevation><heading_deg>180"
      "</heading_deg></spherical_coordinates><atmosphere type='adiabatic'><temperature>300"
      "</temperature><temperature_gradient>-0.01</temperature_gradient><pressure>99000</pressure>"
      "</atmosphere><magnetic_field>1e-5 2e-5 -3e-5</magnetic_field>");
  EXPECT_THAT(texts(*world), IsEmpty());
  const Environment& e = world->environment;
  EXPECT_TRUE(e.placed);
  EXPECT_DOUBLE_EQ(e.latitude, M_PI / 4);
  EXPECT_DOUBLE_EQ(e.longitude, -M_PI / 2);
  EXPECT_EQ(e.elevation, 12.5);
  EXPECT_DOUBLE_EQ(e.heading, M_PI);
  EXPECT_EQ(e.equatorial_radius, 6378137.0);
  EXPECT_NEAR(e.polar_radius, 6356752.314245, 1e-6);
  EXPECT_EQ(e.temperature, 300);
  EXPECT_EQ(e.temperature_gradient, -0.01);
  EXPECT_EQ(e.pressure, 99000);
  EXPECT_EQ(*e.magnetic_field, Vec3(1e-5, 2e-5, -3e-5));
}

TEST(Environment, HasDefaults) {
  const auto world = world_of("");
  EXPECT_FALSE(world->environment.placed);
  EXPECT_FALSE(world->environment.magnetic_field);
  EXPECT_EQ(world->environment.pressure, 101325.0);
}

TEST(Environment, OtherGlobes) {
  EXPECT_EQ(world_of("<spherical_coordinates><surface_model>MOON_SCS</surface_model>"
                     "</spherical_coordinates>")
                ->environment.polar_radius,
            1736000.0);
  EXPECT_EQ(world_of("<spherical_coordinates><surface_model>CUSTOM_SURFACE</surface_model>"
                     "<surface_axis_equatorial>12000</surface_axis_equatorial>"
                     "<surface_axis_polar>10000</surface_axis_polar></spherical_coordinates>")
                ->environment.equatorial_radius,
            12000.0);
}

TEST(Environment, WarnsAboutAxesOfAnotherSurfaceModel) {
  const std::string axes =
      "<surface_axis_equatorial>12000</surface_axis_equatorial>"
      "<surface_axis_polar>10000</surface_axis_polar>";
  const auto of = [&](const std::string& inside) {
    return texts(*world_of("<spherical_coordinates>" + inside + "</spherical_coordinates>"));
  };
  EXPECT_THAT(of("<surface_model>CUSTOM_SURFACE</surface_model>" + axes), IsEmpty());
  const std::string nothing =
      " does nothing with the surface model EARTH_WGS84; it is for CUSTOM_SURFACE";
  EXPECT_THAT(of(axes),
              ElementsAre("<surface_axis_equatorial>" + nothing, "<surface_axis_polar>" + nothing));
  EXPECT_THAT(of("<latitude>3</latitude>"),
              ElementsAre("<latitude> is not supported and left out"));
}

TEST(Environment, OldFilesHaveTheFieldInTheirPhysics) {
  const auto world =
      world_of("<physics type='ode'><magnetic_field>0 0 1e-5</magnetic_field></physics>");
  EXPECT_EQ(*world->environment.magnetic_field, Vec3(0, 0, 1e-5));
}

// Faulty elements are reported and left out; the world still loads.
TEST(Environment, ReportsInvalidElements) {
  struct Case {
    const char* inside;
    const char* error;
  };
  for (const Case& c :
       {Case{"<spherical_coordinates><latitude_deg>95</latitude_deg></spherical_coordinates>",
             "<spherical_coordinates/latitude_deg>: '95' is not allowed"},
        Case{"<spherical_coordinates><surface_model>MARS</surface_model></spherical_coordinates>",
             "'MARS' is not allowed"},
        Case{"<spherical_coordinates><surface_model>CUSTOM_SURFACE</surface_model>"
             "</spherical_coordinates>",
             "needs <surface_axis_equatorial>"},
        Case{"<spherical_coordinates><world_frame_orientation>NED</world_frame_orientation>"
             "</spherical_coordinates>",
             "'NED' is not allowed"},
        Case{"<atmosphere type='stormy'/>", "type 'stormy' is not allowed; allowed is adiabatic"},
        Case{"<atmosphere><temperature>-3</temperature></atmosphere>", "'-3' is not allowed"},
        Case{"<magnetic_field>1 2</magnetic_field>", "'1 2'"}}) {
    const auto world = world_of(c.inside);
    EXPECT_THAT(texts(*world), ElementsAre(HasSubstr(c.error))) << c.inside;
    EXPECT_FALSE(world->environment.placed);
  }
}

}  // namespace
}  // namespace ruedo::world
