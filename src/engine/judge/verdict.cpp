// The verdict as text, JSON and JUnit XML.
#include "engine/judge/verdict.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/json.h"
#include "base/xml.h"

namespace ruedo::judge {
namespace {

double seconds(SimTime time) { return static_cast<double>(time) * 1e-6; }

const char* name_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::passed: return "passed";
    case Outcome::failed: return "failed";
    default: return "not judged";
  }
}

// Of a verdict that has failed: something failed, or nothing did and something was not judged.
Outcome outcome_of(const Verdict& verdict) {
  if (verdict.passed()) return Outcome::passed;
  const bool failed =
      std::any_of(verdict.checks.begin(), verdict.checks.end(),
                  [](const Check& check) { return check.outcome == Outcome::failed; });
  return failed ? Outcome::failed : Outcome::not_judged;
}

}  // namespace

bool Verdict::passed() const {
  return !checks.empty() && std::all_of(checks.begin(), checks.end(), [](const Check& check) {
    return check.outcome == Outcome::passed;
  });
}

std::vector<Check> Verdict::failures() const {
  std::vector<Check> failures;
  for (const Check& check : checks) {
    if (check.outcome != Outcome::passed) failures.push_back(check);
  }
  const auto order = [](const Check& check) {
    return std::pair(check.time, check.outcome == Outcome::not_judged);
  };
  std::stable_sort(failures.begin(), failures.end(),
                   [&](const Check& a, const Check& b) { return order(a) < order(b); });
  return failures;
}

std::string Verdict::evidence() const {
  std::vector<std::string> texts;
  for (const Check& check : checks) {
    if (check.outcome == Outcome::passed) texts.push_back(check.text);
  }
  return fmt::format("{}", fmt::join(texts, "; "));
}

std::string to_line(const Check& check) {
  const std::string when = check.time ? fmt::format("{:.3f} s: ", seconds(*check.time)) : "";
  return (check.outcome == Outcome::not_judged ? "not judged: " : "") + when + check.text;
}

std::string to_json(const Verdict& verdict) {
  JsonWriter json;
  json.open('{').member("outcome", name_of(outcome_of(verdict))).name("evidence").open('[');
  for (const Check& check : verdict.checks) {
    if (check.outcome != Outcome::passed) continue;
    json.open('{').member("what", check.what).member("text", check.text).close('}');
  }
  json.close(']').name("failures").open('[');
  const std::vector<Check> failures = verdict.failures();
  for (const Check& check : failures) {
    json.open('{').member("what", check.what).member("judged", check.outcome == Outcome::failed);
    json.name("time_s").raw(check.time ? fmt::format("{}", seconds(*check.time)) : "null");
    json.member("text", check.text).close('}');
  }
  json.close(']').name("faults").open('[');
  for (const Check& check : failures) {
    if (!check.time) json.value(check.text);
  }
  json.close(']').name("metrics").open('{');
  for (const Metric& metric : verdict.metrics) json.member(metric.name, metric.value);
  json.close('}').name("track").open('[');
  for (const Place& place : verdict.track)
    json.open('[').value(place.time_s).value(place.x).value(place.y).close(']');
  return json.close(']').close('}').text() + "\n";
}

std::string to_junit(const Verdict& verdict, const std::string& name) {
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"{}\" tests=\"{}\" "
      "failures=\"{}\">\n",
      xml_escaped(name), verdict.checks.size(), verdict.failures().size());
  for (const Check& check : verdict.checks) {
    xml += fmt::format("  <testcase classname=\"ruedo.regress\" name=\"{}\">\n    ",
                       xml_escaped(check.what));
    const std::string line = to_line(check), text = xml_escaped(line);
    if (check.outcome == Outcome::passed)
      xml += fmt::format("<system-out>{}</system-out>\n", text);
    else
      xml +=
          fmt::format("<failure type=\"{}\" message=\"{}\">{}</failure>\n", name_of(check.outcome),
                      xml_escaped(line.substr(0, line.find('\n'))), text);
    xml += "  </testcase>\n";
  }
  return xml + "</testsuite>\n";
}

}  // namespace ruedo::judge
