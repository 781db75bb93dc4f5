// Converts the world's links to Bullet's collision objects: a static object for each collision that
// never moves, a compound rigid body for each body of the layout.
#pragma once

#include <memory>
#include <vector>

#include "physics/base/bullet.h"
#include "physics/bodies/surfaces.h"
#include "physics/collision/convex_shapes.h"
#include "physics/collision/shapes.h"
#include "world/model/body_layout.h"

namespace ruedo::physics {

// Links a collision object to the rest of Ruedo; Bullet's user pointer leads here.
struct ObjectInfo {
  BodyIndex body;  // none: static
  InstanceIndex instance;
  bool self_collide = false;  // of its model
  bool plane = false;
  bool on_plane = false;  // supported by a plane without a contact pair
  bool moved = false;     // kinematic: moved from outside, never by contacts
  bool gone = false;      // its model was removed
  struct Shape {
    LinkIndex link;
    ShapeIndex collision;  // in its link
    ShapeSurface surface;
  };
  std::vector<Shape> shapes;      // for each child shape; one entry for a single shape
  std::vector<BodyIndex> joined;  // bodies connected to this one by a joint
};

inline const ObjectInfo& info_of(const btCollisionObject& object) {
  return *static_cast<const ObjectInfo*>(object.getUserPointer());
}

// The shape for a child index of Bullet; for a static object its only shape; for one without shapes
// none.
const ObjectInfo::Shape& shape_of(const ObjectInfo& info, int child);

// The wheel that this body is, with a wheels drive: it rolls on a tyre. None for other bodies.
WheelIndex driven_wheel(const world::BodyLayout& layout, BodyIndex body);

// A moving body. Bullet's frame I has its origin at the centre of mass, along the principal axes of
// inertia.
struct RigidBody {
  std::unique_ptr<BodyShape> compound;
  std::unique_ptr<btRigidBody> bullet;
  ObjectInfo info;
  Pose X_BI;
  Vec3 gravity = Vec3::Zero();                              // at the start
  bool sleeps = true;                                       // when it is at rest
  double wind_mass = 0.0;                                   // kg, of its links exposed to the wind
  Vec3 wind_center = Vec3::Zero();                          // centre of that mass, in I
  Vec3 box_center = Vec3::Zero(), box_half = Vec3::Zero();  // bounds of the shapes, in B
};

struct StaticObject {
  btCollisionObject bullet;
  ObjectInfo info;
};

class RigidBodies {
 public:
  RigidBodies(const world::WorldModel& world, const world::BodyLayout& layout);

  // Creates the bodies and joints of a new instance of the layout, at the end of the lists.
  void append(const world::WorldModel& world, const world::BodyLayout& layout,
              InstanceIndex instance);

  IndexedVector<BodyIndex, RigidBody> bodies;          // numbered as in the layout
  std::vector<std::unique_ptr<StaticObject>> statics;  // in world order
  std::vector<Finding> findings;

 private:
  void make_statics(const world::WorldModel& world, const world::BodyLayout& layout,
                    LinkIndex link);
  ShapeSurface tyre_of(const world::WorldModel& world, const world::BodyLayout& layout,
                       WheelIndex wheel, const ShapeSurface& surface) const;
  ShapeSurface foot_of(const world::WorldModel& world, const world::BodyLayout& layout,
                       InstanceIndex instance, const ShapeSurface& surface) const;
  void make_body(const world::WorldModel& world, const world::BodyLayout& layout, BodyIndex index);
  void make_compound(const world::WorldModel& world, const world::BodyLayout& layout,
                     WheelIndex wheel, RigidBody& body);
  ShapeFactory shapes_;
};

}  // namespace ruedo::physics
