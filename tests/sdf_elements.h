// SDF 1.12, element by element, for tests that none is ignored silently: each is read, or named in
// a finding, or among those that affect no result. The list is run/sdf_elements.txt, by
// run/sdf_elements.py.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/element_watch.h"
#include "world/load.h"

namespace ruedo::test {

struct Row {
  std::string path, type, usual;
  std::string inside = "";  // of an attribute: its element's text
};

inline std::string value_of(const Row& row);

inline std::vector<Row> rows() {
  std::ifstream in(RUEDO_SOURCE_DIR "/tests/run/sdf_elements.txt");
  std::vector<Row> list;
  for (std::string line; std::getline(in, line);) {
    const size_t first = line.find('|'), second = line.rfind('|');
    if (line.front() != '#')
      list.push_back({line.substr(0, first), line.substr(first + 1, second - first - 1),
                      line.substr(second + 1)});
  }
  std::map<std::string, const Row*> by_path;
  for (const Row& row : list) by_path[row.path] = &row;
  for (Row& row : list) {
    const size_t at = row.path.find("/@");
    const auto element = by_path.find(row.path.substr(0, at));
    if (at != std::string::npos && element != by_path.end())
      row.inside = value_of(*element->second);
  }
  return list;
}

inline std::vector<std::string> steps_of(const std::string& path) {
  std::vector<std::string> steps;
  for (size_t begin = 0; begin <= path.size();) {
    const size_t end = std::min(path.find('/', begin), path.size());
    steps.push_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return steps;
}

inline bool ends_with(const std::string& path, const std::string& end) {
  return path == end || path.ends_with("/" + end);
}

// For a path, what its element contains in the list below: the first entry whose path is its end.
using ByEnd = std::vector<std::pair<std::string, std::string>>;
inline std::string by_end(const ByEnd& list, const std::string& path,
                          const std::string& fallback = "") {
  for (const auto& [end, value] : list) {
    if (ends_with(path, end)) return value;
  }
  return fallback;
}

// The type that a sensor must have for the reader to look at that part of it.
inline std::string sensor_type(const std::string& path) {
  static const ByEnd kTypes = {
      {"camera/segmentation_type", "segmentation"}, {"camera/box_type", "boundingbox_camera"},
      {"camera/depth_camera", "depth_camera"},      {"camera/lens/intrinsics", "camera"},
      {"camera/lens/projection", "camera"},         {"camera/lens", "wideanglecamera"},
      {"transceiver", "wireless_transmitter"}};
  const size_t at = path.find("/sensor/");
  if (at == std::string::npos) return "camera";
  for (std::string part = path; part.size() > at + 8; part.resize(part.rfind('/'))) {
    if (const std::string type = by_end(kTypes, part); !type.empty()) return type;
  }
  const std::string rest = path.substr(at + 8);
  const std::string own = rest.substr(0, rest.find('/'));
  static const std::set<std::string> kOwn = {
      "air_pressure", "air_speed", "altimeter",      "camera",       "contact", "force_torque",
      "gps",          "imu",       "logical_camera", "magnetometer", "navsat",  "ray",
      "lidar",        "rfid",      "rfidtag",        "sonar"};
  return kOwn.contains(own) ? own : "camera";
}

inline std::string attributes(const std::string& element, const std::string& path) {
  if (element == "sensor") return " name='s' type='" + sensor_type(path) + "'";
  if (element == "joint" && !path.starts_with("world/state"))
    return std::string(" name='j' type='") +
           (path.find("axis2") != std::string::npos          ? "universal"
            : path.find("gearbox") != std::string::npos      ? "gearbox"
            : path.find("thread_pitch") != std::string::npos ? "screw"
                                                             : "revolute") +
           "'";
  if (element == "mimic") return " joint='j0'";
  if (element == "inertial" && path.find("density") != std::string::npos) return " auto='true'";
  if (element == "light" && !path.starts_with("world/state"))
    return std::string(" name='n' type='") +
           (path.find("spot") != std::string::npos ? "spot" : "point") + "'";
  static const std::map<std::string, std::string> kOthers = {
      {"world", " name='w'"},
      {"plugin", " name='p' filename='libp.so'"},
      {"trajectory", " id='0' type='walk'"},
      {"road", " name='n'"}};
  if (const auto other = kOthers.find(element); other != kOthers.end()) return other->second;
  static const std::set<std::string> kNamed = {
      "model",     "link",        "joint",       "frame",       "collision",  "visual",
      "actor",     "light",       "gripper",     "population",  "projector",  "battery",
      "animation", "joint_state", "model_state", "light_state", "link_state", "particle_emitter"};
  if (!kNamed.contains(element)) return "";
  if (element == "model" || element == "model_state") return " name='m'";
  if (element.starts_with("link")) return " name='l'";
  if (element.starts_with("joint")) return " name='j'";
  return " name='n'";
}

// The elements that are needed beside the one under test.
inline std::vector<std::string> beside(const std::string& element, const std::string& path) {
  const bool in_state = path.starts_with("world/state");
  if (element == "world" && in_state)
    return {
        "<model name='m'><link name='l'/><link name='k'/><joint name='j' "
        "type='revolute'><parent>k</parent><child>l</child><axis><xyz>0 0 1</xyz></axis></joint>"
        "</model><light name='n' type='point'/>"};
  if (element == "world") return {"<model name='other'><link name='l'/></model>"};
  if (in_state && element.starts_with("model")) return {"<pose>0 0 0 0 0 0</pose>"};
  if (element == "link" && path.find("collision/density") != std::string::npos)
    return {"<inertial auto='true'/>"};
  if (element == "model" && !in_state)
    return {"<link name='l0'/>", "<link name='l1'/>",
            "<joint name='j0' type='revolute'><parent>l0</parent><child>l1</child><axis><xyz>0 0 "
            "1</xyz></axis></joint>",
            "<link name='l2'/>"};
  if (element == "joint" && !in_state)
    return {"<parent>l0</parent>", "<child>l2</child>", "<axis><xyz>0 0 1</xyz></axis>"};
  if (element == "axis" || element == "axis2") return {"<xyz>0 0 1</xyz>"};
  if (element == "collision" || element == "visual")
    return {"<geometry><box><size>1 1 1</size></box></geometry>"};
  if (element == "polyline")
    return {"<point>0 0</point>", "<point>1 0</point>", "<point>0 1</point>", "<height>1</height>"};
  if (element == "logical_camera")
    return {"<near>1</near>", "<far>5</far>", "<horizontal_fov>1</horizontal_fov>",
            "<aspect_ratio>1</aspect_ratio>"};
  if (element == "ray" || element == "lidar")
    return {
        "<range><min>0.1</min><max>5</max></range>",
        "<scan><horizontal><samples>3</samples><min_angle>-1</min_angle><max_angle>1</max_angle>"
        "</horizontal></scan>"};
  if (element == "range" && path.find("sensor") != std::string::npos) return {"<max>5</max>"};
  if (element == "horizontal")
    return {"<samples>3</samples>", "<min_angle>-1</min_angle>", "<max_angle>1</max_angle>"};
  if (element == "vertical")
    return {"<samples>3</samples>", "<min_angle>-1</min_angle>", "<max_angle>1</max_angle>"};
  if (element == "noise" && path.find("camera") == std::string::npos) return {};
  if (element == "camera" && path.find("sensor") != std::string::npos)
    return {"<image><width>32</width><height>24</height></image>"};
  if (element == "fog") return {"<type>linear</type>"};
  if (element == "include") return {"<uri>model://none</uri>"};
  if (element == "sonar") return {"<min>0.1</min>", "<max>5</max>"};
  if (element == "actor")
    return {
        "<script><trajectory id='0' type='walk'><waypoint><time>0</time><pose>0 0 0 0 0 "
        "0</pose></waypoint><waypoint><time>1</time><pose>1 0 0 0 0 "
        "0</pose></waypoint></trajectory></script>"};
  if (element == "population") return {"<model name='pm'><link name='l'/></model>"};
  return {};
}

inline std::string value_of(const Row& row) {
  static const ByEnd kValues = {{"joint/parent", "l0"},
                                {"joint/child", "l1"},
                                {"joint/@type", "continuous"},
                                {"sensor/@type", "imu"},
                                {"light/@type", "directional"},
                                {"noise/type", "gaussian"},
                                {"noise/@type", "gaussian"},
                                {"@rotation_format", "euler_rpy"},
                                {"spherical_coordinates/surface_model", "MOON_SCS"},
                                {"geometry/plane/normal", "0 0 1"},
                                {"@relative_to", ""}};
  if (const std::string value = by_end(kValues, row.path); !value.empty()) return value;
  if (row.type == "bool") return row.usual == "true" || row.usual == "1" ? "false" : "true";
  if (row.type.ends_with("int")) return std::to_string(std::atoi(row.usual.c_str()) + 1);
  if (row.type == "double" || row.type == "float") {
    const double usual = std::atof(row.usual.c_str());
    return usual != 0.0 && std::abs(usual) < 1e6 ? std::to_string(usual / 2) : "0.25";
  }
  if (row.type == "vector3") return "0.25 0.5 0.75";
  if (row.type == "vector2d") return "0.25 0.75";
  if (row.type == "vector2i") return "1 2";
  if (row.type == "color") return "0.1 0.2 0.3 1";
  if (row.type == "pose") return "0.1 0.2 0.3 0 0 0.5";
  if (row.type == "time") return "1 0";
  return row.type.empty() ? "" : "other";
}

constexpr int kLine = 100;  // where the element under test stands

// A world that contains it with what it needs; without it, if `with` is false.
inline std::string world_with(const Row& row, bool with) {
  std::vector<std::string> steps = steps_of(row.path);
  std::string attribute;
  if (steps.back().front() == '@') {
    attribute = steps.back().substr(1);
    steps.pop_back();
  }
  std::string text = "<sdf version='1.12'>", end = "</sdf>", path;
  for (size_t i = 0; i < steps.size(); ++i) {
    const std::string& element = steps[i];
    const bool last = i + 1 == steps.size();
    path += (i ? "/" : "") + element;
    std::string own = attributes(element, row.path);
    if (last && !attribute.empty()) {
      const size_t written = own.find(" " + attribute + "=");
      if (with && written != std::string::npos)
        own.erase(written, own.find('\'', own.find('\'', written) + 1) - written + 1);
      if (with) own += " " + attribute + "='" + value_of(row) + "'";
    }
    if (last) {
      text += std::string(kLine - 1, '\n');
      if (!with && attribute.empty()) break;
    }
    text += "<" + own.insert(0, element) + ">";
    if (last) text += attribute.empty() ? value_of(row) : row.inside;
    if (last) text += "\n";
    end.insert(0, "</" + element + ">");
    for (const std::string& other : beside(element, row.path)) {
      const std::string name = other.substr(1, other.find_first_of(" >") - 1);
      if (last ? attribute.empty() && row.type.empty()
               : name != steps[i + 1] || name == "model" || name == "link" || name == "point" ||
                     name == "joint")
        text += other;
      else if (last && !attribute.empty())
        text += other;
    }
  }
  return text + end;
}

struct Outcome {
  std::multiset<std::string> findings;
  bool read = false;
};

// Loads a text, and adds the findings to the list.
using Loader = std::function<void(const std::string& text, std::multiset<std::string>& findings)>;

inline Outcome load(const Row& row, bool with, const Loader& loader) {
  Outcome outcome;
  ElementWatch watch;
  try {
    loader(world_with(row, with), outcome.findings);
  } catch (const InputError& error) {
    outcome.findings.insert(error.what());
  }
  outcome.read = watch.read(kLine, steps_of(row.path).back());
  return outcome;
}

// The findings of a world with the element that the same world without it does not have.
inline bool is_named(const Row& row, const Outcome& with, const Loader& loader) {
  const Outcome without = load(row, false, loader);
  return std::any_of(with.findings.begin(), with.findings.end(), [&](const std::string& text) {
    return with.findings.count(text) > without.findings.count(text);
  });
}

// Elements that findings report by another word: the fog as a whole, the kind of a joint.
inline bool is_told_of(const Row& row, const Outcome& with) {
  static const ByEnd kWords = {
      {"fog/color", "<fog>"},         {"fog/start", "<fog>"},
      {"fog/end", "<fog>"},           {"fog/density", "<fog>"},
      {"gearbox_ratio", "'gearbox'"}, {"gearbox_reference_body", "'gearbox'"}};
  const std::string word = by_end(kWords, row.path);
  return !word.empty() &&
         std::any_of(with.findings.begin(), with.findings.end(),
                     [&](const std::string& text) { return text.find(word) != std::string::npos; });
}

// Elements that affect no result, by the ends of their paths; docs/world-files.md lists them.
inline bool is_of_no_effect(const std::string& path) {
  static const char* const kOfNoEffect[] = {"gui",
                                            "world/physics/ode",
                                            "world/physics/simbody",
                                            "world/physics/dart",
                                            "world/physics/bullet",
                                            "physics/@type",
                                            "physics/@name",
                                            "physics/max_contacts",
                                            "physics/real_time_update_rate",
                                            "scene/grid",
                                            "scene/origin_visual",
                                            "must_be_base_link",
                                            "collision/max_contacts",
                                            "visual/meta",
                                            "contact/bullet/soft_cfm",
                                            "contact/bullet/soft_erp",
                                            "contact/bullet/split_impulse",
                                            "contact/bullet/split_impulse_penetration_threshold",
                                            "contact/ode/max_vel",
                                            "contact/ode/min_depth",
                                            "contact/ode/soft_cfm",
                                            "contact/ode/soft_erp",
                                            "physics/ode/cfm_damping",
                                            "physics/ode/implicit_spring_damper",
                                            "physics/provide_feedback",
                                            "simbody/must_be_loop_joint",
                                            "state/@world_name",
                                            "state/iterations",
                                            "state/real_time",
                                            "state/sim_time",
                                            "state/wall_time"};
  // Parts of a saved state that follow from the rest.
  static const std::set<std::string> kFollows = {"acceleration", "wrench", "frame", "collision",
                                                 "@namespace",   "axis",   "axis2"};
  const bool saved = path.starts_with("world/state/");
  const std::vector<std::string> steps = steps_of(path);
  if (saved && std::any_of(steps.begin(), steps.end(),
                           [&](const std::string& step) { return kFollows.contains(step); }))
    return true;
  return std::any_of(std::begin(kOfNoEffect), std::end(kOfNoEffect), [&](const std::string each) {
    return ends_with(path, each) || path.find("/" + each + "/") != std::string::npos ||
           path.starts_with(each + "/");
  });
}

// The paths of elements that no reader reads and no finding reports, one per line.
inline std::string silent_ones(const std::function<bool(const std::string&)>& wanted,
                               const Loader& loader) {
  std::set<std::string> named;  // whose parts say no more
  std::string silent;
  for (const Row& row : rows()) {
    if (!wanted(row.path) || is_of_no_effect(row.path)) continue;
    bool told = false;
    for (size_t at = row.path.find('/'); at != std::string::npos; at = row.path.find('/', at + 1))
      told |= named.contains(row.path.substr(0, at));
    if (told) continue;
    const Outcome outcome = load(row, true, loader);
    const bool is_whole = row.type.empty() && row.path.find('@') == std::string::npos;
    if (is_named(row, outcome, loader))
      named.insert(row.path);
    else if (!outcome.read && !is_whole && !is_told_of(row, outcome))
      silent += row.path + "\n";
  }
  return silent;
}

}  // namespace ruedo::test
