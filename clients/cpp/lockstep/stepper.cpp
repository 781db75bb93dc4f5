// Grants and the repair of what was lost.
#include "lockstep/stepper.h"

#include <algorithm>
#include <utility>

#include "core.h"
#include "ruedo/grant_reply_t.hpp"
#include "ruedo/grant_request_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/resend_request_t.hpp"
#include "samples/world_info.h"

namespace ruedo::client {
namespace {

constexpr auto kFirstRepeat = std::chrono::milliseconds(5),
               kLastRepeat = std::chrono::milliseconds(100);
constexpr int kDoubtedAfter = 20;             // silences in a row: 1.7 s and more
constexpr size_t kMostWanted = 256;           // messages requested at once
constexpr int64_t kFurthest = INT64_MAX / 2;  // steps

}  // namespace

Observations Stepper::step(int64_t n, const std::vector<Command>& commands, Duration timeout) {
  if (n < 0) throw std::invalid_argument("n is " + std::to_string(n) + ": it must be at least 0");
  for (const Command& command : commands) {
    if (command.after >= 0 && command.after < n) continue;
    throw std::invalid_argument("a command is for " + std::to_string(command.after) +
                                " steps on; of " + std::to_string(n) + " steps 0 to " +
                                std::to_string(n - 1) + " is allowed");
  }
  core_.check_may_wait();
  std::lock_guard one_at_a_time(one_at_a_time_);
  const auto turn = core_.session().turn();
  core_.check_open();
  const CallbackQueue::Borrowed callbacks(core_.callbacks());  // they return before this does
  std::unique_lock lock(mutex_);
  if (part_) {
    check_run();
  } else {
    lock.unlock();
    take_part(timeout);
    if (n == 0 && have_ >= 0) look(timeout);
    lock.lock();
  }
  wait(lock, have_, timeout);  // returns at once, unless the previous call gave up
  const int64_t until = n > INT64_MAX - granted_ ? INT64_MAX : granted_ + n;
  if (n > 0) {
    std::vector<uint8_t> body = grant_body(until, commands);
    Session::check_size(body);  // before anything is granted
    grant_ = {core_.session().next_sequence(), granted_, std::move(body), false};
    granted_ = until;
    acknowledged_ = have_;  // the grant says so
    grant_again();
  }
  wait(lock, until, timeout);
  if (early_.size() > info_->channel_list.size() ||
      core_.info() != info_) {  // a model came on the way
    lock.unlock();
    if (early_.size() > core_.info()->channel_list.size()) core_.refresh_info();
    subscribe();
    lock.lock();
  }
  Observations observations;
  collect(observations);
  lock.unlock();
  core_.clock().note(observations.utime);
  return observations;
}

std::string Stepper::whose_turn() {
  const std::unique_lock no_step(one_at_a_time_, std::try_to_lock);
  const std::lock_guard lock(mutex_);
  const std::string& name = core_.session().name();
  if (!part_) {
    return "in lockstep the clients that take part grant each step, and this one, '" + name +
           "', does not: step() takes part";
  }
  if (!no_step && !waits_for_.empty()) return "in lockstep it waits for " + waits_for_;
  return "in lockstep it waits for the next step() of this client, '" + name + "'";
}

void Stepper::forget() {
  std::lock_guard lock(mutex_);
  part_ = false;
}

void Stepper::check_run() {
  if (core_.info()->run_id == run_id_) return;
  part_ = false;
  throw NoServer("the run that this client took part in has ended; another is at " + core_.url() +
                 " now");
}

void Stepper::take_part(Duration timeout) {
  core_.bus().receive_eagerly();
  subscribe();
  grant_request_t body{};
  body.granted = -1;
  body.received = -1;
  const Reply reply = core_.session().request_in_turn(request_t::GRANT, encoded(body), timeout);
  std::lock_guard lock(mutex_);
  try {
    WireReader in(reply.body.data(), reply.body.size());
    if (in.int64() != grant_reply_t::getHash()) throw WireError("another version of the type");
    granted_ = in.int64();
    have_ = in.int64();
    newest_ = in.int64();
    if (granted_ < 0 || granted_ > kFurthest || have_ < -1 || have_ > granted_)
      throw WireError("impossible steps");
  } catch (const WireError& error) {
    throw TypeMismatch(
        std::string("the reply to GRANT is not a grant_reply_t of this client's version: ") +
        error.what());
  }
  run_id_ = core_.info()->run_id;
  epoch_ = reply.epoch;
  collected_ = acknowledged_ = have_;
  grant_ = {};
  steps_.clear();
  listed_ = 0;
  names_.begin(*core_.info());
  waits_for_.clear();
  fault_ = nullptr;
  part_ = true;
}

// Reads the current state, for a client that joins later and grants nothing.
void Stepper::look(Duration timeout) {
  const State state = state_of(
      core_.session().request_in_turn(request_t::GET_STATE, encoded(name_request_t{}), timeout));
  const std::lock_guard lock(mutex_);
  collected_ = state.step;
  last_utime_ = state.utime;
  last_hash_ = state.state_hash;
}

// Subscribes to everything that the simulation publishes: a manifest may name any of it.
void Stepper::subscribe() {
  const auto info = core_.info();
  if (info_ == info) return;
  {
    std::lock_guard lock(mutex_);
    early_.resize(std::max(early_.size(), info->channel_list.size()));
  }
  const auto wanted = [&](size_t i) {
    if (i >= info->channel_list.size()) return std::string();
    const ChannelInfo& channel = info->channel_list[i];
    return channel.input || (channel.robot.empty() && channel.type != "world_state_t")
               ? std::string()
               : channel.name;
  };
  for (auto it = sources_.begin(); it != sources_.end();)
    it = it->second.first == wanted(it->first) ? std::next(it) : sources_.erase(it);
  for (size_t i = 0; i < info->channel_list.size(); ++i) {
    const std::string channel = wanted(i);
    if (channel.empty() || sources_.count(i)) continue;
    const auto index = static_cast<int32_t>(i);
    sources_[i] = {channel, core_.bus().subscribe(channel, [self = core_.weak_from_this(), index](
                                                               const uint8_t* bytes, size_t size) {
                     if (const auto core = self.lock())
                       core->stepper().on_message(index, bytes, size);
                   })};
  }
  std::lock_guard lock(mutex_);
  info_ = info;
}

std::vector<uint8_t> Stepper::grant_body(int64_t until,
                                         const std::vector<Command>& commands) const {
  grant_request_t body;
  body.granted = granted_;
  body.step_until = until;
  body.received = have_;
  for (const Command& command : commands) {
    grant_command_t& sent = body.commands.emplace_back();
    sent.step = granted_ + command.after;
    sent.channel = command.channel;
    sent.size = static_cast<int32_t>(command.bytes.size());
    sent.data = command.bytes;
  }
  body.ncommands = static_cast<int32_t>(body.commands.size());
  return encoded(body);
}

// Until the states up to `until` are here with all their messages. After a silence the grant, or
// the request for what is missing, goes out again, sooner at first.
void Stepper::wait(std::unique_lock<std::mutex>& lock, int64_t until, Duration timeout) {
  Clock::duration repeat = kFirstRepeat;
  int silences = 0;
  Clock::time_point deadline = deadline_after(timeout);
  const auto done = [&] { return have_ >= until && grant_.taken; };
  if (done()) return;
  lock.unlock();
  Bus::Turn turn(core_.bus());
  lock.lock();
  while (!done()) {
    const int64_t had = have_;
    const auto news_here = [&] {
      return done() || fault_ || ask_now_ || have_ - acknowledged_ >= kAcknowledgedTogether;
    };
    const Clock::time_point quiet_at = Clock::now() + repeat;
    for (Clock::time_point now = quiet_at - repeat; !news_here() && now < quiet_at;
         now = Clock::now()) {
      lock.unlock();
      core_.check_open();
      turn.handle(quiet_at - now);
      core_.callbacks().run_waiting();
      lock.lock();
    }
    const bool news = news_here();
    if (fault_) {
      part_ = false;
      std::rethrow_exception(std::exchange(fault_, nullptr));
    }
    if (done()) return;
    const bool silence = !news && have_ == had;
    silences = silence ? silences + 1 : 0;
    if (silences == kDoubtedAfter) {
      silences = 0;
      doubt();
    }
    if (!grant_.taken && silence) {
      grant_again();
    } else if (grant_.taken && (silence || ask_now_)) {
      ask_for_lost(until);
    } else if (have_ - acknowledged_ >= kAcknowledgedTogether) {
      ask_for_lost(have_);  // asks for nothing, but says what is here
    }
    ask_now_ = false;
    repeat = silence ? std::min<Clock::duration>(2 * repeat, kLastRepeat)
                     : Clock::duration(kFirstRepeat);
    if (have_ > had) deadline = deadline_after(timeout);
    if (!silence) continue;
    lock.unlock();
    core_.check_server();
    lock.lock();
    check_run();
    if (Clock::now() < deadline) continue;
    throw Timeout("step " + std::to_string(have_ + 1) + " did not come within " + text_of(timeout) +
                  " s" + (waits_for_.empty() ? "" : ": the run waits for " + waits_for_));
  }
}

// Forgets incomplete steps, which are requested again.
void Stepper::forget_steps() {
  steps_.erase(steps_.upper_bound(have_), steps_.end());
  listed_ = 0;
}

// Some of the messages since the last complete step may not be the server's: all are requested
// again.
void Stepper::doubt() {
  forget_steps();
  newest_ = have_;
  grant_.taken = grant_.body.empty();
}

void Stepper::grant_again() {
  core_.session().publish(request_t::GRANT, core_.session().id(), grant_.sequence, grant_.body,
                          epoch_);
}

void Stepper::ask_for_lost(int64_t until) {
  resend_request_t body;
  body.received = acknowledged_ = have_;
  const auto want = [&](int64_t step, int32_t channel, int64_t sequence, size_t offset) {
    if (body.wanted.size() == kMostWanted) return;
    resend_wanted_t& wanted = body.wanted.emplace_back();
    wanted.step = step;
    wanted.channel_index = channel;
    wanted.sequence = sequence;
    wanted.offset = static_cast<int32_t>(offset);
  };
  const int64_t last = std::min(
      until, std::max({newest_, have_ + 1, steps_.empty() ? have_ : steps_.rbegin()->first}));
  for (int64_t step = have_ + 1; step <= last && body.wanted.size() < kMostWanted; ++step) {
    const auto found = steps_.find(step);
    if (found == steps_.end()) {
      want(step, info_->tick_channel, 0, 0);
      continue;
    }
    for (size_t part = 0; part < found->second.nparts; ++part) {
      if (!found->second.part_here[part])
        want(step, info_->tick_channel, static_cast<int64_t>(part), 0);
      for (const Entry& entry : found->second.parts[part]) {
        if (!entry.here()) want(step, entry.channel, entry.sequence, entry.bytes.size());
      }
    }
  }
  body.nwanted = static_cast<int32_t>(body.wanted.size());
  core_.session().publish(request_t::RESEND, core_.session().id(), ++resend_sequence_,
                          encoded(body), epoch_);
}

void Stepper::collect(Observations& observations) {
  for (auto step = steps_.begin(); step != steps_.end() && step->first <= have_;
       step = steps_.erase(step)) {
    observations.step = collected_ = step->first;
    observations.utime = step->second.utime;
    observations.state_hash = step->second.state_hash;
    names_.go_to(observations.utime);
    for (std::vector<Entry>& part : step->second.parts) {
      for (Entry& entry : part) {
        observations.messages.push_back(
            {step->first, names_.of(static_cast<size_t>(entry.channel)), std::move(entry.bytes)});
      }
    }
    last_utime_ = observations.utime;
    last_hash_ = observations.state_hash;
  }
  observations.step = collected_;  // n = 0: the state of the call before
  observations.utime = last_utime_;
  observations.state_hash = last_hash_;
  observations.rate = kFast;
}

}  // namespace ruedo::client
