// IMU, GPS, magnetometer, barometer, force-torque and pose plugins of gazebo_plugins,
// hector_gazebo_plugins and gz-sim. Parameter names follow the plugins' documentation; each has had
// several spellings.
#include "world/compat/sensor_plugins.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "ruedo/math.h"
#include "world/compat/plugins.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

using Words = std::vector<std::string>;

Element& add(Element& parent, const std::string& name, const std::string& text = "") {
  parent.children.push_back(std::make_unique<Element>());
  Element& child = *parent.children.back();
  child.name = name;
  child.text = text;
  child.source = parent.source;
  return child;
}

// The first of these children that is given.
const Element* first_of(const Element& plugin, const Words& names) {
  for (const std::string& name : names) {
    if (const Element* child = plugin.child(name)) return child;
  }
  return nullptr;
}

double number(const Element& plugin, const Words& names, double fallback, Allowed allowed) {
  const Element* written = first_of(plugin, names);
  return written ? written->as_number(allowed) : fallback;
}

// One number for all axes, or one for each.
std::vector<double> axes(const Element* written, double fallback) {
  if (!written) return {fallback, fallback, fallback};
  std::vector<double> values = written->as_numbers(Allowed::any(quantity::kNoise));
  if (values.size() != 1 && values.size() != 3)
    written->fail("'" + written->text + "' is not allowed; allowed are one number or three");
  if (values.size() == 1) values.resize(3, values[0]);
  return values;
}

// hector's error model (sensor_model.h): white noise, a constant offset, and a drift, which is a
// Gauss-Markov process with that stationary deviation and correlation time 1 / frequency. Expressed
// as SDF's dynamic bias, whose stationary variance is sigma^2 tau / 2, sigma is drift sqrt(2
// frequency).
struct Errors {
  std::vector<double> noise, offset, drift, frequency;

  // prefix: "", "velocity", "accel", "rate". usual: used where the prefixed noise is not given.
  Errors(const Element& plugin, const std::string& prefix, const Element* usual = nullptr) {
    constexpr double kDriftFrequency = 1.0 / 3600.0;  // Hz, hector's default
    const auto of = [&](std::string name) {
      if (!prefix.empty()) name[0] = static_cast<char>(std::toupper(name[0]));
      return plugin.child(prefix + name);
    };
    const Element* own = of("gaussianNoise");
    noise = axes(own ? own : usual, 0.0);
    offset = axes(of("offset"), 0.0);
    drift = axes(of("drift"), 0.0);
    frequency = axes(of("driftFrequency"), kDriftFrequency);
  }

  // The <noise> of an axis, scaled to the unit of the value that it is added to.
  void add_to(Element& quantity, size_t axis, double scale = 1.0) const {
    if (noise[axis] == 0.0 && offset[axis] == 0.0 && drift[axis] == 0.0) return;
    Element& element = add(quantity, "noise");
    element.attributes.emplace_back("type", "gaussian");
    add(element, "stddev", shown(std::abs(scale * noise[axis])));
    if (offset[axis] != 0.0) add(element, "bias_mean", shown(scale * offset[axis]));
    if (drift[axis] == 0.0 || frequency[axis] <= 0.0) return;
    const double sigma = std::abs(scale * drift[axis]) * std::sqrt(2.0 * frequency[axis]);
    add(element, "dynamic_bias_stddev", shown(sigma));
    add(element, "dynamic_bias_correlation_time", shown(1.0 / frequency[axis]));
  }

  void add_axes(Element& parent) const {
    constexpr const char* kAxes[] = {"x", "y", "z"};
    for (size_t i = 0; i < 3; ++i) add_to(add(parent, kAxes[i]), i);
  }

  void add_horizontal_and_vertical(Element& parent) const {
    add_to(add(parent, "horizontal"), 0);
    add_to(add(parent, "vertical"), 2);
  }
};

struct Made {
  const Element& plugin;
  Element& sensor;
  std::string where;
  const std::vector<const Element*>& performers;
  Findings& findings;

  void without_effect(const Words& names, const std::string& text) const {
    for (const std::string& name : names) {
      if (const Element* element = plugin.child(name))
        findings.unsupported(
            element->source, where,
            "<" + name + "> of the plugin " + kind_of(plugin).name + " is not supported: " + text);
    }
  }
};

void make_imu(const Made& made) {
  Element& imu = add(made.sensor, "imu");
  const Element* same_for_all = first_of(made.plugin, {"gaussianNoise", "gaussian_noise"});
  Errors(made.plugin, "rate", same_for_all).add_axes(add(imu, "angular_velocity"));
  Errors(made.plugin, "accel", same_for_all).add_axes(add(imu, "linear_acceleration"));
  made.without_effect({"accelScaleError", "rateScaleError"}, "scales are exact");
  made.without_effect({"headingOffset", "headingDrift", "headingGaussianNoise", "yawOffset",
                       "yawDrift", "yawGaussianNoise"},
                      "the orientation is the true one");
}

