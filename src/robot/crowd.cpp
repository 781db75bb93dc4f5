// Forces, paths and goals of people.
#include "robot/crowd.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "base/whole.h"
#include "ruedo/math.h"
#include "world/drives/placement.h"
#include "world/model/bounds.h"

namespace ruedo::robot {

namespace {

using world::Vec2;

constexpr SimTime kTick_us = 10'000;
constexpr double kTick_s = 1e-6 * kTick_us;
// Helbing and Molnar 1995.
constexpr double kRelaxation_s = 0.5, kLookAhead_s = 2.0;
constexpr double kPotential = 2.1, kReachOfThings_m = 0.3;  // m^2/s^2
constexpr double kCosineOfSight = -0.17364817766693033;     // 100 degrees to each side
constexpr double kBehind = 0.5, kFasterThanLiked = 1.3;
// Helbing, Farkas and Vicsek 2000, divided by 80 kg.
constexpr double kKeepsAway_m_s2 = 2000.0 / 80.0, kReach_m = 0.08;
constexpr double kBody = 1.2e5 / 80.0, kSliding = 2.4e5 / 80.0;  // 1/s^2, 1/(m s)

// farther away, forces are below 1e-4 m/s^2
constexpr double kSeesPeople_m = 2.0, kSeesWalls_m = 1.5;
constexpr double kBesideWalls_m = 0.2;  // clearance of paths, from a person's side
constexpr double kAtGoal_m = 0.75;      // for a goal that is a point
constexpr int kLooksEvery = 20;         // ticks between path updates
constexpr int kPlaces = 8;              // wander targets, if the file gives no goal
constexpr double kTurns_m_s = 0.2;      // slower people keep their heading
constexpr double kRoom_m = 0.1;         // free space around a person who reappears
constexpr int kTriesToCome = 8;         // attempts per tick
// obstacles to walk around: within this distance and slower than this
constexpr double kSeesThings_m = 4.0, kStands_m_s = 0.2;
constexpr double kBesideThings_m = 0.2;
constexpr double kAboveFloor_m = 0.1;  // lower things are stepped over

bool is_person(const world::Model& model) {
  return model.path && model.path->name == "ruedo:crowd";
}

Vec2 turned(const Vec2& v, double c, double s) {
  return {c * v.x() - s * v.y(), s * v.x() + c * v.y()};
}

// Repulsion by something at distance vector d (pointing to me) that moves by `way` during the
// look-ahead time: eqs. 3 and 4.
Vec2 repulsion(const Vec2& d, const Vec2& way) {
  const double here = d.norm(), there = (d - way).norm();
  if (here < 1e-9 || there < 1e-9) return Vec2::Zero();
  const double both = here + there, squared = both * both - way.squaredNorm();
  if (squared < 1e-12) return Vec2::Zero();
  const double b = 0.5 * std::sqrt(squared);
  const Vec2 gradient = both / (4.0 * b) * (d / here + (d - way) / there);
  return kPotential / kReachOfThings_m * math::exp(-b / kReachOfThings_m) * gradient;
}

// Influences from outside the field of view count less: eq. 8.
Vec2 as_seen(const Vec2& force, const Vec2& ahead) {
  return ahead.dot(-force) >= force.norm() * kCosineOfSight ? force : Vec2(kBehind * force);
}

// Between two people who overlap by `deep`; n points to me, `slides` is the other's velocity minus
// mine: eq. 2.
Vec2 of_contact(double deep, const Vec2& n, const Vec2& slides) {
  const Vec2 t(-n.y(), n.x());
  // Within a tick, friction can at most stop the sliding.
  const double friction = std::min(kSliding * deep, 0.5 / kTick_s);
  return kBody * deep * n + friction * slides.dot(t) * t;
}

// The same, with the repulsion of people who do not touch: eqs. 2 and 3.
Vec2 of_neighbour(double deep, const Vec2& n, const Vec2& slides) {
  const Vec2 apart = kKeepsAway_m_s2 * math::exp(deep / kReach_m) * n;
  return deep > 0.0 ? Vec2(apart + of_contact(deep, n, slides)) : apart;
}

}  // namespace

namespace {

// The walls, and the paths to the goals in the file.
struct Plan {
  world::FloorPlan walls;
  std::vector<world::Route> routes;

