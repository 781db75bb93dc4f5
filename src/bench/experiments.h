// The experiments of the paper that Ruedo began with: Hernandez-Belmonte, Ayala-Ramirez,
// Sanchez-Yanez, "A Mobile Robot Simulator Using a Game Development Engine", ROSSUM 2011; run again
// in its setting and in ours.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"

namespace ruedo::bench {

// One number of an experiment.
struct Outcome {
  std::string experiment;  // "E1"
  std::string quantity;    // what was measured, and how
  std::string paper;       // the paper's number, as printed there; "" where it has none
  double value = 0.0;      // ours
  std::string unit;
  std::string target;  // in words; "" where it is only reported
  bool met = true;
};

// The input and the results of an experiment.
struct Experiments {
  std::filesystem::path pictures;  // folder for plots
  std::vector<Outcome> outcomes;
  std::optional<Progress> running;

  void progress(const std::string& what) { running.emplace(what); }
  void report(Outcome outcome) { outcomes.push_back(std::move(outcome)); }
  void write(const std::string& file, const std::string& text) const;  // into `pictures`
};

void advance_experiment(Experiments& all);   // E1
void square_experiment(Experiments& all);    // E2
void laser_experiment(Experiments& all);     // E3
void overload_experiment(Experiments& all);  // E4
void noise_experiment(Experiments& all);     // E5

// Runs all of them, and writes what they found into the folder `out`; returns the exit code.
int run_experiments(const std::string& out);

}  // namespace ruedo::bench
