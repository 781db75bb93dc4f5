// Our SDF reader against libsdformat 12: on every file of the corpus that both load, names, poses,
// shapes, inertias, joints, sensors and noise agree to 1e-9.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <sdf/sdf.hh>

#include "world/load.h"

namespace fs = std::filesystem;
using ruedo::Element;
using ruedo::Pose;
using ruedo::Vec3;
namespace world = ruedo::world;

namespace {

constexpr double kTolerance = 1e-9;

const fs::path kCorpus = fs::path(RUEDO_SOURCE_DIR) / ".." / "shared" / "corpus";

Pose pose_of(const ignition::math::Pose3d& p) {
  return {ruedo::Quat(p.Rot().W(), p.Rot().X(), p.Rot().Y(), p.Rot().Z()),
          {p.Pos().X(), p.Pos().Y(), p.Pos().Z()}};
}
Vec3 vec(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

std::string dotted(std::string name) {
  for (size_t at = name.find("::"); at != std::string::npos; at = name.find("::"))
    name.replace(at, 2, ".");
  return name;
}

void expect_near(const Pose& ours, const Pose& theirs, const std::string& what) {
  EXPECT_LT((ours.translation - theirs.translation).norm(), kTolerance) << what;
  EXPECT_LT(1.0 - std::abs(ours.rotation.dot(theirs.rotation)), kTolerance) << what;
}

template <class SemanticPose>
Pose resolved(const SemanticPose& pose, const std::string& to = "") {
  ignition::math::Pose3d result;
  const sdf::Errors errors = pose.Resolve(result, to);
  if (!errors.empty()) throw std::runtime_error(errors[0].Message());
  return pose_of(result);
}

// The values of libsdformat, flattened as by our reader.
struct Their {
  struct Link {
    Pose X_WL;
    const sdf::Link* link;
  };
  std::map<std::string, Link> links;
  struct Joint {
    Pose X_WJ;
    Vec3 axis_W;
    const sdf::Joint* joint;
  };
  std::map<std::string, Joint> joints;
  std::map<std::string, bool> static_models;
};

void collect(const sdf::Model& model, const std::string& prefix, const Pose& X_WM, Their& their) {
  for (uint64_t i = 0; i < model.LinkCount(); ++i) {
    const sdf::Link& link = *model.LinkByIndex(i);
    their.links[prefix + dotted(link.Name())] = {X_WM * resolved(link.SemanticPose(), "__model__"),
                                                 &link};
  }
  for (uint64_t i = 0; i < model.JointCount(); ++i) {
    const sdf::Joint& joint = *model.JointByIndex(i);
    const Pose X_WJ = X_WM * resolved(joint.SemanticPose(), "__model__");
    Vec3 axis = Vec3::Zero();
    if (joint.Axis()) {
      ignition::math::Vector3d xyz;
      if (joint.Axis()->ResolveXyz(xyz).empty()) axis = X_WJ.rotation * vec(xyz).normalized();
    }
    their.joints[prefix + dotted(joint.Name())] = {X_WJ, axis, &joint};
  }
  for (uint64_t i = 0; i < model.ModelCount(); ++i) {
    const sdf::Model& nested = *model.ModelByIndex(i);
    collect(nested, prefix + dotted(nested.Name()) + ".",
            X_WM * resolved(nested.SemanticPose(), "__model__"), their);
  }
}

void compare_geometry(const world::Geometry& ours, const sdf::Geometry& theirs,
                      const std::string& what) {
  const auto near = [&](const Vec3& a, const Vec3& b) {
    EXPECT_LT((a - b).norm(), kTolerance) << what;
  };
  switch (theirs.Type()) {
    case sdf::GeometryType::BOX:
      ASSERT_EQ(ours.shape, world::Shape::box) << what;
      near(ours.size, vec(theirs.BoxShape()->Size()));
      break;
    case sdf::GeometryType::SPHERE:
      ASSERT_EQ(ours.shape, world::Shape::sphere) << what;
      EXPECT_NEAR(ours.size.x(), theirs.SphereShape()->Radius(), kTolerance) << what;
      break;
    case sdf::GeometryType::CYLINDER:
      ASSERT_EQ(ours.shape, world::Shape::cylinder) << what;
      near(ours.size, {theirs.CylinderShape()->Radius(), theirs.CylinderShape()->Length(), 0});
      break;
    case sdf::GeometryType::PLANE:
      ASSERT_EQ(ours.shape, world::Shape::plane) << what;
      near(ours.normal, vec(theirs.PlaneShape()->Normal()));
      EXPECT_NEAR(ours.extent.x(), theirs.PlaneShape()->Size().X(), kTolerance) << what;
      break;
    case sdf::GeometryType::MESH:
      ASSERT_EQ(ours.shape, world::Shape::mesh) << what;
      near(ours.scale, vec(theirs.MeshShape()->Scale()));
      break;
    case sdf::GeometryType::HEIGHTMAP: ASSERT_EQ(ours.shape, world::Shape::mesh) << what; break;
    default: ADD_FAILURE() << what << ": a kind of shape that this test does not know";
  }
}

void compare_noise(const Element* ours, const sdf::Noise& theirs, const std::string& what) {
  if (theirs.Type() == sdf::NoiseType::NONE) return;
  ASSERT_NE(ours, nullptr) << what;
  EXPECT_NEAR(ours->number("mean", 0, ruedo::Allowed::any(ruedo::quantity::kRange)), theirs.Mean(),
              kTolerance)
      << what;
  EXPECT_NEAR(ours->number("stddev", 0, ruedo::Allowed::any(ruedo::quantity::kRange)),
              theirs.StdDev(), kTolerance)
      << what;
}

void compare_sensor(const world::SensorDescription& ours, const sdf::Sensor& theirs,
                    const std::string& what) {
  expect_near(ours.X_LS, resolved(theirs.SemanticPose()), what);
  const Element& e = *ours.element;
  EXPECT_NEAR(e.number("update_rate", 0, ruedo::Allowed::any(ruedo::quantity::kRange)),
              theirs.UpdateRate(), kTolerance)
      << what;
  if (const sdf::Lidar* lidar = theirs.LidarSensor()) {
    const Element* l = e.child("lidar") ? e.child("lidar") : e.child("ray");
    ASSERT_NE(l, nullptr) << what;
    EXPECT_EQ(
        l->integer("scan/horizontal/samples", 640, ruedo::Allowed::any(ruedo::quantity::kRange)),
        lidar->HorizontalScanSamples())
        << what;
    EXPECT_NEAR(
        l->number("scan/horizontal/min_angle", 0, ruedo::Allowed::any(ruedo::quantity::kRange)),
        lidar->HorizontalScanMinAngle().Radian(), kTolerance)
        << what;
    EXPECT_NEAR(
        l->number("scan/horizontal/max_angle", 0, ruedo::Allowed::any(ruedo::quantity::kRange)),
        lidar->HorizontalScanMaxAngle().Radian(), kTolerance)
        << what;
    EXPECT_NEAR(l->number("range/min", 0, ruedo::Allowed::any(ruedo::quantity::kRange)),
                lidar->RangeMin(), kTolerance)
        << what;
    EXPECT_NEAR(l->number("range/max", 0, ruedo::Allowed::any(ruedo::quantity::kRange)),
                lidar->RangeMax(), kTolerance)
        << what;
    compare_noise(l->child("noise"), lidar->LidarNoise(), what);
  }
  if (const sdf::Camera* camera = theirs.CameraSensor()) {
    EXPECT_NEAR(
        e.number("camera/horizontal_fov", 1.047, ruedo::Allowed::any(ruedo::quantity::kRange)),
        camera->HorizontalFov().Radian(), kTolerance)
        << what;
    EXPECT_EQ(e.integer("camera/image/width", 320, ruedo::Allowed::any(ruedo::quantity::kRange)),
              camera->ImageWidth())
        << what;
    EXPECT_NEAR(e.number("camera/clip/far", 100, ruedo::Allowed::any(ruedo::quantity::kRange)),
                camera->FarClip(), kTolerance)
        << what;
    compare_noise(e.child("camera/noise"), camera->ImageNoise(), what);
  }
  if (const sdf::Imu* imu = theirs.ImuSensor()) {
    compare_noise(e.child("imu/angular_velocity/x/noise"), imu->AngularVelocityXNoise(), what);
    compare_noise(e.child("imu/linear_acceleration/z/noise"), imu->LinearAccelerationZNoise(),
                  what);
  }
}

// How much was compared, so that a test of nothing cannot pass.
struct Counts {
  int files = 0, links = 0, shapes = 0, joints = 0, sensors = 0;
};

void compare_instance(const world::ModelInstance& ours, const Their& their,
                      const std::string& findings, const std::string& file, Counts& counts) {
  const world::Model& m = *ours.model;
  EXPECT_EQ(m.links.size(), their.links.size()) << file << " " << ours.name;
  for (const world::Link& link : m.links) {
    const std::string what = file + " " + ours.name + "/" + link.name;
    const auto at = their.links.find(link.name);
    if (at == their.links.end()) {
      ADD_FAILURE() << what << ": libsdformat has no such link";
      continue;
    }
    ++counts.links;
    const sdf::Link& theirs = *at->second.link;
    const Pose X_WL = ours.X_WM * link.X_ML;
    expect_near(X_WL, at->second.X_WL, what);
    if (findings.find("link " + theirs.Name() + "/inertial") == std::string::npos) {
      const auto& inertial = theirs.Inertial();
      EXPECT_NEAR(link.inertial.mass, inertial.MassMatrix().Mass(), kTolerance) << what;
      EXPECT_NEAR(link.inertial.inertia(0, 0), inertial.MassMatrix().Ixx(), kTolerance) << what;
      EXPECT_NEAR(link.inertial.inertia(1, 2), inertial.MassMatrix().Iyz(), kTolerance) << what;
      EXPECT_NEAR(link.inertial.inertia(2, 2), inertial.MassMatrix().Izz(), kTolerance) << what;
      expect_near(link.inertial.X_LI, pose_of(inertial.Pose()), what + " inertial");
    }
    for (const world::Collision& c : link.collisions) {
      const sdf::Collision* other = theirs.CollisionByName(c.name);
      ASSERT_NE(other, nullptr) << what << " collision " << c.name;
      expect_near(c.X_LC, resolved(other->SemanticPose()), what + " collision " + c.name);
      compare_geometry(c.geometry, *other->Geom(), what + " collision " + c.name);
      ++counts.shapes;
    }
    for (const world::Visual& v : link.visuals) {
      const sdf::Visual* other = theirs.VisualByName(v.name);
      ASSERT_NE(other, nullptr) << what << " visual " << v.name;
      expect_near(v.X_LV, resolved(other->SemanticPose()), what + " visual " + v.name);
      compare_geometry(v.geometry, *other->Geom(), what + " visual " + v.name);
      EXPECT_NEAR(v.transparency, other->Transparency(), 1e-6) << what;
      ++counts.shapes;
    }
    // Everything that we left out was reported.
    for (uint64_t i = 0; i < theirs.CollisionCount(); ++i) {
      const std::string name = theirs.CollisionByIndex(i)->Name();
      const bool here = std::any_of(link.collisions.begin(), link.collisions.end(),
                                    [&](const auto& c) { return c.name == name; });
      EXPECT_TRUE(here || findings.find("collision " + name) != std::string::npos)
          << what << " collision " << name;
    }
    for (uint64_t i = 0; i < theirs.VisualCount(); ++i) {
      const std::string name = theirs.VisualByIndex(i)->Name();
      const bool here = std::any_of(link.visuals.begin(), link.visuals.end(),
                                    [&](const auto& v) { return v.name == name; });
      EXPECT_TRUE(here || findings.find("visual " + name) != std::string::npos)
          << what << " visual " << name;
    }
    const int index = static_cast<int>(&link - m.links.data());
    for (const world::SensorDescription& sensor : m.sensors) {
      if (sensor.link != index) continue;
      const sdf::Sensor* other = theirs.SensorByName(*sensor.element->attribute("name"));
      ASSERT_NE(other, nullptr) << what << " sensor " << sensor.name;
      compare_sensor(sensor, *other, what + " sensor " + sensor.name);
      ++counts.sensors;
    }
  }
  for (const world::Joint& joint : m.joints) {
    const std::string what = file + " " + ours.name + " joint " + joint.name;
    const auto at = their.joints.find(joint.name);
    if (at == their.joints.end()) {
      EXPECT_NE(joint.name.find(".anchor"), std::string::npos)
          << what << ": libsdformat has no such joint";
      continue;
    }
    expect_near(ours.X_WM * joint.X_MJ, at->second.X_WJ, what);
    if (joint.type == world::JointType::revolute || joint.type == world::JointType::prismatic) {
      const Vec3 axis_W = ours.X_WM.rotation * (joint.X_MJ.rotation * joint.axis.axis_in_J);
      EXPECT_LT((axis_W - at->second.axis_W).norm(), kTolerance) << what;
      const double lower = at->second.joint->Axis()->Lower();
      if (lower > -1e15) EXPECT_NEAR(joint.axis.lower, lower, kTolerance) << what;
      EXPECT_NEAR(joint.axis.damping, at->second.joint->Axis()->Damping(), kTolerance) << what;
    }
    ++counts.joints;
  }
}

// model://NAME to the folder, as Gazebo's search path would.
std::string find_for_oracle(const std::string& uri, const fs::path& file) {
  std::string name = uri;
  for (const char* scheme : {"model://", "file://"}) {
    if (name.rfind(scheme, 0) == 0) name = name.substr(std::string(scheme).size());
  }
  if (name.rfind("https://", 0) == 0) {
    name = name.substr(name.rfind('/') + 1);
    std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) {
      return c == ' ' ? '_' : static_cast<char>(std::tolower(c));
    });
  }
  for (const fs::path& root :
       {file.parent_path(), file.parent_path() / "models", file.parent_path() / "../models",
        file.parent_path() / "..", fs::path(RUEDO_SOURCE_DIR) / "worlds/models",
        kCorpus / "gazebo_models"}) {
    if (fs::exists(root / name)) return (root / name).string();
  }
  return "";
}