  Plan(const world::WorldModel& world, const world::CrowdDescription& crowd, double floor)
      : walls(world::walls_for(world, crowd, floor)) {
    for (const world::Rect& goal : crowd.goals)
      routes.push_back(walls.route_to(goal, crowd.radius, crowd.radius + kBesideWalls_m));
  }
};

// Shared by all copies of a world: it depends on the file alone, and takes a few tenths of a
// second.
std::shared_ptr<const Plan> plan_for(const world::WorldModel& world,
                                     const world::ModelInstance& first,
                                     const world::CrowdDescription& crowd) {
  using Known = std::map<std::weak_ptr<const Element>, std::weak_ptr<const Plan>,
                         std::owner_less<std::weak_ptr<const Element>>>;
  static std::mutex mutex;
  static Known known;
  const std::lock_guard lock(mutex);
  std::erase_if(known, [](const auto& each) { return each.first.expired(); });
  std::weak_ptr<const Plan>& place = known[first.model->path];
  std::shared_ptr<const Plan> plan = place.lock();
  if (!plan) place = plan = std::make_shared<Plan>(world, crowd, first.X_WM.translation.z());
  return plan;
}

}  // namespace

struct Crowd::Group {
  world::CrowdDescription description;
  double floor = 0.0;
  std::shared_ptr<const Plan> plan;
  Bound<const world::FloorPlan> walls;
  std::vector<world::Rect> goals;
  std::shared_ptr<const std::vector<world::Route>> routes;  // by goal
  RandomSource random;

  uint64_t people = 0;
  const Element* element;

  Group(const world::WorldModel& world, const world::ModelInstance& first, uint64_t seed)
      : description(world::read_crowd(*first.model->path)),
        floor(first.X_WM.translation.z()),
        plan(plan_for(world, first, description)),
        walls(plan->walls),
        goals(description.goals),
        routes(plan, &plan->routes),
        random(seed, description.name, "people"),
        element(first.model->path.get()) {
    if (!goals.empty()) return;
    world::CrowdDescription places = description;
    places.count = kPlaces;
    places.name += "/goals";
    auto ways = std::make_shared<std::vector<world::Route>>();
    for (const Vec2& at : world::places_of(places, walls, {}, seed)) {
      goals.push_back({at, at});
      ways->push_back(walls->route_to(goals.back(), description.radius, clearance()));
    }
    routes = std::move(ways);
  }
  double clearance() const { return description.radius + kBesideWalls_m; }
};

struct Crowd::Person {
  InstanceIndex instance;
  BodyIndex body;
  Bound<Group> group;
  uint64_t number;  // in its group
  Vec2 start = Vec2::Zero();
  Vec2 p = Vec2::Zero(), before = Vec2::Zero();  // m, at the last tick and the one before
  Vec2 v = Vec2::Zero();
  Vec2 next = Vec2::Zero();  // the waypoint to walk to
  double heading = 0.0, heading_before = 0.0;
  double speed = 0.0;  // m/s, preferred speed
  size_t goal = 0;
  bool arrived = false, gone = false, jumped = false;
  uint64_t ticks = 0;

  RandomStream draw(uint64_t purpose) const {
    return group->random.stream((number << 40) + (ticks << 8) + purpose);
  }
};

struct Crowd::Other {
  InstanceIndex instance;
  BodyIndex body;
  bool is_robot;
  Eigen::AlignedBox3d box;  // of its shapes, in the body's frame
  // At this tick:
  Vec2 at = Vec2::Zero(), v = Vec2::Zero();
  double c = 1.0, s = 0.0, low = 0.0, high = 0.0;

