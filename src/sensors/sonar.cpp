// An array of sonar transducers, on ROBOT/SONAR-ARRAY. docs/world-files.md lists its elements.
//
// Model: a transducer's cone is sampled by rays in a fixed pattern, see cone(). A ray gets an echo
// from a surface with an acoustic reflectance of at least kQuietest, at an incidence up to the
// specular angle. The reading is the average of all rays, where rays without an echo count as the
// maximum range (Hernandez-Belmonte, Ayala-Ramirez, Sanchez-Yanez, ROSSUM 2011), or the nearest
// echo, as in real sonars. It is not below the minimum range, in which a transducer still rings.
// The nearest echo is searched with rays at most a degree apart, and then around the nearest of
// them with decreasing distance. Noise is added to readings with an echo.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/whole.h"
#include "ruedo/device_info_t.hpp"
#include "ruedo/math.h"
#include "ruedo/sonar_t.hpp"
#include "sensors/noise.h"
#include "sensors/ray_device.h"

namespace ruedo {
namespace {

using scene::Hit;
using scene::Ray;

constexpr double kQuietest = 0.05;  // acoustic reflectance; less gives no echo

// Directions of n rays in a cone about x, each representing an equal part of its solid angle: one
// along the axis, the others on K rings, K = round((sqrt(1 + 4 (n - 1) / 3) - 1) / 2) but at least
// 1. The number of rays grows in proportion to the ring's number; the first ray of odd rings is at
// the top, that of even rings half a spacing further. A ring halves the solid angle of its part of
// the cone. Full angles in rad; if they differ, the cone is elliptic and the parts are equal for
// small angles.
std::vector<Vec3> cone(int64_t n, double horizontal_rad, double vertical_rad) {
  std::vector<Vec3> directions{Vec3::UnitX()};
  const int64_t rest = n - 1;
  const int64_t rings = std::max<int64_t>(
      1, rounded((std::sqrt(1.0 + 4.0 * static_cast<double>(rest) / 3.0) - 1.0) / 2.0));
  int64_t placed = 0;
  for (int64_t ring = 1; ring <= rings && rest > 0; ++ring) {
    const int64_t until = rest * ring * (ring + 1) / (rings * (rings + 1));
    const int64_t on_ring = until - placed;
    const double part = (1.0 + 0.5 * static_cast<double>(placed + until)) /
                        static_cast<double>(n);  // inside the ring
    for (int64_t i = 0; i < on_ring; ++i) {
      const double turn = 2.0 * M_PI * (static_cast<double>(i) + (ring % 2 ? 0.0 : 0.5)) /
                          static_cast<double>(on_ring);
      const double left = -0.5 * horizontal_rad * math::sin(turn),
                   up = 0.5 * vertical_rad * math::cos(turn);
      const double edge = math::hypot(left, up);  // rad, from the axis to the cone's edge
      if (edge == 0.0) {
        directions.push_back(Vec3::UnitX());
        continue;
      }
      const double cosine = 1.0 - part * (1.0 - math::cos(edge)),
                   sine = std::sqrt(1.0 - cosine * cosine);
      directions.push_back({cosine, sine * left / edge, sine * up / edge});
    }
    placed = until;
  }
  return directions;
}

constexpr double kApart_rad = M_PI / 180.0;  // spacing of rays in the search for the nearest echo
constexpr double kClosest_rad = 1e-5;        // resolution of the search
constexpr int kMostRounds = 60;
constexpr size_t kAround = 6;  // rays per round

// The number of rays for that spacing in a cone.
int64_t rays_for(double horizontal_rad, double vertical_rad) {
  constexpr int64_t kMost = 2000;  // for cones wider than those of real sonars
  return std::min(kMost, rounded(0.25 * M_PI * std::max(horizontal_rad, kApart_rad) *
                                 std::max(vertical_rad, kApart_rad) / (kApart_rad * kApart_rad)));
}

class Sonar : public SensorOf<Sonar> {
 public:
  explicit Sonar(const SensorSetup& setup)
      : mount_(setup), random_(setup.random), channel_(setup.channel<sonar_t>()) {
    static const Element kNothing;
    const Element& e = setup.element;
    e.refuse_unknown({"ruedo:sonar", "ruedo:phase"});
    const Element* sonar = e.child("sonar");
    if (!sonar) e.fail("needs a <sonar> with <max>, the largest range in m");
    if (!sonar->has("max")) sonar->fail("needs <max>, the largest range in m");
    min_ = sonar->number("min", 0.0, Allowed::not_negative(quantity::kRange));
    max_ = sonar->number("max", 1.0, Allowed::positive(quantity::kRange));
    if (max_ <= min_) sonar->fail(fmt::format("<max> {} must be above <min> {}", max_, min_));
    if (sonar->choice("geometry", "cone", {"cone", "sphere"}) == "sphere" && setup.findings) {
      setup.findings->unsupported(sonar->source, "sensor " + setup.device + "/sonar/geometry",
                                  "a sphere is not supported; a cone instead");
    }
    const double aperture =
        2.0 *
        math::atan(sonar->number("radius", 0.5, Allowed::not_negative(quantity::kRange)) / max_);
    const Element* ours = e.child("ruedo:sonar");
    configure(ours ? *ours : kNothing, aperture, setup);
  }

