// A service's server over DDS, as one of ROS's middlewares maps services.
//
// rmw_cyclonedds puts a client's mark and a sequence number before each request, which come back
// before its reply; rmw_fastrtps sends the reader that waits for the reply beside the request, and
// has the reply say which request of which reader it answers.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bridges/ros2/messages/cdr.h"
#include "bridges/ros2/messages/interfaces.h"
#include "bridges/ros2/messages/names.h"
#include "bridges/ros2/transport.h"

namespace ruedo::ros2 {

// automatic: each call is answered as it came: what Cyclone DDS sent without a reader beside it is
// rmw_cyclonedds's.
enum class ServiceMapping { automatic, cyclonedds, fastrtps };

// Throws InputError.
ServiceMapping parse_mapping(const std::string& name);

// Where services are made.
struct ServiceContext {
  Transport& transport;
  Distro distro;
  ServiceMapping mapping;
  Names& names;
};

// A call, whose answer may come later, from another thread.
class Call {
 public:
  // type: of the service, "pkg/srv/Name"; must outlive it.
  Call(Writer& replies, const Sample& sample, ServiceMapping mapping, const std::string& type);

  // Begins the answer.
  CdrWriter answer() const;
  uint64_t client() const { return sender_; }
  const std::string& type() const { return type_; }
  bool send(const CdrWriter& out);  // false: it could not be sent

 private:
  std::vector<uint8_t> bytes_;

 public:
  CdrReader in;

 private:
  Writer& replies_;
  const std::string& type_;
  bool has_header_;
  SampleIdentity identity_;
  uint64_t sender_;
  uint64_t client_ = 0;
  int64_t sequence_ = 0;
};
using CallPointer = std::shared_ptr<Call>;

class ServiceServer {
 public:
  using Handler = std::function<void(const CallPointer& call)>;

  // name: without a namespace; type: "pkg/srv/Name". faulty: counts malformed requests. Throws
  // EnvironmentError.
  ServiceServer(const ServiceContext& context, const std::string& name, const std::string& type,
                Handler handler, std::atomic<uint64_t>& faulty);

  const Topic& topic() const { return topic_; }  // its name, and its type
  const Reader& requests() const { return *requests_; }
  const Writer& replies() const { return *replies_; }

 private:
  void on_request(const Sample& sample);

  Topic topic_;
  ServiceMapping mapping_;
  Handler handler_;
  std::atomic<uint64_t>& faulty_;
  std::unique_ptr<Writer> replies_;
  std::unique_ptr<Reader> requests_;  // the last: it calls on_request()
};

}  // namespace ruedo::ros2