// In hector's plugin, the world's x axis points to the compass heading <referenceHeading>; 49.9 N,
// 8.9 E are its defaults.
void make_gps(const Made& made) {
  Element& navsat = add(made.sensor, "navsat");
  Errors(made.plugin, "").add_horizontal_and_vertical(add(navsat, "position_sensing"));
  Errors(made.plugin, "velocity").add_horizontal_and_vertical(add(navsat, "velocity_sensing"));
  const auto degrees = [&](const char* name, double fallback, Allowed allowed) {
    return number(made.plugin, {name}, fallback, allowed);
  };
  Element& place = add(made.sensor, "ruedo:place");
  add(place, "ruedo:latitude_deg",
      shown(degrees("referenceLatitude", 49.9, Allowed::between(-90, 90))));
  add(place, "ruedo:longitude_deg",
      shown(degrees("referenceLongitude", 8.9, Allowed::between(-360, 360))));
  add(place, "ruedo:elevation",
      shown(number(made.plugin, {"referenceAltitude"}, 0.0, Allowed::any(quantity::kLength))));
  add(place, "ruedo:heading_deg",
      shown(90.0 - degrees("referenceHeading", 0.0, Allowed::between(-1e5, 1e5))));
  made.without_effect({"status", "service"}, "every fix is a good one");
}

// In the unit of <magnitude>; the world's x axis points to the compass heading <referenceHeading>.
void make_magnetometer(const Made& made) {
  constexpr double kDegree = M_PI / 180.0;
  Errors(made.plugin, "").add_axes(add(made.sensor, "magnetometer"));
  const auto of = [&](const char* name, double fallback) {
    return number(made.plugin, {name}, fallback, Allowed::any(quantity::kAngle));
  };
  const double magnitude = of("magnitude", 1.0), down = kDegree * of("inclination", 60.0),
               turned = kDegree * (of("referenceHeading", 0.0) - of("declination", 0.0));
  const double field[] = {magnitude * math::cos(down) * math::cos(turned),
                          magnitude * math::cos(down) * math::sin(turned),
                          -magnitude * math::sin(down)};
  add(made.sensor, "ruedo:magnetic_field",
      shown(field[0]) + " " + shown(field[1]) + " " + shown(field[2]));
}

// The plugin's noise is in metres of height; a metre is 12.013 Pa at sea level, p g / (R T).
void make_barometer(const Made& made) {
  Element& air = add(made.sensor, "air_pressure");
  add(air, "reference_altitude",
      shown(number(made.plugin, {"elevation"}, 0.0, Allowed::any(quantity::kLength))));
  Errors(made.plugin, "").add_to(add(air, "pressure"), 2, -12.013);
  made.without_effect({"qnh"}, "<atmosphere> of the world has the pressure at sea level");
}

void make_pose(const Made& made) {
  Element& pose = add(made.sensor, "ruedo:pose");
  const double noise =
      number(made.plugin, {"gaussianNoise", "gaussian_noise"}, 0.0, Allowed::any(quantity::kNoise));
  if (noise != 0.0) {
    for (const char* part : {"ruedo:velocity", "ruedo:turn_rate"}) {
      Element& element = add(add(pose, part), "noise");
      element.attributes.emplace_back("type", "gaussian");
      add(element, "stddev", shown(std::abs(noise)));
    }
  }
  if (const Element* dimensions = made.plugin.child("dimensions"))
    add(pose, "ruedo:dimensions", std::to_string(dimensions->as_integer(Allowed::between(2, 3))));
  if (const Element* frame = first_of(made.plugin, {"frameName", "frame_name"});
      frame && frame->text.find("world") == std::string::npos &&
      frame->text.find("map") == std::string::npos && frame->text.find("odom") == std::string::npos)
    made.findings.unsupported(frame->source, made.where,
                              "<" + frame->name + "> '" + frame->text +
                                  "' is not supported: the pose is relative to the world");
}

void make_force_torque(const Made& made) {
  Element& sensor = add(made.sensor, "force_torque");
  if (const Element* noise = first_of(made.plugin, {"gaussianNoise", "gaussian_noise"})) {
    const double sigma = std::abs(noise->as_number(Allowed::any(quantity::kNoise)));
    for (const char* part : {"force", "torque"}) {
      Element& quantity = add(sensor, part);
      for (const char* axis : {"x", "y", "z"}) {
        Element& element = add(add(quantity, axis), "noise");
        element.attributes.emplace_back("type", "gaussian");
        add(element, "stddev", shown(sigma));
      }
    }
  }
}

const Element& required(const Element& plugin, const char* name) {
  const Element* child = plugin.child(name);
  if (!child || child->text.empty())
    plugin.fail(kind_of(plugin).name + " has no <" + std::string(name) + ">");
  return *child;
}

// The last part of a topic, if it is usable in a channel name.
void name_by_topic(const std::string& topic, Element& sensor) {
  constexpr size_t kLongest = 24;
  std::string name = topic;
  while (!name.empty() && name.back() == '/') name.pop_back();
  name = name.substr(name.rfind('/') + 1);
  if (name.empty() || name.size() > kLongest) return;
  for (auto& [key, value] : sensor.attributes) {
    if (key == "name") value = name;
  }
}

