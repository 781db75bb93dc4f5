// A robot's collisions, on ROBOT/collisions: not a sensor of the robot, but information for
// programs. The end of a touch is reported with the next sample, so that a trembling contact does
// not flood the channel.
#include <algorithm>
#include <vector>

#include "ruedo/bound.h"
#include "ruedo/collisions_t.hpp"
#include "ruedo/sensor.h"
#include "sensors/contact_points.h"
#include "world/model/body_layout.h"

namespace ruedo {
namespace {

class Collisions : public SensorOf<Collisions> {
 public:
  explicit Collisions(const SensorSetup& setup)
      : world_(setup.world),
        layout_(setup.layout),
        robot_(setup.robot_index),
        channel_(setup.channel<collisions_t>()) {
    touched_.reserve(kUsual);
    told_.reserve(kUsual);
    points_.reserve(4 * kUsual);
    message_.points.resize(4 * kUsual);
  }

  bool observes() const override { return true; }

  void observe(const Snapshot& now, Outbox& out) override {
    const LinkIndex blocked_by = now.robots[robot_].motion.blocked_by;
    if (now.collisions.empty() && blocked_by == blocked_by_) return;
    const bool news = gather(now) || blocked_by != blocked_by_;
    blocked_by_ = blocked_by;
    if (news && now.step > 0) show(now, out);  // the initial state is a sample anyway
  }

  void shift_time(SimTime) override { shown_step_ = -1; }

  void sample(const SampleInput& input, Outbox& out) override {
    if (input.snapshot.step != shown_step_) show(input.snapshot, out);
  }

  void exchange(StateArchive& archive) {
    archive(blocked_by_, touched_, points_, told_, shown_step_);
  }

 private:
  // Capacity for links touched between two messages, with four points each.
  static constexpr size_t kUsual = 8;

  struct Touched {
    LinkIndex link;  // the other link
    int64_t step;
  };
  struct Point {
    LinkIndex link;
    Contact contact;
    bool as_a;
    void exchange(StateArchive& archive) { archive(link, contact, as_a); }
  };

  // Records what is touched. True if some of it was not in the last message.
  bool gather(const Snapshot& now) {
    const auto own =
        std::equal_range(now.collisions.begin(), now.collisions.end(), Collision{robot_, {}, true},
                         [](const Collision& a, const Collision& b) { return a.robot < b.robot; });
    bool news = false;
    for (auto each = own.first; each != own.second; ++each) {
      const Contact& contact = now.contacts[each->contact];
      const LinkIndex link = each->as_a ? contact.link_b : contact.link_a;
      auto known = std::find_if(touched_.begin(), touched_.end(),
                                [link](const Touched& one) { return one.link == link; });
      if (known == touched_.end()) {
        known = touched_.insert(known, {link, now.step});
        news |= std::find(told_.begin(), told_.end(), link) == told_.end();
      }
      if (known->step != now.step)
        std::erase_if(points_, [link](const Point& point) { return point.link == link; });
      known->step = now.step;
      points_.push_back({link, contact, each->as_a});
    }
    return news;
  }

  void show(const Snapshot& now, Outbox& out) {
    shown_step_ = now.step;
    message_.utime = now.time;
    message_.blocked_by = world::body_name(world_, layout_, blocked_by_);
    message_.n = static_cast<int32_t>(points_.size());
    if (message_.points.size() < points_.size()) message_.points.resize(points_.size());
    told_.clear();
    auto next = message_.points.begin();  // keeps its capacity: the first n count
    for (const Touched& touched : touched_) {
      told_.push_back(touched.link);
      for (const Point& point : points_) {
        if (point.link == touched.link) put(point.contact, point.as_a, world_, layout_, *next++);
      }
    }
    touched_.clear();
    points_.clear();
    out.publish(channel_, message_);
  }

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  RobotIndex robot_;
  int channel_;
  LinkIndex blocked_by_;
  std::vector<Touched> touched_;  // since the last message, in order of occurrence
  std::vector<Point> points_;     // for each, at the last step with contact
  std::vector<LinkIndex> told_;   // links in the last message
  int64_t shown_step_ = -1;
  collisions_t message_;
};

const RegisterSensor kRegister{
    {.module = "odometry",
     .order = 1,
     .types = {},
     .attach_to = "robot",
     .device_name = "collisions",
     .default_rate = {10, 1},
     .make = [](const SensorSetup& setup) { return std::make_unique<Collisions>(setup); },
     .kind = "collisions"}};

}  // namespace
}  // namespace ruedo
