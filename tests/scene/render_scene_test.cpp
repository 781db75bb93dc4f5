// Pictures against geometry computed by hand: depth, labels and places in the picture.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <thread>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "ruedo/errors.h"
#include "scene/pictures/render_scene.h"
#include "world/model/body_layout.h"

namespace ruedo::scene {
namespace {

using world::Shape;

// A world defined in code. Each thing is a model of one link.
struct World {
  world::WorldModel world;

  world::Link& add(const std::string& name, bool is_static, const Pose& X_WM) {
    auto model = std::make_shared<world::Model>();
    model->name = name;
    model->is_static = is_static;
    model->links.resize(1);
    model->links[0].name = "link";
    world::Link& link = model->links[0];
    world.models.push_back({name, X_WM, std::move(model)});
    return link;
  }
  static world::Visual& show(world::Link& link, Shape shape, const Vec3& size,
                             const world::Rgba& colour) {
    world::Visual visual;
    visual.geometry.shape = shape;
    visual.geometry.size = size;
    visual.material = world::Material{};
    visual.material->diffuse = colour;
    link.visuals.push_back(visual);
    return link.visuals.back();
  }
  world::Visual& box(const std::string& name, const Vec3& at, const Vec3& size,
                     const world::Rgba& colour, bool is_static = true) {
    return show(add(name, is_static, {Quat::Identity(), at}), Shape::box, size, colour);
  }
};

Snapshot start(const world::BodyLayout& layout) {
  Snapshot snapshot;
  for (const world::BodyPlacement& body : layout.bodies) snapshot.bodies.push_back(body.X_WB);
  snapshot.wheel_angles.resize(layout.wheels.size());
  return snapshot;
}

constexpr world::Rgba kRed{0.9f, 0.1f, 0.1f, 1.0f}, kGreen{0.1f, 0.9f, 0.1f, 1.0f},
    kGrey{0.5f, 0.5f, 0.5f, 1.0f};

View ahead(double z = 1.0) {
  return View::pinhole({Quat::Identity(), Vec3(0, 0, z)}, 320, 240, 1.2);
}

Picture draw(const World& w, const View& view, bool depth = true, bool labels = true) {
  const world::BodyLayout layout(w.world);
  Picture picture;
  picture.want_depth = depth;
  picture.want_labels = labels;
  make_renderer(w.world, layout)->draw(start(layout), view, picture);
  return picture;
}

size_t at(const View& view, int u, int v) { return static_cast<size_t>(v * view.width + u); }

TEST(RenderScene, DepthOfAWallAndOfTheFloor) {
  World w;
  w.box("wall", {3.5, 0, 1}, {1, 40, 2}, kGrey);  // its near face at x = 3, up to z = 2
  World::show(w.add("floor", true, {}), Shape::plane, Vec3::Ones(), kGrey);
  const View view = ahead();
  const Picture picture = draw(w, view);
  EXPECT_NEAR(view.fx, 160.0 / std::tan(0.6), 1e-9);
  for (int v = 0; v < view.height; ++v) {
    const double below = (v - view.cy) / view.fy;  // per metre ahead
    const float depth = picture.depth[at(view, 57, v)];
    if (below < -1.0 / 3.0 - 0.01) {
      EXPECT_EQ(depth, std::numeric_limits<float>::infinity()) << "over the wall, row " << v;
    } else if (std::abs(below) < 1.0 / 3.0 - 0.01) {
      EXPECT_NEAR(depth, 3.0, 1e-5) << "wall, row " << v;
    } else if (below > 1.0 / 3.0 + 0.01) {
      EXPECT_NEAR(depth, 1.0 / below, 1e-5) << "floor, row " << v;
    }
  }
}

TEST(RenderScene, FarDepthKeepsItsPrecision) {
  World w;
  w.box("wall", {90.5, 0, 1}, {1, 400, 200}, kGrey);
  for (const double near_m : {0.01, 0.1, 1.0}) {
    View view = ahead();
    view.near_m = near_m;
    EXPECT_NEAR(draw(w, view).depth[at(view, 10, 10)], 90.0, 1e-3) << "near " << near_m;
  }
}

TEST(RenderScene, HidesBeforeTheNearClipAndBeyondTheFarClip) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  World w;
  w.box("near", {0.5, 0, 1}, {0.2, 0.1, 0.1}, kRed);
  w.box("far", {20, 0, 1}, {0.2, 30, 30}, kGreen);
  View view = ahead();
  EXPECT_NEAR(draw(w, view).depth[at(view, 160, 120)], 0.4, 1e-6);
  const auto near_pixels = [&](bool labels) {
    const Picture picture = draw(w, view, true, labels);
    EXPECT_EQ(picture.depth[at(view, 160, 120)], -kInfinity);
    EXPECT_NEAR(picture.depth[at(view, 10, 120)], 19.9, 1e-4);  // beside it
    return std::count(picture.depth.begin(), picture.depth.end(), -kInfinity);
  };
  view.near_m = 0.7;
  for (const bool labels : {false, true}) {
    const double width = 2.0 * std::ceil(view.fx * 0.05 / 0.4);
    EXPECT_NEAR(near_pixels(labels), width * width, 2.0 * width);
  }
  view.near_m = 0.45;  // inside the box
  EXPECT_GT(near_pixels(true), 0);
  view.near_m = 0.7;
  view.far_m = 19.0;
  EXPECT_EQ(draw(w, view).depth[at(view, 10, 120)], kInfinity);
}

// A camera in its housing looks out: inner faces are not drawn.
TEST(RenderScene, AClosedShapeAroundTheCameraHidesNothing) {
  World w;
  w.box("housing", {0, 0, 1}, {0.06, 0.06, 0.06}, kRed);
  w.box("far", {20, 0, 1}, {0.2, 30, 30}, kGreen);
  EXPECT_NEAR(draw(w, ahead()).depth[at(ahead(), 160, 120)], 19.9, 1e-4);
}

TEST(RenderScene, PlacesInThePicture) {
  // A small cube 4 m ahead, 1 m to the right, 0.5 m below the camera, which looks along the world's
  // y.
  World w;
  w.box("cube", {2 + 1, 1 + 4, 3 - 0.5}, {0.08, 0.08, 0.08}, kRed);
  View view = View::pinhole({Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ())), Vec3(2, 1, 3)}, 321,
                            241, 1.0);
  const Picture picture = draw(w, view);
  double u = 0, v = 0, n = 0;
  for (int row = 0; row < view.height; ++row) {
    for (int column = 0; column < view.width; ++column) {
      if (picture.labels[at(view, column, row)] == 0) continue;
      u += column;
      v += row;
      ++n;
    }
  }
  ASSERT_GT(n, 20);
  // The near face, 3.96 m ahead; the side faces that show shift the middle by less than a pixel.
  EXPECT_NEAR(u / n, view.cx + view.fx * 1.0 / 4.0, 0.6);
  EXPECT_NEAR(v / n, view.cy + view.fy * 0.5 / 4.0, 0.6);
}

