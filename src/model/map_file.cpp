// Map files: ROS's map_server (YAML and a picture), Stage's bitmaps, and ArMap.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>

#include "core/input_file.h"
#include "core/output_file.h"
#include "core/progress.h"
#include "model/codecs.h"
#include "model/document.h"
#include "model/occupancy.h"
#include "model/picture.h"
#include "model/read_context.h"
#include "ruedo/math.h"
#include "ruedo/quantity.h"

namespace fs = std::filesystem;

namespace ruedo::model {
namespace {

constexpr int kMostPixels = 20'000;  // width and height

struct Line {
  int number;
  std::string text;
};

std::vector<Line> lines_of(const std::string& path, size_t most_bytes) {
  std::string all = read_input(path, most_bytes);
  if (all.starts_with("\xEF\xBB\xBF")) all.erase(0, 3);  // the UTF-8 byte order mark
  std::istringstream in(std::move(all));
  std::vector<Line> lines;
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    if (!text.empty() && text.back() == '\r') text.pop_back();
    lines.push_back({number, text});
  }
  return lines;
}

std::string trimmed(const std::string& text) {
  const size_t begin = text.find_first_not_of(" \t");
  return begin == std::string::npos ? ""
                                    : text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

double number(const std::string& text, const Source& source, const std::string& what) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    throw InputError(source, what + ": '" + text + "' is not a number");
  }
  return value;
}

