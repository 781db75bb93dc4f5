// Occupancy maps: a cut through a world computed by hand, the round trip through map_server's
// files, ArMap, and faulty files.
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "world/load.h"
#include "world/maps/occupancy.h"

namespace ruedo::world {
namespace {

std::string world_of(const std::string& models) {
  return "<sdf version='1.9'><world name='w'>" + models + "</world></sdf>";
}

std::string shape(const std::string& name, const std::string& pose, const std::string& geometry,
                  const std::string& beside = "<static>true</static>") {
  return "<model name='" + name + "'>" + beside + "<pose>" + pose +
         "</pose><link name='l'><collision name='c'><geometry>" + geometry +
         "</geometry></collision></link></model>";
}

std::shared_ptr<const WorldModel> load(const std::string& models) {
  return load_world_text(world_of(models), "/nowhere/w.sdf");
}

// As text, with the far row first, as one looks at a map.
std::string drawn(const OccupancyGrid& grid) {
  std::string text;
  for (int row = grid.height - 1; row >= 0; --row) {
    for (int column = 0; column < grid.width; ++column)
      text += grid.at(column, row) == Cell::occupied ? '#'
              : grid.at(column, row) == Cell::free   ? '.'
                                                     : '?';
    text += '\n';
  }
  return text;
}

TEST(Map, WorldCutByHand) {
  const auto world =
      load(shape("ground", "0 0 0 0 0 0", "<plane/>") +
           shape("wall", "1 0.25 0.5 0 0 0",
                 "<box><size>2 0.5 1</size></box>") +  // x 0 to 2, y 0 to 0.5
           shape("crate", "1.75 0.75 0.2 0 0 0", "<box><size>0.5 0.5 0.4</size></box>",
                 "") +  // moves, but is not a robot
           shape("low", "0.25 1.25 0.05 0 0 0", "<box><size>0.5 0.5 0.1</size></box>") +
           shape("roof", "1 1 3 0 0 0", "<box><size>20 20 0.1</size></box>"));
  const OccupancyGrid grid = occupancy_of(*world, 0.5, 0.3);
  EXPECT_EQ(grid.x, -1);  // a metre around what is cut
  EXPECT_EQ(grid.y, -1);
  EXPECT_EQ(drawn(grid), "........\n........\n.....#..\n..####..\n........\n........\n");
  const OccupancyGrid above = occupancy_of(*world, 0.5, 0.7);  // over the crate
  EXPECT_EQ(drawn(above), "........\n........\n..####..\n........\n........\n");
}

TEST(Map, LeavesOutRobotsAndWalkers) {
  const auto world =
      load(shape("robot", "0 0 0.5 0 0 0", "<box><size>1 1 1</size></box>",
                 "<link name='s'><sensor name='imu' type='imu'/></link>") +
           shape("walker", "5 0 0.5 0 0 0", "<box><size>1 1 1</size></box>",
                 "<ruedo:path><ruedo:waypoint>0 0 0 0 0 0 0</ruedo:waypoint></ruedo:path>"));
  const OccupancyGrid grid = occupancy_of(*world, 0.5, 0.5);
  EXPECT_EQ(std::count(grid.cells.begin(), grid.cells.end(), Cell::occupied), 0);
}

TEST(Map, MeshesGiveTheirOutline) {
  const auto world = load(shape("hall", "0 0 0 0 0 0",
                                "<polyline><point>0.1 0.1</point><point>1.9 0.1</point><point>1.9 "
                                "1.9</point><point>0.1 1.9</point><height>1</height></polyline>"));
  EXPECT_EQ(drawn(occupancy_of(*world, 0.5, 0.5)),
            "........\n........\n..####..\n..#..#..\n..#..#..\n..####..\n........\n........\n");
}

// A closed yard of 2 x 2 m with walls of 1 m.
std::string yard(const std::string& robot_at) {
  const auto wall = [](const char* name, const std::string& at, const std::string& size) {
    return shape(name, at + " 0.5 0 0 0", "<box><size>" + size + " 1</size></box>");
  };
  return wall("north", "0 1.5", "4 1") + wall("south", "0 -1.5", "4 1") +
         wall("east", "1.5 0", "1 2") + wall("west", "-1.5 0", "1 2") +
         (robot_at.empty() ? ""
                           : "<model name='robot'><pose>" + robot_at +
                                 " 0 0 0 0</pose><link name='l'><sensor name='s' type='imu'/>"
                                 "</link></model>");
}

TEST(Map, OutsideOfTheWallsCellsAreUnknown) {
  const auto map_of = [](const std::string& robot_at) {
    const auto world = load(yard(robot_at));
    OccupancyGrid grid = occupancy_of(*world, 1, 0.5);
    mark_outside(*world, grid);
    return drawn(grid);
  };
  EXPECT_EQ(map_of("0 0"), "??????\n?####?\n?#..#?\n?#..#?\n?####?\n??????\n");
  // It goes where the robot can.
  const std::string free = "......\n.####.\n.#..#.\n.#..#.\n.####.\n......\n";
  EXPECT_EQ(map_of("2.5 0"), free);
  EXPECT_EQ(map_of(""), free);
  EXPECT_EQ(map_of("1.5 0"), free);  // in a wall
}

TEST(Map, TooManyCellsAreRefused) {
  const auto world = load(shape("wall", "0 0 0 0 0 0", "<box><size>1000 1000 1</size></box>"));
  EXPECT_THROW(occupancy_of(*world, 0.01, 0), InputError);
}

// World to map, to walls, to map: the same bytes.
TEST(Map, RoundTrip) {
  TemporaryFolder folder;
  const auto bytes = [](const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  write_map(
      occupancy_of(*load_world(std::string(RUEDO_SOURCE_DIR) + "/worlds/arena.sdf"), 0.05, 0.2),
      folder / "one.yaml");
  Findings findings;
  const OccupancyGrid read = read_map(folder / "one.yaml", findings);
  const std::vector<WallPiece> walls = walls_of(read);
  EXPECT_GT(walls.size(), 4u);
  EXPECT_LT(
      walls.size(),
      static_cast<size_t>(std::count(read.cells.begin(), read.cells.end(), Cell::occupied)) / 4);
  const auto world = load_world(folder.write("walls.sdf", world_of_walls("walls", walls, 1)));
  EXPECT_TRUE(world->findings.empty());
  write_map(occupancy_of(*world, 0.05, 0.5), folder / "two.yaml");
  EXPECT_EQ(bytes(folder / "two.pgm"), bytes(folder / "one.pgm"));
  EXPECT_NE(bytes(folder / "one.yaml").find("\nresolution: 0.05\norigin: ["), std::string::npos)
      << bytes(folder / "one.yaml");
}

// A map of 3 x 2 pixels, turned by a quarter: the wall along the picture's left side lies along x
// = 10.
TEST(Map, MapServerFile) {
  TemporaryFolder folder;
  folder.write("m.pgm", std::string("P5\n3 2\n255\n") + std::string("\x00\xfe\xcd\x00\xfe\xfe", 6));
  const std::string path = folder.write("m.yaml",
                                        "# made by hand\nimage: \"m.pgm\"\nresolution: 0.5  # "
                                        "m\norigin:\n- 10\n- 20\n- 1.5707963267948966\nnegate: 0\n"
                                        "occupied_thresh: 0.65\nfree_thresh: 0.196\n");
  Findings findings;
  const OccupancyGrid grid = read_map(path, findings);
  EXPECT_EQ(drawn(grid), "#.?\n#..\n");
  const auto walls = walls_of(grid);
  ASSERT_EQ(walls.size(), 1u);
  EXPECT_NEAR(walls[0].x, 9.5, 1e-12);  // (0.25, 0.5) in the map's frame
  EXPECT_NEAR(walls[0].y, 20.25, 1e-12);
  EXPECT_NEAR(walls[0].length, 0.5, 1e-12);
  EXPECT_NEAR(walls[0].width, 1.0, 1e-12);
  // A raw map holds the occupancy in per cent, and 255 for unknown.
  folder.write("raw.pgm", std::string("P5\n3 1\n255\n") + "\x64\xff" + std::string(1, '\0'));
  EXPECT_EQ(
      drawn(read_map(
          folder.write("raw.yaml",
                       "image: raw.pgm\nresolution: 1\norigin: [0, 0, 0]\nmode: raw\nnegate: 0\n"),
          findings)),
      "#?.\n");
  EXPECT_THROW(
      read_map(
          folder.write("odd.yaml", "image: raw.pgm\nresolution: 1\norigin: [0, 0, 0]\nmode: row\n"),
          findings),
      InputError);
  const OccupancyGrid bitmap = read_bitmap(folder / "m.pgm", 2);
  EXPECT_TRUE(findings.list().empty());
  EXPECT_EQ(drawn(bitmap), "#..\n#..\n");
  EXPECT_EQ(bitmap.x, -3);
  EXPECT_EQ(bitmap.y, -2);
}

TEST(Map, ArMap) {
  TemporaryFolder folder;
  const std::string head =
      "2D-Map\nLineMinPos: 0 0\nResolution: 20\nCairn: Goal 0 0 0 \"\" ICON \"door\"\nLINES\n";
  std::string left_out;
  const auto walls =
      read_armap(folder.write("a.map", head + "0 0 3000 0\r\n3000 0 3000 4000\nDATA\n5 5\n6 5\n"),
                 0.1, left_out);
  ASSERT_EQ(walls.size(), 2u);
  EXPECT_DOUBLE_EQ(walls[0].x, 1.5);
  EXPECT_DOUBLE_EQ(walls[0].length, 3.1);
  EXPECT_DOUBLE_EQ(walls[1].y, 2);
  EXPECT_DOUBLE_EQ(walls[1].yaw, M_PI / 2);
  EXPECT_DOUBLE_EQ(walls[1].width, 0.1);
  EXPECT_EQ(left_out, "2 points, 1 Goal");
  left_out.clear();
  const auto points =
      read_armap(folder.write("p.map", "2D-Map\nResolution: 20\nDATA\n1000 -500\n"), 0.1, left_out);
  ASSERT_EQ(points.size(), 1u);
  EXPECT_DOUBLE_EQ(points[0].y, -0.5);
  EXPECT_DOUBLE_EQ(points[0].length, 0.02);
}

// The error of reading a map; nothing if it is valid.
std::optional<InputError> error_of(const std::string& path) {
  std::string left_out;
  Findings findings;
  try {
    if (path.ends_with(".yaml"))
      read_map(path, findings);
    else
      read_armap(path, 0.1, left_out);
  } catch (const InputError& error) {
    return error;
  }
  return std::nullopt;
}

TEST(Map, ReportsMalformedFiles) {
  TemporaryFolder folder;
  folder.write("ok.pgm", std::string("P5\n1 1\n255\n\x00", 12));
  folder.write("no.png", "hello");
  const auto error = [&](const std::string& name, const std::string& text) {
    const auto e = error_of(folder.write(name, text));
    return e ? e->source().str().substr(folder.path().size() + 1) + ": " + e->message() : "";
  };
  EXPECT_EQ(error("a.yaml", "image: ok.pgm\nresolution: 0.05\n"), "a.yaml: has no 'origin'");
  EXPECT_EQ(error("a.yaml", "image: ok.pgm\nresolution: fine\norigin: [0,0,0]\n"),
            "a.yaml:2: resolution: 'fine' is not a number");
  EXPECT_EQ(error("a.yaml", "image: ok.pgm\nresolution: -1\norigin: [0,0,0]\n"),
            "a.yaml:2: resolution: '-1' is not allowed; allowed is 0.0001 to 1000 m");
  EXPECT_EQ(error("a.yaml", "image: ok.pgm\nresolution: 1e-308\norigin: [0,0,0]\n"),
            "a.yaml:2: resolution: '1e-308' is not allowed; allowed is 0.0001 to 1000 m");
  EXPECT_EQ(error("a.yaml", "image: ok.pgm\nresolution: 1\norigin: [0, 1e308, 0]\n"),
            "a.yaml:3: origin: '[0, 1e308, 0]' is not allowed; allowed is up to 1000000 m and rad");
  EXPECT_EQ(error("a.yaml", "image: ok.pgm\nresolution: 1\norigin: [0]\n"),
            "a.yaml:3: origin: '[0]' is not allowed; allowed is [x, y, yaw]");
  EXPECT_EQ(error("a.yaml", "image: none.pgm\nresolution: 1\norigin: [0, 0, 0]\n"),
            "none.pgm: no such file");
  EXPECT_EQ(error("a.yaml", "image: no.png\nresolution: 1\norigin: [0, 0, 0]\n"),
            "no.png: it is not a picture that can be read (pgm, png, jpeg, bmp, tiff)");
  const std::string good = "image: ok.pgm\nresolution: 1\norigin: [0, 0, 0]\n";
  EXPECT_EQ(error("a.yaml", "\xEF\xBB\xBF" + good), "");  // as editors of Windows begin a text
  EXPECT_EQ(error("a.yaml", good + "resolution: 2\n"),
            "a.yaml:4: a second 'resolution'; the first is in line 2");
  EXPECT_EQ(error("a.yaml", good + "negate: 2\n"),
            "a.yaml:4: negate: '2' is not allowed; allowed are 0, 1, false and true");
  EXPECT_EQ(error("a.yaml", good + "occupied_thresh: 65\n"),
            "a.yaml:4: occupied_thresh: '65' is not allowed; allowed is 0 to 1");
  EXPECT_EQ(error("a.yaml", good + "free_thresh: -1\n"),
            "a.yaml:4: free_thresh: '-1' is not allowed; allowed is 0 to 1");
  EXPECT_EQ(error("a.yaml", "hello\n"), "a.yaml:1: 'hello' is not a 'key: value'");
  EXPECT_EQ(error("a.map", "hello\n"),
            "a.map:1: is not a map of MobileSim and ARIA: it does not begin with '2D-Map'");
  EXPECT_EQ(error("a.map", "2D-Map\nLINES\n1 2 3\n"),
            "a.map:3: '1 2 3' is not allowed; allowed are x1 y1 x2 y2, in mm");
  EXPECT_EQ(error("a.map", "2D-Map\nLINES\n1 2 3 x\n"), "a.map:3: LINES: 'x' is not a number");
  EXPECT_EQ(error("a.map", "2D-Map\n"), "a.map: holds no LINES and no DATA");
  EXPECT_EQ(error("a.yaml", good + "occupied_thresh: 0.1\nfree_thresh: 0.9\n"),
            "a.yaml:5: free_thresh: '0.9' is not allowed; allowed is up to occupied_thresh, 0.1");
}

// Errors that `ruedo check` would refuse in the world are refused in the map.
TEST(Map, WallsAreAsFarAndAsManyAsAWorldTakes) {
  TemporaryFolder folder;
  folder.write("m.pgm", std::string("P5\n1001 1\n255\n") + std::string(1001, '\0'));
  const auto error = [&](const std::string& name, const std::string& text) {
    const auto e = error_of(folder.write(name, text));
    return e ? std::to_string(e->source().line) + ": " + e->message() : "";
  };
  EXPECT_EQ(error("a.yaml", "image: m.pgm\nresolution: 1000\norigin: [0, 0, 0]\n"),
            "2: with cells of 1000 m the map is 1001000 x 1000 m large and begins at 0, 0; allowed "
            "are walls within 1000000 m of the origin");
  EXPECT_NE(error("a.yaml", "image: m.pgm\nresolution: 1\norigin: [1e6, 0, 0]\n"), "");
  EXPECT_EQ(error("a.yaml", "image: m.pgm\nresolution: 1\norigin: [900000, 0, 0]\n"), "");
  EXPECT_EQ(error("a.map", "2D-Map\nLINES\n0 0 1e12 0\n"),
            "3: '0 0 1e12 0' is not allowed; allowed are coordinates of up to 1000000000 mm");
  EXPECT_EQ(error("a.map", "2D-Map\nLINES\n-9e8 0 9e8 0\n"),
            "3: '-9e8 0 9e8 0' is not allowed; allowed are lines of up to 1000000000 mm");
  for (const char* size : {"1e300", "-20", "0"})
    EXPECT_EQ(error("a.map", std::string("2D-Map\nResolution: ") + size + "\nDATA\n0 0\n"),
              std::string("2: Resolution: '") + size +
                  "' is not allowed; allowed is 0.1 to 1000000, in mm");
  EXPECT_THROW(read_bitmap(folder / "m.pgm", 1000), InputError);
  EXPECT_THROW(read_bitmap_of_width(folder / "m.pgm", 0.001), InputError);
  EXPECT_EQ(read_bitmap_of_width(folder / "m.pgm", 1001).resolution, 1);

  std::string lines, points;
  for (size_t i = 0; i <= kMostWalls; ++i) lines += "0 0 1 1\n", points += "1 1\n";
  EXPECT_EQ(error("a.map", "2D-Map\nLINES\n" + lines),
            "100003: the map has more than 100000 walls; a coarser one, of LINES, has fewer");
  EXPECT_NE(error("a.map", "2D-Map\nDATA\n" + points), "");
  EXPECT_EQ(error("a.map", "2D-Map\nLINES\n0 0 1 1\nDATA\n" + points), "");  // left out
}

// A map may be untrusted: its picture must be in its folder or below.
TEST(Map, ReachesItsOwnFolder) {
  TemporaryFolder folder;
  const std::filesystem::path inside = std::filesystem::path(folder.path()) / "maps" / "pictures";
  std::filesystem::create_directories(inside);
  const std::string picture = std::string("P5\n1 1\n255\n\x00", 12);
  folder.write("secret.pgm", picture);
  folder.write("maps/m.pgm", picture);
  folder.write("maps/pictures/m.pgm", picture);
  const auto reads = [&](const std::string& image, bool allow_absolute) {
    Findings findings;
    try {
      read_map(
          folder.write("maps/m.yaml", "image: " + image + "\nresolution: 1\norigin: [0, 0, 0]\n"),
          findings, allow_absolute);
      return true;
    } catch (const InputError& error) {
      EXPECT_NE(error.message().find("outside the map's folder"), std::string::npos);
      EXPECT_EQ(error.source().line, 1);
      return false;
    }
  };
  for (const std::string& good : {std::string("m.pgm"), std::string("pictures/m.pgm"),
                                  std::string("../maps/m.pgm"), folder / "maps/m.pgm"})
    EXPECT_TRUE(reads(good, false)) << good;
  for (const std::string& bad : {std::string("../secret.pgm"), folder / "secret.pgm",
                                 std::string("pictures/../../secret.pgm")}) {
    EXPECT_FALSE(reads(bad, false)) << bad;
    EXPECT_TRUE(reads(bad, true)) << bad;
  }
  EXPECT_FALSE(reads("/nowhere/none.pgm", false));  // whether it is there is not said
}

TEST(Map, AcceptsAllYamlSpellings) {
  TemporaryFolder folder;
  folder.write("m.pgm", std::string("P5\n1 1\n255\n\x00", 12));
  Findings findings;
  const OccupancyGrid grid =
      read_map(folder.write("a.yaml",
                            "image: m.pgm\nresolution: +0.5\norigin: [+1, 2, 0]\nnegate: True\n"
                            "ocupied_thresh: 0.3\ncolour: red\n"),
               findings);
  EXPECT_EQ(grid.resolution, 0.5);
  EXPECT_EQ(grid.x, 1);
  EXPECT_EQ(drawn(grid), ".\n");
  ASSERT_EQ(findings.list().size(), 2u);  // in the order of the keys
  EXPECT_EQ(findings.list()[0].text, "is not a key of map_server's, and ignored");
  EXPECT_EQ(findings.list()[1].source.line, 5);
  EXPECT_EQ(findings.list()[1].text,
            "is not a key of map_server's, and ignored; did you mean occupied_thresh?");
}

}  // namespace
}  // namespace ruedo::world
