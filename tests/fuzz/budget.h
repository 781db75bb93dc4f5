// The budget of one input. CPU time is measured here, since a slow input is a finding, too, and
// wall time would depend on the machine's load. libFuzzer measures the memory (-malloc_limit_mb,
// -rss_limit_mb).
#pragma once

#include <cstdio>
#include <cstdlib>
#include <ctime>

class Budget {
 public:
  Budget() : begin_s_(now_s()) {}
  ~Budget() {
    const double took_s = now_s() - begin_s_;
    if (took_s <= kMost_s) return;
    std::fprintf(stderr, "slow input: %.1f s of CPU time, allowed are %.1f\n", took_s, kMost_s);
    std::abort();  // libFuzzer keeps the input
  }

 private:
  static constexpr double kMost_s =
      10.0;  // with the sanitizers, which cost a factor of two to five
  static double now_s() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  double begin_s_;
};