// A bar that turns about its middle, 3 m ahead of its link's origin, and a cube fixed to it, whose
// link is turned left by a right angle. The quarter turn about y takes what is above the axis ahead
// of it.
TEST(RenderScene, WheelsTurnAboutTheirAxisWhereverTheirLinksAre) {
  World w;
  w.box("wheel", {0, 0, 0}, {0.1, 0.1, 1.6}, kRed, false).X_LV.translation = Vec3(3, 0, 1);
  auto model = std::make_shared<world::Model>(*w.world.models[0].model);
  model->links.emplace_back();
  world::Link& cap = model->links.back();
  cap.name = "cap";
  cap.X_ML = {Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ())), Vec3(3, 0, 1)};
  World::show(cap, Shape::box, {0.2, 0.2, 0.2}, kGreen).X_LV.translation =
      Vec3(1, 0, 0.5);  // in the model: (3, 1, 1.5)
  world::Joint joint;
  joint.type = world::JointType::fixed;
  joint.parent = ModelLinkIndex(0);
  joint.child = ModelLinkIndex(1);
  model->joints.push_back(joint);
  w.world.models[0].model = model;
  world::BodyLayout layout(w.world);
  layout.links[0].wheel = layout.links[1].wheel = WheelIndex(0);
  world::WheelPlacement wheel;
  wheel.link = LinkIndex(0);
  wheel.center_in_L = Vec3(3, 0, 1);
  layout.wheels.push_back(wheel);
  Snapshot snapshot = start(layout);
  const View view = ahead();
  const auto renderer = make_renderer(w.world, layout);
  const auto depth_of = [&](const Vec3& p) {  // of what is seen in the direction of that point
    Picture picture;
    picture.want_depth = true;
    renderer->draw(snapshot, view, picture);
    const int u = static_cast<int>(std::lround(view.cx - view.fx * p.y() / p.x()));
    const int v = static_cast<int>(std::lround(view.cy - view.fy * (p.z() - 1) / p.x()));
    return picture.depth[at(view, u, v)];
  };
  EXPECT_NEAR(depth_of({2.95, 0, 1.6}), 2.95, 1e-5);
  EXPECT_NEAR(depth_of({2.9, 1, 1.5}), 2.9, 1e-5);
  snapshot.wheel_angles[0] = M_PI / 2;
  EXPECT_EQ(depth_of({2.95, 0, 1.6}), std::numeric_limits<float>::infinity());
  EXPECT_NEAR(depth_of({2.2, 0, 1.0}), 2.2, 1e-5);
  EXPECT_NEAR(depth_of({3.4, 1, 1.0}), 3.4, 1e-5);
}