  // A transducer that fired before the reset of time counts as fired at time 0.
  void shift_time(SimTime us) override {
    for (int64_t& fired : message_.fired_utime)
      fired = fired < 0 ? -1 : std::max<int64_t>(0, fired - us);
  }

  void sample(const SampleInput& input, Outbox& out) override {
    const Pose X_WS = mount_.X_WS(input.snapshot);
    RandomStream stream = random_.stream(static_cast<uint64_t>(input.sample));
    std::fill(message_.fresh.begin(), message_.fresh.end(), 0);
    message_.utime = input.snapshot.time;
    if (all_) {
      for (const int transducer : order_) fire(transducer, X_WS, input, stream);
    } else {
      fire(order_[static_cast<size_t>(input.sample) % order_.size()], X_WS, input, stream);
    }
    out.publish(channel_, message_);
  }

  void describe(device_info_t& info) const override {
    info.range_min = min_;
    info.range_max = max_;
    info.fov_horizontal = horizontal_;
    info.fov_vertical = vertical_;
    info.width = info.nelements = static_cast<int32_t>(transducers_.size());
    info.height = 1;
    info.element_pose.clear();
    for (const Transducer& transducer : transducers_) {
      const Vec3& p = transducer.X_ST.translation;
      const Eigen::Matrix3d R = transducer.X_ST.rotation.toRotationMatrix();
      const double pitch = math::atan2(-R(2, 0), math::hypot(R(0, 0), R(1, 0)));
      info.element_pose.push_back({p.x(), p.y(), p.z(), math::atan2(R(2, 1), R(2, 2)), pitch,
                                   math::atan2(R(1, 0), R(0, 0))});
    }
  }

  void exchange(StateArchive& archive) {
    for (Transducer& transducer : transducers_) archive(transducer.noise);
    archive(message_.range, message_.fired_utime, last_fired_);
  }

 private:
  struct Transducer {
    Pose X_ST;  // x is the cone's axis
    Noise noise;
  };

