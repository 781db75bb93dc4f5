// Grants, commands for steps to come, and leases.
#include "run/lockstep/lockstep.h"

#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/channel_names.h"
#include "ruedo/decode.h"
#include "ruedo/grant_reply_t.hpp"

namespace ruedo::run {
namespace {

constexpr auto kLastWords =
    std::chrono::seconds(1);  // for clients to ask again for lost messages after the end

bool read_grant(const request_t& request, grant_request_t& grant) {
  return decode_checked(request.body.data(), request.body.size(), grant) == DecodeFault::none;
}

const Session* session_of(const std::vector<Session>& sessions, int64_t id) {
  const auto found = std::find_if(sessions.begin(), sessions.end(),
                                  [&](const Session& session) { return session.id == id; });
  return found == sessions.end() ? nullptr : &*found;
}

}  // namespace

Lockstep::Lockstep(const LockstepOptions& options, std::function<void(const applied_t&)> record)
    : options_(options), record_(std::move(record)) {}

void Lockstep::begin(const Stage& stage, int64_t step) {
  inbox_ = stage.inbox;
  gate_ = stage.gate;
  check_possible_ = stage.check_possible;
  kept_.clear();
  limit_ = step < 0 && started_ ? 0 : step;
  published_ = step;
  for (Member& member : members_) {
    member.granted = std::max<int64_t>(step, 0);
    member.received = step;
    member.held.clear();
    member.scheduled = member.held_bytes = 0;
    member.grants.clear();
  }
  gate_->set_limit(limit_);
}

// The inbox has dropped those that it had.
void Lockstep::models_changed(const Stage&, int64_t) {
  const auto is_gone = [this](const Held& command) {
    return inbox_->inputs()[command.input].channel.empty();
  };
  for (Member& member : members_) {
    const auto next = member.held.begin() + static_cast<std::ptrdiff_t>(member.scheduled);
    member.scheduled -= static_cast<size_t>(std::count_if(member.held.begin(), next, is_gone));
    for (const Held& command : member.held)
      if (is_gone(command)) member.held_bytes -= command.bytes.size();
    std::erase_if(member.held, is_gone);
  }
}

Lockstep::Member* Lockstep::find(int64_t session) {
  const auto found = std::find_if(members_.begin(), members_.end(),
                                  [&](const Member& member) { return member.session == session; });
  return found == members_.end() ? nullptr : &*found;
}

engine::Outcome Lockstep::stands(const Member& member) const {
  grant_reply_t reply;
  reply.granted = member.granted;
  reply.received = member.received;
  reply.step = published_;
  return engine::Outcome::with(engine::encoded(reply));
}

engine::Outcome Lockstep::take_part(const Session& session) {
  if (const Member* member = find(session.id)) return stands(*member);
  const auto place = std::find_if(members_.begin(), members_.end(), [&](const Member& member) {
    return member.name >= session.client;
  });
  if (place != members_.end() && place->name == session.client) {
    if (!place->silent)
      return engine::Outcome::refuse(reply_t::REFUSED,
                                     "a client called '" + session.client + "' takes part already");
    place->session = session.id;  // its grants are kept
    place->silent = false;
    place->grants.clear();
    note(request_t::JOIN, *place);
    advance();
    return stands(*place);
  }
  Member member;
  member.session = session.id;
  member.name = session.client;
  member.granted = std::max<int64_t>(limit_, 0);
  member.received = limit_;
  const Member& added = *members_.insert(place, std::move(member));
  if (started_) note(request_t::JOIN, added);
  const engine::Outcome outcome = stands(added);
  advance();
  return outcome;
}

bool Lockstep::early(const request_t& request, const Session& session) const {
  const Member* member = find(session.id);
  grant_request_t grant;
  if (!member || !read_grant(request, grant)) return false;
  if (grant.granted > member->granted) return true;
  if (grant.granted == member->granted && member->grants.size() >= kMostGrants) return true;
  size_t bytes = 0;
  for (const grant_command_t& command : grant.commands) bytes += command.data.size();
  return grant.granted == member->granted && !member->held.empty() &&
         !has_room(*member, grant.commands.size(), bytes);
}

// Every client has the same share of the room, so that none takes another's.
bool Lockstep::has_room(const Member& member, size_t count, size_t bytes) const {
  const size_t share = std::max<size_t>(members_.size(), 1);
  return member.held.size() + count <= kMostHeld / share &&
         member.held_bytes + bytes <= kMostHeldBytes / share;
}

std::string Lockstep::fault_of(const grant_request_t& grant, const Member& member) const {
  if (grant.granted != member.granted)
    return fmt::format("granted is {}, but this client has granted the steps up to {}",
                       grant.granted, member.granted);
  if (grant.step_until < grant.granted)
    return fmt::format("step_until is {}, below granted, {}", grant.step_until, grant.granted);
  if (grant.step_until - grant.granted > kMostSteps) {
    return fmt::format("step_until is {}, and granted {}: at most {} steps at once are allowed",
                       grant.step_until, grant.granted, kMostSteps);
  }
  return fault_of(grant.received, member);
}

// Who joined on the way stands where the others' grants do, which may be ahead of what is
// published.
std::string Lockstep::fault_of(int64_t received, const Member& member) const {
  if (received <= std::max(published_, member.received)) return "";
  return fmt::format("received is {}, but the newest state is {}", received, published_);
}

std::string Lockstep::take_commands(const grant_request_t& grant, std::vector<Held>& held) const {
  const auto& inputs = inbox_->inputs();
  robot::Command decoded;
  auto input = inputs.begin();  // commands mostly come in the order of the robots
  for (size_t i = 0; i < grant.commands.size(); ++i) {
    const grant_command_t& command = grant.commands[i];
    const auto which = [&] { return fmt::format("command {} ({})", i, command.channel); };
    if (command.step < grant.granted || command.step >= grant.step_until) {
      return fmt::format("{} is for step {}; {} to {} is granted", which(), command.step,
                         grant.granted, grant.step_until - 1);
    }
    const auto names_it = [&](const engine::Input& one) { return one.channel == command.channel; };
    input = std::find_if(input, inputs.end(), names_it);
    if (input == inputs.end()) input = std::find_if(inputs.begin(), inputs.end(), names_it);
    if (input == inputs.end() || command.channel.empty())
      return which() + ": no robot takes commands on that channel";
    if (command.data.size() > engine::CommandInbox::kMaxMessageSize)
      return which() + " is larger than 64 kB";
    const DecodeFault fault =
        engine::decode_command(input->kind, command.data.data(), command.data.size(), decoded);
    if (fault != DecodeFault::none) return which() + ": " + describe(fault);
    if (!engine::is_finite(decoded)) return which() + ": a value is not finite";
    if (const std::string wrong =
            engine::check_values(input->kind, command.data.data(), command.data.size());
        !wrong.empty())
      return which() + ": " + wrong;
    decoded.robot = input->robot;
    if (const std::string wrong = input->robot.valid() ? check_possible_(decoded) : "";
        !wrong.empty())
      return which() + ": " + wrong;
    held.push_back({command.step, engine::InputIndex(input - inputs.begin()), command.data});
  }
  std::stable_sort(held.begin(), held.end(),
                   [](const Held& a, const Held& b) { return a.step < b.step; });
  return "";
}

std::string Lockstep::refusal(int32_t kind, bool) const {
  switch (kind) {
    case request_t::RESTORE:
      return "a run in lockstep cannot be set to a snapshot: start one with --restore";
    case request_t::GRANT:
    case request_t::RESEND:
    case request_t::INFO:
    case request_t::QUIT:
    case request_t::STEP: return "";  // a STEP is answered that grants take steps here
    default:
      return begun() ? ""
                     : "lockstep has not begun: call step(0), or grant. It waits for " +
                           waits_for(published_);
  }
}

engine::Outcome Lockstep::grant(const request_t& request, const Session& session) {
  if (request.kind == request_t::RESEND) return resend(request, session);
  grant_request_t grant;
  if (!read_grant(request, grant))
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, "the body is not a grant_request_t");
  if (grant.granted == -1) return take_part(session);
  Member* member = find(session.id);
  if (!member)
    return engine::Outcome::refuse(
        reply_t::BAD_REQUEST, "this client does not take part: a grant of granted -1 comes first");
  if (over_)
    return engine::Outcome::refuse(reply_t::ENDED,
                                   fmt::format("the run has ended at step {}", published_));
  if (std::string wrong = fault_of(grant, *member); !wrong.empty())
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, std::move(wrong));
  std::vector<Held> held;
  if (std::string wrong = take_commands(grant, held); !wrong.empty())
    return engine::Outcome::refuse(reply_t::BAD_REQUEST, std::move(wrong));
  size_t bytes = 0;
  for (const Held& command : held) bytes += command.bytes.size();
  if (!has_room(*member, held.size(), bytes)) {
    return engine::Outcome::refuse(
        reply_t::REFUSED,
        fmt::format("{} commands of {} bytes are more than a client may send ahead", held.size(),
                    bytes));
  }
  member->held_bytes += bytes;
  std::move(held.begin(), held.end(), std::back_inserter(member->held));
  if (grant.step_until > grant.granted) member->grants.push_back({grant.granted, request.sequence});
  member->granted = grant.step_until;
  member->received = std::max(member->received, grant.received);
  forget();
  advance();
  engine::Outcome outcome = stands(*member);
  outcome.quiet = true;
  return outcome;
}