TEST(RenderScene, AnOddPictureIsCentredOnWholePixels) {
  // A wall's vertical edge at y = 0 falls between the pixel left of cx and the one right of it,
  // exactly.
  World w;
  w.box("right half", {3, -5, 1}, {1, 10, 20}, kRed);
  View view = ahead();
  view.cx = 159.5;
  const Picture picture = draw(w, view);
  EXPECT_EQ(picture.labels[at(view, 159, 100)], 0);
  EXPECT_EQ(picture.labels[at(view, 160, 100)], 1);
}

TEST(RenderScene, ParallelView) {
  World w;
  w.box("box", {1, -2, 0.5}, {1, 1, 1}, kGrey);
  View view = View::pinhole(Pose::from_xyz_rpy({0, 0, 10}, {0, M_PI / 2, 0}), 200, 200, 1.0);
  view.orthographic = true;
  view.fx = view.fy = 20;  // pixels per metre: world x is up in the picture, y is left
  const Picture picture = draw(w, view);
  EXPECT_NEAR(picture.depth[at(view, 100 + 40, 100 - 20)], 9.0, 1e-5);
  EXPECT_EQ(picture.labels[at(view, 140 + 9, 80)], 1);
  EXPECT_EQ(picture.labels[at(view, 140 + 11, 80)], 0);
  EXPECT_EQ(picture.labels[at(view, 140, 80 - 11)], 0);
}

TEST(RenderScene, LabelsAreThePlacesInInfo) {
  World w;
  w.box("static_a", {5, 2, 1}, {1, 1, 1}, kGrey);
  w.box("moving_a", {5, 0, 1}, {1, 1, 1}, kGrey, false);
  w.box("static_b", {5, -2, 1}, {1, 1, 1}, kGrey);
  w.box("moving_b", {3, 0, 0.2}, {0.2, 0.2, 0.2}, kGrey, false);
  const View view = ahead();
  const Picture picture = draw(w, view);
  const auto label = [&](const Vec3& p) {
    return picture.labels[at(view, static_cast<int>(view.cx - view.fx * p.y() / p.x()),
                             static_cast<int>(view.cy - view.fy * (p.z() - 1) / p.x()))];
  };
  EXPECT_EQ(label({5, 0, 1}), 1);  // the moving bodies first
  EXPECT_EQ(label({3, 0, 0.2}), 2);
  EXPECT_EQ(label({5, 2, 1}), 3);  // then the links that stand still
  EXPECT_EQ(label({5, -2, 1}), 4);
  EXPECT_EQ(picture.labels[0], 0);
}

TEST(RenderScene, ShapesHaveTheirSizes) {
  struct Case {
    Shape shape;
    Vec3 size;
    double front, half_width, half_height;
  };
  // Seen from x = 0 at the height of the middle; half sizes at the shape's middle plane x = 4.
  const Case cases[] = {{Shape::box, {0.6, 0.8, 1.0}, 3.7, 0.4, 0.5},
                        {Shape::sphere, {0.5, 0, 0}, 3.5, 0.5, 0.5},
                        {Shape::cylinder, {0.5, 1.2, 0}, 3.5, 0.5, 0.6},
                        {Shape::cone, {0.5, 1.2, 0}, 3.75, 0.5, 0.6},
                        {Shape::capsule, {0.3, 0.8, 0}, 3.7, 0.3, 0.7},
                        {Shape::ellipsoid, {0.2, 0.5, 0.4}, 3.8, 0.5, 0.4}};
  for (const Case& c : cases) {
    World w;
    World::show(w.add("thing", true, {Quat::Identity(), Vec3(4, 0, 0)}), c.shape, c.size, kGrey);
    View view = ahead(0.0);
    view.orthographic = true;
    view.fx = view.fy = 100;
    const Picture picture = draw(w, view);
    EXPECT_NEAR(picture.depth[at(view, 160, 120)], c.front, 0.01) << static_cast<int>(c.shape);
    int low_u = 999, high_u = -1, low_v = 999, high_v = -1;
    for (int v = 0; v < view.height; ++v) {
      for (int u = 0; u < view.width; ++u) {
        if (picture.labels[at(view, u, v)] == 0) continue;
        low_u = std::min(low_u, u), high_u = std::max(high_u, u), low_v = std::min(low_v, v),
        high_v = std::max(high_v, v);
      }
    }
    EXPECT_NEAR(high_u - low_u + 1, 200 * c.half_width, 2.0) << static_cast<int>(c.shape);
    EXPECT_NEAR(high_v - low_v + 1, 200 * c.half_height, 2.5) << static_cast<int>(c.shape);
  }
}

