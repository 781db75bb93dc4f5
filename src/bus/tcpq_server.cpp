// The tcpq server's thread: accepts, receives, and serves each client from the ring.
#include "bus/tcpq_server.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <spdlog/spdlog.h>

#include "ruedo/errors.h"
#include "system/peer_owners.h"

namespace ruedo::bus {
namespace {

constexpr auto kGreetingTime = std::chrono::seconds(3);  // for a client to identify itself
constexpr auto kAcceptPause = std::chrono::milliseconds(200);
constexpr auto kFarewellTime = std::chrono::seconds(2);
constexpr auto kStuckTime =
    std::chrono::seconds(30);  // after which a client that takes nothing is disconnected
constexpr int kKeepAlive_s = 30, kKeepAliveAgain_s = 10,
              kKeepAlives = 3;                      // before a vanished machine is noticed
constexpr size_t kChunk = 64 * 1024;                // bytes received from one client at a time
constexpr int kMostChunks = 4;                      // then it is the others' turn
constexpr uint32_t kConflated = uint32_t{1} << 31;  // in the size of a frame that waits
constexpr size_t kMostNumbers = 32768;
constexpr int kMostPieces = 64;  // messages in one call of the system

void set(int socket, int level, int option, int value = 1) {
  ::setsockopt(socket, level, option, &value, sizeof value);
}

}  // namespace

TcpqServer::TcpqServer(const LcmUrl& url) : url_(url) {
  listener_ = FileHandle(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  set(listener_.get(), SOL_SOCKET,
      SO_REUSEADDR);  // connections of a server that has ended do not hold the port
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(url.port);
  ::inet_pton(AF_INET, url.host.c_str(), &address.sin_addr);
  if (::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_.get(), 128) != 0) {
    throw EnvironmentError("cannot serve " + url.str() + " (" + std::strerror(errno) +
                           "): another program has that port, or this machine has no such address; "
                           "`--lcm auto` takes a free port");
  }
  poll_ = FileHandle(::epoll_create1(EPOLL_CLOEXEC));
  wake_ = FileHandle(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  for (const int file : {listener_.get(), wake_.get()}) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.ptr =
        file == wake_.get() ? static_cast<void*>(&wake_) : static_cast<void*>(&listener_);
    ::epoll_ctl(poll_.get(), EPOLL_CTL_ADD, file, &event);
  }
}

TcpqServer::~TcpqServer() { TcpqServer::stop(); }

uint16_t TcpqServer::port() const {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  ::getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

void TcpqServer::listen(const std::vector<std::string>& channels, Handler handler,
                        const std::vector<std::string>&) {
  handler_ = std::move(handler);
  listen_to(channels);
  thread_ = std::thread([this] { serve(); });
}

void TcpqServer::listen_to(const std::vector<std::string>& channels,
                           const std::vector<std::string>&) {
  std::lock_guard lock(mutex_);
  channels_ = {channels.begin(), channels.end()};
}

void TcpqServer::stop() {
  if (!thread_.joinable()) return;
  stop_ = true;
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_.get(), &one, sizeof one);
  thread_.join();
}

void TcpqServer::publish(const std::string& channel, const uint8_t* data, size_t size) {
  if (listeners_ == 0 || stop_) return;
  if (size + channel.size() + 12 > ring_.largest()) {
    ++failed_;
    return;
  }
  bool wake = false;
  {
    std::lock_guard lock(mutex_);
    if (waiting_.size() + size > kMostWaiting) {
      ++failed_;
      return;
    }
    const size_t begin = waiting_.size();
    waiting_.resize(begin + sizeof(uint32_t));
    tcpq::append_publish(waiting_, channel, {data, size});
    auto frame = static_cast<uint32_t>(waiting_.size() - begin - sizeof(uint32_t));
    if (conflated_.contains(channel)) frame |= kConflated;
    std::memcpy(&waiting_[begin], &frame, sizeof frame);
    wake = !std::exchange(woken_, true);
  }
  const uint64_t one = 1;
  if (wake) [[maybe_unused]]
    const ssize_t written = ::write(wake_.get(), &one, sizeof one);
}

void TcpqServer::serve() {
  pthread_setname_np(pthread_self(), "bus");
  Clock::time_point end{};
  epoll_event events[64];
  for (;;) {
    const bool stopping =
        stop_;  // read before collect(), which gets all messages published before stop()
    const int count = ::epoll_wait(poll_.get(), events, 64, stopping ? 10 : 500);
    bool newcomers = false;  // after the others: making place for them ends old ones
    for (int i = 0; i < count; ++i) {
      if (events[i].data.ptr == &wake_) {
        uint64_t times = 0;
        [[maybe_unused]] const ssize_t read = ::read(wake_.get(), &times, sizeof times);
      } else if (events[i].data.ptr == &listener_) {
        newcomers = true;
      } else {
        Client& client = *static_cast<Client*>(events[i].data.ptr);
        if (events[i].events & EPOLLOUT) send(client);
        if (!client.gone && events[i].events & (EPOLLIN | EPOLLHUP | EPOLLERR)) read_from(client);
      }
    }
    if (newcomers) accept_all();
    collect();
    send_all();
    sweep();
    if (!stopping) continue;
    if (end == Clock::time_point{}) end = Clock::now() + kFarewellTime;
    if (drained() || Clock::now() >= end) break;
  }
  // A socket closed with bytes unread would be reset, and the client lose what was sent last.
  for (Client& client : clients_) {
    ::shutdown(client.socket.get(), SHUT_WR);
    uint8_t bytes[4096];
    for (int i = 0; i < 64 && ::recv(client.socket.get(), bytes, sizeof bytes, MSG_DONTWAIT) > 0;
         ++i) {
    }
  }
  std::lock_guard lock(mutex_);
  clients_.clear();
  listener_ = FileHandle();
}

bool TcpqServer::drained() const {
  return std::all_of(clients_.begin(), clients_.end(), [this](const Client& c) {
    return c.filter.empty() || (c.rest.empty() && c.place == ring_.end());
  });
}

void TcpqServer::accept_all() {
  for (;;) {
    FileHandle socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) {
      if (errno == EINTR || errno == ECONNABORTED) continue;
      if (errno != EAGAIN) look_again_soon();  // no file descriptors, no memory
      return;
    }
    ++connections_;
    if (clients_.size() >= kMostClients && !make_place(socket)) {
      ++dropped_clients_;
      continue;  // closes it
    }
    set(socket.get(), IPPROTO_TCP, TCP_NODELAY);
    set(socket.get(), IPPROTO_TCP, TCP_QUICKACK);
    set(socket.get(), SOL_SOCKET, SO_KEEPALIVE);
    set(socket.get(), IPPROTO_TCP, TCP_KEEPIDLE, kKeepAlive_s);
    set(socket.get(), IPPROTO_TCP, TCP_KEEPINTVL, kKeepAliveAgain_s);
    set(socket.get(), IPPROTO_TCP, TCP_KEEPCNT, kKeepAlives);
    Client& client = [this]() -> Client& {
      std::lock_guard lock(mutex_);
      return clients_.emplace_back();
    }();
    client.socket = std::move(socket);
    client.since = client.moved = Clock::now();
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.ptr = &client;
    ::epoll_ctl(poll_.get(), EPOLL_CTL_ADD, client.socket.get(), &event);
  }
}

