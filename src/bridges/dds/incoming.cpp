// RTPS 2.5, 9.4.5.5 (DataFrag).
#include "bridges/dds/incoming.h"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <limits>
#include <mutex>
#include <vector>

#include <dds/ddsi/ddsi_tran.h>

#include "bridges/dds/early_messages.h"
#include "bridges/dds/held_samples.h"
#include "bridges/dds/known_participants.h"
#include "bridges/dds/rtps_message.h"
#include "bridges/dds/sockets.h"

namespace ruedo::dds {
namespace {

// Shared by all of Cyclone's receiving threads: the accepted messages.
class Incoming {
 public:
  // A datagram has taken so many bytes that Cyclone may hold.
  void reserve(size_t bytes, std::span<const Samples> samples) {
    const std::lock_guard lock(mutex_);
    held_.add(bytes, samples);
  }
  // A message from here: the departure of a dropped participant, or an early one. 0: none.
  size_t write_notice(std::span<uint8_t> out, ddsi_locator_t& from) {
    const std::lock_guard lock(mutex_);
    if (const auto samples = held_.overdue()) return write_dropped(*samples, out);
    if (const auto participant = known_.left()) return write_left(*participant, out);
    const auto early = early_.due(EarlyMessages::Clock::now());
    if (!early || early->bytes.size() > out.size()) return 0;
    std::copy(early->bytes.begin(), early->bytes.end(), out.begin());
    from = early->from;
    return early->bytes.size();
  }
  void serve(const ros2::Gid& participant) {
    const std::lock_guard lock(mutex_);
    Prefix prefix{};
    std::copy_n(participant.begin(), prefix.size(), prefix.begin());
    known_.serve(prefix);
  }
  // The samples in the message that are left. socket: that it came by.
  std::vector<Samples> bound(std::span<uint8_t> message, const ddsi_locator_t& from,
                             const ddsi_tran_conn* socket) {
    const std::lock_guard lock(mutex_);
    const auto now = KnownParticipants::Clock::now();
    known_.bound(message, address_of(from), now);
    bound_fragments(message);
    using Told = KnownParticipants::Told;
    const auto knows = [&](const Prefix& participant, const EarlyMessages::Entity& writer) {
      ros2::Gid gid{};
      std::copy(writer.begin(), writer.end(),
                std::copy(participant.begin(), participant.end(), gid.begin()));
      return ruedo_knows_writer(socket, gid.data());
    };
    if (const auto writer = writer_in(message);
        writer && (known_.told(writer->first, writer->second, now) != Told::before ||
                   !knows(writer->first, writer->second)))
      early_.keep({writer->first, writer->second, from, {message.begin(), message.end()}}, now);
    early_.look([&](const EarlyMessages::Message& m) { return knows(m.participant, m.writer); },
                now);
    early_.keep_order(message);
    return samples_in(message);
  }

 private:
  static Address address_of(const ddsi_locator_t& from) {
    Address address{};
    std::copy(std::begin(from.address), std::end(from.address), address.begin());
    std::memcpy(address.data() + sizeof from.address, &from.port, sizeof from.port);
    return address;
  }

  std::mutex mutex_;
  HeldSamples held_;
  KnownParticipants known_;
  EarlyMessages early_;
};

Incoming incoming;

// The datagram that a thread received before. Cyclone puts the next one into the same place, unless
// it holds some of it.
struct Received {
  const uint8_t* place = nullptr;
  size_t size = 0;
  std::vector<Samples> samples;
  ddsi_locator_t from{};

  void settle(const uint8_t* next) {
    const auto begin = reinterpret_cast<uintptr_t>(place), end = reinterpret_cast<uintptr_t>(next);
    if (begin != end && !samples.empty()) {
      const bool is_behind = end > begin && end - begin < 2 * std::numeric_limits<uint16_t>::max();
      incoming.reserve(is_behind ? end - begin : size, samples);
    }
    samples.clear();
  }
};

// The function that all of Cyclone's UDP sockets have.
std::atomic<ddsi_tran_read_fn_t> plain_read{nullptr};

ssize_t read_bounded(ddsi_tran_conn_t conn, unsigned char* into, size_t size, bool allow_spurious,
                     ddsi_locator_t* from) {
  thread_local Received last;
  last.settle(into);
  last.place = into;
  // In place of the datagram, which waits in the socket.
  if (const size_t notice = incoming.write_notice({into, size}, last.from)) {
    if (from) *from = last.from;
    return static_cast<ssize_t>(notice);
  }
  ddsi_locator_t sender{};
  const ssize_t got = plain_read.load()(conn, into, size, allow_spurious, &sender);
  if (from) *from = sender;
  if (got <= 0) return got;
  last.size = static_cast<size_t>(got);
  last.from = sender;
  last.samples = incoming.bound({into, last.size}, sender, conn);
  return got;
}

}  // namespace

void bound_fragments(std::span<uint8_t> message) {
  std::vector<Submessage> fragments;
  size_t payload = 0;
  for_each_submessage(message, [&](const Submessage& each) {
    if (!each.is_fragment()) return;
    fragments.push_back(each);
    payload += each.bytes.size() - Submessage::kFragmentHead;
  });
  const bool is_hollow = message.size() > payload + kMostBesideFragments;
  for (const Submessage& fragment : fragments) {
    if (is_hollow) {
      fragment.erase();
    } else if (fragment.number(Submessage::kSampleSize, 4) > kLargestIncoming ||
               fragment.number(Submessage::kFragmentSize, 2) < kSmallestFragment) {
      fragment.leave_out();
    }
  }
}

void bound_incoming(const ddsi_sertype& type, const ros2::Gid& participant) {
  incoming.serve(participant);
  ruedo_visit_receivers(ddsrt_atomic_ldvoidp(&type.gv), [](ddsi_tran_conn* socket) {
    if (socket->m_read_fn == read_bounded) return;
    ddsi_tran_read_fn_t none = nullptr;
    if (plain_read.compare_exchange_strong(none, socket->m_read_fn) || none == socket->m_read_fn)
      __atomic_store_n(&socket->m_read_fn, &read_bounded, __ATOMIC_RELEASE);
  });
}

}  // namespace ruedo::dds