// Depth of each pixel against its ray's, to the silhouette: of spheres and turned ellipsoids, near
// and far, close before the eye, and beside another.
TEST(RenderScene, SpheresAreRound) {
  struct Case {
    Vec3 at, radii;
    bool parallel;
  };
  for (const Case& c : {Case{{3, 0.3, 1}, {0.4, 0.4, 0.4}, false},
                        {{8, 1, 1.5}, {0.1, 0.1, 0.1}, false},
                        {{2.05, 0, 1}, {2, 2, 2}, false},
                        {{4, -0.5, 1}, {0.3, 0.8, 0.5}, false},
                        {{30, 2, 1}, {0.5, 0.5, 0.5}, false},
                        {{4, 0.2, 1}, {0.4, 0.4, 0.4}, true},
                        {{4, 0.2, 1}, {0.3, 0.8, 0.5}, true}}) {
    World w;
    const Pose X_WM{Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())), c.at};
    World::show(w.add("thing", true, X_WM), Shape::ellipsoid, c.radii, kGrey);
    View view = ahead();
    view.near_m = 0.02;
    view.orthographic = c.parallel;
    if (c.parallel) view.fx = view.fy = 100;
    const Picture picture = draw(w, view);
    int hits = 0;
    for (int v = 0; v < view.height; ++v) {
      for (int u = 0; u < view.width; ++u) {
        const double left = (view.cx - u) / view.fx, up = (view.cy - v) / view.fy;
        const Vec3 eye(0, c.parallel ? left : 0, 1 + (c.parallel ? up : 0)),
            ray(1, c.parallel ? 0 : left, c.parallel ? 0 : up);
        const Vec3 o = (X_WM.inverse() * eye).cwiseQuotient(c.radii),
                   d = (X_WM.rotation.conjugate() * ray).cwiseQuotient(c.radii);
        const double middle = -o.dot(d) / d.squaredNorm(),
                     inside = 1 - (o + middle * d).squaredNorm();
        const float depth = picture.depth[at(view, u, v)];
        ASSERT_EQ(std::isfinite(depth), picture.labels[at(view, u, v)] == 1);
        if (std::abs(inside) < 1e-4) continue;  // within a rounding of the silhouette
        ASSERT_EQ(std::isfinite(depth), inside > 0) << u << " " << v;
        if (inside < 0) continue;
        ASSERT_NEAR(depth, middle - std::sqrt(inside / d.squaredNorm()), 1e-3) << u << " " << v;
        ++hits;
      }
    }
    EXPECT_GT(hits, 10);
  }
}

TEST(RenderScene, OutsideFacesOfMeshesAreSeen) {
  // A tetrahedron, counter-clockwise from outside; mirrored by a negative scale it is seen from
  // outside all the same.
  auto mesh = std::make_shared<world::Mesh>();
  mesh->positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh->triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  for (const double sign : {1.0, -1.0}) {
    World w;
    world::Visual visual;
    visual.geometry.shape = Shape::mesh;
    visual.geometry.mesh = mesh;
    visual.geometry.scale = {1, sign, 1};
    w.add("mesh", true, {Quat::Identity(), Vec3(4, 0, 1)}).visuals.push_back(visual);
    const View view = ahead(1.2);
    const Picture picture = draw(w, view);
    // The face x = 0, at y = +-0.2, at the height of the eye.
    EXPECT_NEAR(picture.depth[at(view, static_cast<int>(view.cx - view.fx * sign * 0.2 / 4), 120)],
                4.0, 1e-5)
        << sign;
  }
}

