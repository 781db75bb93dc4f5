// The event loop: requests are checked (guard.h), pages are sent in chunks, sockets are written
// when they are ready.
#include "console/web_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>

#include <libwebsockets.h>
#include <spdlog/spdlog.h>

#include "core/file_handle.h"
#include "ruedo/errors.h"

namespace ruedo::console {
namespace {

constexpr lws_usec_t kTick_us = 16'000;
constexpr lws_usec_t kIdleTick_us = 250'000;
constexpr lws_usec_t kFarewell_us = 300'000;  // for the last messages to viewers
constexpr size_t kChunk = 64 * 1024;
constexpr int kMostStarts = 5;
constexpr lws_retry_bo_t kIdlePolicy = {nullptr, 0,  0,
                                        20,      60, 0};  // seconds: ping after 20, gone after 60

// Checks the port in the address, or picks a free one for 0. libwebsockets only reports that it
// failed.
int checked_port(const WebPlace& place) {
  const Address& address = place.address;
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
    throw EnvironmentError(place.option + ": " + address.host + ":" + std::to_string(address.port) +
                           " cannot be served: " + std::strerror(error) +
                           ". Another port is chosen by " + place.option + " " + address.host +
                           ":PORT, a free one by PORT 0");
  }
  return ntohs(wanted.sin_port);
}

}  // namespace

