// The kinds of sensors and of drives that there are: those that are linked in, and those of
// plugins.
#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <tuple>
#include <vector>

#include "ruedo/drive.h"
#include "ruedo/sensor.h"

namespace ruedo {
namespace {

// A list that grows while others walk through it: each addition makes another list, and the old
// ones stay. There are a few dozen entries.
template <class Kind>
class Kinds {
 public:
  const std::vector<Kind>& all() const { return *newest_.load(std::memory_order_acquire); }

  template <class Less>
  void add(Kind kind, Less less) {
    const std::lock_guard lock(mutex_);
    auto list = std::make_unique<std::vector<Kind>>(all());
    list->insert(std::upper_bound(list->begin(), list->end(), kind, less), std::move(kind));
    newest_.store(list.get(), std::memory_order_release);
    lists_.push_back(std::move(list));
  }

 private:
  const std::vector<Kind> none_{};
  std::mutex mutex_;
  std::vector<std::unique_ptr<std::vector<Kind>>> lists_;
  std::atomic<const std::vector<Kind>*> newest_{&none_};
};

// A function's static: registrations run before main, in no order that the language fixes.
template <class Kind>
Kinds<Kind>& registered() {
  static Kinds<Kind> kinds;
  return kinds;
}

}  // namespace

RegisterSensor::RegisterSensor(SensorKind kind) {
  registered<SensorKind>().add(std::move(kind), [](const SensorKind& a, const SensorKind& b) {
    return std::tie(a.order, a.module, a.name()) < std::tie(b.order, b.module, b.name());
  });
}

const std::vector<SensorKind>& sensor_kinds() { return registered<SensorKind>().all(); }

RegisterDrive::RegisterDrive(DriveKind kind) {
  registered<DriveKind>().add(
      std::move(kind), [](const DriveKind& a, const DriveKind& b) { return a.type < b.type; });
}

const std::vector<DriveKind>& drive_kinds() { return registered<DriveKind>().all(); }

}  // namespace ruedo
