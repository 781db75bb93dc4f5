// The comparison itself; the rules are in diff_rule.cpp, the reports in diff_report.cpp.
#include "log/diff.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "log/header.h"
#include "log/reader.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/state_hash_t.hpp"

namespace ruedo::log {
namespace {

constexpr size_t kMaxSamples = 1000;  // for a plot

bool fits(const std::string& pattern, const std::string& name) {
  return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

// The patterns of all that messages of a type can hold, in the order of the message.
void collect_patterns(const Schema& schema, const std::string& prefix,
                      std::vector<std::string>& patterns) {
  for (const Field& field : schema.fields) {
    if (field.type)
      collect_patterns(*field.type, prefix + field.name + ".", patterns);
    else
      patterns.push_back(prefix + field.name);
  }
}

std::vector<std::string> patterns_of(const std::set<std::string>& types) {
  std::vector<std::string> patterns;
  for (const std::string& type : types) {
    if (const Schema* schema = find_schema(type))
      collect_patterns(*schema, "", patterns);
    else
      patterns.emplace_back("(bytes)");
  }
  return patterns;
}

// A scalar of a message. It points into that.
struct Value {
  uint64_t pattern;  // represents FieldPath::pattern()
  uint64_t place;    // represents FieldPath::str()
  FieldValue value;
};

uint64_t mixed(uint64_t hash, uint64_t more) {  // the steps of splitmix64
  hash = (hash ^ more) + 0x9E3779B97F4A7C15;
  hash = (hash ^ (hash >> 30)) * 0xBF58476D1CE4E5B9;
  return hash ^ (hash >> 31);
}

// values: written over; its memory is used again.
void read_values(const Schema& schema, const std::vector<uint8_t>& message,
                 std::vector<Value>& values) {
  values.clear();
  visit_message(schema, message, [&](const FieldPath& path, const FieldValue& value) {
    uint64_t pattern = 0, indices = 0;
    for (const FieldPath::Part& part : path.parts) {
      pattern = mixed(pattern, reinterpret_cast<uintptr_t>(part.field));
      for (const int64_t index : part.indices)
        indices = mixed(indices, static_cast<uint64_t>(index));
    }
    values.push_back({pattern, mixed(pattern, indices), value});
    return true;
  });
}

// Of the first value there.
FieldPath path_of(const Schema& schema, const std::vector<uint8_t>& message, size_t index) {
  FieldPath found;
  visit_message(schema, message, [&](const FieldPath& path, const FieldValue&) {
    if (index-- > 0) return true;
    found = path;
    return false;
  });
  return found;
}

bool are_aligned(const std::vector<Value>& golden, const std::vector<Value>& other) {
  return std::ranges::equal(golden, other,
                            [](const Value& a, const Value& b) { return a.place == b.place; });
}

using Events = std::map<std::string, std::vector<Event>>;  // of one time, by channel

class Comparison {
 public:
  Comparison(Diff& diff, const std::vector<DiffRule>& rules) : diff_(diff), rules_(rules) {}

  // Compares two logs at one time. may_lack, may_add: ignores messages that only the golden log, or
  // only the other, has.
  void meet(const Events& golden, const Events& other, bool may_lack, bool may_add) {
    for (const auto& [channel, events] : golden) {
      note_types(channel, events);
      const auto found = other.find(channel);
      const size_t in_both =
          found == other.end() ? 0 : std::min(events.size(), found->second.size());
      for (size_t i = 0; i < events.size() && !ignored(channel); ++i) {
        if (i < in_both)
          both(events[i], found->second[i]);
        else if (!may_lack)
          only(events[i], true);
      }
    }
    for (const auto& [channel, events] : other) {
      note_types(channel, events);
      const auto found = golden.find(channel);
      for (size_t i = found == golden.end() ? 0 : found->second.size();
           i < events.size() && !may_add && !ignored(channel); ++i)
        only(events[i], false);
    }
  }

  // Throws InputError when nothing was left to compare.
  void end() {
    if (!met_.empty() && std::none_of(met_.begin(), met_.end(), [this](const auto& met) {
          return is_judged(met.first, met.second);
        }))
      throw InputError({},
                       "--ignore leaves nothing to compare: it fits every channel of both logs, or "
                       "all that they hold");
    if (diff_.channels.empty())
      diff_.faults.emplace_back("nothing was compared: there is no message to compare");
    for (const DiffRule& rule : rules_) {
      const std::string idle = idleness(rule);
      if (!idle.empty())
        diff_.idle_rules.push_back((rule.ignore ? "--ignore " : "--tolerance ") + rule.channel +
                                   idle);
    }
  }

 private:
  // Every channel of the logs, also one that is ignored.
  void note_types(const std::string& channel, const std::vector<Event>& events) {
    std::set<std::string>& types = met_[channel];
    for (const Event& event : events) {
      const Schema* schema = find_schema(fingerprint_of(event.data));
      types.insert(schema ? schema->name : "");
    }
  }

  void both(const Event& golden, const Event& other) {
    ChannelDifference& channel = diff_.channels[golden.channel];
    ++channel.compared;
    if (golden.data == other.data) return;
    const Schema* schema = find_schema(fingerprint_of(golden.data));
    if (schema != nullptr) channel.type = schema->name;
    if (schema == nullptr || !well_formed(*schema, golden.data) ||
        !well_formed(*schema, other.data)) {
      note(channel, golden.timestamp_us, "(bytes)", "(bytes)",
           std::to_string(golden.data.size()) + " bytes",
           std::to_string(other.data.size()) + " bytes");
      return;
    }
    fields({golden.channel, channel, *schema, golden, other, known_[golden.channel]});
  }

  void only(const Event& event, bool in_golden) {
    ChannelDifference& channel = diff_.channels[event.channel];
    int64_t& count = in_golden ? channel.missing : channel.extra;
    if (count++ == 0)
      (in_golden ? channel.first_missing : channel.first_extra) = event.timestamp_us;
  }

  bool ignored(const std::string& channel) const {
    const DiffRule* rule = rule_of(channel, "");
    return rule != nullptr && rule->ignore;
  }

  // Whether the rules leave anything of a channel's messages.
  bool is_judged(const std::string& channel, const std::set<std::string>& types) const {
    const std::vector<std::string> patterns = patterns_of(types);
    return !ignored(channel) &&
           (patterns.empty() ||  // of types without a field: their presence counts
            std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
              const DiffRule* rule = rule_of(channel, pattern);
              return rule == nullptr || !rule->ignore;
            }));
  }

