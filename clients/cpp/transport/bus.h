// The messages of a client: one thread that receives, raw bytes to handlers.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "callbacks/callbacks.h"
#include "ruedo/client.h"
#include "transport/transport.h"

namespace ruedo::client {

// Thread safe. Handlers run in the receiving thread, one at a time.
class Bus {
  struct State;

 public:
  using Handler = std::function<void(const uint8_t* bytes, size_t size)>;

  static constexpr std::chrono::milliseconds kTurnTime{100};

  explicit Bus(std::unique_ptr<Transport> transport);
  ~Bus();

  // turn: what the receiving thread does each time before it waits; returns for how long it may.
  // Begins to receive.
  void start(std::function<std::chrono::milliseconds()> turn = [] { return kTurnTime; });
  [[nodiscard]] Subscription subscribe(const std::string& channel, Handler handler);
  // Throws Error for a message that is larger than what a server takes from a client.
  void publish(const std::string& channel, const uint8_t* bytes, size_t size);
  static void check_size(const std::string& channel, size_t size);  // throws likewise
  bool is_connected() const;  // false: messages published now are lost
  void receive_eagerly();     // as Transport's
  void stop();  // nothing is received or published any more, but for the handler that runs
  // Stops, and waits for that handler; one that calls this does not wait for itself or another.
  void close();
  // Returns when what waits now was handled, or after a moment: more may come all the time.
  void catch_up();
  bool handling() const;         // this thread is what receives: meanwhile no other does
  static bool in_any_handler();  // or it receives for another bus

  // Lets the caller receive in its own thread: handing each message from thread to thread takes as
  // long as receiving it. While one of these lives, and a moment longer, the receiving thread
  // sleeps, and handle() runs the handlers.
  class Turn {
   public:
    explicit Turn(Bus& bus);
    ~Turn();
    void handle(
        std::chrono::steady_clock::duration timeout);  // what has come, or until the time is over

   private:
    const std::shared_ptr<State> state_;
    const void* const before_;  // that this thread received for
  };

  template <class Message>
  void publish(const std::string& channel, const Message& message) {
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    publish(channel, bytes.data(), bytes.size());
  }

 private:
  const std::shared_ptr<State> state_;  // the thread has one, too: a handler may destroy the bus
  std::thread thread_;
};

}  // namespace ruedo::client
