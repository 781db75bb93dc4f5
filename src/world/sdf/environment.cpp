// <spherical_coordinates>, <atmosphere>, <wind> and <magnetic_field>.
#include "world/sdf/environment.h"

#include <cmath>

#include "world/compat/plugins.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

constexpr double kDegree = M_PI / 180.0;

// SDF's surface models; the moon's radii are those of Gazebo.
void read_surface(const Element& place, Environment& environment, Findings& findings) {
  constexpr const char* kAxes[] = {"surface_axis_equatorial", "surface_axis_polar"};
  const std::string surface =
      place.choice("surface_model", "EARTH_WGS84", {"EARTH_WGS84", "MOON_SCS", "CUSTOM_SURFACE"});
  if (surface == "MOON_SCS") {
    environment.equatorial_radius = 1738100.0;
    environment.polar_radius = 1736000.0;
  } else if (surface == "CUSTOM_SURFACE") {
    const Allowed radius = Allowed::between(1e3, 1e9);
    for (const char* axis : kAxes) {
      if (!place.has(axis))
        place.fail("a CUSTOM_SURFACE needs <" + std::string(axis) + ">, in metres");
    }
    environment.equatorial_radius = place.number("surface_axis_equatorial", 0.0, radius);
    environment.polar_radius = place.number("surface_axis_polar", 0.0, radius);
    return;
  }
  for (const char* axis : kAxes) {
    if (const Element* written = place.child(axis))
      findings.unsupported(written->source, "world/spherical_coordinates",
                           "<" + written->name + "> does nothing with the surface model " +
                               surface + "; it is for CUSTOM_SURFACE");
  }
}

void read_place(const Element& place, Environment& environment, Findings& findings) {
  report_other_children(
      place,
      {"surface_model", "surface_axis_equatorial", "surface_axis_polar", "world_frame_orientation",
       "latitude_deg", "longitude_deg", "elevation", "heading_deg"},
      {}, "world/spherical_coordinates", findings);
  Environment read = environment;
  read.placed = true;
  read_surface(place, read, findings);
  place.choice("world_frame_orientation", "ENU", {"ENU"});
  read.latitude = kDegree * place.number("latitude_deg", 0.0, Allowed::between(-90, 90));
  read.longitude = kDegree * place.number("longitude_deg", 0.0, Allowed::between(-360, 360));
  read.elevation = place.number("elevation", 0.0, Allowed::any(quantity::kLength));
  read.heading = kDegree * place.number("heading_deg", 0.0, Allowed::any(quantity::kAngle));
  environment = read;
}

void read_air(const Element& air, Environment& environment) {
  if (const std::string* type = air.attribute("type"); type && *type != "adiabatic")
    air.fail("type '" + *type + "' is not allowed; allowed is adiabatic");
  const Environment usual;
  const double temperature =
      air.number("temperature", usual.temperature, Allowed::between(1, 10'000));
  const double gradient =
      air.number("temperature_gradient", usual.temperature_gradient, Allowed::between(-1, 1));
  environment.pressure = air.number("pressure", usual.pressure, Allowed::between(1e-3, 1e9));
  environment.temperature = temperature;
  environment.temperature_gradient = gradient;
}

}  // namespace

void read_environment(const Element& world, Environment& environment, Findings& findings) {
  const auto part = [&](const char* name, const std::string& instead, const auto& read) {
    if (const Element* element = world.child(name))
      read_or_leave_out("world/" + element->name, instead, findings, [&] { read(*element); });
  };
  part("spherical_coordinates", "the world has no place on Earth",
       [&](const Element& place) { read_place(place, environment, findings); });
  part("atmosphere", "the air is the standard atmosphere",
       [&](const Element& air) { read_air(air, environment); });
  part("wind", "no wind blows", [&](const Element& wind) {
    environment.wind.velocity =
        wind.vector3("linear_velocity", Vec3::Zero(), Allowed::any(quantity::kSpeed));
  });
  const char* const field =
      world.has("magnetic_field") ? "magnetic_field" : "physics/magnetic_field";
  part(field, "the field is the usual one", [&](const Element& tesla) {
    environment.magnetic_field = tesla.as_vector3(Allowed::between(-100, 100));
  });
  for (const Element* plugin : world.all("plugin")) {
    const std::string kind = kind_of(*plugin).name;
    if (kind == "WindEffects" || kind == "WindPlugin")
      read_or_leave_out("world/plugin", "the wind pushes nothing", findings,
                        [&] { read_wind_plugin(*plugin, environment.wind, findings); });
  }
}

}  // namespace ruedo::world
