// Frames are made when the socket is ready, from what is newest at that time.
#include "console/viewer.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/json.h"
#include "base/warnings.h"

namespace ruedo::console {
namespace {

constexpr auto kTrafficPeriod = std::chrono::milliseconds(500);
constexpr auto kPlaybackPeriod = std::chrono::milliseconds(100);
constexpr size_t kMostNames = 2000;  // of channels in one message

template <class Value>
void append(std::vector<uint8_t>& bytes, Value value) {  // little endian, as browsers are
  const auto* from = reinterpret_cast<const uint8_t*>(&value);
  bytes.insert(bytes.end(), from, from + sizeof value);
}

double read_double(std::span<const uint8_t> bytes) {
  double value = 0;
  std::memcpy(&value, bytes.data(), sizeof value);
  return value;
}

}  // namespace

Viewer::Viewer(Stage& stage)
    : stage_(stage),
      look_(stage.source->look()),
      told_world_(look_ ? 0 : stage.world_version) {  // the page starts with a log's first scene
  stage_.viewers.push_back(this);
  stage_.source->attend(stage_.board);
  pump();
}

Viewer::~Viewer() {
  std::erase(stage_.viewers, this);
  want("");
}

void Viewer::pump() {
  if (look_) look_->pump(own_board_);
}

bool Viewer::on_message(std::span<const uint8_t> message) {
  if (message.empty()) return false;
  const std::span<const uint8_t> rest = message.subspan(1);
  switch (static_cast<Operation>(message[0])) {
    case Operation::seen: unseen_ = std::max(0, unseen_ - 1); return true;
    case Operation::want:
      want({reinterpret_cast<const char*>(rest.data()), rest.size()});
      return true;
    case Operation::command: {
      if (rest.empty() || rest.size() < size_t{1} + rest[0]) return false;
      const std::string channel(reinterpret_cast<const char*>(rest.data()) + 1, rest[0]);
      if (stage_.source->command(channel, rest.subspan(size_t{1} + rest[0]))) return true;
      JsonWriter json;
      json.open('{').member("refused", channel).close('}');
      note_ = json.text();
      return true;
    }
    case Operation::traffic:
      traffic_ = !rest.empty() && rest[0] != 0;
      next_traffic_ = {};
      return true;
    case Operation::play:
      if (rest.size() != 9) return false;
      if (const double speed = read_double(rest.subspan(1)); std::isfinite(speed) && speed > 0.0)
        if (look_) look_->play(rest[0] != 0, speed);
      return true;
    case Operation::seek:
      if (rest.size() != 8) return false;
      if (const double time_s = read_double(rest); look_ && std::isfinite(time_s))
        look_->seek(time_s);
      return true;
    case Operation::step:
      if (rest.size() != 1) return false;
      if (look_) look_->step(rest[0] != 0 ? 1 : -1);
      return true;
  }
  return false;
}

void Viewer::want(std::string_view names) {
  for (size_t i = 0; i < sights_.size(); ++i) {
    if (sights_[i].wanted) --board().channels()[i].watchers;
  }
  wanted_names_.clear();
  while (!names.empty() && wanted_names_.size() < kMostWanted) {
    const size_t end = std::min(names.find('\n'), names.size());
    wanted_names_.emplace_back(names.substr(0, end));
    names.remove_prefix(std::min(end + 1, names.size()));
  }
  std::sort(wanted_names_.begin(), wanted_names_.end());
  const std::vector<Sight> before = std::move(sights_);
  sights_.clear();
  if (wanted_names_.empty()) return;
  match_names();
  for (size_t i = 0; i < std::min(before.size(), sights_.size()); ++i)
    sights_[i].sent = before[i].wanted ? before[i].sent : 0;
}

void Viewer::match_names() {
  auto& channels = board().channels();
  bool more = false;
  for (size_t i = sights_.size(); i < channels.size(); ++i) {
    Sight& sight = sights_.emplace_back();
    sight.wanted = std::binary_search(wanted_names_.begin(), wanted_names_.end(), channels[i].name);
    if (!sight.wanted) continue;
    ++channels[i].watchers;
    more = true;
  }
  if (more) stage_.source->attend(stage_.board);
}

bool Viewer::next(std::vector<uint8_t>& message, bool& text) {
  std::string words;
  text = next_text(words);
  if (text) {
    message.insert(message.end(), words.begin(), words.end());
    return true;
  }
  if (parted_) return false;
  if (const auto now = std::chrono::steady_clock::now(); traffic_ && now >= next_traffic_) {
    next_traffic_ = now + kTrafficPeriod;
    add_traffic(message);
    return true;
  }
  return unseen_ < kMostUnseen && next_messages(message);
}

bool Viewer::next_text(std::string& text) {
  if (!greeted_) {
    greeted_ = true;
    text = stage_.greeting;
    return true;
  }
  if (!note_.empty()) {
    text = std::move(note_);
    note_.clear();
    return true;
  }
  if (!stage_.farewell.empty()) {
    text = stage_.farewell;
    return !std::exchange(parted_, true);
  }
  if (const uint64_t world = look_ ? look_->scene() : stage_.world_version; world != told_world_) {
    told_world_ = world;
    text = "{\"scene\": " + std::to_string(told_world_) + "}";
    return true;
  }
  if (look_ && next_playback(text)) return true;
  if (!compared_) {
    text = stage_.source->comparison();
    compared_ = !text.empty();
    if (compared_) return true;
  }
  const auto& channels = board().channels();
  if (told_channels_ < channels.size()) {
    JsonWriter json;
    json.open('{').member("first", static_cast<int64_t>(told_channels_)).name("channels").open('[');
    const size_t end = std::min(channels.size(), told_channels_ + kMostNames);
    for (; told_channels_ < end; ++told_channels_) json.value(channels[told_channels_].name);
    json.close(']').close('}');
    text = json.text();
    return true;
  }
  return next_events(text) || next_warnings(text);
}

// A running time is sent now and then, everything else at once.
bool Viewer::next_playback(std::string& text) {
  const Playback& playback = look_->playback();
  const auto now = std::chrono::steady_clock::now();
  if (told_playback_) {
    Playback but_for_time = playback;
    but_for_time.now_s = told_playback_->now_s;
    if (playback == *told_playback_ ||
        (but_for_time == *told_playback_ && now - told_playback_at_ < kPlaybackPeriod))
      return false;
  }
  told_playback_ = playback;
  told_playback_at_ = now;
  JsonWriter json;
  json.open('{')
      .name("playback")
      .open('{')
      .member("begin", playback.begin_s)
      .member("end", playback.end_s)
      .member("now", playback.now_s);
  json.member("speed", playback.speed)
      .member("playing", playback.playing)
      .member("jumps", playback.jumps)
      .close('}')
      .close('}');
  text = json.text();
  return true;
}

// {"first": 0, "warnings": [{"kind": ..., "text": ...}, ...]}: starting at that index.
bool Viewer::next_warnings(std::string& text) {
  const std::vector<Warning> fresh = warnings_from(told_warnings_);
  if (fresh.empty()) return false;
  JsonWriter json;
  json.open('{').member("first", static_cast<int64_t>(told_warnings_)).name("warnings").open('[');
  for (const auto& [kind, words] : fresh)
    json.open('{').member("kind", kind).member("text", printable(words)).close('}');
  text = json.close(']').close('}').text();
  told_warnings_ += fresh.size();
  return true;
}

// {"events": [...], "first": 0}: starting at that index. From 0: those sent before are invalid.
bool Viewer::next_events(std::string& text) {
  const Events* events = stage_.source->events();
  if (!events) return false;
  const bool reset = told_generation_ != events->generation();
  if (!reset && told_events_ == events->list().size()) return false;
  if (reset) told_events_ = 0;
  told_generation_ = events->generation();
  const size_t count = std::min(kMostEvents, events->list().size() - told_events_);
  JsonWriter json;
  json.open('{').member("first", static_cast<int64_t>(told_events_)).name("events");
  write_events(json, std::span(events->list()).subspan(told_events_, count));
  text = json.close('}').text();
  told_events_ += count;
  return true;
}

// A frame: its kind (4 bytes), then for each message channel (4 bytes), size (4 bytes), bytes. In
// order of arrival over all channels: a reply is newer than all messages before it.
bool Viewer::next_messages(std::vector<uint8_t>& frame) {
  if (wanted_names_.empty()) return false;
  match_names();
  const size_t begin = frame.size();
  const auto& channels = board().channels();
  std::vector<std::pair<const Board::Message*, size_t>> fresh;  // with its channel
  for (size_t i = 0; i < sights_.size(); ++i) {
    if (!sights_[i].wanted || sights_[i].sent == channels[i].last_number) continue;
    for (const Board::Message& message : channels[i].newest) {
      if (message.number > sights_[i].sent) fresh.emplace_back(&message, i);
    }
  }
  std::sort(fresh.begin(), fresh.end(),
            [](const auto& a, const auto& b) { return a.first->number < b.first->number; });
  for (const auto& [message, i] : fresh) {
    if (frame.size() - begin >= kMostFrame) break;
    if (frame.size() == begin) append(frame, uint32_t{static_cast<uint8_t>(Frame::messages)});
    append(frame, static_cast<uint32_t>(i));
    append(frame, static_cast<uint32_t>(message->bytes->size()));
    frame.insert(frame.end(), message->bytes->begin(), message->bytes->end());
    sights_[i].sent = message->number;
  }
  if (frame.size() == begin) return false;
  ++unseen_;
  return true;
}

// Its kind (4 bytes), then for each channel the number of messages (4 bytes, wraps) and the size of
// the newest one (4 bytes).
void Viewer::add_traffic(std::vector<uint8_t>& frame) {
  append(frame, uint32_t{static_cast<uint8_t>(Frame::traffic)});
  for (size_t i = 0; i < board().channels().size(); ++i) {
    const Count count = look_ ? look_->traffic(i) : stage_.source->traffic(i);
    append(frame, static_cast<uint32_t>(count.messages));
    append(frame, count.size);
  }
}

}  // namespace ruedo::console
