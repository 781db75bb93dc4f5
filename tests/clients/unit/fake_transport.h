// A server in memory, as far as a client needs one: it announces its channels, accepts sessions,
// and records what it receives.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "core.h"
#include "ruedo/channel_info_t.hpp"
#include "ruedo/grant_reply_t.hpp"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/tick_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "server_process.h"
#include "transport/transport.h"

namespace ruedo::client {

// The state that the test and the client's transport share.
class FakeServer {
 public:
  using Bytes = std::vector<uint8_t>;

  std::atomic<int64_t> run_id{7};
  std::atomic<bool> gone{false};  // nothing is answered, and the client's transport knows
  std::atomic<int> lost_leaves{0}, leaves{0};
  std::atomic<bool> exits_on_pause{false};  // the program, as if a signal's handler did it
  std::atomic<int64_t> falsehood{0};        // what it says of odometry_t
  std::atomic<int64_t> features{~(int64_t{1} << request_t::GRANT)};  // all but lockstep
  std::vector<std::string> robots{"p3at"};
  std::weak_ptr<Core> client;  // the last

  template <class Message>
  void send(const std::string& channel, const Message& message) {
    Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    send_bytes(channel, std::move(bytes));
  }
  void send_bytes(const std::string& channel, Bytes bytes) {
    const std::lock_guard lock(mutex_);
    to_client_.emplace_back(channel, std::move(bytes));
    news_.notify_all();
  }

  void send_info() {
    world_info_t info{};
    info.run_id = run_id;
    info.nparts = 1;
    info.version = "1";
    info.world = "memory";
    info.step_us = 5000;
    info.features = features;
    for (const std::string& name : robots) {
      robot_info_t robot{};
      robot.name = name;
      robot.drive = "kinematic";
      robot.watchdog_us = 40'000;
      info.robots.push_back(robot);
      add(info, name, "odometry", "odometry_t", odometry_t::getHash() + falsehood, false);
      add(info, name, "motion", "motion_status_t", motion_status_t::getHash(), false);
      add(info, name, "velocity", "velocity_command_t", velocity_command_t::getHash(), true);
      add(info, name, "move", "move_command_t", 0, true);
    }
    info.nrobots = static_cast<int32_t>(info.robots.size());
    info.ndevices = static_cast<int32_t>(info.devices.size());
    info.nchannels = static_cast<int32_t>(info.channels.size());
    send("ruedo/info", info);
  }
  void send_tick(int64_t utime) {
    tick_t tick{};
    tick.utime = utime;
    tick.run_id = run_id;
    tick.nparts = 1;
    send("ruedo/tick", tick);
  }
  void send_odometry(const std::string& robot, int64_t utime, double x) {
    odometry_t odometry{};
    odometry.utime = utime;
    odometry.x = x;
    send(robot + "/odometry", odometry);
  }
  void send_motion(const std::string& robot, int64_t utime, int64_t id, int8_t state,
                   int8_t reason = 0) {
    motion_status_t status{};
    status.utime = utime;
    status.id = id;
    status.kind = 1;
    status.state = state;
    status.reason = reason;
    send(robot + "/motion", status);
  }

