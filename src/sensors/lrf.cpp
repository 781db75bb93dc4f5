// A laser range finder with one layer (planar_lidar_t) or several (lidar_t), on ROBOT/LRF.
// docs/world-files.md lists its elements.
//
// Model: each ray has its own exact range to the collision shapes. A surface with laser reflectance
// rho, of which the fraction m is specular, returns the intensity m_path rho (1 - m)
// cos(incidence), where m_path is the loss at mirrors passed before, both ways. Below kFaintest
// nothing is detected and the specular part, if any, continues. Noise is drawn for every ray, so
// that a ray's hit does not affect another ray's noise; resolution and limits are applied last.
#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "base/math/sincos.h"
#include "base/whole.h"
#include "ruedo/device_info_t.hpp"
#include "ruedo/lidar_t.hpp"
#include "ruedo/math.h"
#include "ruedo/planar_lidar_t.hpp"
#include "sensors/noise.h"
#include "sensors/ray_device.h"

namespace ruedo {
namespace {

using scene::Hit;
using scene::Ray;

constexpr double kFaintest = 0.02;  // fraction of the light; less is not detected
constexpr int kMirrors = 4;         // reflections per ray
constexpr int64_t kMaxRays = 1'000'000;

// One of SDF's <horizontal> and <vertical>: evenly spaced angles, including both ends.
struct Sweep {
  int64_t count = 1;
  double first = 0.0, step = 0.0;  // rad

  Sweep() = default;
  // limit_rad: for the angles; whole_rad: for their span.
  Sweep(const Element& e, int64_t samples_if_absent, double limit_rad, double whole_rad,
        const SensorSetup& setup) {
    const double written = e.number("samples", static_cast<double>(samples_if_absent),
                                    Allowed::between(1, static_cast<double>(kMaxRays)));
    const double samples = std::floor(written);
    const auto repaired = [&](const Element& at, const std::string& text) {
      if (setup.findings)
        setup.findings->repaired(at.source, "sensor " + setup.device + "/" + e.name, text);
    };
    if (samples != written)
      repaired(*e.child("samples"),
               fmt::format("<samples>: {} is not whole; as in Gazebo, it is {}", written, samples));
    const double resolution = e.number("resolution", 1.0, Allowed::positive(quantity::kFactor));
    // Many planar lidars have one layer with a resolution of 0.01: at least one ray, as in Gazebo.
    const double rays = std::max(1.0, std::round(samples * resolution));
    if (rays > static_cast<double>(kMaxRays)) {
      e.fail(
          fmt::format("<samples> times <resolution> is {} rays; allowed: 1 to {}", rays, kMaxRays));
    }
    count = whole(rays);
    double low = e.number("min_angle", 0.0, Allowed::between(-limit_rad, limit_rad));
    double high = e.number("max_angle", 0.0, Allowed::between(-limit_rad, limit_rad));
    if (high < low && e.name != "vertical")
      e.fail(fmt::format("<max_angle> {} is below <min_angle> {}", high, low));
    if (high < low) {  // layers have no direction
      repaired(e,
               fmt::format("<max_angle> {} is below <min_angle> {}; they are swapped", high, low));
      std::swap(low, high);
    }
    constexpr double kOverlap_rad = 0.1;  // -3.15 to 3.15 still counts as a full turn
    if (high - low > whole_rad + kOverlap_rad)
      e.fail("from <min_angle> to <max_angle> is more than a full turn");
    if (count == 1) {
      first = 0.5 * (low + high);  // a single ray is in the middle
    } else {
      first = low;
      step = (high - low) / static_cast<double>(count - 1);
    }
  }
  double angle(int64_t i) const { return first + static_cast<double>(i) * step; }
};

class Lrf : public SensorOf<Lrf> {
 public:
  explicit Lrf(const SensorSetup& setup) : mount_(setup), random_(setup.random) {
    const Element& e = setup.element;
    e.refuse_unknown({"ruedo:own_link", "ruedo:hits", "ruedo:intensities", "ruedo:sweep_time",
                      "ruedo:bearing_noise", "ruedo:phase"});
    const Element* laser = e.child("lidar") ? e.child("lidar") : e.child("ray");
    if (!laser) e.fail("a laser range finder needs a <lidar> (or <ray>) with <scan> and <range>");
    const Element* horizontal = laser->child("scan/horizontal");
    if (!horizontal) laser->fail("needs <scan><horizontal>");
    columns_ = Sweep(*horizontal, 640, 2.0 * M_PI + 1e-3, 2.0 * M_PI, setup);
    if (const Element* vertical = laser->child("scan/vertical"))
      layers_ = Sweep(*vertical, 1, M_PI / 2 + 1e-3, M_PI, setup);
    if (columns_.count * layers_.count > kMaxRays) {
      laser->fail(std::to_string(layers_.count) + " layers of " + std::to_string(columns_.count) +
                  " rays; allowed: " + std::to_string(kMaxRays) + " rays in all");
    }
    read_range(*laser);
    ignored_link_ = e.boolean("ruedo:own_link", false) ? LinkIndex() : setup.link;
    visuals_ = e.choice("ruedo:hits", "collisions", {"collisions", "visuals"}) == "visuals";
    intensities_ = e.boolean("ruedo:intensities", true);
    sweep_us_ = microseconds(e.number("ruedo:sweep_time", 0.0, Allowed::between(0.0, 60.0)));
    bearing_noise_ = e.number("ruedo:bearing_noise", 0.0, Allowed::not_negative(quantity::kAngle));
    noise_ = Noise(laser->child("noise"));
    RandomStream constants = random_.stream(kConstantDraws);
    noise_.draw_bias(constants);
    if (!setup.noise) {  // the ideal value
      noise_ = Noise();
      bearing_noise_ = resolution_ = 0.0;
    }
    prepare(setup);
  }

