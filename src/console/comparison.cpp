// Bodies of both runs are matched by name, robots by the channels of their poses.
#include "console/comparison.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>

#include "base/json.h"
#include "base/utf8.h"
#include "log/diff.h"
#include "ruedo/decode.h"
#include "ruedo/math.h"
#include "ruedo/pose.h"
#include "ruedo/pose_t.hpp"
#include "ruedo/schema.h"
#include "ruedo/world_info_t.hpp"
#include "ruedo/world_state_t.hpp"

namespace ruedo::console {
namespace {

constexpr size_t kMostPlotted = 100'000;   // poses of a robot that are read for a plot
constexpr size_t kMostReported = 200'000;  // and of all robots together, for the report
constexpr uint32_t kMostMessage = 1u << 20;
constexpr double kAnyAngle_rad = 1e-9;  // acos of a rounded product has no smaller values

template <class Message>
std::optional<Message> decoded(std::span<const uint8_t> bytes) {
  std::optional<Message> message(std::in_place);
  if (decode_checked(bytes.data(), bytes.size(), *message) != DecodeFault::none) message.reset();
  return message;
}

template <class Message>
std::optional<Message> read(log::Reader& reader, const log::Place& entry) {
  if (entry.size > kMostMessage) return std::nullopt;
  log::Event event;
  reader.seek(entry.offset);
  if (!reader.next(event)) return std::nullopt;
  return decoded<Message>(event.data);
}

std::map<std::string, int32_t> bodies_of(const run::LogWorlds::Scene& scene) {
  std::map<std::string, int32_t> bodies;
  for (const std::vector<uint8_t>& part : scene.info) {
    const auto info = decoded<world_info_t>(part);
    if (!info) continue;
    for (const auto& body : info->bodies) {
      if (body.index >= 0) bodies.emplace(body.name, body.index);
    }
  }
  return bodies;
}

constexpr std::string_view kPose = "/pose";

// The robot of a pose channel ROBOT/pose; "" for any other channel.
std::string robot_of(const log::Index::Channel& channel) {
  if (channel.fingerprint != pose_t::getHash() || !channel.name.ends_with(kPose)) return "";
  return channel.name.substr(0, channel.name.size() - kPose.size());
}

Quat rotation_of(const pose_t& pose) {
  return Quat(pose.orientation[0], pose.orientation[1], pose.orientation[2], pose.orientation[3]);
}

double angle_between(const Quat& a, const Quat& b) {
  const Quat turn = a.conjugate() * b;
  const double angle = 2.0 * math::atan2(turn.vec().norm(), std::abs(turn.w()));
  return angle < kAnyAngle_rad ? 0.0 : angle;
}

// The first difference over all channels.
struct First {
  SimTime time_us = 0;
  std::string channel, field, shown, other;
};

std::optional<First> first_of(const log::Diff& diff) {
  std::optional<First> first;
  const auto offer = [&](First found) {
    if (!first || found.time_us < first->time_us) first = std::move(found);
  };
  for (const auto& [name, channel] : diff.channels) {
    for (const auto& [pattern, field] : channel.fields)
      offer({field.first_time, name, field.first_path, field.first_other, field.first_golden});
    if (channel.missing > 0) offer({channel.first_missing, name, "", "no message", "a message"});
    if (channel.extra > 0) offer({channel.first_extra, name, "", "a message", "no message"});
  }
  return first;
}

void write_names(JsonWriter& json, const char* member, const std::vector<std::string>& names) {
  json.name(member).open('[');
  for (const std::string& name : names) json.value(printable(name));
  json.close(']');
}

}  // namespace

Comparison::Comparison(const std::string& log, const log::Index& index,
                       const run::LogWorlds& worlds, const std::string& other,
                       const run::LoadRun& load)
    : log_(log),
      path_(other),
      name_(std::filesystem::path(other).filename().string()),
      index_(index),
      worlds_(worlds),
      other_(other),
      other_worlds_(other_, load) {
  for (size_t i = 0; i < other_.channels().size(); ++i) {
    if (other_.channels()[i].fingerprint == world_state_t::getHash()) states_ = i;
  }
  find_robots();
  thread_ = std::thread([this] {
    pthread_setname_np(pthread_self(), "comparison");
    write_report();
  });
}

Comparison::~Comparison() {
  ending_ = true;
  thread_.join();
}

std::string Comparison::fault() const {
  const std::string why = !other_.fault().empty() ? "The log is not whole: " + other_.fault() + "."
                                                  : other_worlds_.fault();
  return why.empty() ? "" : name_ + ": " + why;
}

void Comparison::find_robots() {
  std::map<std::string, size_t> there;
  for (size_t i = 0; i < other_.channels().size(); ++i) {
    if (const std::string robot = robot_of(other_.channels()[i]); !robot.empty()) there[robot] = i;
  }
  for (size_t i = 0; i < index_.channels().size(); ++i) {
    const std::string robot = robot_of(index_.channels()[i]);
    if (robot.empty()) continue;
    if (const auto found = there.find(robot); found != there.end()) {
      robots_.push_back({robot, i, found->second});
      there.erase(found);
    } else {
      extra_.push_back(robot);
    }
  }
  for (const auto& [robot, channel] : there) missing_.push_back(robot);
}

// ---- ghosts

// If one of the worlds is not known, bodies are matched by index.
const std::vector<int32_t>& Comparison::Ghosts::matched(const run::LogWorlds::Scene& shown,
                                                        const run::LogWorlds::Scene& other) {
  if (&shown == matched_shown_ && &other == matched_other_) return matched_;
  matched_shown_ = &shown;
  matched_other_ = &other;
  matched_.clear();
  const auto ours = bodies_of(shown), theirs = bodies_of(other);
  if (ours.empty() || theirs.empty()) return matched_;
  for (const auto& [name, index] : theirs) {
    const auto at = static_cast<size_t>(index);
    if (at >= matched_.size()) matched_.resize(at + 1, -1);
    if (const auto found = ours.find(name); found != ours.end()) matched_[at] = found->second;
  }
  return matched_;
}

void Comparison::Ghosts::show(Board& board, size_t channel, SimTime time_us) {
  if (!comparison_->states_) return;
  const log::Index::Channel& states = comparison_->other_.channels()[*comparison_->states_];
  const size_t count = std::max<size_t>(states.places.count_until(time_us), 1);
  const run::LogWorlds::Scene& shown = comparison_->worlds_.at(time_us);
  const run::LogWorlds::Scene& other = comparison_->other_worlds_.at(time_us);
  if (count == shown_ && &shown == matched_shown_ && &other == matched_other_) return;
  shown_ = count;
  const std::vector<int32_t>& places = matched(shown, other);
  std::vector<world_state_t> parts;
  for (size_t entry = count; entry > 0 && parts.size() < Board::kMostParts; --entry) {
    auto part = read<world_state_t>(reader_, states.places[entry - 1]);
    if (!part) break;
    parts.push_back(std::move(*part));
    if (parts.back().part == 0) break;
  }
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    size_t kept = 0;
    for (size_t i = 0; i < part->index.size(); ++i) {
      const auto body = static_cast<size_t>(part->index[i]);
      const int32_t place = places.empty()         ? part->index[i]
                            : body < places.size() ? places[body]
                                                   : -1;
      if (place < 0) continue;
      part->index[kept] = place;
      part->position[kept] = part->position[i];
      part->orientation[kept] = part->orientation[i];
      ++kept;
    }
    part->n = static_cast<int32_t>(kept);
    part->index.resize(kept);
    part->position.resize(kept);
    part->orientation.resize(kept);
    std::vector<uint8_t> bytes(static_cast<size_t>(part->getEncodedSize()));
    part->encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    board.put(channel, std::move(bytes));
  }
}

