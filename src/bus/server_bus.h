// The bus that a server serves on: finds the address, claims it, and opens it as multicast, or as
// a server of tcpq or of a Unix-domain socket.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "bus/lcm_url.h"
#include "bus/url_claim.h"
#include "ruedo/bus.h"

namespace ruedo::bus {

// A server's place on the network, held for as long as this lives.
struct ServerBus {
  LcmUrl url;
  // Clients do not find the address by themselves: they need LCM_DEFAULT_URL.
  bool announce = false;
  // Why the address differs from the requested one; "": it does not.
  std::string note;
  FileHandle token;  // keeps `auto` and the client libraries' launch() from the same port
  std::unique_ptr<UrlClaim> claim;
  std::unique_ptr<Bus> bus;  // last: it is closed first
};

// `text` is an LCM URL; "auto": a free port of this machine; "auto-tcp": the same, and tcpq in any
// case; "": $LCM_DEFAULT_URL, else LCM's default group, else, where that has no route,
// tcpq://127.0.0.1:7700. `world` describes this server to others; `say` gets a line about
// each rival (rival_watch.h). Throws InputError for a
// bad address and EnvironmentError, with the cure, when it cannot be served or another server has
// it.
ServerBus open_server_bus(const std::string& text, const std::string& world,
                          std::function<void(const std::string&)> say);

// The shell's command that sends clients there.
std::string export_line(const LcmUrl& url);  // export LCM_DEFAULT_URL='...'

}  // namespace ruedo::bus