  // The number of messages that the client has sent on a channel.
  int64_t heard(const std::string& channel) {
    const std::lock_guard lock(mutex_);
    return heard_[channel];
  }
  std::atomic<int64_t> id_of_last_move{0};
  void await(const std::function<bool()>& ready) {
    while (!ready()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  // Returns when the client's handlers have received all sent messages, and its callbacks have seen
  // them.
  void await_delivery() {
    {
      std::unique_lock lock(mutex_);
      news_.wait(lock, [&] { return to_client_.empty() && !delivering_; });
    }
    if (const auto core = client.lock()) await([&] { return core->callbacks().is_idle(); });
  }

 private:
  friend class FakeTransport;

  static void add(world_info_t& info, const std::string& robot, const std::string& name,
                  const std::string& type, int64_t fingerprint, bool input) {
    channel_info_t channel{};
    channel.name = robot + "/" + name;
    channel.robot = robot;
    channel.device = name;
    channel.type = type;
    channel.fingerprint = fingerprint;
    channel.rate = 50.0;
    channel.input = input;
    info.channels.push_back(channel);
    if (input) return;
    device_info_t device{};
    device.robot = robot;
    device.name = device.kind = name;
    info.devices.push_back(device);
  }

  void hear(const std::string& channel, const uint8_t* bytes, size_t size) {
    {
      const std::lock_guard lock(mutex_);
      ++heard_[channel];
      news_.notify_all();
    }
    if (move_command_t move;
        channel.ends_with("/move") && move.decode(bytes, 0, static_cast<int>(size)) > 0)
      id_of_last_move = move.id;
    if (channel != "ruedo/request") return;
    request_t request;
    if (request.decode(bytes, 0, static_cast<int>(size)) < 0) return;
    if (request.kind == request_t::LEAVE && ++leaves <= lost_leaves) return;
    if (request.kind == request_t::PAUSE && exits_on_pause) std::exit(5);
    if (gone) return;
    if (request.kind == request_t::INFO) return send_info();
    reply_t reply{};
    reply.run_id = run_id;
    reply.session = request.kind == request_t::JOIN ? 5 : request.session;
    reply.sequence = request.sequence;
    reply.kind = request.kind;
    if (request.kind == request_t::GRANT) {
      reply.body = encoded(grant_reply_t{});
      reply.size = static_cast<int32_t>(reply.body.size());
    }
    if (request.kind == request_t::LEAVE) std::fputs("a client has left\n", stderr);
    send("ruedo/reply", reply);
  }

  std::mutex mutex_;
  std::condition_variable news_;
  std::deque<std::pair<std::string, Bytes>> to_client_;
  std::map<std::string, int64_t> heard_;
  bool delivering_ = false;
};

class FakeTransport : public Transport {
 public:
  explicit FakeTransport(std::shared_ptr<FakeServer> server) : server_(std::move(server)) {}

  void subscribe(const std::string& channel) override {
    const std::lock_guard lock(mutex_);
    ++subscribed_[channel];
  }
  void unsubscribe(const std::string& channel) override {
    const std::lock_guard lock(mutex_);
    subscribed_.erase(channel);
  }
  void publish(const std::string& channel, const uint8_t* bytes, size_t size) override {
    server_->hear(channel, bytes, size);
  }
  bool is_connected() override { return !server_->gone; }
  bool has_news() override {
    const std::lock_guard lock(server_->mutex_);
    return !server_->to_client_.empty() || server_->delivering_;
  }
  bool receive(std::chrono::milliseconds timeout, const Receiver& receiver) override {
    std::unique_lock lock(server_->mutex_);
    if (!server_->news_.wait_for(lock, timeout, [&] { return !server_->to_client_.empty(); }))
      return false;
    auto [channel, bytes] = std::move(server_->to_client_.front());
    server_->to_client_.pop_front();
    server_->delivering_ = true;
    lock.unlock();
    if (wanted(channel)) receiver(channel, bytes.data(), bytes.size());
    lock.lock();
    server_->delivering_ = false;
    server_->news_.notify_all();
    return true;
  }

 private:
  bool wanted(const std::string& channel) {
    const std::lock_guard lock(mutex_);
    return subscribed_.count(channel) > 0;
  }

  const std::shared_ptr<FakeServer> server_;
  std::mutex mutex_;
  std::map<std::string, int> subscribed_;
};

// A simulation that is served from memory.
inline Simulation simulation(const std::shared_ptr<FakeServer>& server) {
  auto core =
      std::make_shared<Core>("memq://", "test", nullptr, std::make_unique<FakeTransport>(server));
  server->client = core;
  core->join(300.0);
  return Simulation(std::move(core));
}

}  // namespace ruedo::client
