// E1, an advance of one metre, and E2, the square path: primitives and odometry, in the paper's
// setting and ours.
//
// The paper's setting is a loop at 50 Hz that decides, moves and then changes the speed: it brakes
// when v^2 / (2 d) has reached the rest of the way, by then up to a frame late. The paper prints no
// limits; 4.2 and 0.27 m/s^2 give its two numbers. For the square it prints none either: there the
// limits are the P3-AT's.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/whole.h"
#include "bench/experiment_rig.h"
#include "bench/experiments.h"
#include "report/svg_plot.h"
#include "ruedo/math.h"
#include "ruedo/move_command_t.hpp"

namespace ruedo::bench {
namespace {

using Kind = world::DriveDescription::Kind;

constexpr int64_t kStep_us = 5000, kPaperStep_us = 20'000, kLongStep_us = 50'000;
constexpr double kHigh = 4.2, kLow = 0.27;  // m/s^2
constexpr double kFast = 2.0;               // m/s: more than the triangle's peak
constexpr int kLaps = 5;
// The real robot sends its odometry in status packets, by default one each 100 ms.
constexpr double kPacket_s = 0.1;

// The paper's loop: `way` and `v` along a primitive, from rest to rest, at limits a and d. done()
// is the distance covered, go(v) moves for a frame at speed v.
template <class Done, class Go>
void brake_late(double length, double speed, double a, double d, double dt, Done&& done, Go&& go) {
  double v = 0;
  bool braking = false;
  do {
    braking = braking || v * v / (2 * d) >= length - done();
    go(v);
    v = braking ? v - d * dt : std::min(speed, v + a * dt);
  } while (v > 0);
  go(0);
}

std::string at_step(int64_t step_us) { return fmt::format(", step {} ms", step_us / 1000); }

struct Advance {
  double way_m;
  report::Points speed;  // over time
};

Advance advance_late(double a, double d) {
  ExperimentRig rig({.step_us = kPaperStep_us, .limits = false, .odometry = {}});
  Advance run;
  brake_late(
      1.0, INFINITY, a, d, rig.step_s(), [&] { return rig.robot().X_WBase.translation.x(); },
      [&](double v) {
        run.speed.push_back({rig.time_s(), v});
        rig.velocity(v, 0);
        rig.step();
      });
  run.way_m = rig.robot().X_WBase.translation.x();
  return run;
}

Advance advance(double a, double d, int64_t step_us, Kind drive) {
  ExperimentRig rig({.step_us = step_us, .drive = drive, .limits = false, .odometry = {}});
  Advance run;
  const double start = rig.robot().X_WBase.translation.x();
  rig.move({1, move_command_t::ADVANCE, 1.0, 0.0, kFast, a, d},
           [&] { run.speed.push_back({rig.time_s(), rig.robot().twist.linear.x()}); });
  run.way_m =
      rig.robot().X_WBase.translation.x() - start;  // when the primitive says that it is done
  return run;
}

// The measure of E2: the mean over all steps of |true pose - odometry|, component by component.
struct Square {
  double x_m = 0, y_m = 0, theta_rad = 0;  // means
  double worst_m = 0, worst_rad = 0;
  report::Points true_path, believed_path;

  // The pose that the driving program has: the odometry of the last status packet.
  double packet_s = 0;  // between two packets; 0: it knows each step's
  odometry_t packet{};

  void look(const ExperimentRig& rig) {
    const Pose& X = rig.robot().X_WBase;
    if (steps % std::max(1, rounded<int>(packet_s / rig.step_s())) == 0) packet = rig.odometry();
    const odometry_t& o = packet;
    const double dx = std::abs(X.translation.x() - o.x), dy = std::abs(X.translation.y() - o.y);
    const double dtheta = std::abs(wrap_angle(heading(X.rotation) - o.theta));
    const double n = ++steps;
    x_m += (dx - x_m) / n;
    y_m += (dy - y_m) / n;
    theta_rad += (dtheta - theta_rad) / n;
    worst_m = std::max({worst_m, dx, dy});
    worst_rad = std::max(worst_rad, dtheta);
    add(true_path, X.translation.x(), X.translation.y());
    add(believed_path, o.x, o.y);
  }

