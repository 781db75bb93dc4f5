// A lockstep client written from the protocol's page alone: it knows the message types, but none of
// the client libraries.
#pragma once

#include <atomic>
#include <chrono>
#include <map>
#include <random>
#include <stdexcept>
#include <utility>

#include "base/crc32.h"
#include "lossy_bus.h"
#include "ruedo/decode.h"
#include "ruedo/grant_reply_t.hpp"
#include "ruedo/grant_request_t.hpp"
#include "ruedo/join_t.hpp"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/resend_reply_t.hpp"
#include "ruedo/resend_request_t.hpp"
#include "ruedo/tick_t.hpp"

namespace ruedo::run {

class LockstepClient {
 public:
  struct Seen {
    int64_t state_hash = 0;
    std::vector<std::pair<std::string, std::vector<uint8_t>>>
        messages;  // of the manifest, in its order
  };

  // channels: the server's, whose indices are those of a manifest. over: if given,
  // a waiting call lasts until the run is over, and throws then.
  LockstepClient(LossyBus& bus, const engine::Channels& channels, std::string name,
                 const std::atomic<bool>* over = nullptr)
      : bus_(bus),
        channels_(channels),
        listener_(bus.connect()),
        name_(std::move(name)),
        over_(over) {
    for (size_t i = 0; i < channels.list().size(); ++i) {
      if (channels.list()[i].type == "tick_t") tick_channel_ = static_cast<int32_t>(i);
      by_name_[channels.list()[i].bus_name] = static_cast<int32_t>(i);
    }
  }

  void join() {
    join_t join;
    join.client = name_;
    session_ =
        ask(request_t::JOIN, std::random_device{}() + int64_t{1}, engine::encoded(join)).session;
  }

  // Joins at the run's current state.
  void begin() {
    grant_request_t grant;
    grant.granted = grant.step_until = grant.received = -1;
    grant.ncommands = 0;
    const reply_t reply = ask(request_t::GRANT, ++sequence_, engine::encoded(grant));
    grant_reply_t stands;
    if (reply.code != reply_t::OK ||
        decode_checked(reply.body.data(), reply.body.size(), stands) != DecodeFault::none) {
      throw std::runtime_error("GRANT -1: " + reply.text);
    }
    granted_ = stands.granted;
    have_ = stands.received;
  }

  void take_part() {
    join();
    begin();
  }

  void command(int64_t step, const std::string& channel, const std::vector<uint8_t>& bytes) {
    grant_command_t command;
    command.step = step;
    command.channel = channel;
    command.size = static_cast<int32_t>(bytes.size());
    command.data = bytes;
    commands_.push_back(command);
  }

  // Grants n steps with the given commands, and waits for all of their messages.
  void step(int64_t n) {
    grant_request_t grant;
    grant.granted = granted_;
    grant.step_until = granted_ + n;
    grant.received = have_;
    grant.commands = std::exchange(commands_, {});
    grant.ncommands = static_cast<int32_t>(grant.commands.size());
    const std::vector<uint8_t> body = engine::encoded(grant);
    const int64_t sequence = ++sequence_;
    const int64_t from = std::exchange(granted_, grant.step_until);
    bool taken = false;
    give_up_at_ = Clock::now() + kPatience;
    send(request_t::GRANT, sequence, body);
    for (Clock::time_point again = Clock::now() + kAgain; have_ < granted_;) {
      if (const std::optional<Message> message = listener_->receive(kAgain)) {
        taken |= take(*message, sequence);
        taken |= newest_ > from;
      }
      if (Clock::now() >= again) {  // others are heard all the time: not after silence
        check_run();
        if (!taken) send(request_t::GRANT, sequence, body);
        ask_for_lost();
        again = Clock::now() + kAgain;
      }
      if (have_ - acknowledged_ >= 32) ask_for_lost();
    }
  }

  void leave() { send(request_t::LEAVE, ++sequence_, {}); }
  int64_t have() const { return have_; }
  int64_t session() const { return session_; }
  const std::map<int64_t, Seen>& seen() const { return seen_; }

  void send(int32_t kind, int64_t sequence, const std::vector<uint8_t>& body) {
    request_t request;
    request.utime = 0;
    request.run_id = 0;
    request.epoch = -1;
    request.session = kind == request_t::JOIN ? 0 : session_;
    request.sequence = sequence;
    request.kind = kind;
    request.size = static_cast<int32_t>(body.size());
    request.body = body;
    bus_.send("ruedo/request", engine::encoded(request));
  }

  reply_t ask(int32_t kind, int64_t sequence, const std::vector<uint8_t>& body) {
    give_up_at_ = Clock::now() + kPatience;
    for (;;) {
      check_run();
      send(kind, sequence, body);
      for (const Clock::time_point again = Clock::now() + 5 * kAgain; Clock::now() < again;) {
        const std::optional<Message> message = listener_->receive(kAgain);
        if (!message) continue;
        reply_t reply;
        if (message->channel != "ruedo/reply") {
          take(*message, 0);
        } else if (decode_checked(message->bytes.data(), message->bytes.size(), reply) ==
                       DecodeFault::none &&
                   reply.kind == kind && reply.sequence == sequence &&
                   (kind == request_t::JOIN || reply.session == session_)) {
          return reply;
        }
      }
    }
  }
  int64_t next_sequence() { return ++sequence_; }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kAgain{4};  // until an unanswered request is repeated
  static constexpr std::chrono::seconds kPatience{120};  // with a call

  struct Step {
    std::map<int, tick_t> parts;
    std::map<std::pair<int32_t, int64_t>, std::vector<uint8_t>> resent;
  };

  void check_run() const {
    if (over_ && *over_) throw std::runtime_error(name_ + ": the run is over");
    if (Clock::now() >= give_up_at_) throw std::runtime_error(name_ + ": the run stands still");
  }

