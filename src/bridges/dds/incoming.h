// Limits on the cost of untrusted datagrams, before Cyclone DDS sees them: here those on fragments,
// with those of bridges/dds/held_samples.h and bridges/dds/known_participants.h.
//
// Cyclone keeps the datagrams of a sample until it is whole. Its limit on a sample's size holds for
// both directions, so that it has to let pictures pass, and it has none on a fragment's: fragments
// of 1 byte in datagrams of 64 kB, of samples of 2 GB that never become whole, fill any memory.
#pragma once

#include <cstdint>
#include <span>

#include <dds/ddsi/ddsi_sertype.h>

#include "bridges/ros2/transport.h"

namespace ruedo::dds {

// Of received samples: commands, requests and announcements of endpoints.
constexpr uint32_t kLargestIncoming = 4u << 20;
// Of fragments: those of the known vendors have 1 kB and more.
constexpr uint32_t kSmallestFragment = 512;
// Of a datagram, what is not payload of its fragments: other submessages, such as acknowledgements.
constexpr size_t kMostBesideFragments = 16u << 10;

// Changes an RTPS message in place. Fragments of too large a sample, or that are too small, get the
// largest sample size of all, for which Cyclone skips the sample, and continues with the next.
// Fragments with too much beside them become a submessage without meaning; readers request them
// again.
void bound_fragments(std::span<uint8_t> message);

// From now on, all sockets of that type's domain receive messages in this way. participant: of this
// program, in that domain.
void bound_incoming(const ddsi_sertype& type, const ros2::Gid& participant);

}  // namespace ruedo::dds
