// LCM URLs: chooses one, and checks whether it can be reached.
#pragma once

#include <string>

#include "bus/lcm_url.h"

namespace ruedo::client {

// Reads it as the server does. Throws NoServer if the text is not a client's address.
bus::LcmUrl read_address(const std::string& url);

// Or LCM_DEFAULT_URL, or LCM's default with ttl 0, or TCP where multicast has no route.
std::string resolve_url(const std::string& url);
bool has_multicast_route();  // to LCM's own group
bool is_claimed(
    const std::string& url);  // by a server on this machine: its claim goes with its process
bool is_served(const std::string& url);  // false for a tcpq or unix address without a listener
// Throws NoServer, with the cure. The route is checked before LCM sees the URL, because LCM's own
// self-test blocks for ten seconds where multicast has no route.
void check_reachable(const std::string& url);

}  // namespace ruedo::client
