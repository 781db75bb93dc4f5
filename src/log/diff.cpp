// The comparison itself; the reports are in diff_report.cpp.
#include "log/diff.h"

#include <fnmatch.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "log/header.h"
#include "log/reader.h"
#include "ruedo/errors.h"
#include "ruedo/pose.h"
#include "ruedo/schema.h"

namespace ruedo::log {
namespace {

constexpr size_t kMaxSamples = 1000;  // for a plot

double parse_tolerance(std::string_view text, std::string_view whole) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0.0) ||
      !std::isfinite(value)) {
    throw InputError({}, "tolerance \"" + std::string(whole) + "\": \"" + std::string(text) +
                             "\" is not a number of at least 0");
  }
  return value;
}

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

// A scalar of a message, taken out of it.
struct Value {
  std::string path, pattern, text;
  double number = 0.0;
  bool is_number = false;
};

std::vector<Value> values_of(const Schema& schema, const std::vector<uint8_t>& message) {
  std::vector<Value> values;
  visit_message(schema, message, [&](const FieldPath& path, const FieldValue& value) {
    Value v{path.str(), path.pattern(), to_string(value), 0.0, true};
    if (const auto* integer = std::get_if<int64_t>(&value))
      v.number = static_cast<double>(*integer);
    else if (const auto* number = std::get_if<double>(&value))
      v.number = *number;
    else
      v.is_number = false;
    values.push_back(std::move(v));
    return true;
  });
  return values;
}

class Comparison {
 public:
  Comparison(Diff& diff, const std::vector<DiffRule>& rules) : diff_(diff), rules_(rules) {}

  // Every channel of the logs, also one that is ignored, with its messages of one time.
  void meet(const std::string& channel, const std::vector<Event>& events) {
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
      differ(channel, golden.timestamp_us,
             {"(bytes)", "(bytes)", std::to_string(golden.data.size()) + " bytes", 0, false},
             {"", "", std::to_string(other.data.size()) + " bytes", 0, false});
      return;
    }
    fields(channel, golden, values_of(*schema, golden.data), values_of(*schema, other.data));
  }

  void only(const Event& event, bool in_golden) {
    if (const DiffRule* rule = rule_of(event.channel, ""); rule != nullptr && rule->ignore) return;
    ChannelDifference& channel = diff_.channels[event.channel];
    int64_t& count = in_golden ? channel.missing : channel.extra;
    if (count++ == 0)
      (in_golden ? channel.first_missing : channel.first_extra) = event.timestamp_us;
  }

  bool ignored(const std::string& channel) const {
    const DiffRule* rule = rule_of(channel, "");
    return rule != nullptr && rule->ignore;
  }

  // Throws InputError when nothing was left to compare.
  void end() {
    if (diff_.channels.empty() && !met_.empty())
      throw InputError({},
                       "--ignore leaves nothing to compare: it fits every channel of both logs");
    for (const DiffRule& rule : rules_) {
      const std::string idle = idleness(rule);
      if (!idle.empty())
        diff_.idle_rules.push_back((rule.ignore ? "--ignore " : "--tolerance ") + rule.channel +
                                   idle);
    }
  }

 private:
  // Why a rule fits nothing in either log; "" when it does.
  std::string idleness(const DiffRule& rule) const {
    if (fits(rule.channel, std::string(kHeaderChannel))) return "";
    std::set<std::string> types;
    for (const auto& [channel, each] : met_) {
      if (fits(rule.channel, channel)) types.insert(each.begin(), each.end());
    }
    if (types.empty()) return ": neither log has such a channel";
    std::vector<std::string> patterns;
    for (const std::string& type : types) {
      if (const Schema* schema = find_schema(type))
        collect_patterns(*schema, "", patterns);
      else
        patterns.emplace_back("(bytes)");
    }
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
    if (golden.text == other.text) return true;
    const DiffRule* rule = rule_of(channel, golden.pattern);
    if (rule == nullptr) return false;
    if (rule->ignore) return true;
    if (!golden.is_number || !other.is_number) return false;
    const double difference = other.number - golden.number;
    if (rule->angle >= 0.0 && std::isfinite(difference) &&
        std::abs(wrap_angle(difference)) <= rule->angle)
      return true;
    return std::abs(difference) <=
           std::max(rule->absolute, rule->relative * std::abs(golden.number));
  }

  // Arrays of other lengths shift what follows, so values are matched by their paths, which come in
  // one order.
  void fields(ChannelDifference& channel, const Event& event, const std::vector<Value>& golden,
              const std::vector<Value>& other) {
    std::map<std::string_view, const Value*> by_path;
    for (const Value& value : other) by_path.emplace(value.path, &value);
    for (const Value& value : golden) {
      const auto match = by_path.find(value.path);
      const Value absent{value.path, value.pattern, "(absent)", 0.0, false};
      const Value& counterpart = match == by_path.end() ? absent : *match->second;
      if (match != by_path.end()) by_path.erase(match);
      if (!good(event.channel, value, counterpart))
        differ(channel, event.timestamp_us, value, counterpart);
    }
    for (const Value& value : other) {
      if (!by_path.contains(value.path)) continue;
      const Value absent{value.path, value.pattern, "(absent)", 0.0, false};
      if (!good(event.channel, absent, value)) differ(channel, event.timestamp_us, absent, value);
    }
  }

  static void differ(ChannelDifference& channel, SimTime time, const Value& golden,
                     const Value& other) {
    FieldDifference& field = channel.fields[golden.pattern];
    if (field.count++ == 0) {
      field.first_time = time;
      field.first_path = golden.path;
      field.first_golden = golden.text;
      field.first_other = other.text;
    }
    if (!golden.is_number || !other.is_number) return;
    field.worst = std::max(field.worst, std::abs(other.number - golden.number));
    if (golden.path == field.first_path && field.samples.size() < kMaxSamples) {
      field.samples.push_back({time, golden.number, other.number});
    }
  }

  Diff& diff_;
  const std::vector<DiffRule>& rules_;
  std::map<std::string, std::set<std::string>> met_;  // with the types of its messages; "": unknown
};

