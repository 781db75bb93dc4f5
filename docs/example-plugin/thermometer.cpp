// A thermometer on ROBOT/SENSOR: a heater in the room warms what it shines on.
//
// Model: ambient + power / (1 + d^2) for a device d metres from the heater that it can see, ambient
// else; SDF's <noise> on it.
#include <ruedo/sensor.h>

#include "example/thermometer_t.hpp"
#include "scene/rays/ray_scene.h"
#include "sensors/noise.h"
#include "world/model/body_layout.h"

namespace {

using namespace ruedo;

class Thermometer : public SensorOf<Thermometer> {
 public:
  explicit Thermometer(const SensorSetup& setup)
      : random_(setup.random),
        channel_(setup.channel<example::thermometer_t>()),
        link_(setup.link),
        ambient_(
            setup.element.number("thermometer/ambient", 20.0, Allowed::between(-100.0, 1000.0))),
        power_(setup.element.number("thermometer/power", 0.0, Allowed::between(0.0, 1e6))),
        heater_(setup.element.vector3("thermometer/heater", Vec3::Zero(),
                                      Allowed::any(quantity::kLength))),
        noise_(setup.noise ? Noise(setup.element.child("thermometer/noise")) : Noise()) {
    const world::LinkPlacement& link = setup.layout.links[setup.link];
    body_ = link.body;
    X_BS_ = link.X_BL * setup.X_LS;
    RandomStream constants = random_.stream(kConstantDraws);
    noise_.draw_bias(constants);
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Pose X_WB = body_.valid() ? input.snapshot.bodies[body_] : Pose{};
    const Vec3 place = X_WB * X_BS_.translation, way = heater_ - place;
    const double distance = way.norm();
    const bool warmed =
        distance == 0.0 || !input.rays->cast({place, way / distance, distance}, link_).hit();
    example::thermometer_t message;
    message.utime = input.snapshot.time;
    message.warmed = warmed;
    RandomStream stream = random_.stream(static_cast<uint64_t>(input.sample));
    message.temperature =
        noise_.apply(ambient_ + (warmed ? power_ / (1.0 + distance * distance) : 0.0), 0.0, stream);
    out.publish(channel_, message);
  }

  // For snapshots in files.
  void exchange(StateArchive& archive) { archive(noise_); }

 private:
  RandomSource random_;
  int channel_;
  LinkIndex link_;
  double ambient_, power_;  // degrees Celsius; degrees Celsius m^2
  Vec3 heater_;             // m, world
  Noise noise_;
  BodyIndex body_;  // none: it does not move
  Pose X_BS_;       // the device in its body
};

const RegisterSensor kRegister{
    {.module = "thermometer",
     .order = 100,
     .types = {"thermometer"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {10, 1},
     .needs_rays = true,
     .make = [](const SensorSetup& setup) { return std::make_unique<Thermometer>(setup); }}};

}  // namespace
