// Odometry: the pose that a robot computes from its wheel encoders, on ROBOT/odometry, and its
// velocity with covariances on ROBOT/odometry/twist. Models the encoders and the robot's estimate
// with their errors: ticks, wrap-around, slip, wrong radius, wrong track.
//
// The wheels are read at every step. With s_l and s_r the way of the left and right wheels in a
// step (the mean of a side's wheels, times the radius that the robot believes in), d = (s_l + s_r)
// / 2 and turn = (s_r - s_l) / track:
// - arc: the robot moved on the circle through both, d sin(turn/2) / (turn/2) along heading theta +
// turn/2. Exact
//   while v/omega is constant in a step: straight, on the spot, on a circle, ramps of them
//   included. Where v and omega ramp independently, at a and alpha, a step leaves (v alpha - a
//   omega) dt^3 / 12 to the side: 2e-9 m for 0.3 m/s^2 at 0.5 rad/s and 5 ms.
// - trapezoid: eqs. 4 to 8 of Hernandez-Belmonte et al., ROSSUM 2011, with omega from the
// difference of the wheel
//   rates (the printed eq. 4 has their sum): speeds at both ends of the step, averaged. It leaves
//   v omega^2 dt^3 / 12 a step, 5e-10 m at 0.2 m/s, 0.5 rad/s and 5 ms.
// Other drives take the arc, with what world/model/base_odometry.h makes of their wheels.
//
// The velocity's covariance holds what is drawn at random: slip, and the ticks between which a
// wheel stood at both ends of the interval (variance of a difference of two uniform errors, tick^2
// / 6).
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "base/math/sincos.h"
#include "base/whole.h"
#include "ruedo/math.h"
#include "ruedo/odometry_t.hpp"
#include "ruedo/odometry_twist_t.hpp"
#include "ruedo/sensor.h"
#include "world/model/base_odometry.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

struct Configuration {
  bool trapezoid = false;
  int64_t ticks_per_turn = 0;           // 0: ideal
  int counter_bits = 0;                 // 0: 64
  double radius_error[2] = {0.0, 0.0};  // left, right; relative
  double track_error = 0.0;             // relative
  double slip_noise = 0.0;              // sqrt(m)
  double steering_error = 0.0;          // rad, added to the reading of the steering encoder

  explicit Configuration(const Element& element) {
    element.refuse_unknown({"ruedo:rate", "ruedo:integrator", "ruedo:ticks_per_turn",
                            "ruedo:counter_bits", "ruedo:radius_error", "ruedo:track_error",
                            "ruedo:slip_noise", "ruedo:steering_error"});
    trapezoid = element.choice("ruedo:integrator", "arc", {"arc", "trapezoid"}) == "trapezoid";
    ticks_per_turn = element.integer("ruedo:ticks_per_turn", 0, Allowed::between(0, 1e9));
    counter_bits =
        static_cast<int>(element.integer("ruedo:counter_bits", 0, Allowed::between(0, 62)));
    if (counter_bits > 0 && ticks_per_turn == 0) {
      element.child("ruedo:counter_bits")
          ->fail("needs <ruedo:ticks_per_turn>: ideal encoders do not wrap");
    }
    if (const Element* errors = element.child("ruedo:radius_error")) {
      const std::vector<double> values = errors->as_numbers(Allowed::any(quantity::kFactor));
      if (values.size() != 2 || values[0] <= -1.0 || values[1] <= -1.0) {
        errors->fail("'" + errors->text +
                     "' is not allowed; allowed are two numbers above -1, for left and right");
      }
      radius_error[0] = values[0];
      radius_error[1] = values[1];
    }
    track_error =
        element.number("ruedo:track_error", 0.0,
                       {.min = -1.0, .min_excluded = true, .quantity = &quantity::kFactor});
    slip_noise = element.number("ruedo:slip_noise", 0.0, Allowed::not_negative(quantity::kNoise));
    steering_error = element.number("ruedo:steering_error", 0.0, Allowed::between(-1.5, 1.5));
  }
};

