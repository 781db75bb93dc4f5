// Sending and listening over LCM, with one thread of our own that listens.
#include "bus/lcm_bus.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <random>
#include <system_error>

#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <spdlog/spdlog.h>

#include "bus/stream_socket.h"
#include "bus/udp_sockets.h"
#include "bus/unix_socket.h"
#include "ruedo/errors.h"

namespace ruedo::bus {

namespace {

constexpr std::chrono::milliseconds kBetweenLooks{1000}, kBetweenWarnings{60000},
    kUnheard{50};                   // between looks for listeners
constexpr int kTakenTogether = 64;  // messages between two checks whether the bus is closing
constexpr const char* kSelfTest = "LCM_SELF_TEST";
constexpr auto kSelfTestTime = std::chrono::milliseconds(50);
constexpr std::chrono::milliseconds kFirstPause{50},
    kLongestPause{1000};  // between connections to a server that is gone

FileHandle connected_to(const LcmUrl& url) {
  if (url.scheme == "unix") return connect_unix(url.host);
  std::string why;
  FileHandle socket = connect_tcp(url.host, std::to_string(url.port), why);
  if (!socket) {
    throw EnvironmentError("nothing listens at " + url.str() + " (" + why +
                           "): start `ruedo run` with that --lcm first");
  }
  return socket;
}

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
        if (!std::isalnum(static_cast<unsigned char>(name[i])) && name[i] != '_' && name[i] != '/')
          pattern += '\\';
        pattern += name[i];
      }
    }
    patterns.insert(pattern);
  }
  return {patterns.begin(), patterns.end()};
}

LcmBus::LcmBus(const std::string& url) : url_(parse_url(url)), heard_(url_.scheme != "memq") {
  check_route(url_);
  if (url_.scheme == "unix" || url_.scheme == "tcpq") {
    stream_ = std::make_shared<StreamConnection>(connected_to(url_));
    receive_buffer_ = SIZE_MAX;
    return;
  }
  receive_buffer_ = static_cast<size_t>(receive_buffer(url_));  // -1 becomes the largest
  out_ = std::make_unique<lcm::LCM>(url_.str());
  if (!out_->good())
    throw EnvironmentError("LCM cannot open '" + url_.str() + "': run `ruedo doctor`");
}

LcmBus::~LcmBus() { stop(); }

void LcmBus::send_to_listeners_only() {
  to_listeners_only_ = url_.scheme == "udpm" && url_.option("ttl", "") == "0";
}

void LcmBus::stop() {
  if (!thread_.joinable()) return;
  stopping_ = true;
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(stop_event_.get(), &one, sizeof one);
  thread_.join();
}

void LcmBus::publish(const std::string& channel, const uint8_t* data, size_t size) {
  if (to_listeners_only_ && !heard_) return;
  if (size > receive_buffer_ && !told_large_.exchange(true)) {
    spdlog::warn(
        "a message of {} bytes on {} does not fit into a receive buffer of {} bytes: LCM clients "
        "on this host may miss it. Use JPEG, or "
        "--lcm tcpq://127.0.0.1:7700, or run: sudo sysctl -w net.core.rmem_max=2097152, with "
        "recv_buf_size=2097152 in the URL",
        size, channel, receive_buffer_);
  }
  const auto stream = this->stream();
  const bool sent = stream ? stream->publish(channel, data, size)
                           : out_->publish(channel, data, static_cast<unsigned>(size)) == 0;
  if (!stream) tell_of_network(sent ? 0 : errno);
  if (!sent) ++failed_;
}

// Once when it goes, and once when it is back.
void LcmBus::tell_of_network(int error) {
  if (error == 0 && cut_off_ && cut_off_.exchange(false))
    spdlog::warn("the network is back: messages are sent on {} again", url_.str());
  const bool is_networks = error == ENETUNREACH || error == ENETDOWN || error == EHOSTUNREACH ||
                           error == ENODEV || error == EADDRNOTAVAIL;
  if (is_networks && !cut_off_.exchange(true))
    spdlog::warn(
        "{}: {}: nobody gets a message until its network is back (the interface up, with a route "
        "for multicast)",
        url_.str(), std::strerror(error));
}

