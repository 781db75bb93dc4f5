// Options that several commands share, read strictly: a wrong one says what it should look like.
#include "cli/support/commands.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <tuple>

#include <fmt/format.h>
#include <unistd.h>

#include "base/option_text.h"
#include "base/warnings.h"
#include "base/whole.h"
#include "cli/support/extensions.h"
#include "log/header.h"
#include "ruedo/errors.h"
#include "ruedo/sim_time.h"
#include "run/pacer.h"
#include "scene/gl/mesas_environment.h"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

std::vector<std::pair<int, RegisterCommand::Add>>& commands() {
  static std::vector<std::pair<int, RegisterCommand::Add>> list;
  return list;
}

}  // namespace

RegisterCommand::RegisterCommand(int order, Add add) { commands().emplace_back(order, add); }

std::vector<RegisterCommand::Add> registered_commands() {
  auto sorted = commands();
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<RegisterCommand::Add> list;
  for (const auto& [order, add] : sorted) list.push_back(add);
  return list;
}

void add_world_arguments(CLI::App& command, WorldArguments& arguments) {
  command.add_option("WORLD", arguments.world, "SDF world or model, or URDF robot (xacro, too)")
      ->required();
  add_plugin_argument(command);
  command
      .add_option("--spawn", arguments.spawns,
                  "place a model on the ground: MODEL[:NAME]@X,Y[,YAW] (m, rad); a file, or one of "
                  "ours (p3at)")
      ->type_name("SPAWN")
      ->allow_extra_args(false);
  command
      .add_option("--drive", arguments.drives,
                  "give a model a drive by its wheel joints: ROBOT=LEFT[+LEFT...],RIGHT[+RIGHT...]")
      ->type_name("DRIVE")
      ->allow_extra_args(false);
  command.add_option("--set", arguments.settings, "change a device: ROBOT/DEVICE.KEY=VALUE")
      ->type_name("SETTING")
      ->allow_extra_args(false);
  command.add_option("--disable", arguments.disabled, "leave a device out: ROBOT/DEVICE")
      ->type_name("DEVICE")
      ->allow_extra_args(false);
  command
      .add_option("--xacro-arg", arguments.xacro_arguments,
                  "an argument of a xacro file: NAME:=VALUE")
      ->type_name("ARGUMENT")
      ->allow_extra_args(false);
  command
      .add_option(
          "--fault", arguments.faults,
          "inject a fault: [ROBOT][/TARGET]:KIND@SECONDS[,for=S][,value=V]... (docs/campaigns.md)")
      ->type_name("FAULT")
      ->allow_extra_args(false);
  command.add_flag("--no-noise", arguments.no_noise, "sensors give their ideal values");
  command.add_flag(
      "--fast-pixels", arguments.fast_pixels,
      "draw with this CPU's widest vectors: faster, but pixels may differ between CPUs");
  command.add_flag("--mesa-environment", arguments.mesa_environment,
                   "let Mesa's environment variables act on pictures, such as GALLIUM_DRIVER");
  command.add_flag("--allow-absolute", arguments.allow_absolute,
                   "absolute paths in files may lead out of the search folders");
}

std::pair<std::string, std::string> parse_remap(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    refuse_option("--remap", text, "it looks like CHANNEL=NAME, for example p3at/LRF=LASER");
  }
  return {text.substr(0, equals), text.substr(equals + 1)};
}

std::vector<std::pair<std::string, std::string>> parse_remaps(
    const std::vector<std::string>& texts) {
  std::vector<std::pair<std::string, std::string>> remaps;
  for (const std::string& text : texts) {
    auto remap = parse_remap(text);
    for (const auto& [name, other] : remaps) {
      if (name == remap.first)
        refuse_option("--remap", text, name + " has a new name already: " + other);
    }
    remaps.push_back(std::move(remap));
  }
  return remaps;
}

run::WaitForOption parse_wait_for(const std::string& text) {
  const char* allowed =
      "it looks like CHANNEL@HZ, for example p3at/velocity@10, with a rate above 0";
  const size_t at = text.rfind('@');
  if (at == std::string::npos || at == 0) refuse_option("--wait-for", text, allowed);
  run::WaitForOption option{text.substr(0, at), {}};
  try {
    option.rate = Rate::parse(text.substr(at + 1));
  } catch (const std::invalid_argument&) {
    refuse_option("--wait-for", text, allowed);
  }
  if (option.rate.every_step()) refuse_option("--wait-for", text, allowed);
  return option;
}

double parse_rate(const std::string& text, const std::string& option) {
  double rate = 0.0;
  if (text == "max") return std::numeric_limits<double>::infinity();
  if (!read_number(text, rate) || !run::Pacer::takes(rate))
    refuse_option(option, text, "0.0001 to 1e6 (1 is real time), or max");
  return rate;
}

int64_t parse_duration_us(const std::string& text) {
  double seconds = 0.0;
  if (!read_number(text, seconds) || seconds < 0.0 || seconds > 1e9)
    refuse_option("--duration", text, "seconds of sim time, 0 to 1e9");
  return microseconds(seconds);
}

