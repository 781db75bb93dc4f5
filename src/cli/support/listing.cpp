// Prints ruedo/info for people: one column each for channel, type, rate and
// kind.
#include "cli/support/listing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include <fmt/format.h>

#include "base/utf8.h"
#include "cli/support/commands.h"
#include "ruedo/math.h"

namespace ruedo::cli {
namespace {

// The lists of all parts, whole.
struct Whole {
  std::vector<robot_info_t> robots;
  std::vector<device_info_t> devices;
  std::vector<channel_info_t> channels;

  explicit Whole(const std::vector<world_info_t>& parts) {
    for (const world_info_t& part : parts) {
      robots.insert(robots.end(), part.robots.begin(), part.robots.end());
      devices.insert(devices.end(), part.devices.begin(), part.devices.end());
      channels.insert(channels.end(), part.channels.begin(), part.channels.end());
    }
  }
};

std::string rate_text(const channel_info_t& channel, const std::string& device_kind) {
  if (channel.input) return "";
  if (channel.rate > 0.0) return fmt::format("{:g} Hz", channel.rate);
  return channel.robot.empty() || device_kind == "contact" ? "on event" : "every step";
}

std::string what_text(const device_info_t& device) {
  const double degrees = 180.0 / M_PI;
  std::string text;
  if (device.width > 0 && device.height > 1) {
    text = fmt::format("{} x {}", device.width, device.height);
  } else if (device.width > 0) {
    text = fmt::format("{} {}", device.width, device.nelements > 0 ? "transducers" : "rays");
  }
  if (device.fov_horizontal > 0.0)
    text += fmt::format("{}{:.4g} deg", text.empty() ? "" : ", ", device.fov_horizontal * degrees);
  if (device.range_max > 0.0)
    text += fmt::format("{}{:g} to {:g} m", text.empty() ? "" : ", ", device.range_min,
                        device.range_max);
  return text;
}

struct Row {
  std::string channel, type, rate, what;
  bool input;
};

void print_rows(FILE* out, const std::vector<Row>& rows) {
  const Style style = style_of(out);
  size_t name = 16, type = 8;
  for (const Row& row : rows) {
    name = std::max(name, row.channel.size());
    type = std::max(type, row.type.size());
  }
  for (const Row& row : rows) {
    fmt::print(out, "  {} {}{:<{}}{}  {:<{}}  {}{:>10}{}  {}{}{}\n", row.input ? "<-" : "->",
               style.cyan, row.channel, name, style.off, row.type, type, style.bold, row.rate,
               style.off, style.dim, row.what, style.off);
  }
}

std::string drive_text(const robot_info_t& robot) {
  if (robot.drive.empty()) return "does not drive";
  std::string text = robot.drive + " drive";
  if (std::isfinite(robot.max_speed)) text += fmt::format(", {:g} m/s", robot.max_speed);
  if (std::isfinite(robot.max_turn_rate))
    text += fmt::format(", {:.4g} rad/s", robot.max_turn_rate);
  return text;
}

// Rows of each robot; those with the same rows but for their name are alike.
std::map<std::string, std::vector<Row>> rows_by_robot(const Whole& whole) {
  std::map<std::pair<std::string, std::string>, const device_info_t*> devices;
  for (const device_info_t& device : whole.devices) devices[{device.robot, device.name}] = &device;
  std::map<std::string, std::vector<Row>> rows;
  for (const channel_info_t& channel : whole.channels) {
    const auto found = devices.find({channel.robot, channel.device});
    const device_info_t* device = found == devices.end() ? nullptr : found->second;
    const bool main_channel = device && channel.name == channel.robot + "/" + channel.device;
    rows[channel.robot].push_back({channel.name, channel.type,
                                   rate_text(channel, device ? device->kind : ""),
                                   channel.input  ? "commands"
                                   : main_channel ? what_text(*device)
                                                  : "",
                                   channel.input != 0});
  }
  for (auto& [robot, list] : rows) {
    std::stable_sort(list.begin(), list.end(),
                     [](const Row& a, const Row& b) { return a.input < b.input; });
  }
  return rows;
}

std::string signature(const robot_info_t& robot, const std::vector<Row>& rows) {
  std::string text = robot.model + "|" + drive_text(robot);
  for (const Row& row : rows) {
    const bool own = row.channel.rfind(robot.name + "/", 0) == 0;
    text += "|" + (own ? row.channel.substr(robot.name.size()) : row.channel) + row.type +
            row.rate + row.what;
  }
  return text;
}

}  // namespace

void print_channels(FILE* out, const std::vector<world_info_t>& info) {
  const Style style = style_of(out);
  const Whole whole(info);
  auto rows = rows_by_robot(whole);
  std::vector<std::pair<const robot_info_t*, std::vector<std::string>>>
      kinds;  // the first of each, and the others' names
  std::map<std::string, size_t> kind_of;
  for (const robot_info_t& robot : whole.robots) {
    const auto [found, added] =
        kind_of.try_emplace(signature(robot, rows[robot.name]), kinds.size());
    if (added)
      kinds.push_back({&robot, {}});
    else
      kinds[found->second].second.push_back(robot.name);
  }
  for (const auto& [robot, others] : kinds) {
    fmt::print(out, "{}{}{} ({}; {})", style.bold, robot->name, style.off,
               for_terminal(robot->model), drive_text(*robot));
    if (!others.empty()) {
      fmt::print(out, "; identical: ");
      for (size_t i = 0; i < others.size() && i < 3; ++i)
        fmt::print(out, "{}{}", i > 0 ? ", " : "", others[i]);
      if (others.size() > 3)
        fmt::print(out, ", ... {} ({} in all)", others.back(), others.size() + 1);
    }
    fmt::print(out, "\n");
    print_rows(out, rows[robot->name]);
  }
  fmt::print(out, "{}simulation{}\n", style.bold, style.off);
  print_rows(out, rows[""]);
}

namespace {

// Infinity means unlimited: it executes commands at once.
std::string accelerations(const robot_info_t& robot) {
  std::string limited, at_once;
  const auto add = [&](const char* does, double limit, const char* unit) {
    if (std::isfinite(limit))
      limited += fmt::format("{}{} with {:g} {}", limited.empty() ? "" : ", ", does, limit, unit);
    else
      at_once += fmt::format("{}{}", at_once.empty() ? "" : " and ", does);
  };
  add("accelerates", robot.acceleration, "m/s^2");
  add("brakes", robot.deceleration, "m/s^2");
  add("turns", robot.turn_acceleration, "rad/s^2");
  if (at_once.empty()) return limited;
  return (limited.empty() ? "" : limited + "; ") + at_once + " at once: no limit is given";
}

}  // namespace

void print_devices(FILE* out, const std::vector<world_info_t>& info) {
  const Style style = style_of(out);
  const Whole whole(info);
  for (const robot_info_t& robot : whole.robots) {
    fmt::print(out, "{}{}{} ({}; {})\n", style.bold, robot.name, style.off,
               for_terminal(robot.model), drive_text(robot));
    if (!robot.drive.empty()) {
      std::string wheels;
      for (size_t i = 0; i < robot.wheels.size(); ++i)
        wheels += fmt::format("{}{} ({})", i > 0 ? ", " : "", robot.wheels[i],
                              robot.left[i] ? "left" : "right");
      if (wheels.empty())  // tracks, or what moves without
        fmt::print(out, "  no wheels{}\n",
                   robot.track > 0.0 ? fmt::format("; track {:g} m", robot.track) : "");
      else
        fmt::print(out, "  wheels: {}; radius {:g} m, track {:g} m\n", wheels, robot.wheel_radius,
                   robot.track);
      fmt::print(out, "  {}; watchdog {}\n", accelerations(robot),
                 robot.watchdog_us > 0
                     ? fmt::format("{:g} s", static_cast<double>(robot.watchdog_us) * 1e-6)
                     : "off");
    }
    for (const device_info_t& device : whole.devices) {
      if (device.robot != robot.name) continue;
      const double* q = device.orientation;
      const double yaw =
          math::atan2(2.0 * (q[0] * q[3] + q[1] * q[2]), 1.0 - 2.0 * (q[2] * q[2] + q[3] * q[3]));
      fmt::print(out, "  {}{:<16}{} {:<10} at {:.3f}, {:.3f}, {:.3f} m, {:.1f} deg  {}\n",
                 style.cyan, device.name, style.off, device.kind, device.position[0],
                 device.position[1], device.position[2], yaw * 180.0 / M_PI, what_text(device));
    }
  }
}

}  // namespace ruedo::cli
