// Map files: ROS's map_server (YAML and a picture), Stage's bitmaps, and ArMap.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

#include "base/input_file.h"
#include "base/progress.h"
#include "base/text.h"
#include "base/utf8.h"
#include "ruedo/math.h"
#include "ruedo/quantity.h"
#include "system/output_file.h"
#include "world/document/document.h"
#include "world/maps/occupancy.h"
#include "world/mesh/codecs.h"
#include "world/mesh/picture.h"
#include "world/read/read_context.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

constexpr int kMostPixels = 20'000;  // width and height

constexpr size_t kMostMapBytes = 64u << 20;         // of an ArMap
constexpr size_t kMostWords = 4, kMostKinds = 100;  // of its lines, and of what it holds else
constexpr size_t kLongestShown = 100;               // of a wrong text, in an error

// Calls visit(number from 1, text) for each line of a file.
template <class Visit>
void for_each_line(const std::string& path, size_t most_bytes, Visit visit) {
  std::string all = read_input(path, most_bytes);
  if (all.starts_with("\xEF\xBB\xBF")) all.erase(0, 3);  // the UTF-8 byte order mark
  std::istringstream in(std::move(all));
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    if (!text.empty() && text.back() == '\r') text.pop_back();
    visit(number, text);
  }
}

double number(const std::string& text, const Source& source, const std::string& what) {
  double value = 0;
  const size_t plus = text.starts_with('+') && !text.starts_with("+-") ? 1 : 0;
  const auto [end, error] = std::from_chars(text.data() + plus, text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    throw InputError(source, what + ": '" + shortened(text, kLongestShown) + "' is not a number");
  }
  return value;
}

// Parses the flat YAML that map_server writes: "key: value" lines, with lists in brackets or as "-
// value" lines.
class FlatYaml {
 public:
  explicit FlatYaml(const std::string& path) : path_(path) {
    std::string key;
    for_each_line(path, 1 << 20, [&](int line, std::string text) {
      if (const size_t hash = text.find('#');
          hash == 0 ||
          (hash != std::string::npos && (text[hash - 1] == ' ' || text[hash - 1] == '\t')))
        text.resize(hash);
      text = trimmed(text);
      if (text.empty() || text == "---" || text == "...") return;
      if (text[0] == '-' && !key.empty() && text.size() > 1 && text[1] == ' ') {
        values_[key].second += " " + std::string(trimmed(text.substr(1)));
        return;
      }
      const size_t colon = text.find(':');
      if (colon == std::string::npos)
        throw InputError({path, line}, "'" + text + "' is not a 'key: value'");
      key = trimmed(text.substr(0, colon));
      std::string value(trimmed(text.substr(colon + 1)));
      if (value.size() >= 2 && (value.front() == '"' || value.front() == '\'') &&
          value.back() == value.front())
        value = value.substr(1, value.size() - 2);
      if (const auto [other, added] = values_.try_emplace(key, line, value); !added)
        throw InputError({path, line}, "a second '" + key + "'; the first is in line " +
                                           std::to_string(other->second.first));
    });
  }

  // Keys that map_server does not have.
  void check_keys(Findings& findings) const {
    const std::vector<std::string> known{"image", "resolution",      "origin",     "negate",
                                         "mode",  "occupied_thresh", "free_thresh"};
    for (const auto& [key, value] : values_) {
      if (std::find(known.begin(), known.end(), key) != known.end()) continue;
      const std::string near = nearest_word(key, known);
      findings.unsupported({path_, value.first}, shortened(key, kLongestShown),
                           "is not a key of map_server's, and ignored" +
                               (near.empty() ? "" : "; did you mean " + near + "?"));
    }
  }

