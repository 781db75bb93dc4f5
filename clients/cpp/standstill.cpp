// The look at sim time.
#include "standstill.h"

#include <cstdio>
#include <utility>

namespace ruedo::client {
namespace {

constexpr std::chrono::seconds kLong(5), kStands(1);

}  // namespace

Standstill::Standstill(const SimClock& clock, std::string call, std::function<std::string()> why)
    : clock_(clock), call_(std::move(call)), why_(std::move(why)), utime_(clock.utime()) {}

void Standstill::look() {
  const Clock::duration time = stands_for();
  if (told_ || time < kLong) return;
  const std::string why = why_();
  if (why.empty()) return;
  told_ = true;
  std::fprintf(
      stderr, "ruedo: %s waits, and sim time has stood still for %lld s at %.2f s: %s\n",
      call_.c_str(),
      static_cast<long long>(std::chrono::duration_cast<std::chrono::seconds>(time).count()),
      static_cast<double>(utime_) * 1e-6, why.c_str());
}

std::string Standstill::reason() {
  return stands_for() >= kStands || since_ == began_ ? why_() : "";
}

Standstill::Clock::duration Standstill::stands_for() {
  const Clock::time_point now = Clock::now();
  if (const int64_t utime = clock_.utime(); utime != utime_) {
    utime_ = utime;
    since_ = now;
  }
  return now - since_;
}

}  // namespace ruedo::client
