// Sizes are in the units of 1000 that `ls -h --si` has.
#include "cli/logs/log_listing.h"

#include <algorithm>

#include <fmt/format.h>

#include "base/json.h"
#include "base/utf8.h"
#include "cli/support/commands.h"
#include "cli/support/listing.h"
#include "log/summary.h"
#include "ruedo/sim_time.h"

namespace ruedo::cli {
namespace {

double seconds_of(SimTime us) { return static_cast<double>(us) * 1e-6; }

std::string bytes_text(int64_t bytes) {
  double value = static_cast<double>(bytes);
  const char* const units[] = {"bytes", "kB", "MB", "GB", "TB"};
  size_t unit = 0;
  for (; value >= 999.5 && unit < 4; ++unit) value /= 1000;
  return unit == 0 ? fmt::format("{} bytes", bytes) : fmt::format("{:.3g} {}", value, units[unit]);
}

std::string rate_text(const log::ChannelSummary& channel) {
  return channel.rate() > 0 ? fmt::format("{:.4g} Hz", channel.rate()) : "";
}

std::string type_text(const log::ChannelSummary& channel) {
  return channel.type.empty() ? fmt::format("{:016x}", static_cast<uint64_t>(channel.fingerprint))
                              : channel.type;
}

void print_header(const log_header_t& header, const Style& style) {
  fmt::print("world {}{}{} ({}), steps of {:g} ms, seed {}\nrecorded by Ruedo {} on {}\n",
             style.bold, for_terminal(header.world), style.off, for_terminal(header.world_file),
             static_cast<double>(header.step_us) * 1e-3, static_cast<uint64_t>(header.seed),
             for_terminal(header.version), for_terminal(header.cpu));
  std::string options;
  for (const std::string& option : header.options) options += " " + option;
  if (!options.empty()) fmt::print("options{}\n", for_terminal(options));
}

void print_text(const log::Summary& log, const std::string& path) {
  const Style style = style_of(stdout);
  fmt::print("{}{}{}: {}, {} message{}, {:g} s of sim time ({:g} to {:g} s), {}\n", style.bold,
             for_terminal(path), style.off, bytes_text(log.size), log.messages,
             log.messages == 1 ? "" : "s", seconds_of(log.end_us - log.begin_us),
             seconds_of(log.begin_us), seconds_of(log.end_us),
             log.fault.empty() ? "whole" : log.fault);
  if (!log.fault.empty())
    fmt::print("{} of {} can be read\n", bytes_text(log.readable), bytes_text(log.size));
  if (log.header)
    print_header(*log.header, style);
  else if (log.messages > 0)
    fmt::print("without a header: ruedo run did not record it\n");
  size_t name = 8, type = 8;
  for (const log::ChannelSummary& channel : log.channels) {
    name = std::max(name, for_terminal(channel.name).size());
    type = std::max(type, type_text(channel).size());
  }
  fmt::print("\n{}{:<{}}  {:<{}}  {:>10}  {:>10}  {:>10}{}\n", style.bold, "Channel", name, "type",
             type, "messages", "rate", "size", style.off);
  for (const log::ChannelSummary& channel : log.channels) {
    fmt::print("{}{:<{}}{}  {:<{}}  {:>10}  {:>10}  {:>10}\n", style.cyan,
               for_terminal(channel.name), name, style.off, type_text(channel), type,
               channel.messages, rate_text(channel), bytes_text(channel.bytes));
  }
}

void print_json(const log::Summary& log, const std::string& path) {
  JsonWriter json;
  json.open('{').member("log", path).member("size", log.size).member("readable", log.readable);
  json.member("whole", log.fault.empty()).member("fault", log.fault);
  json.member("messages", log.messages)
      .member("begin", seconds_of(log.begin_us))
      .member("end", seconds_of(log.end_us));
  if (log.header) {
    const log_header_t& header = *log.header;
    json.member("world", header.world)
        .member("world_file", header.world_file)
        .name("seed")
        .raw(fmt::format("{}", static_cast<uint64_t>(header.seed)));
    json.member("step_us", header.step_us)
        .member("epoch", int64_t{header.epoch})
        .member("version", header.version)
        .member("cpu", header.cpu)
        .name("options")
        .open('[');
    for (const std::string& option : header.options) json.value(option);
    json.close(']');
  }
  json.name("channels").open('[');
  for (const log::ChannelSummary& channel : log.channels) {
    json.open('{').member("name", channel.name).member("type", channel.type);
    json.member("fingerprint", fmt::format("{:016x}", static_cast<uint64_t>(channel.fingerprint)));
    json.member("messages", channel.messages)
        .member("bytes", channel.bytes)
        .member("rate", channel.rate());
    json.member("begin", seconds_of(channel.first_us)).member("end", seconds_of(channel.last_us));
    json.close('}');
  }
  json.close(']').close('}');
  fmt::print("{}\n", json.text());
}

}  // namespace

void print_log(const std::string& path, bool json) {
  const log::Summary summary = log::summarize(path);
  if (json)
    print_json(summary, path);
  else
    print_text(summary, path);
}

}  // namespace ruedo::cli