  bool wants_visual_rays() const override { return visuals_; }

  // The device's motion during the sweep.
  bool observes() const override { return sweep_us_ > 0; }
  void observe(const Snapshot& now, Outbox&) override {
    track_.push_back({now.time, mount_.X_WS(now)});
    while (track_.size() > 2 && track_[1].time <= now.time - sweep_us_)
      track_.erase(track_.begin());
  }

  void shift_time(SimTime us) override {
    for (Place& place : track_) place.time -= us;
    sample_time_ -= us;
  }

  void sample(const SampleInput& input, Outbox& out) override {
    RandomStream stream = random_.stream(static_cast<uint64_t>(input.sample));
    Scratch& scratch = scratch_for(directions_->size());
    aim(input.snapshot, stream, scratch);
    const std::vector<Ray>& rays = scratch.rays;
    input.rays->cast(rays, scratch.hits, ignored_link_);
    const double dt_s =
        sampled_ ? 1e-6 * static_cast<double>(input.snapshot.time - sample_time_) : 0.0;
    sampled_ = true;
    sample_time_ = input.snapshot.time;
    const bool drawn = !noise_.none() && !noise_.wanders();  // one draw per ray, all at once
    if (drawn) stream.gaussians(scratch.draws);
    for (size_t i = 0; i < rays.size(); ++i) {
      const Return back = returned(*input.rays, rays[i], scratch.hits[i]);
      const double measured = drawn ? noise_.apply_draw(back.range, scratch.draws[i])
                                    : noise_.apply(back.range, i == 0 ? dt_s : 0.0, stream);
      const float range = scratch.ranges[i] = report(back.range, measured);
      if (intensities_)
        scratch.intensities[i] = std::isfinite(range) ? static_cast<float>(back.intensity) : 0.0f;
    }
    flat() ? publish(planar_, scratch, input, out) : publish(layered_, scratch, input, out);
  }

  void describe(device_info_t& info) const override {
    info.range_min = min_;
    info.range_max = max_;
    info.fov_horizontal = columns_.step * static_cast<double>(columns_.count - 1);
    info.fov_vertical = layers_.step * static_cast<double>(layers_.count - 1);
    info.width = static_cast<int32_t>(columns_.count);
    info.height = static_cast<int32_t>(layers_.count);
  }

  void exchange(StateArchive& archive) { archive(noise_, track_, sample_time_, sampled_); }

 private:
  struct Return {
    double range = std::numeric_limits<double>::infinity();  // m, along the ray's path
    double intensity = 0.0;                                  // 0 to 1
  };
  struct Place {
    SimTime time;
    Pose X_WS;
    void exchange(StateArchive& archive) { archive(time, X_WS); }
  };

  // Scratch memory of a sample, not read afterwards. It belongs to the thread, not the device:
  // shared by a thousand devices, it stays in the cache.
  struct Scratch {
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::vector<double> draws;  // for the bearings, then for the ranges
    std::vector<float> ranges, intensities;
  };
  Scratch& scratch_for(size_t rays) const {
    thread_local Scratch scratch;
    scratch.rays.resize(rays);
    scratch.hits.resize(rays);
    scratch.draws.resize(rays);
    scratch.ranges.resize(rays);
    scratch.intensities.resize(intensities_ ? rays : 0);
    return scratch;
  }

