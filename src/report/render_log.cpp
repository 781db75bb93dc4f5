// Frame by frame: the scene of its moment, its bodies between the state before and the next one,
// drawn, and handed to the video.
#include "report/render_log.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "base/progress.h"
#include "base/whole.h"
#include "log/index.h"
#include "report/drawn_markers.h"
#include "report/render_devices.h"
#include "report/render_view.h"
#include "report/video.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/world_state_t.hpp"
#include "run/repeat/log_worlds.h"
#include "scene/pictures/overview.h"
#include "scene/pictures/render_scene.h"
#include "system/to_stderr.h"

namespace ruedo::report {
namespace {

constexpr Size kDefaultSize{1280, 720};
constexpr int kMostSide = 3840, kMostFrames = 100'000;
constexpr uint32_t kMostMessage = 1u << 20;
constexpr int kMostParts = 256;
constexpr int32_t kMostBodies = 20'000'000;  // of a state that is not trusted
constexpr double kJump_m = 1.5;      // farther between two states is a new place, and no motion
constexpr double kFollowed_m = 5.0;  // from a robot that is followed

// The states of a log: where each body is at any moment.
class States {
 public:
  States(const log::Index& index, const std::string& path) : reader_(path) {
    for (const log::Index::Channel& channel : index.channels()) {
      if (channel.fingerprint == world_state_t::getHash()) channel_ = &channel;
    }
    if (channel_ == nullptr)
      throw InputError({path}, "has no ruedo/world: without it nothing is known to be drawn");
  }

  // Bodies that are not in the states stay as they are in the snapshot.
  void show(SimTime time_us, Snapshot& snapshot) {
    const size_t count = std::max<size_t>(channel_->places.count_until(time_us), 1);
    if (count != count_) {
      const bool next = count == next_ && !after_.empty();
      before_ = next ? std::exchange(after_, {}) : state(count);
      // All parts of the next one have one time.
      next_ = count < channel_->places.size()
                  ? channel_->places.count_until(channel_->places[count].time_us)
                  : 0;
      after_ = state(next_);
      count_ = count;
    }
    const SimTime from = channel_->places[count - 1].time_us;
    const SimTime to = count < channel_->places.size() ? channel_->places[count].time_us : from;
    const double share =
        to > from ? std::clamp(static_cast<double>(time_us - from) / static_cast<double>(to - from),
                               0.0, 1.0)
                  : 0.0;
    for (size_t body = 0; body < std::min(before_.size(), snapshot.bodies.size()); ++body) {
      if (!before_[body]) continue;
      Pose pose = *before_[body];
      const bool moves = body < after_.size() && after_[body] &&
                         (after_[body]->translation - pose.translation).norm() < kJump_m;
      if (moves) {
        pose.translation += share * (after_[body]->translation - pose.translation);
        pose.rotation = pose.rotation.slerp(share, after_[body]->rotation);
      }
      snapshot.bodies[body] = pose;
    }
  }

 private:
  using State = std::vector<std::optional<Pose>>;

  // The one that ends with so many messages; empty for none.
  State state(size_t count) {
    State found;
    for (int parts = 0; count > 0 && parts < kMostParts; --count, ++parts) {
      const log::Place entry = channel_->places[count - 1];
      if (entry.size > kMostMessage) break;
      reader_.seek(entry.offset);
      world_state_t part;
      if (!reader_.next(event_) ||
          decode_checked(event_.data.data(), event_.data.size(), part) != DecodeFault::none)
        break;
      add(part, found);
      if (part.part == 0) break;
    }
    return found;
  }

  static void add(const world_state_t& part, State& state) {
    for (size_t i = 0; i < part.index.size(); ++i) {
      if (part.index[i] < 0 || part.index[i] >= kMostBodies) continue;
      const auto body = static_cast<size_t>(part.index[i]);
      if (body >= state.size()) state.resize(body + 1);
      const auto& p = part.position[i];
      const auto& q = part.orientation[i];
      state[body] = Pose{Quat(q[0], q[1], q[2], q[3]), Vec3(p[0], p[1], p[2])}.normalized();
    }
  }

