// A bounding-box camera: where labelled models are in its picture, or in space, on ROBOT/CAMERA;
// intrinsics on /info. Labels are those of gz-sim's plugin Label.
//
// <box_type> 2d, visible_2d, visible_box_2d: around the visible pixels of a model. full_2d,
// full_box_2d: around the projected corners of the boxes of its labelled visuals, as if nothing
// were in front, clipped to the picture; only for models with a visible pixel. 3d: the box along
// the model's axes around those corners, for models with a visible pixel; exact for boxes, slightly
// too large for other shapes. Of a model partly behind the camera, the part in front counts.
#include <algorithm>
#include <map>

#include "ruedo/boxes_2d_t.hpp"
#include "ruedo/boxes_3d_t.hpp"
#include "sensors/camera_view.h"
#include "sensors/placed_models.h"
#include "sensors/seen_things.h"
#include "world/model/bounds.h"

namespace ruedo {
namespace {

enum class Kind { visible, full, solid };

// A rectangle in pixel-centre coordinates.
using Rectangle = Eigen::AlignedBox2d;

class BoxesCamera : public Sensor {
 public:
  explicit BoxesCamera(const SensorSetup& setup)
      : world_(setup.world),
        layout_(setup.layout),
        kind_(kind_of(setup.element)),
        channel_(kind_ == Kind::solid ? setup.channel<boxes_3d_t>() : setup.channel<boxes_2d_t>()),
        view_(setup, {"box_type"}),
        things_(setup.world, setup.layout) {
    setup.element.refuse_unknown({"ruedo:phase"});
    boxes_.width = view_.lens().width;
    boxes_.height = view_.lens().height;
  }

  void sample(const SampleInput& input, Outbox& out) override {
    things_.update();
    find_visible(view_.labels(input));
    if (kind_ == Kind::solid)
      publish_solid(input, out);
    else
      publish_flat(input, out);
    view_.publish_info(input, out);
  }

  void describe(device_info_t& info) const override { view_.describe(info); }

 private:
  struct Seen {
    int label = 0;
    Rectangle pixels;  // visible ones
  };

  static Kind kind_of(const Element& sensor) {
    const char* const path = sensor.has("camera/box_type") ? "camera/box_type" : "box_type";
    const std::string type = sensor.choice(
        path, "2d", {"2d", "visible_2d", "visible_box_2d", "full_2d", "full_box_2d", "3d"});
    if (type == "3d") return Kind::solid;
    return type.rfind("full", 0) == 0 ? Kind::full : Kind::visible;
  }

  void find_visible(const cv::Mat& labels) {
    seen_.clear();
    for (int row = 0; row < labels.rows; ++row) {
      const auto* pixels = labels.ptr<uint16_t>(row);
      for (int column = 0; column < labels.cols; ++column) {
        const SeenThings::Thing& thing = things_[pixels[column]];
        if (thing.label == 0) continue;
        Seen& seen = seen_[thing.instance];
        seen.label = thing.label;
        seen.pixels.extend(Eigen::Vector2d(column, row));
      }
    }
  }

  void publish_flat(const SampleInput& input, Outbox& out) {
    boxes_.utime = input.snapshot.time;
    boxes_.boxes.clear();
    for (const auto& [instance, seen] : seen_) {
      const Rectangle around =
          kind_ == Kind::full ? projected(instance, input.snapshot) : seen.pixels;
      box_2d_t& box = boxes_.boxes.emplace_back();
      box.label = seen.label;
      box.name = world_.models[instance].name;
      box.x = around.center().x();
      box.y = around.center().y();
      // A pixel has its full width; projected edges are exact.
      const double more = kind_ == Kind::full ? 0.0 : 1.0;
      box.width = around.sizes().x() + more;
      box.height = around.sizes().y() + more;
    }
    boxes_.n = static_cast<int32_t>(boxes_.boxes.size());
    out.publish(channel_, boxes_);
  }

  void publish_solid(const SampleInput& input, Outbox& out) {
    solids_.utime = input.snapshot.time;
    solids_.boxes.clear();
    const Pose X_CW = view_.pose(input.snapshot).inverse();
    for (const auto& [instance, seen] : seen_) {
      const Pose X_CM = X_CW * model_pose(world_, layout_, instance, input.snapshot);
      Eigen::AlignedBox3d around;
      each_corner(instance, input.snapshot, X_CM.inverse() * X_CW,
                  [&](const Vec3& p_M) { around.extend(p_M); });
      box_3d_t& box = solids_.boxes.emplace_back();
      box.label = seen.label;
      box.name = world_.models[instance].name;
      const Vec3 center = X_CM * Vec3(around.center());
      const Vec3 size = around.sizes();
      const Quat& q = X_CM.rotation;
      const double wxyz[] = {q.w(), q.x(), q.y(), q.z()};
      std::copy_n(center.data(), 3, box.center);
      std::copy_n(size.data(), 3, box.size);
      std::copy(std::begin(wxyz), std::end(wxyz), box.orientation);
    }
    solids_.n = static_cast<int32_t>(solids_.boxes.size());
    out.publish(channel_, solids_);
  }

  // Visits the corners of the boxes of a model's labelled visuals, in frame F; takes X_FW.
  template <class Visit>
  void each_corner(InstanceIndex instance, const Snapshot& now, const Pose& X_FW,
                   const Visit& visit) const {
    const world::Model& model = *world_.models[instance].model;
    for (const ModelLinkIndex i : model.links.indices()) {
      const Pose X_FL = X_FW * link_pose(layout_, layout_.link_of(instance, i), now);
      for (const world::Visual& visual : model.links[i].visuals) {
        const Eigen::AlignedBox3d box = world::bounds(visual.geometry);
        if (visual.label == 0 || box.isEmpty()) continue;
        for (int corner = 0; corner < 8; ++corner)
          visit(X_FL * visual.X_LV *
                Vec3(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))));
      }
    }
  }

  Rectangle projected(InstanceIndex instance, const Snapshot& now) const {
    Rectangle around;
    each_corner(instance, now, view_.pose(now).inverse(), [&](Vec3 p) {
      p.x() = std::max(p.x(), view_.lens().near_m);
      around.extend(view_.seen_at(p));
    });
    const Rectangle picture(Eigen::Vector2d(-0.5, -0.5),
                            Eigen::Vector2d(view_.lens().width - 0.5, view_.lens().height - 0.5));
    return around.intersection(picture);
  }

  const world::WorldModel& world_;
  const world::BodyLayout& layout_;
  Kind kind_;
  int channel_;
  CameraView view_;
  SeenThings things_;
  std::map<InstanceIndex, Seen> seen_;  // by instance: in world order
  boxes_2d_t boxes_;
  boxes_3d_t solids_;
};

const RegisterSensor kRegister{
    {.module = "camera",
     .order = 4,
     .types = {"boundingbox", "boundingbox_camera"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {30, 1},
     .needs_renderer = true,
     .make = [](const SensorSetup& setup) { return std::make_unique<BoxesCamera>(setup); },
     .kind = "boundingbox_camera",
     .settings = camera_settings}};

}  // namespace
}  // namespace ruedo
