// A magnetometer: the magnetic field in the device's frame, on ROBOT/MAGNETOMETER.
//
// The field is the sensor's own <ruedo:magnetic_field>, or else the world's <magnetic_field>. If
// the file has neither, but gives the world's location, it is the earth's centred dipole with the
// coefficients of IGRF-13 for 2020: V = a (a/r)^2 (g . r^), B = -grad V = (a/r)^3 (3 (g . r^) r^ -
// g). That is accurate to about a fifth of the field and to 10 degrees of declination in most
// places. Anomalies, and iron and motors of the robot, are not modelled. Without a location it is
// SDF's default, (5.5645, 22.8758, -42.3884) uT in the world's axes.
#include "ruedo/magnetometer_t.hpp"
#include "sensors/geodesy.h"
#include "sensors/mount.h"

namespace ruedo {
namespace {

constexpr double kReferenceRadius = 6371200.0;           // m, of IGRF
const Vec3 kDipole(-1450.9e-9, 4652.5e-9, -29404.8e-9);  // T: g11, h11, g10 of IGRF-13, 2020
const Vec3 kUsual(5.5645e-6, 22.8758e-6, -42.3884e-6);   // T, SDF's default

std::array<std::string, 3> noise_paths() {
  return {"magnetometer/x/noise", "magnetometer/y/noise", "magnetometer/z/noise"};
}

class Magnetometer : public SensorOf<Magnetometer> {
 public:
  explicit Magnetometer(const SensorSetup& setup)
      : environment_(setup.world.environment),
        mount_(setup),
        globe_(environment_),
        noises_(setup, noise_paths()),
        channel_(setup.channel<magnetometer_t>()) {
    setup.element.refuse_unknown({"ruedo:phase", "ruedo:magnetic_field"});
    if (setup.element.has("ruedo:magnetic_field"))
      environment_.magnetic_field = setup.element.vector3("ruedo:magnetic_field", Vec3::Zero(),
                                                          Allowed::any(quantity::kFactor));
    name_what_does_not_act(setup, setup.element.child("magnetometer"), {"x", "y", "z"});
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Pose X_WS = mount_.pose(input.snapshot);
    const Vec3 ideal = X_WS.rotation.conjugate() * field_at(X_WS.translation);
    const auto measured =
        noises_.apply({ideal.x(), ideal.y(), ideal.z()}, input.snapshot.time, input.sample);
    magnetometer_t message;
    message.utime = input.snapshot.time;
    std::copy(measured.begin(), measured.end(), message.field);
    out.publish(channel_, message);
  }

  void shift_time(SimTime us) override { noises_.shift_time(us); }

  void exchange(StateArchive& archive) { archive(noises_); }

 private:
  Vec3 field_at(const Vec3& p_W) const {  // T, in the world's axes
    if (environment_.magnetic_field) return *environment_.magnetic_field;
    if (!environment_.placed) return kUsual;
    const Vec3 p = globe_.to_ecef(p_W);
    const double r = p.norm(), ratio = kReferenceRadius / r;
    const Vec3 up = p / r;
    return globe_.in_world(ratio * ratio * ratio * (3.0 * kDipole.dot(up) * up - kDipole));
  }

  world::Environment environment_;
  Mount mount_;
  Globe globe_;
  Noises<3> noises_;
  int channel_;
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"magnetometer"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {50, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<Magnetometer>(setup); },
     .kind = "magnetometer"}};

}  // namespace
}  // namespace ruedo
