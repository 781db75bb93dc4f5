// IMUs of hector_gazebo_plugins and of gazebo_plugins.
#include "model/sensor_plugins.h"

#include "model/plugins.h"
#include "model/read_context.h"

namespace ruedo::model {
namespace {

Element& add(Element& parent, const char* name, const std::string& text = "") {
  parent.children.push_back(std::make_unique<Element>());
  Element& child = *parent.children.back();
  child.name = name;
  child.text = text;
  child.source = parent.source;
  return child;
}

// One number for all axes, or one each.
void add_noise(Element& imu, const char* quantity, const Element* written) {
  if (!written) return;
  const std::vector<double> values = written->as_numbers(Allowed::any(quantity::kNoise));
  if (values.size() != 1 && values.size() != 3)
    written->fail("'" + written->text + "' is not allowed; allowed are one number or three");
  Element& axes = add(imu, quantity);
  for (size_t i = 0; i < 3; ++i) {
    constexpr const char* kAxes[] = {"x", "y", "z"};
    Element& noise = add(add(axes, kAxes[i]), "noise");
    noise.attributes.emplace_back("type", "gaussian");
    add(noise, "stddev", shown(values[values.size() == 3 ? i : 0]));
  }
}

}  // namespace

PluginSensor sensor_from_plugin(const Element& plugin) {
  const std::string kind = kind_of(plugin).name;
  if (kind != "hector_gazebo_ros_imu" && kind != "gazebo_ros_imu") return {};
  auto sensor = std::make_unique<Element>();
  sensor->name = "sensor";
  sensor->source = plugin.source;
  const std::string* name = plugin.attribute("name");
  sensor->attributes.emplace_back("name", name && !name->empty() ? *name : "imu");
  sensor->attributes.emplace_back("type", "imu");
  if (const double rate = plugin.number("updateRate", 0.0, Allowed::not_negative(quantity::kRange));
      rate > 0)
    add(*sensor, "update_rate", shown(rate));
  Element& imu = add(*sensor, "imu");
  const Element* same_for_all = plugin.child("gaussianNoise");
  add_noise(imu, "angular_velocity",
            plugin.has("rateGaussianNoise") ? plugin.child("rateGaussianNoise") : same_for_all);
  add_noise(imu, "linear_acceleration",
            plugin.has("accelGaussianNoise") ? plugin.child("accelGaussianNoise") : same_for_all);
  return {std::move(sensor), plugin.string("bodyName", "")};
}

}  // namespace ruedo::model
