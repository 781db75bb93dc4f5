// An inertial measurement unit: gyroscope and accelerometer with noise, bias and drifting bias as
// in SDF's <imu>, on ROBOT/IMU.
//
// Ideal values, in the device's frame S at p = p_BS in the body B: the gyroscope measures omega;
// the accelerometer the specific force a_S - g, with a_S = a_B + alpha x p + omega x (omega x p).
// a_B comes from the snapshot; alpha is the change of omega over the last step. At rest it measures
// gravity upwards, on a ramp along the ramp's axes. A wheel that is part of B rotates the device
// about its hub H: the same formula from B to H, then from H to S with the wheel's own omega.
#include "ruedo/bound.h"
#include "ruedo/imu_t.hpp"
#include "ruedo/sensor.h"
#include "sensors/noise.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

class Imu : public SensorOf<Imu> {
 public:
  explicit Imu(const SensorSetup& setup)
      : random_(setup.random),
        gravity_(setup.world.gravity),
        channel_(setup.channel<imu_t>()),
        layout_(setup.layout) {
    const world::LinkPlacement& link = setup.layout.links[setup.link];
    body_ = link.body;
    X_LS_ = setup.X_LS;
    X_BS_ = link.X_BL * X_LS_;
    if (body_.valid() && link.wheel.valid()) {
      on_wheel_ = true;
      link_ = setup.link;
      wheel_ = link.wheel;
      const world::WheelPlacement& wheel = layout_->wheels[wheel_];
      const Pose& X_BWheel = layout_->links[wheel.link].X_BL;
      hub_B_ = X_BWheel * wheel.center_in_L;
      axis_B_ = X_BWheel.rotation * wheel.axis_in_L;
    }
    setup.element.refuse_unknown({"ruedo:phase"});  // read by the server
    if (const Element* imu = setup.element.child("imu")) configure(*imu, setup);
  }

  // To compute alpha.
  bool observes() const override { return body_.valid(); }

  void observe(const Snapshot& now, Outbox&) override {
    const Vec3& of_body = now.body_twists[body_].angular;
    const Vec3 omega = of_body + of_wheel(now);
    if (time_ >= 0 && now.time > time_) {
      const double dt_s = 1e-6 * static_cast<double>(now.time - time_);
      alpha_ = (omega - omega_before_) / dt_s;
      alpha_of_body_ = (of_body - omega_of_body_before_) / dt_s;
    }
    omega_before_ = omega;
    omega_of_body_before_ = of_body;
    time_ = now.time;
  }

  void shift_time(SimTime us) override {
    time_ -= us;
    sample_time_ -= us;
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Snapshot& now = input.snapshot;
    Pose X_WS = X_BS_;
    Vec3 omega = Vec3::Zero(), acceleration = Vec3::Zero();  // of S, expressed in the world
    if (body_.valid()) {
      const Pose& X_WB = now.bodies[body_];
      const Pose X_BS = on_wheel_ ? layout_->link_in_body(link_, now.wheel_angles) * X_LS_ : X_BS_;
      X_WS = X_WB * X_BS;
      acceleration = now.body_accelerations[body_];
      omega = now.body_twists[body_].angular;
      if (on_wheel_) {
        const Vec3 hub = X_WB.rotation * hub_B_;
        acceleration += alpha_of_body_.cross(hub) + omega.cross(omega.cross(hub));
        omega += of_wheel(now);
      }
      const Vec3 arm = X_WB.rotation * Vec3(X_BS.translation - hub_B_);
      acceleration += alpha_.cross(arm) + omega.cross(omega.cross(arm));
    }
    const Quat R_SW = X_WS.rotation.conjugate();
    const Vec3 rate = R_SW * omega;
    const Vec3 force = R_SW * (acceleration - gravity_);

    const double dt_s = sampled_ ? 1e-6 * static_cast<double>(now.time - sample_time_) : 0.0;
    sampled_ = true;
    sample_time_ = now.time;
    RandomStream stream = random_.stream(static_cast<uint64_t>(input.sample));
    imu_t message;
    message.utime = now.time;
    for (int i = 0; i < 3; ++i)
      message.angular_velocity[i] = gyroscope_[i].apply(rate[i], dt_s, stream);
    for (int i = 0; i < 3; ++i)
      message.linear_acceleration[i] = accelerometer_[i].apply(force[i], dt_s, stream);
    const Quat q = turned_ ? R_EnuW_ * X_WS.rotation : X_WS.rotation;
    const double orientation[4] = {q.w(), q.x(), q.y(), q.z()};
    for (int i = 0; i < 4; ++i) message.orientation[i] = has_orientation_ ? orientation[i] : 0.0;
    out.publish(channel_, message);
  }