  const log::Index::Channel* channel_ = nullptr;
  log::Reader reader_;
  log::Event event_;
  size_t count_ = 0, next_ = 0;  // messages up to the state before, and to the next
  State before_, after_;
};

// A world of the log, and what draws it.
class Scene {
 public:
  Scene(const std::shared_ptr<const world::WorldModel>& world, const VideoArguments& arguments,
        Size size)
      : world_(without_roof(world, arguments.view)),
        layout_(*world_),
        renderer_(scene::make_renderer(*world_, layout_)),
        snapshot_(initial_snapshot(layout_)) {
    Vec3 sunlight(1, 1, -1);
    for (const world::Light& light : world_->lights) {
      if (light.type != world::Light::Type::directional) continue;
      sunlight = light.pose.rotation * light.direction;
      break;
    }
    scene::Bounds bounds = scene::overview(*world_).shown;
    robot_ = robot_of(arguments.follow);
    if (robot_.valid())
      bounds = {Vec3::Constant(-0.5 * kFollowed_m), Vec3::Constant(0.5 * kFollowed_m)};
    view_ = parse_view(arguments.view, size, bounds, sunlight);
    placed_ = arguments.view != "top" && arguments.view != "iso";
    view_.samples = 4;
  }

  cv::Mat draw(States& states, DrawnMarkers& drawn, SimTime time_us) {
    states.show(time_us, snapshot_);
    scene::View view = view_;
    if (robot_.valid()) view.X_WCamera = followed() * view_.X_WCamera;
    facets_.clear();
    for (const auto& [layer, markers] : drawn.at(time_us)) {
      const RobotIndex robot = find_robot(markers.frame);
      if (!markers.frame.empty() && !robot.valid()) continue;
      add_facets(markers, robot.valid() ? base_of(robot) : Pose{}, view, facets_);
    }
    renderer_->draw(snapshot_, view, picture_, {.facets = facets_});
    const cv::Mat rgb(view.height, view.width, CV_8UC3, picture_.rgb.data());
    cv::Mat bgr;
    cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
    return bgr;
  }

 private:
  // From outside a roof would hide what is in the rooms.
  static std::shared_ptr<const world::WorldModel> without_roof(
      const std::shared_ptr<const world::WorldModel>& world, const std::string& view) {
    const bool from_outside = view == "top" || view == "iso";
    const auto height = from_outside ? scene::overview(*world).ceiling : std::nullopt;
    return height ? scene::without_what_is_above(*world, *height) : world;
  }

  const std::string& name_of(RobotIndex robot) const {
    return world_->models[layout_.robots[robot].instance].name;
  }
  // Invalid: unknown name.
  RobotIndex find_robot(const std::string& name) const {
    for (const RobotIndex robot : layout_.robots.indices()) {
      if (name_of(robot) == name) return robot;
    }
    return {};
  }

  RobotIndex robot_of(const std::string& name) const {
    if (const RobotIndex robot = find_robot(name); name.empty() || robot.valid()) return robot;
    std::vector<std::string> names;
    for (const RobotIndex robot : layout_.robots.indices()) names.push_back(name_of(robot));
    const std::string near = nearest_word(name, names);
    throw InputError({}, "--follow " + name + ": there is no such robot" +
                             (near.empty() ? "" : "; did you mean " + near + "?"));
  }

  Pose base_of(RobotIndex index) const {
    const world::RobotPlacement& robot = layout_.robots[index];
    return robot.body.valid() ? snapshot_.bodies[robot.body] * robot.X_BBase : robot.X_BBase;
  }

  // Where the robot is that is followed; seen from top or iso without its heading.
  Pose followed() const {
    const Pose base = base_of(robot_);
    const double yaw = placed_ ? heading(base.rotation) : 0.0;
    return Pose::from_xyz_rpy(base.translation, {0, 0, yaw});
  }

