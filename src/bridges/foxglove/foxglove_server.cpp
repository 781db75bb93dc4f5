// Two threads meet here, under one lock: the run's messages come in one and become JSON, browsers
// are served in the other.
//
// The protocol is foxglove.websocket.v1 (github.com/foxglove/ws-protocol, docs/spec.md), which
// foxglove.sdk.v1 repeats: JSON texts with "op", and binary messages that begin with an opcode.
#include "bridges/foxglove/foxglove_server.h"

#include "ruedo/errors.h"

#ifdef RUEDO_CONSOLE

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <nlohmann/json.hpp>

#include "base/utf8.h"
#include "base/version.h"
#include "bridges/foxglove/foxglove.h"
#include "engine/outcome.h"
#include "http/web_server.h"
#include "ruedo/velocity_command_t.hpp"
#include "run/queued_sink.h"
#include "run/run.h"

namespace ruedo::foxglove {
namespace {

using nlohmann::json;
using Text = std::shared_ptr<const std::string>;

constexpr int kPort = 8765;                        // Foxglove's own default
constexpr size_t kMostQueued = size_t{64} << 20;   // bytes between the run and this
constexpr size_t kMostWaiting = size_t{32} << 20;  // bytes that wait for one viewer
constexpr size_t kMostViewers = 16;
constexpr size_t kMostLayers = 64;  // of clients' drawings, for later viewers
constexpr size_t kMostChannels = 65'000;
constexpr size_t kMostOfChannel = 8, kMostPublished = 100;  // subscriptions, topics of one viewer
constexpr SimTime kClockPeriod_us = 20'000;
// Web pages that may connect. Programs have no origin and may; any other web page could be spying.
const std::vector<std::string> kOrigins = {"https://app.foxglove.dev",
                                           "https://studio.foxglove.dev"};

enum Opcode : uint8_t { kMessageData = 1, kTime = 2 };  // kMessageData: of both sides
constexpr size_t kDataHead = 5;                         // a viewer's: opcode, channel

template <class Integer>
void put(std::string& bytes, Integer value) {
  for (size_t i = 0; i < sizeof value; ++i) bytes += static_cast<char>(value >> (8 * i));
}

struct Channel {
  std::string topic, schema_name, schema;
  struct Kept {
    uint64_t time_ns;
    Text text;
    std::string key;
  };
  std::vector<Kept> kept;  // for viewers that come later
  // Keeps its messages until models come or go; those with a key until the next of that key.
  bool lasts = false;
};

// A velocity from Foxglove's Teleop panel: a geometry_msgs/Twist as JSON. Nothing for other JSON.
std::vector<uint8_t> velocity_of(std::string_view text) {
  const json twist = json::parse(text, nullptr, false);
  const auto number = [&](const char* part, const char* axis) {
    const auto at = json::json_pointer(fmt::format("/{}/{}", part, axis));
    return twist.contains(at) && twist[at].is_number() ? twist[at].get<double>() : NAN;
  };
  velocity_command_t command{};
  command.vx = number("linear", "x");
  command.vy = number("linear", "y");
  command.omega = number("angular", "z");
  if (!twist.is_object() || !std::isfinite(command.vx + command.vy + command.omega)) return {};
  return engine::encoded(command);
}

struct BadMessage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

uint32_t id_of(const json& value) {
  if (!value.is_number_unsigned() || value.get<uint64_t>() > UINT32_MAX)
    throw BadMessage("an id is a whole number of 32 bits");
  return static_cast<uint32_t>(value.get<uint64_t>());
}

class Viewer;

// The state that both threads share.
struct Hub {
  std::mutex mutex;               // of all that follows
  std::vector<Channel> channels;  // by id
  std::set<Viewer*> viewers;
  std::map<std::string, std::string> inputs;  // names that publish velocities to: the bus's
  uint64_t dropped = 0;
  bool news = false;
  std::atomic<uint64_t> audience{0};  // grows with each change of subscriptions

