// The meaning of labels drawn by the renderer: classes of objects, and temperatures.
//
// Pictures distinguish bodies, not visuals: a body has the first label and the first temperature
// among its visuals.
#pragma once

#include <vector>

#include "world/model/body_layout.h"

namespace ruedo {

class SeenThings {
 public:
  SeenThings(const world::WorldModel& world, const world::BodyLayout& layout)
      : world_(world), layout_(layout) {}

  struct Thing {
    int label = 0;             // 0: none
    double temperature = 0.0;  // K; 0: air temperature
    InstanceIndex instance;
    int number = 0;  // its model's number among those with the label, from 1
  };
  // By pixel value; 0 is nothing. Valid until the next call of update().
  const Thing& operator[](uint16_t pixel) const {
    return things_[pixel < things_.size() ? pixel : 0];
  }
  const std::vector<Thing>& all() const { return things_; }
  // Adds models that have joined since.
  void update();

 private:
  Thing thing_of(const world::ListedBody& listed);

  const world::WorldModel& world_;
  const world::BodyLayout& layout_;
  std::vector<Thing> things_{Thing{}};
};

}  // namespace ruedo