double square(double x) { return x * x; }

// sin(x) / x
double sinc(double x) {
  const double x2 = x * x;
  return x2 < 1e-4 ? 1.0 - x2 / 6.0 * (1.0 - x2 / 20.0) : math::sin(x) / x;
}

class Odometry : public SensorOf<Odometry> {
 public:
  explicit Odometry(const SensorSetup& setup)
      : configuration_(setup.element),
        random_(setup.random),
        robot_(setup.robot_index),
        channel_(setup.channel<odometry_t>()),
        twist_channel_(setup.channel<odometry_twist_t>("twist")) {
    const world::RobotPlacement& robot = setup.layout.robots[robot_];
    const world::DriveDescription& drive = *setup.world.models[robot.instance].model->drive;
    if (!setup.noise) configuration_.slip_noise = 0.0;
    radius_ = drive.wheel_radius;
    track_ = drive.track * (1.0 + configuration_.track_error);
    for (const WheelIndex wheel : robot.wheels) {
      const world::WheelPlacement& placement = setup.layout.wheels[wheel];
      const int side = placement.left ? 0 : 1;
      wheels_.push_back({wheel, side, placement.steers});
      if (!placement.steers) ++wheels_of_side_[side];
    }
    if (world::BaseOdometry::is_for(drive))
      base_.emplace(setup.layout, robot_, drive, configuration_.track_error,
                    configuration_.steering_error);
    message_.n = static_cast<int32_t>(wheels_.size());
    message_.angle.resize(wheels_.size());
    message_.rate.resize(wheels_.size());
    message_.ticks.resize(wheels_.size());
  }

  bool observes() const override { return true; }

  void observe(const Snapshot& now, Outbox&) override {
    const RobotState& robot = now.robots[robot_];
    if (time_ < 0) {
      for (Wheel& wheel : wheels_) start(wheel, now);
      X_WBase_ = robot.X_WBase;
      side_rates(speed_before_);
    } else if (now.time > time_) {
      const double dt_s = 1e-6 * static_cast<double>(now.time - time_);
      if (base_) slip_variance_ = Vec3::Zero();  // its velocity is that of the last step
      turn_wheels(now, dt_s);
      if (base_)
        integrate_base(now, dt_s);
      else
        configuration_.trapezoid ? integrate_trapezoid(dt_s) : integrate_arc();
    }
    time_ = now.time;
    if (robot.odometry_resets != resets_) {
      resets_ = robot.odometry_resets;
      x_ = y_ = theta_ = 0.0;
    }
  }

  void shift_time(SimTime us) override {
    time_ -= us;
    sample_time_ -= us;
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const double period_s = 1e-6 * static_cast<double>(input.snapshot.time - sample_time_);
    double speed[2] = {0.0, 0.0};
    for (size_t i = 0; i < wheels_.size(); ++i) {
      Wheel& wheel = wheels_[i];
      // Within a step, ticks and slip make the rate meaningless: it is the mean since the last
      // sample.
      double rate = wheel.rate;
      if (configuration_.ticks_per_turn > 0 || configuration_.slip_noise > 0.0)
        rate = period_s > 0.0 ? (wheel.measured - wheel.sampled) / period_s : 0.0;
      wheel.sampled = wheel.measured;
      message_.angle[i] = wheel.measured;
      message_.rate[i] = rate;
      message_.ticks[i] = wheel.counter;
      if (!wheel.steers) speed[wheel.side] += rate * believed_radius(wheel.side);
    }
    for (int side : {0, 1}) speed[side] /= std::max(1, wheels_of_side_[side]);
    const Vec3 twist =
        base_ ? rate_ : Vec3(0.5 * (speed[0] + speed[1]), 0.0, (speed[1] - speed[0]) / track_);
    publish_twist(input.snapshot.time, twist, base_ ? step_s_ : period_s, out);
    sample_time_ = input.snapshot.time;
    message_.utime = input.snapshot.time;
    message_.x = x_;
    message_.y = y_;
    message_.theta = theta_;
    message_.v = twist.x();
    message_.omega = twist.z();
    message_.resets = resets_;
    out.publish(channel_, message_);
  }

