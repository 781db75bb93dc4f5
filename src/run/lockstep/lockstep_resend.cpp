// The repair of lost messages: RESEND.
#include <algorithm>
#include <span>

#include <fmt/format.h>

#include "engine/world_state.h"
#include "ruedo/decode.h"
#include "ruedo/resend_reply_t.hpp"
#include "ruedo/resend_request_t.hpp"
#include "run/lockstep/lockstep.h"

namespace ruedo::run {
namespace {

// The overhead of a reply and of each of its parts, beside the text and the data.
constexpr size_t kReplyHead = 8 + 8 + 4 + 1 + 4, kPartHead = 8 + 4 + 8 + 4 + 4 + 4;

}  // namespace

// A message that fits into a part is sent whole; only one larger than a part is sent in pieces.
engine::Outcome Lockstep::resend(const request_t& request, const Session& session) {
  resend_request_t body;
  if (decode_checked(request.body.data(), request.body.size(), body) != DecodeFault::none) {
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, "the body is not a resend_request_t");
  }
  Member* member = find(session.id);
  if (!member)
    return engine::Outcome::refuse(reply_t::UNKNOWN_SESSION,
                                   "this client does not take part in lockstep (any more)");
  if (std::string wrong = fault_of(body.received, *member); !wrong.empty())
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, std::move(wrong));
  member->received = std::max(member->received, body.received);
  forget();
  if (over_ && member->received >= published_) {
    return engine::Outcome::refuse(reply_t::ENDED,
                                   fmt::format("the run has ended at step {}", published_));
  }
  resend_reply_t reply;
  reply.step = published_;
  reply.waits_for = waits_for(published_);
  // The whole reply, heads included, fits into one datagram. Where a fragment comes twice and
  // another is lost, stock LCM takes the message for complete and hands over whatever the memory
  // held.
  size_t room = engine::kMaxPartSize - kReplyHead - reply.waits_for.size();
  for (const resend_wanted_t& wanted :
       std::span(body.wanted).first(std::min(body.wanted.size(), kMostWanted))) {
    const std::span<const uint8_t> bytes =
        kept_.find(wanted.step, engine::ChannelIndex(wanted.channel_index), wanted.sequence);
    if (wanted.offset < 0 || static_cast<size_t>(wanted.offset) >= bytes.size()) continue;
    const size_t left = bytes.size() - static_cast<size_t>(wanted.offset);
    if (room <= kPartHead || (left > room - kPartHead && !reply.parts.empty())) break;
    room -= kPartHead;
    const std::span<const uint8_t> piece =
        bytes.subspan(static_cast<size_t>(wanted.offset), std::min(left, room));
    resend_part_t& part = reply.parts.emplace_back();
    part.step = wanted.step;
    part.channel_index = wanted.channel_index;
    part.sequence = wanted.sequence;
    part.total = static_cast<int32_t>(bytes.size());
    part.offset = wanted.offset;
    part.size = static_cast<int32_t>(piece.size());
    part.data.assign(piece.begin(), piece.end());
    room -= piece.size();
  }
  reply.nparts = static_cast<int32_t>(reply.parts.size());
  return engine::Outcome::with(engine::encoded(reply));
}

}  // namespace ruedo::run
