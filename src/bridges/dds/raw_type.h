// A Cyclone DDS type whose samples are CDR bytes as on the wire: no generated code, no copy through
// a struct.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

#include "bridges/ros2/transport.h"

namespace ruedo::dds {

// Incoming samples for which there is no room beside the waiting ones of their topic are dropped
// and counted, as those that are too large (bridges/dds/incoming.h).
inline constexpr size_t kMostWaiting = size_t{16} << 20;  // bytes
inline constexpr size_t kMostOfWriter = 100;              // samples

// A topic with that name and type name, and the type of its samples, which lives as long. Negative:
// a Cyclone error.
dds_entity_t create_raw_topic(dds_entity_t participant, const char* topic, const char* type,
                              const ddsi_sertype** sample_type);

// A sample for that topic, to be written by dds_writecdr(), which takes ownership.
ddsi_serdata* make_sample(const ddsi_sertype* type, std::span<const uint8_t> bytes);

// The bytes of a sample from dds_takecdr(), valid while it lives.
ros2::Sample as_sample(const ddsi_serdata* sample);

uint64_t refused_samples();

}  // namespace ruedo::dds
