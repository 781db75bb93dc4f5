// RTPS 2.5, 9.4 (messages), 9.6.4 (inline QoS); DDS-RPC 1.0, 7.8.2 (PID_RELATED_SAMPLE_IDENTITY).
#include "bridges/dds/identity.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include <dds/ddsi/ddsi_tran.h>

#include "base/big_endian.h"
#include "bridges/dds/sockets.h"
#include "bridges/ros2/messages/cdr.h"

namespace ruedo::dds {
namespace {

using ros2::kCdrHeader;

constexpr size_t kMessageHeader = 20, kSubmessageHeader = 4, kPrefix = 12;
constexpr size_t kIdentity = 24;         // a GUID and a sequence number
constexpr size_t kToInlineQos = 16;      // from behind its own field: two entities and a number
constexpr size_t kMostReplied = 55'000;  // bytes, of a reply with its identity
constexpr size_t kInfoSourceSize = 24;
constexpr uint8_t kInfoSource = 0x0c, kData = 0x15, kDataFrag = 0x16;
constexpr uint8_t kLittleEndian = 1, kHasInlineQos = 2;
constexpr uint16_t kSentinel = 0x0001;
constexpr uint16_t kRelated = 0x0083;      // DDS-RPC's
constexpr uint16_t kRelatedFast = 0x800f;  // Fast DDS's before 2.12 (ROS 2 Humble, Iron)
// Of the options of a CDR header, which mean nothing in plain CDR: an identity comes next.
constexpr uint8_t kMark = 0xA5;

uint16_t u16_at(std::span<const uint8_t> bytes, size_t at) {
  return static_cast<uint16_t>(bytes[at] | bytes[at + 1] << 8);
}

bool is_marked(const uint8_t* payload, size_t size) {
  return size >= kCdrHeader + kIdentity && payload[0] == 0 && payload[1] == 1 &&
         payload[2] == kMark;
}

struct Parameter {
  uint16_t id;
  std::span<const uint8_t> value;
  size_t next;
};

// None: the list ends there, or is damaged.
std::optional<Parameter> parameter_at(std::span<const uint8_t> bytes, size_t at) {
  if (at + 4 > bytes.size()) return std::nullopt;
  const uint16_t id = u16_at(bytes, at), size = u16_at(bytes, at + 2);
  if (id == kSentinel || at + 4 + size > bytes.size()) return std::nullopt;
  return Parameter{id, bytes.subspan(at + 4, size), at + 4 + size};
}

// A sequence number of RTPS: the high half first.
int64_t sequence_at(const uint8_t* bytes) {
  uint32_t halves[2];
  std::memcpy(halves, bytes, sizeof halves);
  return static_cast<int64_t>(uint64_t{halves[0]} << 32 | halves[1]);
}

// Part of a GUID that Cyclone has turned to this machine's order, word by word, as it goes over the
// wire.
void copy_turned(std::span<const uint8_t> words, uint8_t* out) {
  for (size_t i = 0; i < words.size(); i += 4) {
    uint32_t word;
    std::memcpy(&word, words.data() + i, sizeof word);
    write_big_endian(out + i, word);
  }
}

void put_related(std::vector<uint8_t>& out, uint16_t id, const uint8_t* identity) {
  out.insert(out.end(), {static_cast<uint8_t>(id), static_cast<uint8_t>(id >> 8), kIdentity, 0});
  out.insert(out.end(), identity, identity + kIdentity);
}

struct Submessage {
  size_t begin, end;
  size_t inline_qos;             // where it begins
  std::optional<size_t> marked;  // the payload with an identity
};

// None if the bytes are not a submessage of Cyclone's form.
std::optional<Submessage> submessage_at(std::span<const uint8_t> message, size_t begin) {
  if (begin + kSubmessageHeader > message.size()) return std::nullopt;
  const uint8_t flags = message[begin + 1];
  const uint16_t size = u16_at(message, begin + 2);
  Submessage found{begin, begin + kSubmessageHeader + size, 0, {}};
  if (size == 0) found.end = message.size();  // the last may say so
  if (!(flags & kLittleEndian) || found.end > message.size()) return std::nullopt;
  found.inline_qos = begin + kSubmessageHeader + 4 + kToInlineQos;
  if (message[begin] != kData || found.inline_qos > found.end) return found;
  size_t payload = found.inline_qos;
  if (flags & kHasInlineQos) {
    while (const auto parameter = parameter_at(message.first(found.end), payload))
      payload = parameter->next;
    payload += 4;  // the sentinel
  }
  if (payload <= found.end && is_marked(message.data() + payload, found.end - payload))
    found.marked = payload;
  return found;
}

void append_related(std::vector<uint8_t>& out, std::span<const uint8_t> message,
                    const Submessage& from) {
  const uint8_t* identity = message.data() + *from.marked + kCdrHeader;
  const size_t begin = out.size();
  const auto copy = [&](size_t first, size_t last) {
    out.insert(out.end(), message.begin() + static_cast<std::ptrdiff_t>(first),
               message.begin() + static_cast<std::ptrdiff_t>(last));
  };
  copy(from.begin, from.inline_qos);
  put_related(out, kRelated, identity);
  put_related(out, kRelatedFast, identity);
  copy(from.inline_qos, *from.marked);
  if (!(message[from.begin + 1] & kHasInlineQos))
    out.insert(out.end(), {static_cast<uint8_t>(kSentinel), 0, 0, 0});
  const size_t payload = out.size();
  copy(*from.marked, *from.marked + kCdrHeader);
  copy(*from.marked + kCdrHeader + kIdentity, from.end);
  out[payload + 2] = 0;
  out[begin + 1] |= kHasInlineQos;
  const size_t size = out.size() - begin - kSubmessageHeader;
  out[begin + 2] = static_cast<uint8_t>(size);
  out[begin + 3] = static_cast<uint8_t>(size >> 8);
}

// The function that all of Cyclone's UDP sockets have.
std::atomic<ddsi_tran_write_fn_t> plain_write{nullptr};

ssize_t write_with_identities(ddsi_tran_conn_t conn, const ddsi_locator_t* to, size_t count,
                              const ddsrt_iovec_t* pieces, uint32_t flags) {
  // Cyclone gives each payload as a piece of its own.
  const bool any = std::any_of(pieces, pieces + count, [](const ddsrt_iovec_t& piece) {
    return is_marked(static_cast<const uint8_t*>(piece.iov_base), piece.iov_len);
  });
  if (!any) return plain_write.load()(conn, to, count, pieces, flags);
  std::vector<uint8_t> message;
  for (size_t i = 0; i < count; ++i) {
    const auto* bytes = static_cast<const uint8_t*>(pieces[i].iov_base);
    message.insert(message.end(), bytes, bytes + pieces[i].iov_len);
  }
  std::vector<uint8_t> changed = with_inline_identities(message);
  ddsrt_iovec_t whole{};
  whole.iov_base = changed.data();
  whole.iov_len = changed.size();
  const ssize_t sent = plain_write.load()(conn, to, 1, &whole, flags);
  return sent < 0 ? sent : static_cast<ssize_t>(message.size());
}

// Who sends the submessage at that offset: by the message's head, or by the last InfoSource before
// it, of which Cyclone has turned the size alone.
void find_sender(std::span<const uint8_t> message, size_t submessage, DataIdentity& found) {
  uint8_t* prefix = found.sample.writer.data();
  std::copy_n(message.begin() + 6, found.vendor.size(), found.vendor.begin());
  copy_turned(message.subspan(8, kPrefix), prefix);
  for (size_t at = kMessageHeader; at + kInfoSourceSize <= submessage;) {
    const size_t size = kSubmessageHeader + u16_at(message, at + 2);
    if (message[at] == kInfoSource && size >= kInfoSourceSize) {
      const auto sender = message.subspan(at + 10, found.vendor.size() + kPrefix);
      std::copy_n(sender.begin(), found.vendor.size(), found.vendor.begin());
      std::copy_n(sender.begin() + found.vendor.size(), kPrefix, prefix);
    }
    at += size;
  }
}

}  // namespace

DataIdentity identity_in(std::span<const uint8_t> message, size_t submessage) {
  DataIdentity found;
  const size_t numbers = submessage + kSubmessageHeader + 4;
  if (message.size() < kMessageHeader || numbers + kToInlineQos > message.size()) return found;
  const uint8_t kind = message[submessage], flags = message[submessage + 1];
  if (kind != kData && kind != kDataFrag) return found;
  find_sender(message, submessage, found);
  copy_turned(message.subspan(numbers + 4, 4), found.sample.writer.data() + kPrefix);
  found.sample.sequence = sequence_at(message.data() + numbers + 8);
  if (!(flags & kHasInlineQos) || !(flags & kLittleEndian)) return found;
  size_t at = numbers + u16_at(message, numbers - 2);
  for (auto each = parameter_at(message, at); each; each = parameter_at(message, each->next)) {
    if ((each->id != kRelated && each->id != kRelatedFast) || each->value.size() < kIdentity)
      continue;
    ros2::Gid reader{};
    std::copy_n(each->value.begin(), reader.size(), reader.begin());
    if (reader != ros2::Gid{}) found.related = reader;
  }
  return found;
}

std::vector<uint8_t> with_identity(std::span<const uint8_t> cdr,
                                   const ros2::SampleIdentity& request) {
  std::vector<uint8_t> bytes;
  if (cdr.size() < kCdrHeader || cdr.size() + kIdentity > kMostReplied) return bytes;
  const auto sequence = static_cast<uint64_t>(request.sequence);
  const uint32_t halves[2] = {static_cast<uint32_t>(sequence >> 32),
                              static_cast<uint32_t>(sequence)};
  bytes.assign(cdr.begin(), cdr.begin() + kCdrHeader);
  bytes[2] = kMark;
  bytes.insert(bytes.end(), request.writer.begin(), request.writer.end());
  const auto* raw = reinterpret_cast<const uint8_t*>(halves);
  bytes.insert(bytes.end(), raw, raw + sizeof halves);
  bytes.insert(bytes.end(), cdr.begin() + kCdrHeader, cdr.end());
  return bytes;
}

std::vector<uint8_t> with_inline_identities(std::span<const uint8_t> message) {
  std::vector<uint8_t> out(message.begin(),
                           message.begin() + std::min(message.size(), kMessageHeader));
  size_t at = out.size();
  while (const auto submessage = submessage_at(message, at)) {
    if (submessage->marked)
      append_related(out, message, *submessage);
    else
      out.insert(out.end(), message.begin() + static_cast<std::ptrdiff_t>(submessage->begin),
                 message.begin() + static_cast<std::ptrdiff_t>(submessage->end));
    at = submessage->end;
  }
  out.insert(out.end(), message.begin() + static_cast<std::ptrdiff_t>(at), message.end());
  return out;
}

void tell_identities(const ddsi_sertype& type) {
  ruedo_visit_senders(ddsrt_atomic_ldvoidp(&type.gv), [](ddsi_tran_conn* socket) {
    if (socket->m_write_fn == write_with_identities) return;
    ddsi_tran_write_fn_t none = nullptr;
    if (plain_write.compare_exchange_strong(none, socket->m_write_fn) || none == socket->m_write_fn)
      __atomic_store_n(&socket->m_write_fn, &write_with_identities, __ATOMIC_RELEASE);
  });
}

}  // namespace ruedo::dds
