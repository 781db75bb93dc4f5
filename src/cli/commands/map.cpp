// ruedo map: the occupancy map of a world, as navigation stacks read it.
#include <algorithm>

#include <fmt/format.h>

#include "cli/support/commands.h"
#include "cli/support/find_all.h"
#include "cli/support/range.h"
#include "ruedo/errors.h"
#include "world/maps/occupancy.h"

namespace ruedo::cli {
namespace {

struct MapArguments {
  WorldArguments world;
  std::string out;
  double resolution = 0.05, height = 0.2;
};

int map(const MapArguments& arguments) {
  if (!arguments.out.ends_with(".yaml") && !arguments.out.ends_with(".yml"))
    throw InputError({}, "-o '" + arguments.out + "': the name ends in .yaml");
  const auto world = load(arguments.world);
  check_options(arguments.world, *world);
  world::OccupancyGrid grid = world::occupancy_of(*world, arguments.resolution, arguments.height);
  world::mark_outside(*world, grid);
  world::write_map(grid, arguments.out);
  const auto count = [&](world::Cell kind) {
    return std::count(grid.cells.begin(), grid.cells.end(), kind);
  };
  fmt::print("{}: {} x {} cells of {:g} m, {} occupied, {} unknown, cut at z = {:g} m\n",
             arguments.out, grid.width, grid.height, grid.resolution, count(world::Cell::occupied),
             count(world::Cell::unknown), arguments.height);
  return kGood;
}

void add_map(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("map", "write the occupancy map of a world, as ROS's map_server reads it");
  const auto arguments = std::make_shared<MapArguments>();
  add_world_arguments(*command, arguments->world);
  command->add_option("-o,--out", arguments->out, "the map's .yaml; the picture goes beside it")
      ->required();
  command->add_option("--resolution", arguments->resolution, "side of a cell, m")
      ->capture_default_str()
      ->check(within(0.001, 100.0));
  command->add_option("--height", arguments->height, "height of the cut through the world: z, m")
      ->capture_default_str()
      ->check(within(-1e5, 1e5));
  command->callback([arguments, &chosen] { chosen = [arguments] { return map(*arguments); }; });
}

const RegisterCommand kRegister{46, add_map};

}  // namespace
}  // namespace ruedo::cli
