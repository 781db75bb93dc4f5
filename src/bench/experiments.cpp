// `ruedo experiments`: runs E1 to E5, prints the table, and writes a page with plots, and the
// numbers as JSON.
#include "bench/experiments.h"

#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "ruedo/errors.h"
#include "system/output_file.h"

namespace ruedo::bench {
namespace {

std::string shown(const Outcome& outcome) {
  const double v = outcome.value;
  const std::string number = v == 0               ? "0"
                             : std::abs(v) < 1e-3 ? fmt::format("{:.1e}", v)
                             : std::abs(v) < 1    ? fmt::format("{:.4f}", v)
                                                  : fmt::format("{:.2f}", v);
  return outcome.unit.empty() ? number : number + " " + outcome.unit;
}

std::string table(const std::vector<Outcome>& outcomes, const std::string& experiment) {
  std::string text = "| Measured | Paper | Ruedo | Target | |\n|---|---|---|---|---|\n";
  for (const Outcome& o : outcomes) {
    if (o.experiment != experiment) continue;
    text += fmt::format("| {} | {} | {} | {} | {} |\n", o.quantity, o.paper, shown(o),
                        o.target.empty() ? "as measured" : o.target,
                        o.target.empty() ? ""
                        : o.met          ? "met"
                                         : "**missed**");
  }
  return text + "\n";
}

// {E1} and so on are the experiments' tables.
constexpr const char* kPage = R"(# The paper's experiments

Ruedo began with Hernandez-Belmonte, Ayala-Ramirez and Sanchez-Yanez, "A Mobile Robot Simulator Using a Game
Development Engine", ROSSUM 2011. This page is written by `ruedo experiments --out docs`, which runs the paper's
experiments again on a P3-AT: in the paper's setting, and in Ruedo's.

The paper's setting is assumed to be a control loop at 50 Hz that starts to brake when the braking distance v^2 / (2 d) has reached the remaining distance.
It notices this up to one frame late, and so drives up to v dt too far. The paper prints neither the loop nor its limits:
4.2 and 0.27 m/s^2 are chosen so that such a loop nearly reproduces the paper's two numbers. The agreement in E1 therefore shows that late braking
can explain them, not that it did. Ruedo plans a primitive in closed form. The kinematic drive evaluates it exactly at every step, so that its distance
does not depend on the step. That of the wheels drive does: its servos are told the plan once a step, and lag by a part of it. Rows that depend on the step
say it; the target is for the usual 5 ms. The distance is measured at the step at which the primitive reports that it is done.

## E1: advance by one metre (the paper's Fig. 8)

{E1}![Speed over time, high acceleration](experiments/e1_high_acceleration.svg)

![Speed over time, high deceleration](experiments/e1_high_deceleration.svg)

## E2: a square of one metre, five times (Fig. 9)

The paper reports the mean difference between the true pose and the odometry over the run; here it is the mean of the absolute
differences at every step. The paper says: a square of 1000 mm, "several times", odometry by the trapezoidal rule. It does not say how
many times, with which speeds and limits, at which rate, how old the odometry was when it was compared, and whether signs
cancelled. Assumed here are five times, 50 Hz, the loop of E1, and the P3-AT's usual limits: 0.6 m/s, 0.75 rad/s, acceleration 0.3 and
deceleration 0.6 m/s^2, 1.74 rad/s^2 (AMRISim's parameters, which the model in worlds/robots/p3at uses, too). They were not fitted, and these rows have
no target. In the first three rows the odometry is that of the same step: the trapezoid then lags half a frame behind the robot. In the next three it is that of
the last status packet, which the real robot sends every 0.1 s. Which of the two the paper used is not known.

In Ruedo's setting the kinematic drive executes the primitives along the robot's true path. With the wheels drive the wheels slip, and the
primitives end by the robot's odometry, as on a real robot. A skid-steered robot turns less than its wheels suggest,
so its square does not close until its odometry assumes a wider track than the real one.

{E2}![Square, late braking](experiments/e2_late_braking.svg)

![Square, kinematic drive](experiments/e2_kinematic.svg)

![Square, wheels in contact](experiments/e2_wheels.svg)

## E3: the laser range finder among obstacles (Fig. 7)

181 rays over 180 degrees, against distances computed from the obstacles' outlines.

{E3}![The scene with the rays](experiments/e3_picture.png)

![The rays from above](experiments/e3_rays.svg)

## E4: an overloaded host

The paper attributes errors to the load of the host. Ruedo runs once on the host as it is, and once beside four busy threads per core,
with every module delayed at random.

{E4}## E5: noise on and off

The LRF of E3 with a sigma of 10 mm, with 1000 seeds.

{E5})";

std::string page(const std::vector<Outcome>& outcomes) {
  return fmt::format(kPage, fmt::arg("E1", table(outcomes, "E1")),
                     fmt::arg("E2", table(outcomes, "E2")), fmt::arg("E3", table(outcomes, "E3")),
                     fmt::arg("E4", table(outcomes, "E4")), fmt::arg("E5", table(outcomes, "E5")));
}

std::string json(const std::vector<Outcome>& outcomes) {
  std::string text = "[\n";
  for (const Outcome& o : outcomes) {
    text += fmt::format(
        "  {{\"experiment\": \"{}\", \"quantity\": \"{}\", \"paper\": \"{}\", \"value\": {:.17g}, "
        "\"unit\": \"{}\", \"target\": \"{}\", \"met\": {}}}{}\n",
        o.experiment, o.quantity, o.paper, o.value, o.unit, o.target, o.met,
        &o == &outcomes.back() ? "" : ",");
  }
  return text + "]\n";
}

}  // namespace

void Experiments::write(const std::string& file, const std::string& text) const {
  write_file(pictures / file, text);
}

int run_experiments(const std::string& out) {
  const std::filesystem::path folder(out);
  Experiments all;
  all.pictures = folder / "experiments";
  std::error_code error;
  std::filesystem::create_directories(all.pictures, error);
  if (error)
    throw EnvironmentError("cannot make the folder " + all.pictures.string() + " (" +
                           error.message() + "): choose another with --out");
  advance_experiment(all);
  square_experiment(all);
  laser_experiment(all);
  overload_experiment(all);
  noise_experiment(all);
  all.running.reset();

  bool met = true;
  for (const Outcome& o : all.outcomes) {
    std::printf("%-3s %-100s %14s  %s\n", o.experiment.c_str(), o.quantity.c_str(),
                shown(o).c_str(),
                o.target.empty() ? "" : ((o.met ? "met: " : "MISSED: ") + o.target).c_str());
    met = met && o.met;
  }
  write_file(folder / "experiments.md", page(all.outcomes));
  write_file(all.pictures / "numbers.json", json(all.outcomes));
  std::printf("Written: %s, with its pictures in %s\n", (folder / "experiments.md").c_str(),
              all.pictures.c_str());
  return met ? 0 : 1;
}

}  // namespace ruedo::bench
