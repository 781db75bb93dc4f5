// Ruedo's configuration comes first: what the user's sets goes before it, but for lists, which
// Cyclone joins.
#include "bridges/dds/configuration.h"

#include <ifaddrs.h>
#include <net/if.h>
#include <sys/socket.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <map>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/input_file.h"
#include "ruedo/element.h"
#include "ruedo/errors.h"
#include "world/document/document.h"

namespace ruedo::dds {
namespace {

constexpr uint32_t kLastDomain = 232;  // higher domains have no valid ports
constexpr size_t kLargest = 1 << 20;   // bytes of a configuration
constexpr auto kLinger = "250ms";      // for readers that have not acknowledged all, at the end

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? value : "";
}

// A configuration element of Cyclone with text from the environment.
std::string peer_element(std::string_view address) {
  std::string text;
  for (const char c : address) {
    if (c == '&')
      text += "&amp;";
    else if (c == '<')
      text += "&lt;";
    else if (c == '"')
      text += "&quot;";
    else
      text += c;
  }
  return "<Peer Address=\"" + text + "\"/>";
}

// Iceoryx, through which Cyclone would share memory, waits a minute for a daemon and then ends the
// process; and Ruedo's samples have no fixed size, so that nothing would be shared.
constexpr char kWithoutSharedMemory[] =
    ",<CycloneDDS><Domain Id=\"any\"><SharedMemory><Enable>false</Enable></SharedMemory></Domain>"
    "</CycloneDDS>";

// Nodes of this machine only: multicast goes over the loopback interface, which reaches those that
// listen to multicast on any interface; nodes without multicast, as with ROS's LOCALHOST, are
// contacted individually. The other interfaces are listed because Cyclone considers a node
// unreachable if its address is on none of its own.
std::string local_interfaces() {
  constexpr size_t kMost = 3;  // Cyclone has room for four
  std::string text = "<NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/>";
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return text;
  size_t count = 0;
  std::set<std::string> names;
  for (const ifaddrs* each = list; each && count < kMost; each = each->ifa_next) {
    const bool usable = each->ifa_addr && each->ifa_addr->sa_family == AF_INET &&
                        (each->ifa_flags & IFF_UP) && !(each->ifa_flags & IFF_LOOPBACK);
    if (!usable || !names.insert(each->ifa_name).second) continue;
    text += fmt::format("<NetworkInterface name=\"{}\" multicast=\"false\"/>", each->ifa_name);
    ++count;
  }
  freeifaddrs(list);
  return text;
}

// Ports are 16 bits wide: high domains have fewer of them.
uint32_t last_participant(uint32_t domain) {
  constexpr uint32_t kLastPort = 65535, kFirst = 7411, kOfDomain = 250, kMost = 119;
  return std::min(kMost, (kLastPort - kFirst - kOfDomain * domain) / 2);
}

std::string in_lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

// Whether a <Domain> is for that one: the attribute is a number, or "any", which is its default.
bool is_for(const Element& element, uint32_t domain) {
  return std::all_of(element.attributes.begin(), element.attributes.end(), [&](const auto& each) {
    const auto& [name, value] = each;
    return in_lower_case(name) != "id" || in_lower_case(value) == "any" ||
           value == std::to_string(domain);
  });
}

void take_names(const Element& element, uint32_t domain, std::set<std::string>& names) {
  for (const auto& each : element.children) {
    const std::string name = in_lower_case(each->name);
    if (name == "domain" && !is_for(*each, domain)) continue;
    names.insert(name);
    take_names(*each, domain, names);
  }
}

std::string xml_of(const std::string& uri) {
  constexpr std::string_view kScheme = "file://";
  if (uri.starts_with('<')) return uri;
  return read_input(uri.substr(uri.starts_with(kScheme) ? kScheme.size() : 0), kLargest);
}

// Reports ignored environment variables, and those that other nodes need.
void check_environment(const CycloneOptions& options) {
  if (!environment("ROS_STATIC_PEERS").empty() && options.static_peers.empty())
    spdlog::warn("ROS 2: ignored ROS_STATIC_PEERS, as {} says to",
                 environment("ROS_LOCALHOST_ONLY") == "1" ? "ROS_LOCALHOST_ONLY"
                                                          : "ROS_AUTOMATIC_DISCOVERY_RANGE");
  if (environment("ROS_SECURITY_ENABLE") != "true") return;
  constexpr const char* kUnsupported =
      "ROS_SECURITY_ENABLE is 'true', but Ruedo does not support DDS Security";
  if (environment("ROS_SECURITY_STRATEGY") == "Enforce")
    throw InputError({}, fmt::format("{}, and ROS_SECURITY_STRATEGY is 'Enforce'; unset one of "
                                     "them to run without encryption",
                                     kUnsupported));
  spdlog::warn(
      "ROS 2: {}: its topics are neither encrypted nor authenticated, and nodes that "
      "enforce security do not see them",
      kUnsupported);
}

}  // namespace

UserSettings::UserSettings(const std::string& uris, uint32_t domain) {
  constexpr std::string_view kEnd = "</cyclonedds>";
  const std::string lower = in_lower_case(uris);
  for (size_t at = 0; (at = uris.find_first_not_of(", \t\n", at)) != uris.npos;) {
    size_t end = uris.find(',', at);
    if (uris[at] == '<') {
      end = lower.find(kEnd, at);
      if (end != lower.npos) end += kEnd.size();
    }
    end = std::min(end, uris.size());
    try {
      take_names(*world::parse_document(xml_of(uris.substr(at, end - at)), "CYCLONEDDS_URI"),
                 domain, names_);
    } catch (const InputError& error) {
      if (unreadable_.empty()) unreadable_ = error.what();
    }
    at = end;
  }
}