// Lets the run go as far as all have granted.
void Lockstep::advance() {
  if (!started_) {
    if (members_.size() < static_cast<size_t>(options_.clients)) return;
    started_ = true;
    for (const Member& member : members_) note(request_t::JOIN, member);
  }
  int64_t until = members_.empty() ? limit_ : INT64_MAX;
  for (const Member& member : members_)
    until = std::min(until, member.silent ? limit_ : member.granted);
  until = std::min(until, std::max<int64_t>(published_, 0) + kMostAhead);
  if (until <= limit_) return;
  schedule(until);
  limit_ = until;
  gate_->set_limit_quietly(limit_);  // the publisher continues from here
}

// Commands of one step go in the order of the clients' names, each client's in the order of its
// grants.
void Lockstep::schedule(int64_t until) {
  for (int64_t step = std::max<int64_t>(limit_, 0); step < until;) {
    int64_t next = until;
    for (Member& member : members_) {
      for (; member.scheduled < member.held.size(); ++member.scheduled) {
        const Held& command = member.held[member.scheduled];
        if (command.step > step) {
          next = std::min(next, command.step);
          break;
        }
        if (inbox_->schedule(command.step, command.input, command.bytes.data(),
                             command.bytes.size()) != engine::CommandInbox::Scheduled::kept) {
          spdlog::error("lockstep: a command of '{}' for step {} found no place", member.name,
                        command.step);
        }
      }
    }
    step = next;
  }
}

