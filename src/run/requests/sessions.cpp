// Sessions of the clients of the simulation control.
#include "run/requests/sessions.h"

#include <algorithm>
#include <random>
#include <tuple>
#include <utility>

namespace ruedo::run {
namespace {

constexpr std::chrono::seconds kHeldUp{1};  // requests are read more often than that

}  // namespace

int64_t random_id() {
  std::random_device device;
  const uint64_t bits = uint64_t{device()} << 32 | device();
  return static_cast<int64_t>(bits >> 1 | 1);
}

Session* Sessions::find(int64_t id) {
  const auto found = std::find_if(sessions_.begin(), sessions_.end(),
                                  [&](const Session& session) { return session.id == id; });
  return found == sessions_.end() ? nullptr : &*found;
}

Session* Sessions::join(const std::string& client, int64_t sequence,
                        const std::function<bool(int64_t)>& keeps) {
  for (Session& session : sessions_) {
    if (session.join_sequence == sequence && session.client == client) return &session;
  }
  if (sessions_.size() == kMostSessions) {
    auto place = sessions_.end();
    for (auto session = sessions_.begin(); session != sessions_.end(); ++session) {
      if (listened_ - session->last_heard < kMaySilence || (keeps && keeps(session->id))) continue;
      if (place == sessions_.end() ||
          std::tie(session->spoke, session->last_heard) < std::tie(place->spoke, place->last_heard))
        place = session;
    }
    if (place == sessions_.end()) return nullptr;
    sessions_.erase(place);
  }
  Session& session = sessions_.emplace_back();
  session.id = random_id();
  session.client = client;
  session.join_sequence = sequence;
  hear(session);
  return &session;
}

void Sessions::leave(int64_t id) {
  std::erase_if(sessions_, [&](const Session& session) { return session.id == id; });
}

void Sessions::listen(Time now) {
  const Time::duration deaf = now - std::exchange(listened_, now);
  if (deaf <= kHeldUp) return;
  for (Session& session : sessions_) session.last_heard += deaf;
}

Sessions::Verdict Sessions::judge(const Session& session, int64_t sequence,
                                  const reply_t*& reply) const {
  if (sequence < 1 || sequence - session.last_sequence > kMostJump) return Verdict::too_far;
  if (sequence > session.last_sequence) return Verdict::execute;
  for (const reply_t& kept : session.replies) {
    if (kept.sequence != sequence) continue;
    reply = &kept;
    return Verdict::answer_again;
  }
  return sequence == session.last_sequence ? Verdict::wait : Verdict::too_old;
}

void Sessions::keep(const reply_t& reply) {
  Session* session = find(reply.session);
  if (!session) return;
  if (session->replies.size() == kKeptReplies) session->replies.pop_front();
  session->replies.push_back(reply);
}

}  // namespace ruedo::run
