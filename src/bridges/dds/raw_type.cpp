// The operations that Cyclone DDS needs for a type without keys whose samples are raw bytes.
#include "bridges/dds/raw_type.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string_view>
#include <vector>

#include <dds/ddsi/q_radmin.h>

#include "bridges/dds/identity.h"
#include "bridges/dds/incoming.h"

namespace ruedo::dds {
namespace {

std::atomic<uint64_t> refused{0};

// The memory for a topic's samples that are waiting, with a share for each writer, so that one that
// sends without end displaces no other's samples.
class Room {
 public:
  // False: there is no room.
  bool take(const ros2::Gid& writer, size_t size) {
    const std::lock_guard lock(mutex_);
    const auto [own, fresh] = samples_of_.try_emplace(writer, 0);
    const bool fits = own->second < kMostOfWriter && bytes_ + size <= kMostWaiting;
    if (fits) ++own->second, bytes_ += size;
    if (own->second == 0) samples_of_.erase(own);
    return fits;
  }
  void give_back(const ros2::Gid& writer, size_t size) {
    const std::lock_guard lock(mutex_);
    bytes_ -= size;
    if (const auto own = samples_of_.find(writer); --own->second == 0) samples_of_.erase(own);
  }

 private:
  std::mutex mutex_;
  size_t bytes_ = 0;
  std::map<ros2::Gid, size_t> samples_of_;
};

struct RawType : ddsi_sertype {
  std::shared_ptr<Room> room = std::make_shared<Room>();  // samples may outlive their type
};

struct RawSample : ddsi_serdata {
  ~RawSample() {
    if (room) room->give_back(writer, size);
  }
  std::shared_ptr<Room> room;  // null: takes no room
  ros2::Gid writer{};
  std::vector<uint8_t> bytes;  // with CDR's header, padded to a multiple of four
  size_t size = 0;             // without padding
  ros2::SampleIdentity identity;
  bool is_related = false;
  std::array<uint8_t, 2> vendor{};
};

RawSample* new_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, size_t size) {
  auto* sample = new RawSample;
  ddsi_serdata_init(sample, type, kind);
  sample->size = size;
  sample->bytes.resize((size + 3) / 4 * 4);
  return sample;
}

const RawSample& as_raw(const ddsi_serdata* sample) {
  return *static_cast<const RawSample*>(sample);
}

bool equal_keys(const ddsi_serdata*, const ddsi_serdata*) { return true; }
uint32_t size_of(const ddsi_serdata* sample) {
  return static_cast<uint32_t>(as_raw(sample).bytes.size());
}
void free_sample(ddsi_serdata* sample) { delete static_cast<RawSample*>(sample); }

bool is_too_large(ddsi_serdata_kind kind, size_t size) {
  const bool too_large = size > kLargestIncoming || (kind == SDK_DATA && size < 4);
  if (too_large) ++refused;
  return too_large;
}

// From the datagram that contained the sample.
DataIdentity identity_of(const nn_rdata& first) {
  const unsigned char* packet = NN_RMSG_PAYLOAD(first.rmsg);
  return identity_in({packet, NN_RDATA_PAYLOAD_OFF(&first)}, NN_RDATA_SUBMSG_OFF(&first));
}

void identify(RawSample& sample, const DataIdentity& found) {
  sample.writer = found.sample.writer;
  sample.identity = found.sample;
  sample.is_related = found.related.has_value();
  sample.vendor = found.vendor;
  if (found.related) sample.identity.writer = *found.related;
}

// Fragments are sorted by offset and may overlap.
ddsi_serdata* from_fragments(const ddsi_sertype* type, ddsi_serdata_kind kind,
                             const nn_rdata* fragment, size_t size) {
  if (is_too_large(kind, size)) return nullptr;
  const DataIdentity identity = identity_of(*fragment);
  const std::shared_ptr<Room>& room = static_cast<const RawType*>(type)->room;
  if (!room->take(identity.sample.writer, size)) {
    ++refused;
    return nullptr;
  }
  RawSample* sample = new_sample(type, kind, size);
  identify(*sample, identity);
  sample->room = room;
  uint32_t done = 0;
  for (; fragment; fragment = fragment->nextfrag) {
    if (fragment->maxp1 <= done || fragment->min > done || fragment->maxp1 > size) continue;
    const unsigned char* payload =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    std::memcpy(sample->bytes.data() + done, payload + (done - fragment->min),
                fragment->maxp1 - done);
    done = fragment->maxp1;
  }
  return sample;
}

ddsi_serdata* from_pieces(const ddsi_sertype* type, ddsi_serdata_kind kind,
                          ddsrt_msg_iovlen_t count, const ddsrt_iovec_t* pieces, size_t size) {
  if (is_too_large(kind, size)) return nullptr;
  RawSample* sample = new_sample(type, kind, size);
  size_t done = 0;
  for (size_t i = 0; i < static_cast<size_t>(count) && done < size; ++i) {
    const size_t part = std::min<size_t>(pieces[i].iov_len, size - done);
    std::memcpy(sample->bytes.data() + done, pieces[i].iov_base, part);
    done += part;
  }
  return sample;
}

ddsi_serdata* from_keyhash(const ddsi_sertype* type, const ddsi_keyhash*) {
  return new_sample(type, SDK_KEY, 0);
}

// Only called by Cyclone itself for samples of this type: to create an instance without a key.
ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void*) {
  return new_sample(type, kind, 0);
}
bool to_sample(const ddsi_serdata*, void*, void**, void*) { return true; }