 private:
  // A point of the plot each centimetre is enough.
  static void add(report::Points& path, double x, double y) {
    if (path.empty() || math::hypot(x - path.back().first, y - path.back().second) > 0.01)
      path.push_back({x, y});
  }
  int steps = 0;
};

// The P3-AT's own limits, but the paper's loop, which knows its way from its odometry.
Square square_late(double packet_s) {
  ExperimentRig rig(
      {.step_us = kPaperStep_us, .limits = false, .odometry = {{"ruedo:integrator", "trapezoid"}}});
  Square square;
  square.packet_s = packet_s;
  for (int side = 0; side < 4 * kLaps; ++side) {
    const odometry_t from = rig.odometry();
    brake_late(
        1.0, 0.6, 0.3, 0.6, rig.step_s(),
        [&] { return math::hypot(rig.odometry().x - from.x, rig.odometry().y - from.y); },
        [&](double v) {
          rig.velocity(v, 0);
          rig.step();
          square.look(rig);
        });
    brake_late(
        M_PI / 2, 0.75, 1.74, 1.74, rig.step_s(), [&] { return rig.odometry().theta - from.theta; },
        [&](double omega) {
          rig.velocity(0, omega);
          rig.step();
          square.look(rig);
        });
  }
  return square;
}

Square square(Kind drive, const std::vector<std::pair<std::string, std::string>>& odometry,
              int64_t step_us = kStep_us) {
  ExperimentRig rig({.step_us = step_us, .drive = drive, .odometry = odometry});
  Square square;
  int64_t id = 0;
  for (int side = 0; side < 4 * kLaps; ++side) {
    rig.move({++id, move_command_t::ADVANCE, 1.0, 0, 0, 0, 0}, [&] { square.look(rig); });
    rig.move({++id, move_command_t::ROTATE, M_PI / 2, 0, 0, 0, 0}, [&] { square.look(rig); });
  }
  return square;
}

// How much wider the track seems to the wheels of a robot that turns on the spot, skidding: the
// turn by the wheels over the true one, less one.
double seeming_track_error(int64_t step_us) {
  ExperimentRig rig({.step_us = step_us, .drive = Kind::wheels, .odometry = {}});
  double turned = 0, last = heading(rig.robot().X_WBase.rotation);
  rig.move({1, move_command_t::ROTATE, 4 * M_PI, 0, 0, 0, 0}, [&] {
    const double now = heading(rig.robot().X_WBase.rotation);
    turned += wrap_angle(now - last);
    last = now;
  });
  return rig.odometry().theta / turned - 1.0;
}

void plot_square(const Experiments& all, const std::string& file, const std::string& title,
                 const Square& square) {
  report::SvgPlot plot(title, "x [m]", "y [m]", true);
  plot.line(square.true_path, "#1f77b4", "true path");
  plot.line(square.believed_path, "#d62728", "odometry", true, 1.0);
  all.write(file, plot.svg());
}

}  // namespace

void advance_experiment(Experiments& all) {
  struct Case {
    double a, d;
    const char* name;
    const char *paper, *paper_error;
    double loop_mm;
    const char* file;
  };
  for (const Case& c : {Case{kHigh, kLow, "acceleration 4.2, deceleration 0.27 m/s^2", "1126.40 mm",
                             "126.40 mm", 1126.44, "e1_high_acceleration.svg"},
                        Case{kLow, kHigh, "acceleration 0.27, deceleration 4.2 m/s^2", "1016.96 mm",
                             "16.96 mm", 1016.82, "e1_high_deceleration.svg"}}) {
    all.progress(fmt::format("E1: advance 1 m, {}", c.name));
    report::SvgPlot plot(fmt::format("Advance of 1 m: {}", c.name), "time [s]", "speed [m/s]");
    const Advance late = advance_late(c.a, c.d);
    plot.line(late.speed, "#d62728",
              fmt::format("late braking at 50 Hz: {:.2f} mm", 1000 * late.way_m));
    all.report({"E1", fmt::format("advance 1 m, {}, late braking at 50 Hz", c.name), c.paper,
                1000 * late.way_m, "mm", fmt::format("such a loop by hand, {:.2f} mm", c.loop_mm),
                std::abs(1000 * late.way_m - c.loop_mm) < 0.01});
    double worst = 0;
    for (const int64_t step_us : {100, 1000, 5000, 20'000, 50'000}) {
      const Advance exact = advance(c.a, c.d, step_us, Kind::kinematic);
      worst = std::max(worst, std::abs(exact.way_m - 1.0));
      if (step_us == kStep_us)
        plot.line(exact.speed, "#1f77b4",
                  fmt::format("Ruedo, 5 ms: {:.6f} mm", 1000 * exact.way_m));
    }
    all.report({"E1",
                fmt::format("advance 1 m, {}, kinematic drive: worst error, steps of 0.1 to 50 ms",
                            c.name),
                c.paper_error, 1000 * worst, "mm", "within 0.001 mm", worst < 1e-6});
    for (const int64_t step_us : {kStep_us, kPaperStep_us, kLongStep_us}) {
      const Advance wheels = advance(c.a, c.d, step_us, Kind::wheels);
      const bool usual = step_us == kStep_us;
      if (usual)
        plot.line(wheels.speed, "#2ca02c",
                  fmt::format("wheels in contact, 5 ms: {:.2f} mm", 1000 * wheels.way_m), true);
      all.report({"E1", fmt::format("advance 1 m, {}, wheels drive{}", c.name, at_step(step_us)),
                  c.paper, 1000 * wheels.way_m, "mm", usual ? "within 2 mm of 1000" : "",
                  !usual || std::abs(wheels.way_m - 1.0) < 2e-3});
    }
    all.write(c.file, plot.svg());
  }
}

void square_experiment(Experiments& all) {
  struct Target {
    std::string text;
    bool met = true;
  };
  const auto report = [&](const std::string& what, const Square& s, const Target& way,
                          const Target& turn) {
    const bool paper = what.find("late") != std::string::npos;
    all.report({"E2", what + ": mean difference in x", paper ? "5.9728 mm" : "", 1000 * s.x_m, "mm",
                way.text, way.met});
    all.report({"E2", what + ": mean difference in y", paper ? "5.5326 mm" : "", 1000 * s.y_m, "mm",
                way.text, way.met});
    all.report({"E2", what + ": mean difference in heading", paper ? "0.0124 rad" : "", s.theta_rad,
                "rad", turn.text, turn.met});
  };
  all.progress("E2: square path, late braking at 50 Hz, trapezoidal odometry");
  const Square late = square_late(0);
  report("square of 1 m, 5 times, late braking at 50 Hz, trapezoid, odometry of each step", late,
         {}, {});
  report(
      "square of 1 m, 5 times, late braking at 50 Hz, trapezoid, odometry of the last 0.1 s packet",
      square_late(kPacket_s), {}, {});
  plot_square(all, "e2_late_braking.svg",
              "Square of 1 m, five times: late braking at 50 Hz, trapezoidal odometry", late);

  all.progress("E2: square path, arc odometry");
  const Square arc = square(Kind::kinematic, {{"ruedo:integrator", "arc"}});
  report("square of 1 m, 5 times, kinematic drive, arc" + at_step(kStep_us), arc,
         {"at every step below 0.001 mm", arc.worst_m < 1e-6},
         {"at every step below 1e-9 rad", arc.worst_rad < 1e-9});
  plot_square(all, "e2_kinematic.svg",
              "Square of 1 m, five times: Ruedo's primitives, kinematic drive, arc odometry", arc);

  all.progress("E2: square path, trapezoidal odometry");
  report("square of 1 m, 5 times, kinematic drive, trapezoid" + at_step(kStep_us),
         square(Kind::kinematic, {{"ruedo:integrator", "trapezoid"}}), {}, {});

  all.progress("E2: square path, encoders of 34 000 ticks");
  const Square ticks =
      square(Kind::kinematic, {{"ruedo:ticks_per_turn", "34000"}, {"ruedo:counter_bits", "16"}});
  report("square of 1 m, 5 times, kinematic drive, arc, 34 000 ticks a turn" + at_step(kStep_us),
         ticks, {"below 0.5 mm", ticks.x_m < 5e-4 && ticks.y_m < 5e-4}, {});

  for (const int64_t step_us : {kStep_us, kPaperStep_us}) {
    all.progress("E2: square path, wheels in contact");
    const Square wheels = square(Kind::wheels, {}, step_us);
    report("square of 1 m, 5 times, wheels drive, arc" + at_step(step_us), wheels, {}, {});
    if (step_us == kStep_us)
      plot_square(all, "e2_wheels.svg",
                  "Square of 1 m, five times: wheels in contact, slip and all", wheels);
    all.progress("E2: square path, wheels in contact, calibrated track");
    const double error = seeming_track_error(step_us);
    const Square calibrated =
        square(Kind::wheels, {{"ruedo:track_error", fmt::format("{:.9f}", error)}}, step_us);
    report(fmt::format("square of 1 m, 5 times, wheels drive, arc, track {:+.1f} % as two turns on "
                       "the spot measure it{}",
                       100 * error, at_step(step_us)),
           calibrated, {}, {});
  }
}

}  // namespace ruedo::bench
