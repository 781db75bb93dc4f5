// By message type: compares successive messages of a channel.
#include "console/events.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include <fmt/format.h>

#include "base/big_endian.h"
#include "base/utf8.h"
#include "log/header.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/decode.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/markers_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/reply_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"
#include "ruedo/tick_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"
#include "ruedo/world_state_t.hpp"

namespace ruedo::console {
namespace {

constexpr double kSameTouch_s = 0.5;    // contacts of a body with shorter gaps are one collision
constexpr double kSameCommand_s = 1.0;  // likewise repeated commands
constexpr size_t kMostAsked = 256, kMostBodies = 256;

template <class Message>
std::optional<Message> decoded(std::span<const uint8_t> bytes) {
  std::optional<Message> message(std::in_place);
  if (decode_checked(bytes.data(), bytes.size(), *message) != DecodeFault::none) message.reset();
  return message;
}

// Contact points, from any type that has them.
bool tells_touches(const Schema& schema) {
  return std::any_of(schema.fields.begin(), schema.fields.end(), [](const Field& field) {
    return field.name == "points" && field.type && field.type->name == "contact_point_t";
  });
}

// ROBOT/DEVICE; only ROBOT for a renamed channel.
std::string robot_of(const std::string& channel) {
  return channel.substr(0, std::min(channel.find('/'), channel.size()));
}

std::string in_degrees(double rad) {
  return fmt::format("{:.1f}°", rad * (180.0 / 3.14159265358979323846));
}

std::string words_of(int kind, double value) {
  switch (kind) {
    case move_command_t::ADVANCE: return fmt::format("advance {:.3g} m", value);
    case move_command_t::ROTATE: return "rotate " + in_degrees(value);
    case move_command_t::HEADING: return "heading " + in_degrees(value);
    case move_command_t::ARC: return "arc of " + in_degrees(value);
    case move_command_t::STOP: return "stop";
    case motion_status_t::KIND_VELOCITY: return "velocity";
    case motion_status_t::KIND_WHEELS: return "wheels";
    default: return "motion";
  }
}

const char* why_refused(int reason) {
  switch (reason) {
    case motion_status_t::REASON_NOT_FINITE: return "not a finite number";
    case motion_status_t::REASON_BAD_KIND: return "unknown kind";
    case motion_status_t::REASON_BAD_VALUE: return "value out of range";
    case motion_status_t::REASON_NO_DRIVE: return "the robot cannot move";
    case motion_status_t::REASON_NOT_POSSIBLE: return "its drive cannot do that";
    default: return "refused";
  }
}

std::string words_of(const std::string& fault, const std::string& target, double duration_s) {
  std::string text = fault;
  if (!target.empty()) text += " of " + target;
  if (duration_s > 0) text += fmt::format(" for {:.3g} s", duration_s);
  return text;
}

// Names may come from messages that are refused: of any length.
std::string fit(const std::string& text) { return shortened(text, Events::kLongestText); }

// The name in a request's body; "" without one.
std::string name_in(int32_t kind, std::span<const uint8_t> body) {
  if (kind == request_t::SPAWN) {
    const auto spawn = decoded<spawn_request_t>(body);
    return !spawn ? "" : fit(spawn->name.empty() ? spawn->model : spawn->name);
  }
  if (kind == request_t::SET_POSE) {
    const auto pose = decoded<set_pose_request_t>(body);
    return pose ? fit(pose->name) : "";
  }
  if (kind == request_t::SET_TWIST) {
    const auto twist = decoded<set_twist_request_t>(body);
    return twist ? fit(twist->name) : "";
  }
  const auto name = decoded<name_request_t>(body);
  return name ? fit(name->name) : "";
}

// The effect of a request; "" if it changes nothing.
const char* verb_of(int32_t kind) {
  switch (kind) {
    case request_t::RESET: return "reset";
    case request_t::SPAWN: return "spawn";
    case request_t::REMOVE: return "remove";
    case request_t::SET_POSE: return "put";
    case request_t::SET_TWIST: return "push";
    case request_t::RESTORE: return "restore";
    case request_t::RESET_ODOMETRY: return "reset the odometry of";
    default: return "";
  }
}

}  // namespace

bool Events::tells(int64_t fingerprint) {
  static const std::set<int64_t> kTypes = [] {
    std::set<int64_t> types{
        motion_status_t::getHash(), applied_t::getHash(),          request_t::getHash(),
        reply_t::getHash(),         velocity_command_t::getHash(), wheel_command_t::getHash(),
        joint_command_t::getHash(), move_command_t::getHash(),     fault_t::getHash()};
    for (const Schema& schema : schemas()) {
      if (tells_touches(schema)) types.insert(schema.fingerprint);
    }
    return types;
  }();
  return kTypes.contains(fingerprint);
}

void Events::add(const std::string& kind, const std::string& robot, const std::string& text) {
  if (list_.size() < kMost)
    list_.push_back({now_s_, kind, printable(fit(robot)), printable(fit(text))});
}

void Events::reset() {
  list_.clear();
  touched_.clear();
  heard_.clear();
  blocked_by_.clear();
  motions_.clear();
  commanded_.clear();
  due_ = 0;
  ++generation_;
}

void Events::plan(const std::vector<world::Fault>& faults) {
  planned_ = faults;
  std::stable_sort(planned_.begin(), planned_.end(),
                   [](const auto& a, const auto& b) { return a.at_s < b.at_s; });
  due_ = 0;
}

void Events::come_due() {
  const double now_s = now_s_;
  for (; due_ < planned_.size() && planned_[due_].at_s <= now_s; ++due_) {
    const world::Fault& fault = planned_[due_];
    now_s_ = fault.at_s;
    add("fault", fault.robot, words_of(fault.kind, fault.target, fault.duration_s));
  }
  now_s_ = now_s;
}

void Events::lost(uint64_t count) {
  if (count > lost_) add("lost", "", fmt::format("{} messages could not be sent", count - lost_));
  lost_ = count;
}

void Events::hear(double time_s, const std::string& channel, std::span<const uint8_t> message) {
  const int64_t type = fingerprint_of(message);
  if (!live_) {
    now_s_ = time_s;
  } else if (type == world_state_t::getHash() || type == tick_t::getHash() ||
             type == motion_status_t::getHash()) {
    if (message.size() < 16) return;
    now_s_ = static_cast<double>(read_big_endian<int64_t>(&message[8])) * 1e-6;
  }
  come_due();
  if (!tells(type)) return;
  if (type == motion_status_t::getHash()) {
    if (const auto status = decoded<motion_status_t>(message)) motion(channel, *status);
  } else if (type == applied_t::getHash()) {
    const auto applied = decoded<applied_t>(message);
    if (applied && applied->kind == 0 && layer_of(applied->data).empty())
      command(applied->channel, applied->data);
    if (applied && applied->kind != 0) done(applied->kind, name_in(applied->kind, applied->data));
  } else if (type == request_t::getHash()) {
    const auto request = decoded<request_t>(message);
    if (!request || *verb_of(request->kind) == 0) return;
    if (asked_.size() >= kMostAsked) asked_.erase(asked_.begin());
    asked_[{request->session, request->sequence}] = {request->kind,
                                                     name_in(request->kind, request->body)};
  } else if (type == reply_t::getHash()) {
    replied(message);
  } else if (tells_touches(*find_schema(type))) {
    touches(channel, message);
  } else {
    command(channel, message);
  }
}

// Bodies that were not touched a moment before. The first message of a channel reports ongoing
// contacts.
void Events::touches(const std::string& channel, std::span<const uint8_t> message) {
  std::set<std::string> bodies;
  std::optional<std::string> blocked_by;
  const auto look = [&](const FieldPath& at, const FieldValue& value) {
    const auto* text = std::get_if<std::string_view>(&value);
    const std::string& field = at.parts.back().field->name;
    if (text && at.parts.size() == 2 && field == "body") bodies.emplace(*text);
    if (text && at.parts.size() == 1 && field == "blocked_by") blocked_by = *text;
    return true;
  };
  const bool whole = visit_message(*find_schema(fingerprint_of(message)), message, look);
  if (!whole) return;
  const std::string robot = robot_of(channel);
  const bool first = heard_.insert(channel).second;
  Touched& touched = touched_[robot];
  for (const std::string& body : bodies) {
    const auto at = touched.find(body);
    if (!first && (at == touched.end() || now_s_ - at->second > kSameTouch_s))
      add("collision", robot, body.empty() ? "touches something" : "touches " + body);
    if (at != touched.end() || touched.size() < kMostBodies) touched[body] = now_s_;
  }
  if (!blocked_by) return;
  std::string& before = blocked_by_[robot];
  if (!blocked_by->empty() && *blocked_by != before)
    add("blocked", robot, "blocked by " + *blocked_by);
  before = *blocked_by;
}

void Events::motion(const std::string& channel, const motion_status_t& now) {
  const auto [at, first] = motions_.try_emplace(channel, now);
  const motion_status_t before = std::exchange(at->second, now);
  if (first || (now.id == before.id && now.kind == before.kind && now.state == before.state &&
                now.reason == before.reason))
    return;
  const std::string robot = robot_of(channel), what = words_of(now.kind, now.done);
  const bool ended = now.state == motion_status_t::STATE_ENDED;
  if (now.state == motion_status_t::STATE_REFUSED) {
    add("refused", robot, words_of(now.kind, now.done) + ": " + why_refused(now.reason));
  } else if (now.reason == motion_status_t::REASON_BLOCKED) {
    // the sender's other messages report that already
    if (blocked_by_.contains(robot) && !ended) return;
    add("blocked", robot, what + (ended ? " ended: blocked" : " is blocked"));
  } else if (now.reason == motion_status_t::REASON_WATCHDOG && ended) {
    add("watchdog", robot, "no command came: stopped");
  } else if (now.state == motion_status_t::STATE_DONE && now.kind != move_command_t::STOP) {
    add("goal", robot, what + " done");
  }
}

// Repeated commands are one event.
void Events::command(const std::string& channel, std::span<const uint8_t> message) {
  const std::string robot = robot_of(channel);
  if (const auto move = decoded<move_command_t>(message))
    return add("command", robot, words_of(move->kind, move->value));
  if (const auto fault = decoded<fault_t>(message))
    return add("fault", robot, words_of(fault->kind, fault->target, fault->duration));
  const auto at = commanded_.find(channel);
  const bool goes_on = at != commanded_.end() && now_s_ - at->second < kSameCommand_s;
  commanded_[channel] = now_s_;
  if (goes_on) return;
  if (const auto velocity = decoded<velocity_command_t>(message)) {
    add("command", robot,
        fmt::format("drive at {:.2f} m/s, {:.2f} rad/s", velocity->vx, velocity->omega));
  } else {
    add("command", robot, "command on " + channel);
  }
}

void Events::done(int32_t kind, const std::string& name) {
  const std::string verb = verb_of(kind);
  if (verb.empty()) return;
  const bool resets = kind == request_t::RESET || kind == request_t::RESTORE;
  if (resets && live_) reset();
  const bool named = !resets && !name.empty();
  add(resets ? "reset" : "request", "", named ? verb + " " + name : verb);
}

// A request that succeeded. Repeating it gives the same answer again.
void Events::replied(std::span<const uint8_t> message) {
  const auto reply = decoded<reply_t>(message);
  if (!reply) return;
  const auto at = asked_.find({reply->session, reply->sequence});
  if (at == asked_.end()) return;
  const Asked asked = std::move(at->second);
  asked_.erase(at);
  if (live_) now_s_ = static_cast<double>(reply->utime) * 1e-6;
  if (reply->code == reply_t::OK && reply->kind == asked.kind) done(asked.kind, asked.name);
}

EventScan::EventScan(const log::Index& index, const world::WorldModel* world) {
  if (world) events_.plan(world->faults);
  const auto& channels = index.channels();
  // If the log records everything that acted, the request messages add nothing.
  const bool written = std::any_of(channels.begin(), channels.end(), [](const auto& channel) {
    return channel.name == log::kAppliedChannel;
  });
  for (const log::Index::Channel& channel : channels) {
    const bool needed = !written || channel.fingerprint == applied_t::getHash() ||
                        channel.fingerprint == motion_status_t::getHash();
    const Schema* schema = find_schema(channel.fingerprint);
    const bool draws = channel.fingerprint == markers_t::getHash() && !written;
    const bool tells = Events::tells(channel.fingerprint) && (needed || tells_touches(*schema));
    if (!draws && !tells) continue;
    log::Places::Cursor cursor(channel.places);
    if (const log::Place* first = cursor.next()) sources_.push_back({std::move(cursor), *first});
  }
  std::ranges::make_heap(sources_, later);
}

bool EventScan::advance(log::Reader& reader, size_t messages) {
  for (; messages > 0 && !sources_.empty(); --messages) {
    std::ranges::pop_heap(sources_, later);
    Source& source = sources_.back();
    const log::Place place = source.next;
    if (const log::Place* next = source.cursor.next()) {
      source.next = *next;
      std::ranges::push_heap(sources_, later);
    } else {
      sources_.pop_back();
    }
    reader.seek(place.offset);
    if (!reader.next(event_)) continue;
    events_.hear(static_cast<double>(place.time_us) * 1e-6, event_.channel, event_.data);
    std::string layer = layer_of(event_.data);
    if (const auto applied = decoded<applied_t>(event_.data)) layer = layer_of(applied->data);
    if (!layer.empty()) drawn_.add(layer, {place.time_us, place.offset});
  }
  return sources_.empty();
}

void write_events(JsonWriter& json, std::span<const Event> events) {
  json.open('[');
  for (const Event& event : events) {
    json.open('{')
        .member("t", event.time_s)
        .member("kind", event.kind)
        .member("robot", event.robot)
        .member("text", event.text)
        .close('}');
  }
  json.close(']');
}

}  // namespace ruedo::console
