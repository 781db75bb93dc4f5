#include "bridges/dds/early_messages.h"

#include <algorithm>

namespace ruedo::dds {
namespace {

constexpr size_t kWriterOfHeartbeat = 8;

// Calls with each data submessage or heartbeat, the prefix of its sender and its writer.
template <class Do>
void for_each_said(std::span<uint8_t> message, Do what) {
  if (message.size() < kMessageHeader) return;
  Prefix sender = sender_at(message, kSenderInHead).prefix;
  for_each_submessage(message, [&](const Submessage& each) {
    if (each.is_source()) sender = sender_at(each.bytes, Submessage::kSender).prefix;
    const bool beats = each.kind() == Submessage::kHeartbeat;
    if (!beats && !each.is_data()) return;
    const size_t place = beats ? kWriterOfHeartbeat : Submessage::kWriter;
    EarlyMessages::Entity writer{};
    if (each.bytes.size() < place + writer.size()) return;
    std::copy_n(each.bytes.begin() + static_cast<std::ptrdiff_t>(place), writer.size(),
                writer.begin());
    what(each, sender, writer);
  });
}

}  // namespace

void EarlyMessages::keep(Message message, Clock::time_point now) {
  while (!held_.empty() && held_.front().came + kLongest < now) {
    bytes_ -= held_.front().message.bytes.size();
    held_.pop_front();
  }
  if (held_.size() >= kMost || bytes_ + message.bytes.size() > kMostBytes) return;
  bytes_ += message.bytes.size();
  held_.push_back({std::move(message), now});
}

void EarlyMessages::look(const std::function<bool(const Message&)>& is_known,
                         Clock::time_point now) {
  for (Held& each : held_)
    if (!each.told && is_known(each.message)) each.told = now;
}

std::optional<EarlyMessages::Message> EarlyMessages::due(Clock::time_point now) {
  const auto next = std::find_if(held_.begin(), held_.end(), [&](const Held& each) {
    return each.told && now >= *each.told + kDelays[each.heard];
  });
  if (next == held_.end()) return std::nullopt;
  if (++next->heard < kDelays.size()) return next->message;
  Message last = std::move(next->message);
  bytes_ -= last.bytes.size();
  held_.erase(next);
  return last;
}

void EarlyMessages::keep_order(std::span<uint8_t> message) const {
  if (held_.empty()) return;
  for_each_said(message, [&](const Submessage& part, const Prefix& who, const Entity& writer) {
    const bool waits = std::any_of(held_.begin(), held_.end(), [&](const Held& each) {
      return each.told && each.message.writer == writer && each.message.participant == who;
    });
    if (waits && part.kind() == Submessage::kHeartbeat) part.erase();
  });
}

std::optional<std::pair<Prefix, EarlyMessages::Entity>> writer_in(std::span<uint8_t> message) {
  constexpr uint8_t kBuiltin = 0xc0;  // in the last byte
  std::optional<std::pair<Prefix, EarlyMessages::Entity>> found;
  for_each_said(message,
                [&](const Submessage&, const Prefix& who, const EarlyMessages::Entity& writer) {
                  if (!found && !(writer.back() & kBuiltin)) found.emplace(who, writer);
                });
  return found;
}

}  // namespace ruedo::dds
