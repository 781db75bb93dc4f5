// The event loop: requests are checked (guard.h), pages are sent in chunks, sockets are written
// when they are ready.
#include "http/web_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <strings.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <functional>
#include <map>
#include <utility>

#include <libwebsockets.h>
#include <spdlog/spdlog.h>

#include "ruedo/errors.h"
#include "system/file_handle.h"
#include "system/peer_owners.h"

namespace ruedo::http {
namespace {

constexpr lws_usec_t kTick_us = 16'000;
constexpr lws_usec_t kIdleTick_us = 250'000;
constexpr lws_usec_t kFarewell_us = 300'000;                 // for the last messages to viewers
constexpr auto kLookPause = std::chrono::milliseconds(100);  // a look takes a few milliseconds
constexpr size_t kMostOver = 32;  // that a limit is exceeded by, until the next look
constexpr auto kMostStuck = std::chrono::seconds(5);
constexpr size_t kChunk = 64 * 1024;
constexpr int kMostStarts = 5;
constexpr lws_retry_bo_t kIdlePolicy = {nullptr, 0,  0,
                                        20,      60, 0};  // seconds: ping after 20, gone after 60

// Checks the port in the address, or picks a free one for 0. libwebsockets only reports that it
// failed.
int checked_port(const Address& address, const std::string& option) {
  const FileHandle probe(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const int one = 1;
  ::setsockopt(probe.get(), SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
  sockaddr_in wanted{};
  wanted.sin_family = AF_INET;
  wanted.sin_port = htons(static_cast<uint16_t>(address.port));
  inet_pton(AF_INET, address.host.c_str(), &wanted.sin_addr);
  const bool bound =
      ::bind(probe.get(), reinterpret_cast<sockaddr*>(&wanted), sizeof wanted) == 0 &&
      ::listen(probe.get(), 1) == 0;
  const int error = errno;
  socklen_t size = sizeof wanted;
  if (bound) ::getsockname(probe.get(), reinterpret_cast<sockaddr*>(&wanted), &size);
  if (!bound) {
    throw EnvironmentError(option + ": " + address.host + ":" + std::to_string(address.port) +
                           " cannot be served: " + std::strerror(error) +
                           ". Another port is chosen by " + option + " " + address.host +
                           ":PORT, a free one by PORT 0");
  }
  return ntohs(wanted.sin_port);
}

}  // namespace

void check_port(const Address& address, const std::string& option) {
  checked_port(address, option);
}

struct WebServer::Impl {
  using Time = std::chrono::steady_clock::time_point;
  struct Peer {                              // a connection
    uint64_t number = 0;                     // in the order in which they came
    bool silent = true;                      // it has not sent a request yet
    Bytes body;                              // of the response that is being sent; null: none
    size_t sent = 0;                         // of it
    bool ends = false;                       // the connection, with it
    std::unique_ptr<Connection> connection;  // null unless it is a WebSocket
    std::vector<uint8_t> incoming;           // what has come of its next message
    size_t held = 0;  // bytes that were made for it alone, and are not known to be sent
    Time held_since;

    void reserve(size_t bytes) {
      held = bytes;
      held_since = std::chrono::steady_clock::now();
    }
  };
  struct Timer {
    lws_sorted_usec_list_t entry{};  // must be the first member: libwebsockets returns its address
    Impl* owner = nullptr;
  };

  WebPlace place;
  WebHandler handler;
  std::vector<lws_protocols> protocols;  // the last one is empty
  lws_context* context = nullptr;
  lws_vhost* vhost = nullptr;
  Timer timer;
  std::map<lws*, Peer> peers;
  uint64_t number = 0;     // of the newest
  Time next_look;          // at the peer with most
  bool postponed = false;  // somebody's message, until there is room
  std::vector<uint8_t> message;
  std::atomic<bool> stopping{false};
  bool over = false;
  bool told = false;  // that something went wrong

  // Nothing may be thrown through libwebsockets, which is C: false when that was tried.
  template <class Serve>
  bool guarded(Serve serve) {
    try {
      serve();
      return true;
    } catch (const std::exception& error) {
      if (!std::exchange(told, true))
        spdlog::error("{}: a connection is closed: {}", place.option, error.what());
      return false;
    }
  }
  static int callback(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t length);
  int dispatch(lws* wsi, lws_callback_reasons reason, void* in, size_t length);
  static void on_timer(lws_sorted_usec_list_t* entry);

  static std::string header(lws* wsi, lws_token_indexes which) {
    std::string text(static_cast<size_t>(lws_hdr_total_length(wsi, which)) + 1, '\0');
    const int copied = lws_hdr_copy(wsi, text.data(), static_cast<int>(text.size()), which);
    text.resize(copied > 0 ? static_cast<size_t>(copied) : 0);
    return text;
  }
  std::string refusal(lws* wsi, bool socket) const {
    char value[128];
    const char* given = lws_get_urlarg_by_name(wsi, "token=", value, sizeof value);
    Visit visit{header(wsi, WSI_TOKEN_HOST), header(wsi, WSI_TOKEN_ORIGIN),
                header(wsi, WSI_TOKEN_HTTP_COOKIE), given ? given : "", socket};
    if (std::find(place.origins.begin(), place.origins.end(), visit.origin) != place.origins.end())
      visit.origin.clear();
    return refuse(visit, place.address, place.token);
  }
  std::vector<lws*> oldest_first(const std::function<bool(const Peer&)>& which) const;
  size_t sockets() const {
    return static_cast<size_t>(std::count_if(peers.begin(), peers.end(), [](const auto& each) {
      return each.second.connection != nullptr;
    }));
  }
  void welcome(lws* wsi);
  void keep_to_limits();
  size_t held() const;
  void make_room();
  void dismiss(lws* wsi);
  int establish(lws* wsi, Peer& peer);
  void ask_to_write();
  int respond(lws* wsi, Peer& peer, HttpResponse response);
  static int completed(lws* wsi, Peer& peer);
  int request(lws* wsi, Peer& peer, std::string_view path);
  int send_chunk(lws* wsi, Peer& peer);
  static int read_from(lws* wsi, Peer& peer, const uint8_t* data, size_t size);
  int write(lws* wsi, Peer& peer);
};

int WebServer::Impl::callback(lws* wsi, lws_callback_reasons reason, void*, void* in,
                              size_t length) {
  const lws_context* of = wsi ? lws_get_context(wsi) : nullptr;
  auto* impl = of ? static_cast<Impl*>(lws_context_user(const_cast<lws_context*>(of))) : nullptr;
  int result = 0;
  const bool done =
      !impl || impl->guarded([&] { result = impl->dispatch(wsi, reason, in, length); });
  return done ? result : -1;
}

int WebServer::Impl::dispatch(lws* wsi, lws_callback_reasons reason, void* in, size_t length) {
  switch (reason) {
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED: welcome(wsi); return 0;
    case LWS_CALLBACK_WSI_DESTROY: peers.erase(wsi); return 0;
    case LWS_CALLBACK_HTTP_CONFIRM_UPGRADE:  // not to HTTP/2: a connection would become many
      return ::strcasecmp(static_cast<const char*>(in), "websocket") == 0 ? 0 : -1;
    case LWS_CALLBACK_HTTP:
    case LWS_CALLBACK_HTTP_WRITEABLE:
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
    case LWS_CALLBACK_ESTABLISHED:
    case LWS_CALLBACK_RECEIVE:
    case LWS_CALLBACK_SERVER_WRITEABLE: break;
    default: return 0;
  }
  const auto found = peers.find(wsi);
  if (found == peers.end()) return -1;  // it was closed to make room
  Peer& peer = found->second;
  peer.silent = false;
  switch (reason) {
    case LWS_CALLBACK_HTTP: return request(wsi, peer, {static_cast<const char*>(in), length});
    case LWS_CALLBACK_HTTP_WRITEABLE: return send_chunk(wsi, peer);
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      if (header(wsi, WSI_TOKEN_GET_URI) == place.socket && refusal(wsi, true).empty()) return 0;
      lws_return_http_status(wsi, HTTP_STATUS_FORBIDDEN, nullptr);
      return 1;
    case LWS_CALLBACK_ESTABLISHED: return establish(wsi, peer);
    case LWS_CALLBACK_RECEIVE: return read_from(wsi, peer, static_cast<const uint8_t*>(in), length);
    default: return write(wsi, peer);
  }
}

std::vector<lws*> WebServer::Impl::oldest_first(
    const std::function<bool(const Peer&)>& which) const {
  std::vector<lws*> found;
  for (const auto& [wsi, peer] : peers) {
    if (which(peer)) found.push_back(wsi);
  }
  std::sort(found.begin(), found.end(),
            [this](lws* a, lws* b) { return peers.at(a).number < peers.at(b).number; });
  return found;
}

void WebServer::Impl::welcome(lws* wsi) {
  peers[wsi].number = ++number;
  const std::vector<lws*> silent = oldest_first([](const Peer& peer) { return peer.silent; });
  if (silent.size() > kMostSilent) dismiss(silent.front());
  keep_to_limits();
}

// If there are too many, closes connections of the peers that have most.
void WebServer::Impl::keep_to_limits() {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_look) return;
  const auto keep = [&](const std::vector<lws*>& which, size_t most) {
    if (which.size() <= most) return;
    next_look = now + kLookPause;
    std::vector<int> files;
    for (lws* each : which) files.push_back(lws_get_socket_fd(each));
    for (const size_t one : who_give_way(files, most, static_cast<uint16_t>(place.address.port)))
      dismiss(which[one]);
  };
  keep(oldest_first([](const Peer& peer) { return peer.connection != nullptr; }),
       place.most_sockets);
  keep(oldest_first([](const Peer&) { return true; }), kMostConnections);
}

size_t WebServer::Impl::held() const {
  size_t bytes = 0;
  for (const auto& [wsi, peer] : peers) bytes += peer.held;
  return bytes;
}

// Closes a connection that reads nothing while others have no room.
void WebServer::Impl::make_room() {
  const Time latest = std::chrono::steady_clock::now() - kMostStuck;
  const auto is_stuck = [&](const Peer& peer) { return peer.held > 0 && peer.held_since < latest; };
  for (lws* each : oldest_first(is_stuck)) {
    if (held() > kMostHeld) dismiss(each);
  }
  if (std::exchange(postponed, false)) ask_to_write();
}

// libwebsockets may put this off, but serves it no more.
void WebServer::Impl::dismiss(lws* wsi) {
  peers.erase(wsi);
  lws_set_timeout(wsi, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
}

int WebServer::Impl::establish(lws* wsi, Peer& peer) {
  if (sockets() >= place.most_sockets + kMostOver) return -1;
  peer.connection = handler.open();
  lws_callback_on_writable(wsi);
  lws_sul_schedule(context, 0, &timer.entry, &on_timer, kTick_us);
  return 0;
}

void WebServer::Impl::ask_to_write() {
  for (const auto& [wsi, peer] : peers) {
    if (peer.connection) lws_callback_on_writable(wsi);
  }
}

void WebServer::Impl::on_timer(lws_sorted_usec_list_t* entry) {
  Impl& impl = *reinterpret_cast<Timer*>(entry)->owner;
  if (impl.stopping) {
    impl.over = true;
    lws_cancel_service(
        impl.context);  // wakes lws_service, which would go on waiting in this very call
    return;
  }
  impl.guarded([&impl] {
    impl.keep_to_limits();
    impl.make_room();
    if (impl.handler.tick()) impl.ask_to_write();
  });
  lws_sul_schedule(impl.context, 0, entry, &on_timer, impl.sockets() > 0 ? kTick_us : kIdleTick_us);
}

int WebServer::Impl::request(lws* wsi, Peer& peer, std::string_view path) {
  // Bytes after a body, or after another request than GET, are not read as the next request.
  peer.ends = lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) <= 0 ||
              lws_hdr_total_length(wsi, WSI_TOKEN_HTTP_CONTENT_LENGTH) > 0 ||
              lws_hdr_total_length(wsi, WSI_TOKEN_HTTP_TRANSFER_ENCODING) > 0;
  const auto text = [](int status, const std::string& words) {
    HttpResponse response;
    response.status = status;
    response.body = std::make_shared<const std::vector<uint8_t>>(words.begin(), words.end());
    return response;
  };
  if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) <= 0)
    return respond(wsi, peer, text(405, "Only GET is served here.\n"));
  if (const std::string why = refusal(wsi, false); !why.empty())
    return respond(wsi, peer, text(403, why + "\n"));
  if (stopping) return respond(wsi, peer, text(503, "The server is ending.\n"));
  HttpResponse response = handler.get(path);
  if (response.body.use_count() == 1) {
    if (held() > kMostHeld)
      return respond(wsi, peer, text(503, "Too much is sent now: ask again.\n"));
    peer.reserve(response.body->size());
  }
  return respond(wsi, peer, std::move(response));
}

