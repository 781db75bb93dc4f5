// The order of checks: run, epoch, session, sequence; then the request itself.
#include "run/control.h"

#include <algorithm>

#include "core/utf8.h"
#include "ruedo/decode.h"
#include "ruedo/join_t.hpp"

namespace ruedo::run {

bool Control::receive(const uint8_t* data, size_t size) {
  request_t request;
  if (size > kMaxRequestSize || decode_checked(data, size, request) != DecodeFault::none) {
    ++refused_;
    return false;
  }
  std::lock_guard lock(mutex_);
  if (inbox_.size() < kMostWaiting) inbox_.push_back(std::move(request));
  return true;
}

namespace {

// Who reads or changes the world waits for its first state. Grants are what lockstep's own order is about.
bool needs_state(int32_t kind) {
  return kind != request_t::JOIN && kind != request_t::LEAVE && kind != request_t::INFO && kind != request_t::QUIT &&
         kind != request_t::GRANT && kind != request_t::RESEND;
}

}  // namespace

bool Control::serve_taken() {
  size_t served = 0;
  while (served < taken_.size() && (server_.has_state() || !needs_state(taken_[served].kind))) serve(taken_[served++]);
  taken_.erase(taken_.begin(), taken_.begin() + static_cast<std::ptrdiff_t>(served));
  return taken_.empty();
}

void Control::serve() {
  if (!serve_taken()) return;    // what a missing state held up
  {
    std::lock_guard lock(mutex_);
    std::swap(inbox_, taken_);
  }
  serve_taken();
}

void Control::serve(const request_t& request) {
  reply_t reply;
  reply.run_id = run_id_;
  reply.epoch = server_.epoch();
  reply.session = request.session;
  reply.sequence = request.sequence;
  reply.kind = request.kind;
  reply.code = reply_t::OK;
  reply.size = 0;
  const auto refuse = [&](int32_t code, std::string text) {
    reply.code = code;
    reply.text = std::move(text);
    reply.utime = server_.utime();
    server_.publish(reply);
  };
  if (request.run_id != 0 && request.run_id != run_id_) return refuse(reply_t::WRONG_RUN, "this is another run of the server");
  if (request.kind == request_t::JOIN) return join(request, reply);
  if (request.kind == request_t::LEAVE) {    // as often as one likes
    if (server_.left) server_.left(request.session);
    sessions_.leave(request.session);
    return refuse(reply_t::OK, "");
  }
  if (request.kind == request_t::INFO && request.session == 0) {    // who has not joined yet may ask what there is to join
    server_.execute(request, Session{});
    return;
  }
  Session* session = sessions_.find(request.session);
  if (!session) return refuse(reply_t::UNKNOWN_SESSION, "no such session: join first");
  session->last_heard = std::chrono::steady_clock::now();
  if (request.kind == request_t::RESEND) {    // changes nothing: it may come as often as one likes, in any order
    engine::Outcome outcome = server_.execute(request, *session);
    reply.body = std::move(outcome.body);
    reply.size = static_cast<int32_t>(reply.body.size());
    return refuse(outcome.code, std::move(outcome.text));
  }
  const reply_t* kept = nullptr;
  switch (sessions_.judge(*session, request.sequence, kept)) {
    case Sessions::Verdict::answer_again: return server_.publish(*kept);
    case Sessions::Verdict::wait: return;
    case Sessions::Verdict::too_old: return refuse(reply_t::OLD_SEQUENCE, "a later request was executed already");
    case Sessions::Verdict::execute: break;
  }
  if (server_.early && request.kind == request_t::GRANT && server_.early(request, *session)) return;
  // After the sequence: a repeated RESET, of the epoch that it ended, gets its answer again.
  if (request.epoch != -1 && request.epoch != reply.epoch) return refuse(reply_t::WRONG_EPOCH, "the world was reset since");
  sessions_.begin(*session, request.sequence);
  engine::Outcome outcome = server_.execute(request, *session);
  reply.code = outcome.code;
  reply.text = std::move(outcome.text);
  reply.body = std::move(outcome.body);
  if (outcome.after_step >= 0) {
    waiting_.push_back({std::move(reply), outcome.after_step});
  } else {
    answer(reply, outcome.quiet);
  }
}

void Control::join(const request_t& request, reply_t& reply) {
  join_t body;
  if (decode_checked(request.body.data(), request.body.size(), body) != DecodeFault::none || body.client.empty() ||
      body.client.size() > 63 || for_terminal(body.client) != body.client || request.sequence <= 0) {
    reply.code = reply_t::BAD_REQUEST;
    reply.text = "JOIN wants a join_t with a name of 1 to 63 bytes of UTF-8 without control characters, and a sequence above 0";
  } else if (const Session* session = sessions_.join(body.client, request.sequence, std::chrono::steady_clock::now())) {
    reply.session = session->id;
  } else {
    reply.code = reply_t::REFUSED;
    reply.text = "64 clients have joined already";
  }
  reply.utime = server_.utime();
  server_.publish(reply);
}

void Control::answer(reply_t& reply, bool quiet) {
  reply.utime = server_.utime();
  reply.epoch = server_.epoch();
  reply.size = static_cast<int32_t>(reply.body.size());
  sessions_.keep(reply);
  if (!quiet) server_.publish(reply);
}

void Control::published(int64_t step) {
  if (waiting_.empty()) return;
  const auto ready = std::stable_partition(waiting_.begin(), waiting_.end(),
                                           [&](const Waiting& waiting) { return waiting.after_step > step; });
  for (auto it = ready; it != waiting_.end(); ++it) {
    it->reply.body = server_.state();
    answer(it->reply);
  }
  waiting_.erase(ready, waiting_.end());
}

void Control::cancel(const std::string& why) {
  for (Waiting& waiting : waiting_) {
    waiting.reply.code = reply_t::REFUSED;
    waiting.reply.text = why;
    waiting.reply.body.clear();
    answer(waiting.reply);
  }
  waiting_.clear();
}

}  // namespace ruedo::run
