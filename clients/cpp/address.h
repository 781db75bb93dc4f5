// LCM URLs: which one is meant, and whether it can be reached.
#pragma once

#include <string>

namespace ruedo::client {

struct Address {
  std::string scheme, host, port;  // host and port of a URL that names none are the scheme's own;
                                   // of unix the path is the host
  std::string options;             // from the "?" on
};
Address split(const std::string& url);

// Or LCM_DEFAULT_URL, or LCM's default with ttl 0, or TCP where multicast has no route.
std::string resolve_url(const std::string& url);
bool has_multicast_route(const std::string& group = "239.255.76.67");
bool is_claimed(
    const std::string& url);  // by a server on this machine: its claim goes with its process
bool is_served(const std::string& url);  // false for a tcpq or unix address without a listener
// Throws NoServer, with the cure. The route is checked before LCM sees the URL, because LCM's own
// self-test blocks for ten seconds where multicast has no route.
void check_reachable(const std::string& url);

}  // namespace ruedo::client