  // Whether the message says that the grant was executed.
  bool take(const Message& message, int64_t sequence) {
    bool taken = false;
    if (message.channel == "ruedo/tick") {
      take_tick(message.bytes);
    } else if (message.channel == "ruedo/reply") {
      reply_t reply;
      resend_reply_t resent;
      if (decode_checked(message.bytes.data(), message.bytes.size(), reply) != DecodeFault::none ||
          reply.session != session_)
        return false;
      if (reply.code != reply_t::OK) throw std::runtime_error(name_ + ": " + reply.text);
      taken = reply.kind == request_t::GRANT && reply.sequence == sequence;
      if (reply.kind == request_t::RESEND &&
          decode_checked(reply.body.data(), reply.body.size(), resent) == DecodeFault::none)
        take_resent(resent);
    } else if (const auto channel = by_name_.find(message.channel); channel != by_name_.end()) {
      early_[{channel->second,
              static_cast<int32_t>(crc32(message.bytes.data(), message.bytes.size()))}] =
          message.bytes;
      if (early_.size() > 4096) early_.clear();
    }
    complete();
    return taken;
  }

  void take_tick(const std::vector<uint8_t>& bytes) {
    tick_t tick;
    if (decode_checked(bytes.data(), bytes.size(), tick) != DecodeFault::none) return;
    newest_ = std::max(newest_, tick.step);
    if (tick.step > have_) steps_[tick.step].parts[tick.part] = tick;
  }

  void take_resent(const resend_reply_t& resent) {
    for (const resend_part_t& part : resent.parts) {
      if (part.channel_index == tick_channel_) {
        take_tick(part.data);
      } else if (part.step > have_) {
        std::vector<uint8_t>& bytes = steps_[part.step].resent[{part.channel_index, part.sequence}];
        if (bytes.size() == static_cast<size_t>(part.offset))
          bytes.insert(bytes.end(), part.data.begin(), part.data.end());
      }
    }
  }

  // Empty if it has not arrived.
  const std::vector<uint8_t>* find(const Step& step, const tick_message_t& entry) const {
    const auto whole = [&](const std::vector<uint8_t>& bytes) {
      return bytes.size() == static_cast<size_t>(entry.size) &&
             static_cast<int32_t>(crc32(bytes.data(), bytes.size())) == entry.crc;
    };
    const auto early = early_.find({entry.channel_index, entry.crc});
    if (early != early_.end() && whole(early->second)) return &early->second;
    const auto resent = step.resent.find({entry.channel_index, entry.sequence});
    return resent != step.resent.end() && whole(resent->second) ? &resent->second : nullptr;
  }

  void complete() {
    for (auto step = steps_.find(have_ + 1); step != steps_.end(); step = steps_.find(have_ + 1)) {
      const auto& parts = step->second.parts;
      if (parts.empty() || parts.size() != static_cast<size_t>(parts.begin()->second.nparts))
        return;
      Seen seen;
      for (const auto& [index, tick] : parts) {
        seen.state_hash = tick.state_hash;
        for (const tick_message_t& entry : tick.manifest) {
          const std::vector<uint8_t>* bytes = find(step->second, entry);
          if (!bytes) return;
          seen.messages.emplace_back(channels_.list()[entry.channel_index].bus_name, *bytes);
        }
      }
      seen_[++have_] = std::move(seen);
      steps_.erase(step);
    }
  }

  void ask_for_lost() {
    resend_request_t body;
    body.received = acknowledged_ = have_;
    const auto want = [&](int64_t step, int32_t channel, int64_t sequence, size_t offset) {
      if (body.wanted.size() < 200) body.wanted.push_back(wanted(step, channel, sequence, offset));
    };
    for (int64_t number = have_ + 1; number <= std::max(newest_, have_ + 1); ++number) {
      const Step& step = steps_[number];
      const int nparts = step.parts.empty() ? 1 : step.parts.begin()->second.nparts;
      for (int part = 0; part < nparts; ++part) {
        const auto tick = step.parts.find(part);
        if (tick == step.parts.end()) {
          want(number, tick_channel_, part, 0);
          continue;
        }
        for (const tick_message_t& entry : tick->second.manifest) {
          const auto begun = step.resent.find({entry.channel_index, entry.sequence});
          if (!find(step, entry))
            want(number, entry.channel_index, entry.sequence,
                 begun == step.resent.end() ? 0 : begun->second.size());
        }
      }
    }
    body.nwanted = static_cast<int32_t>(body.wanted.size());
    send(request_t::RESEND, ++resends_, engine::encoded(body));
  }

  static resend_wanted_t wanted(int64_t step, int32_t channel, int64_t sequence, size_t offset) {
    resend_wanted_t wanted;
    wanted.step = step;
    wanted.channel_index = channel;
    wanted.sequence = sequence;
    wanted.offset = static_cast<int32_t>(offset);
    return wanted;
  }

  LossyBus& bus_;
  const engine::Channels channels_;
  std::shared_ptr<LossyBus::Listener> listener_;
  std::string name_;
  const std::atomic<bool>* over_;
  Clock::time_point give_up_at_;
  int32_t tick_channel_ = -1;
  std::map<std::string, int32_t> by_name_;
  int64_t session_ = 0, sequence_ = 0, resends_ = 0, granted_ = 0, have_ = -1, acknowledged_ = -1,
          newest_ = -1;
  std::vector<grant_command_t> commands_;
  std::map<int64_t, Step> steps_;
  std::map<std::pair<int32_t, int32_t>, std::vector<uint8_t>> early_;  // by channel and crc
  std::map<int64_t, Seen> seen_;
};

}  // namespace ruedo::run
