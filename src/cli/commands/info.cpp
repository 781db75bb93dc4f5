// ruedo info: robots, devices, channels, rates and message types of a world, without running it; or
// what a log holds.
#include <fmt/format.h>

#include "base/json.h"
#include "base/utf8.h"
#include "base/version.h"
#include "cli/logs/log_listing.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/find_all.h"
#include "cli/support/listing.h"
#include "engine/fleet.h"
#include "engine/world_info.h"
#include "log/summary.h"
#include "ruedo/errors.h"

namespace ruedo::cli {
namespace {

struct InfoArguments {
  WorldArguments world;
  bool json = false;
};

void print_json(const world::WorldModel& world, const std::vector<world_info_t>& parts) {
  JsonWriter json;
  json.open('{')
      .member("world", world.name)
      .member("step_us", world.step_us)
      .name("robots")
      .open('[');
  const auto each = [&](auto list, auto&& write) {
    for (const world_info_t& part : parts) {
      for (const auto& entry : part.*list) write(entry);
    }
  };
  each(&world_info_t::robots, [&](const robot_info_t& robot) {
    json.open('{')
        .member("name", robot.name)
        .member("model", robot.model)
        .member("drive", robot.drive);
    json.member("wheel_radius", robot.wheel_radius)
        .member("track", robot.track)
        .member("max_speed", robot.max_speed);
    json.member("max_turn_rate", robot.max_turn_rate)
        .member("watchdog_us", robot.watchdog_us)
        .name("wheels")
        .open('[');
    for (const std::string& wheel : robot.wheels) json.value(wheel);
    json.close(']').close('}');
  });
  json.close(']').name("devices").open('[');
  each(&world_info_t::devices, [&](const device_info_t& device) {
    json.open('{')
        .member("robot", device.robot)
        .member("name", device.name)
        .member("kind", device.kind)
        .member("rate", device.rate);
    json.name("position").open('[');
    for (const double value : device.position) json.value(value);
    json.close(']').name("orientation").open('[');
    for (const double value : device.orientation) json.value(value);
    json.close(']').member("range_min", device.range_min).member("range_max", device.range_max);
    json.member("fov_horizontal", device.fov_horizontal)
        .member("fov_vertical", device.fov_vertical);
    json.member("width", device.width).member("height", device.height).close('}');
  });
  json.close(']').name("channels").open('[');
  each(&world_info_t::channels, [&](const channel_info_t& channel) {
    json.open('{')
        .member("name", channel.name)
        .member("robot", channel.robot)
        .member("device", channel.device);
    json.member("type", channel.type)
        .member("fingerprint", fmt::format("{:016x}", static_cast<uint64_t>(channel.fingerprint)));
    json.member("rate", channel.rate).member("input", channel.input != 0).close('}');
  });
  json.close(']').close('}');
  fmt::print("{}\n", json.text());
}

int info_of_log(const InfoArguments& arguments) {
  if (const auto options = result_options(arguments.world); !options.empty())
    throw InputError({}, options[0] + ": is for a world; " + arguments.world.world + " is a log");
  read_given_types();
  print_log(arguments.world.world, arguments.json);
  return kGood;
}

int info(const InfoArguments& arguments) {
  if (log::is_log(arguments.world.world)) return info_of_log(arguments);
  const std::shared_ptr<const world::WorldModel> world = load(arguments.world);
  check_options(arguments.world, *world);
  const world::BodyLayout layout(*world);
  engine::Channels channels;
  Findings findings;
  engine::FleetOptions options;
  options.disabled = arguments.world.disabled;
  options.noise = !arguments.world.no_noise;
  engine::add_simulation_channels(channels, true);
  const engine::Fleet fleet = engine::make_fleet(*world, layout, options, channels, findings);
  world_info_t head{};
  head.version = version();
  head.world = world->name;
  head.step_us = world->step_us;
  const std::vector<world_info_t> parts =
      engine::make_world_info(head, *world, layout, fleet.devices, channels);
  if (arguments.json) {
    print_json(*world, parts);
    return kGood;
  }
  const Style style = style_of(stdout);
  fmt::print("{}{}{}: {}, steps of {:g} ms; {}, {}, {}\n\n", style.bold, for_terminal(world->name),
             style.off, world->file, static_cast<double>(world->step_us) * 1e-3,
             counted(world->models.size(), "model"),
             layout.bodies.size() == 1 ? "1 body that moves"
                                       : fmt::format("{} bodies that move", layout.bodies.size()),
             counted(layout.robots.size(), "robot"));
  print_devices(stdout, parts);
  fmt::print("\n{}Channels{} (-> published by the server, <- taken by it)\n", style.bold,
             style.off);
  print_channels(stdout, parts);
  return kGood;
}

void add_info(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("info",
                                         "print the robots, devices, channels, rates and message "
                                         "types of a world, or what a log holds");
  const auto arguments = std::make_shared<InfoArguments>();
  add_world_arguments(*command, arguments->world);
  command->get_option("WORLD")->description(
      "SDF world or model, or URDF robot (xacro, too); or a log");
  command->add_flag("--json", arguments->json, "print JSON");
  add_types_argument(*command);
  command->callback([arguments, &chosen] { chosen = [arguments] { return info(*arguments); }; });
}

const RegisterCommand kRegister{30, add_info};

}  // namespace
}  // namespace ruedo::cli
