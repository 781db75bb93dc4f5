// One thread accepts, receives, and sends what clients did not take at once; flush() sends from its
// caller's.
#include "bus/unix_server.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <unordered_map>

#include <pthread.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <spdlog/spdlog.h>

#include "bus/unix_socket.h"

namespace ruedo::bus {
namespace {

constexpr auto kGreetingTime = std::chrono::seconds(3);  // for a client to identify itself
constexpr auto kFarewellTime = std::chrono::seconds(2);
constexpr size_t kChunk = 64 * 1024;             // bytes received from one client at a time
constexpr int kMostPieces = 256;                 // of memory, in one call of the system
constexpr size_t kMostUnsent = size_t{1} << 20;  // bytes that wait for flush()

void add_to(int poll, int file, void* what) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = what;
  ::epoll_ctl(poll, EPOLL_CTL_ADD, file, &event);
}

uint64_t inode_of(const std::string& path) {
  struct stat status{};
  return ::lstat(path.c_str(), &status) == 0 ? status.st_ino : 0;
}

// Where the first frame begins at or after a place; one begins at `begin`.
size_t first_frame(const std::vector<uint8_t>& frames, size_t begin, size_t place) {
  while (begin < place) begin += tcpq::size_of_publish(&frames[begin]);
  return begin;
}

}  // namespace

std::string_view UnixServer::Frame::channel(const std::vector<uint8_t>& frames) const {
  return {reinterpret_cast<const char*>(&frames[begin + 8]), frames[begin + 7]};  // at most 63
}

UnixServer::UnixServer(const LcmUrl& url)
    : url_(url), listener_(listen_unix(url.host)), leftover_(url.host), inode_(inode_of(url.host)) {
  poll_ = FileHandle(::epoll_create1(EPOLL_CLOEXEC));
  wake_ = FileHandle(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  add_to(poll_.get(), listener_.get(), &listener_);
  add_to(poll_.get(), wake_.get(), &wake_);
}

UnixServer::~UnixServer() {
  UnixServer::stop();
  if (inode_ != 0 && inode_of(url_.host) == inode_) ::unlink(url_.host.c_str());
}

void UnixServer::listen(const std::vector<std::string>& channels, Handler handler,
                        const std::vector<std::string>&) {
  handler_ = std::move(handler);
  listen_to(channels);
  thread_ = std::thread([this] { serve(); });
}

void UnixServer::listen_to(const std::vector<std::string>& channels,
                           const std::vector<std::string>&) {
  const std::lock_guard lock(mutex_);
  channels_ = {channels.begin(), channels.end()};
}

void UnixServer::conflate(const std::vector<std::string>& channels) {
  const std::lock_guard lock(mutex_);
  conflated_ = {channels.begin(), channels.end()};
}

void UnixServer::keep_all_for_launcher() {
  const std::lock_guard lock(mutex_);
  launcher_gets_all_ = true;
}

void UnixServer::stop() {
  if (!thread_.joinable()) return;
  flush();
  stop_ = true;
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_.get(), &one, sizeof one);
  thread_.join();
}

void UnixServer::publish(const std::string& channel, const uint8_t* data, size_t size) {
  const std::lock_guard lock(mutex_);
  if (stop_ || channel.size() > tcpq::kLongestChannel || size > kMostBehind) {
    ++failed_;
    return;
  }
  if (!clients_.empty()) add(channel, {data, size});
}

bool UnixServer::is_heard(const std::string& channel) const {
  const std::lock_guard lock(mutex_);
  return std::any_of(clients_.begin(), clients_.end(), [&](const Client& client) {
    return !client.gone && client.filter.passes(channel);
  });
}

void UnixServer::flush() {
  const std::lock_guard lock(mutex_);
  send_frames();
}

// With the mutex held, as all that follows but serve().
void UnixServer::add(std::string_view channel, std::span<const uint8_t> data) {
  const size_t begin = frames_.size();
  tcpq::append_publish(frames_, channel, data);
  index_.push_back({begin, frames_.size() - begin});
  if (frames_.size() > kMostUnsent) send_frames();
}

void UnixServer::send_frames() {
  if (index_.empty()) return;
  for (Client& client : clients_) {
    if (!client.gone && !client.filter.empty()) send(client);
  }
  frames_.clear();
  index_.clear();
}

void UnixServer::send(Client& client) {
  for (size_t i = client.behind() > 0 ? 0 : send_at_once(client); i < index_.size(); ++i) {
    if (client.filter.passes(index_[i].channel(frames_))) keep(client, index_[i]);
  }
}

