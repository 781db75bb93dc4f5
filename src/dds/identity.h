// Which request a reply answers, as DDS-RPC has it: a parameter of the sample's inline QoS, which
// Cyclone DDS has no call for.
//
// What comes is read from its datagram. What goes carries it ahead of its payload as far as the
// socket, where it is moved to the inline QoS: Cyclone keeps, sends and repeats it as any sample.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <dds/ddsi/ddsi_sertype.h>

#include "ros2/transport.h"

namespace ruedo::dds {

struct DataIdentity {
  ros2::SampleIdentity sample;
  std::optional<ros2::Gid> related;  // whom the reply is for
  std::array<uint8_t, 2> vendor{};
};

// Of the DATA or DATA_FRAG submessage at that offset of an RTPS message as Cyclone hands it over:
// its GUIDs and sequence numbers are in this machine's order already, its inline QoS is not. The
// payload is not needed, and begins where the bytes end. Whatever is not there, or is no such
// thing, is left out.
DataIdentity identity_in(std::span<const uint8_t> message, size_t submessage);

// CDR bytes with what they answer; empty: too many for one datagram.
std::vector<uint8_t> with_identity(std::span<const uint8_t> cdr,
                                   const ros2::SampleIdentity& request);

// An RTPS message as it goes to the network: identities that payloads carry are in the inline QoS.
std::vector<uint8_t> with_inline_identities(std::span<const uint8_t> message);

// From now on all sockets of that type's domain send messages so.
void tell_identities(const ddsi_sertype& type);

}  // namespace ruedo::dds