void Lockstep::forget() {
  int64_t received = published_;
  for (const Member& member : members_) received = std::min(received, member.received);
  kept_.forget(received);
}

void Lockstep::published(int64_t step) {
  published_ = step;
  for (Member& member : members_) {
    while (!member.held.empty() && member.scheduled > 0 && member.held.front().step < step) {
      member.held_bytes -= member.held.front().bytes.size();
      member.held.pop_front();
      --member.scheduled;
    }
  }
  if (members_.empty()) forget();
  advance();
}

void Lockstep::add_applied(TickWriter& tick, int64_t step, const std::vector<Session>& sessions) {
  for (Member& member : members_) {
    while (member.grants.size() > 1 && member.grants[1].from < step) member.grants.pop_front();
    const bool any = !member.grants.empty() && member.grants.front().from < step;
    tick.add_applied(member.name, any ? member.grants.front().sequence : 0);
  }
  for (const Session& session : sessions) {
    if (!find(session.id)) tick.add_applied(session.client, session.last_sequence);
  }
}

bool Lockstep::keeps(int64_t session) const {
  const Member* member = find(session);
  return member && !member->silent;
}

std::string Lockstep::waits_for(int64_t) const {
  if (begun() && gate_->paused()) return "a RESUME: it is paused";
  if (!started_)
    return fmt::format("{} more of {} clients",
                       static_cast<size_t>(options_.clients) - members_.size(), options_.clients);
  if (members_.empty()) return "a client that takes part";
  std::string names;
  for (const Member& member : members_) {
    if (member.granted > limit_ && !member.silent) continue;
    names += (names.empty() ? "'" : ", '") + member.name + (member.silent ? "' (silent)" : "'");
  }
  return names;
}