// Parses the flat YAML that map_server writes: "key: value" lines, with lists in brackets or as "-
// value" lines.
class FlatYaml {
 public:
  explicit FlatYaml(const std::string& path) : path_(path) {
    std::string key;
    for (const auto& [line, raw] : lines_of(path, 1 << 20)) {
      std::string text = raw;
      if (const size_t hash = text.find('#');
          hash == 0 ||
          (hash != std::string::npos && (text[hash - 1] == ' ' || text[hash - 1] == '\t')))
        text.resize(hash);
      text = trimmed(text);
      if (text.empty() || text == "---" || text == "...") continue;
      if (text[0] == '-' && !key.empty() && text.size() > 1 && text[1] == ' ') {
        values_[key].second += " " + trimmed(text.substr(1));
        continue;
      }
      const size_t colon = text.find(':');
      if (colon == std::string::npos)
        throw InputError({path, line}, "'" + text + "' is no 'key: value'");
      key = trimmed(text.substr(0, colon));
      std::string value = trimmed(text.substr(colon + 1));
      if (value.size() >= 2 && (value.front() == '"' || value.front() == '\'') &&
          value.back() == value.front())
        value = value.substr(1, value.size() - 2);
      if (const auto [other, added] = values_.try_emplace(key, line, value); !added)
        throw InputError({path, line}, "a second '" + key + "'; the first is in line " +
                                           std::to_string(other->second.first));
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
    const std::string value = has(key) ? text(key) : "0";
    if (value != "0" && value != "1" && value != "false" && value != "true")
      refuse(key, "are 0, 1, false and true");
    return value == "1" || value == "true";
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
    throw InputError({path, 0}, "is no picture that can be read (pgm, png, jpeg, bmp, tiff)");
  return grey;
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
OccupancyGrid read_map(const std::string& path) {
  const FlatYaml yaml(path);
  const double resolution = yaml.real("resolution");
  if (!(resolution >= 0.0001 && resolution <= 1000))
    yaml.refuse("resolution", "is 0.0001 to 1000 m");
  const std::vector<double> origin = yaml.list("origin");
  const auto is_far = [](double number) { return std::abs(number) > quantity::kLength.most; };
  if (std::any_of(origin.begin(), origin.end(), is_far))
    yaml.refuse("origin", "is up to 1000000 m and rad");
  if (origin.size() != 3 && origin.size() != 2) yaml.refuse("origin", "is [x, y, yaw]");
  const double occupied = yaml.part("occupied_thresh", 0.65);
  const double free = yaml.part("free_thresh", 0.25);
  const bool negated = yaml.boolean("negate");
  const std::string mode = yaml.has("mode") ? yaml.text("mode") : "trinary";
  if (mode != "trinary" && mode != "scale" && mode != "raw")
    yaml.refuse("mode", "are trinary, scale and raw");
  const fs::path named = yaml.text("image");
  const std::string picture =
      (named.is_absolute() ? named : fs::path(path).parent_path() / named).string();
  OccupancyGrid grid = grid_of(read_picture(picture), resolution, [&](uint8_t value) {
    if (mode == "raw" && value > 100) return Cell::unknown;
    const double p = mode == "raw" ? value / 100.0 : (negated ? value : 255 - value) / 255.0;
    return p > occupied ? Cell::occupied : p < free ? Cell::free : Cell::unknown;
  });
  grid.x = origin[0];
  grid.y = origin[1];
  grid.yaw = origin.size() == 3 ? origin[2] : 0;
  return grid;
}

OccupancyGrid read_bitmap(const std::string& path, double resolution) {
  OccupancyGrid grid = grid_of(read_picture(path), resolution, [](uint8_t value) {
    return value < 128 ? Cell::occupied : Cell::free;
  });
  grid.x = -grid.width * resolution / 2;
  grid.y = -grid.height * resolution / 2;
  return grid;
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
  write_file(picture.string(), image);
  const auto rounded = [](double v) { return shown(std::round(v * 1e9) / 1e9 + 0.0); };
  write_file(path, "image: " + picture.filename().string() +
                       "\nmode: trinary\nresolution: " + rounded(grid.resolution) + "\norigin: [" +
                       rounded(grid.x) + ", " + rounded(grid.y) + ", " + rounded(grid.yaw) +
                       "]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
}

std::vector<WallPiece> read_armap(const std::string& path, double thickness,
                                  std::string& left_out) {
  enum class Part { head, lines, points };
  Part part = Part::head;
  std::vector<WallPiece> lines, points;
  std::map<std::string, int> others;  // other kinds of map objects, with their counts
  double point_size = 0.02;
  bool is_map = false;
  for (const auto& [line, raw] : lines_of(path, 256u << 20)) {
    const Source source{path, line};
    std::istringstream in(raw);
    std::vector<std::string> words;
    for (std::string word; in >> word;) words.push_back(word);
    if (words.empty()) continue;
    if (words[0] == "2D-Map" || words[0] == "2D-Map-Ex" || words[0] == "2D-Map-Ex2")
      is_map = true;
    else if (words[0] == "LINES")
      part = Part::lines;
    else if (words[0] == "DATA")
      part = Part::points;
    else if (part == Part::head) {
      if (words[0] == "Resolution:" && words.size() > 1)
        point_size = std::max(number(words[1], source, "Resolution") / 1000, 0.001);
      if (words[0] == "Cairn:" && words.size() > 1) ++others[words[1]];
    } else {
      const size_t wanted = part == Part::lines ? 4 : 2;
      if (words.size() != wanted) {
        throw InputError(source, "'" + raw + "' is not allowed; allowed are " +
                                     (wanted == 4 ? "x1 y1 x2 y2" : "x y") + ", in mm");
      }
      double v[4] = {};
      for (size_t i = 0; i < wanted; ++i)
        v[i] = number(words[i], source, wanted == 4 ? "LINES" : "DATA") / 1000;
      if (part == Part::points) {
        points.push_back({v[0], v[1], 0, point_size, point_size});
      } else {
        const double dx = v[2] - v[0], dy = v[3] - v[1];
        // Extended by its thickness at both ends: corners close.
        lines.push_back({(v[0] + v[2]) / 2, (v[1] + v[3]) / 2, math::atan2(dy, dx),
                         math::hypot(dx, dy) + thickness, thickness});
      }
    }
  }
  if (!is_map)
    throw InputError({path, 1}, "is no map of MobileSim and ARIA: it does not begin with '2D-Map'");
  if (lines.empty() && points.empty()) throw InputError({path, 0}, "holds no LINES and no DATA");
  if (!lines.empty() && !points.empty()) left_out = std::to_string(points.size()) + " points";
  for (const auto& [kind, count] : others)
    left_out += (left_out.empty() ? "" : ", ") + std::to_string(count) + " " + kind;
  return lines.empty() ? points : lines;
}

}  // namespace ruedo::model
