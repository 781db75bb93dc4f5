#include "bridges/dds/publications.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "ruedo/errors.h"

namespace ruedo::dds {
namespace {

constexpr size_t kMostTaken = 64;       // at once
constexpr size_t kMostKnown = 100'000;  // any sender can announce any number

std::array<uint8_t, 16> bytes_of(const dds_guid_t& guid) {
  std::array<uint8_t, 16> bytes{};
  std::copy(std::begin(guid.v), std::end(guid.v), bytes.begin());
  return bytes;
}

}  // namespace

Publications::Publications(dds_entity_t participant)
    : reader_(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr)) {
  if (reader_ < 0)
    throw EnvironmentError(
        fmt::format("ROS 2: others' publications: {}", dds_strretcode(-reader_)));
  dds_guid_t guid{};
  if (dds_get_guid(participant, &guid) == DDS_RETCODE_OK) own_ = bytes_of(guid);
}

bool Publications::has(const std::string& topic, const std::string& type) {
  look();
  return counts_.contains({topic, type});
}

void Publications::forget(const Guid& writer) {
  const auto known = writers_.extract(writer);
  if (known && --counts_[known.mapped()] == 0) counts_.erase(known.mapped());
}

void Publications::look() {
  void* samples[kMostTaken] = {};
  dds_sample_info_t infos[kMostTaken];
  for (;;) {
    const dds_return_t count = dds_take(reader_, samples, infos, kMostTaken, kMostTaken);
    if (count <= 0) return;
    for (dds_return_t i = 0; i < count; ++i) {
      const auto& end = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      const Guid guid = bytes_of(end.key);
      forget(guid);  // of what is gone the key is left
      if (!infos[i].valid_data || infos[i].instance_state != DDS_IST_ALIVE) continue;
      if (bytes_of(end.participant_key) == own_ || writers_.size() >= kMostKnown) continue;
      writers_.emplace(guid, Names(end.topic_name, end.type_name));
      ++counts_[{end.topic_name, end.type_name}];
    }
    dds_return_loan(reader_, samples, count);
  }
}

}  // namespace ruedo::dds
