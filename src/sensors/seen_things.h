// What the labels drawn by the renderer mean: classes of objects, and temperatures.
//
// Pictures tell bodies apart, not the visuals of one: a body has the first label and the first
// temperature of its visuals.
#pragma once

#include <vector>

#include "model/body_layout.h"

namespace ruedo {

class SeenThings {
 public:
  SeenThings(const model::WorldModel& world, const model::BodyLayout& layout)
      : world_(world), layout_(layout) {}

  struct Thing {
    int label = 0;             // 0: none
    double temperature = 0.0;  // K; 0: that of the air
    InstanceIndex instance;
    int number = 0;  // of its model among those of the label, from 1
  };
  // By the value of a pixel; 0 is nothing. Valid until the next call of update().
  const Thing& operator[](uint16_t pixel) const {
    return things_[pixel < things_.size() ? pixel : 0];
  }
  const std::vector<Thing>& all() const { return things_; }
  // Of models that were added since.
  void update();

 private:
  Thing thing_of(const model::ListedBody& listed);

  const model::WorldModel& world_;
  const model::BodyLayout& layout_;
  std::vector<Thing> things_{Thing{}};
};

}  // namespace ruedo
