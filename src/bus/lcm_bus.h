// The bus over LCM.
//
// Two LCM instances: one only sends (it never subscribes, so LCM gives it no thread), one only listens. The second
// is made anew after many unknown channel names, which LCM would keep for ever. With memq both are one.
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <unordered_set>
#include <vector>

#include <lcm/lcm-cpp.hpp>

#include "bus/lcm_url.h"
#include "ruedo/bus.h"

namespace ruedo::bus {

class LcmBus : public Bus {
 public:
  static constexpr size_t kMostUnknownNames = 10'000;

  // Opens the bus; "": $LCM_DEFAULT_URL, or LCM's default group with ttl 0. A tcpq address is that
  // of a server which is there already (tcpq_server.h makes one). Throws InputError for a bad address and EnvironmentError,
  // with the cure, when this machine has no multicast route or the server is not there.
  explicit LcmBus(const std::string& url);
  ~LcmBus() override;

  void publish(const std::string& channel, const uint8_t* data, size_t size) override;
  void listen(const std::vector<std::string>& channels, Handler handler, const std::vector<std::string>& own = {}) override;
  void listen_to(const std::vector<std::string>& channels, const std::vector<std::string>& own = {}) override;
  void stop() override;
  uint64_t failed() const override { return failed_; }

  const LcmUrl& url() const { return url_; }
  uint64_t renewals() const { return renewals_; }

 private:
  void know(const std::vector<std::string>& channels, const std::vector<std::string>& own);
  void subscribe();
  void subscribe_missing();
  void take_up();    // what listen_to() left
  void read();
  void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel);
  void on_unknown(const lcm::ReceiveBuffer* buffer, const std::string& channel);

  LcmUrl url_;
  std::unique_ptr<lcm::LCM> out_;
  std::shared_ptr<lcm::LCM> in_;
  size_t receive_buffer_;                    // of clients with this address
  std::atomic<bool> told_large_{false};      // that a message is larger
  Handler handler_;
  std::unordered_set<std::string> channels_;
  std::vector<std::string> patterns_;        // of the channels listened to
  std::string unknown_pattern_;              // of all but those and our own
  std::set<std::string> subscribed_;         // patterns, by in_
  lcm::Subscription* unknown_subscription_ = nullptr;
  std::string unknown_subscribed_;
  int queue_size_ = 0;
  std::unordered_set<size_t> unknown_;       // hashes of names
  int stop_event_ = -1;                      // to end, or to take up
  std::atomic<bool> stopping_{false};
  std::mutex mutex_;
  std::condition_variable taken_up_;
  bool waits_ = false;                       // wanted_ is to be taken up
  std::pair<std::vector<std::string>, std::vector<std::string>> wanted_;    // channels, own
  std::thread thread_;
  std::atomic<uint64_t> failed_{0}, renewals_{0};
};

// Regular expressions that match the names: digits become runs of digits, so that a thousand robots with names that
// count up are one expression. Names that are not in the list may match too.
std::vector<std::string> channel_patterns(const std::vector<std::string>& names);

}  // namespace ruedo::bus
