// Distances: closed forms, a table by another library, and which things carry a robot.
#include "physics/bodies/distances.h"

#include <fstream>
#include <numbers>
#include <sstream>

#include <gtest/gtest.h>

#include "ruedo/random.h"
#include "world.h"

namespace ruedo::physics::testing {
namespace {

using Nearest = Distances::Nearest;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

world::Geometry geometry(world::Shape shape, const Vec3& size = Vec3::Zero()) {
  world::Geometry made;
  made.shape = shape;
  made.size = size;
  return made;
}
world::Geometry box(double x, double y, double z) { return geometry(world::Shape::box, {x, y, z}); }
world::Geometry sphere(double radius) { return geometry(world::Shape::sphere, {radius, 0, 0}); }
world::Geometry cylinder(double radius, double length) {
  return geometry(world::Shape::cylinder, {radius, length, 0});
}
world::Geometry capsule(double radius, double length) {
  return geometry(world::Shape::capsule, {radius, length, 0});
}
world::Geometry plane(const Vec3& normal) {
  world::Geometry made = geometry(world::Shape::plane);
  made.normal = normal;
  return made;
}
world::Geometry mesh(const std::vector<Eigen::Vector3f>& corners) {
  auto triangles = std::make_shared<world::Mesh>();
  triangles->positions = corners;
  for (uint32_t i = 0; i + 2 < corners.size(); i += 3)
    triangles->triangles.push_back({i, i + 1, i + 2});
  world::Geometry made = geometry(world::Shape::mesh);
  made.mesh = triangles;
  return made;
}

void add(world::WorldModel& world, const world::Geometry& geometry, const Pose& X, bool is_static) {
  auto model = std::make_shared<world::Model>();
  model->is_static = is_static;
  world::Link link;
  link.collisions.emplace_back().geometry = geometry;
  model->links.push_back(link);
  world.models.push_back({"m", X, model});
}

Snapshot still(const world::BodyLayout& layout) {
  Snapshot snapshot;
  for (const world::BodyPlacement& body : layout.bodies) snapshot.bodies.push_back(body.X_WB);
  snapshot.wheel_angles.resize(layout.wheels.size());
  snapshot.robots.resize(layout.robots.size());
  for (const RobotIndex i : layout.robots.indices()) {
    const world::RobotPlacement& robot = layout.robots[i];
    snapshot.robots[i].X_WBase =
        robot.body.valid() ? layout.bodies[robot.body].X_WB * robot.X_BBase : robot.X_BBase;
  }
  return snapshot;
}

// From a, which moves, to b, which does unless it is `fixed`.
Nearest between(const world::Geometry& a, const Pose& X_WA, const world::Geometry& b,
                const Pose& X_WB, bool fixed = true, double reach = 100.0) {
  world::WorldModel world;
  add(world, a, X_WA, false);
  add(world, b, X_WB, fixed);
  const world::BodyLayout layout(world);
  return Distances(world, layout, InstanceIndex(0)).nearest(still(layout), reach);
}

Pose at(double x, double y, double z, double roll = 0.0, double pitch = 0.0, double yaw = 0.0) {
  return Pose::from_xyz_rpy({x, y, z}, {roll, pitch, yaw});
}

TEST(Distances, ClosedFormsFromAMillimetreToTenMetres) {
  constexpr double kRight = std::numbers::pi / 2, kEighth = std::numbers::pi / 4;
  const double root2 = std::numbers::sqrt2;
  for (const double s : {1e-3, 1e-2, 0.1, 1.0, 10.0}) {
    for (const double gap : {1e-4, 1e-3, 0.1, 1.0, 5.0}) {
      const auto expect = [&](const char* what, const Nearest& found, double distance) {
        EXPECT_NEAR(found.distance, distance, 1e-6) << what << ", size " << s << ", gap " << gap;
        const double apart = (found.own_point - found.other_point).norm();
        EXPECT_NEAR(distance > 0.0 ? apart : 0.0, distance, 1e-6) << what;
      };
      expect("spheres", between(sphere(s), at(1, 2, 3), sphere(2 * s), at(1 + 3 * s + gap, 2, 3)),
             gap);
      expect("sphere and box, face",
             between(sphere(s), at(0.1 * s, -0.2 * s, 2 * s + gap), box(s, s, 2 * s), Pose()), gap);
      expect("sphere and box, corner",
             between(sphere(s), at(s + gap, s + gap, s + gap), box(2 * s, 2 * s, 2 * s), Pose()),
             std::max(gap * std::sqrt(3.0) - s, 0.0));
      expect("boxes, face", between(box(s, s, s), at(s + gap, s / 3, 0), box(s, 3 * s, s), Pose()),
             gap);
      expect(
          "boxes, edge and face",
          between(box(s, s, s), at(0, 0, s / 2 + s / root2 + gap, kEighth), box(s, s, s), Pose()),
          gap);
      expect("boxes, crossed edges",
             between(box(s, s, s), at(0, 0, root2 * s + gap, kEighth), box(s, s, s),
                     at(0, 0, 0, 0, kEighth)),
             gap);
      expect("cylinder, its face to a plane",
             between(cylinder(s, 2 * s), at(3, 4, s + gap), plane({0, 0, 1}), Pose()), gap);
      expect("cylinder, lying on a tilted plane",
             between(cylinder(s, 2 * s),
                     at(-(s + gap) * std::sin(0.3), 0, (s + gap) * std::cos(0.3), 0, kRight - 0.3),
                     plane({-std::sin(0.3), 0, std::cos(0.3)}), Pose()),
             gap);
      expect("tilted cylinder and box: the rim",
             between(cylinder(s, 2 * s), at(0, 0, s * std::cos(0.4) + s * std::sin(0.4) + gap, 0.4),
                     box(20 * s, 20 * s, s), at(0, 0, -s / 2)),
             gap);
      expect("crossed cylinders",
             between(cylinder(s, 4 * s), at(0, 0, 3 * s + gap, kRight), cylinder(2 * s, 8 * s),
                     at(0, 0, 0, 0, kRight)),
             gap);
      const world::Geometry triangle =
          mesh({Eigen::Vector3f(-8, -8, 0), Eigen::Vector3f(8, -8, 0), Eigen::Vector3f(0, 8, 0)});
      expect("capsule and triangle, end on",
             between(capsule(s, 2 * s), at(0, 0, 2 * s + gap), triangle, Pose()), gap);
      expect("capsule beside the edge of a triangle",
             between(capsule(s, 2 * s), at(0.5, -8 - s - gap, 0.3 * s), triangle, Pose()), gap);
      const world::Geometry ellipsoid = geometry(world::Shape::ellipsoid, {s, 2 * s, 3 * s});
      expect("ellipsoid and sphere", between(ellipsoid, at(0, 3 * s + gap, 0), sphere(s), Pose()),
             gap);
      const world::Geometry cone = geometry(world::Shape::cone, {s, 2 * s, 0});
      expect("a cone's tip", between(cone, at(0, 0, -s - gap), box(s, s, s), at(0, 0, s / 2)), gap);
      expect("a cone's side",
             between(cone, Pose(), sphere(s),
                     at(s / 2 + (s + gap) * 2 / std::sqrt(5.0), 0, (s + gap) / std::sqrt(5.0))),
             gap);
    }
  }
}

TEST(Distances, OverlapIsZeroAndFartherThanReachIsNothing) {
  EXPECT_EQ(between(box(1, 1, 1), Pose(), sphere(0.2), at(0.1, 0, 0)).distance, 0.0);
  EXPECT_EQ(between(box(1, 1, 1), Pose(), plane({0, 0, 1}), at(0, 0, 3)).distance, 0.0);
  EXPECT_EQ(between(box(1, 1, 1), Pose(), box(1, 1, 1), at(2, 0, 0), true, 0.999).distance,
            kInfinite);
  EXPECT_NEAR(between(box(1, 1, 1), Pose(), box(1, 1, 1), at(2, 0, 0), true, 1.001).distance, 1.0,
              1e-9);
}

// A shape of pairs.txt: see distances/make_pairs.py.
std::pair<world::Geometry, Pose> read_shape(std::istream& in) {
  std::string kind;
  Pose X;
  size_t count = 0;
  in >> kind >> X.translation.x() >> X.translation.y() >> X.translation.z() >> X.rotation.w() >>
      X.rotation.x() >> X.rotation.y() >> X.rotation.z() >> count;
  std::vector<double> n(count);
  for (double& number : n) in >> number;
  if (kind == "plane") return {plane({n[0], n[1], n[2]}), X};
  if (kind == "hull" || kind == "mesh") {
    std::vector<Eigen::Vector3f> points;
    for (size_t i = 0; i < count; i += 3)
      points.push_back(Vec3(n[i], n[i + 1], n[i + 2]).cast<float>());
    world::Geometry made = mesh(points);
    if (kind == "hull") {  // one connected part
      auto joined = std::make_shared<world::Mesh>(*made.mesh);
      joined->triangles.clear();
      for (uint32_t i = 0; i + 2 < points.size(); ++i)
        joined->triangles.push_back({i, i + 1, i + 2});
      made.mesh = joined;
    }
    return {made, X};
  }
  using world::Shape;
  static const std::map<std::string, Shape> kShapes{
      {"box", Shape::box},         {"sphere", Shape::sphere},       {"cylinder", Shape::cylinder},
      {"capsule", Shape::capsule}, {"ellipsoid", Shape::ellipsoid}, {"cone", Shape::cone}};
  n.resize(3);
  return {geometry(kShapes.at(kind), {n[0], n[1], n[2]}), X};
}

TEST(Distances, AgreeWithAnotherLibrary) {
  std::ifstream file(RUEDO_SOURCE_DIR "/tests/physics/distances/pairs.txt");
  int pairs = 0;
  for (std::string line; std::getline(file, line); ++pairs) {
    std::istringstream in(line);
    const auto [a, X_WA] = read_shape(in);
    const auto [b, X_WB] = read_shape(in);
    double distance = -1.0;
    ASSERT_TRUE(in >> distance) << line;
    const bool fixed = line.find(" mesh ") != std::string::npos || b.shape == world::Shape::plane;
    const Nearest found = between(a, X_WA, b, X_WB, fixed);
    EXPECT_NEAR(found.distance, distance, 1e-6) << line;
    if (b.shape == world::Shape::plane || fixed) continue;
    const Nearest back = between(b, X_WB, a, X_WA, false);
    EXPECT_NEAR(back.distance, found.distance, 1e-6) << line;
  }
  EXPECT_GT(pairs, 300);
}

// A robot among things.
class Around {
 public:
  explicit Around(const std::string& models, const std::vector<world::Geometry>& meshes = {})
      : world_(*world::load_world_text("<sdf version='1.9' xmlns:ruedo='https://ruedo.org'><world "
                                       "name='w'>" +
                                           models + "</world></sdf>",
                                       "test.sdf")) {
    for (const world::Geometry& geometry : meshes) add(world_, geometry, Pose(), true);
    layout_ = std::make_unique<world::BodyLayout>(world_);
    snapshot = still(*layout_);
    distances_ =
        std::make_unique<Distances>(world_, *layout_, layout_->robots[RobotIndex(0)].instance);
  }
  Nearest nearest(double reach = 2.0) { return distances_->nearest(snapshot, reach); }
  std::string name(LinkIndex link) const {
    const auto& placement = layout_->links[link];
    const auto& instance = world_.models[placement.instance];
    return instance.name + "/" + instance.model->links[placement.link].name;
  }
  // The whole robot, which stands at the world's origin at first.
  void move(const Pose& X) {
    for (const BodyIndex i : layout_->bodies.indices()) {
      if (layout_->bodies[i].instance == layout_->robots[RobotIndex(0)].instance)
        snapshot.bodies[i] = X * layout_->bodies[i].X_WB;
    }
    snapshot.robots[RobotIndex(0)].X_WBase = X;
  }
  LinkIndex link(const std::string& wanted) const {
    for (const LinkIndex i : layout_->links.indices()) {
      if (name(i) == wanted) return i;
    }
    return {};
  }
  BodyIndex body(const std::string& wanted) const { return layout_->links[link(wanted)].body; }

