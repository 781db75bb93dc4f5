// Sending and listening over LCM, with one thread of our own that listens.
#include "bus/lcm_bus.h"

#include <algorithm>
#include <cctype>
#include <set>

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <spdlog/spdlog.h>

#include "ruedo/errors.h"

namespace ruedo::bus {

namespace {

constexpr int kConnectMs = 2000;

}  // namespace

std::vector<std::string> channel_patterns(const std::vector<std::string>& names) {
  std::set<std::string> patterns;
  for (const std::string& name : names) {
    std::string pattern;
    for (size_t i = 0; i < name.size(); ++i) {
      if (std::isdigit(static_cast<unsigned char>(name[i]))) {
        if (i > 0 && std::isdigit(static_cast<unsigned char>(name[i - 1]))) continue;
        pattern += "[0-9]{1,9}";
      } else {
        if (!std::isalnum(static_cast<unsigned char>(name[i])) && name[i] != '_' && name[i] != '/') pattern += '\\';
        pattern += name[i];
      }
    }
    patterns.insert(pattern);
  }
  return {patterns.begin(), patterns.end()};
}

LcmBus::LcmBus(const std::string& url) : url_(parse_url(url)) {
  check_route(url_);
  if (url_.scheme == "tcpq" && !is_served(url_, kConnectMs)) {
    throw EnvironmentError("nothing listens at " + url_.str() + ": start `ruedo run` with that --lcm first");
  }
  receive_buffer_ = static_cast<size_t>(receive_buffer(url_));    // -1 becomes the largest
  out_ = std::make_unique<lcm::LCM>(url_.str());
  if (!out_->good()) throw EnvironmentError("LCM cannot open '" + url_.str() + "': run `ruedo doctor`");
}

LcmBus::~LcmBus() { stop(); }

void LcmBus::stop() {
  if (!thread_.joinable()) return;
  stopping_ = true;
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(stop_event_, &one, sizeof one);
  thread_.join();
  ::close(stop_event_);
}

void LcmBus::publish(const std::string& channel, const uint8_t* data, size_t size) {
  if (size > receive_buffer_ && !told_large_.exchange(true)) {
    spdlog::warn("a message of {} bytes on {} does not fit into a receive buffer of {} bytes: LCM clients on this host may miss it. Use JPEG, or "
                 "--lcm tcpq://127.0.0.1:7700, or run: sudo sysctl -w net.core.rmem_max=2097152, with recv_buf_size=2097152 in the URL",
                 size, channel, receive_buffer_);
  }
  if (out_->publish(channel, data, static_cast<unsigned>(size)) != 0) ++failed_;
}

void LcmBus::listen(const std::vector<std::string>& channels, Handler handler, const std::vector<std::string>& own) {
  handler_ = std::move(handler);
  know(channels, own);
  subscribe();
  stop_event_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  thread_ = std::thread([this] { read(); });
}

void LcmBus::listen_to(const std::vector<std::string>& channels, const std::vector<std::string>& own) {
  if (!thread_.joinable() || stopping_) return;
  std::unique_lock lock(mutex_);
  wanted_ = {channels, own};
  waits_ = true;
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(stop_event_, &one, sizeof one);
  taken_up_.wait(lock, [this] { return !waits_; });
}

// LCM is subscribed to in the thread that handles its messages, and the instance stays: nothing that is on its way is lost.
void LcmBus::take_up() {
  std::lock_guard lock(mutex_);
  if (!waits_) return;
  know(wanted_.first, wanted_.second);
  subscribe_missing();
  waits_ = false;
  taken_up_.notify_all();
}

void LcmBus::know(const std::vector<std::string>& channels, const std::vector<std::string>& own) {
  channels_ = {channels.begin(), channels.end()};
  patterns_ = channel_patterns(channels);
  std::vector<std::string> known = channels;
  known.insert(known.end(), own.begin(), own.end());
  unknown_pattern_ = "(?!(?:";
  for (const std::string& pattern : channel_patterns(known)) unknown_pattern_ += pattern + "|";
  unknown_pattern_ += "LCM_SELF_TEST)$).*";
  // A slow reader is none of ours: the handler only checks and stores. Room for a burst from every robot.
  queue_size_ = static_cast<int>(std::clamp<size_t>(4 * channels.size(), 64, 65536));
}

void LcmBus::subscribe() {
  if (url_.scheme == "memq") {
    in_ = std::shared_ptr<lcm::LCM>(out_.get(), [](lcm::LCM*) {});    // messages stay inside of one instance
  } else {
    in_ = std::make_shared<lcm::LCM>(url_.str());
    if (!in_->good()) throw EnvironmentError("LCM cannot open '" + url_.str() + "': run `ruedo doctor`");
  }
  subscribed_.clear();
  unknown_subscription_ = nullptr;
  unknown_subscribed_.clear();
  subscribe_missing();
  // LCM's subscribe succeeds even where nothing can be received.
  if (in_->getFileno() < 0) throw EnvironmentError("LCM cannot listen on '" + url_.str() + "': run `ruedo doctor`");
}

void LcmBus::subscribe_missing() {
  for (const std::string& pattern : patterns_) {
    if (!subscribed_.insert(pattern).second) continue;
    lcm::Subscription* subscription = in_->subscribe(pattern, &LcmBus::on_message, this);
    if (subscription) subscription->setQueueCapacity(queue_size_);
  }
  if (url_.scheme != "udpm" || unknown_subscribed_ == unknown_pattern_) return;
  if (unknown_subscription_) in_->unsubscribe(unknown_subscription_);
  unknown_subscribed_ = unknown_pattern_;
  unknown_subscription_ = in_->subscribe(unknown_pattern_, &LcmBus::on_unknown, this);
  if (unknown_subscription_) unknown_subscription_->setQueueCapacity(1024);
}

void LcmBus::read() {
  pthread_setname_np(pthread_self(), "bus");
  for (;;) {
    pollfd waiting[2] = {{in_->getFileno(), POLLIN, 0}, {stop_event_, POLLIN, 0}};
    if (::poll(waiting, 2, -1) < 0) continue;    // a signal
    if (waiting[1].revents != 0) {
      if (stopping_) return;
      uint64_t count;
      [[maybe_unused]] const ssize_t got = ::read(stop_event_, &count, sizeof count);
      take_up();
    }
    if (waiting[0].revents == 0) continue;
    if (in_->handle() != 0) ++failed_;
    if (unknown_.size() < kMostUnknownNames) continue;
    unknown_.clear();
    ++renewals_;
    try {
      subscribe();
    } catch (const std::exception& error) {
      spdlog::error("the bus is deaf: {}", error.what());
      stopping_ = true;
      take_up();
      return;
    }
  }
}

void LcmBus::on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
  if (!channels_.contains(channel)) return on_unknown(buffer, channel);    // the patterns are wider than the list
  handler_(channel, static_cast<const uint8_t*>(buffer->data), buffer->data_size);
}

void LcmBus::on_unknown(const lcm::ReceiveBuffer*, const std::string& channel) {
  unknown_.insert(std::hash<std::string>()(channel));
}

}  // namespace ruedo::bus
