// A barometer: the air pressure at the device, on ROBOT/BAROMETER, by the standard atmosphere
// (air.h). Its height above sea level is its z in the world plus <reference_altitude>, or plus the
// world's elevation if there is none. The flow around the robot has no effect.
#include "ruedo/air_pressure_t.hpp"
#include "ruedo/bound.h"
#include "sensors/air.h"
#include "sensors/mount.h"

namespace ruedo {
namespace {

class AirPressure : public SensorOf<AirPressure> {
 public:
  explicit AirPressure(const SensorSetup& setup)
      : environment_(setup.world.environment),
        mount_(setup),
        noises_(setup, {"air_pressure/pressure/noise"}),
        channel_(setup.channel<air_pressure_t>()) {
    setup.element.refuse_unknown({"ruedo:phase"});
    name_what_does_not_act(setup, setup.element.child("air_pressure"),
                           {"reference_altitude", "pressure"});
    origin_m_ = setup.element.number("air_pressure/reference_altitude", environment_->elevation,
                                     Allowed::any(quantity::kLength));
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const double altitude = origin_m_ + mount_.pose(input.snapshot).translation.z();
    air_pressure_t message;
    message.utime = input.snapshot.time;
    message.pressure = noises_.apply({air_at(environment_, altitude).pressure}, input.snapshot.time,
                                     input.sample)[0];
    out.publish(channel_, message);
  }

  void shift_time(SimTime us) override { noises_.shift_time(us); }

  void exchange(StateArchive& archive) { archive(noises_); }

 private:
  Bound<const world::Environment> environment_;
  Mount mount_;
  Noises<1> noises_;
  double origin_m_ = 0.0;  // of the world's z = 0, above sea level
  int channel_;
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"air_pressure"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {20, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<AirPressure>(setup); },
     .kind = "air_pressure"}};

}  // namespace
}  // namespace ruedo
