// A viewer gets what the simulation's cameras draw: the same tessellation, surfaces and lights.
#include "console/scene_data.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <memory>

#include <opencv2/imgproc.hpp>

#include "base/input_file.h"
#include "base/json.h"
#include "scene/pictures/overview.h"
#include "scene/pictures/render_content.h"
#include "scene/pictures/render_texture.h"
#include "world/mesh/codecs.h"
#include "world/model/body_layout.h"

namespace ruedo::console {
namespace {

constexpr size_t kMostPictureBytes = size_t{32} << 20;  // of a file served unchanged

template <class Number>
void list(JsonWriter& json, const Number* numbers, size_t count) {
  json.open('[');
  for (size_t i = 0; i < count; ++i)
    json.value(static_cast<double>(static_cast<float>(numbers[i])));
  json.close(']');
}

std::array<double, 7> numbers(const Pose& X) {
  const Quat& q = X.rotation;
  return {X.translation.x(), X.translation.y(), X.translation.z(), q.w(), q.x(), q.y(), q.z()};
}

class Blob {
 public:
  template <class Value>
  void add(const Value& value) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof value);
  }
  template <class Value>
  void add(const std::vector<Value>& values) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(values.data());
    bytes_.insert(bytes_.end(), bytes, bytes + values.size() * sizeof(Value));
  }
  http::Bytes take() { return std::make_shared<const std::vector<uint8_t>>(std::move(bytes_)); }

 private:
  std::vector<uint8_t> bytes_;
};

// PNG and JPEG are served as they are; formats that browsers do not know, and pictures larger than
// any screen, are converted to PNG.
Picture picture(const world::Texture& texture) {
  std::vector<uint8_t> bytes = texture.embedded;
  if (!texture.path.empty()) {
    try {
      const std::string file = read_input(texture.path, kMostPictureBytes);
      bytes.assign(file.begin(), file.end());
    } catch (const InputError&) {  // larger, or gone: decoded below, or left out
    }
  }
  const auto begins = [&](const char* magic, size_t size) {
    return bytes.size() > size && std::memcmp(bytes.data(), magic, size) == 0;
  };
  if (bytes.size() < (size_t{4} << 20)) {
    if (begins("\x89PNG", 4))
      return {"image/png", std::make_shared<const std::vector<uint8_t>>(std::move(bytes))};
    if (begins("\xff\xd8\xff", 3))
      return {"image/jpeg", std::make_shared<const std::vector<uint8_t>>(std::move(bytes))};
  }
  const scene::TexturePixels pixels = scene::decode_texture(texture);
  if (pixels.width == 0) return {};
  cv::Mat rgba(pixels.height, pixels.width, CV_8UC4, const_cast<uint8_t*>(pixels.rgba.data())),
      bgra;
  cv::cvtColor(rgba, bgra, cv::COLOR_RGBA2BGRA);
  cv::flip(bgra, bgra, 0);
  std::vector<uint8_t> png;
  world::encode_picture(".png", bgra, png);
  return {"image/png", std::make_shared<const std::vector<uint8_t>>(std::move(png))};
}

void write_light(JsonWriter& json, const scene::RenderLight& light) {
  constexpr const char* kTypes[] = {"directional", "point", "spot"};
  const world::Light& l = light.light;
  const Vec3 direction = l.pose.rotation * l.direction;  // in the world, or in the link
  json.open('{').member("type", kTypes[static_cast<int>(l.type)]).member("link", light.link);
  list(json.name("position"), l.pose.translation.data(), 3);
  list(json.name("direction"), direction.data(), 3);
  list(json.name("colour"), l.diffuse.data(), 3);
  json.member("range", l.range)
      .member("outer_angle", l.outer_angle)
      .member("inner_angle", l.inner_angle);
  json.member("intensity", l.intensity)
      .member("constant", l.constant)
      .member("linear", l.linear)
      .member("quadratic", l.quadratic);
  json.member("shadows", l.cast_shadows).close('}');
}

// fast: it is fixed. body: the one that carries the model; -1: none, and the pose is in the world.
void write_model(JsonWriter& json, const world::ModelInstance& instance,
                 const world::BodyLayout& layout, size_t index) {
  const world::LinkPlacement& first = layout.links[layout.first_link[index]];
  json.open('{')
      .member("name", instance.name)
      .member("first_link", layout.first_link[index])
      .member("links", static_cast<int64_t>(instance.model->links.size()))
      .member("fast", instance.model->is_static)
      .member("robot", instance.is_robot())
      .member("path", instance.model->path != nullptr)
      .member("body", first.body);
  list(json.name("pose"), numbers(first.X_BL * instance.model->links[0].X_ML.inverse()).data(), 7);
  json.close('}');
}

}  // namespace