  void exchange(StateArchive& archive) {
    archive.each(wheels_);
    if (base_) archive(*base_);
    archive(X_WBase_, rate_, ways_, angles_, time_, sample_time_, x_, y_, theta_, speed_before_,
            resets_, slip_variance_, step_s_);
  }

 private:
  struct Wheel {
    WheelIndex index;
    int side;                 // 0 left, 1 right
    bool steers;              // its angle is that of steering
    double true_angle = 0.0;  // rad
    double slipped = 0.0;     // rad, the total that slip added to the encoder's angle
    int64_t counter = 0;      // as shown by the encoder, wrapped
    int64_t ticks = 0;        // as unwrapped by the robot
    double measured = 0.0;    // rad since the start
    double rate = 0.0;        // rad/s
    double turned = 0.0;      // rad, measured in the last step
    double sampled = 0.0;     // rad, at the last sample
  };

  double believed_radius(int side) const {
    return radius_ * (1.0 + configuration_.radius_error[side]);
  }

  void start(Wheel& wheel, const Snapshot& now) const {
    wheel.true_angle = now.wheel_angles[wheel.index];
    wheel.rate = now.wheel_rates[wheel.index];
    if (configuration_.ticks_per_turn > 0) {
      wheel.counter = wrapped(count(wheel.true_angle));
      wheel.ticks = wheel.counter;
      wheel.measured = wheel.sampled = angle_of(wheel.ticks);
    } else {
      wheel.measured = wheel.sampled = wheel.true_angle;
    }
  }

  int64_t count(double angle) const {
    return rounded_down(angle * static_cast<double>(configuration_.ticks_per_turn) / (2.0 * M_PI));
  }
  double angle_of(int64_t ticks) const {
    return static_cast<double>(ticks) * (2.0 * M_PI) /
           static_cast<double>(configuration_.ticks_per_turn);
  }
  int64_t wrapped(int64_t ticks) const {
    return configuration_.counter_bits == 0
               ? ticks
               : ticks & ((int64_t{1} << configuration_.counter_bits) - 1);
  }
  // The difference of two counter values as the robot takes it: the shorter way around.
  int64_t unwrapped(int64_t difference) const {
    if (configuration_.counter_bits == 0) return difference;
    const int64_t range = int64_t{1} << configuration_.counter_bits;
    const int64_t positive = difference & (range - 1);
    return positive >= range / 2 ? positive - range : positive;
  }

  // Reads the encoders: updates turned, measured and rate of every wheel.
  void turn_wheels(const Snapshot& now, double dt_s) {
    double way[2] = {0.0, 0.0};  // m, true distance of each side
    for (Wheel& wheel : wheels_) {
      const double angle = now.wheel_angles[wheel.index];
      wheel.turned = angle - wheel.true_angle;
      wheel.true_angle = angle;
      wheel.rate = now.wheel_rates[wheel.index];
      if (!wheel.steers) way[wheel.side] += radius_ * wheel.turned / wheels_of_side_[wheel.side];
    }
    if (configuration_.slip_noise > 0.0 && (way[0] != 0.0 || way[1] != 0.0)) {
      RandomStream stream = random_.stream(static_cast<uint64_t>(now.step));
      double slip[2];
      for (const int side : {0, 1}) {
        slip[side] = configuration_.slip_noise * std::sqrt(std::abs(way[side])) *
                     stream.gaussian() / radius_;
        slip_variance_[side] += square(configuration_.slip_noise) * std::abs(way[side]);
      }
      for (Wheel& wheel : wheels_) {
        if (wheel.steers) continue;
        wheel.slipped += slip[wheel.side];
        wheel.turned += slip[wheel.side];
        wheel.rate += slip[wheel.side] / dt_s;
      }
    }
    for (Wheel& wheel : wheels_) {
      if (configuration_.ticks_per_turn > 0) {
        const int64_t counter = wrapped(count(wheel.true_angle + wheel.slipped));
        const int64_t passed = unwrapped(counter - wheel.counter);
        wheel.counter = counter;
        wheel.ticks += passed;
        wheel.measured = angle_of(wheel.ticks);
        wheel.turned = angle_of(passed);
        wheel.rate = wheel.turned / dt_s;
      } else {
        wheel.measured = wheel.true_angle + wheel.slipped;
      }
    }
  }

