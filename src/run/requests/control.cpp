// The order of checks: run, session, sequence, epoch; then the request itself.
#include "run/requests/control.h"

#include <algorithm>
#include <utility>

#include "base/utf8.h"
#include "ruedo/decode.h"
#include "ruedo/join_t.hpp"
#include "run/requests/request_table.h"

namespace ruedo::run {
namespace {

// It may contain names that a client made up: clients show them, and replies are kept.
std::string fit_text(const std::string& text) {
  return for_terminal(shortened(text, kLongestSaid));
}

}  // namespace

bool Control::on_request(const uint8_t* data, size_t size) {
  request_t request;
  if (decode_checked(data, size, request) != DecodeFault::none) {
    ++refused_;
    return false;
  }
  if (size > kMaxRequestSize) {  // refused for its size, which the reply gives
    request.body = {};
    size = 0;
  }
  std::lock_guard lock(mutex_);
  if (inbox_.size() >= kMostWaiting || inbox_bytes_ + size > kMostWaitingBytes) return true;
  inbox_bytes_ += size;
  inbox_.push_back(std::move(request));
  return true;
}

void Control::serve() {
  sessions_.listen(std::chrono::steady_clock::now());
  if (!held_.empty() && !host_.state_comes()) {
    for (const request_t& request : std::exchange(held_, {})) serve(request);
  }
  {
    std::lock_guard lock(mutex_);
    std::swap(inbox_, taken_);
    inbox_bytes_ = 0;
  }
  for (const request_t& request : taken_) serve(request);
  taken_.clear();
}

void Control::serve(const request_t& request) {
  reply_t reply;
  reply.run_id = run_id_;
  reply.epoch = host_.epoch();
  reply.session = request.session;
  reply.sequence = request.sequence;
  reply.kind = request.kind;
  reply.code = reply_t::OK;
  reply.size = 0;
  const auto answer_with = [&](int32_t code,
                               std::string text) {  // at once; it is not kept for repeats
    reply.code = code;
    reply.text = std::move(text);
    publish(reply);
  };
  if (request.run_id != 0 && request.run_id != run_id_)
    return answer_with(reply_t::WRONG_RUN, "this is another run of the server");
  if (request.body.size() != static_cast<size_t>(request.size))
    return answer_with(reply_t::BAD_REQUEST, "its body has " + std::to_string(request.size) +
                                                 " bytes: a request has " +
                                                 std::to_string(kMaxRequestSize) + " at most");
  if (request.kind == request_t::JOIN) return join(request, reply);
  if (request.kind == request_t::LEAVE) {  // may be repeated at will
    if (host_.left) host_.left(request.session);
    drop(request.session);
    return publish(reply);
  }
  if (request.kind == request_t::INFO &&
      request.session == 0) {  // a client may ask what there is before it joins
    host_.execute(request, Session{});
    return;
  }
  Session* session = sessions_.find(request.session);
  if (!session) return answer_with(reply_t::UNKNOWN_SESSION, "no such session: join first");
  sessions_.hear(*session);
  session->spoke = true;
  if (request.kind ==
      request_t::RESEND) {  // changes nothing: it may come any number of times, in any order
    engine::Outcome outcome = host_.execute(request, *session);
    reply.body = std::move(outcome.body);
    reply.size = static_cast<int32_t>(reply.body.size());
    return answer_with(outcome.code, std::move(outcome.text));
  }
  if (judge(request, *session, reply) != Sessions::Verdict::execute) return;
  if (host_.early && request.kind == request_t::GRANT && host_.early(request, *session)) return;
  // Checked after the sequence, so that a repeated RESET, of the epoch that it ended, is answered.
  if (request.epoch != -1 && request.epoch != reply.epoch)
    return answer_with(reply_t::WRONG_EPOCH, "the world was reset since");
  if (must_wait(request)) return defer(request);
  execute(request, *session, reply);
}

// Answers requests that are not executed.
Sessions::Verdict Control::judge(const request_t& request, const Session& session, reply_t& reply) {
  const reply_t* kept = nullptr;
  if (is_waiting(request.session, request.sequence))
    return Sessions::Verdict::wait;  // later ones may have been executed
  const Sessions::Verdict verdict = sessions_.judge(session, request.sequence, kept);
  const std::string last = std::to_string(session.last_sequence);
  switch (verdict) {
    case Sessions::Verdict::answer_again: host_.publish(*kept); return verdict;
    case Sessions::Verdict::wait:
    case Sessions::Verdict::execute: return verdict;
    case Sessions::Verdict::too_old:
      reply.code = reply_t::OLD_SEQUENCE;
      reply.text = "a later request was executed already: the last is " + last;
      break;
    case Sessions::Verdict::too_far:
      reply.code = reply_t::BAD_REQUEST;
      reply.text = "the sequence is " + std::to_string(request.sequence) +
                   ", and the last request was " + last + ": 1 to " +
                   std::to_string(session.last_sequence + Sessions::kMostJump) + " is allowed";
      break;
  }
  publish(reply);
  return verdict;
}

void Control::execute(const request_t& request, Session& session, reply_t& reply) {
  sessions_.begin(session, request.sequence);
  engine::Outcome outcome =
      has_too_many(request)
          ? engine::Outcome::refuse(
                reply_t::REFUSED,
                "too many requests of this client wait for their steps: wait for the answers")
          : host_.execute(request, session);
  reply.code = outcome.code;
  reply.text = std::move(outcome.text);
  reply.body = std::move(outcome.body);
  if (outcome.pending || outcome.after_step >= 0) {
    waiting_.push_back({std::move(reply), outcome.pending ? kPending : outcome.after_step});
  } else {
    answer(reply, outcome.quiet);
  }
}

// While one request waits, the later ones of its session wait, too: they are executed in order.
bool Control::must_wait(const request_t& request) const {
  const RequestKind* kind = find_request_kind(request.kind);
  if ((!kind || kind->waits == RequestKind::for_state) && host_.state_comes()) return true;
  return std::any_of(held_.begin(), held_.end(),
                     [&](const request_t& held) { return held.session == request.session; });
}

// A client that has used up its share has to ask again.
void Control::defer(const request_t& request) {
  const auto of_session = [&](const request_t& held) { return held.session == request.session; };
  const auto same = [&](const request_t& held) {
    return of_session(held) && held.sequence >= request.sequence;
  };
  if (std::any_of(held_.begin(), held_.end(), same)) return;
  if (static_cast<size_t>(std::count_if(held_.begin(), held_.end(), of_session)) < kMostHeld)
    held_.push_back(request);
}

// A PAUSE has room when a STEP has none.
bool Control::has_too_many(const request_t& request) const {
  const auto waiting =
      static_cast<size_t>(std::count_if(waiting_.begin(), waiting_.end(), [&](const Waiting& each) {
        return each.reply.session == request.session;
      }));
  return waiting >= (request.kind == request_t::STEP ? kMostSteppings : kMostUnanswered);
}

void Control::join(const request_t& request, reply_t& reply) {
  join_t body;
  if (decode_checked(request.body.data(), request.body.size(), body) != DecodeFault::none ||
      body.client.empty() || body.client.size() > 63 || !is_one_line(body.client) ||
      request.sequence <= 0) {
    reply.code = reply_t::BAD_REQUEST;
    reply.text =
        "JOIN needs a join_t with a name of 1 to 63 bytes of UTF-8 without control characters, and "
        "a sequence above 0";
  } else if (const Session* session = sessions_.join(body.client, request.sequence, host_.keeps)) {
    reply.session = session->id;
    forget_left();  // one may have given way
  } else {
    reply.code = reply_t::REFUSED;
    reply.text = std::to_string(Sessions::kMostSessions) +
                 " clients have joined, and each was heard within the last " +
                 std::to_string(Sessions::kMaySilence.count()) +
                 " s or takes part in lockstep: try again";
  }
  publish(reply);
}

void Control::drop(int64_t session) {
  sessions_.leave(session);
  forget_left();
}

// Each session has its share of the waiting requests, and a client that leaves may join again.
void Control::forget_left() {
  const auto left = [&](int64_t session) { return sessions_.find(session) == nullptr; };
  std::erase_if(held_, [&](const request_t& held) { return left(held.session); });
  std::erase_if(waiting_, [&](const Waiting& waiting) { return left(waiting.reply.session); });
}

void Control::publish(reply_t& reply) {
  reply.utime = host_.utime();
  reply.text = fit_text(reply.text);
  host_.publish(reply);
}

void Control::answer(reply_t& reply, bool quiet) {
  reply.utime = host_.utime();
  reply.epoch = host_.epoch();
  reply.text = fit_text(reply.text);
  reply.size = static_cast<int32_t>(reply.body.size());
  sessions_.keep(reply);
  if (!quiet) host_.publish(reply);
}

void Control::published(int64_t step) {
  if (waiting_.empty()) return;
  const auto ready =
      std::stable_partition(waiting_.begin(), waiting_.end(), [&](const Waiting& waiting) {
        return waiting.after_step > step || waiting.after_step == kPending;
      });
  for (auto it = ready; it != waiting_.end(); ++it) {
    it->reply.body = host_.state();
    answer(it->reply);
  }
  waiting_.erase(ready, waiting_.end());
}

template <class Condition>
void Control::refuse_waiting(const std::string& why, int32_t code, Condition condition) {
  const auto refused =
      std::stable_partition(waiting_.begin(), waiting_.end(),
                            [&](const Waiting& waiting) { return !condition(waiting); });
  for (auto waiting = refused; waiting != waiting_.end(); ++waiting) {
    waiting->reply.code = code;
    waiting->reply.text = why;
    waiting->reply.body.clear();
    answer(waiting->reply);
  }
  waiting_.erase(refused, waiting_.end());
}

void Control::cancel(const std::string& why, int32_t code) {
  refuse_waiting(why, code, [](const Waiting&) { return true; });
}

void Control::cancel_after(int64_t step, const std::string& why) {
  refuse_waiting(why, reply_t::REFUSED, [step](const Waiting& waiting) {
    return waiting.after_step > step && waiting.after_step != kPending;
  });
}

bool Control::is_waiting(int64_t session, int64_t sequence) const {
  return std::any_of(waiting_.begin(), waiting_.end(), [&](const Waiting& waiting) {
    return waiting.reply.session == session && waiting.reply.sequence == sequence;
  });
}

bool Control::is_pending(int64_t session, int64_t sequence) const {
  return std::any_of(waiting_.begin(), waiting_.end(), [&](const Waiting& waiting) {
    return waiting.after_step == kPending && waiting.reply.session == session &&
           waiting.reply.sequence == sequence;
  });
}

void Control::finish(int64_t session, int64_t sequence, engine::Outcome outcome) {
  const auto found = std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& waiting) {
    return waiting.after_step == kPending && waiting.reply.session == session &&
           waiting.reply.sequence == sequence;
  });
  if (found == waiting_.end()) return;
  reply_t reply = std::move(found->reply);
  waiting_.erase(found);
  reply.code = outcome.code;
  reply.text = std::move(outcome.text);
  reply.body = std::move(outcome.body);
  answer(reply);
}

}  // namespace ruedo::run
