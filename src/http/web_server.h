// HTTP and WebSocket for browsers and viewers, over libwebsockets: one thread, one port, everything
// bounded.
//
// Why libwebsockets: a small C library, available in every distribution, with one event loop for
// HTTP and WebSocket.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "http/bytes.h"
#include "http/guard.h"

namespace ruedo::http {

struct HttpResponse {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  Bytes body;
  bool gzip = false;     // the body is compressed
  bool lasting = false;  // may be cached by the browser
};

// One browser's WebSocket.
class Connection {
 public:
  virtual ~Connection() = default;
  // Handles a whole message; false closes the connection.
  virtual bool on_message(std::span<const uint8_t> message) = 0;
  // Puts the next message into `message`; false if none is waiting.
  virtual bool next(std::vector<uint8_t>& message, bool& text) = 0;
};

// Whether it could be served now, before any work. Throws EnvironmentError, as WebServer.
void check_port(const Address& address, const std::string& option);

// The address, and the allowed hosts.
struct WebPlace {
  Address address;
  std::string token;               // "": none is required
  std::string option = "--view";   // the option that gives the address, for messages
  std::string socket = "/socket";  // the WebSocket's path
  std::vector<std::string> protocols = {"ruedo"};  // WebSocket subprotocols
  std::vector<std::string> origins;  // other origins whose pages may open the WebSocket
  size_t most_sockets = 128;         // at once
};

struct WebHandler {
  std::function<HttpResponse(std::string_view path)> get;
  std::function<std::unique_ptr<Connection>()> open;
  std::function<void()> end;  // called before the last messages are sent
  // called every few milliseconds while there are connections; true: they may have something to
  // send
  std::function<bool()> tick;
};

class WebServer {
 public:
  // HTTP and WebSocket together. With more of either, connections of the process, or machine, with
  // the most are closed.
  static constexpr size_t kMostConnections = 320;
  static constexpr size_t kMostSilent =
      64;  // of those that have sent no request yet; beyond, the oldest is closed
  static constexpr size_t kMostMessage = size_t{1}
                                         << 20;  // bytes that a browser may send as one message
  // Made for single connections and not sent yet. With more, the others wait, and a connection that
  // reads nothing is closed.
  static constexpr size_t kMostHeld = size_t{128} << 20;
  static constexpr size_t kMostHeaders = 4096;  // bytes of a request's headers

  // Binds the port. Throws EnvironmentError, with the remedy, if it is not available.
  WebServer(WebPlace place, WebHandler handler);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  int port() const;
  // Serves until stop(); then sends what is waiting, for a moment.
  void run();
  void stop();  // any thread

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::http
