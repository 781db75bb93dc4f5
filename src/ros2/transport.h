// What carries ROS messages: writers and readers of CDR bytes under ROS names. src/dds implements
// it over Cyclone DDS.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "ros2/topic.h"

namespace ruedo::ros2 {

using Gid = std::array<uint8_t, 16>;

// Which sample of which writer; of a request, by which its reply is known.
struct SampleIdentity {
  Gid writer{};
  int64_t sequence = 0;
};

// What came.
struct Sample {
  std::span<const uint8_t> cdr;
  SampleIdentity identity;          // where it is related: of the reader that waits for the reply
  bool is_related = false;          // it names that reader (DDS-RPC's related sample identity)
  std::array<uint8_t, 2> vendor{};  // of the DDS that sent it
  uint64_t sender = 0;              // a number that the transport gives the writer
};

// Where a sample goes by, and what the transport's middleware calls it.
enum class Role { topic, request, reply, graph };

struct Endpoint {
  Role role = Role::topic;
  Topic topic;               // of a service: its name, and "pkg/srv/Name_Request" or "..._Response"
  std::string hash;          // RIHS01_..., "": none
  std::string service = {};  // what both ends of a service have in common; "": a topic
  // Of requests, by what they are answered: a request whose client is not yet known to hear there
  // is handed over a little later.
  const class Writer* replies = nullptr;
};

class Writer {
 public:
  virtual ~Writer() = default;
  // Never waits; false: it could not be sent.
  virtual bool write(std::span<const uint8_t> cdr) = 0;
  // The same, as the reply to that request (DDS-RPC's related sample identity); false for more than
  // fits into one datagram, too.
  virtual bool reply(std::span<const uint8_t> cdr, const SampleIdentity& request) = 0;
  virtual size_t readers() const = 0;  // of others
  bool is_read() const { return readers() > 0; }
  virtual Gid gid() const = 0;
};

class Reader {
 public:
  virtual ~Reader() = default;
  virtual size_t writers() const = 0;  // of others
  virtual Gid gid() const = 0;
};

class Transport {
 public:
  virtual ~Transport() = default;

  using Handler = std::function<void(const Sample& sample)>;

  // Both throw EnvironmentError. The handler is called from the transport's thread.
  virtual std::unique_ptr<Writer> add_writer(const Endpoint& endpoint) = 0;
  virtual std::unique_ptr<Reader> add_reader(const Endpoint& endpoint, Handler handler) = 0;

  // Handlers are called from now on, and no more once stop() has returned.
  virtual void start() = 0;
  virtual void stop() = 0;

  virtual Gid gid() const = 0;            // of this participant
  virtual std::string where() const = 0;  // "domain 0, this machine only"
  virtual uint64_t refused() const = 0;   // samples, too large or too many
};

}  // namespace ruedo::ros2
