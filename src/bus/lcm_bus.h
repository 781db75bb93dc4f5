// The bus over LCM.
//
// An LCM instance that only sends (it never subscribes, so LCM gives it no thread), and for
// multicast a receiver of our own: a message takes one thread from the network to the handler, not
// two, and what we send ourselves wakes no one. With memq the same instance listens. A tcpq or unix
// address is a connection of our own.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <lcm/lcm-cpp.hpp>

#include "bus/datagram_loss.h"
#include "bus/lcm_url.h"
#include "bus/multicast_receiver.h"
#include "bus/stream_connection.h"
#include "ruedo/bus.h"
#include "system/file_handle.h"

namespace ruedo::bus {

class LcmBus : public Bus {
 public:
  // Opens the bus; "": $LCM_DEFAULT_URL, or LCM's default group with ttl 0. A tcpq address is that
  // of a server which is there already (tcpq_server.h makes one). Throws InputError for a bad
  // address and EnvironmentError, with the cure, when this machine has no multicast route or the
  // server is not there.
  explicit LcmBus(const std::string& url);
  ~LcmBus() override;

  void publish(const std::string& channel, const uint8_t* data, size_t size) override;
  void listen(const std::vector<std::string>& channels, Handler handler,
              const std::vector<std::string>& own = {}) override;
  void listen_to(const std::vector<std::string>& channels,
                 const std::vector<std::string>& own = {}) override;
  // To be called before listen(). Where messages stay on this machine (multicast with a TTL of 0),
  // from listen() on nothing is sent while no other program listens at the address. A new listener
  // is noticed within 50 ms, and before a message of its own is handled.
  void send_to_listeners_only();
  // For a program that only publishes: notices a server's end and reconnects, as while listening.
  void keep_connected();
  void stop() override;
  // With memq there is only this process.
  bool is_heard(const std::string&) const override { return heard_; }
  uint64_t audience() const override { return audience_; }
  // Datagrams; a stream only where its reader does not read.
  bool loses_messages() const override { return url_.scheme == "udpm"; }
  uint64_t failed() const override { return failed_; }

  const LcmUrl& url() const { return url_; }

 private:
  void tell_of_network(int error);
  void know(const std::vector<std::string>& channels);
  void open();
  void ignore_own();
  void subscribe_missing();
  std::shared_ptr<StreamConnection> stream() const;  // null: the address is of another kind
  bool take_from_stream();
  void take_up();  // what listen_to() left
  void read();
  void look_for_loss();
  void look_for_listeners();
  bool handle();  // what is there
  void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel);
  void deliver(std::string_view channel, const uint8_t* data, size_t size);

  LcmUrl url_;
  std::unique_ptr<lcm::LCM> out_;
  lcm::LCM* in_ = nullptr;  // with memq: out_
  std::unique_ptr<MulticastReceiver> multicast_;
  std::shared_ptr<StreamConnection> stream_;  // with tcpq and unix; under connecting_
  mutable std::mutex connecting_;
  std::optional<DatagramLossWatch> loss_;  // with multicast: of our listeners
  std::chrono::steady_clock::time_point next_look_, next_warning_, next_listeners_;
  bool to_listeners_only_ = false;
  uint64_t own_inode_ = 0;  // of the receiver's socket
  std::atomic<bool> heard_;
  std::atomic<uint64_t> audience_{0};
  int64_t lost_ = 0, told_lost_ = 0;     // datagrams
  size_t receive_buffer_;                // of clients with this address
  std::atomic<bool> told_large_{false};  // that a message is larger
  Handler handler_;
  std::set<std::string, std::less<>> channels_;
  std::set<std::string> subscribed_;  // patterns, by in_
  FileHandle stop_event_;             // to end, or to take up
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  std::condition_variable taken_up_;
  bool waits_ = false;               // wanted_ is to be taken up
  std::vector<std::string> wanted_;  // channels
  std::thread thread_;
  std::atomic<uint64_t> failed_{0};
  std::atomic<bool> cut_off_{false};  // without a network to send on
};

// Regular expressions that match the names: digits become runs of digits, so that a thousand robots
// with names that count up are one expression. Names that are not in the list may match too.
std::vector<std::string> channel_patterns(const std::vector<std::string>& names);

}  // namespace ruedo::bus