  void integrate_arc() {
    double way[2] = {0.0, 0.0};
    for (const Wheel& wheel : wheels_)
      way[wheel.side] += believed_radius(wheel.side) * wheel.turned / wheels_of_side_[wheel.side];
    if (way[0] == 0.0 && way[1] == 0.0) return;
    const double turn = (way[1] - way[0]) / track_;
    const double chord = 0.5 * (way[0] + way[1]) * sinc(0.5 * turn);
    const double along = theta_ + 0.5 * turn;
    const auto [sine, cosine] = math::sincos(along);
    x_ += chord * cosine;
    y_ += chord * sine;
    theta_ += turn;
  }

  void integrate_base(const Snapshot& now, double dt_s) {
    const Pose& X_WBase = now.robots[robot_].X_WBase;
    Vec3 moved;
    if (base_->has_wheels()) {
      angles_.clear();
      ways_.clear();
      for (const Wheel& wheel : wheels_) {
        angles_.push_back(wheel.measured);
        ways_.push_back(believed_radius(wheel.side) * wheel.turned);
      }
      moved = base_->moved(ways_, angles_);
    } else {
      moved = base_->moved(X_WBase_, X_WBase);
      if (configuration_.slip_noise > 0.0 && moved != Vec3::Zero()) {
        RandomStream stream = random_.stream(static_cast<uint64_t>(now.step));
        for (int i = 0; i < 3; ++i) {
          slip_variance_[i] = square(configuration_.slip_noise) * std::abs(moved[i]);
          moved[i] += configuration_.slip_noise * std::sqrt(std::abs(moved[i])) * stream.gaussian();
        }
      }
    }
    X_WBase_ = X_WBase;
    rate_ = moved / dt_s;
    step_s_ = dt_s;
    const double along = theta_ + 0.5 * moved.z(), chord = sinc(0.5 * moved.z());
    x_ += chord * (moved.x() * math::cos(along) - moved.y() * math::sin(along));
    y_ += chord * (moved.x() * math::sin(along) + moved.y() * math::cos(along));
    theta_ += moved.z();
  }

  // Motion of base_link for each metre that a wheel travels: m ahead, m to the left, rad.
  Vec3 moved_by(size_t wheel) const {
    if (base_) return base_->moved_by(wheel);
    const int side = wheels_[wheel].side;
    const double share = 1.0 / wheels_of_side_[side];
    return {0.5 * share, 0.0, (side == 0 ? -share : share) / track_};
  }

  // Of the motion in the interval that the velocity is the mean of: m^2, m rad, rad^2.
  Eigen::Matrix3d covariance() const {
    if (wheels_.empty()) return slip_variance_.asDiagonal();
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    Vec3 by_side[2] = {Vec3::Zero(), Vec3::Zero()};  // the wheels of a side slip together
    for (size_t i = 0; i < wheels_.size(); ++i) {
      if (wheels_[i].steers) continue;
      const Vec3 by = believed_radius(wheels_[i].side) * moved_by(i);
      by_side[wheels_[i].side] += by;
      if (configuration_.ticks_per_turn > 0) sum += square(angle_of(1)) / 6.0 * by * by.transpose();
    }
    for (const int side : {0, 1})
      sum += slip_variance_[side] / square(radius_) * by_side[side] * by_side[side].transpose();
    return sum;
  }

