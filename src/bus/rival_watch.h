// A bus that notices another server on its channels: two servers that publish the same channels
// confuse every client.
//
// Servers of one host are kept apart by their claims (url_claim.h); this is for those of other
// hosts, and for other senders of ruedo/info. Each rival is reported once.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ruedo/bus.h"

namespace ruedo::bus {

class RivalWatch : public Bus {
 public:
  // `say` gets one line a rival, in the bus's thread.
  RivalWatch(std::unique_ptr<Bus> bus, std::function<void(const std::string&)> say);

  void publish(const std::string& channel, const uint8_t* data, size_t size) override;
  void listen(const std::vector<std::string>& channels, Handler handler,
              const std::vector<std::string>& own = {}) override;
  void listen_to(const std::vector<std::string>& channels,
                 const std::vector<std::string>& own = {}) override;
  void flush() override { bus_->flush(); }
  void conflate(const std::vector<std::string>& channels) override { bus_->conflate(channels); }
  void keep_all_for_launcher() override { bus_->keep_all_for_launcher(); }
  void stop() override { bus_->stop(); }
  bool is_heard(const std::string& channel) const override { return bus_->is_heard(channel); }
  uint64_t audience() const override { return bus_->audience(); }
  bool loses_messages() const override { return bus_->loses_messages(); }
  uint64_t failed() const override { return bus_->failed(); }
  uint64_t replaced() const override { return bus_->replaced(); }

 private:
  void heard(const uint8_t* data, size_t size);

  std::unique_ptr<Bus> bus_;
  std::function<void(const std::string&)> say_;
  std::atomic<int64_t> run_id_{0};  // ours, as we published it
  std::vector<int64_t> rivals_;
};

}  // namespace ruedo::bus