TEST(RenderScene, TriangleWithoutItsVerticesIsLeftOut) {
  auto mesh = std::make_shared<world::Mesh>();
  mesh->positions = {{0, -1, -1}, {0, 1, -1}, {0, 0, 1}};
  mesh->triangles = {{0, 2, 1}, {0, 1, 77}};
  World w;
  world::Visual visual;
  visual.geometry.shape = Shape::mesh;
  visual.geometry.mesh = mesh;
  w.add("mesh", true, {Quat::Identity(), Vec3(4, 0, 1)}).visuals.push_back(visual);
  EXPECT_NEAR(draw(w, ahead()).depth[at(ahead(), 160, 120)], 4.0, 1e-5);
}

TEST(RenderScene, ColoursOfLitSurfaces) {
  World w;
  w.box("wall", {3.5, 0, 1}, {1, 40, 20}, kRed);
  const View view = ahead();
  const Picture picture = draw(w, view);
  const uint8_t* rgb = &picture.rgb[3 * at(view, 160, 120)];
  EXPECT_GT(rgb[0], 60);
  EXPECT_LT(rgb[1], rgb[0] / 4);
  EXPECT_LT(rgb[2], rgb[0] / 4);
}

TEST(RenderScene, EmissionNeedsNoLight) {
  World w;
  w.world.sky.ambient = {0, 0, 0, 1};
  world::Visual& lamp = w.box("lamp", {3.5, 0, 1}, {1, 40, 20}, {0, 0, 0, 1});
  lamp.material->ambient = {0, 0, 0, 1};
  lamp.material->emissive = {0.4f, 0.8f, 1.0f, 1.0f};
  const View view = ahead();
  const Picture picture = draw(w, view);
  const uint8_t* rgb = &picture.rgb[3 * at(view, 160, 120)];
  EXPECT_NEAR(rgb[0], 102, 1);
  EXPECT_NEAR(rgb[1], 204, 1);
  EXPECT_NEAR(rgb[2], 255, 1);
}

TEST(RenderScene, ExposureIsAFactorOnLight) {
  World w;
  w.world.sky.ambient = {0, 0, 0, 1};
  world::Visual& lamp = w.box("lamp", {3.5, 0, 1}, {1, 40, 20}, {0, 0, 0, 1});
  lamp.material->ambient = {0, 0, 0, 1};
  lamp.material->emissive = {0.4f, 0.4f, 0.4f, 1.0f};
  View view = ahead();
  view.exposure = 4.0;  // light is the square of what is displayed
  EXPECT_NEAR(draw(w, view).rgb[3 * at(view, 160, 120)], 204, 1);
}

TEST(RenderScene, ShadowsLieWhereTheSunIsHidden) {
  World w;
  world::Light sun;
  sun.type = world::Light::Type::directional;
  sun.direction = Vec3(0, -1, -1).normalized();
  sun.cast_shadows = true;
  w.world.lights.push_back(sun);
  World::show(w.add("floor", true, {}), Shape::box, {20, 20, 0.02}, kGrey);
  w.box("screen", {0, 0, 2}, {2, 2, 0.05}, kGrey, false);  // its shadow's middle is at y = -2
  View view = View::pinhole(Pose::from_xyz_rpy({0, 0, 30}, {0, M_PI / 2, 0}), 200, 200, 1.0);
  view.orthographic = true;
  view.fx = view.fy = 20;
  const auto brightness = [&](const Picture& p, double x, double y) {
    return static_cast<int>(
        p.rgb[3 * at(view, static_cast<int>(100 - 20 * y), static_cast<int>(100 - 20 * x))]);
  };
  const Picture with = draw(w, view);
  EXPECT_LT(brightness(with, 0, -2), 0.7 * brightness(with, 0, 4));
  EXPECT_EQ(brightness(with, 0, -3.3), brightness(with, 0, 4));
  EXPECT_EQ(brightness(with, 1.3, -2), brightness(with, 0, 4));
  w.world.sky.shadows = false;
  const Picture without = draw(w, view);
  EXPECT_EQ(brightness(without, 0, -2), brightness(without, 0, 4));
}

