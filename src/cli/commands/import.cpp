// ruedo import: the maps of ROS, Stage and MobileSim, and recorded drives, as worlds with walls.
#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include <fmt/format.h>

#include "base/input_file.h"
#include "cli/support/commands.h"
#include "cli/support/python.h"
#include "cli/support/range.h"
#include "ruedo/errors.h"
#include "system/output_file.h"
#include "system/to_stderr.h"
#include "world/maps/occupancy.h"

namespace ruedo::cli {
namespace {

struct ImportArguments {
  std::string map, out, mount, robot;
  double resolution = 0, width = 0, height = 1, thickness = 0.05;
  bool allow_absolute = false;
  std::vector<std::string> sizes;  // the options that give one: each is for one kind of map
};

// A size without an effect would give a world of an unexpected size.
void check_sizes(const ImportArguments& arguments, const std::string& what,
                 const std::vector<std::string>& taken) {
  for (const std::string& name : arguments.sizes) {
    if (std::find(taken.begin(), taken.end(), name) == taken.end())
      throw InputError({}, name + " is not for " + what);
  }
}

// A log of any kind that ruedo.fit reads, by its first bytes.
bool is_recorded_drive(const std::filesystem::path& path) {
  if (std::filesystem::is_directory(path)) return true;
  std::string head(512, '\0');
  const InputFile input = open_to_look(path.string());
  head.resize(std::fread(head.data(), 1, head.size(), input.file.get()));
  for (const char* begin :
       {"\x1f\x8b", "\xed\xa1\xda\x01", "#ROSBAG", "\x89MCAP", "SQLite format 3", "FLASER ",
        "ROBOTLASER1 ", "ODOM ", "PARAM ", "# message formats"}) {
    if (head.rfind(begin, 0) == 0) return true;
  }
  const std::string line = head.substr(0, head.find('\n'));
  const bool is_text = std::all_of(line.begin(), line.end(), [](unsigned char c) {
    return std::isprint(c) || c == '\t' || c == '\r';
  });
  return is_text && std::count(line.begin(), line.end(), ',') >= 3;  // a table
}

int import_drive(const ImportArguments& arguments) {
  check_sizes(arguments, "a recorded drive", {"--resolution"});
  std::vector<std::string> words{"import", arguments.map, "--height",
                                 fmt::format("{}", arguments.height)};
  const auto add = [&words](const char* option, const std::string& value) {
    if (!value.empty()) words.push_back(fmt::format("{}={}", option, value));
  };
  add("--out", arguments.out);
  add("--mount", arguments.mount);
  add("--of", arguments.robot);
  if (arguments.resolution > 0) add("--resolution", fmt::format("{}", arguments.resolution));
  return hand_over_to_python("ruedo.fit.cli", "'ruedo[fit]'", words);
}

int import_map(const ImportArguments& arguments) {
  const std::filesystem::path path = arguments.map;
  if (is_recorded_drive(path)) return import_drive(arguments);
  if (!arguments.mount.empty() || !arguments.robot.empty())
    throw InputError({}, "--mount and --of apply to recorded drives only");
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
  CLI::App* command = app.add_subcommand(
      "import",
      "turn a map of ROS, Stage or MobileSim, or a recorded drive, into a world with walls");
  const auto arguments = std::make_shared<ImportArguments>();
  command
      ->add_option("MAP", arguments->map,
                   "map_server's .yaml, ARIA's .map, a picture, or a log of a drive with scans")
      ->required();
  command->add_option("-o,--out", arguments->out, "the world (default: standard output)");
  CLI::Option* resolution =
      command
          ->add_option("--resolution", arguments->resolution,
                       "side of a pixel of a picture, or of a map cell of a drive (m)")
          ->check(within(world::kSmallestCell_m, world::kLargestCell_m));
  CLI::Option* width =
      command->add_option("--width", arguments->width, "width of a picture (m; Stage's size)")
          ->check(within(1e-3, 1e5))
          ->excludes(resolution);
  command->add_option("--height", arguments->height, "height of the walls (m)")
      ->capture_default_str()
      ->check(within(0.01, 100.0));
  CLI::Option* thickness =
      command->add_option("--thickness", arguments->thickness, "thickness of a .map's lines (m)")
          ->capture_default_str()
          ->check(within(0.001, 10.0));
  command
      ->add_option("--mount", arguments->mount,
                   "pose of a drive's range finder on the robot, X,Y,YAW (m, rad; default 0,0,0)")
      ->type_name("X,Y,YAW");
  command->add_option("--of", arguments->robot, "robot to use, of a drive with several")
      ->type_name("ROBOT");
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
