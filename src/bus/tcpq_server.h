// The bus as a tcpq server: LCM programs connect to it over TCP, and need no multicast.
//
// One thread does all the network. publish() copies a message into a bounded queue and returns; the
// thread moves it to a ring from which each client is served at its own pace. Of conflated channels
// a client that is kMostOld behind gets the newest message; one that falls a ring behind loses
// messages. Messages of clients go to the simulation and to all subscribed clients, as on any LCM
// bus.
//
// When all places are occupied, a newcomer replaces a connection that has sent nothing. Without
// one, it replaces one of the process (on another machine: the address) with the most connections,
// provided that this has more than the newcomer's own would then have.
#pragma once

#include <atomic>
#include <chrono>
#include <list>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "bus/lcm_url.h"
#include "bus/message_ring.h"
#include "bus/tcpq_wire.h"
#include "ruedo/bus.h"
#include "system/file_handle.h"

namespace ruedo::bus {

class TcpqServer : public Bus {
 public:
  static constexpr size_t kMostClients = 512;
  static constexpr size_t kMostWaiting = 16 << 20;       // bytes between publish() and the thread
  static constexpr size_t kRing = 16 << 20;              // bytes
  static constexpr size_t kMostOld = size_t{256} << 10;  // bytes,
  static constexpr size_t kMostOldForLauncher = kRing / 2;  // which is more than a run goes ahead
  static constexpr size_t kMostReceived =
      64 << 20;  // bytes of incomplete frames, all clients together

  // Listens at the address of a tcpq URL, and nowhere else. Throws EnvironmentError if it is in
  // use.
  explicit TcpqServer(const LcmUrl& url);
  ~TcpqServer() override;

  // With port 0 in the URL: the port that the system gave.
  uint16_t port() const;

  void publish(const std::string& channel, const uint8_t* data, size_t size) override;
  void listen(const std::vector<std::string>& channels, Handler handler,
              const std::vector<std::string>& own = {}) override;
  void listen_to(const std::vector<std::string>& channels,
                 const std::vector<std::string>& own = {}) override;
  void conflate(const std::vector<std::string>& channels) override;
  // The launcher may be any of the clients: all may be further behind.
  void keep_all_for_launcher() override { most_old_ = kMostOldForLauncher; }
  // Sends all published messages, for at most half a second, and closes all connections.
  void stop() override;
  uint64_t failed() const override { return failed_; }
  uint64_t replaced() const override { return replaced_; }
  bool is_heard(const std::string& channel) const override;
  uint64_t audience() const override { return audience_; }

  // Counts since the start.
  uint64_t connections() const { return connections_; }
  uint64_t dropped_clients() const { return dropped_clients_; }
  uint64_t skipped() const { return skipped_; }  // how often a slow client lost messages

 private:
  using Clock = std::chrono::steady_clock;

  struct Client {
    FileHandle socket;
    Clock::time_point since;
    tcpq::Reader reader;
    tcpq::Filter filter;
    std::vector<int8_t> wants;  // by channel number: 0 not known yet, 1 yes, -1 no
    uint64_t place = 0;         // in the ring
    std::vector<uint8_t> rest;  // of a message that was sent in part
    size_t rest_sent = 0;
    bool told_replaced = false;
    bool blocked = false;     // waits for room in the socket
    Clock::time_point moved;  // when the socket last accepted bytes, or had none left to send
    bool spoke = false;       // published or subscribed
    bool gone = false;
  };

  void serve();
  void accept_all();
  bool make_place(const FileHandle& newcomer);
  Client* of_largest_share(const FileHandle& newcomer);
  void read_from(Client& client);
  void handle(Client& client, const tcpq::Frame& frame);
  void change(Client& client, const tcpq::Frame& frame);  // of its subscriptions
  bool is_listened_to(const std::string& channel);
  void drop(Client& client, const std::string& why);
  void collect();
  void send_all();
  void send(Client& client);
  bool send_rest(Client& client);
  bool wants(Client& client, const MessageRing::Message& message);
  bool is_replaced(Client& client, const MessageRing::Message& message);
  uint32_t number_of(std::string_view channel);
  void sweep();
  void watch(Client& client, bool for_room);
  bool drained() const;
  void look_again_soon();

  LcmUrl url_;
  FileHandle listener_, poll_, wake_;
  Handler handler_;

  mutable std::mutex mutex_;                  // of what follows, up to woken_
  std::unordered_set<std::string> channels_;  // listened to
  std::unordered_set<std::string> conflated_;
  std::vector<uint8_t> waiting_;  // frames, each behind its size
  bool woken_ = false;
  std::atomic<int> listeners_{0};  // clients with a subscription
  std::atomic<bool> stop_{false};
  std::atomic<uint64_t> failed_{0}, connections_{0}, dropped_clients_{0}, skipped_{0}, audience_{0},
      replaced_{0};
  std::atomic<size_t> most_old_{kMostOld};

  // The thread's own; but clients_ and their filters change with the mutex held, for is_heard().
  std::vector<uint8_t> collected_;
  MessageRing ring_{kRing};
  std::unordered_map<std::string, uint32_t>
      numbers_;  // of channels; beyond a bound all others share number 0
  // By channel number: where its newest message begins in the ring, where it is conflated.
  std::vector<uint64_t> newest_;
  std::list<Client> clients_;
  size_t received_ = 0;               // bytes that the readers hold
  Clock::time_point accept_again_{};  // when there was no room for one more
  Clock::time_point complained_{};
  uint64_t silent_drops_ = 0;  // since it last complained
  std::vector<uint8_t> frame_;
  std::thread thread_;
};

}  // namespace ruedo::bus
