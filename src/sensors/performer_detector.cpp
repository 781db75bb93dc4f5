// Performers in a region, like gz-sim's PerformerDetector, on ROBOT/DEVICE: published at once when
// one enters or leaves, and at its rate.
//
// The region is an axis-aligned box around its model's origin plus <ruedo:offset>, which turns with
// the model. A performer is inside if its own axis-aligned box touches it.
#include <algorithm>

#include "ruedo/bound.h"
#include "ruedo/logical_camera_t.hpp"
#include "ruedo/sensor.h"
#include "sensors/placed_models.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

class PerformerDetector : public SensorOf<PerformerDetector> {
 public:
  explicit PerformerDetector(const SensorSetup& setup)
      : world_(setup.world),
        layout_(setup.layout),
        own_(setup.layout.links[setup.link].instance),
        channel_(setup.channel<logical_camera_t>()) {
    const Element& element = setup.element;
    element.refuse_unknown({"ruedo:phase", "ruedo:size", "ruedo:offset", "ruedo:performer"});
    half_ = half_size(element);
    offset_M_ = element.vector3("ruedo:offset", offset_M_, Allowed::any(quantity::kLength));
    for (const Element* each : element.all("ruedo:performer")) {
      each->refuse_unknown({"ruedo:model", "ruedo:size"}, false);
      performers_.push_back({each->string("ruedo:model", ""), half_size(*each), {}, false});
      if (performers_.back().model.empty()) each->fail("has no <ruedo:model>");
    }
  }

  bool observes() const override { return true; }

  void observe(const Snapshot& now, Outbox& out) override {
    if (look(now) && now.step > 0) show(now, out);  // the initial state is a sample anyway
  }

  void sample(const SampleInput& input, Outbox& out) override {
    if (input.snapshot.step != shown_step_) show(input.snapshot, out);
  }

  void shift_time(SimTime) override { shown_step_ = -1; }

  void exchange(StateArchive& archive) {
    for (Performer& each : performers_) archive(each.instance, each.inside);
    archive(shown_step_);
  }

 private:
  struct Performer {
    std::string model;
    Vec3 half;               // m, of its box
    InstanceIndex instance;  // where it was last found
    bool inside;
  };

  static Vec3 half_size(const Element& element) {
    if (!element.has("ruedo:size")) element.fail("has no <ruedo:size>");
    return 0.5 *
           element.vector3("ruedo:size", Vec3::Zero(), Allowed::not_negative(quantity::kLength));
  }

  bool is(const Performer& performer, InstanceIndex instance) const {
    return world_->models.has(instance) && !world_->models[instance].removed &&
           world_->models[instance].name == performer.model;
  }

  void find(Performer& performer) const {
    if (is(performer, performer.instance)) return;
    performer.instance = {};
    for (const InstanceIndex i : world_->models.indices()) {
      if (is(performer, i)) performer.instance = i;
    }
  }

  // True if somebody entered or left.
  bool look(const Snapshot& now) {
    const Vec3 middle = model_pose(world_, layout_, own_, now) * offset_M_;
    bool news = false;
    for (Performer& each : performers_) {
      find(each);
      bool inside = false;
      if (each.instance.valid()) {
        const Vec3 away = model_pose(world_, layout_, each.instance, now).translation - middle;
        inside = ((away.cwiseAbs() - each.half - half_).array() <= 0.0).all();
      }
      news |= inside != each.inside;
      each.inside = inside;
    }
    return news;
  }

  void show(const Snapshot& now, Outbox& out) {
    shown_step_ = now.step;
    message_.utime = now.time;
    message_.objects.clear();
    const Pose X_MW = model_pose(world_, layout_, own_, now).inverse();
    for (const Performer& each : performers_) {
      if (each.inside)
        put(each.model, X_MW * model_pose(world_, layout_, each.instance, now),
            message_.objects.emplace_back());
    }
    message_.n = static_cast<int32_t>(message_.objects.size());
    out.publish(channel_, message_);
  }

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  InstanceIndex own_;
  int channel_;
  Vec3 half_, offset_M_ = Vec3::Zero();
  std::vector<Performer> performers_;  // in file order
  int64_t shown_step_ = -1;
  logical_camera_t message_;
};

const RegisterSensor kRegister{
    {.module = "instruments",
     .order = 7,
     .types = {"ruedo:performer_detector"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {10, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<PerformerDetector>(setup); },
     .kind = "performer_detector"}};

}  // namespace
}  // namespace ruedo