world::WorldModel collision_shapes(const world::WorldModel& world) {
  constexpr world::Rgba kStanding{0.55f, 0.6f, 0.66f, 1}, kMoving{0.56f, 0.82f, 0.31f, 1};
  world::WorldModel shown = world;
  // only looked up, never iterated
  std::map<const world::Model*, std::shared_ptr<const world::Model>> made;
  for (world::ModelInstance& instance : shown.models) {
    auto& replaced = made[instance.model.get()];
    if (!replaced) {
      auto model = std::make_shared<world::Model>(*instance.model);
      for (world::Link& link : model->links) {
        link.visuals.clear();
        for (const world::Collision& collision : link.collisions) {
          world::Visual& visual = link.visuals.emplace_back();
          visual.name = collision.name;
          visual.X_LV = collision.X_LC;
          visual.geometry = collision.geometry;
          visual.material.emplace().diffuse = model->is_static ? kStanding : kMoving;
        }
      }
      replaced = std::move(model);
    }
    instance.model = replaced;
  }
  return shown;
}

namespace {

http::Bytes write_meshes(JsonWriter& out, const std::vector<scene::RenderMesh>& meshes) {
  Blob blob;
  out.name("meshes").open('[');
  for (const scene::RenderMesh& mesh : meshes) {
    static_assert(sizeof(scene::RenderVertex) == 32);
    out.open('[')
        .value(static_cast<int64_t>(mesh.vertices.size()))
        .value(static_cast<int64_t>(mesh.indices.size()))
        .close(']');
    blob.add(mesh.vertices);
    blob.add(mesh.indices);
  }
  out.close(']');
  return blob.take();
}

void write_batches(JsonWriter& out, const std::vector<scene::Batch>& batches) {
  out.name("batches").open('[');
  for (const scene::Batch& batch : batches) {
    out.open('[')
        .value(batch.mesh)
        .value(int64_t{batch.first_index})
        .value(int64_t{batch.index_count})
        .value(batch.texture)
        .value(int64_t{batch.flags})
        .close(']');
  }
  out.close(']');
}

void write_kinds(JsonWriter& out, const std::vector<scene::RenderLinkKind>& kinds) {
  out.name("kinds").open('[');
  for (const scene::RenderLinkKind& kind : kinds) {
    out.open('[');
    for (const scene::RenderPart& part : kind.parts) {
      out.open('{')
          .member("batch", part.batch)
          .member("small", part.small_batch)
          .member("shadow", part.casts_shadow);
      std::array<double, 12> rows{};  // of [M | t]
      for (int i = 0; i < 12; ++i) rows[i] = part.M_LP(i / 4, i % 4);
      list(out.name("matrix"), rows.data(), 12);
      list(out.name("diffuse"), part.diffuse.data(), 4);
      list(out.name("specular"), part.specular.data(), 4);
      list(out.name("emissive"), part.emissive.data(), 3);
      out.close('}');
    }
    out.close(']');
  }
  out.close(']');
}

// Wheels that are not bodies: link, robot, index among its wheels, a point on the axis, the axis.
void write_wheels(JsonWriter& out, const world::BodyLayout& layout) {
  out.name("wheels").open('[');
  for (const RobotIndex r : layout.robots.indices()) {
    const auto& wheels = layout.robots[r].wheels;
    for (size_t w = 0; w < wheels.size(); ++w) {
      const world::WheelPlacement& wheel = layout.wheels[wheels[w]];
      if (!layout.links[wheel.link].wheel.valid()) continue;
      out.open('[').value(wheel.link).value(r).value(static_cast<int>(w));
      for (int k = 0; k < 3; ++k) out.value(wheel.center_in_L[k]);
      for (int k = 0; k < 3; ++k) out.value(wheel.axis_in_L[k]);
      out.close(']');
    }
  }
  out.close(']');
}

// base_link in its body, or in the world, and its start pose in the world: x, y, z, qw, qx, qy, qz.
void write_bases(JsonWriter& out, const world::WorldModel& world, const world::BodyLayout& layout) {
  out.name("bases").open('[');
  for (const world::RobotPlacement& robot : layout.robots) {
    out.open('{').member("robot", world.models[robot.instance].name).member("body", robot.body);
    const Pose start =
        robot.body.valid() ? layout.bodies[robot.body].X_WB * robot.X_BBase : robot.X_BBase;
    list(out.name("pose"), numbers(robot.X_BBase).data(), 7);
    list(out.name("start"), numbers(start).data(), 7);
    out.close('}');
  }
  out.close(']');
}

// Of robots, as joint_state_t and joint_command_t call them: what it can be moved by, from where to
// where, in rad or m; null: without a limit.
void write_joints(JsonWriter& out, const world::WorldModel& world,
                  const world::BodyLayout& layout) {
  out.name("joints").open('[');
  for (const world::RobotPlacement& robot : layout.robots) {
    const world::ModelInstance& instance = world.models[robot.instance];
    for (const JointIndex j : robot.joints) {
      const world::Joint& joint = instance.model->joints[layout.joints[j].joint];
      out.open('{').member("robot", instance.name).member("name", joint.name);
      out.member("slides", joint.type == world::JointType::prismatic)
          .member("lower", joint.axis.lower)
          .member("upper", joint.axis.upper)
          .close('}');
    }
  }
  out.close(']');
}

// The classes of gz-sim's plugin Label: each with the models that have it, in the order in which
// segmentation cameras number them.
void write_classes(JsonWriter& out, const world::WorldModel& world,
                   const world::BodyLayout& layout) {
  std::map<int, std::vector<InstanceIndex>> classes;
  for (const world::LinkPlacement& link : layout.links) {
    for (const world::Visual& visual :
         world.models[link.instance].model->links[link.link].visuals) {
      std::vector<InstanceIndex>& known = classes[visual.label];
      if (visual.label > 0 && std::find(known.begin(), known.end(), link.instance) == known.end())
        known.push_back(link.instance);
    }
  }
  classes.erase(0);
  out.name("classes").open('[');
  for (const auto& [label, instances] : classes) {
    out.open('[').value(label);
    for (const InstanceIndex instance : instances) out.value(world.models[instance].name);
    out.close(']');
  }
  out.close(']');
}

http::Bytes link_bytes(const world::WorldModel& world, const world::BodyLayout& layout,
                       const scene::RenderContent& content) {
  Blob blob;
  for (const LinkIndex i : layout.links.indices()) {
    const world::LinkPlacement& link = layout.links[i];
    const bool removed = world.models[link.instance].removed;
    blob.add(int32_t{removed ? -1 : content.kind_of_link[i]});  // -1: nothing to draw
    blob.add(int32_t{link.body});
    for (const double value : numbers(link.X_BL)) blob.add(static_cast<float>(value));
  }
  return blob.take();
}

}  // namespace