  bool is_in_way_of(const world::CrowdDescription& crowd, double floor) const {
    return high > floor + kAboveFloor_m && low < floor + crowd.height &&
           (!is_robot || crowd.avoids_robots);
  }
  Vec2 middle() const { return at + turned(box.center().head<2>(), c, s); }
  Vec2 nearest(const Vec2& p) const {
    const Vec2 in = turned(p - at, c, -s);
    const Vec2 on = in.cwiseMax(box.min().head<2>()).cwiseMin(box.max().head<2>());
    return at + turned(on, c, s);
  }
};

Crowd::Crowd(const world::WorldModel& world, const world::BodyLayout& layout,
             physics::PhysicsWorld& physics, uint64_t seed)
    : world_(world), physics_(physics), seed_(seed), step_us_(world.step_us) {
  gather(layout);
  if (people_.empty()) return;
  std::vector<world::Circle> taken;
  for (const world::ModelInstance& instance : world.models) {
    if (!instance.model->is_static && !is_person(*instance.model))
      taken.push_back(
          {instance.X_WM.translation.head<2>(), world::footprint_radius(*instance.model)});
  }
  size_t first = 0;
  for (const auto& group : groups_) {
    const std::vector<Vec2> places =
        world::places_of(group->description, group->walls, taken, seed_);
    for (size_t i = 0; first + i < people_.size() && &*people_[first + i].group == group.get();
         ++i) {
      people_[first + i].start = places[i];
      taken.push_back({places[i], group->description.radius});
    }
    first += places.size();
  }
  for (Person& person : people_) begin(person);
}

Crowd::~Crowd() = default;

void Crowd::copy_from(const Crowd& other) {
  seed_ = other.seed_;
  thought_ = other.thought_;
  for (size_t i = 0; i < groups_.size(); ++i) *groups_[i] = *other.groups_[i];
  for (size_t i = 0; i < people_.size(); ++i) people_[i] = other.people_[i];
  others_ = other.others_;
}

// Goals and draws follow from the seed.
void Crowd::exchange(StateArchive& archive) {
  archive(thought_);
  for (Person& person : people_) {
    archive(person.p, person.before, person.v, person.next, person.heading, person.heading_before,
            person.speed, person.goal, person.arrived, person.gone, person.jumped, person.ticks);
  }
  for (Other& other : others_) archive(other.at, other.v, other.c, other.s, other.low, other.high);
}

void Crowd::reseed(uint64_t seed) {
  for (const auto& group : groups_) group->random.reseed(seed);
}

void Crowd::gather(const world::BodyLayout& layout) {
  if (std::none_of(world_->models.begin(), world_->models.end(),
                   [](const auto& instance) { return is_person(*instance.model); }))
    return;
  for (const BodyIndex body : layout.bodies.indices()) {
    is_person(*world_->models[layout.bodies[body].instance].model) ? add_person(layout, body)
                                                                   : add_other(layout, body);
  }
}

void Crowd::add(InstanceIndex instance, const world::BodyLayout& layout) {
  if (people_.empty()) return;
  for (const BodyIndex body : layout.bodies.indices()) {
    if (layout.bodies[body].instance == instance) add_other(layout, body);
  }
}

void Crowd::add_other(const world::BodyLayout& layout, BodyIndex body) {
  const world::BodyPlacement& placed = layout.bodies[body];
  const world::ModelInstance& instance = world_->models[placed.instance];
  Other other{placed.instance, body, instance.is_robot(), {}};
  for (const LinkIndex l : placed.links) {
    const world::LinkPlacement& link = layout.links[l];
    for (const world::Collision& collision : instance.model->links[link.link].collisions) {
      const Eigen::AlignedBox3d box = world::bounds(collision.geometry);
      if (box.isEmpty()) continue;
      for (int corner = 0; corner < 8; ++corner)
        other.box.extend(
            link.X_BL *
            (collision.X_LC * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))));
    }
  }
  if (!other.box.isEmpty()) others_.push_back(other);
}

void Crowd::add_person(const world::BodyLayout& layout, BodyIndex body) {
  const InstanceIndex index = layout.bodies[body].instance;
  const world::ModelInstance& instance = world_->models[index];
  const auto known = std::find_if(groups_.begin(), groups_.end(), [&](const auto& group) {
    return group->element == instance.model->path.get();
  });
  if (known == groups_.end()) {
    groups_.push_back(std::make_unique<Group>(world_, instance, seed_));
    people_.push_back({index, body, *groups_.back(), 0});
  } else {
    people_.push_back({index, body, **known, (*known)->people});
  }
  ++people_.back().group->people;
}

void Crowd::begin(Person& person) {
  person.ticks = 0;
  const world::CrowdDescription& crowd = person.group->description;
  RandomStream stream = person.draw(0);
  constexpr double kSlowest = 0.3;  // relative to the mean
  person.speed =
      std::max(kSlowest * crowd.speed, crowd.speed + crowd.speed_deviation * stream.gaussian());
  person.v.setZero();
  person.arrived = false;
  person.goal = 0;
  put(person, person.start);
  if (crowd.goals.empty()) choose_goal(person);
  look_for_way(person);
  const Vec2 ahead = person.next - person.p;
  person.heading = person.heading_before = math::atan2(ahead.y(), ahead.x());
  physics_->set_pose(person.body, {Quat(Eigen::AngleAxisd(person.heading, Vec3::UnitZ())),
                                   {person.p.x(), person.p.y(), person.group->floor}});
}

