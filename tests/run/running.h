// Runs small worlds for the tests of the server: a bus in memory, and a run as one call.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <unistd.h>

#include "engine/thread_limit.h"
#include "ruedo/bus.h"
#include "run/run.h"
#include "world/load.h"

namespace ruedo::run {

struct Message {
  std::string channel;
  std::vector<uint8_t> bytes;
};

// Keeps what is published, and lets a test send messages.
class MemoryBus : public Bus {
 public:
  bool keep = true;  // false: only counts
  bool loses = false;
  std::function<void(const std::string&)> on_publish;

  void publish(const std::string& channel, const uint8_t* data, size_t size) override {
    {
      std::lock_guard lock(mutex_);
      ++count_;
      if (keep) messages_.push_back({channel, {data, data + size}});
    }
    changed_.notify_all();
    if (on_publish) on_publish(channel);
  }

  void listen(const std::vector<std::string>& channels, Handler handler,
              const std::vector<std::string>&) override {
    {
      std::lock_guard lock(mutex_);
      channels_ = channels;
      handler_ = std::move(handler);
    }
    changed_.notify_all();
  }

  void send(const std::string& channel, const std::vector<uint8_t>& bytes) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return handler_ != nullptr; });
    const Handler handler = handler_;
    lock.unlock();
    handler(channel, bytes.data(), bytes.size());
  }

  bool loses_messages() const override { return loses; }

  // A server that ends: the next one will listen.
  void stop() override {
    std::lock_guard lock(mutex_);
    handler_ = nullptr;
  }

  // The first message at or after index `from` on a channel that `good` accepts; waits for it.
  // Throws if none comes, instead of waiting for the test's time limit.
  Message wait_for(const std::string& channel, size_t& from,
                   const std::function<bool(const Message&)>& good = {}) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    std::unique_lock lock(mutex_);
    for (;;) {
      for (; from < messages_.size(); ++from) {
        if (messages_[from].channel == channel && (!good || good(messages_[from])))
          return messages_[from++];
      }
      if (changed_.wait_until(lock, deadline) == std::cv_status::timeout)
        throw std::runtime_error("nothing that is waited for came on " + channel + " for 60 s");
    }
  }

  std::vector<Message> messages() {
    std::lock_guard lock(mutex_);
    return messages_;
  }
  void forget() {  // the published messages
    std::lock_guard lock(mutex_);
    messages_.clear();
  }
  size_t count() {
    std::lock_guard lock(mutex_);
    return count_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Message> messages_;
  std::vector<std::string> channels_;
  Handler handler_;
  size_t count_ = 0;
};

// A file that a test needs beside its world.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& name)
      : path_(std::filesystem::temp_directory_path() / (std::to_string(::getpid()) + "_" + name)) {}
  ~TemporaryFile() { std::filesystem::remove(path_); }
  std::string path() const { return path_.string(); }
  std::string bytes() const {
    std::ifstream file(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

 private:
  std::filesystem::path path_;
};

// A two-wheeled robot of 10 kg: wheels of radius 0.1 m, track 0.4 m, no limits, no watchdog.
// `inside` goes into its link.
inline std::string robot_sdf(const std::string& name, double x, double y,
                             const std::string& inside = "") {
  const std::string place = std::to_string(x) + " " + std::to_string(y) + " 0 0 0 0";
  const auto wheel = [](const std::string& side, const std::string& y_m) {
    return "<link name='" + side + "'><pose>0 " + y_m +
           " 0.1 -1.5707963267948966 0 0</pose><inertial><mass>0.5</mass></inertial>"
           "<collision "
           "name='c'><geometry><cylinder><radius>0.1</radius><length>0.05</length></cylinder></"
           "geometry></collision></link>"
           "<joint name='" +
           side + "_joint' type='revolute'><parent>body</parent><child>" + side +
           "</child><axis><xyz expressed_in='__model__'>0 1 0</xyz></axis></joint>";
  };
  return "<model name='" + name + "'><pose>" + place +
         "</pose><link name='body'><pose>0 0 0.15 0 0 0</pose>"
         "<inertial><mass>10</mass></inertial>"
         "<collision name='c'><geometry><box><size>0.5 0.3 "
         "0.2</size></box></geometry></collision>" +
         inside + "</link>" + wheel("left", "0.2") + wheel("right", "-0.2") +
         "<ruedo:drive><ruedo:left_joint>left_joint</"
         "ruedo:left_joint><ruedo:right_joint>right_joint</ruedo:right_joint>"
         "<ruedo:watchdog>0</ruedo:watchdog></ruedo:drive></model>";
}

// A world of these models on a static model "ground".
inline std::string world_sdf(const std::string& models) {
  return "<?xml version='1.0'?><sdf version='1.9' xmlns:ruedo='ruedo'><world name='test'><physics "
         "type='bullet'>"
         "<max_step_size>0.005</max_step_size></physics>"
         "<model name='ground'><static>true</static><link name='link'><collision "
         "name='c'><geometry><plane><normal>0 0 1</normal>"
         "</plane></geometry></collision></link></model>" +
         models + "</world></sdf>";
}

inline std::shared_ptr<const world::WorldModel> load_text(const std::string& models) {
  return world::load_world_text(world_sdf(models), "test.sdf");
}

// At full speed, for `seconds` of sim time.
inline RunOptions fast(double seconds, uint64_t seed = 1) {
  RunOptions options;
  options.rate = std::numeric_limits<double>::infinity();
  options.duration_us = static_cast<int64_t>(seconds * 1e6);
  options.simulation.fleet.seed = seed;
  return options;
}

}  // namespace ruedo::run