  template <class Message>
  void publish(Message& message, Scratch& scratch, const SampleInput& input, Outbox& out) const {
    message.utime = input.snapshot.time;
    message.ranges.swap(scratch.ranges);
    message.intensities.swap(scratch.intensities);
    out.publish(channel_, message);
    message.ranges.swap(scratch.ranges);
    message.intensities.swap(scratch.intensities);
  }

  bool flat() const { return layers_.count == 1; }

  void read_range(const Element& laser) {
    const Element* range = laser.child("range");
    if (!range || !range->has("max"))
      laser.fail("needs <range> with <max>, the largest range in m");
    min_ = range->number("min", 0.0, Allowed::not_negative(quantity::kRange));
    max_ = range->number("max", 0.0, Allowed::positive(quantity::kRange));
    if (max_ <= min_) range->fail(fmt::format("<max> {} must be above <min> {}", max_, min_));
    resolution_ = range->number("resolution", 0.0, Allowed::not_negative(quantity::kRange));
  }

  // Precomputes directions in the device's frame, and messages of their final size: nothing grows
  // later.
  void prepare(const SensorSetup& setup) {
    directions_ = shared_directions();
    const size_t n = directions_->size();
    const auto n32 = static_cast<int32_t>(n);
    if (flat()) {
      channel_ = setup.channel<planar_lidar_t>();
      planar_.nranges = n32;
      planar_.nintensities = intensities_ ? n32 : 0;
      planar_.rad0 = static_cast<float>(columns_.first);
      planar_.radstep = static_cast<float>(columns_.step);
    } else {
      channel_ = setup.channel<lidar_t>();
      layered_.nlayers = static_cast<int32_t>(layers_.count);
      layered_.ncolumns = static_cast<int32_t>(columns_.count);
      layered_.nranges = n32;
      layered_.nintensities = intensities_ ? n32 : 0;
      layered_.azimuth0 = static_cast<float>(columns_.first);
      layered_.azimuth_step = static_cast<float>(columns_.step);
      layered_.elevation0 = static_cast<float>(layers_.first);
      layered_.elevation_step = static_cast<float>(layers_.step);
    }
  }

  // Devices with the same angles share an array: copies of a world, and the robots of a fleet.
  std::shared_ptr<const std::vector<Vec3>> shared_directions() const {
    using Key = std::tuple<int64_t, double, double, int64_t, double, double>;
    static std::mutex mutex;
    static std::map<Key, std::weak_ptr<const std::vector<Vec3>>> known;
    const std::lock_guard lock(mutex);
    std::weak_ptr<const std::vector<Vec3>>& place = known[{
        columns_.count, columns_.first, columns_.step, layers_.count, layers_.first, layers_.step}];
    if (auto shared = place.lock()) return shared;
    std::erase_if(
        known, [&](const auto& each) { return &each.second != &place && each.second.expired(); });
    auto directions = std::make_shared<std::vector<Vec3>>();
    directions->reserve(static_cast<size_t>(layers_.count * columns_.count));
    for (int64_t layer = 0; layer < layers_.count; ++layer) {
      const math::SineCosine up = math::sincos(layers_.angle(layer));
      for (int64_t column = 0; column < columns_.count; ++column)
        directions->push_back(direction(up, columns_.angle(column)));
    }
    place = directions;
    return directions;
  }

  static Vec3 direction(const math::SineCosine& up, double azimuth) {
    const math::SineCosine around = math::sincos(azimuth);
    return {up.cosine * around.cosine, up.cosine * around.sine, up.sine};
  }

  // Transforms the rays to the world. All layers of a column share a time.
  void aim(const Snapshot& now, RandomStream& stream, Scratch& scratch) {
    std::vector<Ray>& rays = scratch.rays;
    const std::vector<Vec3>& directions = *directions_;
    for (Ray& ray : rays) ray.max_range = max_;
    Pose X_WS = mount_.X_WS(now);
    Eigen::Matrix3d R_WS = X_WS.rotation.toRotationMatrix();
    if (bearing_noise_ > 0.0) stream.gaussians(scratch.draws);
    if (sweep_us_ == 0 && bearing_noise_ == 0.0) {
      for (size_t i = 0; i < rays.size(); ++i) {
        rays[i].origin = X_WS.translation;
        rays[i].direction = R_WS * directions[i];
      }
      return;
    }
    size_t i = 0;
    for (int64_t layer = 0; layer < layers_.count; ++layer) {
      const math::SineCosine up = math::sincos(layers_.angle(layer));
      for (int64_t column = 0; column < columns_.count; ++column, ++i) {
        if (sweep_us_ > 0 && columns_.count > 1) {
          X_WS = place(now.time - sweep_us_ * (columns_.count - 1 - column) / (columns_.count - 1));
          R_WS = X_WS.rotation.toRotationMatrix();
        }
        rays[i].origin = X_WS.translation;
        rays[i].direction =
            R_WS * (bearing_noise_ > 0.0
                        ? direction(up, columns_.angle(column) + bearing_noise_ * scratch.draws[i])
                        : directions[i]);
      }
    }
  }