int WebServer::Impl::respond(lws* wsi, Peer& peer, HttpResponse response) {
  std::array<uint8_t, LWS_PRE + 2048> buffer{};
  uint8_t *at = buffer.data() + LWS_PRE, *const start = at,
          *const end = buffer.data() + buffer.size() - 1;
  bool fits = true;
  const auto add = [&](const char* name, const std::string& value) {
    fits = fits && lws_add_http_header_by_name(wsi, reinterpret_cast<const unsigned char*>(name),
                                               reinterpret_cast<const unsigned char*>(value.data()),
                                               static_cast<int>(value.size()), &at, end) == 0;
  };
  const size_t size = response.body ? response.body->size() : 0;
  fits = lws_add_http_common_headers(wsi, static_cast<unsigned>(response.status),
                                     response.type.c_str(), size, &at, end) == 0;
  add("content-security-policy:",
      "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
      "frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
  add("x-content-type-options:", "nosniff");
  add("referrer-policy:", "no-referrer");
  if (peer.ends) add("connection:", "close");
  add("cache-control:", response.lasting ? "private, max-age=86400" : "no-store");
  if (response.gzip) add("content-encoding:", "gzip");
  if (!place.token.empty() && response.status == 200)
    add("set-cookie:", "ruedo_token=" + place.token + "; HttpOnly; SameSite=Strict; Path=/");
  if (!fits || lws_finalize_write_http_header(wsi, start, &at, end) != 0) return 1;
  if (size == 0) return completed(wsi, peer);
  peer.body = std::move(response.body);
  peer.sent = 0;
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::Impl::completed(lws* wsi, Peer& peer) {
  peer.body.reset();
  peer.held = 0;
  return peer.ends || lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

int WebServer::Impl::send_chunk(lws* wsi, Peer& peer) {
  if (!peer.body) return 0;
  const size_t size = std::min(kChunk, peer.body->size() - peer.sent);
  const bool last = peer.sent + size == peer.body->size();
  message.resize(LWS_PRE + size);
  std::memcpy(message.data() + LWS_PRE, peer.body->data() + peer.sent, size);
  if (lws_write(wsi, message.data() + LWS_PRE, size, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
      0)
    return -1;
  peer.sent += size;
  if (last) return completed(wsi, peer);
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::Impl::read_from(lws* wsi, Peer& peer, const uint8_t* data, size_t size) {
  if (!peer.connection) return -1;
  if (lws_is_first_fragment(wsi) != 0) peer.incoming.clear();
  if (peer.incoming.size() + size > kMostMessage) return -1;
  peer.incoming.insert(peer.incoming.end(), data, data + size);
  if (lws_is_final_fragment(wsi) == 0 || lws_remaining_packet_payload(wsi) > 0) return 0;
  if (!peer.connection->on_message(peer.incoming)) return -1;
  peer.incoming.clear();
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::Impl::write(lws* wsi, Peer& peer) {
  if (!peer.connection) return -1;
  peer.held = 0;  // libwebsockets asks for more when all before is sent
  if (held() > kMostHeld) {
    postponed = true;
    return 0;
  }
  message.assign(LWS_PRE, 0);
  bool text = false;
  if (!peer.connection->next(message, text)) return 0;
  peer.reserve(message.size());
  if (lws_write(wsi, message.data() + LWS_PRE, message.size() - LWS_PRE,
                text ? LWS_WRITE_TEXT : LWS_WRITE_BINARY) < 0)
    return -1;
  lws_callback_on_writable(wsi);  // until everything is sent
  return 0;
}

WebServer::WebServer(WebPlace place, WebHandler handler) : impl_(std::make_unique<Impl>()) {
  impl_->place = std::move(place);
  for (const std::string& name : impl_->place.protocols)
    impl_->protocols.push_back({name.c_str(), &Impl::callback, 0, 16384, 0, nullptr, 0});
  impl_->protocols.push_back({nullptr, nullptr, 0, 0, 0, nullptr, 0});
  impl_->handler = std::move(handler);
  impl_->timer.owner = impl_.get();
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  Address& address = impl_->place.address;
  info.iface = address.host == "0.0.0.0" ? nullptr : address.host.c_str();
  info.protocols = impl_->protocols.data();
  info.gid = static_cast<gid_t>(-1);
  info.uid = static_cast<uid_t>(-1);
  info.user = impl_.get();
  info.server_string = "ruedo";
  info.fd_limit_per_thread = kMostConnections + kMostOver;
  info.max_http_header_data = kMostHeaders;
  info.max_http_header_pool = kMostConnections;
  info.timeout_secs = 10;
  info.keepalive_timeout = 15;
  info.retry_and_idle_policy = &kIdlePolicy;
  info.options = LWS_SERVER_OPTION_DISABLE_IPV6 | LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  const WebPlace wanted = impl_->place;
  for (int start = 0; start < kMostStarts; ++start) {
    // Another program may take the port after this look: the next one finds another, or says so.
    info.port = address.port = checked_port(wanted.address, wanted.option);
    impl_->context = lws_create_context(&info);
    impl_->vhost = impl_->context ? lws_create_vhost(impl_->context, &info) : nullptr;
    if (impl_->vhost) return;
    if (impl_->context) lws_context_destroy(impl_->context);
  }
  throw EnvironmentError(wanted.option + ": libwebsockets cannot serve " + address.host + ":" +
                         std::to_string(address.port));
}

WebServer::~WebServer() { lws_context_destroy(impl_->context); }

int WebServer::port() const { return impl_->place.address.port; }

void WebServer::run() {
  lws_sul_schedule(impl_->context, 0, &impl_->timer.entry, &Impl::on_timer, kTick_us);
  bool farewell = false;
  while (!impl_->over && lws_service(impl_->context, 0) >= 0) {
    if (!impl_->stopping || farewell) continue;
    farewell = true;
    impl_->handler.end();
    impl_->ask_to_write();
    lws_sul_schedule(impl_->context, 0, &impl_->timer.entry, &Impl::on_timer,
                     impl_->sockets() > 0 ? kFarewell_us : 1);
  }
  lws_sul_cancel(&impl_->timer.entry);
}

void WebServer::stop() {
  impl_->stopping = true;
  lws_cancel_service(impl_->context);
}

}  // namespace ruedo::http
