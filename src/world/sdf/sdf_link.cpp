// Links. Impossible inertias are replaced by those of a box around the collisions, and reported.
#include "world/sdf/sdf_link.h"

#include <cmath>
#include <optional>
#include <set>

#include <Eigen/Eigenvalues>

#include "base/text.h"
#include "world/model/bounds.h"
#include "world/read/geometry.h"
#include "world/read/material.h"

namespace ruedo::world {
namespace {

// Surface parameters that change motion in Gazebo, but have no effect here.
void name_what_has_no_effect(const Element& surface, const std::string& where, Findings& findings) {
  const auto name = [&](const char* path, const std::string& text) {
    findings.unsupported(surface.child(path)->source, where,
                         "<" + surface.child(path)->name + "> is not supported: " + text);
  };
  constexpr const char* kMask = "contact/collide_bitmask";
  if (surface.has(kMask)) {
    const std::string mask = surface.string(kMask, "");
    const bool all = mask.find_first_not_of("0x1fF") == std::string::npos &&
                     mask.find_first_of("1fF") != std::string::npos;
    if (!all && mask != "65535") name(kMask, "the shape collides with everything");
  }
  if (surface.boolean("contact/collide_without_contact", false))
    name("contact/collide_without_contact", "the shape collides as others do");
}

// Friction other than mu and mu2, and compliance of the contact.
void read_contact(const Element& surface, Surface& s) {
  const Allowed friction = Allowed::not_negative(quantity::kFriction),
                direction = Allowed::any(quantity::kFactor),
                length = Allowed::not_negative(quantity::kLength),
                contact = Allowed::not_negative(quantity::kContact);
  s.friction_direction =
      surface.vector3("friction/ode/fdir1",
                      surface.vector3("friction/bullet/fdir1", Vec3::Zero(), direction), direction);
  s.slip = surface.number("friction/ode/slip1", 0.0, friction);
  s.slip2 = surface.number("friction/ode/slip2", 0.0, friction);
  s.rolling = surface.number("friction/bullet/rolling_friction", 0.0, friction);
  if (const Element* torsional = surface.child("friction/torsional")) {
    s.torsional = torsional->number("coefficient", 0.0, friction);
    s.patch_radius = torsional->boolean("use_patch_radius", true)
                         ? torsional->number("patch_radius", 0.0, length)
                         : 0.0;
    s.surface_radius = torsional->number("surface_radius", 0.0, length);
  }
  s.stiffness =
      surface.number("contact/ode/kp", surface.number("contact/bullet/kp", 0.0, contact), contact);
  s.damping =
      surface.number("contact/ode/kd", surface.number("contact/bullet/kd", 1.0, contact), contact);
}

Surface read_surface(const Element& surface, const std::string& where, ReadContext& context) {
  report_other_children(surface,
                        {"friction", "bounce", "ruedo:laser_reflectance", "ruedo:laser_mirror",
                         "ruedo:acoustic_reflectance"},
                        {"contact", "soft_contact"}, where, context.findings);
  Surface s;
  const Allowed part = Allowed::between(0, 1),
                friction = Allowed::not_negative(quantity::kFriction);
  // gz-sim reads friction/ode; friction/bullet holds an author's values for Bullet alone.
  const char* engine = !surface.has("friction/ode") && surface.has("friction/bullet")
                           ? "friction/bullet/"
                           : "friction/ode/";
  const std::string first = engine + std::string(engine[9] == 'b' ? "friction" : "mu");
  const std::string second = engine + std::string(engine[9] == 'b' ? "friction2" : "mu2");
  s.friction = surface.number(first, s.friction, friction);
  s.friction2 = surface.number(second, surface.has(second) ? s.friction2 : s.friction, friction);
  read_contact(surface, s);
  s.restitution = surface.number("bounce/restitution_coefficient", 0, part);
  s.laser_reflectance = surface.number("ruedo:laser_reflectance", 1, part);
  s.laser_mirror = surface.number("ruedo:laser_mirror", 0, part);
  s.acoustic_reflectance = surface.number("ruedo:acoustic_reflectance", 1, part);
  name_what_has_no_effect(surface, where, context.findings);
  return s;
}

Collision read_collision(const Element& element, const Pose& X_LC, Geometry geometry,
                         const std::string& where, ReadContext& context) {
  report_other_children(element, {"pose", "geometry", "surface"},
                        {"laser_retro", "max_contacts", "density", "auto_inertia_params"}, where,
                        context.findings);
  Collision c;
  c.name = required_name(element);
  c.X_LC = X_LC;
  c.geometry = std::move(geometry);
  if (element.number("laser_retro", 0.0, Allowed::any(quantity::kBrightness)) != 0.0) {
    context.findings.unsupported(
        element.child("laser_retro")->source, where,
        "<laser_retro> is not supported: <ruedo:laser_reflectance> gives intensities");
  }
  if (const Element* surface = element.child("surface"))
    c.surface = read_surface(*surface, where, context);
  c.source = element.source;
  return c;
}

Visual read_visual(const Element& element, const Pose& X_LV, Geometry geometry,
                   const std::string& where, ReadContext& context) {
  report_other_children(element, {"pose", "geometry", "material", "transparency", "cast_shadows"},
                        {"laser_retro", "meta", "visibility_flags", "plugin"}, where,
                        context.findings);
  Visual v;
  v.name = required_name(element);
  v.X_LV = X_LV;
  v.geometry = std::move(geometry);
  if (const Element* material = element.child("material")) {
    read_or_leave_out(where, "the material is left out", context.findings,
                      [&] { v.material = read_material(*material, where, context); });
  }
  if (v.geometry.mesh && !v.material)
    context.meshes.name_textures_not_found(*v.geometry.mesh, context.findings);
  v.transparency = element.number("transparency", 0, Allowed::between(0, 1));
  v.cast_shadows = element.boolean("cast_shadows", true);
  return v;
}

constexpr double kLightest_kg = 1e-9;  // with less, an impulse could produce any speed

// A moment of inertia; NaN where exporters wrote nan.
double moment(const Element& inertia, const char* name, double fallback) {
  const std::string text = inertia.string(name, "");
  if (text == "nan" || text == "-nan" || text == "NaN")
    return std::numeric_limits<double>::quiet_NaN();
  return inertia.number(name, fallback, Allowed::any(quantity::kInertia));
}

// The error in an inertia; "" if a body can have it. A tolerance of a thousandth allows for
// rounding.
std::string inertia_fault(const Inertial& inertial) {
  if (!inertial.inertia.allFinite()) return "a moment of inertia is not a number";
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertial.inertia);
  const Vec3 moments = solver.eigenvalues();  // sorted, ascending
  if (!(moments[0] > 0)) return "the moments of inertia are not all positive";
  if (moments[0] + moments[1] < moments[2] * (1 - 1e-3))
    return "one moment of inertia is larger than the sum of the two others";
  return "";
}

std::string in_words(const Vec3& size) {
  const auto rounded = [](double v) { return shown(std::round(v * 1000) / 1000); };
  return rounded(size.x()) + " x " + rounded(size.y()) + " x " + rounded(size.z()) + " m";
}

// The inertia of a box around the collisions; of a cube of 0.1 m without one.
Eigen::Matrix3d box_inertia(double mass, const Link& link, Vec3& size) {
  Eigen::AlignedBox3d box;
  for (const Collision& c : link.collisions) {
    const Eigen::AlignedBox3d shape = bounds(c.geometry);
    if (shape.isEmpty()) continue;
    for (int corner = 0; corner < 8; ++corner) {
      box.extend(c.X_LC * shape.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
    }
  }
  size = box.isEmpty() ? Vec3(Vec3::Constant(0.1)) : Vec3(box.sizes().cwiseMax(0.01));
  const Vec3 s2 = size.cwiseProduct(size);
  return Vec3(mass / 12 * (s2.y() + s2.z()), mass / 12 * (s2.x() + s2.z()),
              mass / 12 * (s2.x() + s2.y()))
      .asDiagonal();
}

// Volume, and moments about the centre for density 1; nullopt: a shape for which they are not
// known.
std::optional<std::pair<double, Vec3>> solid(const Geometry& geometry) {
  const double x = geometry.size.x(), y = geometry.size.y(), z = geometry.size.z();
  const auto with = [](double volume, double xx, double yy, double zz) {
    return std::pair(volume, Vec3(volume * Vec3(xx, yy, zz)));
  };
  switch (geometry.shape) {
    case Shape::box:
      return with(x * y * z, (y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12);
    case Shape::sphere:
      return with(4.0 / 3 * M_PI * x * x * x, 0.4 * x * x, 0.4 * x * x, 0.4 * x * x);
    case Shape::cylinder:
      return with(M_PI * x * x * y, x * x / 4 + y * y / 12, x * x / 4 + y * y / 12, x * x / 2);
    case Shape::ellipsoid:
      return with(4.0 / 3 * M_PI * x * y * z, (y * y + z * z) / 5, (x * x + z * z) / 5,
                  (x * x + y * y) / 5);
    default: return std::nullopt;
  }
}

// auto="true": mass, centre and moments of the collisions' solids (with SDF's default density of
// 1000 kg/m^3 if none is given), scaled to <mass> if there is one. False if the solid of a shape is
// not known.
bool computed_inertial(const Element& element, const Element& link_element, const Link& link,
                       Inertial& inertial) {
  const std::vector<const Element*> written = link_element.all("collision");
  const double usual = element.number("density", 1000.0, Allowed::positive(quantity::kDensity));
  double mass = 0;
  Vec3 moment = Vec3::Zero();
  Eigen::Matrix3d about_link = Eigen::Matrix3d::Zero();
  for (const Collision& c : link.collisions) {
    const auto shape = solid(c.geometry);
    if (!shape) return false;
    double density = usual;
    for (const Element* each : written) {
      if (required_name(*each) == c.name)
        density = each->number("density", usual, Allowed::positive(quantity::kDensity));
    }
    const double m = density * shape->first;
    const Vec3 at = c.X_LC.translation;
    const Eigen::Matrix3d R = c.X_LC.rotation.toRotationMatrix();
    mass += m;
    moment += m * at;
    about_link += R * Vec3(density * shape->second).asDiagonal() * R.transpose() +
                  m * (at.squaredNorm() * Eigen::Matrix3d::Identity() - at * at.transpose());
  }
  if (!(mass >= kLightest_kg && mass <= quantity::kMass.most)) return false;
  const Vec3 centre = moment / mass;
  const double scale = element.has("mass") ? inertial.mass / mass : 1.0;
  inertial.mass = mass * scale;
  inertial.X_LI = Pose{};
  inertial.X_LI.translation = centre;
  inertial.inertia =
      scale * (about_link - mass * (centre.squaredNorm() * Eigen::Matrix3d::Identity() -
                                    centre * centre.transpose()));
  return true;
}

Inertial read_inertial(const Element& element, const Element& link_element, const Link& link,
                       const Pose& X_LI, const std::string& where, ReadContext& context) {
  report_other_children(element, {"pose", "mass", "inertia", "density"}, {"auto_inertia_params"},
                        where, context.findings);
  Inertial inertial;
  inertial.X_LI = X_LI;
  inertial.mass = element.number("mass", 1.0, Allowed::any(quantity::kMass));
  if (!(inertial.mass >= kLightest_kg)) {
    context.findings.repaired(
        element.child("mass")->source, where,
        "the mass " + shown(inertial.mass) + " kg is " +
            (inertial.mass > 0 ? "below " + shown(kLightest_kg) + " kg" : "not above 0") +
            "; it is taken as 1 kg");
    inertial.mass = 1.0;
  }
  const std::string* automatic = element.attribute("auto");
  if (automatic && (*automatic == "true" || *automatic == "1")) {
    if (computed_inertial(element, link_element, link, inertial)) return inertial;
    Vec3 size;
    inertial.inertia = box_inertia(inertial.mass, link, size);
    context.findings.repaired(
        element.source, where,
        "auto=\"true\" is not computed from the shapes; the inertia is that of a box of " +
            in_words(size));
    return inertial;
  }
  if (const Element* i = element.child("inertia")) {
    report_other_children(*i, {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}, {}, where,
                          context.findings);
    const double ixx = moment(*i, "ixx", 1), iyy = moment(*i, "iyy", 1), izz = moment(*i, "izz", 1);
    const double ixy = moment(*i, "ixy", 0), ixz = moment(*i, "ixz", 0), iyz = moment(*i, "iyz", 0);
    inertial.inertia << ixx, ixy, ixz, ixy, iyy, iyz, ixz, iyz, izz;
    if (const std::string fault = inertia_fault(inertial); !fault.empty()) {
      Vec3 size;
      inertial.inertia = box_inertia(inertial.mass, link, size);
      context.findings.repaired(
          i->source, where,
          fault + "; the inertia of a box of " + in_words(size) + " is taken instead");
    }
  }
  return inertial;
}

// Parts of a link that Ruedo does not support.
void report_unsupported(const Element& element, const std::string& where, Findings& findings) {
  if (const Element* decay = element.child("velocity_decay");
      decay && (decay->number("linear", 0.0, Allowed::any(quantity::kDamping)) != 0.0 ||
                decay->number("angular", 0.0, Allowed::any(quantity::kDamping)) != 0.0)) {
    findings.unsupported(decay->source, where,
                         "<velocity_decay> is not supported: nothing slows the link in the air");
  }
  if (element.boolean("self_collide", false)) {
    findings.unsupported(element.child("self_collide")->source, where,
                         "<self_collide> of a link is not supported; a model may have it");
  }
}

}  // namespace

Light read_light(const Element& element, const Pose& pose, const std::string& where,
                 ReadContext& context) {
  report_other_children(element,
                        {"pose", "diffuse", "specular", "attenuation", "direction", "spot",
                         "intensity", "cast_shadows", "light_on"},
                        {"visualize"}, where, context.findings);
  Light light;
  light.name = required_name(element);
  const std::string* type = element.attribute("type");
  const std::string kind = type ? *type : "point";
  if (kind == "directional")
    light.type = Light::Type::directional;
  else if (kind == "spot")
    light.type = Light::Type::spot;
  else if (kind != "point")
    element.fail("type '" + kind + "' is not allowed; allowed are directional, point, spot");
  light.pose = pose;
  light.direction = element.vector3("direction", -Vec3::UnitZ(), Allowed::any(quantity::kFactor));
  if (!(light.direction.norm() > 1e-9))
    element.child("direction")
        ->fail("'" + element.child("direction")->text +
               "' is not allowed; a direction is not zero");
  light.direction.normalize();
  if (const Element* colour = element.child("diffuse"))
    light.diffuse = read_colour(*colour, where, context.findings);
  if (const Element* colour = element.child("specular"))
    light.specular = read_colour(*colour, where, context.findings);
  const Allowed brightness = Allowed::not_negative(quantity::kBrightness),
                angle = Allowed::not_negative(quantity::kAngle);
  light.range =
      element.number("attenuation/range", light.range, Allowed::not_negative(quantity::kRange));
  light.constant = element.number("attenuation/constant", light.constant, brightness);
  light.linear = element.number("attenuation/linear", light.linear, brightness);
  light.quadratic = element.number("attenuation/quadratic", light.quadratic, brightness);
  light.inner_angle = element.number("spot/inner_angle", 0, angle);
  light.outer_angle = element.number("spot/outer_angle", 0, angle);
  light.falloff = element.number("spot/falloff", 0, brightness);
  if (light.type == Light::Type::spot && light.inner_angle > light.outer_angle &&
      element.has("spot/outer_angle")) {
    context.findings.repaired(element.child("spot")->source, where,
                              "the <inner_angle> " + shown(light.inner_angle) +
                                  " is above the <outer_angle> " + shown(light.outer_angle) +
                                  "; they are taken the other way round");
    std::swap(light.inner_angle, light.outer_angle);
  }
  light.intensity =
      element.boolean("light_on", true) ? element.number("intensity", 1, brightness) : 0.0;
  light.cast_shadows = element.boolean("cast_shadows", false);
  return light;
}

SensorDescription read_sensor(const Element& element, ModelLinkIndex link, const Pose& X_LS) {
  SensorDescription sensor;
  sensor.name = dotted(required_name(element));
  const std::string* type = element.attribute("type");
  if (!type || type->empty()) element.fail("has no type");
  sensor.type = *type;
  sensor.link = link;
  sensor.X_LS = X_LS;
  sensor.element = element.clone();
  return sensor;
}

Link read_link(const Element& element, const PoseInLink& pose_in_link, const std::string& where,
               ReadContext& context, bool moves, ModelLinkIndex index,
               std::vector<SensorDescription>& sensors) {
  report_other_children(element,
                        {"pose", "inertial", "collision", "visual", "sensor", "light", "gravity",
                         "kinematic", "enable_wind"},
                        {"self_collide", "velocity_decay", "must_be_base_link", "plugin"}, where,
                        context.findings);
  Link link;
  link.name = required_name(element);
  link.source = element.source;
  link.gravity = element.boolean("gravity", true);
  link.wind = element.boolean("enable_wind", false);
  link.kinematic = element.boolean("kinematic", false);
  report_unsupported(element, where, context.findings);
  std::set<std::string> names;
  const auto unique = [&](const Element& child) {
    if (names.insert(child.name + " " + required_name(child)).second) return;
    child.fail("a second <" + child.name + "> named '" + required_name(child) + "' in this link");
  };
  const auto read_shape = [&](const Element& child) {
    unique(child);
    const std::string here = where + "/" + child.name + " " + required_name(child);
    const Element* shape = child.child("geometry");
    if (!shape) child.fail("has no <geometry>");
    const ShapeUse use = child.name == "visual" ? ShapeUse::seen
                         : moves                ? ShapeUse::collides_moving
                                                : ShapeUse::collides;
    auto geometry = read_geometry(*shape, here, context, use);
    if (!geometry) return;
    const Pose pose = pose_in_link(child);
    if (child.name == "collision")
      link.collisions.push_back(read_collision(child, pose, std::move(*geometry), here, context));
    else
      link.visuals.push_back(read_visual(child, pose, std::move(*geometry), here, context));
  };
  for (const auto& child : element.children) {
    if (child->name == "collision" || child->name == "visual") {
      read_or_leave_out(where, "the shape is left out", context.findings,
                        [&] { read_shape(*child); });
    } else if (child->name == "light") {
      read_or_leave_out(where, "the light is left out", context.findings, [&] {
        link.lights.push_back(read_light(*child, pose_in_link(*child), where + "/light", context));
      });
    } else if (child->name == "sensor") {
      read_or_leave_out(where, "the sensor is left out", context.findings, [&] {
        unique(*child);
        sensors.push_back(read_sensor(*child, index, pose_in_link(*child)));
      });
    }
  }
  if (const Element* inertial = element.child("inertial")) {
    read_or_leave_out(where, "a mass of 1 kg is taken", context.findings, [&] {
      link.inertial = read_inertial(*inertial, element, link, pose_in_link(*inertial),
                                    where + "/inertial", context);
    });
  }
  return link;
}

}  // namespace ruedo::world