bool UserSettings::has(std::string_view element) const {
  return names_.contains(in_lower_case(element));
}

std::string configuration(const CycloneOptions& options) {
  std::string general, peers;
  // A second list of them would add to the user's, and no interface may occur twice.
  const UserSettings own(options.own, options.domain);
  const bool interfaces = !own.has("Interfaces") && !own.has("NetworkInterfaceAddress");
  switch (options.range) {
    case Range::off:
      if (interfaces)
        general =
            "<Interfaces><NetworkInterface address=\"127.0.0.1\" multicast=\"false\"/>"
            "</Interfaces>";
      general += "<AllowMulticast>false</AllowMulticast>";
      break;
    case Range::localhost:
      if (interfaces) general = "<Interfaces>" + local_interfaces() + "</Interfaces>";
      general +=
          "<AllowMulticast>spdp</AllowMulticast><MulticastTimeToLive>0</MulticastTimeToLive>";
      peers = peer_element("127.0.0.1");
      break;
    case Range::subnet:
    case Range::system_default: break;
  }
  for (size_t begin = 0; begin < options.static_peers.size();) {
    const size_t end = std::min(options.static_peers.find(';', begin), options.static_peers.size());
    if (end > begin)
      peers += peer_element(std::string_view(options.static_peers).substr(begin, end - begin));
    begin = end + 1;
  }
  // Pictures need few datagrams; a writer's cache is limited by its depth only. Data that arrives
  // while others have the CPU waits in the socket buffer, as far as the system allows
  // (net.core.rmem_max). Of each writer few samples are kept that are not whole, or whose turn has
  // not come; how large they may be says bridges/dds/incoming.h. One thread receives from all
  // sockets: one that waits on the multicast socket alone ends when a datagram comes, and none
  // comes where the interface is down. Without key hashes Fast DDS does not see an endpoint go, and
  // lists it for ever as _NODE_NAME_UNKNOWN_.
  return "<CycloneDDS><Domain Id=\"any\"><General>" + general +
         "<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>60000B</FragmentSize></General>"
         "<Discovery>" +
         (peers.empty()
              ? ""
              : fmt::format("<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>{}"
                            "</MaxAutoParticipantIndex><Peers>{}</Peers>",
                            last_participant(options.domain), peers)) +
         "</Discovery><Internal><MultipleReceiveThreads>false</MultipleReceiveThreads>"
         "<GenerateKeyhash>true</GenerateKeyhash>"
         "<SocketReceiveBufferSize "
         "max=\"8MiB\"/><MaxSampleSize>1GiB</MaxSampleSize>"
         "<DefragUnreliableMaxSamples>4</DefragUnreliableMaxSamples>"
         "<DefragReliableMaxSamples>4</DefragReliableMaxSamples>"
         "<PrimaryReorderMaxSamples>32</PrimaryReorderMaxSamples>"
         "<SecondaryReorderMaxSamples>32</SecondaryReorderMaxSamples><WriterLingerDuration>" +
         std::string(kLinger) +
         "</WriterLingerDuration><Watermarks><WhcHigh>1GB</"
         "WhcHigh></Watermarks></Internal>"
         "<Tracing><Verbosity>none</Verbosity></Tracing></Domain></CycloneDDS>" +
         (options.own.empty() ? "" : "," + options.own) + kWithoutSharedMemory;
}

CycloneOptions options_from_environment() {
  CycloneOptions options;
  if (const std::string text = environment("ROS_DOMAIN_ID"); !text.empty()) {
    const auto [end, error] =
        std::from_chars(text.data(), text.data() + text.size(), options.domain);
    if (error != std::errc() || end != text.data() + text.size() || options.domain > kLastDomain) {
      throw InputError({},
                       fmt::format("ROS_DOMAIN_ID is '{}'; 0 to {} is allowed", text, kLastDomain));
    }
  }
  const std::string range = environment("ROS_AUTOMATIC_DISCOVERY_RANGE");
  const std::map<std::string, Range> ranges{{"", Range::localhost},
                                            {"OFF", Range::off},
                                            {"LOCALHOST", Range::localhost},
                                            {"SUBNET", Range::subnet},
                                            {"SYSTEM_DEFAULT", Range::system_default}};
  const auto known = ranges.find(range);
  if (known == ranges.end()) {
    throw InputError({}, "ROS_AUTOMATIC_DISCOVERY_RANGE is '" + range +
                             "'; OFF, LOCALHOST, SUBNET and SYSTEM_DEFAULT are allowed");
  }
  options.range = known->second;
  const bool on_this_host_alone = environment("ROS_LOCALHOST_ONLY") == "1";  // wins in each release
  if (on_this_host_alone) options.range = Range::localhost;
  // As with any program over Cyclone DDS: what it says goes before what Ruedo says.
  options.own = environment("CYCLONEDDS_URI");
  if (options.range != Range::system_default && options.range != Range::off && !on_this_host_alone)
    options.static_peers = environment("ROS_STATIC_PEERS");
  check_environment(options);
  return options;
}

}  // namespace ruedo::dds