void LcmBus::listen(const std::vector<std::string>& channels, Handler handler,
                    const std::vector<std::string>&) {
  handler_ = std::move(handler);
  know(channels);
  open();
  stop_event_ = FileHandle(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  thread_ = std::thread([this] { read(); });
}

void LcmBus::keep_connected() {
  if (stream_) listen({}, {});
}

void LcmBus::listen_to(const std::vector<std::string>& channels, const std::vector<std::string>&) {
  if (!thread_.joinable() || stopping_) return;
  std::unique_lock lock(mutex_);
  wanted_ = channels;
  waits_ = true;
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(stop_event_.get(), &one, sizeof one);
  taken_up_.wait(lock, [this] { return !waits_; });
}

// Subscribes in the thread that handles LCM's messages, on the same instance: no message in flight
// is lost.
void LcmBus::take_up() {
  std::lock_guard lock(mutex_);
  if (!waits_) return;
  know(wanted_);
  subscribe_missing();
  waits_ = false;
  taken_up_.notify_all();
}

void LcmBus::know(const std::vector<std::string>& channels) {
  channels_ = {channels.begin(), channels.end()};
}

void LcmBus::open() {
  if (stream_) return subscribe_missing();
  if (url_.scheme == "udpm") {
    try {
      multicast_ = std::make_unique<MulticastReceiver>(
          url_.host, url_.port, std::atoi(url_.option("recv_buf_size", "0").c_str()));
    } catch (const std::system_error& error) {
      throw EnvironmentError("cannot listen on '" + url_.str() + "' (" + error.what() +
                             "): run `ruedo doctor`");
    }
    loss_.emplace(static_cast<uint16_t>(url_.port), multicast_->file());
    ignore_own();
    own_inode_ = inode_of(multicast_->file());
    return look_for_listeners();
  }
  in_ = out_.get();  // messages stay inside of one instance
  subscribe_missing();
  // LCM's subscribe succeeds even where nothing can be received.
  if (in_->getFileno() < 0)
    throw EnvironmentError("LCM cannot listen on '" + url_.str() + "': run `ruedo doctor`");
}

// Our first message comes back, and shows the address from which LCM sends. If it does not come
// back, all our messages do, and are ignored.
void LcmBus::ignore_own() {
  uint8_t mark[16];
  std::random_device random;
  std::generate(std::begin(mark), std::end(mark), [&] { return static_cast<uint8_t>(random()); });
  publish(kSelfTest, mark, sizeof mark);
  bool own = false;
  const auto look = [&](std::string_view channel, const uint8_t* data, size_t size) {
    own = channel == kSelfTest && std::equal(data, data + size, std::begin(mark), std::end(mark));
    if (!own) deliver(channel, data, size);
  };
  const auto until = std::chrono::steady_clock::now() + kSelfTestTime;
  while (!own && std::chrono::steady_clock::now() < until) {
    pollfd waiting{multicast_->file(), POLLIN, 0};
    if (::poll(&waiting, 1, 1) > 0) multicast_->receive(look);
  }
  if (own) multicast_->ignore(multicast_->sender());
}

void LcmBus::subscribe_missing() {
  if (stream_) {
    for (const std::string& channel : channels_) {
      if (subscribed_.insert(channel).second) stream_->subscribe(channel);
    }
    return;
  }
  if (!in_) return;
  // Our handler only checks and stores, so it never blocks; the queue holds a burst from every
  // robot.
  const int queue_size = static_cast<int>(std::clamp<size_t>(4 * channels_.size(), 64, 65536));
  for (const std::string& pattern : channel_patterns({channels_.begin(), channels_.end()})) {
    if (!subscribed_.insert(pattern).second) continue;
    lcm::Subscription* subscription = in_->subscribe(pattern, &LcmBus::on_message, this);
    if (subscription) subscription->setQueueCapacity(queue_size);
  }
}

void LcmBus::read() {
  pthread_setname_np(pthread_self(), "bus");
  bool lost = false;  // tcpq: the server
  auto pause = kFirstPause;
  for (;;) {
    const int file = stream_ ? stream_->file() : multicast_ ? multicast_->file() : in_->getFileno();
    pollfd waiting[2] = {{lost ? -1 : file, POLLIN, 0}, {stop_event_.get(), POLLIN, 0}};
    const int longest = lost                    ? static_cast<int>(pause.count())
                        : !heard_ && multicast_ ? static_cast<int>(kUnheard.count())
                        : loss_                 ? static_cast<int>(kBetweenLooks.count())
                                                : -1;
    if (::poll(waiting, 2, longest) < 0) {
      if (stopping_) return;
      if (errno != EINTR) std::this_thread::sleep_for(kFirstPause);  // it may fail again
      continue;
    }
    if (loss_) look_for_loss();
    if (std::chrono::steady_clock::now() >= next_listeners_) look_for_listeners();
    if (waiting[1].revents != 0) {
      if (stopping_) return;
      uint64_t count;
      [[maybe_unused]] const ssize_t got = ::read(stop_event_.get(), &count, sizeof count);
      take_up();
    }
    if (!lost && waiting[0].revents == 0) continue;
    const bool was_lost = lost;
    lost = !handle();
    if (!lost)
      pause = kFirstPause;
    else if (was_lost)
      pause = std::min(2 * pause, kLongestPause);
    else
      spdlog::warn("{}: the server has closed the connection; it is looked for again", url_.str());
  }
}

void LcmBus::look_for_listeners() {
  if (!to_listeners_only_) return;
  const bool heard = has_listeners(static_cast<uint16_t>(url_.port), own_inode_);
  if (heard_.exchange(heard) != heard) ++audience_;
  next_listeners_ = std::chrono::steady_clock::now() + (heard ? kBetweenLooks : kUnheard);
}

// Lost datagrams mostly go unnoticed: they are reported here, with the cure.
void LcmBus::look_for_loss() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_look_) return;
  next_look_ = now + kBetweenLooks;
  lost_ += loss_->look();
  if (lost_ == told_lost_ || now < next_warning_) return;
  told_lost_ = lost_;
  next_warning_ = now + kBetweenWarnings;
  spdlog::warn(
      "{} datagrams to {} were lost on this machine: a listener did not read them "
      "in time, and the receive buffer was full; {}",
      lost_, url_.str(), cure_of_datagram_loss());
}

