// The plugins WindEffects of gz-sim and WindPlugin of Gazebo Classic, which share their elements.
#include <cmath>

#include "world/read/read_context.h"
#include "world/sdf/environment.h"

namespace ruedo::world {
namespace {

const Allowed kSeconds = Allowed::not_negative(quantity::kTime);

// Only Gaussian noise that is drawn independently in each step.
Wind::Noise read_noise(const Element& of, const char* unit_name, double unit, Findings& findings) {
  Wind::Noise noise;
  const Element* written = of.child("noise");
  if (!written) return noise;
  const std::string* attribute = written->attribute("type");
  const std::string type = attribute ? *attribute : written->string("type", "gaussian");
  if (type == "none") return noise;
  const Allowed any = Allowed::any(quantity::kFactor);
  noise.mean = unit * written->number("mean", 0.0, any);
  noise.stddev = unit * written->number("stddev", 0.0, Allowed::not_negative(quantity::kFactor));
  const auto name = [&](const Element& at, const std::string& what) {
    findings.unsupported(at.source, "world/plugin",
                         what + " of the wind's " + unit_name +
                             " is not supported: its noise is drawn anew in each step");
  };
  if (type != "gaussian") name(*written, "the noise '" + type + "'");
  for (const char* each : {"bias_mean", "bias_stddev", "dynamic_bias_stddev"}) {
    if (written->number(each, 0.0, any) != 0.0)
      name(*written->child(each), "<" + std::string(each) + ">");
  }
  return noise;
}

void read_horizontal(const Element& horizontal, Wind& wind, Findings& findings) {
  const Allowed period = Allowed::positive(quantity::kTime);
  if (const Element* speed = horizontal.child("magnitude")) {
    wind.rise_s = speed->number("time_for_rise", wind.rise_s, kSeconds);
    wind.swing = speed->number("sin/amplitude_percent", 0.0, Allowed::any(quantity::kFactor));
    wind.swing_period_s = speed->number("sin/period", 1.0, period);
    wind.speed_noise = read_noise(*speed, "speed", 1.0, findings);
  }
  if (const Element* direction = horizontal.child("direction")) {
    constexpr double kDegree = M_PI / 180.0;
    wind.turn_rad =
        kDegree * direction->number("sin/amplitude", 0.0, Allowed::any(quantity::kAngle));
    wind.turn_period_s = direction->number("sin/period", 1.0, period);
    wind.turn_noise = read_noise(*direction, "direction", kDegree, findings);
  }
}

}  // namespace

void read_wind_plugin(const Element& plugin, Wind& wind, Findings& findings) {
  // a higher gain would make a link follow the wind within a step
  constexpr double kMostGain = 100.0;
  Wind read = wind;
  read.pushes = true;
  read.rise_s = read.vertical_rise_s = 1.0;
  if (const Element* gain = plugin.child("force_approximation_scaling_factor")) {
    if (gain->children.empty())
      read.gain = gain->as_number(Allowed::between(0, kMostGain));
    else
      findings.unsupported(
          gain->source, "world/plugin",
          "<" + gain->name + "> by places is not supported: the wind pushes everywhere as hard");
  }
  if (const Element* horizontal = plugin.child("horizontal"))
    read_horizontal(*horizontal, read, findings);
  if (const Element* vertical = plugin.child("vertical")) {
    read.vertical_rise_s = vertical->number("time_for_rise", read.vertical_rise_s, kSeconds);
    read.vertical_noise = read_noise(*vertical, "vertical speed", 1.0, findings);
  }
  wind = read;
}

}  // namespace ruedo::world