  std::function<void(const std::string& channel, const std::vector<uint8_t>&)> inject;

  std::string advertised(const std::vector<size_t>& which) const {
    json list = json::array();
    for (const size_t id : which) {
      const Channel& channel = channels[id];
      list.push_back({{"id", id},
                      {"topic", channel.topic},
                      {"encoding", "json"},
                      {"schemaName", channel.schema_name},
                      {"schema", channel.schema},
                      {"schemaEncoding", "jsonschema"}});
    }
    return json{{"op", "advertise"}, {"channels", list}}.dump();
  }
};

// One viewer. Everything but the constructor and the destructor needs the hub's lock.
class Viewer : public http::Connection {
 public:
  explicit Viewer(Hub& hub, const std::string& greeting) : hub_(hub) {
    const std::lock_guard lock(hub_.mutex);
    say(greeting);
    std::vector<size_t> all(hub_.channels.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = i;
    if (!all.empty()) say(hub_.advertised(all));
    hub_.viewers.insert(this);
  }
  ~Viewer() override {
    const std::lock_guard lock(hub_.mutex);
    hub_.viewers.erase(this);
    ++hub_.audience;
  }

  void say(std::string text) { push({std::make_shared<const std::string>(std::move(text)), {}}); }
  void send_time(uint64_t time_ns) {
    std::string head(1, kTime);
    put(head, time_ns);
    push({nullptr, std::move(head)});
  }
  void send(size_t channel, uint64_t time_ns, const Text& message) {
    const auto [begin, end] = subscribed_.equal_range(channel);
    for (auto at = begin; at != end; ++at) {
      std::string head(1, kMessageData);
      put(head, at->second);
      put(head, time_ns);
      push({message, std::move(head)});
    }
  }
  bool wants(size_t channel) const { return subscribed_.contains(channel); }

  // Others wait for the lock: texts are read without it.
  bool on_message(std::span<const uint8_t> message) override {
    const std::string_view text(reinterpret_cast<const char*>(message.data()), message.size());
    if (text.empty()) return true;
    const bool data = text[0] == kMessageData;
    const std::vector<uint8_t> command = data && text.size() >= kDataHead
                                             ? velocity_of(text.substr(kDataHead))
                                             : std::vector<uint8_t>();
    const json asked = data ? json() : json::parse(text, nullptr, false);
    const std::lock_guard lock(hub_.mutex);
    complained_ = false;
    if (data) return publish(text, command), true;
    try {
      return obey(asked);
    } catch (const BadMessage& bad) {
      complain(bad.what());
    } catch (const json::exception&) {
      complain("a message outside of the protocol was ignored");
    }
    return true;
  }

  bool next(std::vector<uint8_t>& message, bool& text) override {
    const std::lock_guard lock(hub_.mutex);
    if (waiting_.empty()) return false;
    const Waiting& first = waiting_.front();
    text = first.head.empty();
    message.insert(message.end(), first.head.begin(), first.head.end());
    if (first.body) message.insert(message.end(), first.body->begin(), first.body->end());
    bytes_ -= first.size();
    waiting_.pop_front();
    return true;
  }

 private:
  struct Waiting {
    Text body;
    std::string head;  // of a binary message
    size_t size() const { return head.size() + (body ? body->size() : 0); }
  };

  void push(Waiting message) {
    if (bytes_ > kMostWaiting) {
      ++hub_.dropped;
      if (!std::exchange(told_, true)) {
        waiting_.clear();  // it is too far behind: what waits is dropped
        bytes_ = 0;
        warn("messages were dropped: this connection is slower than the run");
      }
      return;
    }
    told_ = false;
    bytes_ += message.size();
    waiting_.push_back(std::move(message));
    hub_.news = true;
  }

  void warn(const std::string& words) {
    say(json{{"op", "status"}, {"level", 1}, {"message", words}}.dump());
  }
  // Once for each message, which may hold many things that are wrong.
  void complain(const std::string& words) {
    if (!std::exchange(complained_, true)) warn(words);
  }

  bool obey(const json& asked) {
    const std::string op = asked.at("op");
    if (op == "subscribe") {
      for (const json& one : asked.at("subscriptions"))
        subscribe(id_of(one.at("id")), id_of(one.at("channelId")));
    } else if (op == "unsubscribe") {
      for (const json& one : asked.at("subscriptionIds")) unsubscribe(id_of(one));
    } else if (op == "advertise") {
      for (const json& one : asked.at("channels")) advertise(one);
    } else if (op == "unadvertise") {
      for (const json& one : asked.at("channelIds")) published_.erase(id_of(one));
    }
    return true;  // the rest of the protocol is not supported
  }

  void subscribe(uint32_t id, size_t channel) {
    if (channel >= hub_.channels.size()) return complain(fmt::format("no channel {}", channel));
    if (subscribed_.count(channel) >= kMostOfChannel)
      return complain(fmt::format("too many subscriptions to channel {}", channel));
    if (!channels_.emplace(id, channel).second)
      return complain(fmt::format("subscription {} is there already", id));
    subscribed_.emplace(channel, id);
    ++hub_.audience;
    for (const Channel::Kept& kept : hub_.channels[channel].kept) {
      std::string head(1, kMessageData);
      put(head, id);
      put(head, kept.time_ns);
      push({kept.text, std::move(head)});
    }
  }

  void unsubscribe(uint32_t id) {
    const auto known = channels_.find(id);
    if (known == channels_.end()) return;
    const auto [begin, end] = subscribed_.equal_range(known->second);
    subscribed_.erase(std::find(begin, end, std::pair<const size_t, uint32_t>(known->second, id)));
    channels_.erase(known);
    ++hub_.audience;
  }

  void advertise(const json& channel) {
    std::string topic = channel.at("topic");
    if (topic.starts_with('/')) topic.erase(0, 1);
    const auto input = hub_.inputs.find(topic);
    if (channel.at("encoding") != "json" || input == hub_.inputs.end()) {
      if (complained_) return;
      std::string names;
      for (const auto& [name, bus] : hub_.inputs) names += (names.empty() ? "" : ", ") + name;
      return complain("publishing is for velocities (geometry_msgs/Twist as json) on: " + names);
    }
    if (published_.size() < kMostPublished) published_[id_of(channel.at("id"))] = input->second;
  }

  void publish(std::string_view message, const std::vector<uint8_t>& command) {
    if (message.size() < kDataHead) return complain("a message without a channel");
    uint32_t id = 0;
    for (size_t i = kDataHead - 1; i > 0; --i) id = id << 8 | static_cast<uint8_t>(message[i]);
    const auto known = published_.find(id);
    if (known == published_.end()) return complain(fmt::format("no channel {} was advertised", id));
    if (command.empty()) return complain("a Twist needs finite numbers in linear and angular");
    hub_.inject(known->second, command);
  }

  Hub& hub_;
  std::deque<Waiting> waiting_;
  size_t bytes_ = 0;
  bool told_ = false, complained_ = false;
  std::multimap<size_t, uint32_t> subscribed_;  // ids, by channel
  std::map<uint32_t, size_t> channels_;         // by id
  std::map<uint32_t, std::string> published_;   // the bus's channels
};

class LiveFoxglove : public FoxgloveServer, public run::Sink, private FoxgloveOutput {
 public:
  LiveFoxglove(run::Run& server, const http::Address& address)
      : server_(server),
        export_(*this),
        queue_(*this, {.thread = "foxglove", .most_bytes = kMostQueued}) {
    hub_.inject = [&server](const std::string& channel, const std::vector<uint8_t>& bytes) {
      server.on_message(channel, bytes);
    };
    const json greeting = {{"op", "serverInfo"},
                           {"name", std::string("Ruedo ") + version()},
                           {"capabilities", {"time", "clientPublish"}},
                           {"supportedEncodings", {"json"}},
                           {"sessionId", std::to_string(server.run_id())}};
    http::WebHandler handler;
    handler.get = [](std::string_view) {
      static const std::string words =
          "A Foxglove WebSocket. In Foxglove: Open connection, Foxglove WebSocket, this address.\n";
      http::HttpResponse response;
      response.body = std::make_shared<const std::vector<uint8_t>>(words.begin(), words.end());
      return response;
    };
    handler.open = [this, text = greeting.dump()] { return std::make_unique<Viewer>(hub_, text); };
    handler.end = [] {};
    handler.tick = [this] {
      const std::lock_guard lock(hub_.mutex);
      return std::exchange(hub_.news, false);
    };
    const std::string token = address.loopback() ? "" : http::make_token();
    for (const std::string& host : http::reachable_hosts(address)) hosts_.push_back(host);
    web_ = std::make_unique<http::WebServer>(
        http::WebPlace{.address = address,
                       .token = token,
                       .option = "--foxglove",
                       .socket = "/",
                       .protocols = {"foxglove.websocket.v1", "foxglove.sdk.v1"},
                       .origins = kOrigins,
                       .most_sockets = kMostViewers},
        std::move(handler));
    rest_ = fmt::format(":{}/{}", web_->port(), token.empty() ? "" : "?token=" + token);
    find_inputs(server.channels());  // a viewer may come before the first announcement
    thread_ = std::thread([this] {
      pthread_setname_np(pthread_self(), "foxglove web");
      try {
        web_->run();
      } catch (const std::exception& error) {
        spdlog::error("--foxglove has ended: {}", error.what());
      }
    });
    server.add(queue_);
  }
  ~LiveFoxglove() override {
    web_->stop();
    thread_.join();
    web_.reset();  // its viewers, before the hub
  }

