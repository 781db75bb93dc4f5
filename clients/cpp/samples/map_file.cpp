// Occupancy maps in files, as map_server of ROS has them: a YAML file, and a picture that it names.
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>

#include "ruedo/client_map.h"
#include "ruedo/client_samples.h"

namespace ruedo::client {
namespace {

namespace fs = std::filesystem;

constexpr int8_t kFree = 0, kOccupied = 100, kUnknown = -1;
constexpr double kFarthest = 1e6;                                     // m, rad
constexpr uintmax_t kMostYaml = 1u << 20, kMostPicture = 256u << 20;  // bytes
constexpr const char* kBlanks = " \t\r\n";

std::string content_of(const fs::path& path, uintmax_t most) {
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    throw Error(path.string() + (fs::exists(path, error) ? ": it is not a file that can be read"
                                                         : ": no such file"));
  if (fs::file_size(path, error) > most)
    throw Error(path.string() + ": it has more than " + std::to_string(most) + " bytes");
  std::ifstream file(path, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(file), {}};
  if (!file) throw Error(path.string() + ": it cannot be read");
  return content;
}

std::string trimmed(const std::string& text, const std::string& what = kBlanks) {
  const size_t begin = text.find_first_not_of(what);
  return begin == std::string::npos ? ""
                                    : text.substr(begin, text.find_last_not_of(what) - begin + 1);
}

// The keys of a YAML file without nesting, which map files are; a list is a text "a, b, c".
std::map<std::string, std::string> values_of(const std::string& yaml) {
  std::map<std::string, std::string> values;
  std::istringstream lines(yaml);
  std::string last;  // key
  for (std::string line; std::getline(lines, line);) {
    const bool all = line.starts_with('#');
    line = trimmed(line.substr(0, all ? 0 : line.find(" #")));
    if (line.starts_with("- ") && !last.empty()) {
      std::string& list = values[last];
      list += (list.empty() ? "" : ", ") + trimmed(line.substr(2));
    } else if (const size_t colon = line.find(':'); colon != std::string::npos) {
      last = trimmed(line.substr(0, colon));
      values[last] = trimmed(trimmed(line.substr(colon + 1)), "[]\"'");
    }
  }
  return values;
}

bool read_number(const std::string& text, double& value) {
  const std::string word = trimmed(text);
  const char* const begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* const end = word.data() + word.size();
  const auto [at, error] = std::from_chars(begin, end, value);
  return error == std::errc() && at == end && std::abs(value) <= kFarthest;
}

class Head {
 public:
  explicit Head(const std::string& path)
      : path_(path), values_(values_of(content_of(path, kMostYaml))) {
    std::string missing;
    for (const char* key : {"image", "resolution", "origin"}) {
      if (!values_.contains(key)) missing += (missing.empty() ? "" : ", ") + std::string(key);
    }
    if (!missing.empty()) throw Error(path + ": " + missing + " is missing");
  }

  const std::string& image() const { return values_.at("image"); }

  double positive(const std::string& key, double fallback) const {
    const auto found = values_.find(key);
    if (found == values_.end()) return fallback;
    double value = 0.0;
    if (read_number(found->second, value) && value > 0.0) return value;
    throw Error(path_ + ": " + key + " is '" + found->second +
                "': expected a number above 0, at most 1e6");
  }

  Map::Origin origin() const {
    std::istringstream parts(values_.at("origin"));
    double values[3];
    size_t count = 0;
    bool good = true;
    for (std::string part; std::getline(parts, part, ',') && good; ++count)
      good = count < 3 && read_number(part, values[count]);
    if (good && count == 3) return {values[0], values[1], values[2]};
    throw Error(path_ + ": origin is '" + values_.at("origin") +
                "': expected three numbers: x, y and heading");
  }

  bool negated() const {
    const auto found = values_.find("negate");
    return found != values_.end() && found->second != "0" && found->second != "false";
  }

 private:
  std::string path_;
  std::map<std::string, std::string> values_;
};

// A PGM of 8 bits.
struct Picture {
  size_t width = 0, height = 0;
  std::string pixels;  // from the top

  explicit Picture(const fs::path& path) : pixels(content_of(path, kMostPicture)) {
    if (!pixels.starts_with("P5"))
      throw Error(path.string() + ": it is not a PGM, the kind of picture that is read here");
    size_t at = 2, largest = 0;
    for (size_t* const number : {&width, &height, &largest}) {
      while (at < pixels.size() &&
             (std::isspace(static_cast<unsigned char>(pixels[at])) || pixels[at] == '#'))
        at = pixels[at] == '#' ? std::min(pixels.find('\n', at), pixels.size()) : at + 1;
      const char* const end = pixels.data() + pixels.size();
      at = std::from_chars(pixels.data() + at, end, *number).ptr - pixels.data();
    }
    pixels.erase(0, std::min(at + 1, pixels.size()));
    if (largest == 255 && width > 0 && height > 0 && width <= pixels.size() / height) return;
    throw Error(path.string() + ": expected an 8-bit PGM of " + std::to_string(width) + " x " +
                std::to_string(height) + " pixels, found " + std::to_string(pixels.size()) +
                " bytes");
  }
};

std::string written(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

void write(const fs::path& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file.write(content.data(), static_cast<std::streamsize>(content.size()));
  file.close();
  if (!file) throw Error(path.string() + ": it cannot be written");
}

}  // namespace

void Map::save(const std::string& path) const {
  fs::path picture(path);
  if (picture.extension() != ".yaml")
    throw std::invalid_argument(path + ": the name of a map ends in .yaml");
  picture.replace_extension(".pgm");
  std::string pgm = "P5\n" + std::to_string(columns()) + " " + std::to_string(rows()) + "\n255\n";
  for (size_t row = rows(); row-- > 0;) {
    for (size_t i = 0; i < columns(); ++i) {
      const int8_t cell = cells_[row * columns_ + i];
      pgm += static_cast<char>(cell == kOccupied ? 0 : cell == kFree ? 254 : 205);
    }
  }
  write(picture, pgm);
  write(path, "image: " + picture.filename().string() + "\nresolution: " + written(resolution_) +
                  "\norigin: [" + written(origin_.x) + ", " + written(origin_.y) + ", " +
                  written(origin_.heading) +
                  "]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
}

Map load_map(const std::string& path) {
  const Head head(path);
  const double occupied = head.positive("occupied_thresh", 0.65);
  const double free = head.positive("free_thresh", 0.196);
  const double resolution = head.positive("resolution", 0.0);
  const Map::Origin origin = head.origin();
  const bool negated = head.negated();
  const Picture picture(fs::path(path).parent_path() / head.image());
  std::vector<int8_t> cells(picture.width * picture.height, kUnknown);
  for (size_t i = 0; i < cells.size(); ++i) {
    const size_t row = picture.height - 1 - i / picture.width;
    const double grey =
        static_cast<uint8_t>(picture.pixels[row * picture.width + i % picture.width]) / 255.0;
    const double dark = negated ? grey : 1.0 - grey;
    if (dark > occupied) cells[i] = kOccupied;
    if (dark < free) cells[i] = kFree;
  }
  return {std::move(cells), picture.width, resolution, origin};
}

}  // namespace ruedo::client