struct WebServer::Impl {
  struct Transfer {  // state of a response's body
    Bytes body;
    size_t sent = 0;
  };
  struct Socket {
    std::unique_ptr<Connection> connection;
    std::vector<uint8_t> incoming;
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
  std::map<lws*, Transfer> transfers;  // looked up only
  std::map<lws*, Socket> sockets;
  size_t open = 0;          // connections of any kind
  std::deque<lws*> silent;  // those that have not sent a request yet, oldest first
  std::vector<uint8_t> message;
  std::atomic<bool> stopping{false};
  bool over = false;

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
  int respond(lws* wsi, HttpResponse response);
  int request(lws* wsi, std::string_view path);
  int send_chunk(lws* wsi);
  int receive(lws* wsi, const uint8_t* data, size_t size);
  int write(lws* wsi);
};

int WebServer::Impl::callback(lws* wsi, lws_callback_reasons reason, void*, void* in,
                              size_t length) {
  const lws_context* of = wsi ? lws_get_context(wsi) : nullptr;
  auto* impl = of ? static_cast<Impl*>(lws_context_user(const_cast<lws_context*>(of))) : nullptr;
  return impl ? impl->dispatch(wsi, reason, in, length) : 0;
}

int WebServer::Impl::dispatch(lws* wsi, lws_callback_reasons reason, void* in, size_t length) {
  switch (reason) {
    case LWS_CALLBACK_FILTER_NETWORK_CONNECTION: return open >= kMostConnections ? 1 : 0;
    case LWS_CALLBACK_WSI_CREATE: ++open; return 0;
    case LWS_CALLBACK_SERVER_NEW_CLIENT_INSTANTIATED:
      silent.push_back(wsi);
      if (silent.size() > kMostSilent) {
        lws_set_timeout(silent.front(), PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
        silent.pop_front();
      }
      return 0;
    case LWS_CALLBACK_WSI_DESTROY:
      --open;
      std::erase(silent, wsi);
      transfers.erase(wsi);
      sockets.erase(wsi);
      return 0;
    case LWS_CALLBACK_HTTP:
      std::erase(silent, wsi);
      return request(wsi, {static_cast<const char*>(in), length});
    case LWS_CALLBACK_HTTP_WRITEABLE: return send_chunk(wsi);
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      std::erase(silent, wsi);
      if (header(wsi, WSI_TOKEN_GET_URI) != place.socket || !refusal(wsi, true).empty()) {
        lws_return_http_status(wsi, HTTP_STATUS_FORBIDDEN, nullptr);
        return 1;
      }
      return 0;
    case LWS_CALLBACK_ESTABLISHED: {
      Socket socket{handler.open(), {}};
      if (!socket.connection) return -1;
      sockets.emplace(wsi, std::move(socket));
      lws_callback_on_writable(wsi);
      lws_sul_schedule(context, 0, &timer.entry, &on_timer, kTick_us);
      return 0;
    }
    case LWS_CALLBACK_RECEIVE: return receive(wsi, static_cast<const uint8_t*>(in), length);
    case LWS_CALLBACK_SERVER_WRITEABLE: return write(wsi);
    case LWS_CALLBACK_CLOSED: sockets.erase(wsi); return 0;
    default: return 0;
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
  if (impl.handler.tick()) {
    for (auto& [wsi, socket] : impl.sockets) lws_callback_on_writable(wsi);
  }
  lws_sul_schedule(impl.context, 0, entry, &on_timer,
                   impl.sockets.empty() ? kIdleTick_us : kTick_us);
}

int WebServer::Impl::request(lws* wsi, std::string_view path) {
  const auto text = [](int status, const std::string& words) {
    HttpResponse response;
    response.status = status;
    response.body = std::make_shared<const std::vector<uint8_t>>(words.begin(), words.end());
    return response;
  };
  if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) <= 0)
    return respond(wsi, text(405, "Only GET is served here.\n"));
  if (const std::string why = refusal(wsi, false); !why.empty())
    return respond(wsi, text(403, why + "\n"));
  return respond(wsi, handler.get(path));
}

int WebServer::Impl::respond(lws* wsi, HttpResponse response) {
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
  add("cache-control:", response.lasting ? "private, max-age=86400" : "no-store");
  if (response.gzip) add("content-encoding:", "gzip");
  if (!place.token.empty() && response.status == 200)
    add("set-cookie:", "ruedo_token=" + place.token + "; HttpOnly; SameSite=Strict; Path=/");
  if (!fits || lws_finalize_write_http_header(wsi, start, &at, end) != 0) return 1;
  if (size == 0) return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
  transfers[wsi] = {std::move(response.body), 0};
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::Impl::send_chunk(lws* wsi) {
  const auto at = transfers.find(wsi);
  if (at == transfers.end()) return 0;
  Transfer& transfer = at->second;
  const size_t size = std::min(kChunk, transfer.body->size() - transfer.sent);
  const bool last = transfer.sent + size == transfer.body->size();
  message.resize(LWS_PRE + size);
  std::memcpy(message.data() + LWS_PRE, transfer.body->data() + transfer.sent, size);
  if (lws_write(wsi, message.data() + LWS_PRE, size, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
      0)
    return -1;
  transfer.sent += size;
  if (!last) {
    lws_callback_on_writable(wsi);
    return 0;
  }
  transfers.erase(at);
  return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

int WebServer::Impl::receive(lws* wsi, const uint8_t* data, size_t size) {
  const auto at = sockets.find(wsi);
  if (at == sockets.end()) return -1;
  Socket& socket = at->second;
  if (lws_is_first_fragment(wsi) != 0) socket.incoming.clear();
  if (socket.incoming.size() + size > kMostMessage) return -1;
  socket.incoming.insert(socket.incoming.end(), data, data + size);
  if (lws_is_final_fragment(wsi) == 0 || lws_remaining_packet_payload(wsi) > 0) return 0;
  if (!socket.connection->receive(socket.incoming)) return -1;
  socket.incoming.clear();
  lws_callback_on_writable(wsi);
  return 0;
}

int WebServer::Impl::write(lws* wsi) {
  const auto at = sockets.find(wsi);
  if (at == sockets.end()) return -1;
  message.assign(LWS_PRE, 0);
  bool text = false;
  if (!at->second.connection->next(message, text)) return 0;
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
  info.fd_limit_per_thread = kMostConnections + 32;
  info.max_http_header_data = kMostHeaders;
  info.max_http_header_pool = kMostConnections;
  info.timeout_secs = 10;
  info.keepalive_timeout = 15;
  info.retry_and_idle_policy = &kIdlePolicy;
  info.options = LWS_SERVER_OPTION_DISABLE_IPV6 | LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
  const WebPlace wanted = impl_->place;
  for (int start = 0; start < kMostStarts; ++start) {
    // Another program may take the port after this look: the next one finds another, or says so.
    info.port = address.port = checked_port(wanted);
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
    for (auto& [wsi, socket] : impl_->sockets) lws_callback_on_writable(wsi);
    lws_sul_schedule(impl_->context, 0, &impl_->timer.entry, &Impl::on_timer,
                     impl_->sockets.empty() ? 1 : kFarewell_us);
  }
  lws_sul_cancel(&impl_->timer.entry);
}

void WebServer::stop() {
  impl_->stopping = true;
  lws_cancel_service(impl_->context);
}

}  // namespace ruedo::console
