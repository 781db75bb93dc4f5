// The pose and motion of a device, from a snapshot. On a wheel it rotates with the wheel.
#pragma once

#include <array>
#include <string>

#include "ruedo/bound.h"
#include "ruedo/sensor.h"
#include "ruedo/state_archive.h"
#include "sensors/noise.h"

namespace ruedo {

class Mount {
 public:
  // X_SD: what is measured, in the device's frame.
  explicit Mount(const SensorSetup& setup, const Pose& X_SD = {});

  BodyIndex body() const { return body_; }  // none: static
  Pose start() const;                       // X_WS in the world's initial state
  Pose pose(const Snapshot& now) const;     // X_WS
  Twist twist(const Snapshot& now) const;   // of S's origin, expressed in the world

 private:
  Bound<const world::BodyLayout> layout_;
  LinkIndex link_;
  BodyIndex body_;
  Pose X_LS_;
};

// The noises of a device: read in a fixed order, and drawn in that order from the device's own
// random numbers.
template <size_t count>
class Noises {
 public:
  // Their paths in the sensor's element: "altimeter/vertical_position/noise"; several may have the
  // same.
  Noises(const SensorSetup& setup, const std::array<std::string, count>& paths)
      : random_(setup.random) {
    RandomStream constants = random_.stream(kConstantDraws);
    for (size_t i = 0; i < count; ++i) {
      const Noise read(setup.element.child(paths[i]));
      if (setup.noise) noises_[i] = read;
      noises_[i].draw_bias(constants);
    }
  }

  // The measured values of a sample at that time.
  std::array<double, count> apply(const std::array<double, count>& ideal, SimTime time,
                                  int64_t sample) {
    const double dt_s = sampled_ ? 1e-6 * static_cast<double>(time - time_) : 0.0;
    sampled_ = true;
    time_ = time;
    RandomStream stream = random_.stream(static_cast<uint64_t>(sample));
    std::array<double, count> measured;
    for (size_t i = 0; i < count; ++i) measured[i] = noises_[i].apply(ideal[i], dt_s, stream);
    return measured;
  }

  void shift_time(SimTime us) { time_ -= us; }
  void exchange(StateArchive& archive) { archive(noises_, time_, sampled_); }
  const Noise& operator[](size_t i) const { return noises_[i]; }

 private:
  RandomSource random_;
  std::array<Noise, count> noises_;
  SimTime time_ = 0;
  bool sampled_ = false;
};

// For a <sensor>'s own element (<navsat>, <altimeter>): reports children not in `read` as having no
// effect.
void name_what_does_not_act(const SensorSetup& setup, const Element* element,
                            const std::vector<std::string>& read);

// Reports these children of a <sensor>'s element as having no effect.
void name_where_written(const SensorSetup& setup, const Element& element,
                        const std::vector<std::string>& children);

}  // namespace ruedo
