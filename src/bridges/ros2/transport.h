// The interface to ROS middleware: writers and readers of CDR bytes under ROS names.
// src/bridges/dds implements it with Cyclone DDS.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "bridges/ros2/topic.h"

namespace ruedo::ros2 {

using Gid = std::array<uint8_t, 16>;

// Identifies a sample and its writer; for a request, used to match its reply.
struct SampleIdentity {
  Gid writer{};
  int64_t sequence = 0;
};

// A received sample.
struct Sample {
  std::span<const uint8_t> cdr;
  SampleIdentity identity;          // if related: that of the reader waiting for the reply
  bool is_related = false;          // it names that reader (DDS-RPC's related sample identity)
  std::array<uint8_t, 2> vendor{};  // of the sender's DDS implementation
  uint64_t sender = 0;              // a number given to the writer by the transport
};

// Information about a sample, and the names in the middleware.
enum class Role { topic, request, reply, graph };

struct Endpoint {
  Role role = Role::topic;
  Topic topic;       // for a service: its name, and "pkg/srv/Name_Request" or "..._Response"
  std::string hash;  // RIHS01_..., "": none
  std::string service = {};  // common to both ends of a service; "": a topic
  // For requests: the writer of their replies. A request from a client whose reply reader is not
  // discovered yet is delivered a little later.
  const class Writer* replies = nullptr;
};

class Writer {
 public:
  virtual ~Writer() = default;
  // Never blocks; false: it could not be sent.
  virtual bool write(std::span<const uint8_t> cdr) = 0;
  // The same, as the reply to that request (DDS-RPC's related sample identity); also false if it
  // does not fit into one datagram.
  virtual bool reply(std::span<const uint8_t> cdr, const SampleIdentity& request) = 0;
  virtual size_t readers() const = 0;  // of other participants
  bool is_read() const { return readers() > 0; }
  virtual Gid gid() const = 0;
};

class Reader {
 public:
  virtual ~Reader() = default;
  virtual size_t writers() const = 0;  // of other participants
  virtual Gid gid() const = 0;
};

class Transport {
 public:
  virtual ~Transport() = default;

  using Handler = std::function<void(const Sample& sample)>;

  // Both throw EnvironmentError. The handler is called from the transport's thread, and not after
  // the end of the reader.
  virtual std::unique_ptr<Writer> add_writer(const Endpoint& endpoint) = 0;
  virtual std::unique_ptr<Reader> add_reader(const Endpoint& endpoint, Handler handler) = 0;

  // Whether another participant publishes on that topic, with its type. From one thread at a time.
  virtual bool is_published(const Topic& topic) = 0;

  // Handlers are called between start() and the return of stop().
  virtual void start() = 0;
  virtual void stop() = 0;

  virtual Gid gid() const = 0;            // of this participant
  virtual std::string where() const = 0;  // "domain 0, this machine only"
  virtual uint64_t refused() const = 0;   // samples refused as too large or too many
};

}  // namespace ruedo::ros2