world::LoadOptions load_options(const WorldArguments& arguments) {
  world::LoadOptions options;
  for (const std::string& text : arguments.spawns)
    options.spawns.push_back(world::parse_spawn(text));
  for (const std::string& text : arguments.drives)
    options.drives.push_back(world::parse_drive(text));
  for (const std::string& text : arguments.xacro_arguments) {
    const size_t sign = text.find(":=");
    if (sign == std::string::npos || sign == 0)
      refuse_option("--xacro-arg", text,
                    "it looks like NAME:=VALUE, for example laser_enabled:=true");
  }
  options.xacro_arguments = arguments.xacro_arguments;
  options.allow_absolute = arguments.allow_absolute;
  for (const std::string& text : arguments.settings) {
    world::Setting setting = world::parse_setting(text);
    for (const world::Setting& other : options.settings) {
      if (std::tie(other.robot, other.device, other.key) ==
          std::tie(setting.robot, setting.device, setting.key))
        refuse_option("--set", text, "it is set already, to " + other.value);
    }
    options.settings.push_back(std::move(setting));
  }
  for (const std::string& text : arguments.disabled) {
    if (text.find('/') == std::string::npos)
      refuse_option("--disable", text, "it looks like ROBOT/DEVICE, for example p3at/CAMERA");
  }
  options.disabled = arguments.disabled;
  for (const std::string& text : arguments.faults)
    options.faults.push_back(world::parse_fault(text));
  return options;
}

void draw_as_told(const WorldArguments& arguments) {
  if (arguments.fast_pixels) scene::draw_as_fast_as_it_goes();
  if (arguments.mesa_environment) scene::heed_mesas_variables();
}

std::shared_ptr<const world::WorldModel> load(const WorldArguments& arguments) {
  draw_as_told(arguments);
  load_given_plugins();
  return world::load_world(arguments.world, load_options(arguments));
}

std::vector<std::string> mesa_options() {
  std::vector<std::string> options = scene::mesas_variables();
  for (std::string& variable : options) variable.insert(0, log::kMesaOption);
  return options;
}

std::vector<std::string> result_options(const WorldArguments& arguments) {
  std::vector<std::string> options;
  for (const std::string& text : arguments.spawns) options.push_back("--spawn=" + text);
  for (const std::string& text : arguments.drives) options.push_back("--drive=" + text);
  for (const std::string& text : arguments.xacro_arguments)
    options.push_back("--xacro-arg=" + text);
  if (arguments.allow_absolute) options.push_back("--allow-absolute");
  for (const std::string& text : arguments.settings) options.push_back("--set=" + text);
  for (const std::string& text : arguments.disabled) options.push_back("--disable=" + text);
  for (const std::string& text : arguments.faults) options.push_back("--fault=" + text);
  if (arguments.no_noise) options.push_back("--no-noise");
  if (arguments.fast_pixels) options.push_back("--fast-pixels");
  if (arguments.mesa_environment) {
    options.push_back("--mesa-environment");
    for (std::string& one : mesa_options()) options.push_back(std::move(one));
  }
  return options;
}

const char* kind_name(Finding::Kind kind) {
  switch (kind) {
    case Finding::Kind::unsupported: return "unsupported";
    case Finding::Kind::repaired: return "repaired";
    case Finding::Kind::error: return "error";
  }
  return "";
}

std::vector<FindingGroup> group(const std::vector<Finding>& findings) {
  std::vector<FindingGroup> groups;
  std::map<std::pair<int, std::string>, size_t> index;
  for (const Finding& finding : findings) {
    const auto [found, added] =
        index.try_emplace({static_cast<int>(finding.kind), finding.text}, groups.size());
    if (added) groups.push_back({finding.kind, finding.text, {}});
    groups[found->second].places.push_back(&finding);
  }
  return groups;
}

void print_findings(const std::vector<Finding>& findings) {
  const Style style = style_of(stderr);
  for (const FindingGroup& group : group(findings)) {
    const Finding& first = *group.places.front();
    const std::string more =
        group.places.size() > 1
            ? fmt::format(" (and {} more places; see ruedo check)", group.places.size() - 1)
            : "";
    keep_warning(kind_name(group.kind),
                 fmt::format("{}: {}: {}{}", first.source.str(), first.element, group.text, more));
    const char* colour = group.kind == Finding::Kind::error ? style.red : style.yellow;
    to_stderr("{}{}{}: {}: {}: {}{}{}{}\n", colour, kind_name(group.kind), style.off,
              first.source.str(), first.element, group.text, style.dim, more, style.off);
  }
}

Style style_of(FILE* stream) {
  const char* terminal = std::getenv("TERM");
  const bool dumb = terminal && std::string_view(terminal) == "dumb";
  if (!isatty(fileno(stream)) || std::getenv("NO_COLOR") || dumb) return {};
  return {"\033[1m", "\033[2m", "\033[31m", "\033[33m", "\033[32m", "\033[36m", "\033[0m"};
}

}  // namespace ruedo::cli
