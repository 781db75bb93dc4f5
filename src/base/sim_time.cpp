// Exact rates and the steps at which a device takes its samples. All in integers: 128 bits hold the
// products of a million hours at a megahertz.
#include "ruedo/sim_time.h"

#include <cassert>
#include <charconv>
#include <numeric>
#include <stdexcept>

namespace ruedo {
namespace {

__extension__ typedef __int128 Wide;

constexpr int64_t kMicrosPerSecond = 1'000'000;
constexpr int64_t kMaxRateHz = 1'000'000;
constexpr int kMaxDecimals = 9;

// Quotients rounded down and up; the divisor is positive.
Wide floor_div(Wide a, Wide b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }
Wide ceil_div(Wide a, Wide b) { return -floor_div(-a, b); }

[[noreturn]] void refuse(std::string_view text, const char* why) {
  throw std::invalid_argument("'" + std::string(text) + "' is not a rate: " + why);
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

Rate Rate::parse(std::string_view text) {
  constexpr const char* kForm =
      "allowed is a decimal number from 0 to 1000000 Hz with at most nine decimals";
  size_t at = !text.empty() && text[0] == '+' ? 1 : 0;
  // digits * 10^exponent
  int64_t digits = 0;
  int64_t exponent = 0;
  bool any = false, point = false;
  for (; at < text.size() && (is_digit(text[at]) || (text[at] == '.' && !point)); ++at) {
    if (text[at] == '.') {
      point = true;
      continue;
    }
    any = true;
    if (digits >=
        100'000'000'000'000'000) {  // 18 digits: no more fit; zeros at the end mean nothing
      if (text[at] != '0') refuse(text, kForm);
      if (!point) ++exponent;
      continue;
    }
    digits = digits * 10 + (text[at] - '0');
    if (point) --exponent;
  }
  if (!any) refuse(text, kForm);
  if (at < text.size() && (text[at] == 'e' || text[at] == 'E')) {
    ++at;
    if (at + 1 < text.size() && text[at] == '+' && is_digit(text[at + 1])) ++at;
    int written = 0;
    const auto [end, error] = std::from_chars(text.data() + at, text.data() + text.size(), written);
    if (error != std::errc()) refuse(text, kForm);
    exponent += written;
    at = static_cast<size_t>(end - text.data());
  }
  if (at != text.size()) refuse(text, kForm);
  if (digits == 0) return {0, 1};

  while (digits % 10 == 0) {
    digits /= 10;
    ++exponent;
  }
  if (exponent < -kMaxDecimals) refuse(text, "more than nine decimals");
  int64_t denominator = 1;
  for (; exponent < 0; ++exponent) denominator *= 10;
  for (; exponent > 0; --exponent) {
    if (digits > kMaxRateHz) refuse(text, "above 1000000 Hz");
    digits *= 10;
  }
  if (static_cast<Wide>(digits) > static_cast<Wide>(kMaxRateHz) * denominator)
    refuse(text, "above 1000000 Hz");
  const int64_t common = std::gcd(digits, denominator);
  return {digits / common, denominator / common};
}

SampleClock::SampleClock(Rate rate, int64_t step_us, SimTime phase_us)
    : rate_(rate), step_us_(step_us), phase_us_(phase_us) {
  assert(step_us > 0 && phase_us >= 0 && rate.numerator >= 0 && rate.denominator > 0);
  every_step_ = rate.every_step() || static_cast<Wide>(rate.numerator) * step_us >=
                                         static_cast<Wide>(rate.denominator) * kMicrosPerSecond;
}

int64_t SampleClock::step_of(int64_t sample) const {
  if (every_step_) return static_cast<int64_t>(ceil_div(phase_us_, step_us_)) + sample;
  // The first s with s * step >= phase + sample * 1e6 * denominator / numerator.
  if (int64_t of_samples = 0, phase = 0, time = 0, divisor = 0;  // mostly, 64 bits hold it all
      !__builtin_mul_overflow(sample, rate_.denominator * kMicrosPerSecond, &of_samples) &&
      !__builtin_mul_overflow(phase_us_, rate_.numerator, &phase) &&
      !__builtin_add_overflow(of_samples, phase, &time) &&
      !__builtin_mul_overflow(rate_.numerator, step_us_, &divisor) && time >= 0)
    return time / divisor + (time % divisor != 0);
  const Wide time_times_rate = static_cast<Wide>(phase_us_) * rate_.numerator +
                               static_cast<Wide>(sample) * rate_.denominator * kMicrosPerSecond;
  return static_cast<int64_t>(
      ceil_div(time_times_rate, static_cast<Wide>(rate_.numerator) * step_us_));
}

int64_t SampleClock::samples_before(int64_t step) const {
  if (step <= 0) return 0;
  if (every_step_) {
    const int64_t first = static_cast<int64_t>(ceil_div(phase_us_, step_us_));
    return step > first ? step - first : 0;
  }
  // Samples whose time is at most that of the step before.
  const Wide time = static_cast<Wide>(step - 1) * step_us_ - phase_us_;
  if (time < 0) return 0;
  return static_cast<int64_t>(floor_div(time * rate_.numerator,
                                        static_cast<Wide>(rate_.denominator) * kMicrosPerSecond)) +
         1;
}

}  // namespace ruedo