std::shared_ptr<StreamConnection> LcmBus::stream() const {
  const std::lock_guard lock(connecting_);
  return stream_;
}

// False when the connection is lost; the next call connects again.
bool LcmBus::take_from_stream() {
  const auto take = [this](std::string_view channel, const uint8_t* data, size_t size) {
    deliver(channel, data, size);
  };
  if (!stream_->is_over()) {
    stream_->receive(0, take);
    return !stream_->is_over();
  }
  try {
    auto made = std::make_shared<StreamConnection>(connected_to(url_));
    const std::lock_guard lock(connecting_);
    stream_ = std::move(made);
  } catch (const EnvironmentError&) {
    return false;
  }
  subscribed_.clear();
  subscribe_missing();
  const auto until = std::chrono::steady_clock::now() + kFirstPause;  // some close at once
  while (!stream_->is_over() && std::chrono::steady_clock::now() < until) {
    if (stream_->receive(static_cast<int>(kFirstPause.count()), take)) break;
  }
  return !stream_->is_over();
}

// False when the connection was lost.
bool LcmBus::handle() {
  if (stream_) return take_from_stream();
  if (!multicast_) {
    if (in_->handle() != 0) ++failed_;
    return true;
  }
  if (!heard_) look_for_listeners();  // the sender expects an answer
  const auto take = [this](std::string_view channel, const uint8_t* data, size_t size) {
    deliver(channel, data, size);
  };
  for (int i = 0; i < kTakenTogether && multicast_->receive(take); ++i) {
  }
  return true;
}

void LcmBus::on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
  deliver(channel, static_cast<const uint8_t*>(buffer->data), buffer->data_size);
}

void LcmBus::deliver(std::string_view channel, const uint8_t* data, size_t size) {
  const auto known = channels_.find(channel);  // LCM's patterns are wider than the list
  if (known != channels_.end()) handler_(*known, data, size);
}

}  // namespace ruedo::bus
