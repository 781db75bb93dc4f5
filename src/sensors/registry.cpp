// The list of all kinds of sensors that are linked in. It lives among the sensors, which are an
// object library, so that whoever links them has all of them.
#include <algorithm>
#include <tuple>

#include "ruedo/sensor.h"

namespace ruedo {
namespace {

// A function's static: registrations run before main, in no order that the language fixes.
std::vector<SensorKind>& registered() {
  static std::vector<SensorKind> kinds;
  return kinds;
}

}  // namespace

RegisterSensor::RegisterSensor(SensorKind kind) {
  std::vector<SensorKind>& kinds = registered();
  const auto place = std::upper_bound(
      kinds.begin(), kinds.end(), kind, [](const SensorKind& a, const SensorKind& b) {
        return std::tie(a.order, a.module, a.name()) < std::tie(b.order, b.module, b.name());
      });
  kinds.insert(place, std::move(kind));
}

const std::vector<SensorKind>& sensor_kinds() { return registered(); }

}  // namespace ruedo
