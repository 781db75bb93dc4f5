// Each service is a reading of its request, a request of the run's own, and a writing of the
// answer.
#include "bridges/ros2/services.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <map>
#include <set>

#include <regex.h>

#include "base/version.h"
#include "bridges/ros2/cdr.h"
#include "bridges/ros2/conversions.h"
#include "engine/outcome.h"
#include "ruedo/decode.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"
#include "ruedo/state_reply_t.hpp"
#include "ruedo/step_request_t.hpp"

namespace ruedo::ros2 {

namespace {

using engine::encoded;

// simulation_interfaces/msg/Result, and what some services add.
constexpr uint8_t kUnsupported = 0, kOk = 1, kNotFound = 2, kIncorrectState = 3, kFailed = 4;
constexpr uint8_t kNameNotUnique = 101, kNameInvalid = 102, kNoResource = 104;
constexpr uint8_t kAlreadyThere = 101;
// EntityCategory
constexpr uint8_t kRobot = 2, kDynamic = 4, kStatic = 5;
constexpr size_t kLongestFilter = 200;
constexpr size_t kLongestWrittenOut = 500;  // what is repeated so often

std::vector<uint8_t> name_body(const std::string& name) {
  name_request_t body;
  body.name = name;
  return encoded(body);
}

uint8_t result_of(int32_t kind, int32_t code) {
  switch (code) {
    case reply_t::OK: return kOk;
    case reply_t::UNKNOWN_NAME: return kNotFound;
    case reply_t::NOT_SUPPORTED: return kUnsupported;
    case reply_t::ENDED:
    case reply_t::REFUSED: return kind == request_t::STEP ? kIncorrectState : kFailed;
    default: return kFailed;
  }
}

void put_result(CdrWriter& out, uint8_t code, const std::string& text) { out.put(code).put(text); }
void put_result(CdrWriter& out, int32_t kind, const reply_t& reply) {
  put_result(out, result_of(kind, reply.code), reply.text);
}

void put_numbers(CdrWriter& out, std::initializer_list<double> numbers) {
  for (const double number : numbers) out.put(number);
}

void put_state(CdrWriter& out, const state_reply_t& state) {
  put_header(out, state.utime, "world");
  const double* q = state.orientation;
  for (const double x : state.position) out.put(x);
  put_numbers(out, {q[1], q[2], q[3], q[0]});
  for (const double x : state.linear) out.put(x);
  for (const double x : state.angular) out.put(x);
  put_numbers(out, {0, 0, 0, 0, 0, 0});  // acceleration
}

void put_no_state(CdrWriter& out) {
  put_header(out, 0, "");
  put_numbers(out, {0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
}

struct Placed {
  std::string frame;
  double position[3], orientation[4];  // w, x, y, z
};

Placed read_pose_stamped(CdrReader& in) {
  Placed placed;
  in.skip<uint32_t>(2);
  placed.frame = in.get_text();
  for (double& x : placed.position) x = in.get<double>();
  for (const size_t i : {1, 2, 3, 0}) placed.orientation[i] = in.get<double>();
  // An empty message is no rotation.
  if (std::all_of(placed.orientation, placed.orientation + 4, [](double x) { return x == 0.0; }))
    placed.orientation[0] = 1.0;
  return placed;
}

bool is_world(const std::string& frame) { return frame.empty() || frame == "world"; }

// How many copies the C library makes of a part of an expression, at most: + after a group or a
// repeat doubles what it repeats, and {9} makes nine of it.
size_t copies(const std::string& expression) {
  size_t times = 1;
  for (size_t i = 1; i < expression.size() && times <= kLongestWrittenOut; ++i) {
    if (expression[i] == '+' && std::strchr(")+*?}", expression[i - 1])) times *= 2;
    if (expression[i] != '{') continue;
    size_t number = 0, largest = 1;
    for (size_t at = i + 1; at < expression.size() && largest <= kLongestWrittenOut; ++at) {
      const char c = expression[at];
      number = c >= '0' && c <= '9' ? 10 * number + static_cast<size_t>(c - '0') : 0;
      largest = std::max(largest, number);
      if (c == '}') break;
    }
    times *= largest;
  }
  return times;
}

// Whether a name matches a POSIX extended regular expression as a whole or in part; null where the
// expression cannot be taken.
class Filter {
 public:
  explicit Filter(const std::string& text) : empty_(text.empty()) {
    // Repeats of repeats, and references backwards, take time and memory without end.
    const bool dear = text.find('\\') != std::string::npos || text.size() > kLongestFilter ||
                      text.size() * copies(text) > kLongestWrittenOut;
    good_ = empty_ || (!dear && text.find('\0') == std::string::npos &&
                       regcomp(&expression_, text.c_str(), REG_EXTENDED | REG_NOSUB) == 0);
  }
  ~Filter() {
    if (good_ && !empty_) regfree(&expression_);
  }
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;

  bool good() const { return good_; }
  bool matches(const std::string& name) const {
    return empty_ || regexec(&expression_, name.c_str(), 0, nullptr, 0) == 0;
  }

 private:
  bool empty_, good_ = false;
  regex_t expression_{};
};

}  // namespace

Services::Services(const ServiceContext& context, Requests& requests,
                   const Requests::Inject& inject)
    : requests_(requests),
      step_action_(context, requests, faulty_),
      parameters_(context, requests, inject, faulty_) {
  struct Row {
    const char* name;
    const char* type;
    void (Services::*handler)(const CallPointer& call);
  };
  static constexpr Row kRows[] = {
      {"get_simulator_features", "GetSimulatorFeatures", &Services::get_simulator_features},
      {"reset_simulation", "ResetSimulation", &Services::reset_simulation},
      {"step_simulation", "StepSimulation", &Services::step_simulation},
      {"get_simulation_state", "GetSimulationState", &Services::get_simulation_state},
      {"set_simulation_state", "SetSimulationState", &Services::set_simulation_state},
      {"spawn_entity", "SpawnEntity", &Services::spawn_entity},
      {"delete_entity", "DeleteEntity", &Services::delete_entity},
      {"get_entities", "GetEntities", &Services::get_entities},
      {"get_entity_state", "GetEntityState", &Services::get_entity_state},
      {"set_entity_state", "SetEntityState", &Services::set_entity_state},
  };
  for (const Row& row : kRows) {
    services_.push_back(std::make_unique<ServiceServer>(
        context, row.name, std::string("simulation_interfaces/srv/") + row.type,
        [this, handler = row.handler](const CallPointer& call) { (this->*handler)(call); },
        faulty_));
  }
}

std::vector<Topic> Services::list() const {
  std::vector<Topic> topics;
  for (const auto& service : services_) topics.push_back(service->topic());
  topics.push_back(step_action_.topic());
  for (const Topic& topic : parameters_.list()) topics.push_back(topic);
  return topics;
}

std::vector<const Reader*> Services::readers() const {
  std::vector<const Reader*> all = step_action_.readers();
  for (const Reader* reader : parameters_.readers()) all.push_back(reader);
  for (const auto& service : services_) all.push_back(&service->requests());
  return all;
}

std::vector<const Writer*> Services::writers() const {
  std::vector<const Writer*> all = step_action_.writers();
  for (const Writer* writer : parameters_.writers()) all.push_back(writer);
  for (const auto& service : services_) all.push_back(&service->replies());
  return all;
}

// Models are the entities; a body is called MODEL/LINK.
void Services::update(const std::vector<world_info_t>& info) {
  parameters_.update(info);
  std::set<std::string> robots;
  std::map<std::string, uint8_t> categories;
  for (const world_info_t& part : info) {
    for (const robot_info_t& robot : part.robots) robots.insert(robot.name);
  }
  for (const world_info_t& part : info) {
    for (const body_info_t& body : part.bodies) {
      if (body.name.empty()) continue;
      const std::string name = body.name.substr(0, body.name.find('/'));
      const auto [at, fresh] =
          categories.try_emplace(name, robots.contains(name) ? kRobot : kStatic);
      if (at->second == kStatic && !body.is_static) at->second = kDynamic;
    }
  }
  const std::lock_guard lock(mutex_);
  entities_.clear();
  for (const auto& [name, category] : categories) entities_.push_back({name, category});
}

void Services::pass_on(const CallPointer& call, int32_t kind, std::vector<uint8_t> body) {
  requests_.ask(call->client(), kind, std::move(body), [call, kind](const reply_t& reply) {
    CdrWriter out = call->answer();
    put_result(out, kind, reply);
    call->send(out);
  });
}

void Services::get_simulator_features(const CallPointer& call) {
  // SimulatorFeatures' numbers: spawning, deleting, categories, from texts, states of entities,
  // resets of time and state, state of the simulation with pausing, one step and many, these as an
  // action.
  constexpr std::array<uint16_t, 15> kFeatures{0,  1,  8,  9,  10, 11, 20, 21,
                                               22, 24, 25, 26, 31, 32, 33};
  CdrWriter out = call->answer();
  out.put_sequence(std::span<const uint16_t>(kFeatures));
  out.put_length(2).put("sdf").put("urdf");
  out.put(std::string("Ruedo ") + version());
  call->send(out);
}

void Services::reset_simulation(const CallPointer& call) {
  constexpr uint8_t kTime = 1, kState = 2, kSpawned = 4, kEach = kTime | kState | kSpawned;
  const auto scope = call->in.get<uint8_t>();
  if (!call->in.good()) return void(++faulty_);
  const auto body = [](int8_t what) {
    reset_request_t reset;
    reset.what = what;
    reset.seed = -1;
    return encoded(reset);
  };
  if (scope == 0 || (scope & kEach) == kEach)
    return pass_on(call, request_t::RESET, body(reset_request_t::ALL));
  if (scope == kTime) return pass_on(call, request_t::RESET, body(reset_request_t::TIME));
  if (scope == kState) return pass_on(call, request_t::RESET, body(reset_request_t::POSES));
  if (scope == (kTime | kState)) {
    requests_.ask(call->client(), request_t::RESET, body(reset_request_t::POSES),
                  [this, call, body](const reply_t& reply) {
                    if (reply.code == reply_t::OK)
                      return pass_on(call, request_t::RESET, body(reset_request_t::TIME));
                    CdrWriter out = call->answer();
                    put_result(out, request_t::RESET, reply);
                    call->send(out);
                  });
    return;
  }
  CdrWriter out = call->answer();
  put_result(out, kUnsupported, "scopes are ALL, TIME, STATE, and TIME with STATE");
  call->send(out);
}

void Services::step_simulation(const CallPointer& call) {
  constexpr uint64_t kMost = INT64_MAX;
  step_request_t body;
  body.steps = static_cast<int64_t>(std::min(call->in.get<uint64_t>(), kMost));
  if (!call->in.good()) return void(++faulty_);
  pass_on(call, request_t::STEP, encoded(body));
}

void Services::get_simulation_state(const CallPointer& call) {
  requests_.ask(
      call->client(), request_t::GET_STATE, name_body(""), [this, call](const reply_t& reply) {
        state_reply_t state{};
        const bool good =
            reply.code == reply_t::OK &&
            decode_checked(reply.body.data(), reply.body.size(), state) == DecodeFault::none;
        CdrWriter out = call->answer();
        out.put(good ? state_of(state.paused) : kPlaying);
        put_result(out, request_t::GET_STATE, reply);
        call->send(out);
      });
}

void Services::set_simulation_state(const CallPointer& call) {
  const auto wanted = call->in.get<uint8_t>();
  if (!call->in.good()) return void(++faulty_);
  requests_.ask(
      call->client(), request_t::GET_STATE, name_body(""),
      [this, call, wanted](const reply_t& reply) {
        state_reply_t state{};
        if (reply.code == reply_t::OK &&
            decode_checked(reply.body.data(), reply.body.size(), state) == DecodeFault::none) {
          return change_state(call, state_of(state.paused), wanted);
        }
        CdrWriter out = call->answer();
        put_result(out, request_t::GET_STATE, reply);
        call->send(out);
      });
}

void Services::change_state(const CallPointer& call, uint8_t now, uint8_t wanted) {
  if (now == wanted || wanted > kQuitting) {
    CdrWriter out = call->answer();
    put_result(out, now == wanted ? kAlreadyThere : kFailed,
               now == wanted ? "" : "there is no such state");
    return call->send(out);
  }
  if (wanted == kPlaying) stopped_ = false;
  if (wanted == kPlaying) return pass_on(call, request_t::RESUME, {});
  if (wanted == kQuitting) return pass_on(call, request_t::QUIT, {});
  if (wanted == kPaused && now == kStopped) {  // it stands still already
    stopped_ = false;
    CdrWriter out = call->answer();
    put_result(out, kOk, "");
    return call->send(out);
  }
  if (wanted == kPaused) return pass_on(call, request_t::PAUSE, {});
  requests_.ask(call->client(), request_t::PAUSE, {}, [this, call](const reply_t& reply) {
    if (reply.code != reply_t::OK) {
      CdrWriter out = call->answer();
      put_result(out, request_t::PAUSE, reply);
      return call->send(out);
    }
    stopped_ = true;
    reset_request_t body;
    body.what = reset_request_t::ALL;
    body.seed = -1;
    pass_on(call, request_t::RESET, encoded(body));
  });
}

void Services::spawn_entity(const CallPointer& call) {
  spawn_request_t body;
  body.name = call->in.get_text();
  const bool renames = call->in.get<bool>();
  std::string uri = call->in.get_text();
  const std::string text = call->in.get_text();
  call->in.get_text();  // a namespace: the robot's name is one
  const Placed placed = read_pose_stamped(call->in);
  if (!call->in.good()) return void(++faulty_);
  const auto refuse = [&](uint8_t code, const std::string& why) {
    CdrWriter out = call->answer();
    put_result(out, code, why);
    out.put("");
    call->send(out);
  };
  if (uri.starts_with("file://")) uri = uri.substr(7);
  if (uri.empty() && text.empty()) return refuse(kNoResource, "give uri or resource_string");
  if (!is_world(placed.frame))
    return refuse(kFailed, "poses are in the frame world, not in '" + placed.frame + "'");
  if (body.name.empty() && !renames)
    return refuse(kNameInvalid, "the name is empty, and allow_renaming is false");
  {
    const std::lock_guard lock(mutex_);
    if (is_entity(body.name) && !renames)
      return refuse(kNameNotUnique, "there is a '" + body.name + "' already");
    if (renames && !body.name.empty()) body.name = free_name(body.name);
    spawning_.insert(body.name);
  }
  body.model = uri;
  body.text = uri.empty() ? text : "";
  body.on_ground = false;
  std::copy(std::begin(placed.position), std::end(placed.position), body.position);
  std::copy(std::begin(placed.orientation), std::end(placed.orientation), body.orientation);
  const auto answer = [this, call, asked = body.name](const reply_t& reply) {
    {
      const std::lock_guard lock(mutex_);
      spawning_.erase(spawning_.find(asked));
    }
    state_reply_t state{};
    const bool named =
        reply.code == reply_t::OK &&
        decode_checked(reply.body.data(), reply.body.size(), state) == DecodeFault::none;
    CdrWriter out = call->answer();
    put_result(out, request_t::SPAWN, reply);
    out.put(named ? state.name : std::string());
    call->send(out);
  };
  requests_.ask(call->client(), request_t::SPAWN, encoded(body), answer);
}

bool Services::is_entity(const std::string& name) const {
  return std::any_of(entities_.begin(), entities_.end(),
                     [&](const Entity& entity) { return entity.name == name; });
}

std::string Services::free_name(const std::string& wanted) const {
  std::string name = wanted;
  for (int i = 2; is_entity(name) || spawning_.contains(name); ++i)
    name = wanted + "_" + std::to_string(i);
  return name;
}

void Services::delete_entity(const CallPointer& call) {
  const std::string name = call->in.get_text();
  if (!call->in.good()) return void(++faulty_);
  pass_on(call, request_t::REMOVE, name_body(name));
}

void Services::get_entities(const CallPointer& call) {
  CdrReader& in = call->in;
  const std::string text = in.get_text();
  const std::vector<uint8_t> categories = in.get_sequence<uint8_t>();
  const std::vector<std::string> tags = in.get_texts();
  in.skip<uint8_t>(2);  // how tags are joined; kind of the bounds
  const size_t bounds = in.get_length(24);
  if (!in.good()) return void(++faulty_);
  const Filter filter(text);
  CdrWriter out = call->answer();
  if (bounds > 0 || !filter.good()) {
    put_result(out, kUnsupported,
               bounds > 0
                   ? "bounds are not supported"
                   : "the filter is no POSIX extended regular expression, or too dear a one");
    out.put_length(0);
    return call->send(out);
  }
  std::vector<std::string> found;
  {
    const std::lock_guard lock(mutex_);
    for (const Entity& entity : entities_) {
      const bool wanted = categories.empty() || std::find(categories.begin(), categories.end(),
                                                          entity.category) != categories.end();
      if (wanted && tags.empty() && filter.matches(entity.name)) found.push_back(entity.name);
    }
  }
  put_result(out, kOk, "");
  out.put_length(found.size());
  for (const std::string& name : found) out.put(name);
  call->send(out);
}

void Services::get_entity_state(const CallPointer& call) {
  const std::string name = call->in.get_text();
  if (!call->in.good()) return void(++faulty_);
  const auto answer = [call](const reply_t& reply) {
    state_reply_t state{};
    const bool good =
        reply.code == reply_t::OK &&
        decode_checked(reply.body.data(), reply.body.size(), state) == DecodeFault::none;
    CdrWriter out = call->answer();
    put_result(out, request_t::GET_STATE, reply);
    if (good)
      put_state(out, state);
    else
      put_no_state(out);
    call->send(out);
  };
  if (!name.empty())
    return requests_.ask(call->client(), request_t::GET_STATE, name_body(name), answer);
  reply_t nobody{};  // without a name the run tells of itself
  nobody.code = reply_t::UNKNOWN_NAME;
  nobody.text = "the name is empty";
  answer(nobody);
}

void Services::set_entity_state(const CallPointer& call) {
  set_pose_request_t pose;
  set_twist_request_t twist;
  pose.name = twist.name = call->in.get_text();
  const Placed placed = read_pose_stamped(call->in);
  for (double& x : twist.linear) x = call->in.get<double>();
  for (double& x : twist.angular) x = call->in.get<double>();
  if (!call->in.good()) return void(++faulty_);
  if (!is_world(placed.frame)) {
    CdrWriter out = call->answer();
    put_result(out, kFailed, "poses are in the frame world, not in '" + placed.frame + "'");
    return call->send(out);
  }
  std::copy(std::begin(placed.position), std::end(placed.position), pose.position);
  std::copy(std::begin(placed.orientation), std::end(placed.orientation), pose.orientation);
  const bool rests =
      std::all_of(twist.linear, twist.linear + 3, [](double x) { return x == 0.0; }) &&
      std::all_of(twist.angular, twist.angular + 3, [](double x) { return x == 0.0; });
  if (rests) return pass_on(call, request_t::SET_POSE, encoded(pose));  // which brings it to rest
  requests_.ask(call->client(), request_t::SET_POSE, encoded(pose),
                [this, call, twist](const reply_t& reply) {
                  if (reply.code == reply_t::OK)
                    return pass_on(call, request_t::SET_TWIST, encoded(twist));
                  CdrWriter out = call->answer();
                  put_result(out, request_t::SET_POSE, reply);
                  call->send(out);
                });
}

}  // namespace ruedo::ros2
