// ruedo echo and ruedo hz: what is on a channel, and how often, in a terminal. They see what any
// client sees.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>

#include <fmt/format.h>

#include "base/utf8.h"
#include "bus/lcm_bus.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/range.h"
#include "ruedo/decode.h"
#include "ruedo/element.h"
#include "ruedo/schema.h"
#include "ruedo/world_info_t.hpp"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kInfo = "ruedo/info";
constexpr int kShownElements = 8;  // of an array
// Messages waiting to be shown; more are dropped and counted.
constexpr size_t kMostWaiting = 1000;  // messages
constexpr size_t kMostWaitingBytes = 64 << 20;

struct Message {
  std::string channel;
  std::vector<uint8_t> bytes;
  Clock::time_point arrived;
};

// Between the bus's thread and this one; never grows without bound.
class Mailbox {
 public:
  void put(const std::string& channel, const uint8_t* data, size_t size) {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= kMostWaiting || waiting_bytes_ + size > kMostWaitingBytes) {
      ++dropped_;
      return;
    }
    waiting_bytes_ += size;
    waiting_.push_back({channel, {data, data + size}, Clock::now()});
    ready_.notify_one();
  }

  // False when nothing came in time.
  bool take(Message& message, Clock::time_point until) {
    std::unique_lock lock(mutex_);
    if (!ready_.wait_until(lock, until, [this] { return !waiting_.empty(); })) return false;
    message = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_bytes_ -= message.bytes.size();
    return true;
  }

  uint64_t dropped() {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<Message> waiting_;
  size_t waiting_bytes_ = 0;
  uint64_t dropped_ = 0;
};

// The elements of long arrays after the first few are counted, not shown.
class Printer {
 public:
  bool operator()(const FieldPath& path, const FieldValue& value) {
    const std::string pattern = path.pattern();
    if (pattern != pattern_) end_field();
    pattern_ = pattern;
    if (std::any_of(path.parts.begin(), path.parts.end(), [](const auto& part) {
          return std::any_of(part.indices.begin(), part.indices.end(),
                             [](int64_t i) { return i >= kShownElements; });
        })) {
      ++hidden_;
      return true;
    }
    fmt::print("  {} = {}\n", path.str(), for_terminal(to_string(value)));
    return true;
  }
  void end_field() {
    if (hidden_ > 0) fmt::print("  {} ... {} more\n", pattern_, hidden_);
    hidden_ = 0;
  }

 private:
  std::string pattern_;
  int64_t hidden_ = 0;
};

void print(const Message& message) {
  const Schema* schema = find_schema(fingerprint_of(message.bytes));
  const std::string channel = for_terminal(message.channel);
  if (schema == nullptr) {
    fmt::print(
        "{}: {} bytes of a type that Ruedo does not know (its hash is {:#018x}); --types reads its "
        ".lcm file\n",
        channel, message.bytes.size(), static_cast<uint64_t>(fingerprint_of(message.bytes)));
    return;
  }
  fmt::print("{} ({}, {} bytes)\n", channel, schema->name, message.bytes.size());
  Printer printer;
  const bool whole = visit_message(
      *schema, message.bytes,
      [&](const FieldPath& path, const FieldValue& value) { return printer(path, value); });
  printer.end_field();
  if (!whole) fmt::print("  ... and then bytes that are not a {}\n", schema->name);
}

// Warns, once, of channels that the server's list does not have. The list comes in parts.
class UnknownChannels {
 public:
  explicit UnknownChannels(const std::vector<std::string>& asked) {
    for (const std::string& channel : asked) {
      const bool is_name = channel.find_first_of(".*+?[](){}|^$\\") == std::string::npos;
      if (is_name) asked_.push_back(channel);
    }
  }
  void take(const Message& message) {
    world_info_t info;
    if (is_done_ ||
        decode_checked(message.bytes.data(), message.bytes.size(), info) != DecodeFault::none)
      return;
    if (info.part == 0) known_.clear();
    for (const channel_info_t& channel : info.channels) known_.push_back(channel.name);
    if (info.part + 1 < info.nparts) return;
    is_done_ = true;
    for (const std::string& channel : asked_) {
      if (std::find(known_.begin(), known_.end(), channel) != known_.end()) continue;
      const std::string near = nearest_word(channel, known_);
      to_stderr("ruedo: the server has no channel '{}'{}; there are {}\n", for_terminal(channel),
                near.empty() ? "" : "; did you mean '" + near + "'?",
                for_terminal(fmt::format("{}", fmt::join(known_, ", "))));
    }
  }

 private:
  std::vector<std::string> asked_, known_;
  bool is_done_ = false;
};

struct EchoArguments {
  std::vector<std::string> channels;
  std::string lcm;
  int count = 0;
  double timeout_s = 0.0;
};