  bool has(const std::string& key) const { return values_.count(key) != 0; }
  Source source(const std::string& key) const {
    return {path_, has(key) ? values_.at(key).first : 0};
  }
  std::string text(const std::string& key) const {
    if (!has(key) || values_.at(key).second.empty())
      throw InputError({path_, 0}, "has no '" + key + "'");
    return values_.at(key).second;
  }
  [[noreturn]] void refuse(const std::string& key, const std::string& allowed) const {
    throw InputError(source(key), key + ": '" + text(key) + "' is not allowed; allowed " + allowed);
  }
  double real(const std::string& key) const { return number(text(key), source(key), key); }
  // From 0 to 1.
  double part(const std::string& key, double fallback) const {
    if (!has(key)) return fallback;
    const double value = real(key);
    if (value < 0 || value > 1) refuse(key, "is 0 to 1");
    return value;
  }
  bool boolean(const std::string& key) const {
    if (!has(key)) return false;
    const std::string value = text(key);
    for (const char* yes : {"1", "true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"}) {
      if (value == yes) return true;
    }
    for (const char* no : {"0", "false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"}) {
      if (value == no) return false;
    }
    refuse(key, "are 0, 1, false and true");
  }
  std::vector<double> list(const std::string& key) const {
    std::string text = this->text(key);
    for (char& c : text) {
      if (c == '[' || c == ']' || c == ',') c = ' ';
    }
    std::vector<double> numbers;
    std::istringstream in(text);
    for (std::string word; in >> word;) numbers.push_back(number(word, source(key), key));
    return numbers;
  }

 private:
  std::string path_;
  std::map<std::string, std::pair<int, std::string>> values_;
};

// A picture in 8-bit grey, with its first row at the top.
cv::Mat read_picture(const std::string& path) {
  const std::string bytes = read_input(path, 256u << 20);
  if (bytes.empty()) throw InputError({path, 0}, "the file is empty");
  if (const std::string fault = picture_fault(bytes, kMostPixels); !fault.empty())
    throw InputError({path, 0}, fault);
  const Progress progress("reading " + path);
  cv::Mat grey;
  try {
    grey = decode_picture(bytes.data(), bytes.size(), cv::IMREAD_GRAYSCALE);
  } catch (const cv::Exception&) {
    throw InputError({path, 0}, "the picture is broken");
  }
  if (grey.empty())
    throw InputError({path, 0}, "is not a picture that can be read (pgm, png, jpeg, bmp, tiff)");
  return grey;
}

bool is_cell(double side) { return side >= kSmallestCell_m && side <= kLargestCell_m; }

// A world takes no walls that are larger or farther away. source: for errors.
void check_extent(const OccupancyGrid& grid, const Source& source) {
  const double width = grid.width * grid.resolution, height = grid.height * grid.resolution;
  const double reach = math::hypot(grid.x, grid.y) + math::hypot(width, height);
  if (std::max({width, height, reach}) <= quantity::kLength.most) return;
  throw InputError(source, "with cells of " + shown(grid.resolution) + " m the map is " +
                               shown(width) + " x " + shown(height) + " m large and begins at " +
                               shown(grid.x) + ", " + shown(grid.y) +
                               "; allowed are walls within 1000000 m of the origin");
}

// A map may be untrusted: it reaches the pictures in its own folder and below.
std::string picture_of(const FlatYaml& yaml, const std::string& path, bool allow_absolute) {
  const std::string named = yaml.text("image");
  const fs::path folder = fs::absolute(path).parent_path().lexically_normal();
  const fs::path picture = (folder / named).lexically_normal();  // named alone, where absolute
  const bool is_below = *picture.lexically_relative(folder).begin() != "..";
  if (!is_below && !allow_absolute)
    throw InputError(yaml.source("image"),
                     "image: '" + named +
                         "' lies outside the map's folder: put the picture beside "
                         "the map, and name it without folders (--allow-absolute lets it in)");
  const fs::path own = fs::path(path).parent_path();
  return (own / (is_below ? picture.lexically_relative(folder) : fs::path(named))).string();
}

template <class CellOf>
OccupancyGrid grid_of(const cv::Mat& grey, double resolution, CellOf cell_of) {
  OccupancyGrid grid;
  grid.width = grey.cols;
  grid.height = grey.rows;
  grid.resolution = resolution;
  grid.cells.resize(static_cast<size_t>(grey.cols) * static_cast<size_t>(grey.rows));
  for (int row = 0; row < grey.rows; ++row) {
    for (int column = 0; column < grey.cols; ++column)
      grid.at(column, grey.rows - 1 - row) = cell_of(grey.at<uint8_t>(row, column));
  }
  return grid;
}

}  // namespace

