// A Pitot tube: the differential pressure rho v |v| / 2 of air flowing along the device's x axis at
// v, and the air temperature, on ROBOT/AIRSPEED. Density and temperature follow the standard
// atmosphere (air.h). The air moves with the world's wind (robot/wind.h).
#include <cmath>
#include "ruedo/bound.h"

#include "ruedo/air_speed_t.hpp"
#include "sensors/air.h"
#include "sensors/mount.h"

namespace ruedo {
namespace {

// gz-sim reads <pressure>; SDF's documentation has <airspeed>.
std::array<std::string, 1> noise_path(const SensorSetup& setup) {
  const bool older = setup.element.has("air_speed/airspeed/noise") &&
                     !setup.element.has("air_speed/pressure/noise");
  return {older ? "air_speed/airspeed/noise" : "air_speed/pressure/noise"};
}

class AirSpeed : public SensorOf<AirSpeed> {
 public:
  explicit AirSpeed(const SensorSetup& setup)
      : environment_(setup.world.environment),
        mount_(setup),
        noises_(setup, noise_path(setup)),
        channel_(setup.channel<air_speed_t>()) {
    setup.element.refuse_unknown({"ruedo:phase"});
    name_what_does_not_act(setup, setup.element.child("air_speed"), {"pressure", "airspeed"});
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Pose X_WS = mount_.pose(input.snapshot);
    const Air air = air_at(environment_, environment_->elevation + X_WS.translation.z());
    const Vec3 ahead = X_WS.rotation * Vec3::UnitX();
    const double v = (mount_.twist(input.snapshot).linear - input.snapshot.wind).dot(ahead);
    air_speed_t message;
    message.utime = input.snapshot.time;
    message.differential_pressure =
        noises_.apply({0.5 * air.density * v * std::abs(v)}, input.snapshot.time, input.sample)[0];
    message.temperature = air.temperature;
    out.publish(channel_, message);
  }

  void shift_time(SimTime us) override { noises_.shift_time(us); }

  void exchange(StateArchive& archive) { archive(noises_); }

 private:
  Bound<const world::Environment> environment_;
  Mount mount_;
  Noises<1> noises_;
  int channel_;
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"air_speed"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {20, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<AirSpeed>(setup); },
     .kind = "air_speed"}};

}  // namespace
}  // namespace ruedo