// Returns the index of the first frame that was not sent or kept. Frames that are adjacent in
// memory are one piece.
size_t UnixServer::send_at_once(Client& client) {
  for (size_t begin = 0, end = 0; begin < index_.size(); begin = end) {
    iovec pieces[kMostPieces];
    int count = 0;
    for (; end < index_.size(); ++end) {
      const Frame& frame = index_[end];
      if (!client.filter.passes(frame.channel(frames_))) continue;
      uint8_t* const bytes = &frames_[frame.begin];
      iovec* const last = count > 0 ? &pieces[count - 1] : nullptr;
      if (last && static_cast<uint8_t*>(last->iov_base) + last->iov_len == bytes) {
        last->iov_len += frame.size;
        continue;
      }
      if (count == kMostPieces) break;
      pieces[count++] = {bytes, frame.size};
    }
    if (count == 0) return end;
    msghdr header{};
    header.msg_iov = pieces;
    header.msg_iovlen = static_cast<size_t>(count);
    const ssize_t result = ::sendmsg(client.socket.get(), &header, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (result < 0 && errno != EAGAIN && errno != EINTR) {
      client.gone = true;
      return index_.size();
    }
    auto sent = static_cast<size_t>(std::max<ssize_t>(result, 0));
    for (size_t i = begin; i < end; ++i) {
      const Frame& frame = index_[i];
      if (!client.filter.passes(frame.channel(frames_))) continue;
      if (sent >= frame.size) {
        sent -= frame.size;
        continue;
      }
      if (sent == 0) return i;
      keep(client, {&frames_[frame.begin + sent], frame.size - sent});
      client.frames_begin = client.rest.size();
      return i + 1;
    }
  }
  return index_.size();
}

void UnixServer::keep(Client& client, const Frame& frame) {
  const bool gets_all = conflated_.empty() || (client.is_launcher && launcher_gets_all_);
  if (client.behind() + frame.size > client.most_old && !gets_all) take_out_replaced(client);
  if (client.behind() + frame.size > kMostBehind || held_ + frame.size > kMostHeld) {
    ++failed_;
    if (!std::exchange(client.told, true)) {
      spdlog::warn(
          "{}: a client does not read, and loses messages: {} MiB wait for it (shown once)",
          url_.str(), client.behind() >> 20);
    }
    return;
  }
  keep(client, {&frames_[frame.begin], frame.size});
}

void UnixServer::keep(Client& client, std::span<const uint8_t> bytes) {
  if (client.rest_sent > 0 && client.rest_sent >= client.rest.size() / 2) {
    const size_t begin = first_frame(client.rest, client.frames_begin, client.rest_sent);
    client.rest.erase(client.rest.begin(),
                      client.rest.begin() + static_cast<std::ptrdiff_t>(client.rest_sent));
    client.frames_begin = begin - client.rest_sent;
    client.rest_sent = 0;
  }
  client.rest.insert(client.rest.end(), bytes.begin(), bytes.end());
  held_ += bytes.size();
  watch(client);
}

// Messages of channels that are not conflated go first: replies do not wait for samples.
void UnixServer::take_out_replaced(Client& client) {
  const size_t begin = first_frame(client.rest, client.frames_begin, client.rest_sent);
  std::unordered_map<std::string, size_t> newest;  // of each conflated channel, where it begins
  std::vector<uint8_t> kept(client.rest.begin() + static_cast<std::ptrdiff_t>(client.rest_sent),
                            client.rest.begin() + static_cast<std::ptrdiff_t>(begin));
  const auto keep_frame = [&](size_t at) {
    const auto frame = client.rest.begin() + static_cast<std::ptrdiff_t>(at);
    kept.insert(kept.end(), frame,
                frame + static_cast<std::ptrdiff_t>(tcpq::size_of_publish(&client.rest[at])));
  };
  for (size_t at = begin; at < client.rest.size(); at += tcpq::size_of_publish(&client.rest[at])) {
    const std::string channel(Frame{at, 0}.channel(client.rest));
    if (!conflated_.contains(channel)) {
      keep_frame(at);
    } else if (!newest.insert_or_assign(channel, at).second) {
      ++replaced_;
    }
  }
  std::vector<size_t> in_order;
  for (const auto& [channel, at] : newest) in_order.push_back(at);
  std::sort(in_order.begin(), in_order.end());
  for (const size_t at : in_order) keep_frame(at);
  held_ -= client.behind() - kept.size();
  client.frames_begin = begin - client.rest_sent;
  client.rest = std::move(kept);
  client.rest_sent = 0;
  client.most_old = std::max(kMostOld, 2 * client.rest.size());
  if (!std::exchange(client.told_replaced, true)) {
    spdlog::warn(
        "{}: a client reads more slowly than messages arrive; it gets only the newest message of "
        "each sensor (shown once)",
        url_.str());
  }
}

void UnixServer::send_rest(Client& client) {
  while (client.behind() > 0 && !client.gone) {
    const ssize_t sent = ::send(client.socket.get(), &client.rest[client.rest_sent],
                                client.behind(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno == EAGAIN) break;
    if (sent < 0 && errno != EINTR) client.gone = true;
    if (sent > 0) client.rest_sent += static_cast<size_t>(sent), held_ -= static_cast<size_t>(sent);
  }
  if (client.behind() == 0) {
    std::vector<uint8_t>().swap(client.rest);
    client.rest_sent = client.frames_begin = 0;
    client.most_old = kMostOld;
  }
  watch(client);
}

void UnixServer::watch(Client& client) {
  const bool wanted = client.behind() > 0;
  if (client.watched == wanted) return;
  client.watched = wanted;
  epoll_event event{};
  event.events = wanted ? EPOLLIN | EPOLLOUT : EPOLLIN;
  event.data.ptr = &client;
  ::epoll_ctl(poll_.get(), EPOLL_CTL_MOD, client.socket.get(), &event);
}

void UnixServer::serve() {
  pthread_setname_np(pthread_self(), "bus");
  Clock::time_point end{};
  epoll_event events[64];
  for (;;) {
    const bool stopping = stop_;
    const int count = ::epoll_wait(poll_.get(), events, 64, stopping ? 10 : 500);
    {
      const std::lock_guard lock(mutex_);
      for (int i = 0; i < count; ++i) {
        if (events[i].data.ptr == &wake_) {
          uint64_t times = 0;
          [[maybe_unused]] const ssize_t read = ::read(wake_.get(), &times, sizeof times);
        } else if (events[i].data.ptr != &listener_) {
          Client& client = *static_cast<Client*>(events[i].data.ptr);
          if (events[i].events & EPOLLOUT) send_rest(client);
          if (!client.gone && events[i].events & (EPOLLIN | EPOLLHUP | EPOLLERR)) read_from(client);
        }
      }
      sweep();
      accept_all();
      send_frames();  // from client to client
    }
    if (!stopping) {
      for (const auto& [channel, data] : heard_) handler_(channel, data.data(), data.size());
    }
    heard_.clear();
    if (!stopping) continue;
    if (end == Clock::time_point{}) end = Clock::now() + kFarewellTime;
    if (drained() || Clock::now() >= end) break;
  }
  const std::lock_guard lock(mutex_);
  clients_.clear();
  listener_ = FileHandle();
}

bool UnixServer::drained() {
  const std::lock_guard lock(mutex_);
  return std::all_of(clients_.begin(), clients_.end(),
                     [](const Client& client) { return client.gone || client.behind() == 0; });
}

void UnixServer::accept_all() {
  for (;;) {
    FileHandle socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!socket) {
      if (errno == EINTR || errno == ECONNABORTED) continue;
      // Where file descriptors ran out, newcomers wait for another round.
      watch_newcomers(errno == EAGAIN);
      return;
    }
    ++connections_;
    const pid_t peer = own_peer(socket.get());
    if (peer < 0 || clients_.size() >= kMostClients) {
      ++refused_;
      continue;  // closes it
    }
    Client& client = clients_.emplace_back();
    client.socket = std::move(socket);
    client.since = Clock::now();
    client.is_launcher = peer == ::getppid();
    add_to(poll_.get(), client.socket.get(), &client);
  }
}

void UnixServer::watch_newcomers(bool wanted) {
  if (newcomers_watched_ == wanted) return;
  newcomers_watched_ = wanted;
  if (wanted)
    add_to(poll_.get(), listener_.get(), &listener_);
  else
    ::epoll_ctl(poll_.get(), EPOLL_CTL_DEL, listener_.get(), nullptr);
}

void UnixServer::read_from(Client& client) {
  uint8_t chunk[kChunk];
  const ssize_t size = ::recv(client.socket.get(), chunk, sizeof chunk, MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  if (size <= 0) {
    client.gone = true;
    return;
  }
  const bool greeted = client.reader.greeted();
  client.reader.add({chunk, static_cast<size_t>(size)});
  tcpq::Frame frame;
  tcpq::Reader::Result result;
  while ((result = client.reader.next(frame)) == tcpq::Reader::Result::frame) handle(client, frame);
  client.reader.tidy();
  if (result == tcpq::Reader::Result::broken) {
    ++refused_;
    client.gone = true;
  } else if (!greeted && client.reader.greeted()) {
    keep(client, tcpq::server_hello());
    client.frames_begin = client.rest.size();
    send_rest(client);
  }
}

void UnixServer::handle(Client& client, const tcpq::Frame& frame) {
  switch (frame.kind) {
    case tcpq::Frame::Kind::subscribe:
      send_frames();  // what was published before is not for it
      client.filter.subscribe(frame.channel);
      ++audience_;
      return;
    case tcpq::Frame::Kind::unsubscribe:
      client.filter.unsubscribe(frame.channel);
      ++audience_;
      return;
    case tcpq::Frame::Kind::publish: break;
  }
  const std::string channel(frame.channel);
  if (channels_.contains(channel))
    heard_.emplace_back(channel, std::vector<uint8_t>(frame.data.begin(), frame.data.end()));
  const auto wants = [&](const Client& other) { return other.filter.passes(channel); };
  if (std::any_of(clients_.begin(), clients_.end(), wants)) add(channel, frame.data);
}

void UnixServer::sweep() {
  const Clock::time_point now = Clock::now();
  for (auto client = clients_.begin(); client != clients_.end();) {
    if (!client->reader.greeted() && now - client->since > kGreetingTime)
      ++refused_, client->gone = true;
    if (!client->gone) {
      ++client;
      continue;
    }
    held_ -= client->behind();
    client = clients_.erase(client);
    ++audience_;
  }
}

}  // namespace ruedo::bus