void Crowd::put(Person& person, const Vec2& at) {
  person.p = person.before = at;
  person.jumped = true;
}

void Crowd::remove(InstanceIndex instance) {
  for (Person& person : people_) person.gone |= person.instance == instance;
  std::erase_if(others_, [&](const Other& other) { return other.instance == instance; });
}

void Crowd::reset(InstanceIndex instance, SimTime now) {
  for (Person& person : people_) {
    if (person.instance != instance || person.gone) continue;
    begin(person);
    thought_ = now;
  }
}

void Crowd::before_step(SimTime now) {
  if (people_.empty()) return;
  for (Person& person : people_) person.jumped = false;
  const SimTime end = now + step_us_;
  while (thought_ < end) think();
  const double part = 1.0 - static_cast<double>(thought_ - end) / kTick_us;
  const double step_s = 1e-6 * static_cast<double>(step_us_);
  for (const Person& person : people_) {
    if (person.gone) continue;
    const Vec2 at = person.before + part * (person.p - person.before);
    const double turn = wrap_angle(person.heading - person.heading_before);
    const Pose X_WB{Quat(Eigen::AngleAxisd(person.heading_before + part * turn, Vec3::UnitZ())),
                    {at.x(), at.y(), person.group->floor}};
    Twist mean;
    if (!person.jumped) {
      const Pose& was = physics_->pose(person.body);
      mean.linear = (X_WB.translation - was.translation) / step_s;
      mean.angular.z() = wrap_angle(heading(X_WB.rotation) - heading(was.rotation)) / step_s;
    }
    physics_->guide(person.body, mean, X_WB);
  }
}

// One tick: all forces are computed from the same state, then everybody moves.
void Crowd::think() {
  see_others();
  sort_into_cells();
  std::vector<Vec2> forces(people_.size(), Vec2::Zero());
  for (size_t i = 0; i < people_.size(); ++i) {
    Person& person = people_[i];
    if (person.gone) continue;
    if (person.ticks % kLooksEvery == person.number % kLooksEvery) look_for_way(person);
    forces[i] = force_on(person, i);
  }
  for (size_t i = 0; i < people_.size(); ++i) {
    Person& person = people_[i];
    if (person.gone) continue;
    ++person.ticks;
    person.before = person.p;
    person.heading_before = person.heading;
    const Vec2 was = person.v;
    person.v += kTick_s * forces[i];
    const double fastest = kFasterThanLiked * person.speed, speed = person.v.norm();
    if (speed > fastest) person.v *= fastest / speed;
    person.p += 0.5 * kTick_s * (was + person.v);
    if (speed > kTurns_m_s) person.heading = math::atan2(person.v.y(), person.v.x());
    choose_goal(person);
  }
  thought_ += kTick_us;
}

void Crowd::see_others() {
  for (Other& other : others_) {
    const Pose& X_WB = physics_->pose(other.body);
    const Eigen::Matrix3d R = X_WB.rotation.toRotationMatrix();
    const double middle = (X_WB * Vec3(other.box.center())).z(),
                 half = 0.5 * R.row(2).cwiseAbs().dot(other.box.sizes());
    other.low = middle - half;
    other.high = middle + half;
    const double yaw = heading(X_WB.rotation);
    other.c = math::cos(yaw);
    other.s = math::sin(yaw);
    other.at = X_WB.translation.head<2>();
    other.v = physics_->twist(other.body).linear.head<2>();
  }
}