// Compares one file when libsdformat loads it; false when it does not.
bool compare_file(const fs::path& path, Counts& counts) {
  sdf::ParserConfig config;
  config.SetFindCallback([&](const std::string& uri) { return find_for_oracle(uri, path); });
  sdf::Root root;
  try {
    if (const sdf::Errors errors = root.Load(path.string(), config); !errors.empty()) return false;
  } catch (const sdf::Exception&) {  // no std::exception
    return false;
  } catch (const std::exception&) {
    return false;
  }
  SCOPED_TRACE(path.string());
  std::shared_ptr<const world::WorldModel> ours;
  try {
    ours = world::load_world(path.string());
  } catch (const std::exception& error) {
    ADD_FAILURE() << path << ": libsdformat loads it, we do not: " << error.what();
    return true;
  }
  std::string findings;
  for (const auto& finding : ours->findings)
    findings += finding.element + ": " + finding.text + "\n";
  const auto compare = [&](const sdf::Model& theirs, const Pose& X_WM, const std::string& name) {
    const auto at = std::find_if(ours->models.begin(), ours->models.end(),
                                 [&](const auto& each) { return each.name == dotted(name); });
    ASSERT_NE(at, ours->models.end()) << path << " " << name;
    if (theirs.Static()) EXPECT_TRUE(at->model->is_static) << path << " " << name;
    Their their;
    collect(theirs, "", X_WM, their);
    compare_instance(*at, their, findings, path.filename().string(), counts);
  };
  ++counts.files;
  if (const sdf::World* world = root.WorldByIndex(0)) {
    for (uint64_t i = 0; i < world->ModelCount(); ++i) {
      const sdf::Model& theirs = *world->ModelByIndex(i);
      Pose X_WM = resolved(theirs.SemanticPose(), "world");
      if (world->Element()->HasElement(
              "state")) {  // libsdformat reads it, and leaves it to its users
        for (auto state = world->Element()->FindElement("state")->FindElement("model"); state;
             state = state->GetNextElement("model")) {
          if (state->Get<std::string>("name") == theirs.Name())
            X_WM = pose_of(state->Get<ignition::math::Pose3d>("pose"));
        }
      }
      compare(theirs, X_WM, theirs.Name());
    }
    EXPECT_LT((ours->gravity - vec(world->Gravity())).norm(), kTolerance);
    if (world->Element()->HasElement("physics")) {
      EXPECT_NEAR(static_cast<double>(ours->step_us) * 1e-6, world->PhysicsDefault()->MaxStepSize(),
                  kTolerance);
    }
    for (uint64_t i = 0; i < world->LightCount(); ++i) {
      const sdf::Light& light = *world->LightByIndex(i);
      const auto at = std::find_if(ours->lights.begin(), ours->lights.end(),
                                   [&](const auto& each) { return each.name == light.Name(); });
      if (at == ours->lights.end()) {
        ADD_FAILURE() << light.Name();
        continue;
      }
      if (world->Element()->HasElement("state")) continue;  // which it leaves to its users
      expect_near(at->pose, pose_of(light.RawPose()), light.Name());
      EXPECT_LT((at->direction - vec(light.Direction()).normalized()).norm(), kTolerance)
          << light.Name();
    }
  } else if (const sdf::Model* theirs = root.Model()) {
    compare(*theirs, pose_of(theirs->RawPose()), theirs->Name());
  }
  return true;
}

