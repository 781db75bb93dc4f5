// Written by the fields that docs.foxglove.dev gives for each type; descriptions are left out.
#include "bridges/foxglove/foxglove_schemas.h"

#include <utility>
#include <vector>

#include "base/json.h"

namespace ruedo::foxglove {
namespace {

using Fields = std::vector<std::pair<const char*, std::string>>;

std::string object(const std::string& title, const Fields& fields) {
  JsonWriter json;
  json.open('{').member("title", title).member("type", "object").name("properties").open('{');
  for (const auto& [name, type] : fields) json.name(name).raw(type);
  json.close('}').close('}');
  return json.text();
}

std::string list(const std::string& items) {
  return R"({"type": "array", "items": )" + items + "}";
}

const std::string kNumber = R"({"type": "number"})";
const std::string kCount = R"({"type": "integer", "minimum": 0})";
const std::string kText = R"({"type": "string"})";
const std::string kFlag = R"({"type": "boolean"})";
const std::string kBytes = R"({"type": "string", "contentEncoding": "base64"})";

std::string time(const char* title) {
  return object(title, {{"sec", R"({"type": "integer"})"},
                        {"nsec", R"({"type": "integer", "minimum": 0, "maximum": 999999999})"}});
}
std::string vector3() {
  return object("foxglove.Vector3", {{"x", kNumber}, {"y", kNumber}, {"z", kNumber}});
}
std::string point3() {
  return object("foxglove.Point3", {{"x", kNumber}, {"y", kNumber}, {"z", kNumber}});
}
std::string quaternion() {
  return object("foxglove.Quaternion",
                {{"x", kNumber}, {"y", kNumber}, {"z", kNumber}, {"w", kNumber}});
}
std::string colour() {
  return object("foxglove.Color", {{"r", kNumber}, {"g", kNumber}, {"b", kNumber}, {"a", kNumber}});
}
std::string pose() {
  return object("foxglove.Pose", {{"position", vector3()}, {"orientation", quaternion()}});
}

Type type(const std::string& name, const Fields& fields) { return {name, object(name, fields)}; }

std::string deletion() {
  return object("foxglove.SceneEntityDeletion",
                {{"timestamp", time("time")}, {"type", kCount}, {"id", kText}});
}
std::string triangles() {
  return object("foxglove.TriangleListPrimitive", {{"pose", pose()},
                                                   {"points", list(point3())},
                                                   {"color", colour()},
                                                   {"colors", list(colour())},
                                                   {"indices", list(kCount)}});
}
std::string lines() {
  return object("foxglove.LinePrimitive", {{"type", kCount},
                                           {"pose", pose()},
                                           {"thickness", kNumber},
                                           {"scale_invariant", kFlag},
                                           {"points", list(point3())},
                                           {"color", colour()},
                                           {"colors", list(colour())},
                                           {"indices", list(kCount)}});
}
std::string spheres() {
  return object("foxglove.SpherePrimitive",
                {{"pose", pose()}, {"size", vector3()}, {"color", colour()}});
}
std::string texts() {
  return object("foxglove.TextPrimitive", {{"pose", pose()},
                                           {"billboard", kFlag},
                                           {"font_size", kNumber},
                                           {"scale_invariant", kFlag},
                                           {"color", colour()},
                                           {"text", kText}});
}
std::string entity() {
  return object("foxglove.SceneEntity", {{"timestamp", time("time")},
                                         {"frame_id", kText},
                                         {"id", kText},
                                         {"lifetime", time("duration")},
                                         {"frame_locked", kFlag},
                                         {"lines", list(lines())},
                                         {"spheres", list(spheres())},
                                         {"texts", list(texts())},
                                         {"triangles", list(triangles())}});
}

}  // namespace

const Type& laser_scan() {
  static const Type made = type("foxglove.LaserScan", {{"timestamp", time("time")},
                                                       {"frame_id", kText},
                                                       {"pose", pose()},
                                                       {"start_angle", kNumber},
                                                       {"end_angle", kNumber},
                                                       {"ranges", list(kNumber)},
                                                       {"intensities", list(kNumber)}});
  return made;
}

const Type& compressed_image() {
  static const Type made =
      type("foxglove.CompressedImage",
           {{"timestamp", time("time")}, {"frame_id", kText}, {"data", kBytes}, {"format", kText}});
  return made;
}

const Type& raw_image() {
  static const Type made = type("foxglove.RawImage", {{"timestamp", time("time")},
                                                      {"frame_id", kText},
                                                      {"width", kCount},
                                                      {"height", kCount},
                                                      {"encoding", kText},
                                                      {"step", kCount},
                                                      {"data", kBytes}});
  return made;
}

const Type& camera_calibration() {
  static const Type made = type("foxglove.CameraCalibration", {{"timestamp", time("time")},
                                                               {"frame_id", kText},
                                                               {"width", kCount},
                                                               {"height", kCount},
                                                               {"distortion_model", kText},
                                                               {"D", list(kNumber)},
                                                               {"K", list(kNumber)},
                                                               {"R", list(kNumber)},
                                                               {"P", list(kNumber)}});
  return made;
}

const Type& pose_in_frame() {
  static const Type made = type(
      "foxglove.PoseInFrame", {{"timestamp", time("time")}, {"frame_id", kText}, {"pose", pose()}});
  return made;
}

const Type& location_fix() {
  static const Type made = type("foxglove.LocationFix", {{"timestamp", time("time")},
                                                         {"frame_id", kText},
                                                         {"latitude", kNumber},
                                                         {"longitude", kNumber},
                                                         {"altitude", kNumber},
                                                         {"position_covariance", list(kNumber)},
                                                         {"position_covariance_type", kCount}});
  return made;
}

const Type& frame_transforms() {
  static const Type made =
      type("foxglove.FrameTransforms",
           {{"transforms", list(object("foxglove.FrameTransform", {{"timestamp", time("time")},
                                                                   {"parent_frame_id", kText},
                                                                   {"child_frame_id", kText},
                                                                   {"translation", vector3()},
                                                                   {"rotation", quaternion()}}))}});
  return made;
}

const Type& scene_update() {
  static const Type made =
      type("foxglove.SceneUpdate", {{"deletions", list(deletion())}, {"entities", list(entity())}});
  return made;
}

}  // namespace ruedo::foxglove