void Crowd::sort_into_cells() {
  constexpr double kWidest_m = 500.0;  // people spread farther apart get a grid with larger cells
  Vec2 low = Vec2::Constant(1e9), high = Vec2::Constant(-1e9);
  for (const Person& person : people_) {
    low = low.cwiseMin(person.p);
    high = high.cwiseMax(person.p);
  }
  high = high.cwiseMin(low + Vec2::Constant(kWidest_m));
  cells_from_ = low;
  columns_ = std::max(1, rounded_up<int>((high.x() - low.x()) / kSeesPeople_m));
  rows_ = std::max(1, rounded_up<int>((high.y() - low.y()) / kSeesPeople_m));
  cells_.resize(static_cast<size_t>(columns_) * static_cast<size_t>(rows_));
  for (auto& cell : cells_) cell.clear();
  for (size_t i = 0; i < people_.size(); ++i) {
    if (people_[i].gone) continue;
    const Vec2 at = (people_[i].p - cells_from_) / kSeesPeople_m;
    const int c = std::min(rounded_down<int>(std::min(at.x(), 1e6)), columns_ - 1),
              r = std::min(rounded_down<int>(std::min(at.y(), 1e6)), rows_ - 1);
    cells_[r * columns_ + c].push_back(static_cast<int>(i));
  }
}

Crowd::Vec2 Crowd::force_on(const Person& person, size_t index) const {
  const Vec2 way = person.next - person.p;
  const double far = way.norm();
  const bool walks = !person.arrived && far > 1e-6;
  const Vec2 ahead =
      walks ? Vec2(way / far) : Vec2(math::cos(person.heading), math::sin(person.heading));
  const Vec2 liked = walks ? Vec2(person.speed * ahead) : Vec2(Vec2::Zero());
  Vec2 force = (liked - person.v) / kRelaxation_s + of_people(person, index) +
               of_others(person, ahead) + of_walls(person);
  if (const double sigma = person.group->description.fluctuation; sigma > 0.0) {
    RandomStream stream = person.draw(1);
    const double x = stream.gaussian();
    force += sigma * Vec2(x, stream.gaussian());
  }
  return force;
}

Crowd::Vec2 Crowd::of_people(const Person& person, size_t index) const {
  Vec2 sum = Vec2::Zero();
  const Vec2 at = (person.p - cells_from_) / kSeesPeople_m;
  const int c = std::min(rounded_down<int>(std::min(at.x(), 1e6)), columns_ - 1),
            r = std::min(rounded_down<int>(std::min(at.y(), 1e6)), rows_ - 1);
  for (int row = std::max(0, r - 1); row <= std::min(rows_ - 1, r + 1); ++row) {
    for (int column = std::max(0, c - 1); column <= std::min(columns_ - 1, c + 1); ++column) {
      for (const int i : cells_[row * columns_ + column]) {
        const Person& other = people_[i];
        if (static_cast<size_t>(i) == index || other.group->floor != person.group->floor) continue;
        const Vec2 d = person.p - other.p;
        const double distance = d.norm();
        if (distance > kSeesPeople_m || distance < 1e-9) continue;
        const double deep =
            person.group->description.radius + other.group->description.radius - distance;
        sum += of_neighbour(deep, d / distance, other.v - person.v);
      }
    }
  }
  return sum;
}

// A thing repels like a person at its nearest point, whose centre is one radius behind it.
Crowd::Vec2 Crowd::of_others(const Person& person, const Vec2& ahead) const {
  const world::CrowdDescription& crowd = person.group->description;
  Vec2 sum = Vec2::Zero();
  for (size_t i = 0; i < others_.size();) {
    const InstanceIndex instance = others_[i].instance;
    const Other* near = nullptr;  // nearest of all bodies of a model
    double least = kSeesThings_m;
    Vec2 d = Vec2::Zero();
    for (; i < others_.size() && others_[i].instance == instance; ++i) {
      const Other& other = others_[i];
      if (!other.is_in_way_of(crowd, person.group->floor)) continue;
      const Vec2 away = person.p - other.nearest(person.p);
      if (away.norm() >= least) continue;
      least = away.norm();
      d = away;
      near = &other;
    }
    if (!near) continue;
    const Vec2 n = least > 1e-9                          ? Vec2(d / least)
                   : (person.p - near->at).norm() > 1e-9 ? Vec2((person.p - near->at).normalized())
                                                         : Vec2::UnitX();
    sum += as_seen(repulsion(d + crowd.radius * n, kLookAhead_s * near->v), ahead);
    if (least < crowd.radius) sum += of_contact(crowd.radius - least, n, near->v - person.v);
  }
  return sum;
}

Crowd::Vec2 Crowd::of_walls(const Person& person) const {
  const double radius = person.group->description.radius;
  world::FloorPlan::Near near[2];
  const int count = person.group->walls->nearest(person.p, kSeesWalls_m, near);
  Vec2 sum = Vec2::Zero();
  for (int i = 0; i < count; ++i) {
    const Vec2 d = near[i].inside ? Vec2(near[i].point - person.p) : Vec2(person.p - near[i].point);
    const double distance = d.norm();
    if (distance < 1e-9) continue;
    const double deep = near[i].inside ? radius + distance : radius - distance;
    sum += of_neighbour(deep, d / distance, -person.v);
  }
  return sum;
}

