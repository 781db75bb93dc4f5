#include "bridges/ros2/services/requests.h"

#include <algorithm>
#include <iterator>
#include <random>
#include <utility>

#include "engine/outcome.h"
#include "ruedo/decode.h"
#include "ruedo/join_t.hpp"
#include "ruedo/request_t.hpp"

namespace ruedo::ros2 {
namespace {

using engine::encoded;

std::vector<uint8_t> request(int64_t session, int64_t sequence, int32_t kind,
                             const std::vector<uint8_t>& body) {
  request_t message;
  message.utime = 0;
  message.run_id = 0;
  message.epoch = -1;
  message.session = session;
  message.sequence = sequence;
  message.kind = kind;
  message.size = static_cast<int32_t>(body.size());
  message.body = body;
  return encoded(message);
}

reply_t refusal(int32_t code, const char* text) {
  reply_t reply{};
  reply.code = code;
  reply.text = text;
  return reply;
}

// Of its own, so that another client's JOIN is not taken for this one's.
int64_t random_sequence() {
  std::random_device device;
  return (static_cast<int64_t>(device()) << 20 | device() % (1 << 20)) + 1;
}

}  // namespace

void Requests::listen(const std::string& channel) {
  const std::lock_guard lock(mutex_);
  channel_ = channel;
}

void Requests::send(uint64_t client, int32_t kind, std::vector<uint8_t> body, Then then) {
  const char* too_many = nullptr;
  {
    const std::lock_guard lock(mutex_);
    const auto own = waiting_.find(client);
    if (own != waiting_.end() && own->second.size() >= kMostWaitingOfOne)
      too_many = "too many calls of this client are not answered yet: wait for the answers";
    else if (waiting_bytes_ + body.size() > kMostWaitingBytes)
      too_many = "too many calls are not answered yet: try again";
    if (!channel_.empty() && !too_many) {
      waiting_bytes_ += body.size();
      waiting_[client].push_back({client, kind, std::move(body), std::move(then), false, {}});
      return pump();
    }
  }
  then(too_many ? refusal(reply_t::REFUSED, too_many)
                : refusal(reply_t::NOT_SUPPORTED, "this run accepts no requests (--control off)"));
}

void Requests::join() {
  if (join_sequence_ == 0) join_sequence_ = random_sequence();
  joined_at_ = Clock::now();
  join_t body;
  body.client = "ros2";
  inject({0, join_sequence_}, request_t::JOIN, encoded(body));
}

void Requests::inject(const Key& key, int32_t kind, const std::vector<uint8_t>& body) {
  inject_(channel_, request(key.first, key.second, kind, body));
}

// In turn, one call of each client that has not its share already.
void Requests::pump() {
  if (waiting_.empty()) return;
  if (session_ == 0) {
    if (join_sequence_ == 0) join();
    return;
  }
  for (size_t passed = 0; passed < waiting_.size() && pending_.size() < kMostPending;) {
    auto next = waiting_.upper_bound(last_client_);
    if (next == waiting_.end()) next = waiting_.begin();
    last_client_ = next->first;
    const bool steps = next->second.front().kind == request_t::STEP;
    const auto own = pending_of_.find(last_client_);
    if ((own != pending_of_.end() && own->second >= kMostPendingOfOne) ||
        (steps && steps_ >= kMostSteps)) {
      ++passed;
      continue;
    }
    passed = 0;
    if (steps) ++steps_;
    ++pending_of_[last_client_];
    const Key key{session_, ++sequence_};
    Asked& asked = pending_[key] = std::move(next->second.front());
    next->second.pop_front();
    if (next->second.empty()) waiting_.erase(next);
    waiting_bytes_ -= asked.body.size();
    asked.sent = Clock::now();
    inject(key, asked.kind, asked.body);
  }
}

// Returns the waiting requests to refuse, if the run lets no client join.
std::vector<Requests::Asked> Requests::joined(const reply_t& reply) {
  std::vector<Asked> refused;
  join_sequence_ = 0;
  if (reply.code == reply_t::OK) {
    session_ = reply.session;
    sequence_ = 0;
    pump();
    return refused;
  }
  for (auto& [client, queue] : std::exchange(waiting_, {}))
    std::move(queue.begin(), queue.end(), std::back_inserter(refused));
  waiting_bytes_ = 0;
  return refused;
}

void Requests::reply(std::span<const uint8_t> message) {
  reply_t reply;
  if (decode_checked(message.data(), message.size(), reply) != DecodeFault::none) return;
  std::vector<Asked> answered;
  {
    const std::lock_guard lock(mutex_);
    if (reply.kind == request_t::JOIN) {
      if (join_sequence_ != 0 && reply.sequence == join_sequence_) answered = joined(reply);
    } else if (const auto found = pending_.find({reply.session, reply.sequence});
               found != pending_.end()) {
      Asked asked = std::move(found->second);
      pending_.erase(found);
      if (asked.kind == request_t::STEP) --steps_;
      if (--pending_of_[asked.client] == 0) pending_of_.erase(asked.client);
      // It was silent for long, and others took its place; or the run had dropped that request.
      const bool lost =
          reply.code == reply_t::UNKNOWN_SESSION || reply.code == reply_t::OLD_SEQUENCE;
      if (!lost || asked.again) {
        answered.push_back(std::move(asked));
      } else {
        if (reply.code == reply_t::UNKNOWN_SESSION && reply.session == session_) session_ = 0;
        asked.again = true;
        waiting_bytes_ += asked.body.size();
        waiting_[asked.client].push_back(std::move(asked));
      }
      pump();
    }
  }
  for (const Asked& asked : answered) asked.then(reply);
}

void Requests::repeat(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (join_sequence_ != 0 && now >= joined_at_ + kRepeat) join();
  for (auto& [key, asked] : pending_) {
    if (now < asked.sent + kRepeat) continue;
    asked.sent = now;
    inject(key, asked.kind, asked.body);
  }
}

}  // namespace ruedo::ros2
