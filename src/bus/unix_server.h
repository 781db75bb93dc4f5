// The bus as a Unix-domain socket: for programs of one user on one machine.
//
// The socket has mode 0600, and the kernel names its peer: no other user reads or sends.
// The frames are tcpq's (tcpq_wire.h). Messages wait for flush(), and then go to each client in
// one call of the system; messages that a client does not read at once are kept for it, in order.
// Once more than kMostOld bytes wait for a client, messages on conflated channels that newer ones
// replace are taken out; the process that started this one keeps all of them, since a run does not
// leave it behind. A client that falls kMostBehind behind loses whole messages. Both are logged.
#pragma once

#include <atomic>
#include <chrono>
#include <list>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_set>
#include <vector>

#include "bus/lcm_url.h"
#include "bus/tcpq_wire.h"
#include "ruedo/bus.h"
#include "system/file_handle.h"
#include "system/leftovers.h"

namespace ruedo::bus {

class UnixServer : public Bus {
 public:
  static constexpr size_t kMostClients = 256;
  static constexpr size_t kMostOld = size_t{256} << 10;    // bytes
  static constexpr size_t kMostBehind = size_t{64} << 20;  // bytes that one client has not taken
  static constexpr size_t kMostHeld =
      size_t{256} << 20;  // bytes that wait for clients, or belong to messages that are incomplete

  // Makes the socket; a file that a server left behind is replaced. Throws EnvironmentError when
  // the path is served, or cannot be.
  explicit UnixServer(const LcmUrl& url);
  ~UnixServer() override;  // removes the socket

  void publish(const std::string& channel, const uint8_t* data, size_t size) override;
  void flush() override;
  void listen(const std::vector<std::string>& channels, Handler handler,
              const std::vector<std::string>& own = {}) override;
  void listen_to(const std::vector<std::string>& channels,
                 const std::vector<std::string>& own = {}) override;
  void conflate(const std::vector<std::string>& channels) override;
  void keep_all_for_launcher() override;
  // Sends what was published, for at most two seconds, and closes all connections.
  void stop() override;
  uint64_t failed() const override { return failed_; }
  uint64_t replaced() const override { return replaced_; }
  bool is_heard(const std::string& channel) const override;
  uint64_t audience() const override { return audience_; }

  // Counts since the start.
  uint64_t connections() const { return connections_; }
  uint64_t refused() const { return refused_; }  // other users, one too many, or foreign programs

 private:
  using Clock = std::chrono::steady_clock;

  struct Client {
    FileHandle socket;
    Clock::time_point since;
    tcpq::Reader reader;
    tcpq::Filter filter;
    std::vector<uint8_t> rest;  // what it has not taken yet
    size_t rest_sent = 0;
    size_t frames_begin = 0;  // in rest; before it is what remains of a frame that was sent in part
    size_t most_old = kMostOld;  // then replaced messages are removed
    bool is_launcher = false;
    bool told_replaced = false;
    bool watched = false;  // for room
    bool told = false;     // that it lost messages
    bool gone = false;
    size_t behind() const { return rest.size() - rest_sent; }
  };
  struct Frame {  // in frames_
    size_t begin, size;
    std::string_view channel(const std::vector<uint8_t>& frames) const;
  };

  void serve();
  void accept_all();
  void watch_newcomers(bool wanted);
  void read_from(Client& client);
  void handle(Client& client, const tcpq::Frame& frame);
  void add(std::string_view channel, std::span<const uint8_t> data);
  void send_frames();
  void send(Client& client);
  size_t send_at_once(Client& client);
  void keep(Client& client, const Frame& frame);
  void keep(Client& client, std::span<const uint8_t> bytes);
  void take_out_replaced(Client& client);
  void send_rest(Client& client);
  void watch(Client& client);
  void sweep();
  bool drained();

  const LcmUrl url_;
  FileHandle listener_, poll_, wake_;
  Leftover leftover_;
  uint64_t inode_ = 0;
  Handler handler_;
  std::atomic<bool> stop_{false};
  std::atomic<uint64_t> failed_{0}, replaced_{0}, connections_{0}, refused_{0}, audience_{0};

  mutable std::mutex mutex_;  // of all that follows; not held while the handler runs
  std::unordered_set<std::string> channels_;  // listened to
  std::unordered_set<std::string> conflated_;
  bool launcher_gets_all_ = false;
  std::vector<uint8_t> frames_;  // published since flush()
  std::vector<Frame> index_;
  std::list<Client> clients_;
  bool newcomers_watched_ = true;
  size_t held_ = 0;  // bytes in rest of all clients
  std::vector<std::pair<std::string, std::vector<uint8_t>>>
      heard_;  // for the handler; the thread's
  std::thread thread_;
};

}  // namespace ruedo::bus