// ---- how far apart

// At the times of the log's poses; the other run's pose is interpolated linearly.
std::vector<Comparison::Sample> Comparison::samples(const Robot& robot, size_t most) const {
  log::Reader shown_reader(log_), other_reader(path_);
  const auto& ours = index_.channels()[robot.shown].places;
  const log::Places& theirs = other_.channels()[robot.other].places;
  const size_t every = 1 + ours.size() / std::max<size_t>(most, 1);
  std::vector<Sample> found;
  for (size_t i = 0; i < ours.size() && !ending_; i += every) {
    const SimTime time_us = ours[i].time_us;
    const size_t count = theirs.count_until(time_us);
    if (count == 0 || (count == theirs.size() && theirs.back().time_us < time_us)) continue;
    const auto here = read<pose_t>(shown_reader, ours[i]);
    const auto before = read<pose_t>(other_reader, theirs[count - 1]);
    if (!here || !before) continue;
    Vec3 place(before->pos[0], before->pos[1], before->pos[2]);
    Quat rotation = rotation_of(*before);
    const SimTime before_us = theirs[count - 1].time_us;
    const auto after =
        before_us < time_us ? read<pose_t>(other_reader, theirs[count]) : std::optional<pose_t>();
    if (after) {
      const double share = static_cast<double>(time_us - before_us) /
                           static_cast<double>(theirs[count].time_us - before_us);
      place += share * (Vec3(after->pos[0], after->pos[1], after->pos[2]) - place);
      rotation = rotation.slerp(share, rotation_of(*after));
    }
    const double time_s = static_cast<double>(time_us) * 1e-6;
    if (!found.empty() && time_s <= found.back().time_s) continue;
    found.push_back({time_s, (Vec3(here->pos[0], here->pos[1], here->pos[2]) - place).norm(),
                     angle_between(rotation_of(*here), rotation)});
  }
  return found;
}

