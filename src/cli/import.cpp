// ruedo import: the maps of ROS, Stage and MobileSim as worlds with walls.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>

#include "cli/commands.h"
#include "cli/range.h"
#include "core/output_file.h"
#include "model/occupancy.h"
#include "ruedo/errors.h"

namespace ruedo::cli {
namespace {

struct ImportArguments {
  std::string map, out;
  double resolution = 0, width = 0, height = 1, thickness = 0.05;
};

int import_map(const ImportArguments& arguments) {
  const std::filesystem::path path = arguments.map;
  std::string kind = path.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::vector<model::WallPiece> walls;
  std::string left_out;
  const auto walls_of = [&](const model::OccupancyGrid& grid) {
    try {
      return model::walls_of(grid);
    } catch (const std::runtime_error& error) {
      throw InputError({arguments.map, 0}, error.what());
    }
  };
  if (kind == ".yaml" || kind == ".yml") {
    walls = walls_of(model::read_map(arguments.map));
  } else if (kind == ".map") {
    walls = model::read_armap(arguments.map, arguments.thickness, left_out);
  } else if (kind == ".world" || kind == ".inc") {
    throw InputError(
        {arguments.map, 0},
        "is a world of Stage; import the bitmap that it names, with --width and Stage's size");
  } else {
    if ((arguments.resolution > 0) == (arguments.width > 0))
      throw InputError({}, "a bitmap needs --resolution or --width, to know how large it is");
    model::OccupancyGrid grid =
        model::read_bitmap(arguments.map, arguments.resolution > 0 ? arguments.resolution : 1);
    if (arguments.width > 0) {
      grid.resolution = arguments.width / grid.width;
      grid.x *= grid.resolution;
      grid.y *= grid.resolution;
    }
    walls = walls_of(grid);
  }
  const std::string sdf = model::world_of_walls(path.stem().string(), walls, arguments.height);
  if (arguments.out.empty()) {
    fmt::print("{}", sdf);
    return kGood;
  }
  write_file(arguments.out, sdf);
  fmt::print("{}: {} walls{}\n", arguments.out, walls.size(),
             left_out.empty() ? "" : "; left out: " + left_out);
  return kGood;
}

void add_import(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("import", "turn a map of ROS, Stage or MobileSim into a world with walls");
  const auto arguments = std::make_shared<ImportArguments>();
  command->add_option("MAP", arguments->map, "map_server's .yaml, ARIA's .map, or a picture")
      ->required();
  command->add_option("-o,--out", arguments->out, "the world (default: standard output)");
  command->add_option("--resolution", arguments->resolution, "of a picture: side of a pixel, m")
      ->check(within(1e-4, 1000.0));
  command->add_option("--width", arguments->width, "of a picture: how wide it is, m (Stage's size)")
      ->check(within(1e-3, 1e5));
  command->add_option("--height", arguments->height, "of the walls, m")
      ->capture_default_str()
      ->check(within(0.01, 100.0));
  command->add_option("--thickness", arguments->thickness, "of a .map's lines, m")
      ->capture_default_str()
      ->check(within(0.001, 10.0));
  command->callback(
      [arguments, &chosen] { chosen = [arguments] { return import_map(*arguments); }; });
}

const RegisterCommand kRegister{45, add_import};

}  // namespace
}  // namespace ruedo::cli
