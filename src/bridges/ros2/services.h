// The services of simulation_interfaces, its action, and the node's parameters.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "bridges/ros2/parameters.h"
#include "bridges/ros2/requests.h"
#include "bridges/ros2/service_server.h"
#include "bridges/ros2/step_action.h"
#include "ruedo/world_info_t.hpp"

namespace ruedo::ros2 {

class Services {
 public:
  // Throws EnvironmentError.
  Services(const ServiceContext& context, Requests& requests, const Requests::Inject& inject);

  // What there is in the run from now on. Any thread.
  void update(const std::vector<world_info_t>& info);

  std::vector<Topic> list() const;  // names, and "pkg/srv/Name"
  std::vector<const Reader*> readers() const;
  std::vector<const Writer*> writers() const;
  uint64_t faulty() const { return faulty_; }

 private:
  // Asks the run, and answers with its Result alone.
  void pass_on(const CallPointer& call, int32_t kind, std::vector<uint8_t> body);

  void get_simulator_features(const CallPointer& call);
  void reset_simulation(const CallPointer& call);
  void step_simulation(const CallPointer& call);
  void get_simulation_state(const CallPointer& call);
  void set_simulation_state(const CallPointer& call);
  void change_state(const CallPointer& call, uint8_t now, uint8_t wanted);
  void spawn_entity(const CallPointer& call);
  void delete_entity(const CallPointer& call);
  void get_entities(const CallPointer& call);
  void get_entity_state(const CallPointer& call);
  void set_entity_state(const CallPointer& call);

  bool is_entity(const std::string& name) const;  // under the mutex
  std::string free_name(const std::string& wanted) const;

  uint8_t state_of(bool paused) const { return !paused ? kPlaying : stopped_ ? kStopped : kPaused; }

  static constexpr uint8_t kStopped = 0, kPlaying = 1, kPaused = 2, kQuitting = 3;

  Requests& requests_;
  std::atomic<bool> stopped_{false};
  std::atomic<uint64_t> faulty_{0};
  std::vector<std::unique_ptr<ServiceServer>> services_;
  StepAction step_action_;
  Parameters parameters_;

  struct Entity {
    std::string name;
    uint8_t category;
  };
  std::mutex mutex_;  // of what follows
  std::vector<Entity> entities_;
  std::multiset<std::string> spawning_;  // the names that the run was asked for
};

}  // namespace ruedo::ros2
