#include "bridges/dds/early_messages.h"

#include <algorithm>

namespace ruedo::dds {

void EarlyMessages::hold(Message message, Clock::time_point now) {
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

std::optional<std::pair<Prefix, EarlyMessages::Entity>> writer_in(std::span<uint8_t> message) {
  constexpr size_t kWriterOfHeartbeat = 8;
  constexpr uint8_t kBuiltin = 0xc0;  // in the last byte
  if (message.size() < kMessageHeader) return std::nullopt;
  Prefix sender = sender_at(message, kSenderInHead).prefix;
  std::optional<std::pair<Prefix, EarlyMessages::Entity>> found;
  for_each_submessage(message, [&](const Submessage& each) {
    if (each.is_source()) sender = sender_at(each.bytes, Submessage::kSender).prefix;
    const bool beats = each.kind() == Submessage::kHeartbeat;
    if (found || !(beats || each.is_data())) return;
    const size_t place = beats ? kWriterOfHeartbeat : Submessage::kWriter;
    EarlyMessages::Entity writer{};
    if (each.bytes.size() < place + writer.size()) return;
    std::copy_n(each.bytes.begin() + static_cast<std::ptrdiff_t>(place), writer.size(),
                writer.begin());
    if (!(writer.back() & kBuiltin)) found.emplace(sender, writer);
  });
  return found;
}

}  // namespace ruedo::dds
