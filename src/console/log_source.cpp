// Playing and seeking are the same: the time changes, and channels whose newest message has changed
// are read.
#include "console/log_source.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "base/channel_names.h"
#include "base/utf8.h"
#include "base/whole.h"
#include "ruedo/markers_t.hpp"
#include "ruedo/schema.h"
#include "ruedo/world_info_t.hpp"
#include "ruedo/world_state_t.hpp"

namespace ruedo::console {
namespace {

constexpr double kLongestPause_s =
    // longest interval between two looks at the clock; after a longer one the log does not jump
    0.5;
constexpr double kSlowest = 0.01, kFastest = 1000.0;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::optional<double> number_of(const FieldValue& value) {
  if (const auto* real = std::get_if<double>(&value)) return *real;
  if (const auto* whole = std::get_if<int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* yes = std::get_if<bool>(&value)) return *yes ? 1.0 : 0.0;
  return std::nullopt;
}

// The plotted value of a message: the number at a path ("vel[0]"), or the least, the largest, the
// mean or the sum of an array's finite elements ("min(ranges)"). web/src/wire/fields.ts has the
// same.
class PlottedField {
 public:
  explicit PlottedField(std::string_view text) : path_(text) {
    const size_t open = text.find('(');
    if (open == text.npos || !text.ends_with(')')) return;
    over_ = text.substr(0, open);
    path_ = text.substr(open + 1, text.size() - open - 2);
  }

  void begin() { value_ = kNone, count_ = 0; }
  void visit(const FieldPath& at, const FieldValue& value) {
    if (!path_.starts_with(at.parts.front().field->name)) return;
    const auto number = number_of(value);
    if (!number || (over_.empty() ? at.str() : at.pattern()) != path_) return;
    if (over_.empty()) {
      value_ = *number;
      count_ = 1;
    } else if (std::isfinite(*number)) {
      value_ = count_++ == 0    ? *number
               : over_ == "min" ? std::min(value_, *number)
               : over_ == "max" ? std::max(value_, *number)
                                : value_ + *number;
    }
  }
  bool found() const { return count_ > 0; }
  double value() const { return over_ == "mean" ? value_ / static_cast<double>(count_) : value_; }