// The next goal, once one is reached.
void Crowd::choose_goal(Person& person) {
  const Group& group = *person.group;
  const world::CrowdDescription& crowd = group.description;
  const bool wanders = crowd.goals.empty();
  if (person.arrived) {
    if (crowd.at_end == world::CrowdDescription::AtEnd::again) come_again(person);
    return;
  }
  const world::Rect& goal = group.goals[person.goal];
  const bool there =
      goal.low == goal.high ? (goal.low - person.p).norm() < kAtGoal_m : goal.has(person.p);
  if (!there && !(wanders && person.ticks == 0)) return;
  if (wanders) {
    const size_t other = static_cast<size_t>(person.draw(2).uniform() * (kPlaces - 1));
    person.goal = (person.goal + 1 + other) % kPlaces;
  } else if (person.goal + 1 < group.goals.size()) {
    ++person.goal;
  } else if (crowd.at_end == world::CrowdDescription::AtEnd::loop && group.goals.size() > 1) {
    person.goal = 0;
  } else {
    person.arrived = true;
    if (crowd.at_end == world::CrowdDescription::AtEnd::again) come_again(person);
    return;
  }
  look_for_way(person);
}

void Crowd::look_for_way(Person& person) {
  const Group& group = *person.group;
  person.next = group.walls->next((*group.routes)[person.goal], group.goals[person.goal], person.p,
                                  group.clearance());
  go_around_what_stands(person);
}

// A waypoint beside the first obstacle on the path, on the nearer side: with forces alone the
// person would stop in front of it.
void Crowd::go_around_what_stands(Person& person) const {
  const world::CrowdDescription& crowd = person.group->description;
  const Vec2 way = person.next - person.p;
  const double far = way.norm();
  if (far < 1e-6) return;
  const Vec2 ahead = way / far, left(-ahead.y(), ahead.x());
  double first = std::min(far, kSeesThings_m);
  for (const Other& other : others_) {
    if (!other.is_in_way_of(crowd, person.group->floor) || other.v.norm() > kStands_m_s) continue;
    const Vec2 to = other.middle() - person.p;
    const double half = 0.5 * (other.box.sizes().head<2>()).norm();  // for any orientation
    const double along = to.dot(ahead), beside = to.dot(left);
    const double needs = half + crowd.radius;
    if (along < 0.0 || along - half > first || std::abs(beside) > needs) continue;
    first = std::max(0.0, along - half);
    const double side = beside > 0.0 ? -1.0 : 1.0;
    person.next = person.p + along * ahead + (beside + side * (needs + kBesideThings_m)) * left;
  }
}

// A free place in the area where they started.
bool Crowd::come_again(Person& person) {
  const Group& group = *person.group;
  const world::CrowdDescription& crowd = group.description;
  const auto is_free = [&](const Vec2& at) {
    world::FloorPlan::Near near[2];
    if (group.walls->nearest(at, crowd.radius, near) > 0) return false;
    for (const Person& other : people_) {
      if (&other != &person && !other.gone &&
          (other.p - at).norm() < other.group->description.radius + crowd.radius + kRoom_m)
        return false;
    }
    return std::none_of(others_.begin(), others_.end(), [&](const Other& other) {
      return (other.nearest(at) - at).norm() < crowd.radius + kRoom_m;
    });
  };
  RandomStream stream = person.draw(3);
  for (int i = 0; i < kTriesToCome; ++i) {
    const double x = stream.uniform(), y = stream.uniform();
    const Vec2 at = crowd.area.low + Vec2(x, y).cwiseProduct(crowd.area.high - crowd.area.low);
    if (!is_free(at)) continue;
    put(person, at);
    person.arrived = false;
    person.goal = 0;
    look_for_way(person);
    const Vec2 ahead = person.next - at;
    if (ahead.norm() > 1e-6) {
      person.heading = person.heading_before = math::atan2(ahead.y(), ahead.x());
      person.v = person.speed * ahead.normalized();
    }
    return true;
  }
  return false;
}

}  // namespace ruedo::robot