// The sweep does; until then newcomers wait in the kernel.
void TcpqServer::look_again_soon() {
  accept_again_ = Clock::now() + kAcceptPause;
  ::epoll_ctl(poll_.get(), EPOLL_CTL_DEL, listener_.get(), nullptr);
}

// When all places are occupied, ends the oldest connection without a greeting, else the oldest with
// only a greeting, else one of the peer with the most. False if that peer is the newcomer's own.
bool TcpqServer::make_place(const FileHandle& newcomer) {
  for (const bool greeted : {false, true}) {
    for (Client& client : clients_) {
      if (client.gone || client.spoke || client.reader.greeted() != greeted) continue;
      drop(client, "there are too many, and this one said nothing");
      sweep();
      return true;
    }
  }
  Client* client = of_largest_share(newcomer);
  look_again_soon();  // counting the connections takes a while: a flood of newcomers must not
                      // stop the bus
  if (!client) return false;
  drop(*client, "there are too many, and its process has most of them");
  sweep();
  return true;
}

TcpqServer::Client* TcpqServer::of_largest_share(const FileHandle& newcomer) {
  std::vector<int> sockets;
  for (const Client& client : clients_) sockets.push_back(client.socket.get());
  sockets.push_back(newcomer.get());
  const size_t which = who_give_way(sockets, clients_.size(), port()).front();
  const auto client = std::next(clients_.begin(), static_cast<std::ptrdiff_t>(which));
  return client == clients_.end() ? nullptr : &*client;
}

