// Shared parts of the program's commands: their registration, the options for the world, exit
// codes, and printing.
//
// A command is one file: a function that adds a subcommand, and one registration at its end.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "run/wait_for.h"
#include "world/load.h"

namespace ruedo::cli {

enum ExitCode {
  kGood = 0,
  kCheckFailed = 1,
  kWrongUsage = 2,
  kBadInput = 3,
  kEnvironment = 4,
  kBrokenState = 5
};

// Runs after the whole command line was read; returns the exit code. InputError and
// EnvironmentError may come out.
using Action = std::function<int()>;

// Put one at namespace scope: static const RegisterCommand kRegister{10, add_run}; commands are
// listed by `order`. `add` adds a subcommand whose callback sets `chosen`.
struct RegisterCommand {
  using Add = void (*)(CLI::App& app, Action& chosen);
  RegisterCommand(int order, Add add);
};
std::vector<RegisterCommand::Add> registered_commands();

// The world and what is changed in it, for every command that loads one.
struct WorldArguments {
  std::string world;
  std::vector<std::string> spawns, drives, settings, disabled, xacro_arguments, faults;
  bool no_noise = false, allow_absolute = false, fast_pixels = false, mesa_environment = false;
};
// WORLD, --spawn, --drive, --set, --disable, --fault, --xacro-arg, --no-noise, --allow-absolute,
// --fast-pixels, --mesa-environment.
void add_world_arguments(CLI::App& command, WorldArguments& arguments);
// Throws InputError; for wrong usage it names no file.
world::LoadOptions load_options(const WorldArguments& arguments);
std::shared_ptr<const world::WorldModel> load(const WorldArguments& arguments);
// --fast-pixels and --mesa-environment, before any context is made; load() does it, too.
void draw_as_told(const WorldArguments& arguments);
// Those of them that change a result, as on the command line: for a log's header.
std::vector<std::string> result_options(const WorldArguments& arguments);
// Of a log whose pictures Mesa's variables act on: those that are set here.
std::vector<std::string> mesa_options();

std::pair<std::string, std::string> parse_remap(const std::string& text);  // CHANNEL=NAME
// Of one command line: none may be renamed twice.
std::vector<std::pair<std::string, std::string>> parse_remaps(
    const std::vector<std::string>& texts);
run::WaitForOption parse_wait_for(const std::string& text);  // CHANNEL@HZ
// 0.0001 to 1e6, or "max": +inf. option: names it in the error.
double parse_rate(const std::string& text, const std::string& option = "--rate");
int64_t parse_duration_us(const std::string& text);  // seconds

// The findings with the same text, of several places.
struct FindingGroup {
  Finding::Kind kind;
  std::string text;
  std::vector<const Finding*> places;  // in the order of the files
};
std::vector<FindingGroup> group(const std::vector<Finding>& findings);
const char* kind_name(Finding::Kind kind);  // "unsupported", "repaired", "error"
// One line a group on stderr.
void print_findings(const std::vector<Finding>& findings);

// Colours for a stream, empty if it is not a terminal or NO_COLOR is set.
struct Style {
  const char *bold = "", *dim = "", *red = "", *yellow = "", *green = "", *cyan = "", *off = "";
};
Style style_of(FILE* stream);

}  // namespace ruedo::cli
