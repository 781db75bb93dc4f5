// ruedo edit: serves a world that stands still, and the console that changes it and saves it to one
// file.
#include <filesystem>

#include <fmt/format.h>
#include <unistd.h>

#include "base/input_file.h"
#include "cli/support/run_command.h"
#include "ruedo/errors.h"
#include "world/document/document.h"
#include "world/world_name.h"

namespace fs = std::filesystem;

namespace ruedo::cli {
namespace {

constexpr const char* kNewWorld = "world.sdf";

struct EditArguments {
  std::string world, save_as, view, lcm, record;
};

bool is_there(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

bool is_world_file(const std::string& path) {
  const std::string ending = fs::path(path).extension().string();
  return ending == ".sdf" || ending == ".world";
}

// The name of a file that does not exist yet: a new world.
bool is_new(const EditArguments& arguments) {
  return arguments.world.empty() || (!is_there(arguments.world) && is_world_file(arguments.world));
}

// Whether what is loaded has a <world> of its own that can be written back.
bool has_world(const std::string& path) {
  constexpr size_t kMost = 64u << 20;
  return world::parse_document(read_input(path, kMost), path)->has("world");
}

std::string target(const EditArguments& arguments) {
  if (!arguments.save_as.empty()) return arguments.save_as;
  if (arguments.world.empty()) return kNewWorld;
  if (is_new(arguments)) return arguments.world;
  if (!is_there(arguments.world)) {
    world::world_file(arguments.world);  // throws for an unknown name
    throw InputError({}, "'" + arguments.world +
                             "' is the name of a world that comes with Ruedo or lies in "
                             "RUEDO_PATH: say where to save it by --save-as FILE");
  }
  if (!is_world_file(arguments.world) || !has_world(arguments.world)) {
    throw InputError({}, arguments.world +
                             " holds no world, and is loaded into one: say where to save that by "
                             "--save-as FILE");
  }
  return arguments.world;
}

void check_target(const std::string& file, const EditArguments& arguments) {
  if (!is_world_file(file))
    throw InputError({}, "'" + file + "' is not allowed; a world is saved as FILE.sdf or .world");
  std::error_code error;
  const bool own = is_there(arguments.world) && fs::equivalent(file, arguments.world, error);
  if (is_there(file) && !own) {
    throw InputError({}, file + " is there already, and would be lost: edit that (ruedo edit " +
                             file + "), or choose another name by --save-as FILE");
  }
  const fs::path folder = fs::absolute(file).parent_path();
  if (access(folder.c_str(), W_OK) != 0) {
    throw EnvironmentError(folder.string() +
                           " cannot be written to; choose another place by --save-as FILE");
  }
}

int edit(const EditArguments& arguments) {
  RunArguments run;
  run.world.world = is_new(arguments) ? "empty" : arguments.world;
  run.save = target(arguments);
  check_target(run.save, arguments);
  run.viewed = run.paused = run.quiet = true;
  run.view = arguments.view;
  run.lcm = arguments.lcm;
  run.record = arguments.record;
  fmt::print("Saves to {}\n", run.save);
  return run_world(run);
}

void add_edit(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("edit", "change a world, or make one, in the browser, and save it as SDF");
  const auto arguments = std::make_shared<EditArguments>();
  command
      ->add_option("world", arguments->world,
                   "SDF or URDF file, or a world's name (default: an empty floor)")
      ->type_name("WORLD");
  command
      ->add_option("--save-as", arguments->save_as,
                   "save to this file (default: WORLD; world.sdf for an empty floor)")
      ->type_name("FILE");
  command->add_option("--view", arguments->view, "address of the page (default: 127.0.0.1:8080)")
      ->type_name("ADDRESS:PORT");
  command
      ->add_option("--lcm", arguments->lcm,
                   "LCM address, or auto for a free port (default: $LCM_DEFAULT_URL, or LCM's "
                   "group with ttl 0)")
      ->type_name("URL|auto");
  command->add_option("--record", arguments->record, "write a standard LCM log")->type_name("FILE");
  command->callback([arguments, &chosen] { chosen = [arguments] { return edit(*arguments); }; });
}

const RegisterCommand kRegister{11, add_edit};

}  // namespace
}  // namespace ruedo::cli