  void configure(const Element& ours, double aperture, const SensorSetup& setup) {
    ours.refuse_unknown({"ruedo:transducer", "ruedo:horizontal_aperture", "ruedo:vertical_aperture",
                         "ruedo:rays", "ruedo:reading", "ruedo:firing", "ruedo:order",
                         "ruedo:specular_angle", "ruedo:cross_talk"});
    for (const Element* each : ours.all("ruedo:transducer"))
      transducers_.push_back({each->as_pose(), {}});
    if (transducers_.empty()) transducers_.emplace_back();
    const int n = static_cast<int>(transducers_.size());

    const Allowed angle = Allowed::between(0.0, M_PI);
    horizontal_ = ours.number("ruedo:horizontal_aperture", aperture, angle);
    vertical_ = ours.number("ruedo:vertical_aperture", aperture, angle);
    nearest_ = ours.choice("ruedo:reading", "average", {"average", "nearest"}) == "nearest";
    int64_t rays = ours.integer("ruedo:rays", 9, Allowed::between(1, 10000));
    if (nearest_) rays = std::max(rays, rays_for(horizontal_, vertical_));
    const std::vector<Vec3> directions = cone(rays, horizontal_, vertical_);
    for (const Transducer& transducer : transducers_)
      for (const Vec3& direction : directions)
        directions_.push_back(transducer.X_ST.rotation * direction);
    rays_.resize(directions.size());
    hits_.resize(directions.size());
    for (Ray& ray : rays_) ray.max_range = max_;

    all_ = ours.choice("ruedo:firing", "sequence", {"sequence", "all"}) == "all";
    read_order(ours, n);
    const double specular =
        ours.number("ruedo:specular_angle", M_PI / 2, Allowed::between(0.0, M_PI / 2 + 1e-6));
    least_cosine_ = specular >= M_PI / 2 - 1e-9 ? 0.0 : math::cos(specular);
    cross_talk_ =
        setup.noise ? ours.number("ruedo:cross_talk", 0.0, Allowed::between(0.0, 1.0)) : 0.0;
    RandomStream constants = random_.stream(kConstantDraws);
    for (Transducer& transducer : transducers_) {
      transducer.noise = Noise(ours.child("noise"));
      transducer.noise.draw_bias(constants);
      if (!setup.noise) transducer.noise = Noise();
    }

    message_.n = n;
    message_.range.assign(transducers_.size(), static_cast<float>(max_));
    message_.fired_utime.assign(transducers_.size(), -1);
    message_.fresh.assign(transducers_.size(), 0);
  }

  void read_order(const Element& ours, int n) {
    const Element* order = ours.child("ruedo:order");
    if (!order) {
      for (int i = 0; i < n; ++i) order_.push_back(i);
      return;
    }
    std::vector<bool> named(static_cast<size_t>(n), false);
    for (const double index : order->as_numbers(Allowed::any(quantity::kFactor))) {
      if (index != std::floor(index) || index < 0 || index >= n) {
        order->fail("'" + order->text + "': allowed are the transducers' numbers, 0 to " +
                    std::to_string(n - 1));
      }
      order_.push_back(whole<int>(index));
      named[whole<size_t>(index)] = true;
    }
    for (int i = 0; i < n; ++i)
      if (!named[i])
        order->fail("transducer " + std::to_string(i) + " never fires; name every one of 0 to " +
                    std::to_string(n - 1));
  }

  void fire(int index, const Pose& X_WS, const SampleInput& input, RandomStream& stream) {
    const auto i = static_cast<size_t>(index);
    Transducer& transducer = transducers_[i];
    const Vec3 origin = X_WS * transducer.X_ST.translation;
    const Eigen::Matrix3d R_WS = X_WS.rotation.toRotationMatrix();
    for (size_t k = 0; k < rays_.size(); ++k) {
      rays_[k].origin = origin;
      rays_[k].direction = R_WS * directions_[i * rays_.size() + k];
    }
    input.rays->cast(rays_, hits_, mount_.link());

    const bool fired = message_.fired_utime[i] >= 0;
    const double dt_s =
        fired ? 1e-6 * static_cast<double>(input.snapshot.time - message_.fired_utime[i]) : 0.0;
    double range =
        nearest_ ? std::max(search(R_WS * transducer.X_ST.rotation, input), min_) : reading();
    const double measured =
        transducer.noise.apply(range, dt_s, stream);  // drawn with or without an echo
    if (range < max_) range = std::clamp(measured, min_, max_);
    if (cross_talk_ > 0.0) {
      // Crosstalk: the echo of the transducer that fired before counts as this one's own if it
      // arrives first.
      const bool heard = stream.uniform() < cross_talk_;
      if (heard && last_fired_ >= 0 && last_fired_ != index)
        range = std::min(range, static_cast<double>(message_.range[last_fired_]));
    }
    last_fired_ = index;
    message_.range[i] = static_cast<float>(range);
    message_.fired_utime[i] = input.snapshot.time;
    message_.fresh[i] = 1;
  }

  // From the cone's rays, without noise; max_ if there is no echo.
  double reading() const {
    double sum = 0.0, nearest = max_;
    for (size_t k = 0; k < rays_.size(); ++k) {
      const double echo = hears(rays_[k], hits_[k]) ? hits_[k].range : max_;
      sum += echo;
      nearest = std::min(nearest, echo);
    }
    const double range =
        nearest_ || nearest == max_ ? nearest : sum / static_cast<double>(rays_.size());
    return std::max(range, min_);
  }