  // Why a rule fits nothing in either log; "" when it does.
  std::string idleness(const DiffRule& rule) const {
    if (fits(rule.channel, std::string(kHeaderChannel))) return "";
    std::set<std::string> types;
    for (const auto& [channel, each] : met_) {
      if (fits(rule.channel, channel)) types.insert(each.begin(), each.end());
    }
    if (types.empty()) return ": neither log has such a channel";
    const std::vector<std::string> patterns = patterns_of(types);
    if (std::any_of(patterns.begin(), patterns.end(),
                    [&](const std::string& pattern) { return fits(rule.field, pattern); }))
      return "";
    return ":" + rule.field + ": there is no such field; there are " +
           fmt::format("{}", fmt::join(patterns, ", "));
  }

  // The last rule for that field; field "": for the channel as a whole.
  const DiffRule* rule_of(const std::string& channel, const std::string& field) const {
    for (auto rule = rules_.rbegin(); rule != rules_.rend(); ++rule) {
      if (fits(rule->channel, channel) &&
          (field.empty() ? rule->field == "*" : fits(rule->field, field)))
        return &*rule;
    }
    return nullptr;
  }

  // The state of a field of a channel, once a value of it has differed.
  struct Known {
    std::string pattern;
    const DiffRule* rule = nullptr;
    FieldDifference* difference = nullptr;  // null: within the tolerance until now
    uint64_t first_place = 0;
  };

  // Two messages of a channel that are not the same bytes.
  struct Pair {
    const std::string& name;
    ChannelDifference& channel;
    const Schema& schema;
    const Event &golden, &other;
    std::unordered_map<uint64_t, Known>& known;  // by pattern
  };

  // Arrays of other lengths shift what follows, so values are matched by their places.
  void fields(const Pair& pair) {
    read_values(pair.schema, pair.golden.data, golden_);
    read_values(pair.schema, pair.other.data, other_);
    if (are_aligned(golden_, other_)) {
      for (size_t i = 0; i < golden_.size(); ++i) compare(pair, &golden_[i], &other_[i]);
      return;
    }
    std::unordered_map<uint64_t, const Value*> by_place;
    for (const Value& value : other_) by_place.emplace(value.place, &value);
    for (const Value& value : golden_) {
      const auto match = by_place.find(value.place);
      compare(pair, &value, match == by_place.end() ? nullptr : match->second);
      if (match != by_place.end()) by_place.erase(match);
    }
    for (const Value& value : other_) {
      if (by_place.contains(value.place)) compare(pair, nullptr, &value);
    }
  }

