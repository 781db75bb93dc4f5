#include "bridges/dds/reply_ends.h"

#include <algorithm>
#include <memory>
#include <vector>

namespace ruedo::dds {
namespace {

using Participant = std::array<uint8_t, 16>;
using Endpoint =
    std::unique_ptr<dds_builtintopic_endpoint_t, decltype(&dds_builtintopic_free_endpoint)>;

constexpr size_t kMostDeaf = 256;  // participants that are remembered

Participant participant_of(const Endpoint& end) {
  Participant key{};
  std::copy(std::begin(end->participant_key.v), std::end(end->participant_key.v), key.begin());
  return key;
}

Endpoint writer_of(dds_entity_t reader, dds_instance_handle_t writer) {
  return {dds_get_matched_publication_data(reader, writer), dds_builtintopic_free_endpoint};
}

// How many of the ends that match an entity are a participant's.
template <class List, class Data>
size_t count_of(const Participant& whose, dds_entity_t entity, List list, Data data) {
  std::vector<dds_instance_handle_t> ends(64);
  for (;;) {
    const dds_return_t all = list(entity, ends.data(), ends.size());
    if (all <= 0) return 0;
    if (static_cast<size_t>(all) <= ends.size()) {
      ends.resize(static_cast<size_t>(all));
      break;
    }
    ends.resize(static_cast<size_t>(all));
  }
  return static_cast<size_t>(std::count_if(ends.begin(), ends.end(), [&](auto handle) {
    const Endpoint end(data(entity, handle), dds_builtintopic_free_endpoint);
    return end && participant_of(end) == whose;
  }));
}

}  // namespace

size_t ReplyEnds::missing(const Participant& whose) const {
  const size_t writers =
      count_of(whose, requests_, dds_get_matched_publications, dds_get_matched_publication_data);
  const size_t readers =
      count_of(whose, replies_, dds_get_matched_subscriptions, dds_get_matched_subscription_data);
  return writers > readers ? writers - readers : 0;
}

bool ReplyEnds::hears(dds_instance_handle_t writer) {
  dds_subscription_matched_status_t clients{};
  dds_publication_matched_status_t replies{};
  dds_get_subscription_matched_status(requests_, &clients);
  dds_get_publication_matched_status(replies_, &replies);
  if (const uint32_t ends = clients.total_count + replies.total_count; ends != ends_) {
    ends_ = ends;
    hears_.clear();
  }
  const auto [known, fresh] = hears_.try_emplace(writer, false);
  if (fresh) known->second = look(writer);
  return known->second;
}

bool ReplyEnds::look(dds_instance_handle_t writer) {
  const Endpoint end = writer_of(requests_, writer);
  if (!end) return true;  // it has gone
  const Participant whose = participant_of(end);
  const size_t now = missing(whose);
  const auto deaf = deaf_.find(whose);
  if (now > (deaf == deaf_.end() ? 0 : deaf->second)) return false;
  if (deaf != deaf_.end()) deaf->second = now;
  return true;
}

void ReplyEnds::give_up(dds_instance_handle_t writer) {
  const Endpoint end = writer_of(requests_, writer);
  if (!end) return;
  if (deaf_.size() >= kMostDeaf) deaf_.clear();
  const Participant whose = participant_of(end);
  deaf_[whose] = missing(whose);
  hears_.clear();
}

bool ReplyEnds::may_answer(dds_instance_handle_t writer, Clock::time_point now) {
  if (hears(writer)) {
    until_.erase(writer);
    return true;
  }
  const auto [until, fresh] = until_.try_emplace(writer, now + kLongest);
  if (now < until->second) return false;
  until_.erase(until);
  give_up(writer);
  return true;
}

}  // namespace ruedo::dds