// Thresholds as in map_server's "trinary" mode, also applied to "scale" maps; "raw" maps hold
// percentages.
OccupancyGrid read_map(const std::string& path, Findings& findings, bool allow_absolute) {
  const FlatYaml yaml(path);
  yaml.check_keys(findings);
  const double resolution = yaml.real("resolution");
  if (!is_cell(resolution)) yaml.refuse("resolution", "is 0.0001 to 1000 m");
  const std::vector<double> origin = yaml.list("origin");
  const auto is_far = [](double number) { return std::abs(number) > quantity::kLength.most; };
  if (std::any_of(origin.begin(), origin.end(), is_far))
    yaml.refuse("origin", "is up to 1000000 m and rad");
  if (origin.size() != 3 && origin.size() != 2) yaml.refuse("origin", "is [x, y, yaw]");
  const double occupied = yaml.part("occupied_thresh", 0.65);
  const double free = yaml.part("free_thresh", std::min(0.25, occupied));
  if (free > occupied) yaml.refuse("free_thresh", "is up to occupied_thresh, " + shown(occupied));
  const bool negated = yaml.boolean("negate");
  const std::string mode = yaml.has("mode") ? yaml.text("mode") : "trinary";
  if (mode != "trinary" && mode != "scale" && mode != "raw")
    yaml.refuse("mode", "are trinary, scale and raw");
  const std::string picture = picture_of(yaml, path, allow_absolute);
  OccupancyGrid grid = grid_of(read_picture(picture), resolution, [&](uint8_t value) {
    if (mode == "raw" && value > 100) return Cell::unknown;
    const double p = mode == "raw" ? value / 100.0 : (negated ? value : 255 - value) / 255.0;
    return p > occupied ? Cell::occupied : p < free ? Cell::free : Cell::unknown;
  });
  grid.x = origin[0];
  grid.y = origin[1];
  grid.yaw = origin.size() == 3 ? origin[2] : 0;
  check_extent(grid, yaml.source("resolution"));
  return grid;
}

namespace {

OccupancyGrid bitmap_of(const std::string& path, const cv::Mat& grey, double resolution) {
  OccupancyGrid grid = grid_of(
      grey, resolution, [](uint8_t value) { return value < 128 ? Cell::occupied : Cell::free; });
  grid.x = -grid.width * resolution / 2;
  grid.y = -grid.height * resolution / 2;
  check_extent(grid, {path, 0});
  return grid;
}

}  // namespace

OccupancyGrid read_bitmap(const std::string& path, double resolution) {
  return bitmap_of(path, read_picture(path), resolution);
}

OccupancyGrid read_bitmap_of_width(const std::string& path, double width) {
  const cv::Mat grey = read_picture(path);
  const double resolution = width / grey.cols;
  if (!is_cell(resolution))
    throw InputError({path, 0}, "a width of " + shown(width) + " m makes its " +
                                    std::to_string(grey.cols) + " pixels " + shown(resolution) +
                                    " m wide; allowed is 0.0001 to 1000 m");
  return bitmap_of(path, grey, resolution);
}

