// RTPS 2.5, 9.4.5.5 (DataFrag).
#include "dds/incoming.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <optional>
#include <vector>

#include <dds/ddsi/ddsi_tran.h>

#include "dds/sockets.h"

namespace ruedo::dds {
namespace {

constexpr size_t kMessageHeader = 20, kSubmessageHeader = 4;
constexpr uint8_t kDataFrag = 0x16, kNothing = 0xff;  // a vendor's own, which nobody knows
constexpr uint8_t kLittleEndian = 1;
// Of a DataFrag: flags, offset of the inline QoS, reader, writer, sequence number, then these.
constexpr size_t kFragmentSize = kSubmessageHeader + 26, kSampleSize = kSubmessageHeader + 28,
                 kFragmentHead = kSubmessageHeader + 32;

struct Submessage {
  std::span<uint8_t> bytes;

  bool is_fragment() const { return bytes[0] == kDataFrag && bytes.size() >= kFragmentHead; }
  uint32_t number(size_t at, size_t size) const {
    uint32_t value = 0;
    for (size_t i = 0; i < size; ++i) {
      const size_t shift = bytes[1] & kLittleEndian ? i : size - 1 - i;
      value |= uint32_t{bytes[at + i]} << 8 * shift;
    }
    return value;
  }
};

// None: nothing whole begins there.
std::optional<Submessage> submessage_at(std::span<uint8_t> message, size_t begin) {
  if (begin + kSubmessageHeader > message.size()) return std::nullopt;
  const Submessage head{message.subspan(begin)};
  const size_t size = head.number(2, 2);
  // The last may leave its size to the datagram's.
  if (size == 0)
    return begin + kFragmentHead <= message.size() && head.is_fragment()
               ? head
               : Submessage{message.subspan(begin, kSubmessageHeader)};
  if (begin + kSubmessageHeader + size > message.size()) return std::nullopt;
  return Submessage{message.subspan(begin, kSubmessageHeader + size)};
}

// The function that all of Cyclone's UDP sockets have.
std::atomic<ddsi_tran_read_fn_t> plain_read{nullptr};

ssize_t read_bounded(ddsi_tran_conn_t conn, unsigned char* into, size_t size, bool allow_spurious,
                     ddsi_locator_t* from) {
  const ssize_t got = plain_read.load()(conn, into, size, allow_spurious, from);
  if (got > 0) bound_fragments({into, static_cast<size_t>(got)});
  return got;
}

}  // namespace

void bound_fragments(std::span<uint8_t> message) {
  std::vector<Submessage> fragments;
  size_t payload = 0;
  for (size_t at = kMessageHeader; const auto each = submessage_at(message, at);) {
    at += each->bytes.size();
    if (!each->is_fragment()) continue;
    fragments.push_back(*each);
    payload += each->bytes.size() - kFragmentHead;
  }
  const bool is_hollow = message.size() > payload + kMostBesideFragments;
  for (const Submessage& fragment : fragments) {
    if (is_hollow) {
      fragment.bytes[0] = kNothing;
    } else if (fragment.number(kSampleSize, 4) > kLargestIncoming ||
               fragment.number(kFragmentSize, 2) < kSmallestFragment) {
      std::fill_n(fragment.bytes.begin() + kSampleSize, 4, std::numeric_limits<uint8_t>::max());
    }
  }
}

void bound_incoming(const ddsi_sertype& type) {
  ruedo_visit_receivers(ddsrt_atomic_ldvoidp(&type.gv), [](ddsi_tran_conn* socket) {
    if (socket->m_read_fn == read_bounded) return;
    ddsi_tran_read_fn_t none = nullptr;
    if (plain_read.compare_exchange_strong(none, socket->m_read_fn) || none == socket->m_read_fn)
      __atomic_store_n(&socket->m_read_fn, &read_bounded, __ATOMIC_RELEASE);
  });
}

}  // namespace ruedo::dds