void make_touch(const Made& made) {
  const Element& time = required(made.plugin, "time");
  constexpr double kLongest_s = 1e6;
  add(made.sensor, "ruedo:target", required(made.plugin, "target").text);
  add(made.sensor, "ruedo:time", shown(time.as_number(Allowed::between(0, kLongest_s))));
  for (const Element* each : made.plugin.all("collision"))
    add(made.sensor, "ruedo:collision", each->text);
  name_by_topic(made.plugin.string("namespace", ""), made.sensor);
  if (!made.plugin.boolean("enabled", false))
    made.findings.unsupported(
        made.plugin.source, made.where,
        "the plugin TouchPlugin is enabled from the start: Ruedo has no service "
        "that enables it");
}

void make_detector(const Made& made) {
  const Element* size = made.plugin.child("geometry/box/size");
  if (!size) made.plugin.fail("PerformerDetector has no <geometry><box><size>");
  size->as_vector3(Allowed::not_negative(quantity::kLength));
  add(made.sensor, "ruedo:size", size->text);
  const Vec3 offset = made.plugin.pose("pose").translation;
  add(made.sensor, "ruedo:offset",
      shown(offset.x()) + " " + shown(offset.y()) + " " + shown(offset.z()));
  for (const Element* performer : made.performers) {
    Element& each = add(made.sensor, "ruedo:performer");
    add(each, "ruedo:model", dotted(performer->string("ref", "")));
    add(each, "ruedo:size", performer->string("geometry/box/size", ""));
  }
  if (made.performers.empty())
    made.findings.unsupported(made.plugin.source, made.where,
                              "PerformerDetector detects nobody: the world has no <performer>");
  made.without_effect({"header_data"}, "messages have no header");
  name_by_topic(made.plugin.string("topic", ""), made.sensor);
}

struct Maker {
  const char* plugin;
  const char* type;
  const char* name;  // used if the plugin's own name cannot be a device's
  void (*make)(const Made&);
};

constexpr Maker kMakers[] = {
    {"hector_gazebo_ros_imu", "imu", "imu", make_imu},
    {"gazebo_ros_imu", "imu", "imu", make_imu},
    {"hector_gazebo_ros_gps", "navsat", "gps", make_gps},
    {"hector_gazebo_ros_magnetic", "magnetometer", "magnetic", make_magnetometer},
    {"hector_gazebo_ros_baro", "air_pressure", "baro", make_barometer},
    {"gazebo_ros_p3d", "ruedo:pose", "p3d", make_pose},
    {"gazebo_ros_ft_sensor", "force_torque", "ft_sensor", make_force_torque},
    {"OdometryPublisher", "ruedo:pose", "odometry_publisher", make_pose},
    {"TouchPlugin", "ruedo:touch", "touch", make_touch},
    {"PerformerDetector", "ruedo:performer_detector", "performer_detector", make_detector},
};

// <xyzOffset> and <rpyOffset>, as the <pose> of the sensor.
void add_pose(const Element& plugin, Element& sensor) {
  const auto three = [&](const Words& names) {
    const Element* written = first_of(plugin, names);
    return written ? written->as_vector3(Allowed::any(quantity::kLength)) : Vec3(Vec3::Zero());
  };
  const Vec3 xyz = three({"xyzOffset", "xyzOffsets", "xyz_offset", "xyz_offsets"}),
             rpy = three({"rpyOffset", "rpyOffsets", "rpy_offset", "rpy_offsets"});
  if (xyz.isZero() && rpy.isZero()) return;
  std::string text;
  for (const Vec3& part : {xyz, rpy}) {
    for (const double value : part) text += (text.empty() ? "" : " ") + shown(value);
  }
  add(sensor, "pose", text);
}

}  // namespace

PluginSensor sensor_from_plugin(const Element& plugin, const std::string& where,
                                const std::vector<const Element*>& performers, Findings& findings) {
  const std::string kind = kind_of(plugin).name;
  const auto maker = std::find_if(std::begin(kMakers), std::end(kMakers),
                                  [&](const Maker& each) { return each.plugin == kind; });
  if (maker == std::end(kMakers)) return {};
  auto sensor = std::make_unique<Element>();
  sensor->name = "sensor";
  sensor->source = plugin.source;
  const std::string* name = plugin.attribute("name");
  const bool usable = name && !name->empty() && name->find("::") == std::string::npos;
  sensor->attributes.emplace_back("name", usable ? *name : maker->name);
  sensor->attributes.emplace_back("type", maker->type);
  const double rate =
      number(plugin, {"updateRate", "update_rate", "updateRateHZ", "odom_publish_frequency"}, 0.0,
             Allowed::not_negative(quantity::kRange));
  if (rate > 0) add(*sensor, "update_rate", shown(rate));
  add_pose(plugin, *sensor);
  maker->make({plugin, *sensor, where, performers, findings});
  const Element* body = first_of(plugin, {"bodyName", "body_name"});
  const Element* joint = first_of(plugin, {"jointName", "joint_name"});
  return {std::move(sensor), body ? body->text : "", joint ? joint->text : ""};
}

}  // namespace ruedo::world