  // Null: absent.
  void compare(const Pair& pair, const Value* golden, const Value* other) {
    const bool both = golden && other;
    if (both && passes(golden->value, other->value, nullptr)) return;
    const Value& place = golden ? *golden : *other;
    const auto path = [&] {
      const auto index = static_cast<size_t>(&place - (golden ? golden_ : other_).data());
      return path_of(pair.schema, (golden ? pair.golden : pair.other).data, index);
    };
    const auto [at, fresh] = pair.known.try_emplace(place.pattern);
    Known& known = at->second;
    if (fresh) {
      known.pattern = path().pattern();
      known.rule = rule_of(pair.name, known.pattern);
    }
    if (known.rule &&
        (known.rule->ignore || (both && passes(golden->value, other->value, known.rule))))
      return;
    if (!known.difference) {
      const auto text = [](const Value* value) {
        return value ? to_string(value->value) : "(absent)";
      };
      known.difference = &note(pair.channel, pair.golden.timestamp_us, known.pattern, path().str(),
                               text(golden), text(other));
      known.first_place = place.place;
    } else {
      ++known.difference->count;
    }
    if (both)
      measure(*known.difference, pair.golden.timestamp_us, *golden, *other,
              place.place == known.first_place);
  }

  static void measure(FieldDifference& field, SimTime time, const Value& golden, const Value& other,
                      bool is_first) {
    const auto then = number_of(golden.value), now = number_of(other.value);
    if (!then || !now) return;
    field.worst = std::max(field.worst, static_cast<double>(std::abs(*now - *then)));
    if (is_first && field.samples.size() < kMaxSamples)
      field.samples.push_back({time, static_cast<double>(*then), static_cast<double>(*now)});
  }

  static FieldDifference& note(ChannelDifference& channel, SimTime time, const std::string& pattern,
                               const std::string& path, const std::string& golden,
                               const std::string& other) {
    FieldDifference& field = channel.fields[pattern];
    if (field.count++ == 0) {
      field.first_time = time;
      field.first_path = path;
      field.first_golden = golden;
      field.first_other = other;
    }
    return field;
  }

  Diff& diff_;
  const std::vector<DiffRule>& rules_;
  std::map<std::string, std::set<std::string>> met_;  // with the types of its messages; "": unknown
  std::unordered_map<std::string, std::unordered_map<uint64_t, Known>>
      known_;                          // by channel, pattern
  std::vector<Value> golden_, other_;  // of the messages that are compared
};

// Hands out the events of one timestamp after the other, without the header.
class Stamps {
 public:
  explicit Stamps(const std::string& path) : reader_(path) { advance(); }

  bool more() const { return more_; }
  SimTime time() const { return event_.timestamp_us; }
  const std::vector<uint8_t>& header() const { return header_; }

  // Why the log breaks off, once there is no more; "" when it is whole. A run's log has the run's
  // end in it.
  std::string fault() const {
    if (more_ || !reader_.fault().empty()) return reader_.fault();
    return open_ ? "cut off: the end of the run is not in it" : "";
  }

  Events take() {
    Events events;
    for (const SimTime now = time(); more_ && time() == now; advance()) {
      if (event_.channel == kHeaderChannel)
        header_ = event_.data;
      else
        events[event_.channel].push_back(event_);
    }
    return events;
  }

 private:
  void advance() {
    state_hash_t hash;
    more_ = reader_.next(event_);
    if (more_ && event_.channel == kStateHashChannel &&
        decode_checked(event_.data.data(), event_.data.size(), hash) == DecodeFault::none)
      open_ = !hash.last;
  }

  Reader reader_;
  Event event_;
  bool more_ = false, open_ = false;
  std::vector<uint8_t> header_;
};

}  // namespace

bool Diff::same() const {
  return faults.empty() && std::all_of(channels.begin(), channels.end(),
                                       [](const auto& channel) { return channel.second.same(); });
}

Diff diff_logs(const std::string& golden_path, const std::string& other_path,
               const std::vector<DiffRule>& rules, bool partial,
               const std::function<bool()>& goes_on) {
  Diff diff;
  Comparison comparison(diff, rules);
  Stamps golden(golden_path), other(other_path);
  bool at_cut = false;

  while ((golden.more() || other.more()) && !at_cut && (!goes_on || goes_on())) {
    const bool take_golden = golden.more() && (!other.more() || golden.time() <= other.time());
    const bool take_other = other.more() && (!golden.more() || other.time() <= golden.time());
    const Events golden_events = take_golden ? golden.take() : Events{};
    const Events other_events = take_other ? other.take() : Events{};
    const bool golden_ends = partial && !golden.fault().empty();
    const bool other_ends = partial && !other.fault().empty();
    comparison.meet(golden_events, other_events, other_ends, golden_ends);
    at_cut = golden_ends || other_ends;
  }
  comparison.end();
  std::vector<std::string>& cuts = partial ? diff.notes : diff.faults;
  if (!golden.fault().empty()) cuts.push_back(golden_path + ": " + golden.fault());
  if (!other.fault().empty() && golden_path != other_path)
    cuts.push_back(other_path + ": " + other.fault());
  if (golden.header() != other.header()) {
    diff.notes.push_back(
        "the headers differ: another machine, version, world file or option (ruedo/header is not "
        "compared)");
  }
  return diff;
}

}  // namespace ruedo::log
