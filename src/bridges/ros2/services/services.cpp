// Each service is a reading of its request, requests of the run's own, and a writing of the answer.
#include "bridges/ros2/services/services.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <utility>

#include "base/version.h"
#include "bridges/ros2/messages/cdr.h"
#include "bridges/ros2/messages/conversions.h"
#include "engine/outcome.h"
#include "ruedo/decode.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/step_request_t.hpp"

namespace ruedo::ros2 {

namespace {

using engine::encoded;

const std::string kPackage = "simulation_interfaces/";

// SimulatorFeatures' numbers, and the request of the run that each needs; 0: none.
struct Feature {
  uint16_t number;
  int32_t needs;
};
constexpr Feature kFeatures[] = {
    {0, request_t::SPAWN},       // SPAWNING
    {1, request_t::REMOVE},      // DELETING
    {4, 0},                      // ENTITY_TAGS
    {5, 0},                      // ENTITY_BOUNDS
    {6, request_t::GET_STATE},   // ENTITY_BOUNDS_BOX
    {8, 0},                      // ENTITY_CATEGORIES
    {9, request_t::SPAWN},       // SPAWNING_RESOURCE_STRING
    {10, request_t::GET_STATE},  // ENTITY_STATE_GETTING
    {11, request_t::SET_TWIST},  // ENTITY_STATE_SETTING
    {12, 0},                     // ENTITY_INFO_GETTING
    {13, 0},                     // ENTITY_INFO_SETTING
    {14, 0},                     // SPAWNABLES
    {20, request_t::RESET},      // SIMULATION_RESET
    {21, request_t::RESET},      // SIMULATION_RESET_TIME
    {22, request_t::RESET},      // SIMULATION_RESET_STATE
    {23, request_t::REMOVE},     // SIMULATION_RESET_SPAWNED
    {24, request_t::GET_STATE},  // SIMULATION_STATE_GETTING
    {25, request_t::PAUSE},      // SIMULATION_STATE_SETTING
    {26, request_t::PAUSE},      // SIMULATION_STATE_PAUSE
    {31, request_t::STEP},       // STEP_SIMULATION_SINGLE
    {32, request_t::STEP},       // STEP_SIMULATION_MULTIPLE
    {33, request_t::STEP},       // STEP_SIMULATION_ACTION
    {44, 0},                     // WORLD_INFO_GETTING
    {50, request_t::SPAWN},      // SPAWNING_ENTITIES
};

constexpr int64_t bit(int32_t kind) { return int64_t{1} << kind; }

// Zeros, and sequences and texts of no length.
void put_nothing(CdrWriter& out, const Field& field, Distro distro) {
  if (field.kind == Field::Kind::sequence || field.kind == Field::Kind::bounded)
    return void(out.put_length(0));
  const size_t count = field.kind == Field::Kind::array ? field.capacity : 1;
  for (size_t i = 0; i < count; ++i) {
    if (field.type.find('/') != std::string::npos) {
      for (const Field& inner : fields_of(field.type, distro)) put_nothing(out, inner, distro);
    } else if (field.type == "string") {
      out.put("");
    } else if (field.type.ends_with("64")) {
      out.put(int64_t{0});
    } else if (field.type.ends_with("32")) {
      out.put(int32_t{0});
    } else if (field.type.ends_with("16")) {
      out.put(int16_t{0});
    } else {
      out.put(uint8_t{0});
    }
  }
}

std::vector<uint8_t> reset_body(int8_t what) {
  reset_request_t reset;
  reset.what = what;
  reset.seed = -1;
  return encoded(reset);
}

}  // namespace

Services::Services(const ServiceContext& context, Requests& requests,
                   const Requests::Inject& inject)
    : distro_(context.distro),
      requests_(requests),
      step_action_(context, requests, faulty_),
      parameters_(context, requests, inject, faulty_) {
  struct Row {
    const char* name;
    const char* type;
    void (Services::*handler)(const CallPointer& call);
  };
  static constexpr Row kRows[] = {
      {"delete_entity", "DeleteEntity", &Services::delete_entity},
      {"get_available_worlds", "GetAvailableWorlds", &Services::refuse},
      {"get_current_world", "GetCurrentWorld", &Services::get_current_world},
      {"get_entities", "GetEntities", &Services::get_entities},
      {"get_entities_states", "GetEntitiesStates", &Services::get_entities_states},
      {"get_entity_bounds", "GetEntityBounds", &Services::get_entity_bounds},
      {"get_entity_info", "GetEntityInfo", &Services::get_entity_info},
      {"get_entity_state", "GetEntityState", &Services::get_entity_state},
      {"get_named_pose_bounds", "GetNamedPoseBounds", &Services::refuse},
      {"get_named_poses", "GetNamedPoses", &Services::refuse},
      {"get_simulation_state", "GetSimulationState", &Services::get_simulation_state},
      {"get_simulator_features", "GetSimulatorFeatures", &Services::get_simulator_features},
      {"get_spawnables", "GetSpawnables", &Services::get_spawnables},
      {"load_world", "LoadWorld", &Services::refuse},
      {"reset_simulation", "ResetSimulation", &Services::reset_simulation},
      {"set_entity_info", "SetEntityInfo", &Services::set_entity_info},
      {"set_entity_state", "SetEntityState", &Services::set_entity_state},
      {"set_simulation_state", "SetSimulationState", &Services::set_simulation_state},
      {"spawn_entities", "SpawnEntities", &Services::spawn_entities},
      {"spawn_entity", "SpawnEntity", &Services::spawn_entity},
      {"step_simulation", "StepSimulation", &Services::step_simulation},
      {"unload_world", "UnloadWorld", &Services::refuse},
  };
  for (const Row& row : kRows) {
    services_.push_back(std::make_unique<ServiceServer>(
        context, row.name, kPackage + "srv/" + row.type,
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

void Services::update(const std::vector<world_info_t>& info,
                      std::shared_ptr<const world::WorldModel> world) {
  parameters_.update(info);
  const std::lock_guard lock(mutex_);
  served_ = 0;
  for (const world_info_t& part : info)
    for (const channel_info_t& channel : part.channels)
      if (channel.type == request_t::getTypeName() && channel.robot.empty())
        served_ = part.features;
  // In lockstep it is the clients' grants that step.
  if ((served_ & bit(request_t::GRANT)) != 0) served_ &= ~bit(request_t::STEP);
  entities_.update(std::move(world));
  std::erase_if(namespaces_, [&](const auto& each) {
    return !entities_.find(each.first) && !spawning_.contains(each.first);
  });
}

std::map<std::string, std::string> Services::namespaces() const {
  const std::lock_guard lock(mutex_);
  return namespaces_;
}

void Services::answer(const CallPointer& call, const Result& result) const {
  CdrWriter out = call->answer();
  for (const Field& field : fields_of(call->type() + "_Response", distro_)) {
    if (field.type == kPackage + "msg/Result")
      out.put(result.code).put(result.text);
    else
      put_nothing(out, field, distro_);
  }
  call->send(out);
}

void Services::send(const CallPointer& call, const CdrWriter& out) const {
  if (!call->send(out))
    answer(call, kFailed, "the answer is too large for one message: ask for less with a filter");
}

void Services::in_turn(uint64_t client, std::vector<Step> steps, Requests::Then then) {
  Step first = std::move(steps.front());
  steps.erase(steps.begin());
  requests_.send(client, first.kind, std::move(first.body),
                 [this, client, steps = std::move(steps), then](const reply_t& reply) {
                   if (reply.code != reply_t::OK || steps.empty()) return then(reply);
                   in_turn(client, steps, then);
                 });
}

void Services::in_turn(const CallPointer& call, std::vector<Step> steps) {
  in_turn(call->client(), std::move(steps),
          [this, call](const reply_t& reply) { answer(call, result_of(reply)); });
}

void Services::ask_state(uint64_t client, const std::string& name,
                         std::function<void(const Result&, const state_reply_t&)> then) {
  name_request_t body;
  body.name = name;
  requests_.send(client, request_t::GET_STATE, encoded(body), [then](const reply_t& reply) {
    state_reply_t state{};
    Result result = result_of(reply);
    if (reply.code == reply_t::OK &&
        decode_checked(reply.body.data(), reply.body.size(), state) != DecodeFault::none)
      result = {kFailed, "the run's answer is of another version"};
    then(result, state);
  });
}

void Services::to_world(uint64_t client, Motion motion,
                        std::function<void(const Result&, const Motion&)> then) {
  if (motion.frame.empty() || motion.frame == "world") return then({}, motion);
  ask_state(client, motion.frame, [motion, then](const Result& result, const state_reply_t& state) {
    if (result.code != kOk) {
      const bool unknown = result.code == kNotFound;
      return then({result.code, unknown ? "the frame '" + motion.frame +
                                              "' is neither world nor an entity or a link of one"
                                        : result.text},
                  motion);
    }
    const auto vector = [](const double(&v)[3]) { return Vec3(v[0], v[1], v[2]); };
    const double* q = state.orientation;
    const Pose X_WF{Quat(q[0], q[1], q[2], q[3]), vector(state.position)};
    Motion moved{"world", X_WF * motion.pose, {}};
    moved.twist.angular = vector(state.angular) + X_WF.rotation * motion.twist.angular;
    moved.twist.linear = vector(state.linear) + X_WF.rotation * motion.twist.linear +
                         vector(state.angular).cross(moved.pose.translation - X_WF.translation);
    then({}, moved);
  });
}

void Services::refuse(const CallPointer& call) {
  answer(call, kUnsupported, "not supported: get_simulator_features lists what is");
}

void Services::get_simulator_features(const CallPointer& call) {
  std::vector<uint16_t> features;
  {
    const std::lock_guard lock(mutex_);
    for (const Feature& feature : kFeatures)
      if (feature.needs == 0 || (served_ & bit(feature.needs)) != 0)
        features.push_back(feature.number);
  }
  CdrWriter out = call->answer();
  out.put_sequence(std::span<const uint16_t>(features));
  out.put_length(2).put("sdf").put("urdf");
  out.put(std::string("Ruedo ") + version());
  send(call, out);
}

void Services::reset_simulation(const CallPointer& call) {
  constexpr uint8_t kTime = 1, kState = 2, kSpawned = 4, kEach = kTime | kState | kSpawned;
  const auto scope = call->in.get<uint8_t>();
  if (!call->in.good()) return void(++faulty_);
  if (scope == 0 || (scope & kEach) == kEach)
    return in_turn(call, {{request_t::RESET, reset_body(reset_request_t::ALL)}});
  if ((scope & kEach) == 0)
    return answer(call, kUnsupported,
                  "scopes are 1 (time), 2 (state) and 4 (spawned), each with each, and 255 (all)");
  std::vector<Step> steps;
  if ((scope & kSpawned) != 0) {
    const std::lock_guard lock(mutex_);
    for (const std::string& name : entities_.spawned()) {
      name_request_t body;
      body.name = name;
      steps.push_back({request_t::REMOVE, encoded(body)});
    }
  }
  if ((scope & kState) != 0)
    steps.push_back({request_t::RESET, reset_body(reset_request_t::POSES)});
  if ((scope & kTime) != 0) steps.push_back({request_t::RESET, reset_body(reset_request_t::TIME)});
  if (steps.empty()) return answer(call, Result{});  // nothing was spawned
  in_turn(call, std::move(steps));
}

// Steps while the simulation plays are RESULT_OPERATION_FAILED, as StepSimulation says.
void Services::step_simulation(const CallPointer& call) {
  step_request_t body;
  body.steps = static_cast<int64_t>(
      std::min<uint64_t>(call->in.get<uint64_t>(), std::numeric_limits<int64_t>::max()));
  if (!call->in.good()) return void(++faulty_);
  in_turn(call, {{request_t::STEP, encoded(body)}});
}

void Services::get_simulation_state(const CallPointer& call) {
  ask_state(call->client(), "", [this, call](const Result& result, const state_reply_t& state) {
    CdrWriter out = call->answer();
    out.put(result.code == kOk ? state_of(state) : kPlaying);
    out.put(result.code).put(result.text);
    send(call, out);
  });
}

void Services::set_simulation_state(const CallPointer& call) {
  const auto wanted = call->in.get<uint8_t>();
  if (!call->in.good()) return void(++faulty_);
  ask_state(call->client(), "",
            [this, call, wanted](const Result& result, const state_reply_t& state) {
              if (result.code != kOk) return answer(call, result);
              change_state(call, state_of(state), wanted);
            });
}

// A world is always loaded, so that each change between the other states is allowed.
void Services::change_state(const CallPointer& call, uint8_t now, uint8_t wanted) {
  if (now == wanted) return answer(call, kAlreadyThere, "it is in that state already");
  if (wanted > kLoading) return answer(call, kFailed, "there is no such state");
  if (wanted > kQuitting)
    return answer(call, kIncorrectTransition, "a world is loaded, and stays: set 0 to 3");
  if (wanted == kPaused && now == kStopped) {  // it stands still already
    stopped_ = false;
    return answer(call, Result{});
  }
  constexpr int32_t kKinds[] = {request_t::PAUSE, request_t::RESUME, request_t::PAUSE,
                                request_t::QUIT};
  std::vector<Step> steps{{kKinds[wanted], {}}};
  if (wanted == kStopped) steps.push_back({request_t::RESET, reset_body(reset_request_t::ALL)});
  in_turn(call->client(), std::move(steps), [this, call, wanted](const reply_t& reply) {
    Result result = result_of(reply);
    if (result.code == kOk) stopped_ = wanted == kStopped;
    if (result.code == kFailed) result.code = kTransitionError;
    answer(call, result);
  });
}

void Services::get_current_world(const CallPointer& call) {
  std::string name, file;
  {
    const std::lock_guard lock(mutex_);
    if (const world::WorldModel* world = entities_.world()) {
      name = world->name;
      file = std::filesystem::absolute(world->file).lexically_normal().string();
    }
  }
  if (file.empty()) return answer(call, kNoWorld, "no world is known");
  CdrWriter out = call->answer();
  out.put(uint8_t{kOk}).put("");
  out.put(name).put(file).put("").put("").put_length(0);
  send(call, out);
}

}  // namespace ruedo::ros2
