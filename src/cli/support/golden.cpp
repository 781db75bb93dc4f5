// The comparison is log/diff.h's; here are the files.
#include "cli/support/golden.h"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>
#include <spdlog/spdlog.h>

#include "base/input_file.h"
#include "log/reader.h"
#include "log/writer.h"
#include "ruedo/errors.h"
#include "system/output_file.h"

namespace ruedo::cli {
namespace {

namespace fs = std::filesystem;

bool fits_any(const std::string& channel, const std::vector<std::string>& patterns) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return fnmatch(pattern.c_str(), channel.c_str(), 0) == 0;
  });
}

void note_channels(const std::string& path, std::set<std::string>& channels) {
  log::Reader log(path);
  log::Event event;
  while (log.next(event, [](const std::string&) { return false; })) channels.insert(event.channel);
}

// A run that lacks what the golden log holds differs; --keep is wrong where neither has it.
void check_kept(const Golden& golden, const std::string& record, bool renew) {
  std::set<std::string> channels;
  note_channels(record, channels);
  if (!renew) note_channels(golden.log, channels);
  for (const std::string& pattern : golden.keep) {
    if (std::none_of(channels.begin(), channels.end(),
                     [&](const std::string& channel) { return fits_any(channel, {pattern}); }))
      throw InputError(
          {}, fmt::format("--keep {}: no message of the run is on such a channel; there are {}",
                          pattern, fmt::join(channels, ", ")));
  }
}

// A log's events on the channels that are kept.
void keep_channels(const std::string& from, const std::string& to,
                   const std::vector<std::string>& patterns) {
  log::Reader log(from);
  log::Writer writer(to);
  log::Event event;
  while (log.next(event)) {
    if (fits_any(event.channel, patterns))
      writer.write(event.timestamp_us, event.channel, event.data.data(), event.data.size());
  }
  writer.flush();
  if (!writer.error().empty()) throw EnvironmentError(to + ": " + writer.error());
}

// A file that is removed in the end.
class Removed {
 public:
  explicit Removed(std::string path) : path_(std::move(path)) {}
  ~Removed() { std::remove(path_.c_str()); }
  Removed(const Removed&) = delete;
  Removed& operator=(const Removed&) = delete;

 private:
  std::string path_;
};

// The difference from the golden log, or "".
std::string compare(const Golden& golden, const std::string& kept) {
  const log::Diff result = log::diff_logs(golden.log, kept, golden.rules);
  for (const std::string& line : result.idle_rules) spdlog::warn(line);
  if (!golden.html.empty()) write_file(golden.html, log::diff_html(result, golden.log, kept));
  if (result.same()) return "";
  std::string text = "the run differs from " + golden.log;
  for (const std::string& fault : result.faults) text += " (" + fault + ")";
  text += ":\n" + log::diff_text(result);
  if (golden.html.empty()) return text;
  while (text.ends_with('\n')) text.pop_back();
  return text + "\nplots of what differs: " + golden.html;
}

}  // namespace

std::string hold_to_golden(const Golden& golden, const std::string& record, bool renew) {
  const std::string kept = record + kKept;
  if (std::error_code unreadable; !renew && !fs::exists(golden.log, unreadable))
    return "there is no golden log " + golden.log + " yet: run this once with RUEDO_RENEW=1";
  check_kept(golden, record, renew);
  const Removed removed(kept);
  keep_channels(record, kept, golden.keep);
  if (!renew) return compare(golden, kept);
  if (const fs::path folder = fs::path(golden.log).parent_path(); !folder.empty()) {
    std::error_code error;  // writing the log reports what is wrong
    fs::create_directories(folder, error);
  }
  write_file(golden.log, read_input(kept, std::numeric_limits<size_t>::max()));
  fmt::print("renewed {}\n", golden.log);
  return "";
}

bool is_told_to_renew() {
  const char* environment = std::getenv("RUEDO_RENEW");
  std::string told = environment ? environment : "";
  std::transform(told.begin(), told.end(), told.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto is_any_of = [&](std::initializer_list<const char*> words) {
    return std::find(words.begin(), words.end(), told) != words.end();
  };
  if (is_any_of({"1", "true", "yes", "on"})) return true;
  if (is_any_of({"", "0", "false", "no", "off"})) return false;
  throw InputError({}, fmt::format("RUEDO_RENEW is \"{}\"; allowed are 1, true, yes, on and 0, "
                                   "false, no, off",
                                   environment));
}

}  // namespace ruedo::cli