  std::shared_ptr<const world::WorldModel> world_;
  world::BodyLayout layout_;
  std::unique_ptr<scene::Renderer> renderer_;
  Snapshot snapshot_;
  scene::View view_;
  scene::Picture picture_;
  std::vector<scene::Facet> facets_;  // what clients drew
  RobotIndex robot_;
  bool placed_ = false;
};

Size size_of(const std::string& text) {
  const Size size = text.empty() ? kDefaultSize : parse_size(text);
  if (size.width % 2 != 0 || size.height % 2 != 0 || std::max(size.width, size.height) > kMostSide)
    throw InputError({}, fmt::format("--size {}: a video's sides are even, and {} pixels at most",
                                     text, kMostSide));
  return size;
}

// The times of the first frame and behind the last.
std::pair<SimTime, SimTime> times_of(const VideoArguments& arguments, const log::Index& index) {
  const SimTime begin = index.begin_us(), end = index.end_us();
  const double length_s = static_cast<double>(end - begin) * 1e-6;
  const auto time_of = [&](const char* option, double value_s) {
    if (!(value_s >= 0.0 && value_s <= length_s))
      throw InputError({arguments.log},
                       fmt::format("{} {:g}: the log has 0 to {:g} s", option, value_s, length_s));
    return begin + microseconds(value_s);
  };
  const SimTime from = arguments.from_s ? time_of("--from", *arguments.from_s) : begin;
  const SimTime to = arguments.to_s ? time_of("--to", *arguments.to_s) : end;
  if (from >= to && begin < end) throw InputError({}, "--from: it must be before --to");
  return {from, to};
}

int frames_of(const VideoArguments& arguments, SimTime from, SimTime to) {
  const double seconds = static_cast<double>(to - from) * 1e-6 / arguments.rate;
  const double frames = std::floor(seconds * arguments.fps) + 1.0;
  if (frames > kMostFrames)
    throw InputError(
        {arguments.log},
        fmt::format("{:.0f} frames: a video has {} at most; --rate, --fps, --from and --to make "
                    "fewer",
                    frames, kMostFrames));
  return static_cast<int>(frames);
}

}  // namespace

void render_video(const VideoArguments& arguments, const run::LoadRun& load) {
  Video::check_name(arguments.video);
  const Size size = size_of(arguments.size);
  const log::Index index(arguments.log);
  const auto [from, to] = times_of(arguments, index);
  const int frames = frames_of(arguments, from, to);
  const run::LogWorlds worlds(index, load);
  if (!worlds.at(from).world)
    throw InputError({arguments.log}, "its world is not known: " + worlds.fault());
  for (const std::string& fault : {worlds.fault(), index.fault()}) {
    if (!fault.empty()) to_stderr("ruedo: {}: {}\n", arguments.log, fault);
  }
  States states(index, arguments.log);
  DrawnMarkers drawn(index, arguments.log);
  const run::LogWorlds::Scene* shown = &worlds.at(from);
  auto scene = std::make_unique<Scene>(shown->world, arguments, size);
  Video video(arguments.video, {size.width, size.height}, arguments.fps);
  Progress progress("drawing " + arguments.log, frames);
  for (int frame = 0; frame < frames; ++frame) {
    const SimTime time_us =
        std::min(to, from + microseconds(frame * arguments.rate / arguments.fps));
    if (const run::LogWorlds::Scene& now = worlds.at(time_us); &now != shown) {
      shown = &now;
      scene = std::make_unique<Scene>(now.world, arguments, size);
    }
    video.write(scene->draw(states, drawn, time_us));
    progress.to(frame + 1);
  }
  video.close();
  fmt::print("{}: {} frames of {} x {} pixels, {:g} s\n", arguments.video, frames, size.width,
             size.height, frames / arguments.fps);
}

}  // namespace ruedo::report