  void print() const override {
    for (const std::string& host : hosts_) fmt::print("Foxglove: ws://{}{}\n", host, rest_);
    std::fflush(stdout);
  }

  // ---- The run's, in the queue's thread.

  // Of records what clients draw.
  Hears hears() const override { return {.samples = true, .records = true}; }
  uint64_t audience() const override { return hub_.audience; }
  void announce(const std::shared_ptr<const run::Announcement>& announcement) override {
    run::LogWorlds::Scene scene;
    scene.world = server_.world();
    for (const world_info_t& part : announcement->info) scene.info.push_back(engine::encoded(part));
    {
      const std::lock_guard lock(hub_.mutex);
      for (Channel& channel : hub_.channels)
        std::erase_if(channel.kept, [](const Channel::Kept& kept) { return kept.key.empty(); });
      find_inputs(announcement->channels);
    }
    export_.begin_scene(scene, nanoseconds(last_us_));
  }
  void message(const run::Published& message) override {
    last_us_ = message.stamp_us;
    const std::span<const uint8_t> bytes(message.data, message.size);
    if (message.kind == run::Kind::record)
      export_.add_drawn(nanoseconds(message.stamp_us), bytes);
    else
      export_.add(message.channel, nanoseconds(message.stamp_us), bytes);
  }
  void flush() override {
    if (last_us_ < clock_us_ + kClockPeriod_us) return;
    clock_us_ = last_us_;
    const std::lock_guard lock(hub_.mutex);
    for (Viewer* viewer : hub_.viewers) viewer->send_time(nanoseconds(last_us_));
  }