void to_bytes(const ddsi_serdata* sample, size_t offset, size_t size, void* out) {
  std::memcpy(out, as_raw(sample).bytes.data() + offset, size);
}

ddsi_serdata* lend_bytes(const ddsi_serdata* sample, size_t offset, size_t size,
                         ddsrt_iovec_t* out) {
  out->iov_base = const_cast<uint8_t*>(as_raw(sample).bytes.data() + offset);
  out->iov_len = size;
  return ddsi_serdata_ref(sample);
}
void give_back(ddsi_serdata* sample, const ddsrt_iovec_t*) { ddsi_serdata_unref(sample); }

ddsi_serdata* without_type(const ddsi_serdata* sample) {
  RawSample* copy = new_sample(sample->type, SDK_KEY, 0);
  copy->type = nullptr;
  return copy;
}
bool untyped_to_sample(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) {
  return true;
}

size_t print(const ddsi_sertype*, const ddsi_serdata*, char* out, size_t size) {
  return size == 0 ? 0 : (out[0] = 0, 0);
}
void no_keyhash(const ddsi_serdata*, ddsi_keyhash* out, bool) { std::memset(out, 0, sizeof *out); }

ddsi_serdata_ops sample_operations() {
  ddsi_serdata_ops ops{};
  ops.eqkey = equal_keys;
  ops.get_size = size_of;
  ops.from_ser = from_fragments;
  ops.from_ser_iov = from_pieces;
  ops.from_keyhash = from_keyhash;
  ops.from_sample = from_sample;
  ops.to_ser = to_bytes;
  ops.to_ser_ref = lend_bytes;
  ops.to_ser_unref = give_back;
  ops.to_sample = to_sample;
  ops.to_untyped = without_type;
  ops.untyped_to_sample = untyped_to_sample;
  ops.free = free_sample;
  ops.print = print;
  ops.get_keyhash = no_keyhash;
  return ops;
}

void free_type(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete static_cast<RawType*>(type);
}
// Called for types with the same name and these operations only.
bool equal_types(const ddsi_sertype*, const ddsi_sertype*) { return true; }
uint32_t hash_type(const ddsi_sertype* type) {
  return static_cast<uint32_t>(std::hash<std::string_view>{}(type->type_name));
}

ddsi_sertype_ops type_operations() {
  ddsi_sertype_ops ops{};
  ops.version = ddsi_sertype_v0;
  ops.free = free_type;
  ops.equal = equal_types;
  ops.hash = hash_type;
  return ops;
}

const ddsi_serdata_ops kSampleOperations = sample_operations();
const ddsi_sertype_ops kTypeOperations = type_operations();

}  // namespace

dds_entity_t create_raw_topic(dds_entity_t participant, const char* topic, const char* type,
                              const ddsi_sertype** sample_type) {
  auto* raw = new RawType{};
  ddsi_sertype_init_flags(raw, type, &kTypeOperations, &kSampleOperations,
                          DDSI_SERTYPE_FLAG_TOPICKIND_NO_KEY);
  raw->allowed_data_representation = DDS_DATA_REPRESENTATION_FLAG_XCDR1;
  ddsi_sertype* used = raw;
  const dds_entity_t entity =
      dds_create_topic_sertype(participant, topic, &used, nullptr, nullptr, nullptr);
  if (entity < 0) ddsi_sertype_unref(raw);
  *sample_type = used;
  return entity;
}

ddsi_serdata* make_sample(const ddsi_sertype* type, std::span<const uint8_t> bytes) {
  RawSample* sample = new_sample(type, SDK_DATA, bytes.size());
  std::memcpy(sample->bytes.data(), bytes.data(), bytes.size());
  sample->bytes[3] =
      static_cast<uint8_t>(sample->bytes.size() - bytes.size());  // number of padding bytes
  return sample;
}

ros2::Sample as_sample(const ddsi_serdata* sample) {
  const RawSample& raw = as_raw(sample);
  return {{raw.bytes.data(), raw.size}, raw.identity, raw.is_related, raw.vendor};
}

uint64_t refused_samples() { return refused; }

}  // namespace ruedo::dds