void write_map(const OccupancyGrid& grid, const std::string& path) {
  const fs::path picture = fs::path(path).replace_extension(".pgm");
  std::string image =
      "P5\n" + std::to_string(grid.width) + " " + std::to_string(grid.height) + "\n255\n";
  for (int r = grid.height - 1; r >= 0; --r) {
    for (int c = 0; c < grid.width; ++c) {
      const Cell cell = grid.at(c, r);
      image += static_cast<char>(cell == Cell::occupied ? 0 : cell == Cell::free ? 254 : 205);
    }
  }
  OutputFile image_file(picture.string()), map(path);
  image_file.write(image);
  const auto rounded = [](double v) { return shown(std::round(v * 1e9) / 1e9 + 0.0); };
  map.write("image: " + picture.filename().string() + "\nmode: trinary\nresolution: " +
            rounded(grid.resolution) + "\norigin: [" + rounded(grid.x) + ", " + rounded(grid.y) +
            ", " + rounded(grid.yaw) + "]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
  image_file.keep();
  map.keep();
}

namespace {

// The contents of an ArMap, line by line.
class ArMap {
 public:
  ArMap(const std::string& path, double thickness) : path_(path), thickness_(thickness) {
    for_each_line(path, kMostMapBytes, [this](int line, const std::string& text) {
      std::istringstream in(text);
      std::vector<std::string> words;
      for (std::string word; words.size() <= kMostWords && in >> word;) words.push_back(word);
      if (!words.empty()) add(words, {path_, line});
    });
    if (!is_map_)
      throw InputError({path, 1},
                       "is not a map of MobileSim and ARIA: it does not begin with '2D-Map'");
    if (lines_.empty() && point_count_ == 0)
      throw InputError({path, 0}, "holds no LINES and no DATA");
    if (lines_.empty() && point_count_ > points_.size()) refuse_count(0);
  }

  const std::vector<WallPiece>& walls() const { return lines_.empty() ? points_ : lines_; }
  std::string left_out() const {
    std::string text =
        lines_.empty() || point_count_ == 0 ? "" : std::to_string(point_count_) + " points";
    for (const auto& [kind, count] : others_)
      text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + kind;
    return text;
  }

 private:
  enum class Part { head, lines, points };

  void add(const std::vector<std::string>& words, const Source& source) {
    if (words[0] == "2D-Map" || words[0] == "2D-Map-Ex" || words[0] == "2D-Map-Ex2")
      is_map_ = true;
    else if (words[0] == "LINES")
      part_ = Part::lines;
    else if (words[0] == "DATA")
      part_ = Part::points;
    else if (part_ == Part::head)
      add_head(words, source);
    else
      add_wall(words, source);
  }

  void add_head(const std::vector<std::string>& words, const Source& source) {
    if (words.size() < 2) return;
    if (words[0] == "Cairn:") {
      const bool is_kept = others_.size() < kMostKinds || others_.contains(words[1]);
      ++others_[is_kept ? shortened(words[1], kLongestShown) : "of other kinds"];
    }
    if (words[0] != "Resolution:") return;
    point_size_ = number(words[1], source, "Resolution") / 1000;
    if (!is_cell(point_size_))
      throw InputError(source, "Resolution: '" + shortened(words[1], kLongestShown) +
                                   "' is not allowed; allowed is 0.1 to 1000000, in mm");
  }

  void add_wall(const std::vector<std::string>& words, const Source& source) {
    const bool is_line = part_ == Part::lines;
    const size_t wanted = is_line ? 4 : 2;
    const auto refuse = [&](const std::string& allowed) {
      std::string all;
      for (const std::string& word : words) all += (all.empty() ? "" : " ") + word;
      throw InputError(
          source, "'" + shortened(all, kLongestShown) + "' is not allowed; allowed are " + allowed);
    };
    if (words.size() != wanted) refuse(is_line ? "x1 y1 x2 y2, in mm" : "x y, in mm");
    double v[4] = {};
    for (size_t i = 0; i < wanted; ++i) {
      v[i] = number(words[i], source, is_line ? "LINES" : "DATA") / 1000;
      if (std::abs(v[i]) > quantity::kLength.most) refuse("coordinates of up to 1000000000 mm");
    }
    if (!is_line) {
      ++point_count_;
      if (points_.size() < kMostWalls) points_.push_back({v[0], v[1], 0, point_size_, point_size_});
      return;
    }
    const double dx = v[2] - v[0], dy = v[3] - v[1];
    // Extended by its thickness at both ends: corners close.
    const double length = math::hypot(dx, dy) + thickness_;
    if (length > quantity::kLength.most) refuse("lines of up to 1000000000 mm");
    if (lines_.size() == kMostWalls) refuse_count(source.line);
    lines_.push_back(
        {(v[0] + v[2]) / 2, (v[1] + v[3]) / 2, math::atan2(dy, dx), length, thickness_});
  }

  [[noreturn]] void refuse_count(int line) const {
    throw InputError({path_, line}, "the map has more than " + std::to_string(kMostWalls) +
                                        " walls; a coarser one, of LINES, has fewer");
  }

  const std::string& path_;
  double thickness_, point_size_ = 0.02;
  Part part_ = Part::head;
  bool is_map_ = false;
  std::vector<WallPiece> lines_, points_;  // points: the first of them
  size_t point_count_ = 0;
  std::map<std::string, int> others_;  // other kinds of map objects, with their counts
};

}  // namespace

std::vector<WallPiece> read_armap(const std::string& path, double thickness,
                                  std::string& left_out) {
  const ArMap map(path, thickness);
  left_out = map.left_out();
  return map.walls();
}

}  // namespace ruedo::world
