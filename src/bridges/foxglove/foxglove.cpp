// Frames: world, a frame for each body that moves (MODEL/LINK), for each robot (its base_link), its
// odometry's origin (ROBOT/odom), and its devices (ROBOT/DEVICE, and ROBOT/DEVICE/optical: z ahead,
// x right, y down).
#include "bridges/foxglove/foxglove.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/base64.h"
#include "base/channel_names.h"
#include "base/json.h"
#include "base/utf8.h"
#include "bridges/foxglove/foxglove_json.h"
#include "bridges/foxglove/message_json.h"
#include "engine/markers.h"
#include "ruedo/decode.h"
#include "ruedo/math.h"
#include "scene/pictures/render_content.h"
#include "world/model/body_layout.h"

namespace ruedo::foxglove {
namespace {

constexpr int kManyLinks =
    150;  // of a kind: round shapes get fewer triangles then, as on the console's page

void write_frame(JsonWriter& json, uint64_t time_ns, const std::string& parent,
                 const std::string& child, const Pose& X) {
  const Quat& q = X.rotation;
  json.open('{');
  write_time(json, "timestamp", time_ns);
  json.member("parent_frame_id", parent).member("child_frame_id", child);
  write_xyz(json, "translation", X.translation.x(), X.translation.y(), X.translation.z());
  write_rotation(json, "rotation", q.w(), q.x(), q.y(), q.z());
  json.close('}');
}

template <class Numbers>
void write_numbers(JsonWriter& json, const char* name, const Numbers& numbers) {
  json.name(name).open('[');
  for (const auto number : numbers) json.raw(json_number(number));
  json.close(']');
}

Pose pose_of(const double* position, const double* orientation) {
  return Pose{Quat(orientation[0], orientation[1], orientation[2], orientation[3]),
              Vec3(position[0], position[1], position[2])};
}

// Foxglove's name of a format of raw pixels; null if it has none.
const char* encoding_of(int32_t format) {
  switch (format) {
    case image_t::PIXEL_FORMAT_GRAY: return "mono8";
    case image_t::PIXEL_FORMAT_RGB: return "rgb8";
    case image_t::PIXEL_FORMAT_BGR: return "bgr8";
    case image_t::PIXEL_FORMAT_LE_GRAY16: return "16UC1";
    case image_t::PIXEL_FORMAT_FLOAT_GRAY32: return "32FC1";
    default: return nullptr;
  }
}

std::string scan_json(const planar_lidar_t& scan, const std::string& frame, uint64_t time_ns) {
  JsonWriter json;
  json.open('{');
  write_time(json, "timestamp", time_ns);
  json.member("frame_id", frame);
  write_pose(json, Pose{});
  const double first = scan.rad0,
               last = first + std::max(0, scan.nranges - 1) * static_cast<double>(scan.radstep);
  json.name("start_angle").raw(json_number(first)).name("end_angle").raw(json_number(last));
  write_numbers(json, "ranges", scan.ranges);
  write_numbers(json, "intensities", scan.intensities);
  json.close('}');
  return json.text();
}

std::string image_json(const image_t& image, const char* encoding, const std::string& frame,
                       uint64_t time_ns) {
  JsonWriter json;
  json.open('{');
  write_time(json, "timestamp", time_ns);
  json.member("frame_id", frame);
  if (encoding) {
    json.member("width", image.width).member("height", image.height).member("encoding", encoding);
    json.member("step", image.row_stride > 0 || image.height < 1 ? image.row_stride
                                                                 : image.size / image.height);
  } else {
    json.member("format", "jpeg");
  }
  json.member("data", base64(image.data)).close('}');
  return json.text();
}

std::string camera_json(const camera_info_t& camera, const std::string& frame, uint64_t time_ns) {
  JsonWriter json;
  json.open('{');
  write_time(json, "timestamp", time_ns);
  json.member("frame_id", frame)
      .member("width", camera.width)
      .member("height", camera.height)
      .member("distortion_model", "plumb_bob");
  const auto [fx, fy, cx, cy] = std::array{camera.fx, camera.fy, camera.cx, camera.cy};
  write_numbers(json, "D", camera.distortion);
  write_numbers(json, "K", std::array{fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0});
  write_numbers(json, "R", std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  write_numbers(json, "P", std::array{fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  json.close('}');
  return json.text();
}

std::string pose_json(const Pose& X, const std::string& frame, uint64_t time_ns) {
  JsonWriter json;
  json.open('{');
  write_time(json, "timestamp", time_ns);
  json.member("frame_id", frame);
  write_pose(json, X);
  json.close('}');
  return json.text();
}

std::string location_json(const navsat_t& navsat, const std::string& frame, uint64_t time_ns) {
  constexpr int kCovarianceUnknown = 0;
  JsonWriter json;
  json.open('{');
  write_time(json, "timestamp", time_ns);
  json.member("frame_id", frame)
      .member("latitude", navsat.latitude_deg)
      .member("longitude", navsat.longitude_deg)
      .member("altitude", navsat.altitude);
  write_numbers(json, "position_covariance", std::array<double, 9>{});
  json.member("position_covariance_type", kCovarianceUnknown).close('}');
  return json.text();
}

// A part of a link as a list of triangles in the body's frame, or the world's.
void write_part(JsonWriter& json, const scene::RenderContent& content,
                const scene::RenderPart& part, bool many, const Pose& X_BL) {
  const scene::Batch& batch = content.batches[many ? part.small_batch : part.batch];
  const scene::RenderMesh& mesh = content.meshes[batch.mesh];
  const scene::Affine M = scene::compose(scene::to_affine(X_BL), part.M_LP);
  std::map<uint32_t, size_t> places;  // of vertices among the points
  std::vector<uint32_t> vertices;
  std::vector<size_t> corners;
  for (uint32_t i = batch.first_index; i < batch.first_index + batch.index_count; ++i) {
    const auto [at, fresh] = places.try_emplace(mesh.indices[i], vertices.size());
    if (fresh) vertices.push_back(mesh.indices[i]);
    corners.push_back(at->second);
  }
  json.open('{');
  write_pose(json, Pose{});
  json.name("points").open('[');
  for (const uint32_t vertex : vertices) {
    const auto& p = mesh.vertices[vertex].position;
    write_point(json, M.leftCols<3>() * Vec3(p[0], p[1], p[2]) + M.col(3));
  }
  json.close(']');
  json.name("color");
  write_color(json, part.diffuse.data());
  json.name("colors").open('[').close(']').name("indices").open('[');
  for (const size_t corner : corners) json.value(static_cast<int64_t>(corner));
  json.close(']').close('}');
}

}  // namespace

uint16_t FoxgloveExport::channel(const std::string& topic, const std::string& name,
                                 const std::string& schema) {
  const auto [known, fresh] = schemas_.try_emplace(name);
  if (fresh) known->second = out_.add_schema(name, schema);
  const auto [at, first] = channels_.try_emplace(topic + '\n' + name);
  if (first) at->second = out_.add_channel(known->second, topic);
  return at->second;
}

void FoxgloveExport::send(const std::string& topic, const Type& type, uint64_t time_ns,
                          const std::string& json) {
  out_.add_message(channel(topic, type.name, type.schema), time_ns, json, "");
}

void FoxgloveExport::begin_scene(const run::LogWorlds::Scene& scene, uint64_t time_ns) {
  device_of_channel_.clear();
  bodies_.clear();
  body_names_.clear();
  for (const std::vector<uint8_t>& bytes : scene.info) {
    world_info_t part;
    if (decode_checked(bytes.data(), bytes.size(), part) != DecodeFault::none) continue;
    for (const body_info_t& body : part.bodies) {
      if (body.index < 0) continue;
      bodies_[body.index] = body.name;
      body_names_.insert(body.name);
    }
    for (const channel_info_t& channel : part.channels) {
      if (!channel.device.empty())
        device_of_channel_[channel.name] = channel.robot + "/" + channel.device;
    }
  }
  if (!scene.world) return;
  send_frames(scene, time_ns);
  send_scene(*scene.world, time_ns);
}

std::string FoxgloveExport::device_frame(const std::string& channel) const {
  const auto known = device_of_channel_.find(channel);
  const std::string name = known == device_of_channel_.end() ? channel : known->second;
  return body_names_.contains(name) ? name + "/device" : name;
}

void FoxgloveExport::send_frames(const run::LogWorlds::Scene& scene, uint64_t time_ns) {
  const world::BodyLayout layout(*scene.world);
  JsonWriter json;
  json.open('{').name("transforms").open('[');
  for (const world::RobotPlacement& robot : layout.robots) {
    const world::ModelInstance& instance = scene.world->models[robot.instance];
    if (instance.removed) continue;
    const world::BodyPlacement* body = robot.body.valid() ? &layout.bodies[robot.body] : nullptr;
    write_frame(json, time_ns, body ? body->name : "world", instance.name, robot.X_BBase);
    write_frame(json, time_ns, "world", instance.name + "/odom",
                body ? body->X_WB * robot.X_BBase : robot.X_BBase);
  }
  for (const std::vector<uint8_t>& bytes : scene.info) {
    world_info_t part;
    if (decode_checked(bytes.data(), bytes.size(), part) != DecodeFault::none) continue;
    for (const device_info_t& device : part.devices) {
      const std::string frame = device_frame(device.robot + "/" + device.name);
      write_frame(json, time_ns, device.robot, frame, pose_of(device.position, device.orientation));
      if (device.kind == "camera")
        write_frame(json, time_ns, frame, frame + "/optical",
                    Pose{Quat(0.5, -0.5, 0.5, -0.5), Vec3::Zero()});
    }
  }
  json.close(']').close('}');
  send(kFrames, frame_transforms(), time_ns, json.text());
}

// A message for each model, so that none grows without bound.
void FoxgloveExport::send_scene(const world::WorldModel& world, uint64_t time_ns) {
  const world::BodyLayout layout(world);
  const scene::RenderContent content(world, layout);
  IndexedVector<scene::RenderKindIndex, int> links_of_kind(content.link_kinds.size());
  for (const scene::RenderKindIndex kind : content.kind_of_link) {
    if (kind.valid()) ++links_of_kind[kind];
  }
  if (scene_sent_) {
    JsonWriter all;
    all.open('{').name("deletions").open('[').open('{');
    write_time(all, "timestamp", time_ns);
    all.member("type", 1)
        .member("id", "")
        .close('}')
        .close(']')
        .name("entities")
        .open('[')
        .close(']')
        .close('}');
    send(kScene, scene_update(), time_ns, all.text());
  }
  scene_sent_ = true;
  for (size_t m = 0; m < world.models.size(); ++m) {
    const world::ModelInstance& instance = world.models[m];
    if (instance.removed) continue;
    JsonWriter json;
    json.open('{').name("deletions").open('[').close(']').name("entities").open('[');
    for (size_t k = 0; k < instance.model->links.size(); ++k) {
      const size_t link = static_cast<size_t>(layout.first_link[m]) + k;
      const world::LinkPlacement& placement = layout.links[link];
      const scene::RenderKindIndex kind = content.kind_of_link[link];
      if (!kind.valid()) continue;
      json.open('{');
      write_time(json, "timestamp", time_ns);
      json.member("frame_id", placement.body.valid() ? layout.bodies[placement.body].name
                                                     : std::string("world"));
      json.member("id", instance.name + "/" + instance.model->links[k].name);
      write_time(json, "lifetime", 0);
      json.member("frame_locked", true).name("triangles").open('[');
      for (const scene::RenderPart& part : content.link_kinds[kind].parts)
        write_part(json, content, part, links_of_kind[kind] > kManyLinks, placement.X_BL);
      json.close(']').close('}');
    }
    json.close(']').close('}');
    send(kScene, scene_update(), time_ns, json.text());
  }
}

FoxgloveExport::Shown FoxgloveExport::show(const planar_lidar_t& scan, const Place& place) {
  send(place.channel, laser_scan(), place.time_ns,
       scan_json(scan, device_frame(place.channel), place.time_ns));
  return Shown::wholly;
}

FoxgloveExport::Shown FoxgloveExport::show(const image_t& image, const Place& place) {
  const char* encoding = encoding_of(image.pixelformat);
  if (!encoding && image.pixelformat != image_t::PIXEL_FORMAT_MJPEG) return Shown::no;
  const std::string frame = device_frame(place.channel) + "/optical";
  send(place.channel, encoding ? raw_image() : compressed_image(), place.time_ns,
       image_json(image, encoding, frame, place.time_ns));
  return Shown::wholly;
}

FoxgloveExport::Shown FoxgloveExport::show(const camera_info_t& camera, const Place& place) {
  send(place.channel, camera_calibration(), place.time_ns,
       camera_json(camera, device_frame(place.channel) + "/optical", place.time_ns));
  return Shown::wholly;
}

FoxgloveExport::Shown FoxgloveExport::show(const pose_t& pose, const Place& place) {
  send(place.channel, pose_in_frame(), place.time_ns,
       pose_json(pose_of(pose.pos, pose.orientation), "world", place.time_ns));
  return Shown::partly;
}

FoxgloveExport::Shown FoxgloveExport::show(const navsat_t& navsat, const Place& place) {
  send(place.channel, location_fix(), place.time_ns,
       location_json(navsat, device_frame(place.channel), place.time_ns));
  return Shown::partly;  // without the velocities
}

FoxgloveExport::Shown FoxgloveExport::show(const odometry_t& odometry, const Place& place) {
  const std::string robot = place.channel.substr(0, place.channel.find('/'));
  const Pose X{Quat(math::cos(odometry.theta / 2), 0, 0, math::sin(odometry.theta / 2)),
               Vec3(odometry.x, odometry.y, 0)};
  send(place.channel, pose_in_frame(), place.time_ns, pose_json(X, robot + "/odom", place.time_ns));
  return Shown::partly;
}

FoxgloveExport::Shown FoxgloveExport::show(const world_state_t& state, const Place& place) {
  JsonWriter json;
  json.open('{').name("transforms").open('[');
  for (size_t i = 0; i < state.index.size(); ++i) {
    const auto known = bodies_.find(state.index[i]);
    const std::string name =
        known == bodies_.end() ? fmt::format("body_{}", state.index[i]) : known->second;
    write_frame(json, place.time_ns, "world", name,
                pose_of(state.position[i].data(), state.orientation[i].data()));
  }
  json.close(']').close('}');
  send(place.channel, frame_transforms(), place.time_ns, json.text());
  return Shown::wholly;
}

FoxgloveExport::Shown FoxgloveExport::convert(const Place& place,
                                              std::span<const uint8_t> message) {
  const int64_t fingerprint = fingerprint_of(message);
  Shown shown = Shown::no;
  const auto is = [&]<typename Type>(Type read) {
    if (fingerprint != Type::getHash()) return false;
    if (decode_checked(message.data(), message.size(), read) == DecodeFault::none)
      shown = show(read, place);
    return true;
  };
  static_cast<void>(is(planar_lidar_t()) || is(image_t()) || is(camera_info_t()) || is(pose_t()) ||
                    is(navsat_t()) || is(odometry_t()) || is(world_state_t()));
  return shown;
}

bool FoxgloveExport::add_drawn(uint64_t time_ns, std::span<const uint8_t> message) {
  const auto markers = engine::markers_in(message);
  if (!markers) return false;
  const Type& type = scene_update();
  out_.add_message(channel(kMarkersChannel, type.name, type.schema), time_ns,
                   markers_json(*markers, time_ns), markers->layer);
  return true;
}

void FoxgloveExport::add(const std::string& name, uint64_t time_ns,
                         std::span<const uint8_t> message) {
  const std::string topic = printable(name);
  if (add_drawn(time_ns, message) && fingerprint_of(message) == markers_t::getHash()) return;
  if (!out_.wants(topic)) return;
  const Shown shown = convert({topic, time_ns}, message);
  if (shown == Shown::wholly) return;
  const Schema* schema = find_schema(fingerprint_of(message));
  const std::string json = schema ? json_message(*schema, message) : "";
  if (json.empty()) {
    ++left_out_;
    return;
  }
  // The fields that Foxglove's type lacks.
  const std::string own = shown == Shown::partly ? topic + "/values" : topic;
  out_.add_message(channel(own, "ruedo." + schema->name, json_schema(*schema)), time_ns, json, "");
}

}  // namespace ruedo::foxglove
