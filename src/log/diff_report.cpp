// A Diff as text for a terminal, as JUnit XML for CI, and as one HTML page with plots of what
// differs.
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/xml.h"
#include "log/diff.h"

namespace ruedo::log {
namespace {

std::string seconds(SimTime time) {
  return fmt::format("{}.{:06d} s", time / 1'000'000, time % 1'000'000);
}

std::string describe(const std::string& name, const FieldDifference& field) {
  std::string text = fmt::format("{} of {} at {}: golden {}, new {}", field.first_path, name,
                                 seconds(field.first_time), field.first_golden, field.first_other);
  if (field.count > 1)
    text += fmt::format(" ({} values differ, by {:.3g} at most)", field.count, field.worst);
  return text;
}

std::vector<std::string> lines_of(const std::string& name, const ChannelDifference& channel) {
  std::vector<std::tuple<SimTime, std::string>> lines;
  if (channel.missing > 0) {
    lines.emplace_back(channel.first_missing,
                       fmt::format("{} messages of {} are missing, the first at {}",
                                   channel.missing, name, seconds(channel.first_missing)));
  }
  if (channel.extra > 0) {
    lines.emplace_back(channel.first_extra,
                       fmt::format("{} messages of {} are not in the golden log, the first at {}",
                                   channel.extra, name, seconds(channel.first_extra)));
  }
  for (const auto& [pattern, field] : channel.fields)
    lines.emplace_back(field.first_time, describe(name, field));
  std::sort(lines.begin(), lines.end());
  std::vector<std::string> texts;
  for (auto& [time, text] : lines) texts.push_back(std::move(text));
  return texts;
}

SimTime first_time(const ChannelDifference& channel) {
  SimTime first = std::numeric_limits<SimTime>::max();
  if (channel.missing > 0) first = std::min(first, channel.first_missing);
  if (channel.extra > 0) first = std::min(first, channel.first_extra);
  for (const auto& [pattern, field] : channel.fields) first = std::min(first, field.first_time);
  return first;
}

// The channels that differ, the earliest difference first.
std::vector<const std::pair<const std::string, ChannelDifference>*> differing(const Diff& diff) {
  std::vector<const std::pair<const std::string, ChannelDifference>*> channels;
  for (const auto& channel : diff.channels) {
    if (!channel.second.same()) channels.push_back(&channel);
  }
  std::stable_sort(channels.begin(), channels.end(), [](const auto* a, const auto* b) {
    return first_time(a->second) < first_time(b->second);
  });
  return channels;
}

// Golden and new values over time as an SVG of 640 x 160.
std::string plot(const FieldDifference& field) {
  constexpr double kWidth = 640, kHeight = 160, kMargin = 6;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const auto& sample : field.samples) {
    for (const double value : {sample.golden, sample.other}) {
      if (!std::isfinite(value)) continue;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  if (field.samples.size() < 2 || !(low <= high)) return "";
  if (low == high) high = low + 1;
  const double begin = static_cast<double>(field.samples.front().time);
  const double span = std::max(1.0, static_cast<double>(field.samples.back().time) - begin);
  const auto line = [&](auto member, const char* style) {
    std::string points;
    for (const auto& sample : field.samples) {
      const double value = sample.*member;
      if (!std::isfinite(value)) continue;
      points += fmt::format(
          "{:.1f},{:.1f} ",
          kMargin + (static_cast<double>(sample.time) - begin) / span * (kWidth - 2 * kMargin),
          kHeight - kMargin - (value - low) / (high - low) * (kHeight - 2 * kMargin));
    }
    return fmt::format("<polyline class=\"{}\" points=\"{}\"/>", style, points);
  };
  return fmt::format(
      "<svg viewBox=\"0 0 {} {}\" role=\"img\">{}{}</svg><p class=\"range\">{:.6g} to {:.6g}, {} "
      "to {}</p>\n",
      kWidth, kHeight, line(&FieldDifference::Sample::golden, "golden"),
      line(&FieldDifference::Sample::other, "new"), low, high, seconds(field.samples.front().time),
      seconds(field.samples.back().time));
}

}  // namespace

std::string diff_text(const Diff& diff) {
  std::string text;
  int64_t messages = 0;
  for (const auto& [name, channel] : diff.channels) messages += channel.compared;
  const auto channels = differing(diff);
  if (diff.same()) {
    text = fmt::format("same: {} messages on {} channels\n", messages, diff.channels.size());
  } else if (channels.empty()) {
    text = fmt::format("not the same: {}\n", fmt::join(diff.faults, "; "));
  } else {
    text = fmt::format("different: {} of {} channels; the earliest difference first\n",
                       channels.size(), diff.channels.size());
    for (const auto* channel : channels) {
      for (const std::string& line : lines_of(channel->first, channel->second))
        text += "  " + line + "\n";
    }
    for (const std::string& fault : diff.faults) text += "  " + fault + "\n";
  }
  for (const std::string& note : diff.notes) text += "note: " + note + "\n";
  return text;
}

std::string diff_junit(const Diff& diff) {
  std::string xml = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"ruedo diff\" tests=\"{}\" "
      "failures=\"{}\">\n",
      diff.channels.size() + diff.faults.size(), differing(diff).size() + diff.faults.size());
  for (const std::string& fault : diff.faults) {
    xml += fmt::format(
        "  <testcase classname=\"ruedo.diff\" name=\"logs\">\n    <failure message=\"{0}\">{0}"
        "</failure>\n  </testcase>\n",
        xml_escaped(fault));
  }
  for (const auto& [name, channel] : diff.channels) {
    xml += fmt::format("  <testcase classname=\"ruedo.diff\" name=\"{}\"", xml_escaped(name));
    if (channel.same()) {
      xml += "/>\n";
      continue;
    }
    const auto lines = lines_of(name, channel);
    xml += fmt::format(">\n    <failure message=\"{}\">", xml_escaped(lines.front()));
    for (const std::string& line : lines) xml += xml_escaped(line) + "\n";
    xml += "</failure>\n  </testcase>\n";
  }
  return xml + "</testsuite>\n";
}

std::string diff_html(const Diff& diff, const std::string& golden, const std::string& other) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>ruedo "
      "diff</title>\n<style>\n"
      "body{{font:15px/1.5 system-ui,sans-serif;max-width:720px;margin:2em auto;padding:0 "
      "1em;color-scheme:light dark}}\n"
      "svg{{width:100%;border:1px solid #8888}} polyline{{fill:none;stroke-width:1.5}} "
      ".golden{{stroke:#c08000;color:#c08000}}\n"
      ".new{{stroke:#2070d0;color:#2070d0}} .range{{font-size:13px;margin-top:0}} "
      "td{{padding-right:1.5em}}\n"
      "</style></head><body>\n<h1>{}</h1>\n<p><b class=\"golden\">golden</b> {}<br><b "
      "class=\"new\">new</b> {}</p>\n",
      diff.same() ? "The logs are the same" : "The logs differ", xml_escaped(golden),
      xml_escaped(other));
  for (const std::string& fault : diff.faults) page += "<p>" + xml_escaped(fault) + "</p>\n";
  for (const std::string& note : diff.notes) page += "<p>Note: " + xml_escaped(note) + "</p>\n";
  for (const auto* entry : differing(diff)) {
    const auto& [name, channel] = *entry;
    page += fmt::format("<h2>{}</h2>\n<ul>\n", xml_escaped(name));
    for (const std::string& line : lines_of(name, channel))
      page += "<li>" + xml_escaped(line) + "</li>\n";
    page += "</ul>\n";
    for (const auto& [pattern, field] : channel.fields) {
      if (const std::string svg = plot(field); !svg.empty())
        page += "<h3>" + xml_escaped(field.first_path) + "</h3>\n" + svg;
    }
  }
  page += "<h2>All channels</h2>\n<table>\n";
  for (const auto& [name, channel] : diff.channels) {
    page += fmt::format("<tr><td>{}</td><td>{} messages</td><td>{}</td></tr>\n", xml_escaped(name),
                        channel.compared, channel.same() ? "same" : "different");
  }
  return page + "</table>\n</body></html>\n";
}

}  // namespace ruedo::log
