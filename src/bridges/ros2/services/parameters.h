// The parameters of the node, with the services that each ROS node has for them: settings that
// programs read and change during a run.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

#include "bridges/ros2/services/requests.h"
#include "bridges/ros2/services/service_server.h"
#include "ruedo/state_reply_t.hpp"
#include "ruedo/world_info_t.hpp"

namespace ruedo::ros2 {

class Parameters {
 public:
  // inject: a message for the run. faulty: counts malformed requests. Throws EnvironmentError.
  Parameters(const ServiceContext& context, Requests& requests, Requests::Inject inject,
             std::atomic<uint64_t>& faulty);

  // The contents of the run from now on. Any thread.
  void update(const std::vector<world_info_t>& info);

  std::vector<Topic> list() const;  // the services
  std::vector<const Reader*> readers() const;
  std::vector<const Writer*> writers() const;

 private:
  // monostate: not set, or of a type that no parameter has.
  using Value = std::variant<std::monostate, bool, int64_t, double, std::string>;
  struct Parameter {
    std::string name;
    Value value;
  };
  struct Setting;  // of several, one after the other

  void get_values(const CallPointer& call);
  void get_types(const CallPointer& call);
  void list_names(const CallPointer& call);
  void describe(const CallPointer& call);
  void set(const CallPointer& call, bool atomically);
  void set_next(const std::shared_ptr<Setting>& setting);
  void answer(const Setting& setting);

  // "": it may be set.
  std::string fault_of(const Parameter& parameter) const;
  // then: with why it was refused, "": it was not.
  void apply(uint64_t client, const Parameter& parameter,
             const std::function<void(const std::string&)>& then);
  std::string inject_fault(const std::string& text);

  Value value_of(const std::string& name, const state_reply_t* state) const;
  static void put(CdrWriter& out, const Value& value);
  static Parameter read(CdrReader& in);
  void tell(const std::vector<Parameter>& changed);  // /parameter_events

  Requests& requests_;
  Requests::Inject inject_;
  std::atomic<uint64_t>& faulty_;
  std::vector<std::unique_ptr<ServiceServer>> services_;
  std::unique_ptr<Writer> events_;

  mutable std::mutex mutex_;                           // of what follows
  std::map<std::string, std::string> fault_channels_;  // by robot
  std::string world_, fault_;
  int64_t seed_ = 0, step_us_ = 0;
};

}  // namespace ruedo::ros2
