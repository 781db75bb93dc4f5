// Settings edit a copy of the element of a sensor or drive, which the usual reader then reads as if
// the file said so.
#include "world/settings.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "ruedo/sensor.h"
#include "world/drives/drive.h"
#include "world/drives/odd_drive.h"
#include "world/sdf/sdf_reader.h"

namespace ruedo::world {
namespace {

// Elements of sensors that nothing here reads.
constexpr const char* kWithoutEffect[] = {"always_on", "visualize", "topic", "enable_metrics",
                                          "plugin"};
constexpr const char* kDriveDevices[] = {"velocity", "wheels", "odometry",
                                         "pose",     "motion", "move"};

template <class List>
bool contains(const List& list, const std::string& what) {
  return std::find(std::begin(list), std::end(list), what) != std::end(list);
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

// The devices of a robot that need no <sensor>: those that take commands, and those derived from
// it.
bool is_fixed_device(const std::string& name) {
  if (contains(kDriveDevices, name) || name == "joint_command") return true;
  return std::any_of(sensor_kinds().begin(), sensor_kinds().end(), [&](const SensorKind& kind) {
    return !kind.attach_to.empty() && kind.device_name == name;
  });
}

std::vector<std::string> devices_of(const Model& model) {
  std::vector<std::string> names;
  if (model.drive) names.assign(std::begin(kDriveDevices), std::end(kDriveDevices));
  for (const auto& sensor : model.sensors) names.push_back(sensor.name);
  return names;
}

[[noreturn]] void refuse_device(const Model& model, const std::string& device,
                                const std::string& option) {
  const std::vector<std::string> devices = devices_of(model);
  const std::string near = nearest_word(device, devices);
  throw InputError(
      {}, fmt::format("{}: the robot has no device '{}'{}; there are {}", option, device,
                      near.empty() ? "" : "; did you mean '" + near + "'?", listed(devices)));
}

// The robots of a world by name.
class RobotsByName {
 public:
  explicit RobotsByName(WorldModel& world) : world_(world) {
    for (ModelInstance& instance : world.models) {
      if (instance.is_robot()) robots_.emplace(instance.name, &instance);
    }
  }

  ModelInstance& at(const std::string& name, const std::string& option) const {
    const auto found = robots_.find(name);
    if (found != robots_.end()) return *found->second;
    std::vector<std::string> names;
    for (const auto& [robot, instance] : robots_) names.push_back(robot);
    const std::string near = nearest_word(name, names);
    throw InputError({}, option + ": there is no robot '" + name + "'" +
                             (near.empty() ? "" : "; did you mean '" + near + "'?") +
                             "; there are " + listed(names) + first_error());
  }

 private:
  // Why a robot may not be there.
  std::string first_error() const {
    for (const Finding& finding : world_.findings) {
      if (finding.kind == Finding::Kind::error)
        return "; " + finding.source.str() + ": " + finding.element + ": " + finding.text;
    }
    return "";
  }

  const WorldModel& world_;
  std::map<std::string, ModelInstance*> robots_;
};

// All keys of a sensor, so that values missing in the file can be set, too.
std::vector<std::string> known_keys(const std::string& type) {
  std::vector<std::string> keys = {"update_rate", "pose"};
  for (const SensorKind& kind : sensor_kinds()) {
    if (!kind.settings || !contains(kind.types, type)) continue;
    for (std::string& key : kind.settings(type)) keys.push_back(std::move(key));
  }
  return keys;
}

// All paths below the element that end in a text.
void collect_keys(const Element& element, const std::string& prefix,
                  std::vector<std::string>& keys) {
  for (const auto& child : element.children) {
    if (contains(kWithoutEffect, child->name) || child->name == "ruedo:transducer") continue;
    const std::string key = prefix + child->name;
    if (child->children.empty()) {
      if (!contains(keys, key)) keys.push_back(key);
    } else {
      collect_keys(*child, key + ".", keys);
    }
  }
}

std::string without_prefixes(std::string key) {
  for (size_t at = key.find("ruedo:"); at != std::string::npos; at = key.find("ruedo:"))
    key.erase(at, 6);
  return key;
}

// The unique key that matches: in full, or by its ending ("range.max"); "ruedo:" may be omitted.
std::string resolved(const std::string& wanted, const std::vector<std::string>& keys,
                     const std::string& option) {
  const std::string plain = without_prefixes(wanted);
  std::vector<std::string> matches;
  for (const std::string& key : keys) {
    if (key == wanted) return key;
    const std::string candidate = without_prefixes(key);
    const bool ends = candidate == plain || (candidate.size() > plain.size() &&
                                             candidate.compare(candidate.size() - plain.size(),
                                                               plain.size(), plain) == 0 &&
                                             candidate[candidate.size() - plain.size() - 1] == '.');
    if (candidate == plain) return key;
    if (ends) matches.push_back(key);
  }
  if (matches.size() == 1) return matches[0];
  if (matches.size() > 1)
    throw InputError({}, option + ": '" + wanted + "' could be " + listed(matches));
  const std::string near = nearest_word(wanted, keys);
  throw InputError({}, option + ": there is no '" + wanted + "'" +
                           (near.empty() ? "" : "; did you mean '" + near + "'?") + "; there are " +
                           listed(keys));
}

// A noise of type none reads nothing else, so a deviation set alone would do nothing. Call this
// when everything is set, since the type may be set after it.
void require_noise(const Element& sensor, const std::string& key, const std::string& option) {
  const std::string end = ".noise.";
  const size_t at = key.rfind(end);
  if (at == std::string::npos || key.substr(at + end.size()) == "type") return;
  const std::string noise_key = key.substr(0, at + end.size() - 1);
  std::string path = noise_key;
  std::replace(path.begin(), path.end(), '.', '/');
  const Element& noise = *sensor.child(path);
  const std::string* attribute = noise.attribute("type");
  const Element* type = noise.child("type");
  if ((attribute ? *attribute : type ? type->text : "none") != "none") return;
  throw InputError({}, option + ": has no effect, since the noise is of type none" +
                           (attribute ? " (an attribute of the file)"
                                      : "; set " + noise_key + ".type=gaussian, too"));
}

// The parent of the value gets the option as its source, too: it may refuse the value.
void set_text(Element& element, const std::string& key, const std::string& value,
              const Source& source) {
  Element* at = &element;
  std::string rest = key;
  while (!rest.empty()) {
    const size_t dot = rest.find('.');
    const std::string name = rest.substr(0, dot);
    Element* next = at->child(name);
    if (!next) {
      at->children.push_back(std::make_unique<Element>());
      next = at->children.back().get();
      next->name = name;
    }
    at = next;
    at->source = source;
    rest = dot == std::string::npos ? "" : rest.substr(dot + 1);
  }
  at->text = value;
}

void set_in_drive(Model& model, const Setting& setting, const std::string& option,
                  const Source& source) {
  const bool odometry = setting.device == "odometry";
  std::vector<std::string> keys = odometry ? odometry_elements() : drive_elements();
  std::erase_if(keys, [&](const std::string& key) {
    return !odometry && !steering_has(model.drive->steering, key);
  });
  std::shared_ptr<const Element> original = odometry ? model.drive->odometry : model.drive->element;
  std::unique_ptr<Element> copy;
  if (original)
    copy = original->clone();
  else
    copy = std::make_unique<Element>();
  copy->name = odometry ? "ruedo:odometry" : "ruedo:drive";
  set_text(*copy, resolved(setting.key, keys, option), setting.value, source);
  std::shared_ptr<const Element> edited = std::move(copy);
  // Nesting may have moved base_link, which the drive's own element does not know.
  const Pose X_MBase = model.drive->X_MBase;
  auto drive = read_drive(odometry ? model.drive->element : edited,
                          odometry ? edited : model.drive->odometry, model);
  if (setting.key.find("base") == std::string::npos &&
      setting.key.find("wheel_radius") == std::string::npos)
    drive.X_MBase = X_MBase;
  model.drive = std::move(drive);
}

}  // namespace

void apply_drives(const std::vector<DriveOption>& drives, WorldModel& world) {
  for (const DriveOption& each : drives) {
    const std::string option = "--drive " + each.robot;
    std::vector<std::string> names;
    ModelInstance* instance = nullptr;
    for (ModelInstance& candidate : world.models) {
      names.push_back(candidate.name);
      if (candidate.name == each.robot) instance = &candidate;
    }
    if (!instance) {
      const std::string near = nearest_word(each.robot, names);
      throw InputError({}, option + ": there is no model '" + each.robot + "'" +
                               (near.empty() ? "" : "; did you mean '" + near + "'?") +
                               "; there are " + listed(names));
    }
    if (instance->model->is_static)
      throw InputError({}, option + ": the model is static, and cannot drive");
    auto drive = std::make_shared<Element>();
    drive->name = "ruedo:drive";
    drive->source = {option, 0};
    const auto add = [&](const char* name, const std::string& joint) {
      drive->children.push_back(std::make_unique<Element>());
      Element& child = *drive->children.back();
      child.name = name;
      child.text = joint;
      child.source = drive->source;
    };
    for (const std::string& joint : each.left_joints) add("ruedo:left_joint", joint);
    for (const std::string& joint : each.right_joints) add("ruedo:right_joint", joint);
    auto model = std::make_shared<Model>(*instance->model);
    const auto odometry = model->drive ? model->drive->odometry : nullptr;
    model->drive = read_drive(std::move(drive), odometry, *model);
    instance->model = std::move(model);
    check_channel_names(*instance, {option, 0});
  }
}

void apply_settings(const std::vector<Setting>& settings, WorldModel& world) {
  const RobotsByName robots(world);
  struct SensorSetting {
    const ModelInstance& robot;
    std::string device, key, option;
  };
  std::vector<SensorSetting> of_sensors;
  for (const Setting& setting : settings) {
    const std::string option = "--set " + setting.robot + "/" + setting.device + "." + setting.key;
    ModelInstance& instance = robots.at(setting.robot, option);
    auto model = std::make_shared<Model>(*instance.model);
    const Source source{option, 0};
    const auto sensor = std::find_if(model->sensors.begin(), model->sensors.end(),
                                     [&](const auto& each) { return each.name == setting.device; });
    if (sensor != model->sensors.end()) {
      std::unique_ptr<Element> copy = sensor->element->clone();
      std::vector<std::string> keys;
      collect_keys(*copy, "", keys);
      for (const std::string& key : known_keys(sensor->type)) {
        if (!contains(keys, key)) keys.push_back(key);
      }
      const std::string key = resolved(setting.key, keys, option);
      set_text(*copy, key, setting.value, source);
      if (key == "pose") sensor->X_LS = copy->pose("pose");
      sensor->element = std::move(copy);
      of_sensors.push_back({instance, setting.device, key, option});
    } else if (model->drive && contains(kDriveDevices, setting.device)) {
      set_in_drive(*model, setting, option, source);
    } else {
      refuse_device(*model, setting.device, option);
    }
    instance.model = std::move(model);
  }
  for (const SensorSetting& each : of_sensors) {
    for (const auto& sensor : each.robot.model->sensors) {
      if (sensor.name == each.device) require_noise(*sensor.element, each.key, each.option);
    }
  }
}

void apply_disabled(const std::vector<std::string>& disabled, WorldModel& world) {
  const RobotsByName robots(world);
  std::map<std::pair<std::shared_ptr<const Model>, std::string>, std::shared_ptr<const Model>>
      without;  // equal robots share a model
  for (const std::string& each : disabled) {
    const std::string option = "--disable " + each;
    const size_t slash = each.find('/');
    if (slash == std::string::npos) throw InputError({}, option + ": allowed is ROBOT/DEVICE");
    ModelInstance& instance = robots.at(each.substr(0, slash), option);
    const std::string device = each.substr(slash + 1);
    const auto is_it = [&](const auto& sensor) { return sensor.name == device; };
    if (std::any_of(instance.model->sensors.begin(), instance.model->sensors.end(), is_it)) {
      // Without a drive and sensors, a model is not a robot.
      auto& less = without[{instance.model, device}];
      if (!less) {
        auto model = std::make_shared<Model>(*instance.model);
        std::erase_if(model->sensors, is_it);
        less = std::move(model);
      }
      instance.model = less;
    } else if (is_fixed_device(device)) {
      world.disabled.push_back(each);
    } else {
      refuse_device(*instance.model, device, option);
    }
  }
}

}  // namespace ruedo::world
