// An altimeter: vertical distance from the start and vertical speed of the device, on
// ROBOT/ALTIMETER.
#include "ruedo/altimeter_t.hpp"
#include "sensors/mount.h"

namespace ruedo {
namespace {

class Altimeter : public SensorOf<Altimeter> {
 public:
  explicit Altimeter(const SensorSetup& setup)
      : mount_(setup),
        start_m_(mount_.start().translation.z()),
        noises_(setup, {"altimeter/vertical_position/noise", "altimeter/vertical_velocity/noise"}),
        channel_(setup.channel<altimeter_t>()) {
    setup.element.refuse_unknown({"ruedo:phase"});
    name_what_does_not_act(setup, setup.element.child("altimeter"),
                           {"vertical_position", "vertical_velocity"});
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Snapshot& now = input.snapshot;
    const auto measured =
        noises_.apply({mount_.pose(now).translation.z() - start_m_, mount_.twist(now).linear.z()},
                      now.time, input.sample);
    altimeter_t message;
    message.utime = now.time;
    message.altitude = measured[0];
    message.velocity = measured[1];
    out.publish(channel_, message);
  }

  void shift_time(SimTime us) override { noises_.shift_time(us); }

  void exchange(StateArchive& archive) { archive(noises_); }

 private:
  Mount mount_;
  double start_m_;  // the world's z of the device at the start
  Noises<2> noises_;
  int channel_;
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"altimeter"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {20, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<Altimeter>(setup); },
     .kind = "altimeter"}};

}  // namespace
}  // namespace ruedo
