// Common to sensors that cast rays: the device's pose, and the properties of surfaces that it hits.
#pragma once

#include "ruedo/bound.h"
#include "ruedo/sensor.h"
#include "scene/rays/ray_scene.h"
#include "world/model/body_layout.h"

namespace ruedo {

// A device's mount on its robot.
class RayMount {
 public:
  explicit RayMount(const SensorSetup& setup)
      : world_(setup.world), layout_(setup.layout), link_(setup.link) {
    const world::LinkPlacement& link = setup.layout.links[setup.link];
    body_ = link.body;
    X_LS_ = setup.X_LS;
    X_BS_ = link.X_BL * setup.X_LS;
    turns_ = link.wheel.valid();
  }

  LinkIndex link() const { return link_; }
  Pose X_WS(const Snapshot& now) const {
    if (!body_.valid()) return X_BS_;
    const Pose& X_WB = now.bodies[body_];
    return turns_ ? X_WB * layout_->link_in_body(link_, now.wheel_angles) * X_LS_ : X_WB * X_BS_;
  }

  // The surface that a ray hit; visuals have the default surface.
  const world::Surface& surface(const scene::Hit& hit, bool visuals = false) const {
    static const world::Surface kDefault;
    if (visuals) return kDefault;
    const world::LinkPlacement& link = layout_->links[hit.link];
    const world::Model& model = *world_->models[link.instance].model;
    return model.links[link.link].collisions[hit.shape].surface;
  }

 private:
  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  LinkIndex link_;
  BodyIndex body_;      // none: static, X_BS_ is then X_WS
  bool turns_ = false;  // with a wheel that is part of that body
  Pose X_LS_;
  Pose X_BS_;
};

}  // namespace ruedo
