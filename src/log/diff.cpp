// The comparison itself; the rules are in diff_rule.cpp, the reports in diff_report.cpp.
#include "log/diff.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <set>

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
  std::string path, pattern;
  std::optional<FieldValue> value;  // none: absent

  std::string text() const { return value ? to_string(*value) : "(absent)"; }
};

std::vector<Value> values_of(const Schema& schema, const std::vector<uint8_t>& message) {
  std::vector<Value> values;
  visit_message(schema, message, [&](const FieldPath& path, const FieldValue& value) {
    values.push_back({path.str(), path.pattern(), value});
    return true;
  });
  return values;
}

using Events = std::map<std::string, std::vector<Event>>;  // of one time, by channel

class Comparison {
 public:
  Comparison(Diff& diff, const std::vector<DiffRule>& rules) : diff_(diff), rules_(rules) {}

  // What two logs have at one time. may_lack, may_add: what only the golden log, or only the other
  // has is passed over.
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
      note(channel, golden.timestamp_us, {"(bytes)", "(bytes)", {}},
           std::to_string(golden.data.size()) + " bytes",
           std::to_string(other.data.size()) + " bytes");
      return;
    }
    fields(channel, golden, values_of(*schema, golden.data), values_of(*schema, other.data));
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
           (patterns.empty() ||  // of types without a field: there are messages, or there are none
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

  bool good(const std::string& channel, const Value& golden, const Value& other) const {
    const bool both = golden.value && other.value;
    if (both && passes(*golden.value, *other.value, nullptr)) return true;
    const DiffRule* rule = rule_of(channel, golden.pattern);
    return rule && (rule->ignore || (both && passes(*golden.value, *other.value, rule)));
  }

  // Arrays of other lengths shift what follows, so values are matched by their paths, which come in
  // one order.
  void fields(ChannelDifference& channel, const Event& event, const std::vector<Value>& golden,
              const std::vector<Value>& other) {
    std::map<std::string_view, const Value*> by_path;
    for (const Value& value : other) by_path.emplace(value.path, &value);
    for (const Value& value : golden) {
      const auto match = by_path.find(value.path);
      const Value absent{value.path, value.pattern, {}};
      const Value& counterpart = match == by_path.end() ? absent : *match->second;
      if (match != by_path.end()) by_path.erase(match);
      if (!good(event.channel, value, counterpart))
        differ(channel, event.timestamp_us, value, counterpart);
    }
    for (const Value& value : other) {
      if (!by_path.contains(value.path)) continue;
      const Value absent{value.path, value.pattern, {}};
      if (!good(event.channel, absent, value)) differ(channel, event.timestamp_us, absent, value);
    }
  }

  static FieldDifference& note(ChannelDifference& channel, SimTime time, const Value& place,
                               const std::string& golden, const std::string& other) {
    FieldDifference& field = channel.fields[place.pattern];
    if (field.count++ == 0) {
      field.first_time = time;
      field.first_path = place.path;
      field.first_golden = golden;
      field.first_other = other;
    }
    return field;
  }

  static void differ(ChannelDifference& channel, SimTime time, const Value& golden,
                     const Value& other) {
    FieldDifference& field = note(channel, time, golden, golden.text(), other.text());
    const auto then = golden.value ? number_of(*golden.value) : std::nullopt;
    const auto now = other.value ? number_of(*other.value) : std::nullopt;
    if (!then || !now) return;
    field.worst = std::max(field.worst, static_cast<double>(std::abs(*now - *then)));
    if (golden.path == field.first_path && field.samples.size() < kMaxSamples)
      field.samples.push_back({time, static_cast<double>(*then), static_cast<double>(*now)});
  }

  Diff& diff_;
  const std::vector<DiffRule>& rules_;
  std::map<std::string, std::set<std::string>> met_;  // with the types of its messages; "": unknown
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