SceneData::SceneData(const world::WorldModel& world, int version) {
  const world::BodyLayout layout(world);
  const scene::RenderContent content(world, layout);
  JsonWriter out;
  out.open('{')
      .member("version", version)
      .member("world", world.name)
      .member("sky", world.sky.sky)
      .member("shadows", world.sky.shadows);
  list(out.name("ambient"), world.sky.ambient.data(), 3);
  list(out.name("background"), world.sky.background.data(), 3);
  const scene::Overview overview = scene::overview(world);
  list(out.name("low"), overview.shown.low.data(), 3);
  list(out.name("high"), overview.shown.high.data(), 3);
  out.member("floor", overview.floor);
  if (world.viewpoint) list(out.name("viewpoint"), numbers(*world.viewpoint).data(), 7);
  constexpr double kOpen = std::numeric_limits<double>::infinity();  // null in JSON
  out.member("ceiling", overview.ceiling.value_or(kOpen));
  meshes = write_meshes(out, content.meshes);
  out.name("textures").open('[');
  for (const auto& texture : content.textures) {
    pictures.push_back(picture(*texture));
    out.value(pictures.back().bytes != nullptr);
  }
  out.close(']');
  write_batches(out, content.batches);
  write_kinds(out, content.link_kinds);
  out.name("lights").open('[');
  for (const scene::RenderLight& light : content.lights) write_light(out, light);
  out.close(']').name("models").open('[');
  for (size_t i = 0; i < world.models.size(); ++i) write_model(out, world.models[i], layout, i);
  out.close(']');
  write_wheels(out, layout);
  write_bases(out, world, layout);
  write_joints(out, world, layout);
  write_classes(out, world, layout);
  out.close('}');
  json = http::bytes_of(out.text());
  links = link_bytes(world, layout, content);
}

}  // namespace ruedo::console
