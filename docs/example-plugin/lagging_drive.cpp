// A drive whose wheels follow the commanded speed with a first-order lag:
// <ruedo:drive type="lagging">.
//
// Model: v' = (asked - v) / T, solved exactly over a step in which `asked` is constant; the
// result is the mean over the step.
#include <ruedo/drive.h>
#include <ruedo/math.h>

namespace {

using namespace ruedo;

class LaggingDrive : public DriveModel {
 public:
  explicit LaggingDrive(const DriveSetup& setup)
      : time_constant_(setup.element.number("time_constant", 0.2, {.min = 1e-3, .max = 10.0})),
        kept_(math::exp(-setup.step_s / time_constant_)),
        mean_(time_constant_ / setup.step_s * (1.0 - kept_)) {}

  BaseVelocity step(const DriveInput& input) override {
    return {follow(v_.ahead, input.asked.ahead), follow(v_.left, input.asked.left),
            follow(v_.turn, input.asked.turn)};
  }
  bool copy_from(const DriveModel& other) override {
    *this = static_cast<const LaggingDrive&>(other);
    return true;
  }

 private:
  double follow(double& v, double asked) const {
    const double missing = v - asked;
    v = asked + kept_ * missing;
    return asked + mean_ * missing;
  }

  double time_constant_;  // s
  double kept_,
      mean_;        // fractions of the speed error at the start of a step: at its end, and its mean
  BaseVelocity v_;  // at the end of the last step
};

const RegisterDrive kRegister{{.type = "lagging", .make = [](const DriveSetup& setup) {
                                 return std::make_unique<LaggingDrive>(setup);
                               }}};

}  // namespace
