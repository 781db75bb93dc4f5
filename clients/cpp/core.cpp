// The connection: info, time, repetition, and the signs of life of the server.
#include "core.h"

#include <cstdio>

#include "ruedo/request_t.hpp"
#include "ruedo/tick_t.hpp"
#include "server_process.h"
#include "wire_reader.h"

namespace ruedo::client {
namespace {

constexpr double kSilence = 5.0;    // s of real time without any message: a server gives a sign of life each second

}  // namespace

Clock::time_point deadline_after(double seconds) {
  if (!(seconds < 1e9)) return Clock::time_point::max();
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

Core::Core(const std::string& url, const std::string& name, std::unique_ptr<ServerProcess> server)
    : url_(url), server_(std::move(server)), last_sign_(Clock::now().time_since_epoch().count()), session_(*this, name),
      stepper_(*this), bus_(url) {
  uint32_t hash = 2166136261u;    // FNV-1a of the name: two clients number their primitives apart
  for (unsigned char c : name) hash = (hash ^ c) * 16777619u;
  ids_ = static_cast<int64_t>(hash & 0x7fffffffu) << 20;
  bus_.subscribe("ruedo/info", [this](const uint8_t* bytes, size_t size) { on_info(bytes, size); });
  bus_.subscribe("ruedo/tick", [this](const uint8_t* bytes, size_t size) { on_tick(bytes, size); });
  bus_.subscribe("ruedo/reply", [this](const uint8_t* bytes, size_t size) { session_.receive(bytes, size); });
  bus_.start();
}

Core::~Core() { close(); }

void Core::join(double timeout) {
  const Clock::time_point deadline = deadline_after(timeout);
  std::unique_lock lock(mutex_);
  while (!known_) {
    if (fault_) std::rethrow_exception(fault_);
    if (server_) {
      if (const auto ended = server_->ended()) throw NoServer(*ended);
    }
    if (Clock::now() >= deadline) {
      char text[32];
      std::snprintf(text, sizeof text, "%g", timeout);
      throw NoServer("no Ruedo server answered at " + url_ + " within " + text + " s. Is `ruedo run` started, with the same "
                     "--lcm or LCM_DEFAULT_URL? `ruedo doctor` looks for what is wrong");
    }
    ask_info();
    news_.wait_for(lock, std::chrono::milliseconds(100));
  }
}

void Core::close() {
  if (closed_.exchange(true)) return;
  {
    std::lock_guard lock(mutex_);
    wake_.notify_all();
  }
  if (repeater_.joinable()) repeater_.join();
  if (info()) session_.leave();
  bus_.close();
  if (server_) server_->end();
  news_.notify_all();
}

std::shared_ptr<const WorldInfo> Core::info() const {
  std::lock_guard lock(mutex_);
  return known_;
}

RobotInfo Core::robot_info(const std::string& name) const {
  const auto known = info();
  if (const RobotInfo* robot = known->robot(name)) return *robot;
  std::string names;
  for (const RobotInfo& robot : known->robots) names += (names.empty() ? "" : ", ") + robot.name;
  throw UnknownName("there is no robot '" + name + "'; there is " + (names.empty() ? "none" : names));
}

std::shared_ptr<StreamCore> Core::stream(const ChannelInfo& channel) {
  std::lock_guard lock(mutex_);
  auto& stream = streams_[channel.name];
  if (!stream) stream = std::make_shared<StreamCore>(*this, channel);
  return stream;
}

std::shared_ptr<Driver> Core::driver(const std::string& robot) {
  const double watchdog = robot_info(robot).watchdog;
  std::lock_guard lock(mutex_);
  auto& driver = drivers_[robot];
  if (!driver) driver = std::make_shared<Driver>(*this, robot, watchdog);
  return driver;
}

void Core::keep_repeating(const std::shared_ptr<Driver>& driver) {
  std::lock_guard lock(mutex_);
  repeating_.insert(driver);
  if (!repeater_.joinable() && !closed_) repeater_ = std::thread([this] { repeat(); });
  wake_.notify_all();
}

void Core::repeat() {    // feeds the watchdogs in real time
  double period = 0.1;
  std::unique_lock lock(mutex_);
  while (!closed_) {
    wake_.wait_for(lock, std::chrono::duration<double>(period));
    const std::vector<std::shared_ptr<Driver>> drivers(repeating_.begin(), repeating_.end());
    lock.unlock();
    period = 0.1;
    for (const auto& driver : drivers) {
      driver->repeat();
      period = std::min(period, driver->period());
    }
    lock.lock();
  }
}

void Core::note_time(int64_t utime) {
  last_sign_ = Clock::now().time_since_epoch().count();
  {
    std::lock_guard lock(mutex_);
    if (utime > utime_) utime_ = utime;
  }
  news_.notify_all();
}

void Core::sleep_until(int64_t utime) {
  std::unique_lock lock(mutex_);
  while (utime_ < utime) {
    news_.wait_for(lock, std::chrono::milliseconds(500));
    lock.unlock();
    check_server();
    lock.lock();
  }
}

void Core::refresh_info(std::shared_ptr<const WorldInfo> before) {
  if (!before) before = info();
  const Clock::time_point deadline = deadline_after(10.0);
  std::unique_lock lock(mutex_);
  while (known_ == before && Clock::now() < deadline) {
    lock.unlock();
    ask_info();
    lock.lock();
    news_.wait_for(lock, std::chrono::milliseconds(100));
  }
}

void Core::check_server() {
  if (closed_) throw NoServer("this simulation was closed");
  if (server_) {
    if (const auto ended = server_->ended()) throw NoServer(*ended);
  }
  // One of this machine that is stopped, or in a debugger, is waited for.
  if (silence() > kSilence && !is_claimed(url_)) throw NoServer("nothing was heard from the server at " + url_ + " for 5 s");
}

std::string Core::what_is_known(double rate) const {
  char text[96];
  if (silence() > 3.0) {
    std::snprintf(text, sizeof text, "nothing at all was heard from the server for %.1f s", silence());
  } else if (info()->paused) {
    return "the simulation is paused";
  } else if (rate > 0.0) {
    std::snprintf(text, sizeof text, "its rate is %g Hz of sim time, which is now %.2f s", rate, static_cast<double>(utime_) * 1e-6);
  } else {
    return "it sends when something happens";
  }
  return text;
}

double Core::silence() const {
  const Clock::duration since = Clock::now().time_since_epoch() - Clock::duration(last_sign_.load());
  return std::chrono::duration<double>(since).count();
}

void Core::on_info(const uint8_t* bytes, size_t size) {
  std::shared_ptr<const WorldInfo> info;
  std::exception_ptr fault;
  try {
    info = assembler_.add(bytes, size);
  } catch (const TypeMismatch&) {
    fault = std::current_exception();
  }
  {
    std::lock_guard lock(mutex_);
    fault_ = fault;
    if (!fault) last_sign_ = Clock::now().time_since_epoch().count();
    if (info) {
      if (known_ && (info->run_id != known_->run_id || info->epoch != known_->epoch)) utime_ = 0;
      known_ = std::move(info);
      // No command is repeated to a robot that is gone, nor to the next one of its name.
      for (auto it = drivers_.begin(); it != drivers_.end();) {
        const bool gone = !known_->robot(it->first);
        if (gone) repeating_.erase(it->second);
        it = gone ? drivers_.erase(it) : std::next(it);
      }
    }
  }
  news_.notify_all();
}

void Core::on_tick(const uint8_t* bytes, size_t size) {
  if (size < 16) return;
  WireReader in(bytes, size);
  if (in.int64() != tick_t::getHash()) return;
  note_time(in.int64());
  try {
    stepper_.on_tick(bytes, size);
  } catch (const WireError&) {
  }
  // Sim time may run a hundred times faster than real time: the watchdog is fed by its beat, too.
  std::vector<std::shared_ptr<Driver>> drivers;
  {
    std::lock_guard lock(mutex_);
    drivers.assign(repeating_.begin(), repeating_.end());
  }
  for (const auto& driver : drivers) driver->repeat();
}

void Core::ask_info() {
  request_t request{};
  request.epoch = -1;
  request.kind = request_t::INFO;
  bus_.publish("ruedo/request", request);
}

}  // namespace ruedo::client