  // The device's pose between two steps, interpolated linearly; before the start it was at rest.
  Pose place(SimTime time) const {
    if (time <= track_.front().time) return track_.front().X_WS;
    size_t after = track_.size() - 1;
    while (after > 0 && track_[after - 1].time >= time) --after;
    const Place& b = track_[after];
    if (after == 0 || b.time == time) return b.X_WS;
    const Place& a = track_[after - 1];
    const double part = static_cast<double>(time - a.time) / static_cast<double>(b.time - a.time);
    return {a.X_WS.rotation.slerp(part, b.X_WS.rotation),
            (1.0 - part) * a.X_WS.translation + part * b.X_WS.translation};
  }

  Return returned(const scene::RayScene& scene, const Ray& first, const Hit& first_hit) const {
    Ray ray = first;
    Hit hit = first_hit;
    double way = 0.0, mirrored = 1.0;
    for (int mirrors = 0; hit.hit(); ++mirrors) {
      way += hit.range;
      const world::Surface& surface = mount_.surface(hit, visuals_);
      const double part = mirrored * surface.laser_reflectance * (1.0 - surface.laser_mirror);
      if (part >= kFaintest) return {way, part * std::abs(hit.normal.dot(ray.direction))};
      mirrored *= surface.laser_mirror * surface.laser_mirror;
      if (mirrored < kFaintest || mirrors == kMirrors || hit.range == 0.0) break;
      ray.origin += hit.range * ray.direction +
                    1e-9 * hit.normal;  // off the mirror, so that it is not hit again
      ray.direction -= 2.0 * ray.direction.dot(hit.normal) * hit.normal;
      ray.max_range = max_ - way;
      hit = scene.cast(ray, ignored_link_);
    }
    return {};
  }

  float report(double ideal, double measured) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    if (ideal == std::numeric_limits<double>::infinity()) return kInfinity;
    if (resolution_ > 0.0) measured = std::round(measured / resolution_) * resolution_;
    if (ideal < min_ || measured < min_) return -kInfinity;
    return measured > max_ ? kInfinity : static_cast<float>(measured);
  }

  RayMount mount_;
  RandomSource random_;
  Sweep columns_, layers_;
  double min_ = 0.0, max_ = 0.0, resolution_ = 0.0;  // m
  double bearing_noise_ = 0.0;                       // rad
  Noise noise_;
  LinkIndex ignored_link_;
  bool visuals_ = false, intensities_ = true;
  int64_t sweep_us_ = 0;
  int channel_ = -1;

  std::vector<Place> track_;  // over the duration of the sweep
  SimTime sample_time_ = 0;
  bool sampled_ = false;
  std::shared_ptr<const std::vector<Vec3>> directions_;  // in S, layer by layer
  planar_lidar_t planar_{};
  lidar_t layered_{};
};

std::vector<std::string> settings_of(const std::string& type) {
  const std::string top = type.find("ray") != std::string::npos ? "ray" : "lidar";
  std::vector<std::string> keys = noise_settings(top + ".noise");
  for (const char* plane : {"horizontal", "vertical"}) {
    for (const char* each : {"samples", "resolution", "min_angle", "max_angle"})
      keys.push_back(top + ".scan." + plane + "." + each);
  }
  for (const char* each : {"min", "max", "resolution"})
    keys.push_back(top + ".range." + std::string(each));
  for (const char* each :
       {"own_link", "hits", "intensities", "sweep_time", "bearing_noise", "phase"})
    keys.push_back(std::string("ruedo:") + each);
  return keys;
}

const RegisterSensor kRegister{
    {.module = "lrf",
     .order = 3,
     .types = {"ray", "gpu_ray", "lidar", "gpu_lidar"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {10, 1},
     .needs_rays = true,
     .make = [](const SensorSetup& setup) { return std::make_unique<Lrf>(setup); },
     .settings = settings_of}};

}  // namespace
}  // namespace ruedo