// Hands out the events of one timestamp after the other.
class Stamps {
 public:
  explicit Stamps(const std::string& path) : reader_(path) { more_ = reader_.next(event_); }

  bool more() const { return more_; }
  SimTime time() const { return event_.timestamp_us; }
  const std::string& fault() const { return reader_.fault(); }

  // The events of time(), by channel, each channel's in their order.
  std::map<std::string, std::vector<Event>> take() {
    std::map<std::string, std::vector<Event>> events;
    for (const SimTime now = time(); more_ && time() == now; more_ = reader_.next(event_))
      events[event_.channel].push_back(event_);
    return events;
  }

 private:
  Reader reader_;
  Event event_;
  bool more_;
};

// Of the fields that "CHANNEL" or "CHANNEL:FIELD" names.
DiffRule rule_for(std::string_view place) {
  DiffRule rule;
  const size_t colon = place.find(':');
  rule.channel = place.substr(0, colon);
  if (colon != std::string_view::npos) rule.field = place.substr(colon + 1);
  if (rule.channel.empty() || rule.field.empty())
    throw InputError({}, "\"" + std::string(place) + "\" does not name CHANNEL or CHANNEL:FIELD");
  return rule;
}

}  // namespace

DiffRule DiffRule::ignoring(std::string_view text) {
  DiffRule rule = rule_for(text);
  rule.ignore = true;
  return rule;
}

DiffRule DiffRule::tolerance(std::string_view text) {
  const size_t equals = text.find('=');
  DiffRule rule = rule_for(text.substr(0, equals));
  if (equals == std::string_view::npos) {
    throw InputError({}, "tolerance \"" + std::string(text) +
                             "\" is not of the form CHANNEL:FIELD=abs:1e-3,rel:0.01,angle:0.02");
  }
  std::string_view rest = text.substr(equals + 1);
  while (!rest.empty()) {
    const std::string_view part = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), part.size() + 1));
    const size_t separator = part.find(':');
    const std::string_view kind =
        separator == std::string_view::npos ? "abs" : part.substr(0, separator);
    const double value = parse_tolerance(
        separator == std::string_view::npos ? part : part.substr(separator + 1), text);
    if (kind == "abs")
      rule.absolute = value;
    else if (kind == "rel")
      rule.relative = value;
    else if (kind == "angle")
      rule.angle = value;
    else
      throw InputError({}, "tolerance \"" + std::string(text) + "\": \"" + std::string(kind) +
                               "\" is none of abs, rel, angle");
  }
  return rule;
}

std::vector<DiffRule> DiffRule::all(const std::vector<std::string>& tolerances,
                                    const std::vector<std::string>& ignored) {
  std::vector<DiffRule> rules;
  for (const std::string& text : tolerances) rules.push_back(tolerance(text));
  for (const std::string& text : ignored) rules.push_back(ignoring(text));
  return rules;
}

bool Diff::same() const {
  return std::all_of(channels.begin(), channels.end(),
                     [](const auto& channel) { return channel.second.same(); });
}

Diff diff_logs(const std::string& golden_path, const std::string& other_path,
               const std::vector<DiffRule>& rules, const std::function<bool()>& goes_on) {
  Diff diff;
  Comparison comparison(diff, rules);
  Stamps golden(golden_path), other(other_path);
  std::vector<uint8_t> golden_header, other_header;

  while ((golden.more() || other.more()) && (!goes_on || goes_on())) {
    const bool take_golden = golden.more() && (!other.more() || golden.time() <= other.time());
    const bool take_other = other.more() && (!golden.more() || other.time() <= golden.time());
    auto golden_events = take_golden ? golden.take() : decltype(golden.take()){};
    auto other_events = take_other ? other.take() : decltype(other.take()){};
    if (const auto at = golden_events.find(std::string(kHeaderChannel));
        at != golden_events.end()) {
      golden_header = at->second.front().data;
      golden_events.erase(at);
    }
    if (const auto at = other_events.find(std::string(kHeaderChannel)); at != other_events.end()) {
      other_header = at->second.front().data;
      other_events.erase(at);
    }
    for (const auto& [channel, events] : golden_events) {
      comparison.meet(channel, events);
      if (comparison.ignored(channel)) continue;
      const std::vector<Event>& counterparts = other_events[channel];
      for (size_t i = 0; i < events.size(); ++i) {
        if (i < counterparts.size())
          comparison.both(events[i], counterparts[i]);
        else
          comparison.only(events[i], true);
      }
    }
    for (const auto& [channel, events] : other_events) {
      comparison.meet(channel, events);
      const auto counterparts = golden_events.find(channel);
      for (size_t i = counterparts == golden_events.end() ? 0 : counterparts->second.size();
           i < events.size(); ++i) {
        comparison.only(events[i], false);
      }
    }
  }
  comparison.end();
  if (diff.channels.empty() && golden_header.empty() && other_header.empty())
    diff.notes.push_back("both logs are without any message: nothing was compared");
  if (!golden.fault().empty()) diff.notes.push_back(golden_path + ": " + golden.fault());
  if (!other.fault().empty()) diff.notes.push_back(other_path + ": " + other.fault());
  if (golden_header != other_header) {
    diff.notes.push_back(
        "the headers differ: another machine, version, world file or option (ruedo/header is not "
        "compared)");
  }
  return diff;
}

}  // namespace ruedo::log