 private:
  static uint64_t nanoseconds(SimTime time_us) { return static_cast<uint64_t>(time_us) * 1000; }

  // A robot takes velocities on ROBOT/velocity and ROBOT/cmd_vel, the only one on cmd_vel, too.
  void find_inputs(const engine::Channels& channels) {
    hub_.inputs.clear();
    for (const engine::Channel& channel : channels.list()) {
      if (!channel.input || channel.gone || channel.type != "velocity_command_t") continue;
      hub_.inputs[channel.name] = channel.bus_name;
      hub_.inputs[channel.robot + "/cmd_vel"] = channel.bus_name;
    }
    if (hub_.inputs.size() == 2) hub_.inputs["cmd_vel"] = hub_.inputs.begin()->second;
  }

  // ---- The export's.

  uint16_t add_schema(const std::string& name, const std::string& schema) override {
    schemas_.push_back({name, schema});
    return static_cast<uint16_t>(schemas_.size() - 1);
  }
  uint16_t add_channel(uint16_t schema, const std::string& topic) override {
    const std::lock_guard lock(hub_.mutex);
    const size_t id = hub_.channels.size();
    hub_.channels.push_back({topic,
                             schemas_[schema].first,
                             schemas_[schema].second,
                             {},
                             topic == FoxgloveExport::kFrames || topic == FoxgloveExport::kScene});
    by_topic_[topic] = id;
    for (Viewer* viewer : hub_.viewers) viewer->say(hub_.advertised({id}));
    return static_cast<uint16_t>(id);
  }
  void add_message(uint16_t id, uint64_t time_ns, const std::string& text,
                   const std::string& key) override {
    const auto message = std::make_shared<const std::string>(text);
    const std::lock_guard lock(hub_.mutex);
    keep(hub_.channels[id], {time_ns, message, key});
    for (Viewer* viewer : hub_.viewers) viewer->send(id, time_ns, message);
  }
  static void keep(Channel& channel, Channel::Kept message) {
    std::vector<Channel::Kept>& kept = channel.kept;
    if (!message.key.empty()) {
      std::erase_if(kept, [&](const Channel::Kept& each) { return each.key == message.key; });
      if (kept.size() >= kMostLayers) kept.erase(kept.begin());
    } else if (!channel.lasts) {
      return;
    }
    kept.push_back(std::move(message));
  }
  // For the run and the export. The first message of a topic says which channels there are.
  bool wants(const std::string& topic) const override {
    const std::lock_guard lock(hub_.mutex);
    const auto known = by_topic_.find(topic), values = by_topic_.find(topic + "/values");
    if (known == by_topic_.end()) return hub_.channels.size() < kMostChannels;
    for (const Viewer* viewer : hub_.viewers) {
      if (viewer->wants(known->second) ||
          (values != by_topic_.end() && viewer->wants(values->second)))
        return true;
    }
    return false;
  }

