// A touch trigger, like gz-sim's TouchPlugin: reports that its model has touched a target for some
// time, on ROBOT/DEVICE; at once, and also at its rate. Where Gazebo sends one message and stops,
// `pressed` stays true here, for late subscribers.
//
// It uses the collisions of its contact sensors, or the subset that it names. The target is a part
// of the scoped name of a collision: of a model's, a link's or its own.
#include <algorithm>
#include <optional>

#include "base/whole.h"
#include "ruedo/bound.h"
#include "ruedo/contact_t.hpp"
#include "ruedo/sensor.h"
#include "sensors/contact_points.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

bool ends_with(const std::string& text, const std::string& end) {
  return text == end || text.ends_with("::" + end);
}

class Touch : public SensorOf<Touch> {
 public:
  explicit Touch(const SensorSetup& setup)
      : world_(setup.world),
        layout_(setup.layout),
        own_(setup.layout.links[setup.link].instance),
        channel_(setup.channel<contact_t>()) {
    setup.element.refuse_unknown({"ruedo:phase", "ruedo:target", "ruedo:time", "ruedo:collision"});
    target_ = setup.element.string("ruedo:target", "");
    if (target_.empty()) setup.element.fail("has no <ruedo:target>");
    constexpr double kLongest_s = 1e6;
    time_us_ = microseconds(setup.element.number("ruedo:time", 0, Allowed::between(0, kLongest_s)));
    find_shapes(setup);
  }

  bool observes() const override { return true; }

  void observe(const Snapshot& now, Outbox& out) override {
    if (pressed_) return;
    if (std::none_of(now.contacts.begin(), now.contacts.end(),
                     [this](const Contact& contact) { return side(contact) != 0; })) {
      since_.reset();
      return;
    }
    if (!since_) since_ = now.time;
    if (now.time - *since_ <= time_us_) return;
    pressed_ = true;
    show(now, out);
  }

  void sample(const SampleInput& input, Outbox& out) override {
    if (input.snapshot.step != shown_step_) show(input.snapshot, out);
  }

  void shift_time(SimTime us) override {
    if (since_) *since_ -= us;
    shown_step_ = -1;
  }

  void exchange(StateArchive& archive) { archive(since_, pressed_, shown_step_); }

 private:
  const world::Model& model() const { return *world_->models[own_].model; }

  void find_shapes(const SensorSetup& setup) {
    const std::vector<const Element*> named = setup.element.all("ruedo:collision");
    for (const ModelLinkIndex link : model().links.indices()) {
      const auto& shapes = model().links[link].collisions;
      for (size_t i = 0; i < shapes.size(); ++i) {
        const std::string name = model().links[link].name + "::" + shapes[i].name;
        const bool chosen =
            named.empty() ? is_felt(link, shapes[i].name)
                          : std::any_of(named.begin(), named.end(), [&](const Element* each) {
                              return ends_with(name, each->text) || ends_with(each->text, name);
                            });
        if (chosen) shapes_.emplace_back(layout_->link_of(own_, link), ShapeIndex(i));
      }
    }
    if (!shapes_.empty() || !setup.findings) return;
    setup.findings->unsupported(setup.element.source, "sensor " + setup.device,
                                "the model has no contact sensor with such a collision: here all "
                                "of its collisions feel");
  }

  // From a contact sensor.
  bool is_felt(ModelLinkIndex link, const std::string& shape) const {
    return std::any_of(model().sensors.begin(), model().sensors.end(),
                       [&](const world::SensorDescription& each) {
                         if (each.type != "contact" || each.link != link) return false;
                         const Element* contact = each.element->child("contact");
                         if (!contact || !contact->has("collision")) return true;
                         const auto all = contact->all("collision");
                         return std::any_of(all.begin(), all.end(), [&](const Element* named) {
                           return named->text == "__default__" || ends_with(named->text, shape);
                         });
                       });
  }

  bool feels(LinkIndex link, ShapeIndex shape) const {
    if (layout_->links[link].instance != own_) return false;
    return shapes_.empty() || std::any_of(shapes_.begin(), shapes_.end(), [&](const auto& each) {
             return each.first == link && (!shape.valid() || each.second == shape);
           });
  }

  // In both notations used by Gazebo: model/M/link/L/collision/C, and M::L::C.
  bool is_target(LinkIndex index, ShapeIndex shape) const {
    const world::LinkPlacement& placed = layout_->links[index];
    const world::ModelInstance& instance = world_->models[placed.instance];
    const world::Link& link = instance.model->links[placed.link];
    std::string path, classic;
    for (std::string rest = instance.name + "." + link.name; !rest.empty();) {
      const size_t dot = rest.find('.');
      const std::string part = rest.substr(0, dot);
      path += (dot == std::string::npos ? "link/" : "model/") + part + "/";
      classic += part + "::";
      rest = dot == std::string::npos ? "" : rest.substr(dot + 1);
    }
    const auto is_it = [&](const std::string& name) {
      return (path + "collision/" + name).find(target_) != std::string::npos ||
             (classic + name).find(target_) != std::string::npos;
    };
    if (shape.valid()) return is_it(link.collisions[shape].name);
    return std::any_of(link.collisions.begin(), link.collisions.end(),
                       [&](const world::Collision& each) { return is_it(each.name); });
  }

  // Which side of the contact is the model's: 1 for a, -1 for b; 0: not a contact with the target.
  int side(const Contact& contact) const {
    const bool as_a = feels(contact.link_a, contact.shape_a);
    if (!as_a && !feels(contact.link_b, contact.shape_b)) return 0;
    const bool with_target = as_a ? is_target(contact.link_b, contact.shape_b)
                                  : is_target(contact.link_a, contact.shape_a);
    return !with_target ? 0 : as_a ? 1 : -1;
  }

  void show(const Snapshot& now, Outbox& out) {
    shown_step_ = now.step;
    message_.utime = now.time;
    message_.points.clear();
    for (const Contact& contact : now.contacts) {
      if (const int of = side(contact); of != 0)
        put(contact, of > 0, world_, layout_, message_.points.emplace_back());
    }
    message_.n = static_cast<int32_t>(message_.points.size());
    message_.pressed = pressed_ ? 1 : 0;
    out.publish(channel_, message_);
  }

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  InstanceIndex own_;
  int channel_;
  std::string target_;
  SimTime time_us_ = 0;
  std::vector<std::pair<LinkIndex, ShapeIndex>> shapes_;  // sensitive ones; empty: all
  std::optional<SimTime> since_;                          // start of the uninterrupted contact
  bool pressed_ = false;
  int64_t shown_step_ = -1;
  contact_t message_;
};

const RegisterSensor kRegister{
    {.module = "contact",
     .order = 6,
     .types = {"ruedo:touch"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {10, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<Touch>(setup); },
     .kind = "touch"}};

}  // namespace
}  // namespace ruedo