void TcpqServer::read_from(Client& client) {
  uint8_t chunk[kChunk];
  for (int i = 0; i < kMostChunks && !client.gone; ++i) {
    const ssize_t size = ::recv(client.socket.get(), chunk, sizeof chunk, 0);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) break;
    if (size <= 0) {
      client.gone = true;
      return;
    }
    const bool greeted = client.reader.greeted();
    const size_t held = client.reader.held();
    client.reader.add({chunk, static_cast<size_t>(size)});
    tcpq::Frame frame;
    tcpq::Reader::Result result;
    while ((result = client.reader.next(frame)) == tcpq::Reader::Result::frame)
      handle(client, frame);
    client.reader.tidy();
    received_ += client.reader.held() - held;
    if (result == tcpq::Reader::Result::broken)
      return drop(client, "its data is not LCM's tcpq, or too large");
    if (received_ > kMostReceived) return drop(client, "unfinished messages take too much memory");
    if (!greeted && client.reader.greeted()) {
      client.rest = tcpq::server_hello();
      client.place = ring_.end();
    }
    if (static_cast<size_t>(size) < sizeof chunk) break;
  }
  set(client.socket.get(), IPPROTO_TCP, TCP_QUICKACK);  // the kernel falls back to delayed ones
}

void TcpqServer::handle(Client& client, const tcpq::Frame& frame) {
  client.spoke = true;
  const bool had_none = client.filter.empty();
  if (frame.kind == tcpq::Frame::Kind::publish) {
    if (!stop_) {
      const std::string channel(frame.channel);
      if (is_listened_to(channel)) handler_(channel, frame.data.data(), frame.data.size());
    }
    if (listeners_ == 0) return;
    frame_.clear();
    tcpq::append_publish(frame_, frame.channel, frame.data);
    ring_.append(number_of(frame.channel), frame_);
    return;
  }
  change(client, frame);
  if (had_none && !client.filter.empty()) client.place = ring_.end(), ++listeners_;
  if (!had_none && client.filter.empty()) --listeners_;
}

bool TcpqServer::is_listened_to(const std::string& channel) {
  std::lock_guard lock(mutex_);
  return channels_.contains(channel);
}

void TcpqServer::conflate(const std::vector<std::string>& channels) {
  const std::lock_guard lock(mutex_);
  conflated_ = {channels.begin(), channels.end()};
}

bool TcpqServer::is_heard(const std::string& channel) const {
  std::lock_guard lock(mutex_);
  return std::any_of(clients_.begin(), clients_.end(),
                     [&](const Client& client) { return client.filter.passes(channel); });
}

void TcpqServer::change(Client& client, const tcpq::Frame& frame) {
  std::lock_guard lock(mutex_);
  if (frame.kind == tcpq::Frame::Kind::subscribe)
    client.filter.subscribe(frame.channel);
  else
    client.filter.unsubscribe(frame.channel);
  client.wants.clear();
  ++audience_;
}

void TcpqServer::drop(Client& client, const std::string& why) {
  client.gone = true;
  ++dropped_clients_;
  ++silent_drops_;
  if (Clock::now() < complained_ + std::chrono::seconds(10)) return;
  spdlog::warn("{}: dropped {} client(s); the last because {}", url_.str(), silent_drops_, why);
  complained_ = Clock::now();
  silent_drops_ = 0;
}

// Takes over what was published.
void TcpqServer::collect() {
  {
    std::lock_guard lock(mutex_);
    collected_.swap(waiting_);
    woken_ = false;
  }
  for (size_t at = 0; at < collected_.size();) {
    uint32_t size = 0;
    std::memcpy(&size, &collected_[at], sizeof size);
    at += sizeof size;
    const bool conflated = size & kConflated;
    size &= ~kConflated;
    const std::span<const uint8_t> frame(&collected_[at], size);
    const uint32_t name_size = frame[7];  // at most 63
    const uint32_t number = number_of({reinterpret_cast<const char*>(&frame[8]), name_size});
    ring_.append(number, frame);
    if (newest_.size() <= number) newest_.resize(number + 64);
    newest_[number] = conflated && number > 0 ? ring_.end() : 0;
    at += size;
  }
  collected_.clear();
}

uint32_t TcpqServer::number_of(std::string_view channel) {
  const std::string name(channel);
  if (const auto found = numbers_.find(name); found != numbers_.end()) return found->second;
  if (numbers_.size() >= kMostNumbers) return 0;
  const auto number = static_cast<uint32_t>(numbers_.size() + 1);
  numbers_.emplace(name, number);
  return number;
}

bool TcpqServer::wants(Client& client, const MessageRing::Message& message) {
  const auto passes = [&] {
    return client.filter.passes(
        {reinterpret_cast<const char*>(&message.bytes[8]), message.bytes[7]});
  };
  if (message.channel == 0) return passes();
  if (client.wants.size() <= message.channel) client.wants.resize(message.channel + 64);
  int8_t& known = client.wants[message.channel];
  if (known == 0) known = passes() ? 1 : -1;
  return known > 0;
}

