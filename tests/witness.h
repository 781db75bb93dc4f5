// Whether the machine, not the program under test, was at fault: the only reason for which a test
// restarts. tests/witness.py is its twin, and reads the threshold here.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>

namespace ruedo {

// A thread that sleeps has to wake within this time; if it does not, all of the machine's programs
// stood still. A machine that is busy gives each thread its turn sooner.
inline constexpr double kHeldUp_s = 0.25;

class Witness {
 public:
  Witness() = default;
  ~Witness() {
    over_ = true;
    thread_.join();
  }
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;

  // Since it was made. Each such excuse is counted in the file that RUEDO_REPEATS names: a run of
  // all tests has at most three (scripts/test).
  bool excuses(const std::string& test) const {
    if (longest_s_ <= kHeldUp_s) return false;
    if (const char* file = std::getenv("RUEDO_REPEATS"))
      std::ofstream(file, std::ios::app) << test << "\n";
    return true;
  }

 private:
  using Clock = std::chrono::steady_clock;
  void watch() {
    constexpr std::chrono::milliseconds kNap(10);
    while (!over_) {
      const Clock::time_point before = Clock::now();
      std::this_thread::sleep_for(kNap);
      const std::chrono::duration<double> late = Clock::now() - before - kNap;
      longest_s_ = std::max(longest_s_.load(), late.count());
    }
  }

  std::atomic<double> longest_s_{0.0};
  std::atomic<bool> over_{false};
  std::thread thread_{[this] { watch(); }};
};

}  // namespace ruedo