Mode::Attended Lockstep::attend(const std::vector<Session>& sessions, int64_t, Time now) {
  std::vector<int64_t> dropped = check_leases(sessions, now);
  return {next_check_, std::move(dropped)};
}

std::vector<int64_t> Lockstep::check_leases(const std::vector<Session>& sessions, Time now) {
  std::vector<int64_t> dropped;
  if (now < next_check_) return dropped;
  const auto lease =
      std::chrono::duration_cast<Time::duration>(std::chrono::duration<double>(options_.lease_s));
  next_check_ = now + std::clamp<Time::duration>(lease / 8, std::chrono::milliseconds(5),
                                                 std::chrono::seconds(1));
  for (size_t i = 0; i < members_.size();) {
    Member& member = members_[i];
    const Session* session = session_of(sessions, member.session);
    const bool silent = !session || now - session->last_heard > lease;
    if (member.silent && !silent) {
      member.silent = false;
      spdlog::info("lockstep: '{}' is heard again", member.name);
      note(request_t::JOIN, member);
    } else if (silent && !member.silent) {
      note(request_t::LEAVE, member);
      const std::string what = fmt::format("lockstep: nothing was heard from '{}' for {:g} s",
                                           member.name, options_.lease_s);
      if (options_.policy == LockstepOptions::Policy::fail)
        throw LeaseEnded(what + fmt::format(", at step {}", published_));
      const bool drop = options_.policy == LockstepOptions::Policy::drop || !started_;
      spdlog::warn("{}: {}", what, drop ? "it takes part no longer" : "the run waits for it");
      if (drop) {
        dropped.push_back(member.session);
        members_.erase(members_.begin() + static_cast<std::ptrdiff_t>(i));
        continue;
      }
      member.silent = true;
    }
    ++i;
  }
  forget();
  advance();
  return dropped;
}

void Lockstep::left(int64_t session) {
  const auto found = std::find_if(members_.begin(), members_.end(),
                                  [&](const Member& member) { return member.session == session; });
  if (found == members_.end()) return;
  if (started_) note(request_t::LEAVE, *found);
  members_.erase(found);
  forget();
  advance();
}

bool Lockstep::finished(const std::vector<Session>& sessions, Time now) const {
  return std::all_of(members_.begin(), members_.end(), [&](const Member& member) {
    const Session* session = session_of(sessions, member.session);
    return member.received >= published_ || !session || now - session->last_heard > kLastWords;
  });
}

void Lockstep::note(int32_t kind, const Member& member) {
  applied_t applied;
  applied.step = kind == request_t::JOIN ? member.granted : std::max<int64_t>(limit_, 0);
  applied.client = member.name;
  applied.sequence = 0;
  applied.channel = kRequestChannel;
  applied.kind = kind;
  applied.size = 0;
  record_(applied);
}

}  // namespace ruedo::run
