// Applies the draws to a copy of the world: settings first, then masses, friction and lights, then
// positions, of the models in world order.
#include "world/randomization.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "base/option_text.h"
#include "ruedo/element.h"
#include "ruedo/errors.h"
#include "ruedo/math.h"
#include "ruedo/random.h"
#include "world/drives/placement.h"
#include "world/load.h"
#include "world/settings.h"

namespace ruedo::world {
namespace {

constexpr const char* kOption = "--randomize";
constexpr const char* kAllowed =
    "it looks like TARGET=uniform(LOW,HIGH), log_uniform(LOW,HIGH), normal(MEAN,STDDEV) or "
    "choice(VALUE,...), and TARGET is MODEL.x, .y, .z, .yaw, .mass or .friction, LIGHT.brightness "
    "or ROBOT/DEVICE.KEY; for example box*.x=uniform(-2,2)";
constexpr int kTries = 100;  // for a free place

const std::map<std::string, Distribution::Kind> kKinds = {
    {"uniform", Distribution::Kind::uniform},
    {"log_uniform", Distribution::Kind::log_uniform},
    {"normal", Distribution::Kind::normal},
    {"choice", Distribution::Kind::choice}};

bool is_place(const std::string& key) {
  return key == "x" || key == "y" || key == "z" || key == "yaw";
}

bool matches(const std::string& pattern, const std::string& name) {
  const size_t star = pattern.find('*');
  if (star == std::string::npos) return pattern == name;
  const std::string head = pattern.substr(0, star), tail = pattern.substr(star + 1);
  return name.size() >= head.size() + tail.size() && name.starts_with(head) && name.ends_with(tail);
}

std::string text_of(const Draw& draw) {
  const auto kind = std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& each) {
    return each.second == draw.distribution.kind;
  });
  return fmt::format("{} {}={}", kOption, draw.target, kind->first);
}

double value_of(const Distribution& distribution, RandomStream stream) {
  const std::vector<double>& p = distribution.parameters;
  switch (distribution.kind) {
    case Distribution::Kind::uniform: return p[0] + (p[1] - p[0]) * stream.uniform();
    case Distribution::Kind::log_uniform: return p[0] * math::pow(p[1] / p[0], stream.uniform());
    case Distribution::Kind::normal: return p[0] + p[1] * stream.gaussian();
    case Distribution::Kind::choice: break;
  }
  const auto n = static_cast<double>(p.size());
  return p[std::min(p.size() - 1, static_cast<size_t>(stream.uniform() * n))];
}

// The model or light of a target, and which of its values.
struct Target {
  std::string name, key;
  bool setting = false;
};

Target target_of(const Draw& draw) {
  const size_t dot = draw.target.rfind('.');
  return {draw.target.substr(0, dot), draw.target.substr(dot + 1),
          draw.target.find('/') != std::string::npos};
}

class Randomizer {
 public:
  Randomizer(const WorldModel& world, uint64_t seed, Drawn* drawn)
      : world_(world), seed_(seed), drawn_(drawn) {}

  std::shared_ptr<const WorldModel> run(const std::vector<Draw>& draws) {
    std::vector<const Draw*> places;
    std::vector<Setting> settings;
    for (const Draw& draw : draws) {
      const Target target = target_of(draw);
      if (target.setting) {
        settings.push_back(
            parse_setting(draw.target + "=" + fmt::format("{}", drawn(draw, draw.target))));
      } else if (is_place(target.key)) {
        places.push_back(&draw);
      } else if (target.key == "brightness") {
        change_lights(draw, target);
      } else {
        change_models(draw, target);
      }
    }
    apply_settings(settings, world_);
    if (!places.empty()) place(places);
    return std::make_shared<const WorldModel>(std::move(world_));
  }

