// The part of a DATA of discovery about a participant or an endpoint that must be known before
// Cyclone DDS sees it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bridges/dds/rtps_message.h"

namespace ruedo::dds {

// Bytes of the announcement of one participant or endpoint.
inline constexpr size_t kMostTold = size_t{16} << 10;

using Entity = std::array<uint8_t, 4>;    // a GUID without its prefix
using Locator = std::array<uint8_t, 24>;  // a kind of address, a port, and the address

inline constexpr Entity kParticipant{0, 0, 1, 0xc1}, kAnnouncer{0, 1, 0, 0xc2},
    kSecureAnnouncer{0xff, 1, 1, 0xc2}, kOfWriters{0, 0, 3, 0xc2}, kOfReaders{0, 0, 4, 0xc2};

enum DataFlag : uint8_t { kHasInlineQos = 2, kHasPayload = 4, kHasKey = 8 };

enum Parameter : uint16_t {
  kPad = 0x00,
  kSentinel = 0x01,
  kTopicName = 0x05,
  kParticipantGuid = 0x50,
  kEndpointGuid = 0x5a,
  kKeyHash = 0x70,
  kStatus = 0x71,
};

struct ToldLocator {
  Locator locator;
  std::span<uint8_t> parameter;

  void erase() const;
};

struct DiscoveryData {
  Entity entity{};
  bool leaves = false;
  size_t topic = 0;  // a hash of its name
  std::vector<ToldLocator> locators;
};

// guid: the parameter that identifies the announced one. Old forms of addresses, and announcements
// of other participants, are removed. None: it cannot be read, is too large, or announces another
// one.
std::optional<DiscoveryData> discovery_data(const Submessage& part, const Prefix& who,
                                            Parameter guid);

}  // namespace ruedo::dds
