// A type of Cyclone DDS whose samples are CDR bytes as they go over the wire: no generated code, no
// copy through a struct.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <dds/ddsi/ddsi_sertype.h>

#include "ros2/transport.h"

namespace ruedo::dds {

// Samples that come in and are larger are dropped, and counted.
inline constexpr size_t kMostReceived = size_t{1} << 20;
// As are those for which there is no room beside those of their topic that wait to be dealt with.
inline constexpr size_t kMostWaiting = size_t{16} << 20;  // bytes
inline constexpr size_t kMostOfWriter = 100;              // samples

// A topic with that name and that type's name, and the type for its samples, which lives as long.
// Negative: Cyclone's error.
dds_entity_t create_raw_topic(dds_entity_t participant, const char* topic, const char* type,
                              const ddsi_sertype** sample_type);

// A sample of that topic's type to be written by dds_writecdr(), which takes it over.
ddsi_serdata* make_sample(const ddsi_sertype* type, std::span<const uint8_t> bytes);

// What a sample that dds_takecdr() gave holds, while that lives.
ros2::Sample as_sample(const ddsi_serdata* sample);

uint64_t refused_samples();

}  // namespace ruedo::dds
