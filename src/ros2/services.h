// The services of simulation_interfaces, as rmw_cyclonedds maps services: a client's mark and a
// sequence number go before each request, and come back before its reply.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "ros2/interfaces.h"
#include "ros2/names.h"
#include "ros2/requests.h"
#include "ros2/transport.h"
#include "ruedo/world_info_t.hpp"

namespace ruedo::ros2 {

class Services {
 public:
  // Throws EnvironmentError.
  Services(Transport& transport, Distro distro, Names& names, Requests& requests);

  // What there is in the run from now on. Any thread.
  void update(const std::vector<world_info_t>& info);

  std::vector<Topic> list() const;  // names, and "pkg/srv/Name"
  std::vector<const Reader*> readers() const;
  std::vector<const Writer*> writers() const;
  uint64_t faulty() const { return faulty_; }

  // A call, whose answer may come later, from another thread.
  class Call;

 private:
  struct Service {
    Topic topic;
    std::unique_ptr<Writer> replies;
    std::unique_ptr<Reader> requests;
    size_t deaf = 0;  // clients that write requests, and read no replies
  };
  using CallPointer = std::shared_ptr<Call>;
  using Handler = void (Services::*)(const CallPointer& call);
  struct Row {
    const char* name;  // of the service
    const char* type;
    Handler handler;
  };

  void add(Transport& transport, Distro distro, Names& names, const Row& row);
  void receive(Service& service, Handler handler, std::span<const uint8_t> cdr);

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

  uint8_t state_of(bool paused) const { return !paused ? kPlaying : stopped_ ? kStopped : kPaused; }

  static constexpr uint8_t kStopped = 0, kPlaying = 1, kPaused = 2, kQuitting = 3;

  Requests& requests_;
  std::vector<std::unique_ptr<Service>> services_;
  std::atomic<bool> stopped_{false};
  std::atomic<uint64_t> faulty_{0};

  struct Entity {
    std::string name;
    uint8_t category;
  };
  std::mutex mutex_;  // of what follows
  std::vector<Entity> entities_;
};

}  // namespace ruedo::ros2