TEST(RenderScene, DepthLooksThroughGlassAndColourIsMixed) {
  World w;
  w.box("wall", {5.5, 0, 1}, {1, 40, 20}, kRed);
  w.box("glass", {3, 5, 1}, {0.1, 10, 20}, kGreen).transparency = 0.5;  // the left half of the view
  const View view = ahead();
  const Picture picture = draw(w, view);
  EXPECT_NEAR(picture.depth[at(view, 60, 120)], 5.0, 1e-5);
  EXPECT_EQ(picture.labels[at(view, 60, 120)], 1);
  const uint8_t* behind = &picture.rgb[3 * at(view, 60, 120)];
  const uint8_t* beside = &picture.rgb[3 * at(view, 260, 120)];
  EXPECT_LT(behind[0], beside[0] - 10);
  EXPECT_GT(behind[1], beside[1] + 10);
}

TEST(RenderScene, TexturesWithHolesAndWithout) {
  const std::string folder = testing::TempDir();
  cv::Mat texture(8, 8, CV_8UC4, cv::Scalar(0, 255, 255, 255));  // BGR: yellow
  texture(cv::Rect(2, 0, 4, 8))
      .setTo(cv::Scalar(0, 0, 0, 0));  // a hole in the middle, also of the far face
  ASSERT_TRUE(cv::imwrite(folder + "/hole.png", texture));
  std::ofstream(folder + "/broken.png") << "not a picture";
  const auto make = [&](const std::string& file) {
    World w;
    auto named = std::make_shared<world::Texture>();
    named->path = folder + "/" + file;
    w.box("poster", {3, 0, 1}, {0.02, 2, 2}, {1, 1, 1, 1}).material->texture = named;
    return draw(w, ahead());
  };
  const View view = ahead();
  const Picture hole = make("hole.png");
  const uint8_t* left = &hole.rgb[3 * at(view, 100, 120)];
  EXPECT_GT(left[0], 60);
  EXPECT_EQ(left[0], left[1]);
  EXPECT_EQ(left[2], 0);
  EXPECT_NEAR(hole.depth[at(view, 100, 120)], 2.99, 1e-5);
  EXPECT_EQ(hole.labels[at(view, 100, 120)], 1);
  EXPECT_EQ(hole.labels[at(view, 160, 120)], 0);
  EXPECT_EQ(hole.depth[at(view, 160, 120)], std::numeric_limits<float>::infinity());
  for (const char* file : {"broken.png", "missing.png"}) {
    const Picture plain = make(file);
    const uint8_t* rgb = &plain.rgb[3 * at(view, 120, 120)];
    EXPECT_GT(rgb[2], 60) << file;
    EXPECT_EQ(rgb[0], rgb[2]) << file;
  }
}

// Draws three states in turn, with one renderer.
struct Sequence {
  World w;
  explicit Sequence(int pillars = 30) {
    World::show(w.add("floor", true, {}), Shape::plane, Vec3::Ones(), kGrey);
    for (int i = 0; i < pillars; ++i)
      w.box("pillar" + std::to_string(i), {3.0 + 2 * i, (i % 5) - 2.0, 1}, {0.3, 0.3, 2}, kRed);
    w.box("mover", {4, 1, 0.5}, {0.5, 0.5, 1}, kGreen, false);
  }
  static constexpr int kStates = 3;
  Snapshot state(const world::BodyLayout& layout, int i) const {
    Snapshot snapshot = start(layout);
    snapshot.bodies[0].translation += Vec3(0.7 * i, -0.9 * i, 0.3 * i);
    return snapshot;
  }
  View view(int i) const {
    return View::pinhole(Pose::from_xyz_rpy({9.0 * i, 0.2 * i, 1.0}, {0, 0.1, 0.1 * i}), 160, 120,
                         1.2);
  }
};

TEST(RenderScene, APictureShowsNothingOfTheOneBefore) {
  const Sequence s;
  const world::BodyLayout layout(s.w.world);
  const auto used = make_renderer(s.w.world, layout);
  for (int i : {0, 1, 2, 1, 0, 2}) {
    Picture a, b;
    a.want_depth = b.want_depth = a.want_labels = b.want_labels = true;
    used->draw(s.state(layout, i), s.view(i), a);
    make_renderer(s.w.world, layout)->draw(s.state(layout, i), s.view(i), b);
    EXPECT_EQ(a.rgb, b.rgb) << i;
    EXPECT_EQ(a.depth, b.depth) << i;
    EXPECT_EQ(a.labels, b.labels) << i;
  }
}

