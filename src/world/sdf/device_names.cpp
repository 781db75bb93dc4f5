// Names of devices and robots: unique, and usable in channel names.
#include <algorithm>
#include <map>
#include <string_view>

#include "base/utf8.h"
#include "world/sdf/sdf_reader.h"

namespace ruedo::world {
namespace {

constexpr size_t kMaxChannel = 63;  // bytes; LCM's limit

constexpr const char* kFixedDevices[] = {"odometry", "pose",          "motion",
                                         "velocity", "wheels",        "move",
                                         "joints",   "joint_command", "collisions"};

bool is_fit(char c) { return static_cast<unsigned char>(c) > 0x20 && c != 0x7f && c != '/'; }

bool fit_for_channel(std::string_view name) {
  return std::all_of(name.begin(), name.end(), is_fit) && for_terminal(name) == name;
}

}  // namespace

std::string made_fit_for_channel(const std::string& name) {
  std::string result = name;
  for (char& c : result) {
    if (!is_fit(c)) c = '_';
  }
  return for_terminal(result);
}

void make_sensor_names_unique(Model& model, const std::string& where, Findings& findings) {
  for (SensorDescription& sensor : model.sensors) {
    const std::string fit = made_fit_for_channel(sensor.name);
    if (fit == sensor.name) continue;
    findings.repaired(sensor.element->source, where,
                      "the sensor name '" + sensor.name +
                          "' is not fit for a channel; it is called '" + fit + "'");
    sensor.name = fit;
  }
  const auto is_kept = [](const std::string& name) {
    return std::find(std::begin(kFixedDevices), std::end(kFixedDevices), name) !=
           std::end(kFixedDevices);
  };
  for (SensorDescription& sensor : model.sensors) {
    if (!is_kept(sensor.name)) continue;
    const std::string other = sensor.name + "_sensor";
    findings.repaired(sensor.element->source, where,
                      "the sensor name '" + sensor.name +
                          "' is kept for the robot's own channel; it is called '" + other + "'");
    sensor.name = other;
  }
  std::map<std::string, int> uses;
  for (const SensorDescription& sensor : model.sensors) ++uses[sensor.name];
  for (SensorDescription& sensor : model.sensors) {
    if (uses[sensor.name] < 2) continue;
    // "arm.laser" twice becomes "arm.wrist-laser": the link's name has the scope already.
    const size_t dot = sensor.name.rfind('.');
    const std::string own = dot == std::string::npos ? sensor.name : sensor.name.substr(dot + 1);
    sensor.name = model.links[sensor.link].name + "-" + own;
  }
  std::map<std::string, const SensorDescription*> seen;
  for (SensorDescription& sensor : model.sensors) {
    const std::string own = sensor.name;
    for (int number = 2; !seen.try_emplace(sensor.name, &sensor).second; ++number)
      sensor.name = own + "_" + std::to_string(number);
    if (sensor.name == own) continue;
    findings.repaired(
        sensor.element->source, where,
        "a second sensor of the name '" + own + "'; it is called '" + sensor.name + "'");
  }
}

std::string shared_path(const ModelInstance& one, const ModelInstance& other) {
  if (one.name.size() > other.name.size()) return shared_path(other, one);
  if (!other.name.starts_with(one.name + "/")) return "";
  const std::string rest = other.name.substr(one.name.size() + 1);
  for (const Link& link : one.model->links) {
    if (link.name == rest) return other.name;
    if (link.name.starts_with(rest + "/") &&
        std::any_of(other.model->links.begin(), other.model->links.end(),
                    [&](const Link& its) { return link.name == rest + "/" + its.name; }))
      return one.name + "/" + link.name;
  }
  return "";
}

void name_shared_paths(const WorldModel& world, Findings& findings) {
  std::map<std::string, const ModelInstance*> by_name;
  for (const ModelInstance& each : world.models) by_name.emplace(each.name, &each);
  for (const ModelInstance& each : world.models) {
    for (size_t at = each.name.find('/'); at != std::string::npos;
         at = each.name.find('/', at + 1)) {
      const auto above = by_name.find(each.name.substr(0, at));
      if (above == by_name.end()) continue;
      if (const std::string path = shared_path(*above->second, each); !path.empty())
        findings.error(each.model->source, "model " + each.name,
                       "'" + path + "' is a link of the model '" + above->first + "', too; a " +
                           "request for it reads one of the two");
    }
  }
}

void check_channel_names(const ModelInstance& instance, const Source& source) {
  if (!instance.is_robot()) return;
  const auto refuse = [](const Source& at, const std::string& what) { throw InputError(at, what); };
  if (instance.name == "ruedo")
    refuse(source, "the model name 'ruedo' is kept for Ruedo's own channels; choose another");
  if (!fit_for_channel(instance.name)) {
    refuse(source, "the model name '" + instance.name +
                       "' is not fit for a channel: it has a '/', a space or a control character");
  }
  const auto check_length = [&](const std::string& device, const Source& at) {
    const std::string channel = instance.name + "/" + device;
    if (channel.size() > kMaxChannel) {
      refuse(at, "the channel '" + channel + "' has " + std::to_string(channel.size()) +
                     " characters; allowed are 63");
    }
  };
  check_length("joint_command", source);
  for (const SensorDescription& sensor : instance.model->sensors) {
    const Source& at = sensor.element->source;
    if (std::find(std::begin(kFixedDevices), std::end(kFixedDevices), sensor.name) !=
        std::end(kFixedDevices)) {
      refuse(at, "the sensor name '" + sensor.name +
                     "' is kept for the robot's own channel; choose another");
    }
    if (!fit_for_channel(sensor.name)) {
      refuse(at, "the sensor name '" + sensor.name +
                     "' is not fit for a channel: it has a '/', a space or a control character");
    }
    check_length(sensor.name + (sensor.type.find("camera") != std::string::npos ? "/labels" : ""),
                 at);
  }
}

}  // namespace ruedo::world
