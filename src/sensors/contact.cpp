// A contact sensor (bumper): contacts of the collision shapes named by SDF's <contact>, or of the
// whole link, on ROBOT/CONTACT. Contacts between samples are not lost: `pressed` covers every step
// since the last sample.
//
// A kinematic robot on a level plane has no contact pair with it (robot/kinematic_drive.h), so what
// of it reaches down to the plane is computed here; the force of such a point is not known, 0 N.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include "ruedo/bound.h"
#include "ruedo/contact_t.hpp"
#include "ruedo/sensor.h"
#include "sensors/contact_points.h"
#include "world/model/body_layout.h"
#include "world/model/ground.h"

namespace ruedo {
namespace {

// "robot::chassis::bumper" is the same shape as "bumper".
std::string without_scope(const std::string& name) {
  const size_t colons = name.rfind("::");
  return colons == std::string::npos ? name : name.substr(colons + 2);
}

constexpr double kOnPlane_m = 1e-6;  // a robot that a plane carries is exactly on it

class ContactSensor : public SensorOf<ContactSensor> {
 public:
  explicit ContactSensor(const SensorSetup& setup)
      : world_(setup.world),
        layout_(setup.layout),
        link_(setup.link),
        channel_(setup.channel<contact_t>()) {
    setup.element.refuse_unknown({"ruedo:phase"});  // read by the server
    if (const Element* contact = setup.element.child("contact")) read_shapes(*contact, setup);
    find_soles(setup.robot_index);
  }