  // interval_s: 0 before the first step, when nothing has been measured.
  void publish_twist(SimTime time, const Vec3& twist, double interval_s, Outbox& out) {
    twist_.utime = time;
    twist_.vx = twist.x();
    twist_.vy = twist.y();
    twist_.omega = twist.z();
    std::fill(std::begin(twist_.covariance), std::end(twist_.covariance), 0.0);
    const bool random = configuration_.ticks_per_turn > 0 || configuration_.slip_noise > 0.0;
    if (random && interval_s > 0.0)
      Eigen::Map<Eigen::Matrix3d>(twist_.covariance) = covariance() / square(interval_s);
    slip_variance_ = Vec3::Zero();
    out.publish(twist_channel_, twist_);
  }

  void side_rates(double (&speed)[2]) const {
    speed[0] = speed[1] = 0.0;
    for (const Wheel& wheel : wheels_) {
      if (!wheel.steers)
        speed[wheel.side] += believed_radius(wheel.side) * wheel.rate / wheels_of_side_[wheel.side];
    }
  }

  void integrate_trapezoid(double dt_s) {
    double speed[2];
    side_rates(speed);
    const double v_before = 0.5 * (speed_before_[0] + speed_before_[1]);  // eq. 5
    const double v = 0.5 * (speed[0] + speed[1]);
    const double omega_before =
        (speed_before_[1] - speed_before_[0]) / track_;  // eq. 4, with the sign of eq. 3
    const double omega = (speed[1] - speed[0]) / track_;
    const double theta_before = theta_;
    theta_ += dt_s * 0.5 * (omega + omega_before);                                    // eq. 8
    x_ += dt_s * 0.5 * (v * math::cos(theta_) + v_before * math::cos(theta_before));  // eq. 6
    y_ += dt_s * 0.5 * (v * math::sin(theta_) + v_before * math::sin(theta_before));  // eq. 7
    speed_before_[0] = speed[0];
    speed_before_[1] = speed[1];
  }

  Configuration configuration_;
  RandomSource random_;
  RobotIndex robot_;
  int channel_, twist_channel_;
  double radius_ = 0.0, track_ = 0.0;  // m; the track that the robot believes
  std::vector<Wheel> wheels_;
  int wheels_of_side_[2] = {0, 0};
  std::optional<world::BaseOdometry> base_;  // for other than differential drives
  Pose X_WBase_;                             // at the previous step
  Vec3 rate_ = Vec3::Zero();  // m/s forward and to the left, rad/s, in the last step; with base_
  double step_s_ = 0.0;       // s, the last step; with base_
  std::vector<double> ways_, angles_;
  // m^2, of the slip since the last sample, with base_ in the last step: of left and right wheels;
  // without wheels m^2, m^2, rad^2 ahead, to the left, turning
  Vec3 slip_variance_ = Vec3::Zero();

  SimTime time_ = -1, sample_time_ = 0;
  double x_ = 0.0, y_ = 0.0, theta_ = 0.0;  // m, m, rad: base_link in odom
  double speed_before_[2] = {0.0, 0.0};     // m/s, left and right, at the previous step
  int32_t resets_ = 0;
  odometry_t message_;
  odometry_twist_t twist_;
};

const RegisterSensor kRegister{
    {.module = "odometry",
     .order = 1,
     .types = {},
     .attach_to = "drive",
     .device_name = "odometry",
     .default_rate = {50, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<Odometry>(setup); },
     .drive_rate = [](const world::DriveDescription& drive) { return drive.odometry_rate; }}};

}  // namespace
}  // namespace ruedo