// In a small world all cameras share a map of the shadows; in a large one it follows the camera.
TEST(RenderScene, ShadowsAreThoseOfTheStep) {
  for (const int pillars : {3, 30}) {
    Sequence s(pillars);
    world::Light sun;
    sun.type = world::Light::Type::directional;
    sun.direction = Vec3(0.4, -0.3, -1).normalized();
    sun.cast_shadows = true;
    s.w.world.lights.push_back(sun);
    const world::BodyLayout layout(s.w.world);
    const auto used = make_renderer(s.w.world, layout);
    const auto draw = [&](Renderer& renderer, int state, int view) {
      Picture picture;
      picture.want_depth = picture.want_labels = false;
      renderer.draw(s.state(layout, state), s.view(view), picture);
      return picture.rgb;
    };
    for (const auto& [state, view] :
         {std::pair{0, 0}, {0, 1}, {0, 0}, {1, 0}, {1, 1}, {1, 0}, {0, 0}, {2, 0}, {0, 1}})
      EXPECT_EQ(draw(*used, state, view), draw(*make_renderer(s.w.world, layout), state, view))
          << pillars << " pillars, state " << state << ", view " << view;
    EXPECT_NE(draw(*used, 0, 0), draw(*used, 1, 0));
  }
}

// Of what moves only that is drawn into the map whose shadow a view may show; of what stands still
// all is.
TEST(RenderScene, ShadowsOfMoversEqualThoseOfStaticModels) {
  const auto picture = [](bool is_static, double yaw, double pitch) {
    World w;
    world::Light sun;
    sun.type = world::Light::Type::directional;
    sun.direction = Vec3(0.9, 0.5, -0.4).normalized();  // low: the shadows are long
    sun.cast_shadows = true;
    w.world.lights.push_back(sun);
    World::show(w.add("floor", true, {}), Shape::plane, Vec3::Ones(), kGrey);
    for (int i = 0; i < 196; ++i)
      w.box("box" + std::to_string(i),
            {5.0 * (i % 14) - 32, 5.0 * (i / 14) - 32, 0.5 * (1 + i % 4)}, {0.4, 0.6, 1.0 + i % 4},
            kRed, is_static);
    const View view =
        View::pinhole(Pose::from_xyz_rpy({0.5, 0.5, 2}, {0, pitch, yaw}), 160, 120, 1.0);
    return draw(w, view, false, false).rgb;
  };
  for (const double yaw : {0.0, 1.3, 2.6, 3.9, 5.2}) {
    for (const double pitch : {0.1, 0.8}) {
      const auto moving = picture(false, yaw, pitch);
      EXPECT_EQ(moving, picture(true, yaw, pitch)) << yaw << ", " << pitch;
    }
  }
}

TEST(RenderScene, ThreadsDrawTheSame) {
  const Sequence s;
  const world::BodyLayout layout(s.w.world);
  const auto run = [&](std::vector<Picture>& pictures) {
    const auto renderer = make_renderer(s.w.world, layout);
    for (int i = 0; i < Sequence::kStates; ++i)
      renderer->draw(s.state(layout, i), s.view(i), pictures.emplace_back());
  };
  std::vector<Picture> alone, first, second;
  run(alone);
  std::thread a([&] { run(first); }), b([&] { run(second); });
  a.join();
  b.join();
  for (size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(alone[i].rgb, first[i].rgb);
    EXPECT_EQ(alone[i].rgb, second[i].rgb);
  }
}

TEST(RenderScene, ARendererMayMoveToAnotherThread) {
  const Sequence s;
  const world::BodyLayout layout(s.w.world);
  const auto renderer = make_renderer(s.w.world, layout);
  Picture here, there;
  renderer->draw(s.state(layout, 0), s.view(0), here);
  std::thread([&] { renderer->draw(s.state(layout, 0), s.view(0), there); }).join();
  EXPECT_EQ(here.rgb, there.rgb);
}

TEST(RenderScene, BothBackendsDrawTheSame) {
  const Sequence s;
  const world::BodyLayout layout(s.w.world);
  std::vector<Picture> pictures;
  for (const char* backend : {"osmesa", "egl"}) {
    setenv("RUEDO_RENDERER", backend, 1);
    try {
      const auto renderer = make_renderer(s.w.world, layout);
      if (renderer->description().find("llvmpipe") == std::string::npos)
        GTEST_SKIP() << "not drawn in software: " << renderer->description();
      pictures.emplace_back().want_depth = true;
      renderer->draw(s.state(layout, 1), s.view(1), pictures.back());
    } catch (const EnvironmentError& error) {
      unsetenv("RUEDO_RENDERER");
      GTEST_SKIP() << backend << " does not work here: " << error.what();
    }
  }
  unsetenv("RUEDO_RENDERER");
  EXPECT_EQ(pictures[0].rgb, pictures[1].rgb);
  EXPECT_EQ(pictures[0].depth, pictures[1].depth);
}

