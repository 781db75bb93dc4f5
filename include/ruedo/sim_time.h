// Simulated time: whole microseconds and step counts, and the schedule of a device's samples in
// them. No double ever holds a time, so a rate never drifts.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace ruedo {

// Microseconds of simulated time since the start of the run.
using SimTime = int64_t;

// A rate in Hz as an exact fraction: 30 is 30/1, 29.97 is 2997/100. Zero means "every step".
struct Rate {
  int64_t numerator = 0;
  int64_t denominator = 1;

  bool every_step() const { return numerator == 0; }
  double hz() const { return static_cast<double>(numerator) / static_cast<double>(denominator); }

  // Reads a decimal number of at most nine digits after the point ("10", "29.97", "1e1"). Throws
  // std::invalid_argument for anything else, negative numbers and rates above 1 MHz.
  static Rate parse(std::string_view text);

  friend bool operator==(const Rate&, const Rate&) = default;
};

// Schedules the samples of a device. Sample k (from 0, the initial state) is taken at
// the first step whose time is at least phase + k / rate.
class SampleClock {
 public:
  // step_us > 0; phase_us >= 0. A rate of zero, or above the step rate, means every step.
  SampleClock(Rate rate, int64_t step_us, SimTime phase_us = 0);

  // The step of sample k.
  int64_t step_of(int64_t sample) const;
  // The number of samples taken before step `step`; it is also the index of the sample taken at or
  // after it.
  int64_t samples_before(int64_t step) const;
  bool every_step() const { return every_step_; }

 private:
  Rate rate_;
  int64_t step_us_;
  SimTime phase_us_;
  bool every_step_;
};

}  // namespace ruedo
