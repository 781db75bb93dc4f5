// A satellite navigation receiver: geodetic position, and velocity towards east, north and up, on
// ROBOT/NAVSAT.
//
// The world's frame is tangential to the ellipsoid at <spherical_coordinates>: positions are
// converted through ECEF (geodesy.h), so that the ground curves away below it, by 8 cm at 1 km.
// Noise is in metres and m/s, as in SDF: drawn separately for each horizontal direction and for the
// vertical one, in local axes. Satellites are not modelled: no outages, and every fix is good.
#include "ruedo/navsat_t.hpp"
#include "sensors/geodesy.h"
#include "sensors/mount.h"

namespace ruedo {
namespace {

const char* element_of(const SensorSetup& setup) {
  return !setup.element.has("navsat") && setup.element.has("gps") ? "gps" : "navsat";
}

std::array<std::string, 6> noise_paths(const std::string& element) {
  const std::string position = element + "/position_sensing/",
                    velocity = element + "/velocity_sensing/";
  return {position + "horizontal/noise", position + "horizontal/noise",
          position + "vertical/noise",   velocity + "horizontal/noise",
          velocity + "horizontal/noise", velocity + "vertical/noise"};
}

// The world's location: <spherical_coordinates>, or else what the receiver gives (hector's GPS
// plugin).
world::Environment place_of(const SensorSetup& setup) {
  constexpr double kDegree = M_PI / 180.0;
  world::Environment place = setup.world.environment;
  const Element* own = setup.element.child("ruedo:place");
  if (!own) return place;
  own->refuse_unknown(
      {"ruedo:latitude_deg", "ruedo:longitude_deg", "ruedo:elevation", "ruedo:heading_deg"});
  const Allowed angle = Allowed::any(quantity::kAngle);
  const double latitude = own->number("ruedo:latitude_deg", 0.0, Allowed::between(-90, 90)),
               longitude = own->number("ruedo:longitude_deg", 0.0, Allowed::between(-360, 360)),
               elevation = own->number("ruedo:elevation", 0.0, Allowed::any(quantity::kLength)),
               heading = own->number("ruedo:heading_deg", 0.0, angle);
  if (place.placed) {
    if (setup.findings)
      setup.findings->unsupported(own->source, "sensor " + setup.device,
                                  "its own place on Earth is not used: the world has "
                                  "<spherical_coordinates>");
    return place;
  }
  place.placed = true;
  place.latitude = kDegree * latitude;
  place.longitude = kDegree * longitude;
  place.elevation = elevation;
  place.heading = kDegree * heading;
  return place;
}

class NavSat : public SensorOf<NavSat> {
 public:
  explicit NavSat(const SensorSetup& setup)
      : mount_(setup),
        place_(place_of(setup)),
        globe_(place_),
        noises_(setup, noise_paths(element_of(setup))),
        channel_(setup.channel<navsat_t>()) {
    setup.element.refuse_unknown({"ruedo:phase", "ruedo:place"});
    const Element* own = setup.element.child(element_of(setup));
    name_what_does_not_act(setup, own, {"position_sensing", "velocity_sensing"});
    for (const char* part : {"position_sensing", "velocity_sensing"}) {
      if (own) name_what_does_not_act(setup, own->child(part), {"horizontal", "vertical"});
    }
    if (!place_.placed && setup.findings) {
      setup.findings->repaired(setup.element.source, "sensor " + setup.device,
                               "the world has no <spherical_coordinates>; it is taken to lie at "
                               "0 degrees north, 0 degrees east");
    }
  }

  void sample(const SampleInput& input, Outbox& out) override {
    constexpr double kDegrees = 180.0 / M_PI;
    const Geodetic ideal = globe_.geodetic(mount_.pose(input.snapshot).translation);
    const Vec3 velocity = globe_.east_north_up_at(ideal, mount_.twist(input.snapshot).linear);
    const auto m = noises_.apply({0, 0, 0, velocity.x(), velocity.y(), velocity.z()},
                                 input.snapshot.time, input.sample);
    Geodetic place = ideal;
    if (m[0] != 0.0 || m[1] != 0.0 || m[2] != 0.0) {
      const Vec3 off = east_north_up(ideal.latitude, ideal.longitude) * Vec3(m[0], m[1], m[2]);
      place = globe_.from_ecef(globe_.to_ecef(ideal) + off);
    }
    navsat_t message;
    message.utime = input.snapshot.time;
    message.latitude_deg = kDegrees * place.latitude;
    message.longitude_deg = kDegrees * place.longitude;
    message.altitude = place.altitude;
    std::copy(m.begin() + 3, m.end(), message.velocity);
    out.publish(channel_, message);
  }

  void shift_time(SimTime us) override { noises_.shift_time(us); }

  void exchange(StateArchive& archive) { archive(noises_); }

 private:
  Mount mount_;
  world::Environment place_;
  Globe globe_;
  Noises<6> noises_;  // east, north, up; of position, then velocity
  int channel_;
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"navsat", "gps"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {5, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<NavSat>(setup); },
     .kind = "navsat"}};

}  // namespace
}  // namespace ruedo
