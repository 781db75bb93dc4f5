// Poses and twists of devices.
#include "sensors/mount.h"

#include <algorithm>

#include "world/model/body_layout.h"
#include "world/read/read_context.h"

namespace ruedo {

Mount::Mount(const SensorSetup& setup, const Pose& X_SD)
    : layout_(setup.layout),
      link_(setup.link),
      body_(setup.layout.links[setup.link].body),
      X_LS_(setup.X_LS * X_SD) {}

Pose Mount::start() const {
  const Pose X_BS = layout_->links[link_].X_BL * X_LS_;
  return body_.valid() ? layout_->bodies[body_].X_WB * X_BS : X_BS;
}

Pose Mount::pose(const Snapshot& now) const {
  if (!body_.valid()) return start();
  const world::LinkPlacement& link = layout_->links[link_];
  const Pose X_BL = link.wheel.valid() ? layout_->link_in_body(link_, now.wheel_angles) : link.X_BL;
  return now.bodies[body_] * X_BL * X_LS_;
}

Twist Mount::twist(const Snapshot& now) const {
  if (!body_.valid()) return {};
  const Pose& X_WB = now.bodies[body_];
  const Vec3 p_WS = pose(now).translation;
  Twist twist = now.body_twists[body_];
  twist.linear += twist.angular.cross(p_WS - X_WB.translation);
  const world::LinkPlacement& link = layout_->links[link_];
  if (link.wheel.valid()) {
    const world::WheelPlacement& wheel = layout_->wheels[link.wheel];
    const Pose X_WWheel = X_WB * layout_->link_in_body(wheel.link, now.wheel_angles);
    const Vec3 omega = now.wheel_rates[link.wheel] * (X_WWheel.rotation * wheel.axis_in_L);
    twist.linear += omega.cross(p_WS - X_WWheel * wheel.center_in_L);
    twist.angular += omega;
  }
  return twist;
}

void name_what_does_not_act(const SensorSetup& setup, const Element* element,
                            const std::vector<std::string>& read) {
  if (!element || !setup.findings) return;
  for (const auto& child : element->children) {
    if (std::find(read.begin(), read.end(), child->name) != read.end()) continue;
    world::report_unknown(*child, "<" + child->name + ">", nearest_word(child->name, read),
                          "sensor " + setup.device + "/" + element->name, *setup.findings);
  }
}

void name_where_written(const SensorSetup& setup, const Element& element,
                        const std::vector<std::string>& children) {
  if (!setup.findings) return;
  for (const std::string& name : children) {
    if (const Element* child = element.child(name))
      setup.findings->unsupported(child->source, "sensor " + setup.device + "/" + element.name,
                                  "<" + name + "> is not supported and left out");
  }
}

}  // namespace ruedo