TEST(RenderScene, RejectsAnUnknownBackend) {
  setenv("RUEDO_RENDERER", "vulkan", 1);
  const World w;
  const world::BodyLayout layout(w.world);
  try {
    make_renderer(w.world, layout);
    ADD_FAILURE() << "no error";
  } catch (const EnvironmentError& error) {
    EXPECT_STREQ(error.what(), "RUEDO_RENDERER=vulkan: allowed are osmesa, egl and auto");
  }
  unsetenv("RUEDO_RENDERER");
}

TEST(RenderScene, SmoothEdgesChangeColoursOnly) {
  const Sequence s;
  View view = s.view(0);
  const Picture plain = draw(s.w, view);
  view.samples = 4;
  const Picture smooth = draw(s.w, view);
  EXPECT_NE(plain.rgb, smooth.rgb);
  EXPECT_EQ(plain.depth, smooth.depth);
  EXPECT_EQ(plain.labels, smooth.labels);
}

TEST(RenderScene, LinesAreDrawnOverThePicture) {
  World w;
  w.box("wall", {3.5, 0, 1}, {1, 40, 20}, kGrey);
  const world::BodyLayout layout(w.world);
  const View view = ahead();
  const Line lines[] = {{{2, -1, 1}, {2, 1, 1}, {1, 0, 0, 1}},
                        {{4, -1, 1.2}, {4, 1, 1.2}, {1, 0, 0, 1}},
                        {{-5, 0, 1.4}, {2.9, 0, 1.4}, {0, 1, 0, 1}}};
  Picture picture;
  make_renderer(w.world, layout)->draw(start(layout), view, picture, {.lines = lines});
  const auto pixel = [&](int u, double v) {
    return &picture.rgb[3 * at(view, u, static_cast<int>(std::lround(v)))];
  };
  EXPECT_EQ(pixel(120, 120)[0], 255);
  EXPECT_EQ(pixel(120, 120)[1], 0);
  EXPECT_EQ(pixel(120, 120 - view.fy * 0.2 / 4)[0], pixel(120, 120 - view.fy * 0.2 / 4)[1])
      << "hidden by the wall";
  EXPECT_EQ(pixel(160, 120 - view.fy * 0.4 / 2.0)[1], 255) << "cut where it is behind the eye";
}

// From both sides, mixed with what is behind, and cut by the near plane.
TEST(RenderScene, FacetsStandInTheWorld) {
  World w;
  w.box("wall", {3.5, 0, 1}, {1, 40, 20}, kGrey);
  const world::BodyLayout layout(w.world);
  const View view = ahead();
  const auto across = [](double x, double y, std::array<float, 4> rgba) {
    return Facet{{Vec3(x, y, 0.5), Vec3(x, y + 0.6, 0.5), Vec3(x, y, 1.6)}, rgba};
  };
  const Facet facets[] = {
      across(2, 0.1, {1, 0, 0, 1}),
      {{Vec3(2, -0.1, 0.5), Vec3(2, -0.1, 1.6), Vec3(2, -0.7, 0.5)}, {0, 1, 0, 1}},
      across(4, -0.1, {0, 0, 1, 1}),
      {{Vec3(-5, -9, 1.9), Vec3(-5, 9, 1.9), Vec3(2, 0, 1.9)}, {0, 0, 1, 1}}};
  Picture picture;
  make_renderer(w.world, layout)->draw(start(layout), view, picture, {.facets = facets});
  const auto pixel = [&](double y, double z, double x = 2.0) {
    const int u = static_cast<int>(std::lround(view.cx - view.fx * y / x));
    const int v = static_cast<int>(std::lround(view.cy - view.fy * (z - 1.0) / x));
    return &picture.rgb[3 * at(view, u, v)];
  };
  EXPECT_TRUE(pixel(0.2, 0.7)[0] == 255 && pixel(0.2, 0.7)[1] == 0);
  EXPECT_TRUE(pixel(-0.2, 0.7)[1] == 255 && pixel(-0.2, 0.7)[0] == 0) << "from its back";
  EXPECT_EQ(pixel(0.0, 0.7)[2], pixel(0.0, 0.7)[0]) << "hidden by the wall";
  EXPECT_EQ(pixel(0.0, 1.9, 1.9)[2], 255) << "cut where it is behind the eye";
}

}  // namespace
}  // namespace ruedo::scene
