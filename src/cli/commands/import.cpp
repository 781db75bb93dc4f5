// ruedo import: the maps of ROS, Stage and MobileSim as worlds with walls.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>

#include "cli/support/commands.h"
#include "cli/support/range.h"
#include "ruedo/errors.h"
#include "system/output_file.h"
#include "system/to_stderr.h"
#include "world/maps/occupancy.h"

namespace ruedo::cli {
namespace {

struct ImportArguments {
  std::string map, out;
  double resolution = 0, width = 0, height = 1, thickness = 0.05;
  bool allow_absolute = false;
  std::vector<std::string> sizes;  // the options that give one: each is for one kind of map
};

// A size that is given and has no effect would be a world of another size than was meant.
void check_sizes(const ImportArguments& arguments, const std::string& what,
                 const std::vector<std::string>& taken) {
  for (const std::string& name : arguments.sizes) {
    if (std::find(taken.begin(), taken.end(), name) == taken.end())
      throw InputError({}, name + " is not for " + what);
  }
}

int import_map(const ImportArguments& arguments) {
  const std::filesystem::path path = arguments.map;
  std::string kind = path.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  std::vector<world::WallPiece> walls;
  std::string left_out;
  const auto walls_of = [&](const world::OccupancyGrid& grid) {
    try {
      return world::walls_of(grid);
    } catch (const std::runtime_error& error) {
      throw InputError({arguments.map, 0}, error.what());
    }
  };
  if (kind == ".yaml" || kind == ".yml") {
    check_sizes(arguments, "a map's .yaml, which says how large it is", {});
    Findings findings;
    walls = walls_of(world::read_map(arguments.map, findings, arguments.allow_absolute));
    print_findings(findings.list());
  } else if (kind == ".map") {
    check_sizes(arguments, "a .map, which says how large it is", {"--thickness"});
    walls = world::read_armap(arguments.map, arguments.thickness, left_out);
  } else if (kind == ".world" || kind == ".inc") {
    throw InputError(
        {arguments.map, 0},
        "is a world of Stage; import the bitmap that it names, with --width and Stage's size");
  } else {
    check_sizes(arguments, "a picture", {"--resolution", "--width"});
    if (arguments.sizes.empty())
      throw InputError({}, "a bitmap needs --resolution or --width, to know how large it is");
    walls =
        walls_of(arguments.width > 0 ? world::read_bitmap_of_width(arguments.map, arguments.width)
                                     : world::read_bitmap(arguments.map, arguments.resolution));
  }
  const std::string sdf = world::world_of_walls(path.stem().string(), walls, arguments.height);
  if (arguments.out.empty()) {
    fmt::print("{}", sdf);
    return kGood;
  }
  write_file(arguments.out, sdf);
  fmt::print("{}: {} walls{}\n", arguments.out, walls.size(),
             left_out.empty() ? "" : "; left out: " + one_line(shortened(left_out, kLongestSaid)));
  return kGood;
}

void add_import(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("import", "turn a map of ROS, Stage or MobileSim into a world with walls");
  const auto arguments = std::make_shared<ImportArguments>();
  command->add_option("MAP", arguments->map, "map_server's .yaml, ARIA's .map, or a picture")
      ->required();
  command->add_option("-o,--out", arguments->out, "the world (default: standard output)");
  CLI::Option* resolution =
      command->add_option("--resolution", arguments->resolution, "of a picture: side of a pixel, m")
          ->check(within(world::kSmallestCell_m, world::kLargestCell_m));
  CLI::Option* width = command
                           ->add_option("--width", arguments->width,
                                        "of a picture: how wide it is, m (Stage's size)")
                           ->check(within(1e-3, 1e5))
                           ->excludes(resolution);
  command->add_option("--height", arguments->height, "of the walls, m")
      ->capture_default_str()
      ->check(within(0.01, 100.0));
  CLI::Option* thickness =
      command->add_option("--thickness", arguments->thickness, "of a .map's lines, m")
          ->capture_default_str()
          ->check(within(0.001, 10.0));
  command->add_flag("--allow-absolute", arguments->allow_absolute,
                    "let a .yaml name a picture outside its folder");
  command->callback([=, &chosen] {
    for (const CLI::Option* size : {resolution, width, thickness}) {
      if (size->count() > 0) arguments->sizes.push_back(size->get_name());
    }
    chosen = [arguments] { return import_map(*arguments); };
  });
}

const RegisterCommand kRegister{45, add_import};

}  // namespace
}  // namespace ruedo::cli