  run::Run& server_;
  mutable Hub hub_;
  std::map<std::string, size_t> by_topic_;  // channels
  std::vector<std::pair<std::string, std::string>> schemas_;
  FoxgloveExport export_;
  SimTime last_us_ = 0, clock_us_ = -kClockPeriod_us;
  std::unique_ptr<http::WebServer> web_;
  std::thread thread_;
  std::vector<std::string> hosts_;
  std::string rest_;
  run::QueuedSink queue_;  // its thread ends first
};

}  // namespace

void FoxgloveServer::check(const std::string& address) {
  http::check_port(http::parse_address(address, "--foxglove", kPort), "--foxglove");
}

std::unique_ptr<FoxgloveServer> FoxgloveServer::open(run::Run& server, const std::string& address) {
  return std::make_unique<LiveFoxglove>(server, http::parse_address(address, "--foxglove", kPort));
}

}  // namespace ruedo::foxglove

#else

namespace ruedo::foxglove {

void FoxgloveServer::check(const std::string&) {
  throw EnvironmentError(
      "--foxglove: this build has no web server: it was made without the console");
}

std::unique_ptr<FoxgloveServer> FoxgloveServer::open(run::Run&, const std::string& address) {
  check(address);
  return nullptr;
}

}  // namespace ruedo::foxglove

#endif