  void read_shapes(const Element& contact, const SensorSetup& setup) {
    for (const Element* named : contact.all("collision")) {
      const std::string name = without_scope(named->text);
      auto shape = shape_of(link_, [&](const world::Collision& each) { return each.name == name; });
      if (!shape) shape = shape_of_converter(name);
      if (shape) {
        shapes_.push_back(*shape);
      } else if (name != "__default__" && setup.findings) {
        setup.findings->unsupported(named->source, "sensor " + setup.device + "/contact/collision",
                                    "'" + named->text +
                                        "' is not a collision of the sensor's link; without "
                                        "another one, all of them count");
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
    add_plane(input.snapshot);
    message_.n = static_cast<int32_t>(message_.points.size());
    message_.pressed = pressed_ || message_.n > 0 ? 1 : 0;
    pressed_ = false;
    out.publish(channel_, message_);
  }

  void exchange(StateArchive& archive) { archive(pressed_); }

 private:
  struct Shape {
    LinkIndex link;
    ShapeIndex shape;
  };

  const world::Link& model_link(LinkIndex link) const {
    const world::LinkPlacement& placement = layout_->links[link];
    return world_->models[placement.instance].model->links[placement.link];
  }

  template <class Is>
  std::optional<Shape> shape_of(LinkIndex link, Is is) const {
    const auto& shapes = model_link(link).collisions;
    const auto found = std::find_if(shapes.begin(), shapes.end(), is);
    if (found == shapes.end()) return std::nullopt;
    return Shape{link, ShapeIndex(found - shapes.begin())};
  }

  // The names that sdformat's converter of URDF makes: LINK_collision, LINK_collision_1, ..., or
  // PARENT_fixed_joint_lump__LINK_collision of a link that it joined to its parent. Here such a
  // link is still one of its own, whose shapes are in the file's order.
  std::optional<Shape> shape_of_converter(const std::string& name) const {
    constexpr std::string_view kJoined = "_fixed_joint_lump__", kShape = "_collision";
    const size_t joined = name.rfind(kJoined);
    const std::string own =
        joined == std::string::npos ? name : name.substr(joined + kJoined.size());
    const size_t end = own.rfind(kShape);
    if (end == std::string::npos) return std::nullopt;
    const std::string number = own.substr(end + kShape.size());
    size_t index = 0;
    if (!number.empty()) {
      const char* const past = number.data() + number.size();
      const auto read = std::from_chars(number.data() + 1, past, index);
      if (number[0] != '_' || read.ec != std::errc() || read.ptr != past) return std::nullopt;
    }
    const world::LinkPlacement& sensor = layout_->links[link_];
    for (const LinkIndex link : layout_->links.indices()) {
      const world::LinkPlacement& other = layout_->links[link];
      if (other.instance != sensor.instance || other.body != sensor.body ||
          model_link(link).name != own.substr(0, end))
        continue;
      if (index < model_link(link).collisions.size()) return Shape{link, ShapeIndex(index)};
    }
    return std::nullopt;
  }

  // Those of its shapes on which a kinematic robot stands.
  void find_soles(RobotIndex robot) {
    constexpr double kStands_m = 2e-3;  // as in robot/kinematic_drive.cpp
    if (!robot.valid()) return;
    const world::RobotPlacement& placement = layout_->robots[robot];
    const auto& drive = world_->models[placement.instance].model->drive;
    if (!drive || drive->kind != world::DriveDescription::Kind::kinematic) return;
    robot_ = robot;
    lowest_ = world::lowest_of_wheels(world_, layout_, robot);
    const Pose X_BaseB = placement.X_BBase.inverse();
    for (const LinkIndex link : layout_->links.indices()) {
      if (layout_->links[link].body != placement.body) continue;
      const auto& shapes = model_link(link).collisions;
      for (size_t i = 0; i < shapes.size(); ++i) {
        if (!counts(link, ShapeIndex(i))) continue;
        const Pose X_BaseC = X_BaseB * layout_->links[link].X_BL * shapes[i].X_LC;
        if (world::lowest_point(shapes[i].geometry, X_BaseC) < lowest_ + kStands_m)
          soles_.push_back({{link, ShapeIndex(i)}, X_BaseC.translation});
      }
    }
  }

  void add_plane(const Snapshot& now) {
    if (soles_.empty()) return;
    const Pose& X_WBase = now.robots[robot_].X_WBase;
    const double sole = X_WBase.translation.z() + lowest_;
    const auto plane = world::nearest_plane(world_, layout_, sole);
    const bool upright = (X_WBase.rotation * Vec3::UnitZ()).z() > 1.0 - 1e-9;
    if (!plane || !upright || std::abs(sole - plane->height) > kOnPlane_m) return;
    for (const auto& [shape, p_BaseC] : soles_) {
      if (touches(now, shape, plane->link)) continue;
      Contact contact;
      contact.link_a = shape.link;
      contact.link_b = plane->link;
      contact.position = X_WBase * p_BaseC;
      contact.position.z() = plane->height;
      put(contact, true, world_, layout_, message_.points.emplace_back());
    }
  }

  static bool touches(const Snapshot& now, const Shape& shape, LinkIndex other) {
    return std::any_of(now.contacts.begin(), now.contacts.end(), [&](const Contact& c) {
      return (c.link_a == shape.link && c.shape_a == shape.shape && c.link_b == other) ||
             (c.link_b == shape.link && c.shape_b == shape.shape && c.link_a == other);
    });
  }

  bool counts(LinkIndex link, ShapeIndex shape) const {
    if (shapes_.empty()) return link == link_;
    return std::any_of(shapes_.begin(), shapes_.end(), [&](const Shape& each) {
      return each.link == link && (!shape.valid() || each.shape == shape);
    });
  }
  bool is_a(const Contact& contact) const { return counts(contact.link_a, contact.shape_a); }
  bool is_b(const Contact& contact) const { return counts(contact.link_b, contact.shape_b); }

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  LinkIndex link_;
  int channel_;
  std::vector<Shape> shapes_;  // empty: all of the link
  struct Sole {
    Shape shape;
    Vec3 p_BaseC;
  };
  std::vector<Sole> soles_;  // of a kinematic robot
  RobotIndex robot_;
  double lowest_ = 0.0;  // of its wheels, m above base_link
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