int echo(const EchoArguments& arguments) {
  read_given_types();
  Mailbox mailbox;
  bus::LcmBus bus(arguments.lcm);
  const bool shows_info = std::find(arguments.channels.begin(), arguments.channels.end(), kInfo) !=
                          arguments.channels.end();
  std::vector<std::string> heard = arguments.channels;
  if (!shows_info) heard.emplace_back(kInfo);
  bus.listen(heard, [&](const std::string& channel, const uint8_t* data, size_t size) {
    mailbox.put(channel, data, size);
  });
  UnknownChannels unknown(arguments.channels);
  const auto patience = arguments.timeout_s > 0.0
                            ? std::chrono::duration<double>(arguments.timeout_s)
                            : std::chrono::hours(24 * 365);
  Message message;
  for (int seen = 0; arguments.count == 0 || seen < arguments.count; ++seen) {
    const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(patience);
    bool came = mailbox.take(message, until);
    for (; came && message.channel == kInfo && !shows_info; came = mailbox.take(message, until))
      unknown.take(message);
    if (!came) {
      to_stderr("ruedo: nothing on {} for {:g} s, on {}\n",
                fmt::format("{}", fmt::join(arguments.channels, ", ")), arguments.timeout_s,
                bus.url().str());
      return kCheckFailed;
    }
    print(message);
    std::fflush(stdout);
  }
  return kGood;
}

// The messages of a channel within the last report's time.
struct Traffic {
  int64_t messages = 0, bytes = 0;
  Clock::time_point last;
  double least_s = INFINITY, most_s = 0.0;
};

// Each once, in the order given.
std::vector<std::string> different(const std::vector<std::string>& names) {
  std::vector<std::string> found;
  for (const std::string& name : names) {
    if (std::find(found.begin(), found.end(), name) == found.end()) found.push_back(name);
  }
  return found;
}

int hz(const EchoArguments& arguments) {
  const std::vector<std::string> channels = different(arguments.channels);
  Mailbox mailbox;
  bus::LcmBus bus(arguments.lcm);
  bus.listen(channels, [&](const std::string& channel, const uint8_t* data, size_t size) {
    mailbox.put(channel, data, size);
  });
  std::map<std::string, Traffic> traffic;
  bool anything = false;
  for (int report = 0; arguments.count == 0 || report < arguments.count; ++report) {
    const auto begin = Clock::now(), end = begin + std::chrono::seconds(1);
    for (Message message; mailbox.take(message, end);) {
      Traffic& t = traffic[message.channel];
      if (t.last != Clock::time_point{}) {
        const double gap_s = std::chrono::duration<double>(message.arrived - t.last).count();
        t.least_s = std::min(t.least_s, gap_s);
        t.most_s = std::max(t.most_s, gap_s);
      }
      t.last = message.arrived;
      ++t.messages;
      t.bytes += static_cast<int64_t>(message.bytes.size());
      if (Clock::now() >= end) break;
    }
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    for (const std::string& channel : channels) {
      Traffic& t = traffic[channel];
      anything |= t.messages > 0;
      if (t.messages == 0)
        fmt::print("{}: nothing\n", channel);
      else if (t.most_s == 0.0)
        fmt::print("{}: {:.1f} Hz\n", channel, static_cast<double>(t.messages) / seconds);
      else {
        fmt::print("{}: {:.1f} Hz, {:.1f} to {:.1f} ms apart, {:.1f} kB/s\n", channel,
                   static_cast<double>(t.messages) / seconds, t.least_s * 1e3, t.most_s * 1e3,
                   static_cast<double>(t.bytes) / seconds * 1e-3);
      }
      t = {0, 0, t.last, INFINITY, 0.0};
    }
    if (const uint64_t dropped = mailbox.dropped(); dropped > 0)
      fmt::print("{} messages came faster than they could be counted\n", dropped);
    std::fflush(stdout);
  }
  return anything ? kGood : kCheckFailed;
}

void add(CLI::App& app, Action& chosen, const char* name, const char* help, const char* count_help,
         int (*action)(const EchoArguments&)) {
  CLI::App* command = app.add_subcommand(name, help);
  const auto arguments = std::make_shared<EchoArguments>();
  command->add_option("CHANNEL", arguments->channels, "such as p3at/odometry")->required();
  command
      ->add_option("--lcm", arguments->lcm,
                   "LCM address (default: $LCM_DEFAULT_URL, or LCM's group)")
      ->type_name("URL");
  command->add_option("-n,--count", arguments->count, count_help)
      ->type_name("N")
      ->check(CLI::Range(1, 1'000'000'000));
  if (action == echo) {
    add_types_argument(*command);
    command
        ->add_option("--timeout", arguments->timeout_s,
                     "exit with 1 after so many seconds without a message")
        ->type_name("S")
        ->check(within(1e-3, 1e9));
  }
  command->callback([arguments, action, &chosen] {
    chosen = [arguments, action] { return action(*arguments); };
  });
}

void add_echo(CLI::App& app, Action& chosen) {
  add(app, chosen, "echo", "print the messages on a channel, field by field",
      "end after this many messages", echo);
}
void add_hz(CLI::App& app, Action& chosen) {
  add(app, chosen, "hz", "measure the rate of a channel's messages", "end after this many seconds",
      hz);
}

const RegisterCommand kRegisterEcho{60, add_echo};
const RegisterCommand kRegisterHz{61, add_hz};

}  // namespace
}  // namespace ruedo::cli
