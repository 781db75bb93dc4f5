#include "bridges/ros2/messages/diagnostics.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include "bridges/ros2/messages/cdr.h"
#include "bridges/ros2/messages/conversions.h"

namespace ruedo::ros2 {
namespace {

enum Level : uint8_t { ok = 0, warn = 1 };

using Values = std::vector<std::pair<const char*, std::string>>;

void put_status(CdrWriter& out, Level level, const char* name, const std::string& message,
                const Values& values) {
  out.put(uint8_t{level}).put(name).put(message).put("ruedo").put_length(values.size());
  for (const auto& [key, value] : values) out.put(key).put(value);
}

}  // namespace

std::optional<std::vector<uint8_t>> Diagnostics::look(Clock::time_point now,
                                                      const HealthCounts& counts) {
  constexpr auto kPeriod = std::chrono::seconds(1);
  if (now < last_ + kPeriod) return std::nullopt;
  const double real_s = std::chrono::duration<double>(now - last_).count();
  const uint64_t steps = steps_ - last_steps_;
  const double factor = static_cast<double>(time_us_ - last_time_us_) * 1e-6 / real_s;
  const auto count = [](uint64_t number) { return std::to_string(number); };

  CdrWriter out;
  put_header(out, time_us_, "");
  out.put_length(3);
  put_status(
      out, ok, "ruedo: simulation", steps == 0 ? "stands still" : "runs",
      {{"sim time (s)", fmt::format("{:.3f}", static_cast<double>(time_us_) * 1e-6)},
       {"real-time factor", fmt::format("{:.3f}", steps == 0 ? 0.0 : factor)},
       {"steps per second", fmt::format("{:.1f}", static_cast<double>(steps) / real_s)},
       {"real time per step (ms)",
        steps == 0 ? "" : fmt::format("{:.3f}", 1e3 * real_s / static_cast<double>(steps))}});
  const HealthCounts& last = last_counts_;
  const bool slow = counts.missed + counts.dropped > last.missed + last.dropped;
  const bool faulty = counts.faulty > last.faulty;
  put_status(out, slow || faulty ? warn : ok, "ruedo: ROS 2",
             slow     ? "messages were lost on the way to ROS"
             : faulty ? "faulty messages came"
                      : "",
             {{"messages sent", count(counts.sent)},
              {"messages missed (the node did not follow the run)", count(counts.missed)},
              {"messages dropped (DDS did not take them)", count(counts.dropped)},
              {"commands received", count(counts.received)},
              {"faulty messages ignored", count(counts.faulty)}});
  const bool lost = counts.lost_on_bus > last.lost_on_bus;
  put_status(out, lost ? warn : ok, "ruedo: bus",
             lost ? "messages were lost, or clients are too slow" : "",
             {{"messages lost", count(counts.lost_on_bus)}});
  last_ = now;
  last_time_us_ = time_us_;
  last_steps_ = steps_;
  last_counts_ = counts;
  return out.bytes();
}

}  // namespace ruedo::ros2
