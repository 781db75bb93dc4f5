// Access control: addresses, host names, origins, tokens and paths, as pure functions.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace ruedo::http {

struct Address {
  std::string host = "127.0.0.1";  // dotted IPv4
  int port = 8080;                 // 0: any free port
  bool loopback() const { return host.starts_with("127."); }
};

// "", "PORT", "ADDRESS" or "ADDRESS:PORT", where "localhost" is an address. Throws InputError,
// without a file. option: the option that gave the text.
Address parse_address(const std::string& text, const std::string& option = "--view",
                      int default_port = 8080);

// A new token: 32 hexadecimal digits from the kernel's generator.
std::string make_token();

// The headers of a request.
struct Visit {
  std::string host{}, origin{}, cookie{},
      token{};          // headers Host, Origin and Cookie; the address's ?token=
  bool socket = false;  // asks for a WebSocket
};

// "" if the request is allowed; otherwise the reason. token: "" if none is required.
std::string refuse(const Visit& visit, const Address& address, const std::string& token);

// The value of a cookie; "" without one.
std::string cookie_value(std::string_view cookies, std::string_view name);

// Addresses at which browsers reach the console: of all interfaces for 0.0.0.0.
std::vector<std::string> reachable_hosts(const Address& address);

}  // namespace ruedo::http