http::Bytes Comparison::apart(const std::string& name, const std::string& field) {
  const auto robot = std::find_if(robots_.begin(), robots_.end(),
                                  [&](const Robot& each) { return printable(each.name) == name; });
  if (robot == robots_.end() || (field != "distance" && field != "angle")) return nullptr;
  const size_t entries = index_.channels()[robot->shown].places.size();
  const size_t every = 1 + entries / kMostPlotted;
  std::vector<double> numbers{static_cast<double>(every)};
  for (const Sample& sample : samples(*robot, kMostPlotted)) {
    numbers.push_back(sample.time_s);
    numbers.push_back(field == "angle" ? sample.angle_rad : sample.distance_m);
  }
  const auto* bytes = reinterpret_cast<const uint8_t*>(numbers.data());
  return std::make_shared<const std::vector<uint8_t>>(bytes,
                                                      bytes + numbers.size() * sizeof(double));
}

std::string Comparison::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

void Comparison::write_report() {
  JsonWriter json;
  json.open('{').name("comparison").open('{').member("other", printable(name_));
  std::string fault;
  try {
    const log::Diff diff = log::diff_logs(path_, log_, {}, true, [this] { return !ending_; });
    if (ending_) return;
    fault = fmt::format("{}", fmt::join(diff.faults, "; "));
    json.member("same", diff.same());
    if (const auto first = first_of(diff)) {
      json.name("first")
          .open('{')
          .member("t", static_cast<double>(first->time_us) * 1e-6)
          .member("channel", printable(first->channel))
          .member("field", printable(first->field))
          .member("shown", printable(first->shown))
          .member("other", printable(first->other))
          .close('}');
    }
    std::vector<std::string> differing;
    for (const auto& [name, channel] : diff.channels) {
      if (!channel.same()) differing.push_back(name);
    }
    write_names(json, "channels", differing);
  } catch (const std::exception& error) {
    fault = error.what();
  }
  json.name("robots").open('[');
  for (const Robot& robot : robots_) {
    Sample most{0, 0, 0};
    for (const Sample& sample : samples(robot, kMostReported / robots_.size())) {
      if (sample.distance_m > most.distance_m) most = sample;
    }
    if (ending_) return;
    json.open('{')
        .member("name", printable(robot.name))
        .member("distance", most.distance_m)
        .member("t", most.time_s)
        .close('}');
  }
  json.close(']');
  write_names(json, "missing", missing_);
  write_names(json, "extra", extra_);
  json.member("fault", printable(fault)).close('}').close('}');
  const std::lock_guard lock(mutex_);
  report_ = json.text();
}

}  // namespace ruedo::console