 private:
  double drawn(const Draw& draw, const std::string& target, uint64_t attempt = 0) const {
    const double value =
        value_of(draw.distribution, RandomSource(seed_, "randomize", target).stream(attempt));
    if (drawn_) {
      const auto known = std::find_if(drawn_->begin(), drawn_->end(),
                                      [&](const auto& each) { return each.first == target; });
      if (known == drawn_->end())
        drawn_->emplace_back(target, value);
      else
        known->second = value;
    }
    return value;
  }

  [[noreturn]] void none(const Draw& draw, const char* what, const Target& target) const {
    std::vector<std::string> names;
    if (target.key == "brightness") {
      for (const Light& light : world_.lights) names.push_back(light.name);
    } else {
      for (const ModelInstance& instance : world_.models) names.push_back(instance.name);
    }
    const std::string near = nearest_word(target.name, names);
    throw InputError({}, fmt::format("{}: there is no {} '{}'{}", text_of(draw), what, target.name,
                                     near.empty() ? "" : "; did you mean '" + near + "'?"));
  }

  double not_negative(const Draw& draw, double value) const {
    if (value >= 0.0 && std::isfinite(value)) return value;
    throw InputError(
        {}, fmt::format("{}: {} was drawn; it must not be negative", text_of(draw), value));
  }

  void change_lights(const Draw& draw, const Target& target) {
    bool any = false;
    for (Light& light : world_.lights) {
      if (!matches(target.name, light.name)) continue;
      any = true;
      light.intensity *= not_negative(draw, drawn(draw, light.name + "." + target.key));
    }
    if (!any) none(draw, "light", target);
  }

  // The models that a draw would change. Throws if there is none.
  std::vector<size_t> models_of(const Draw& draw) const {
    const Target target = target_of(draw);
    std::vector<size_t> models;
    std::string unchanged;
    for (size_t i = 0; i < world_.models.size(); ++i) {
      const ModelInstance& instance = world_.models[i];
      if (!matches(target.name, instance.name)) continue;
      if (is_place(target.key) && instance.model->path) {
        unchanged = fmt::format("the place of '{}' follows from its path", instance.name);
      } else if (target.key == "mass" && (instance.model->is_static || instance.model->path)) {
        unchanged =
            fmt::format("no force moves '{}', so its mass would change nothing", instance.name);
      } else {
        models.push_back(i);
      }
    }
    if (!models.empty()) return models;
    if (unchanged.empty()) none(draw, "model", target);
    throw InputError({}, text_of(draw) + ": " + unchanged);
  }

  void change_models(const Draw& draw, const Target& target) {
    for (const size_t i : models_of(draw)) {
      ModelInstance& instance = world_.models[i];
      const double value = not_negative(draw, drawn(draw, instance.name + "." + target.key));
      auto model = std::make_shared<Model>(*instance.model);
      for (Link& link : model->links) {
        if (target.key == "mass") {
          link.inertial.mass *= value;
          link.inertial.inertia *= value;
        } else {
          for (Collision& collision : link.collisions)
            collision.surface.friction = collision.surface.friction2 = value;
        }
      }
      instance.model = std::move(model);
    }
  }

  void place(const std::vector<const Draw*>& draws) {
    std::vector<std::vector<const Draw*>> of_model(world_.models.size());
    for (const Draw* draw : draws) {
      for (const size_t i : models_of(*draw)) of_model[i].push_back(draw);
    }
    for (const bool robots : {false, true}) {  // obstacles first: robots need free space among them
      for (size_t i = 0; i < world_.models.size(); ++i) {
        if (!of_model[i].empty() && world_.models[i].is_robot() == robots)
          robots ? place_robot(i, of_model) : move(world_.models[i], of_model[i], 0);
      }
    }
  }