  void exchange(StateArchive& archive) {
    archive(gyroscope_, accelerometer_, time_, sample_time_, sampled_, omega_before_, alpha_,
            omega_of_body_before_, alpha_of_body_);
  }

 private:
  // rad/s, world: the wheel's rotation relative to the body.
  Vec3 of_wheel(const Snapshot& now) const {
    if (!on_wheel_) return Vec3::Zero();
    return now.bodies[body_].rotation * (now.wheel_rates[wheel_] * axis_B_);
  }

  void configure(const Element& imu, const SensorSetup& setup) {
    has_orientation_ = imu.boolean("enable_orientation", true);
    if (const Element* frame = imu.child("orientation_reference_frame")) {
      const bool by_compass = frame->string("localization", "CUSTOM") == "ENU";
      const double heading = setup.world.environment.heading;
      turned_ = by_compass && heading != 0.0;
      if (turned_) R_EnuW_ = Quat(Eigen::AngleAxisd(heading, Vec3::UnitZ()));
      if (setup.findings && !by_compass) {
        setup.findings->unsupported(
            frame->source, "sensor " + setup.device + "/imu/orientation_reference_frame",
            "the orientation is that of the device in the world (east, north, up)");
      }
    }
    constexpr const char* kAxes[3] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i) {
      gyroscope_[i] = Noise(imu.child(std::string("angular_velocity/") + kAxes[i] + "/noise"));
      accelerometer_[i] =
          Noise(imu.child(std::string("linear_acceleration/") + kAxes[i] + "/noise"));
    }
    // SDF up to 1.4: one <noise> with <rate> and <accel> for all axes.
    if (const Element* old = imu.child("noise")) {
      const std::string type = old->choice("type", "none", {"none", "gaussian"});
      for (int i = 0; i < 3 && type == "gaussian"; ++i) {
        if (const Element* rate = old->child("rate"))
          gyroscope_[i] = Noise::from_parameters(*rate, false);
        if (const Element* accel = old->child("accel"))
          accelerometer_[i] = Noise::from_parameters(*accel, false);
      }
    }
    RandomStream constants = random_.stream(kConstantDraws);
    for (Noise* noise : {&gyroscope_[0], &gyroscope_[1], &gyroscope_[2], &accelerometer_[0],
                         &accelerometer_[1], &accelerometer_[2]}) {
      if (!setup.noise) *noise = Noise();
      noise->draw_bias(constants);
    }
  }

  RandomSource random_;
  Vec3 gravity_;
  int channel_;
  BodyIndex body_;    // none: does not move
  Pose X_LS_, X_BS_;  // X_BS_: X_WS when it does not move
  Bound<const world::BodyLayout> layout_;
  bool on_wheel_ = false;  // a wheel of that body turns the device
  LinkIndex link_;
  WheelIndex wheel_;
  Vec3 hub_B_ = Vec3::Zero(), axis_B_ = Vec3::Zero();  // p_BH; unit
  bool has_orientation_ = true;
  bool turned_ = false;  // the orientation is that in R_EnuW_'s frame: x is east, not the world's x
  Quat R_EnuW_ = Quat::Identity();
  Noise gyroscope_[3], accelerometer_[3];

  SimTime time_ = -1, sample_time_ = 0;
  bool sampled_ = false;
  Vec3 omega_before_ = Vec3::Zero(), alpha_ = Vec3::Zero();  // rad/s, rad/s^2, world
  Vec3 omega_of_body_before_ = Vec3::Zero(), alpha_of_body_ = Vec3::Zero();
};

const RegisterSensor kRegister{
    {.module = "imu",
     .order = 5,
     .types = {"imu"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {100, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<Imu>(setup); }}};

}  // namespace
}  // namespace ruedo
