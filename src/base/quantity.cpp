// The table of quantities.
#include "ruedo/quantity.h"

namespace ruedo {

std::span<const Quantity> quantities() {
  using namespace quantity;
  static constexpr Quantity kAll[] = {kLength,  kRange,      kAngle,    kFactor,  kMass,
                                      kInertia, kDensity,    kGravity,  kSpeed,   kAcceleration,
                                      kEffort,  kDamping,    kFriction, kContact, kTime,
                                      kNoise,   kBrightness, kPixels};
  return kAll;
}

}  // namespace ruedo