bool TcpqServer::is_replaced(Client& client, const MessageRing::Message& message) {
  if (ring_.end() - client.place <= most_old_ || message.next >= newest_[message.channel])
    return false;
  ++replaced_;
  if (!std::exchange(client.told_replaced, true)) {
    spdlog::warn(
        "{}: a client reads more slowly than messages arrive; it gets only the newest message of "
        "each sensor (shown once)",
        url_.str());
  }
  return true;
}

void TcpqServer::send_all() {
  for (Client& client : clients_) {
    if (!client.gone && !client.blocked) send(client);
  }
}

bool TcpqServer::send_rest(Client& client) {
  while (client.rest_sent < client.rest.size()) {
    const ssize_t sent = ::send(client.socket.get(), &client.rest[client.rest_sent],
                                client.rest.size() - client.rest_sent, MSG_NOSIGNAL);
    if (sent >= 0) {
      client.rest_sent += static_cast<size_t>(sent);
      client.moved = Clock::now();
    } else if (errno == EAGAIN) {
      watch(client, true);
      return false;
    } else if (errno != EINTR) {
      client.gone = true;
      return false;
    }
  }
  std::vector<uint8_t>().swap(client.rest);
  client.rest_sent = 0;
  return true;
}

void TcpqServer::send(Client& client) {
  if (!client.rest.empty() && !send_rest(client)) return;
  while (!client.filter.empty() && client.place < ring_.end()) {
    if (client.place < ring_.begin()) {  // overtaken
      ++skipped_;
      client.place = ring_.end();
      break;
    }
    iovec pieces[kMostPieces];
    uint64_t places[kMostPieces];
    int count = 0;
    size_t total = 0;
    while (client.place < ring_.end() && count < kMostPieces) {
      const MessageRing::Message message = ring_.at(client.place);
      if (wants(client, message) && !is_replaced(client, message)) {
        places[count] = client.place;
        pieces[count++] = {const_cast<uint8_t*>(message.bytes.data()), message.bytes.size()};
        total += message.bytes.size();
      }
      client.place = message.next;
    }
    if (count == 0) break;
    msghdr header{};
    header.msg_iov = pieces;
    header.msg_iovlen = static_cast<size_t>(count);
    const ssize_t result = ::sendmsg(client.socket.get(), &header, MSG_NOSIGNAL);
    if (result < 0 && errno != EAGAIN && errno != EINTR) {
      client.gone = true;
      return;
    }
    size_t sent = result < 0 ? 0 : static_cast<size_t>(result);
    if (sent > 0) client.moved = Clock::now();
    if (sent == total) continue;
    // The rest of a partly sent message goes to the client's own buffer: the ring may overwrite it.
    int begun = 0;
    for (; sent >= pieces[begun].iov_len; ++begun) sent -= pieces[begun].iov_len;
    client.place = places[begun];
    if (sent > 0) {
      const auto* bytes = static_cast<const uint8_t*>(pieces[begun].iov_base);
      client.rest.assign(bytes + sent, bytes + pieces[begun].iov_len);
      client.place = ring_.at(client.place).next;
    }
    watch(client, true);
    return;
  }
  watch(client, false);
}

void TcpqServer::watch(Client& client, bool for_room) {
  if (client.blocked == for_room) return;
  client.blocked = for_room;
  client.moved = Clock::now();
  epoll_event event{};
  event.events = for_room ? EPOLLIN | EPOLLOUT : EPOLLIN;
  event.data.ptr = &client;
  ::epoll_ctl(poll_.get(), EPOLL_CTL_MOD, client.socket.get(), &event);
}

// Ends connections whose peers are gone or have not identified themselves.
void TcpqServer::sweep() {
  const Clock::time_point now = Clock::now();
  for (auto client = clients_.begin(); client != clients_.end();) {
    if (!client->gone && !client->reader.greeted() && now - client->since > kGreetingTime)
      drop(*client, "it did not greet");
    if (!client->gone && client->blocked && now - client->moved > kStuckTime)
      drop(*client, "it took nothing for half a minute");
    if (!client->gone) {
      ++client;
      continue;
    }
    if (!client->filter.empty()) --listeners_;
    received_ -= client->reader.held();
    std::lock_guard lock(mutex_);
    client = clients_.erase(client);
    ++audience_;
  }
  if (accept_again_ != Clock::time_point{} && now >= accept_again_) {
    accept_again_ = {};
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.ptr = &listener_;
    ::epoll_ctl(poll_.get(), EPOLL_CTL_ADD, listener_.get(), &event);
  }
}

}  // namespace ruedo::bus