  void move(ModelInstance& instance, const std::vector<const Draw*>& draws,
            uint64_t attempt) const {
    for (const Draw* draw : draws) {
      const std::string key = target_of(*draw).key;
      const double value = drawn(*draw, instance.name + "." + key, attempt);
      if (!std::isfinite(value) || std::abs(value) > 1e6)
        throw InputError(
            {}, fmt::format("{}: {} was drawn; allowed are 1e6 at most", text_of(*draw), value));
      if (key == "yaw") {
        instance.X_WM.rotation = Quat(math::cos(0.5 * value), 0.0, 0.0, math::sin(0.5 * value));
      } else {
        instance.X_WM.translation[key[0] - 'x'] = value;
      }
    }
  }

  // Robots that are drawn later are not placed yet.
  void place_robot(size_t index, const std::vector<std::vector<const Draw*>>& of_model) {
    Room room;
    for (size_t i = 0; i < world_.models.size(); ++i) {
      const bool later = !of_model[i].empty() && world_.models[i].is_robot() && i >= index;
      if (!later) room.add(world_.models[i]);
    }
    ModelInstance& robot = world_.models[index];
    for (uint64_t attempt = 0; attempt < kTries; ++attempt) {
      move(robot, of_model[index], attempt);
      if (room.overlapped(*robot.model, robot.X_WM).empty()) return;
    }
    throw InputError({}, fmt::format("{}: no place that is free was found for {} in {} draws",
                                     text_of(*of_model[index].front()), robot.name, kTries));
  }

  WorldModel world_;
  uint64_t seed_;
  Drawn* drawn_;
};

void check(const Draw& draw, const std::string& text) {
  const auto& [kind, p] = draw.distribution;
  using Kind = Distribution::Kind;
  const bool interval = kind == Kind::uniform || kind == Kind::log_uniform;
  if (p.empty() || (kind != Kind::choice && p.size() != 2)) refuse_option(kOption, text, kAllowed);
  if (interval && p[1] < p[0]) refuse_option(kOption, text, "HIGH must not be below LOW");
  if (kind == Kind::log_uniform && p[0] <= 0.0) refuse_option(kOption, text, "LOW must be above 0");
  if (kind == Kind::normal && p[1] < 0.0)
    refuse_option(kOption, text, "STDDEV must not be negative");
  const Target target = target_of(draw);
  if (target.setting || is_place(target.key)) return;
  for (const char* key : {"mass", "friction", "brightness"})
    if (target.key == key) return;
  refuse_option(kOption, text, kAllowed);
}

}  // namespace

Draw parse_draw(const std::string& text) {
  const size_t equals = text.find('='),
               open = text.find('(', equals == std::string::npos ? 0 : equals);
  const size_t dot = text.find('.');
  if (equals == std::string::npos || open == std::string::npos || dot == std::string::npos ||
      dot == 0 || dot + 1 >= equals || !text.ends_with(')'))
    refuse_option(kOption, text, kAllowed);
  const auto kind = kKinds.find(text.substr(equals + 1, open - equals - 1));
  if (kind == kKinds.end()) refuse_option(kOption, text, kAllowed);
  Draw draw{text.substr(0, equals), {kind->second, {}}};
  const std::string_view numbers(text.data() + open + 1, text.size() - open - 2);
  for (size_t begin = 0; begin <= numbers.size();) {
    const size_t end = std::min(numbers.find(',', begin), numbers.size());
    std::string_view number = numbers.substr(begin, end - begin);
    while (number.starts_with(' ')) number.remove_prefix(1);
    draw.distribution.parameters.emplace_back();
    if (!read_number(number, draw.distribution.parameters.back()))
      refuse_option(kOption, text, kAllowed);
    begin = end + 1;
  }
  check(draw, text);
  if (target_of(draw).setting) parse_setting(draw.target + "=0");
  return draw;
}

std::shared_ptr<const WorldModel> randomized(const WorldModel& world,
                                             const std::vector<Draw>& draws, uint64_t seed,
                                             Drawn* drawn) {
  if (drawn) drawn->clear();
  return Randomizer(world, seed, drawn).run(draws);
}

}  // namespace ruedo::world
