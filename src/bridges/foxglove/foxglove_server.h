// --foxglove: a run in Foxglove, by its WebSocket protocol, with the messages that `ruedo export`
// writes. Without the web console's server in this build it says what is missing.
#pragma once

#include <memory>
#include <string>

namespace ruedo::run {
class Run;
}

namespace ruedo::foxglove {

class FoxgloveServer {
 public:
  // Before any work. Throws as open().
  static void check(const std::string& address);
  // From now on clients may connect, and get the run's messages. address: as of --view. Throws
  // InputError, and EnvironmentError if the port is in use.
  static std::unique_ptr<FoxgloveServer> open(run::Run& server, const std::string& address);

  virtual ~FoxgloveServer() = default;  // after the run, before the server
  virtual void print() const = 0;       // where it is reached
};

}  // namespace ruedo::foxglove
