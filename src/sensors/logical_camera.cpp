// A logical camera: the models whose origins lie in its frustum, on ROBOT/CAMERA, without occlusion
// and without its own model. The frustum is given by <horizontal_fov> and by <near> and <far> along
// x; its height is its width divided by <aspect_ratio>.
#include "ruedo/bound.h"
#include "ruedo/device_info_t.hpp"
#include "ruedo/logical_camera_t.hpp"
#include "ruedo/math.h"
#include "sensors/mount.h"
#include "sensors/placed_models.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

class LogicalCamera : public SensorOf<LogicalCamera> {
 public:
  explicit LogicalCamera(const SensorSetup& setup)
      : world_(setup.world),
        layout_(setup.layout),
        own_(setup.layout.links[setup.link].instance),
        mount_(setup),
        channel_(setup.channel<logical_camera_t>()) {
    setup.element.refuse_unknown({"ruedo:phase"});
    const Element* own = setup.element.child("logical_camera");
    name_what_does_not_act(setup, own, {"near", "far", "aspect_ratio", "horizontal_fov"});
    static const Element kNothing;
    const Element& camera = own ? *own : kNothing;
    near_m_ = camera.number("near", 0.0, Allowed::not_negative(quantity::kRange));
    far_m_ = camera.number("far", 1.0, Allowed::positive(quantity::kRange));
    if (far_m_ <= near_m_) camera.fail("far has to be beyond near");
    hfov_ =
        camera.number("horizontal_fov", 1.0, Allowed{.min = 0.0, .max = 3.1, .min_excluded = true});
    const double aspect = camera.number("aspect_ratio", 1.0, Allowed::positive(quantity::kFactor));
    half_width_ = math::tan(hfov_ / 2);
    half_height_ = half_width_ / aspect;
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Snapshot& now = input.snapshot;
    const Pose X_SW = mount_.pose(now).inverse();
    message_.utime = now.time;
    message_.objects.clear();
    for (const InstanceIndex i : world_->models.indices()) {
      const world::ModelInstance& instance = world_->models[i];
      if (instance.removed || i == own_) continue;
      const Pose X_SM = X_SW * model_pose(world_, layout_, i, now);
      if (!sees(X_SM.translation)) continue;
      put(instance.name, X_SM, message_.objects.emplace_back());
    }
    message_.n = static_cast<int32_t>(message_.objects.size());
    out.publish(channel_, message_);
  }

  void describe(device_info_t& info) const override {
    info.range_min = near_m_;
    info.range_max = far_m_;
    info.fov_horizontal = hfov_;
    info.fov_vertical = 2 * math::atan(half_height_);
  }

  void exchange(StateArchive&) {}

 private:
  bool sees(const Vec3& p) const {
    return p.x() >= near_m_ && p.x() <= far_m_ && std::abs(p.y()) <= half_width_ * p.x() &&
           std::abs(p.z()) <= half_height_ * p.x();
  }

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  InstanceIndex own_;
  Mount mount_;
  int channel_;
  double near_m_ = 0.0, far_m_ = 1.0, hfov_ = 1.0;
  double half_width_ = 0.0, half_height_ = 0.0;  // m at a distance of 1 m
  logical_camera_t message_;
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"logical_camera"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {10, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<LogicalCamera>(setup); },
     .kind = "logical_camera"}};

}  // namespace
}  // namespace ruedo
