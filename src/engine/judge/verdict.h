// A verdict: the expectations of a run, and the outcome of each, with the evidence.
//
// It is made of evidence, not of the absence of objections: a run has passed when each check was
// judged and held, with its evidence. A check that was not judged has not passed. `ruedo regress`,
// campaigns and the engine of Python all make one of these.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "ruedo/sim_time.h"

namespace ruedo::judge {

enum class Outcome { passed, failed, not_judged };

// One expectation.
struct Check {
  std::string what;  // "run", "goal 0", "contact", "clearance", "odometry", "client", "golden", ...
  Outcome outcome = Outcome::passed;
  std::string text;             // passed: the evidence; else what is wrong
  std::optional<SimTime> time;  // when it went wrong, where there is such a moment
};

// A number that says how well a run went: SI units, in the name's end.
struct Metric {
  std::string name;
  double value = 0.0;
};

// Where base_link was: s, m, m.
struct Place {
  double time_s, x, y;
};

struct Verdict {
  std::vector<Check> checks;  // in the order of the report
  std::vector<Metric> metrics;
  std::vector<Place> track;

  // Not without a check.
  bool passed() const;
  // The checks that have not passed: first those without a time, then the earliest; failed ones
  // before those that were not judged.
  std::vector<Check> failures() const;
  // "12000 steps; the client ended with 0 at 59.8 s; clearance 0.31 m over 12000 steps".
  std::string evidence() const;
};

std::string to_line(const Check& check);  // "12.500 s: p3at touched wall/link at ..."

// {"outcome": "passed", "evidence": [{"what", "text"}], "failures": [{"what", "judged", "time_s",
// "text"}], "faults": ["text"], "metrics": {...}, "track": [[s, m, m]]}; faults are the failures
// that have no moment.
std::string to_json(const Verdict& verdict);

// JUnit XML: one test case a check.
std::string to_junit(const Verdict& verdict, const std::string& name);

}  // namespace ruedo::judge