  Snapshot snapshot;

 private:
  world::WorldModel world_;
  std::unique_ptr<world::BodyLayout> layout_;
  std::unique_ptr<Distances> distances_;
};

const std::string kRobot = "<include><uri>model://p3at</uri></include>";
constexpr double kFront = 0.257;  // m: x of the robot's deck, 0.221 to 0.2775 m high

std::string block(const std::string& name, const Vec3& size, const Pose& X) {
  std::ostringstream pose, lengths;
  const Vec3 rpy = X.rotation.toRotationMatrix().eulerAngles(2, 1, 0).reverse();
  pose << X.translation.transpose() << ' ' << rpy.transpose();
  lengths << size.transpose();
  return thing(name, pose.str(), "<box><size>" + lengths.str() + "</size></box>", 0);
}

TEST(Distances, SeeATableTopThatStandsBetweenHorizontalRays) {
  Around robot(kRobot + kPlane + block("table", {1, 1, 0.08}, at(kFront + 0.017 + 0.5, 0, 0.24)));
  const Nearest nearest = robot.nearest();
  EXPECT_NEAR(nearest.distance, 0.017, 1e-6);
  EXPECT_EQ(robot.name(nearest.own), "p3at/base_link");
  EXPECT_EQ(robot.name(nearest.other), "table/l");
  EXPECT_NEAR(nearest.other_point.x(), kFront + 0.017, 1e-6);
  EXPECT_EQ(robot.nearest(0.016).distance, kInfinite);
}

TEST(Distances, TurnWithTheJoints) {
  const std::string arm =
      "<model name='arm'><link name='base_link'><collision name='c'><geometry><box><size>0.4 0.4 "
      "0.2</size></box></geometry><pose>0 0 0.1 0 0 0</pose></collision><sensor name='i' "
      "type='imu'/></link><link name='upper'><pose>0 0 0.9 0 0 0</pose><collision "
      "name='c'><pose>0.4 0 0 0 1.5707963267948966 0</pose><geometry><capsule><radius>0.02</radius>"
      "<length>0.8</length></capsule></geometry></collision></link><joint name='j' "
      "type='revolute'><parent>base_link</parent><child>upper</child><axis><xyz>0 1 0</xyz></axis>"
      "</joint></model>";
  Around robot(arm + kPlane + block("table", {0.4, 2, 0.04}, at(0.8, 0, 0.7)));
  EXPECT_NEAR(robot.nearest().distance, 0.9 - 0.02 - 0.72, 1e-6);
  Pose& X_WB = robot.snapshot.bodies[robot.body("arm/upper")];
  X_WB.rotation = Quat(Eigen::AngleAxisd(0.1, Vec3::UnitY()));
  const Nearest nearest = robot.nearest();
  EXPECT_NEAR(nearest.distance, 0.9 - 0.8 * std::sin(0.1) - 0.02 - 0.72, 1e-6);
  EXPECT_EQ(robot.name(nearest.own), "arm/upper");
  EXPECT_NEAR(nearest.own_point.x(), 0.8 * std::cos(0.1), 1e-5);
  X_WB.rotation = Quat(Eigen::AngleAxisd(0.25, Vec3::UnitY()));
  EXPECT_EQ(robot.nearest().distance, 0.0);  // carried by nothing: it is in the table
}

// A floor of 0.5 m squares and, 3 m from the middle, walls 1 m high, in one mesh.
world::Geometry room(double tilt = 0.0) {
  std::vector<Eigen::Vector3f> corners;
  const auto square = [&](const Vec3& a, const Vec3& along, const Vec3& across) {
    for (const Vec3& p : {a, Vec3(a + along), Vec3(a + along + across), a, Vec3(a + along + across),
                          Vec3(a + across)})
      corners.push_back((Eigen::AngleAxisd(tilt, Vec3::UnitY()) * p).cast<float>());
  };
  for (int i = -6; i < 6; ++i) {
    for (int k = -6; k < 6; ++k) square({i / 2.0, k / 2.0, 0}, {0.5, 0, 0}, {0, 0.5, 0});
    for (const double side : {-3.0, 3.0}) {
      square({side, i / 2.0, 0}, {0, 0.5, 0}, {0, 0, 1});
      square({i / 2.0, side, 0}, {0.5, 0, 0}, {0, 0, 1});
    }
  }
  return mesh(corners);
}

TEST(Distances, TheFloorOfARoomCarriesAndItsWallsDoNot) {
  for (const double tilt : {0.0, 0.3, -0.3}) {
    Around robot(kRobot, {room(tilt)});
    const Quat turn(Eigen::AngleAxisd(tilt, Vec3::UnitY()));
    for (const double x : {0.0, 0.1, 1.3, 2.7}) {
      for (const double sunk : {-0.001, 0.0, 1e-5, 0.003}) {
        robot.move({turn, turn * Vec3(x, 0.01, -sunk)});
        const Nearest nearest = robot.nearest(4.0);
        EXPECT_NEAR(nearest.distance, 3.0 - x - kFront, 1e-5) << x << ' ' << sunk << ' ' << tilt;
      }
    }
    robot.move({turn, turn * Vec3(3.0 - kFront + 0.001, 0, 0)});
    EXPECT_EQ(robot.nearest().distance, 0.0);
  }
}

TEST(Distances, TilesAndRampsCarry) {
  const double slope = 0.25;
  std::string floor;
  for (int i = -3; i < 3; ++i)
    floor += block("tile" + std::to_string(i + 3), {1, 4, 0.2}, at(i + 0.5, 0, -0.1));
  floor += block("ramp", {4, 4, 0.2},
                 at(3 + 2 * std::cos(slope) + 0.1 * std::sin(slope), 0,
                    2 * std::sin(slope) - 0.1 * std::cos(slope), 0, -slope));
  Around robot(kRobot + floor);
  for (double x = -2.0; x < 2.8; x += 0.07) {
    for (const double sunk : {-1e-4, 0.0, 0.002}) {
      robot.move(at(x, 0, -sunk));
      const Nearest nearest = robot.nearest(0.5);
      EXPECT_EQ(nearest.distance, kInfinite)
          << x << ' ' << sunk << ' ' << robot.name(nearest.own) << ' ' << robot.name(nearest.other);
    }
  }
  robot.move(at(3 + std::cos(slope), 0, std::sin(slope), 0, -slope));  // on the ramp
  EXPECT_EQ(robot.nearest(0.5).distance, kInfinite);
}

TEST(Distances, AKerbCountsAsAnObstacle) {
  Around kerb(kRobot + kPlane + block("kerb", {0.1, 4, 0.05}, at(0.5, 0, 0.025)));
  const double below = std::hypot(0.45 - 0.135, 0.111 - 0.05) - 0.111;  // wheel and edge
  EXPECT_NEAR(kerb.nearest().distance, below, 1e-6);
  Around wall(kRobot + kPlane + block("wall", {0.1, 4, 1}, at(0.5, 0, 0.5)));
  EXPECT_NEAR(wall.nearest().distance, 0.45 - kFront, 1e-6);
}

TEST(Distances, AContactIsATouch) {
  Around robot(kRobot + kPlane + block("wall", {0.1, 4, 1}, at(3, 0, 0.5)));
  Contact contact;
  contact.link_a = robot.link("p3at/front_left_wheel");
  contact.link_b = robot.link("ground/l");
  contact.position = {0.135, 0.197, 0.0};
  robot.snapshot.contacts.moving().push_back(contact);
  EXPECT_EQ(robot.nearest(0.5).distance, kInfinite);
  contact.link_a = robot.link("wall/l");
  contact.link_b = robot.link("p3at/base_link");
  contact.normal = Vec3::UnitX();
  contact.position = {2.95, 0, 0.2};
  robot.snapshot.contacts.moving().push_back(contact);
  const Nearest nearest = robot.nearest(0.0);
  EXPECT_EQ(nearest.distance, 0.0);
  EXPECT_EQ(robot.name(nearest.own), "p3at/base_link");
  EXPECT_EQ(robot.name(nearest.other), "wall/l");
}

// With a wheels drive, a wheel is a tyre: all points within half its width of a disc.
TEST(Distances, KnowTyres) {
  std::string robot =
      "<model name='r'><link name='base_link'><pose>0 0 0.1 0 0 0</pose><collision name='c'>"
      "<geometry><box><size>0.1 0.2 0.1</size></box></geometry></collision></link>";
  for (const auto& [name, y] : {std::pair("left", "0.2"), {"right", "-0.2"}}) {
    const std::string n = name;
    robot += "<link name='" + n + "'><pose>0 " + y +
             " 0.1 0 0 0</pose><collision name='c'><pose>0 0 0 1.5707963267948966 0 0</pose>"
             "<geometry><cylinder><radius>0.1</radius><length>0.06</length></cylinder></geometry>"
             "</collision></link><joint name='" +
             n + "_joint' type='continuous'><parent>base_link</parent><child>" + n +
             "</child><axis><xyz>0 1 0</xyz></axis></joint>";
  }
  robot +=
      "<ruedo:drive type='wheels'><ruedo:left_joint>left_joint</ruedo:left_joint>"
      "<ruedo:right_joint>right_joint</ruedo:right_joint></ruedo:drive></model>";
  Around ball(robot + kPlane +
              thing("ball", "0.2 0.23 0.1 0 0 0", "<sphere><radius>0.01</radius></sphere>", 0));
  const Nearest nearest = ball.nearest();
  EXPECT_NEAR(nearest.distance, std::hypot(0.2 - 0.07, 0.03) - 0.03 - 0.01, 1e-6);
  EXPECT_EQ(ball.name(nearest.own), "r/left");
}

}  // namespace
}  // namespace ruedo::physics::testing
