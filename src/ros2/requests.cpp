#include "ros2/requests.h"

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

void Requests::ask(int32_t kind, std::vector<uint8_t> body, Then then) {
  std::unique_lock lock(mutex_);
  if (channel_.empty()) {
    lock.unlock();
    return then(refusal(reply_t::NOT_SUPPORTED, "this run takes no requests (--control off)"));
  }
  if (waiting_.size() + pending_.size() >= kMostPending) {
    lock.unlock();
    return then(refusal(reply_t::REFUSED, "too many calls are not answered yet: try again"));
  }
  Asked asked{kind, std::move(body), std::move(then)};
  if (session_ != 0) return send(lock, std::move(asked));
  waiting_.push_back(std::move(asked));
  if (join_sequence_ == 0) join(lock);
}

void Requests::join(std::unique_lock<std::mutex>& lock) {
  join_sequence_ = random_sequence();
  join_t body;
  body.client = "ros2";
  const std::vector<uint8_t> bytes = request(0, join_sequence_, request_t::JOIN, encoded(body));
  const std::string channel = channel_;
  lock.unlock();
  inject_(channel, bytes);
}

void Requests::send(std::unique_lock<std::mutex>& lock, Asked asked) {
  const std::vector<uint8_t> bytes = request(session_, ++sequence_, asked.kind, asked.body);
  const std::string channel = channel_;
  pending_[sequence_] = std::move(asked);
  lock.unlock();
  inject_(channel, bytes);
}

void Requests::joined(const reply_t& reply, std::unique_lock<std::mutex>& lock) {
  join_sequence_ = 0;
  session_ = reply.session;
  sequence_ = 0;
  std::deque<Asked> waiting = std::move(waiting_);
  waiting_.clear();
  for (Asked& asked : waiting) {
    if (!lock.owns_lock()) lock.lock();
    if (reply.code == reply_t::OK) {
      send(lock, std::move(asked));
    } else {
      lock.unlock();
      asked.then(reply);
    }
  }
}

void Requests::reply(std::span<const uint8_t> message) {
  reply_t reply;
  if (decode_checked(message.data(), message.size(), reply) != DecodeFault::none) return;
  std::unique_lock lock(mutex_);
  if (reply.kind == request_t::JOIN) {
    if (reply.sequence == join_sequence_) joined(reply, lock);
    return;
  }
  const auto found = reply.session == session_ ? pending_.find(reply.sequence) : pending_.end();
  if (found == pending_.end()) return;
  Asked asked = std::move(found->second);
  pending_.erase(found);
  if (reply.code != reply_t::UNKNOWN_SESSION || asked.again) {
    lock.unlock();
    return asked.then(reply);
  }
  session_ = 0;  // it was silent for long, and others took its place
  asked.again = true;
  waiting_.push_back(std::move(asked));
  if (join_sequence_ == 0) join(lock);
}

}  // namespace ruedo::ros2