  // The nearest echo in the cone: a descent from the nearest ray. R_WT: of the transducer, x along
  // the axis.
  double search(const Eigen::Matrix3d& R_WT, const SampleInput& input) {
    double best = max_;
    Vec3 at = Vec3::UnitX();  // in T
    for (size_t k = 0; k < rays_.size(); ++k) {
      if (!hears(rays_[k], hits_[k]) || hits_[k].range >= best) continue;
      best = hits_[k].range;
      at = R_WT.transpose() * rays_[k].direction;
    }
    if (best == max_) return best;
    std::array<Ray, kAround> rays;
    std::array<Hit, kAround> hits;
    double apart = 0.5 * kApart_rad;
    for (int round = 0; round < kMostRounds && apart > kClosest_rad; ++round) {
      for (size_t i = 0; i < kAround; ++i) {
        const double turn = 2.0 * M_PI * static_cast<double>(i) / kAround;
        rays[i].origin = rays_[0].origin;
        rays[i].max_range = max_;
        rays[i].direction =
            R_WT * within_cone(at + apart * Vec3(0.0, math::cos(turn), math::sin(turn)));
      }
      input.rays->cast(rays, hits, mount_.link());
      const double before = best;
      for (size_t i = 0; i < kAround; ++i) {
        if (!hears(rays[i], hits[i]) || hits[i].range >= best) continue;
        best = hits[i].range;
        at = R_WT.transpose() * rays[i].direction;
      }
      if (best == before) apart *= 0.5;
    }
    return best;
  }

  // The direction (T) itself, or its projection onto the cone's edge.
  Vec3 within_cone(const Vec3& direction) const {
    const double a = std::max(0.5 * horizontal_, kClosest_rad),
                 b = std::max(0.5 * vertical_, kClosest_rad);
    const double side = std::sqrt(direction.y() * direction.y() + direction.z() * direction.z());
    if (side == 0.0) return Vec3::UnitX();
    const double y = direction.y() / side, z = direction.z() / side;
    const double angle = std::min(math::atan2(side, direction.x()),
                                  1.0 / std::sqrt(y * y / (a * a) + z * z / (b * b)));
    return {math::cos(angle), math::sin(angle) * y, math::sin(angle) * z};
  }

  bool hears(const Ray& ray, const Hit& hit) const {
    if (!hit.hit() || mount_.surface(hit).acoustic_reflectance < kQuietest) return false;
    return least_cosine_ == 0.0 || -hit.normal.dot(ray.direction) >= least_cosine_;
  }

  RayMount mount_;
  RandomSource random_;
  int channel_;
  double min_ = 0.0, max_ = 0.0;              // m
  double horizontal_ = 0.0, vertical_ = 0.0;  // rad
  std::vector<Transducer> transducers_;
  std::vector<int> order_;
  bool nearest_ = false, all_ = false;
  double least_cosine_ = 0.0;  // of the largest incidence with an echo; 0: any
  double cross_talk_ = 0.0;

  std::vector<Vec3> directions_;  // in S, transducer by transducer
  std::vector<Ray> rays_;         // of one cone
  std::vector<Hit> hits_;
  int last_fired_ = -1;
  sonar_t message_{};
};

std::vector<std::string> settings_of(const std::string&) {
  std::vector<std::string> keys = noise_settings("ruedo:sonar.noise");
  for (const char* each : {"min", "max", "radius", "geometry"})
    keys.push_back(std::string("sonar.") + each);
  for (const char* each : {"horizontal_aperture", "vertical_aperture", "rays", "reading", "firing",
                           "order", "specular_angle", "cross_talk"})
    keys.push_back(std::string("ruedo:sonar.ruedo:") + each);
  return keys;
}

const RegisterSensor kRegister{
    {.module = "sonar",
     .order = 2,
     .types = {"sonar"},
     .attach_to = "",
     .device_name = "",
     .default_rate = {25, 1},
     .needs_rays = true,
     .make = [](const SensorSetup& setup) { return std::make_unique<Sonar>(setup); },
     .settings = settings_of}};

}  // namespace
}  // namespace ruedo
