// Sessions: joining, numbering, repeating, and the errors that replies become.
#include "session.h"

#include <random>
#include <stdexcept>

#include "base/utf8.h"
#include "core.h"
#include "ruedo/join_t.hpp"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "samples/wire_reader.h"

namespace ruedo::client {
namespace {

constexpr auto kRepeatTime = std::chrono::milliseconds(100);
constexpr int kMostLeaves = 5;  // that are sent: for half a second in all

std::string kind_name(int32_t kind) { return to_string(static_cast<RequestKind>(kind)); }

Reply checked(Reply reply) {
  if (reply.code == reply_t::OK) return reply;
  const std::string text =
      kind_name(reply.kind) + ": " +
      (reply.text.empty() ? "refused with code " + std::to_string(reply.code) : reply.text);
  if (reply.code == reply_t::ENDED) throw RunEnded(text);
  if (reply.code == reply_t::NOT_SUPPORTED) throw NotSupported(text);
  throw RequestError(text, static_cast<ReplyCode>(reply.code));
}

}  // namespace

Session::Session(Core& core, std::string name) : core_(core), name_(std::move(name)) {
  constexpr size_t kMost = 63;
  if (name_.empty() || name_.size() > kMost || !is_one_line(name_))
    throw std::invalid_argument("the name '" + for_terminal(shortened(name_, kMost)) +
                                "': a client's has 1 to 63 bytes of UTF-8, without control "
                                "characters");
}

Reply Session::request(int32_t kind, const std::vector<uint8_t>& body, Duration timeout) {
  core_.check_may_wait();
  const auto turn = this->turn();
  return request_in_turn(kind, body, timeout);
}

Reply Session::request_in_turn(int32_t kind, const std::vector<uint8_t>& body, Duration timeout) {
  core_.check_open();
  const auto info = core_.info();
  if (!(static_cast<uint64_t>(info->features) >> kind & 1)) {
    throw NotSupported("this server (Ruedo " + info->version + ") has no " + kind_name(kind) +
                       " request");
  }
  for (int attempt = 1;; ++attempt) {
    if (session_ == 0 || run_id_ != info->run_id) {
      run_id_ = info->run_id;
      join(timeout);
    }
    Reply reply = exchange(kind, session_, ++sequence_, body, timeout);
    if (reply.code != reply_t::UNKNOWN_SESSION || attempt == 2) return checked(std::move(reply));
    session_ = 0;  // its place went to another: join again
  }
}

void Session::check_size(const std::vector<uint8_t>& body) {
  static const auto head = static_cast<size_t>(request_t{}.getEncodedSize());
  Bus::check_size(kRequestChannel, head + body.size());
}

void Session::leave() {
  if (session_ == 0) return;
  std::unique_lock lock(mutex_);
  if (leaving_.exchange(true)) {
    news_.wait(lock, [this] { return gone_; });
    return;
  }
  repeat_leave(lock);
  gone_ = true;
  news_.notify_all();
}

void Session::repeat_leave(std::unique_lock<std::mutex>& lock) {
  const int64_t sequence = ++sequence_;
  // Counted, since in a second without a processor one alone would go out.
  for (int sent = 0; sent < kMostLeaves; ++sent) {
    send(request_t::LEAVE, session_, sequence, {}, -1);
    const bool answered = news_.wait_for(lock, kRepeatTime, [this] { return left_; });
    if (answered || core_.server_has_ended()) return;
  }
}

void Session::join(Duration timeout) {
  join_t body;
  body.client = name_;
  std::random_device random;
  const int64_t number =
      static_cast<int64_t>((static_cast<uint64_t>(random()) << 32 | random()) >> 2) + 1;
  checked(exchange(request_t::JOIN, 0, number, encoded(body), timeout));
  sequence_ = 0;
}

Reply Session::exchange(int32_t kind, int64_t session, int64_t sequence,
                        const std::vector<uint8_t>& body, Duration timeout) {
  const Clock::time_point deadline = deadline_after(timeout);
  std::unique_lock lock(mutex_);
  awaited_kind_ = kind;
  awaited_sequence_ = sequence;
  reply_.reset();
  while (!reply_) {
    if (core_.info()->run_id != run_id_) {
      awaited_kind_ = 0;
      throw RequestError(kind_name(kind) + ": another run has begun meanwhile",
                         ReplyCode::wrong_run);
    }
    if (Clock::now() >= deadline) {
      awaited_kind_ = 0;
      throw Timeout("no reply to " + kind_name(kind) + " on ruedo/reply within " +
                    text_of(timeout) + " s");
    }
    lock.unlock();  // it may take long, and the receiving thread continues meanwhile
    publish(kind, session, sequence, body);
    lock.lock();
    news_.wait_for(lock, kRepeatTime, [this] { return reply_.has_value(); });
    core_.check_open();
    if (!reply_) core_.check_server();  // else the run may have ended since
  }
  awaited_kind_ = 0;
  return std::move(*reply_);
}

void Session::publish(int32_t kind, int64_t session, int64_t sequence,
                      const std::vector<uint8_t>& body, int32_t epoch) {
  if (!leaving_) send(kind, session, sequence, body, epoch);
}

void Session::send(int32_t kind, int64_t session, int64_t sequence,
                   const std::vector<uint8_t>& body, int32_t epoch) {
  request_t request;
  request.utime = core_.utime();
  request.run_id = run_id_;
  request.epoch = epoch;
  request.session = session;
  request.sequence = sequence;
  request.kind = kind;
  request.size = static_cast<int32_t>(body.size());
  request.body = body;
  core_.bus().publish(kRequestChannel, request);
}

void Session::on_reply(const uint8_t* bytes, size_t size) {
  Reply reply;
  try {
    WireReader in(bytes, size);
    if (in.int64() != reply_t::getHash()) return;
    in.int64();                                    // utime
    if (!core_.is_of_our_run(in.int64())) return;  // another server's, which was not asked
    reply.epoch = in.int32();
    reply.session = in.int64();
    reply.sequence = in.int64();
    reply.kind = in.int32();
    reply.code = in.int32();
    reply.text = in.text();
    reply.body = in.bytes(in.count(1));
  } catch (const WireError&) {
    return;
  }
  if (reply.code == reply_t::ENDED && reply.session == 0)  // without a request
    return core_.note_end(reply.text);
  if (reply.kind != request_t::JOIN && reply.session != session_) return;
  std::unique_lock lock(mutex_);
  if (reply.kind == request_t::LEAVE) {
    left_ = true;
    news_.notify_all();
  } else if (reply.kind == awaited_kind_ && reply.sequence == awaited_sequence_) {
    // At once: leave() in another thread is to know of it.
    if (reply.kind == request_t::JOIN && reply.code == reply_t::OK) session_ = reply.session;
    reply_ = std::move(reply);
    news_.notify_all();
  } else if (reply.kind == request_t::GRANT || reply.kind == request_t::RESEND) {
    lock.unlock();
    core_.stepper().on_reply(reply);
  }
}

void wrong_body(const char* type, const std::exception& error) {
  throw TypeMismatch(std::string("the reply's body is not a ") + type +
                     " of this client's version: " + error.what());
}

}  // namespace ruedo::client
