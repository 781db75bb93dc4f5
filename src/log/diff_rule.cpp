// How the rules of a comparison are read, and what passes under one: docs/regressions.md has the
// arithmetic.
#include <charconv>
#include <cmath>

#include "log/diff.h"
#include "ruedo/errors.h"
#include "ruedo/pose.h"

namespace ruedo::log {
namespace {

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

// As they are printed: 0 is not -0, and a NaN is a NaN whatever its bits.
bool equal(const FieldValue& a, const FieldValue& b) {
  const auto *x = std::get_if<double>(&a), *y = std::get_if<double>(&b);
  if (!x || !y) return a == b;
  if (std::isnan(*x) || std::isnan(*y)) return std::isnan(*x) && std::isnan(*y);
  return *x == *y && std::signbit(*x) == std::signbit(*y);
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
                               "\" is not one of abs, rel, angle");
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

// A long double holds every int64_t, and the difference of any two.
std::optional<long double> number_of(const FieldValue& value) {
  if (const auto* integer = std::get_if<int64_t>(&value)) return *integer;
  if (const auto* number = std::get_if<double>(&value)) return *number;
  return std::nullopt;
}

bool passes(const FieldValue& golden, const FieldValue& other, const DiffRule* rule) {
  if (equal(golden, other)) return true;
  if (!rule) return false;
  if (rule->ignore) return true;
  const auto then = number_of(golden), now = number_of(other);
  // How far it is from there to infinity no tolerance says.
  if (!then || !now || !std::isfinite(*then) || !std::isfinite(*now)) return false;
  const long double difference = *now - *then;
  if (std::abs(wrap_angle(static_cast<double>(difference))) <= rule->angle) return true;
  return std::abs(difference) <=
         std::max<long double>(rule->absolute, rule->relative * std::abs(*then));
}

}  // namespace ruedo::log
