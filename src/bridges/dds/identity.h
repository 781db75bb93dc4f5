// Which request a reply answers, by DDS-RPC: a parameter in the sample's inline QoS, for which
// Cyclone DDS has no API.
//
// Incoming identities are read from the datagram. Outgoing ones travel in front of the payload as
// far as the socket, where they are moved to the inline QoS: for Cyclone it is a normal sample to
// keep, send and repeat.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <dds/ddsi/ddsi_sertype.h>

#include "bridges/ros2/transport.h"

namespace ruedo::dds {

struct DataIdentity {
  ros2::SampleIdentity sample;
  std::optional<ros2::Gid> related;  // the recipient of the reply
  std::array<uint8_t, 2> vendor{};
};

// From the DATA or DATA_FRAG submessage at that offset of an RTPS message, as handed over by
// Cyclone: its GUIDs and sequence numbers are in host order already, its inline QoS is not. The
// payload is not needed, and starts where the bytes end. Missing or malformed parts are left out.
DataIdentity identity_in(std::span<const uint8_t> message, size_t submessage);

// CDR bytes with the identity that they answer; empty: too large for one datagram.
std::vector<uint8_t> with_identity(std::span<const uint8_t> cdr,
                                   const ros2::SampleIdentity& request);

// An RTPS message as sent to the network: identities are moved from payloads to the inline QoS.
std::vector<uint8_t> with_inline_identities(std::span<const uint8_t> message);

// From now on, all sockets of that type's domain send messages in this way.
void tell_identities(const ddsi_sertype& type);

}  // namespace ruedo::dds
