// The services of simulation_interfaces 1.5, its action, and the node's parameters.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "bridges/ros2/services/entities.h"
#include "bridges/ros2/services/model_checks.h"
#include "bridges/ros2/services/parameters.h"
#include "bridges/ros2/services/requests.h"
#include "bridges/ros2/services/results.h"
#include "bridges/ros2/services/service_server.h"
#include "bridges/ros2/services/step_action.h"
#include "ruedo/spawn_request_t.hpp"
#include "ruedo/state_reply_t.hpp"
#include "ruedo/world_info_t.hpp"

namespace ruedo::ros2 {

class Services {
 public:
  // Throws EnvironmentError.
  Services(const ServiceContext& context, Requests& requests, const Requests::Inject& inject);

  // The contents of the run from now on; world: null if it is unknown. Any thread.
  void update(const std::vector<world_info_t>& info,
              std::shared_ptr<const world::WorldModel> world);
  // Namespaces of spawned robots, by name, if a client requested one.
  std::map<std::string, std::string> namespaces() const;

  std::vector<Topic> list() const;  // names, and "pkg/srv/Name"
  std::vector<const Reader*> readers() const;
  std::vector<const Writer*> writers() const;
  uint64_t faulty() const { return faulty_; }

 private:
  struct Step {  // a request of the run
    int32_t kind;
    std::vector<uint8_t> body;
  };
  struct Motion {  // of an entity in a frame
    std::string frame;
    Pose pose;
    Twist twist;
  };
  struct Selection;  // of entities, and their states
  struct Order;      // for a model
  struct Orders;     // for several
  using Spawned = std::function<void(const Result& result, const std::string& name)>;

  // Fills what the response has beside its result with nothing.
  void answer(const CallPointer& call, const Result& result) const;
  void answer(const CallPointer& call, uint8_t code, const std::string& text) const {
    answer(call, Result{code, text});
  }
  // The answer as it is, or that it is too large.
  void send(const CallPointer& call, const CdrWriter& out) const;
  // One after the other, until one is refused.
  void in_turn(uint64_t client, std::vector<Step> steps, Requests::Then then);
  void in_turn(const CallPointer& call, std::vector<Step> steps);  // and answers
  void ask_state(uint64_t client, const std::string& name,
                 std::function<void(const Result& result, const state_reply_t& state)> then);
  // Where the frame is an entity's, or a link's. Result: why not.
  void to_world(uint64_t client, Motion motion,
                std::function<void(const Result& result, const Motion& in_world)> then);

  void get_simulator_features(const CallPointer& call);
  void reset_simulation(const CallPointer& call);
  void step_simulation(const CallPointer& call);
  void get_simulation_state(const CallPointer& call);
  void set_simulation_state(const CallPointer& call);
  void change_state(const CallPointer& call, uint8_t now, uint8_t wanted);
  void get_current_world(const CallPointer& call);
  void refuse(const CallPointer& call);  // what is not supported

  // entity_services.cpp
  void delete_entity(const CallPointer& call);
  void get_entities(const CallPointer& call) { select(call, false); }
  void get_entities_states(const CallPointer& call) { select(call, true); }
  void select(const CallPointer& call, bool with_states);
  void next_state(const std::shared_ptr<Selection>& selection);
  void answer_selection(const Selection& selection);
  void get_entity_bounds(const CallPointer& call);
  void get_entity_info(const CallPointer& call);
  void set_entity_info(const CallPointer& call);
  void get_entity_state(const CallPointer& call);
  void set_entity_state(const CallPointer& call);

  // spawn_services.cpp
  void get_spawnables(const CallPointer& call);
  void spawn_entity(const CallPointer& call);
  void spawn_entities(const CallPointer& call);
  void spawn_next(const std::shared_ptr<Orders>& orders);
  void spawn(uint64_t client, Order order, Spawned then);
  void spawn_checked(uint64_t client, Order order, const Spawned& then);
  Result fault_of(const Order& order) const;
  Result reserve(Order& order);  // its name and its namespace
  void release(const std::string& name, bool spawned);
  std::string free_name(const std::string& wanted) const;

  bool is_stopped(const state_reply_t& state) const {
    return stopped_ && state.paused && state.step == 0;
  }
  uint8_t state_of(const state_reply_t& state) const {
    return !state.paused ? kPlaying : is_stopped(state) ? kStopped : kPaused;
  }

  static constexpr uint8_t kStopped = 0, kPlaying = 1, kPaused = 2, kQuitting = 3, kLoading = 5;

  Distro distro_;
  Requests& requests_;
  std::atomic<bool> stopped_{false};
  std::atomic<uint64_t> faulty_{0};
  std::vector<std::unique_ptr<ServiceServer>> services_;
  StepAction step_action_;
  Parameters parameters_;

  mutable std::mutex mutex_;  // of what follows
  int64_t served_ = 0;        // bitmap of the run's kinds of requests
  Entities entities_;
  std::multiset<std::string> spawning_;  // the names requested from the run
  std::map<std::string, std::string> namespaces_;

  ModelChecks checks_;  // the last: its thread calls the above
};

}  // namespace ruedo::ros2
