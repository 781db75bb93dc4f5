// A contact sensor (bumper): contacts of the collision shapes named by SDF's <contact>, or of the
// whole link, on ROBOT/CONTACT. Contacts between samples are not lost: `pressed` covers every step
// since the last sample.
#include <algorithm>

#include "ruedo/bound.h"
#include "ruedo/contact_t.hpp"
#include "ruedo/sensor.h"
#include "sensors/contact_points.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

// "robot::chassis::bumper" is the same shape as "bumper".
std::string without_scope(const std::string& name) {
  const size_t colons = name.rfind("::");
  return colons == std::string::npos ? name : name.substr(colons + 2);
}

class ContactSensor : public SensorOf<ContactSensor> {
 public:
  explicit ContactSensor(const SensorSetup& setup)
      : world_(setup.world),
        layout_(setup.layout),
        link_(setup.link),
        channel_(setup.channel<contact_t>()) {
    setup.element.refuse_unknown({"ruedo:phase"});  // read by the server
    const Element* contact = setup.element.child("contact");
    if (!contact) return;
    const world::LinkPlacement& placement = layout_->links[link_];
    const std::vector<world::Collision>& shapes =
        world_->models[placement.instance].model->links[placement.link].collisions;
    for (const Element* named : contact->all("collision")) {
      const std::string name = without_scope(named->text);
      const auto found =
          std::find_if(shapes.begin(), shapes.end(),
                       [&](const world::Collision& shape) { return shape.name == name; });
      if (found != shapes.end()) {
        shapes_.push_back(ShapeIndex(found - shapes.begin()));
      } else if (name != "__default__" && setup.findings) {
        setup.findings->unsupported(
            named->source, "sensor " + setup.device + "/contact/collision",
            "'" + named->text +
                "' is no collision of the sensor's link; without another one, all of them count");
      }
    }
  }

  bool observes() const override { return true; }

  void observe(const Snapshot& now, Outbox&) override {
    if (!pressed_) {
      pressed_ = std::any_of(now.contacts.begin(), now.contacts.end(),
                             [this](const Contact& c) { return is_a(c) || is_b(c); });
    }
  }

  void sample(const SampleInput& input, Outbox& out) override {
    message_.utime = input.snapshot.time;
    message_.points.clear();
    for (const Contact& contact : input.snapshot.contacts) {
      const bool as_a = is_a(contact);
      if (!as_a && !is_b(contact)) continue;
      put(contact, as_a, world_, layout_, message_.points.emplace_back());
    }
    message_.n = static_cast<int32_t>(message_.points.size());
    message_.pressed = pressed_ ? 1 : 0;
    pressed_ = false;
    out.publish(channel_, message_);
  }

  void exchange(StateArchive& archive) { archive(pressed_); }

 private:
  bool counts(ShapeIndex shape) const {
    return shapes_.empty() || !shape.valid() ||
           std::find(shapes_.begin(), shapes_.end(), shape) != shapes_.end();
  }
  bool is_a(const Contact& contact) const {
    return contact.link_a == link_ && counts(contact.shape_a);
  }
  bool is_b(const Contact& contact) const {
    return contact.link_b == link_ && counts(contact.shape_b);
  }

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  LinkIndex link_;
  int channel_;
  std::vector<ShapeIndex> shapes_;  // collisions of the link; empty: all
  bool pressed_ = false;
  contact_t message_;
};

const RegisterSensor kRegister{
    {.module = "contact",
     .order = 6,
     .types = {"contact"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {50, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<ContactSensor>(setup); }}};

}  // namespace
}  // namespace ruedo