 private:
  std::string path_, over_;  // over_: "min", "max", "mean", "sum"; "" for a single number
  double value_ = kNone;
  size_t count_ = 0;
};

std::vector<PlottedField> plotted_fields(std::string_view list) {
  std::vector<PlottedField> fields;
  while (fields.size() < LogSource::kMostFields) {
    const size_t end = std::min(list.find(','), list.size());
    fields.emplace_back(list.substr(0, end));
    if (end == list.size()) break;
    list.remove_prefix(end + 1);
  }
  return fields;
}

// False if the message has none of them.
bool read_fields(std::span<const uint8_t> message, std::vector<PlottedField>& fields) {
  const Schema* schema = find_schema(fingerprint_of(message));
  for (PlottedField& field : fields) field.begin();
  if (!schema) return false;
  visit_message(*schema, message, [&](const FieldPath& at, const FieldValue& value) {
    for (PlottedField& field : fields) field.visit(at, value);
    return true;
  });
  return std::any_of(fields.begin(), fields.end(), [](const auto& field) { return field.found(); });
}

bool read(log::Reader& reader, const log::Place& wanted, log::Event& event) {
  if (wanted.size > LogSource::kMostMessage) return false;
  reader.seek(wanted.offset);
  return reader.next(event);  // false if the file has changed
}

}  // namespace

LogSource::LogSource(const std::string& path, const run::LoadRun& load, double speed,
                     const std::string& other, const run::LoadRun& load_other)
    : path_(path),
      speed_(std::clamp(speed, kSlowest, kFastest)),
      index_(path),
      worlds_(index_, load),
      scan_(index_, worlds_.at(index_.begin_us()).world.get()),
      reader_(path) {
  for (const log::Index::Channel& channel : index_.channels()) {
    if (channel.fingerprint == world_info_t::getHash()) info_channel_ = printable(channel.name);
  }
  makes_info_ = info_channel_.empty();
  if (makes_info_) info_channel_ = kInfoChannel;
  if (!other.empty())
    comparison_ = std::make_unique<Comparison>(path, index_, worlds_, other, load_other);
}

std::string LogSource::fault() const {
  const std::string log =
      index_.fault().empty() ? "" : "The log is not whole: " + index_.fault() + ".";
  const std::string other = comparison_ ? comparison_->fault() : "";
  std::string all;
  for (const std::string& each : {log, worlds_.fault(), other}) {
    if (!each.empty()) all += (all.empty() ? "" : " ") + each;
  }
  return all;
}

std::shared_ptr<const world::WorldModel> LogSource::world(size_t scene) {
  return scene < worlds_.scenes().size() ? worlds_.scenes()[scene].world : nullptr;
}

std::unique_ptr<Look> LogSource::look() { return std::make_unique<LogLook>(*this); }

void LogSource::pump(Board&, bool viewers) {
  if (viewers && !scanned_) scanned_ = scan_.advance(reader_, kScanned);
}

// The first and the last message are always among those read.
http::Bytes LogSource::history(const std::string& name, const std::string& list) {
  const std::string_view apart = Comparison::kApart;
  if (comparison_ && name.starts_with(apart))
    return comparison_->apart(name.substr(apart.size()), list);
  const auto& channels = index_.channels();
  const auto found = std::find_if(
      channels.begin(), channels.end(),
      [&](const log::Index::Channel& channel) { return printable(channel.name) == name; });
  if (found == channels.end()) return nullptr;
  const log::Places& places = found->places;
  const size_t every =
      1 + std::max(places.size() / kMostHistory, static_cast<size_t>(found->bytes) / kMostForPlot);
  std::vector<PlottedField> fields = plotted_fields(list);
  std::vector<double> numbers{static_cast<double>(every)};
  double last_s = -std::numeric_limits<double>::infinity();
  log::Event event;
  for (size_t i = 0; i < places.size();
       i = i + 1 < places.size() ? std::min(i + every, places.size() - 1) : places.size()) {
    const log::Place place = places[i];
    if (!read(reader_, place, event)) continue;
    const double time_s = static_cast<double>(place.time_us) * 1e-6;
    if (time_s <= last_s || !read_fields(event.data, fields)) continue;
    numbers.push_back(last_s = time_s);
    for (const PlottedField& field : fields)
      numbers.push_back(field.found() ? field.value() : kNone);
  }
  const auto* bytes = reinterpret_cast<const uint8_t*>(numbers.data());
  return std::make_shared<const std::vector<uint8_t>>(bytes,
                                                      bytes + numbers.size() * sizeof(double));
}

LogLook::LogLook(LogSource& source)
    : source_(source),
      reader_(source.path_),
      shown_(source.index_.channels().size(), kNothing),
      held_(shown_.size(), 0),
      last_(std::chrono::steady_clock::now()) {
  if (source_.comparison_) ghosts_.emplace(*source_.comparison_);
  playback_.begin_s = static_cast<double>(source.index_.begin_us()) * 1e-6;
  playback_.end_s = static_cast<double>(source.index_.end_us()) * 1e-6;
  playback_.now_s = playback_.begin_s;
  playback_.speed = source.speed_;
  playback_.playing = true;
  ++source_.looks_;
}

LogLook::~LogLook() {
  --source_.looks_;
  for (const size_t bytes : held_) source_.held_ -= bytes;
}

SimTime LogLook::now_us() const {
  if (playback_.now_s >= playback_.end_s) return source_.index_.end_us();
  return std::max(source_.index_.begin_us(), microseconds(playback_.now_s));
}

void LogLook::pump(Board& board) {
  if (board.channels().empty()) {
    const auto& channels = source_.index_.channels();
    for (size_t i = 0; i < channels.size(); ++i) board.name(i, channels[i].name);
    if (source_.makes_info_) board.name(channels.size(), source_.info_channel_);
    board.name(source_.drawn_channel(), kMarkersChannel);
    if (ghosts_) board.name(source_.compared_channel(), Comparison::kStates);
  }
  const auto now = std::chrono::steady_clock::now();
  const double passed_s =
      std::min(kLongestPause_s, std::chrono::duration<double>(now - last_).count());
  last_ = now;
  if (playback_.playing) {
    playback_.now_s = std::min(playback_.end_s, playback_.now_s + passed_s * playback_.speed);
    playback_.playing = playback_.now_s < playback_.end_s;
  }
  show(board);
}

void LogLook::show(Board& board) {
  const SimTime time_us = now_us();
  const auto& channels = source_.index_.channels();
  const size_t begin = next_;
  size_t bytes = 0;
  for (size_t n = 0; n < channels.size(); ++n) {
    const size_t i = (begin + n) % channels.size();
    if (channels[i].fingerprint == markers_t::getHash()) continue;  // see show_drawn
    if (board.channels()[i].watchers == 0) {
      shown_[i] = kNothing;  // read again on demand
      forget(board, i);
      continue;
    }
    size_t count = channels[i].places.count_until(time_us);
    if (count == 0 && channels[i].fingerprint == world_info_t::getHash()) count = 1;
    if (count == shown_[i]) continue;
    if (bytes > LogSource::kMostAtATime / source_.looks_) {  // the others are shown next time
      next_ = i;
      break;
    }
    shown_[i] = count;
    if (count > 0) bytes += load(board, i, count);
  }
  const run::LogWorlds::Scene& scene = source_.worlds_.at(time_us);
  if (source_.makes_info_ && told_ != &scene) {
    told_ = &scene;
    for (const auto& part : scene.info) board.put(channels.size(), part);
  }
  show_drawn(board);
  if (!ghosts_) return;
  const size_t compared = source_.compared_channel();
  if (board.channels()[compared].watchers == 0)
    ghosts_->forget();
  else
    ghosts_->show(board, compared, time_us);
}

void LogLook::show_drawn(Board& board) {
  const size_t channel = source_.drawn_channel();
  if (board.channels()[channel].watchers == 0) return shown_layers_.clear();
  const std::vector<Drawn::Layer>& layers = source_.scan_.drawn().layers();
  shown_layers_.resize(layers.size(), kNothing);
  for (size_t i = 0; i < layers.size(); ++i) {
    const size_t count = layers[i].count_until(now_us());
    if (count == shown_layers_[i]) continue;
    shown_layers_[i] = count;
    board.put(channel, Drawn::message(layers[i], count, reader_));
  }
}

// The newest of that many messages; for one in parts, including the previous parts.
size_t LogLook::load(Board& board, size_t channel, size_t count) {
  const log::Places& places = source_.index_.channels()[channel].places;
  std::vector<std::vector<uint8_t>> parts;
  size_t bytes = 0;
  for (size_t entry = count; entry > 0 && parts.size() < Board::kMostParts; --entry) {
    if (bytes > LogSource::kMostHeld) break;
    if (!read(reader_, places[entry - 1], event_)) break;
    parts.push_back(event_.data);
    bytes += event_.data.size();
    if (!board.is_later_part(parts.back())) break;
  }
  if (source_.held_ + bytes > LogSource::kMostHeld) forget(board, channel);
  if (source_.held_ + bytes > LogSource::kMostHeld) return bytes;
  for (auto part = parts.rbegin(); part != parts.rend(); ++part)
    board.put(channel, std::move(*part));
  source_.held_ -= held_[channel];
  held_[channel] = 0;
  for (const Board::Message& message : board.channels()[channel].newest)
    held_[channel] += message.bytes->size();
  source_.held_ += held_[channel];
  return bytes;
}

void LogLook::forget(Board& board, size_t channel) {
  board.channels()[channel].newest.clear();
  source_.held_ -= held_[channel];
  held_[channel] = 0;
}

Count LogLook::traffic(size_t channel) const {
  if (channel >= source_.index_.channels().size()) return {};
  const log::Index::Channel& of = source_.index_.channels()[channel];
  const size_t count = of.places.count_until(now_us());
  if (count == 0) return {};
  constexpr uint32_t kEventHead = 28;  // bytes before channel and data
  return {count, of.places[count - 1].size - kEventHead - static_cast<uint32_t>(of.name.size())};
}

void LogLook::play(bool on, double speed) {
  playback_.speed = std::clamp(speed, kSlowest, kFastest);
  if (on && playback_.now_s >= playback_.end_s) {
    playback_.now_s = playback_.begin_s;
    ++playback_.jumps;
  }
  playback_.playing = on;
}

// It is shown by the next pump(): a thousand of these at a time cost one look.
void LogLook::seek(double time_s) {
  playback_.now_s = std::clamp(time_s, playback_.begin_s, playback_.end_s);
  ++playback_.jumps;
}

// From state to state; if the log has none, from message to message.
void LogLook::step(int states) {
  const auto& channels = source_.index_.channels();
  const auto found = std::find_if(channels.begin(), channels.end(), [](const auto& channel) {
    return channel.fingerprint == world_state_t::getHash();
  });
  const log::Places& places = (found == channels.end() ? channels.front() : *found).places;
  playback_.playing = false;
  const size_t count = places.count_until(states > 0 ? now_us() : now_us() - 1);
  if (states > 0 && count == places.size()) return seek(playback_.end_s);
  if (states < 0 && count == 0) return seek(playback_.begin_s);
  const SimTime time_us = places[states > 0 ? count : count - 1].time_us;
  seek(static_cast<double>(time_us) * 1e-6);
}

}  // namespace ruedo::console