std::vector<fs::path> sdf_files(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const auto extension = entry.path().extension();
    if (extension == ".world" || extension == ".sdf") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

void silence() {
  static std::ostringstream nowhere;
  sdf::Console::Instance()->GetMsgStream().SetStream(&nowhere);
}

TEST(Oracle, FixturesAgree) {
  silence();
  Counts counts;
  for (const fs::path& path :
       sdf_files(fs::path(RUEDO_SOURCE_DIR) / "tests/world/oracle/fixtures")) {
    EXPECT_TRUE(compare_file(path, counts)) << path << ": libsdformat refuses it";
  }
  EXPECT_EQ(counts.files, 5);
  EXPECT_GE(counts.links, 20);
  EXPECT_GE(counts.joints, 13);
}

TEST(Oracle, CorpusAgrees) {
  if (!fs::exists(kCorpus)) GTEST_SKIP() << "the corpus of real worlds is not here: " << kCorpus;
  silence();
  Counts counts;
  for (const fs::path& path : sdf_files(kCorpus)) compare_file(path, counts);
  RecordProperty("files", counts.files);
  EXPECT_GE(counts.files, 90);
  EXPECT_GE(counts.links, 250);
  EXPECT_GE(counts.shapes, 900);
  EXPECT_GE(counts.joints, 70);
  EXPECT_GE(counts.sensors, 20);
}

}  // namespace
