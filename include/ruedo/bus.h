// The bus, as the rest of Ruedo sees it: bytes on named channels. src/bus implements it over LCM.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace ruedo {

class Bus {
 public:
  virtual ~Bus() = default;

  // Safe from any thread. Never throws: a message that cannot be sent is counted.
  virtual void publish(const std::string& channel, const uint8_t* data, size_t size) = 0;

  // Returns when all published messages are on their way, at the latest. For busy publishers
  // at once: a bus may send it as one piece. Any thread.
  virtual void flush() {}

  // Called from the bus's own thread for every message on one of the channels given to listen().
  // The bytes are as they came: nothing about them is checked.
  using Handler = std::function<void(const std::string& channel, const uint8_t* data, size_t size)>;

  // Starts to listen; once in a bus's life. `own` are the channels that this process publishes: a
  // bus that hears itself can tell them from another process's.
  virtual void listen(const std::vector<std::string>& channels, Handler handler,
                      const std::vector<std::string>& own = {}) = 0;

  // After listen(): from now on these are the channels, and `own` those that this process
  // publishes. Messages on channels that stay are not lost. Returns when the bus has taken them up.
  // Any thread but the bus's own.
  virtual void listen_to(const std::vector<std::string>& channels,
                         const std::vector<std::string>& own = {}) {
    static_cast<void>(channels), static_cast<void>(own);
  }

  // On these channels each message replaces the one before it: a listener that falls behind gets
  // the newest of each. On all others it gets every message, as long as the bus has room for them.
  // Any thread.
  virtual void conflate(const std::vector<std::string>& channels) { static_cast<void>(channels); }

  // The process that started this one gets every message from now on: the run waits for it. Any
  // thread.
  virtual void keep_all_for_launcher() {}

  // Ends listening: once it returns, the handler is not called any more.
  virtual void stop() {}

  // Whether somebody may hear what is published on that channel; true where a bus does not know its
  // listeners. Any thread, as the next.
  virtual bool is_heard(const std::string& channel) const {
    static_cast<void>(channel);
    return true;
  }
  // Grows whenever is_heard() may say something else than before.
  virtual uint64_t audience() const { return 0; }

  // Whether a message may get lost on its way to a listener that takes its messages.
  virtual bool loses_messages() const { return false; }

  // Messages that could not be sent until now.
  virtual uint64_t failed() const { return 0; }
  // Messages that listeners did not get, since newer ones replaced them.
  virtual uint64_t replaced() const { return 0; }
};

}  // namespace ruedo
