// The connection: info, time, repetition, and the signs of life of the server.
#include "core.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <optional>
#include <system_error>
#include <utility>

#include "ends.h"
#include "ruedo/request_t.hpp"
#include "ruedo/tick_t.hpp"
#include "samples/wire_reader.h"
#include "server_process.h"
#include "transport/address.h"

namespace ruedo::client {
namespace {

constexpr auto kAskAgain = std::chrono::milliseconds(500),
               kFaultTime = std::chrono::milliseconds(1000);
constexpr std::chrono::seconds kLookTime(1);  // a stopped server keeps the connection of each look
constexpr std::chrono::milliseconds kTurnInUse(10), kListenTime(200);
constexpr double kSilence =
    5.0;  // s of real time without any message: a server gives a sign of life each second

// How many clients of this process have joined that run before.
uint32_t joined_before(int64_t run_id) {
  static std::mutex mutex;
  static std::map<int64_t, uint32_t> joined;
  const std::lock_guard lock(mutex);
  return joined[run_id]++;
}

// Where a client that joins at that time begins to number its primitives: apart from others', and
// from those of its own that an earlier start of the program has left under way. Equal runs in
// lockstep have equal numbers, since their logs are compared.
int64_t ids_from(const std::string& name, int64_t utime, uint32_t before) {
  uint32_t hash = 2166136261u;  // FNV-1a
  for (unsigned char c : name) hash = (hash ^ c) * 16777619u;
  hash +=
      static_cast<uint32_t>(utime) + before * 0x9e3779b1u;  // the golden ratio's bits: far apart
  return static_cast<int64_t>(hash & 0x7fffffffu) << 20;
}

// Two callbacks that close each other's simulation do not wait for each other.
bool may_wait_for_callbacks() { return !CallbackQueue::any_runs_here() && !Bus::in_any_handler(); }

}  // namespace

Clock::time_point deadline_after(Duration time) {
  if (!(time.count() < 1e9)) return Clock::time_point::max();
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::max(time, Duration(0.0)));
}

std::string text_of(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", number);
  return text;
}

std::string text_of(Duration time) { return text_of(time.count()); }

Core::Core(const std::string& url, const std::string& name, std::unique_ptr<ServerProcess> server,
           std::unique_ptr<Transport> transport)
    : url_(url),
      server_(std::move(server)),
      regression_(server_ ? nullptr : ToRegression::at(url)),
      clock_(
          [this](int64_t utime, const Progress::Threads& woken) { progress_.use(utime, woken); }),
      watch_([this](int64_t run_id) { tell_another_server(run_id); }),
      session_(*this, name),
      stepper_(*this),
      bus_(transport ? std::move(transport) : open_transport(url)) {}

Core::~Core() { close(); }

void Core::join(Duration timeout) {
  const auto handler = [this](auto method) {
    return [self = weak_from_this(), method](const uint8_t* bytes, size_t size) {
      if (const auto core = self.lock()) method(*core, bytes, size);
    };
  };
  info_source_ = bus_.subscribe(
      "ruedo/info",
      handler([](Core& core, const uint8_t* bytes, size_t size) { core.on_info(bytes, size); }));
  tick_source_ = bus_.subscribe(
      "ruedo/tick",
      handler([](Core& core, const uint8_t* bytes, size_t size) { core.on_tick(bytes, size); }));
  reply_source_ =
      bus_.subscribe("ruedo/reply", handler([](Core& core, const uint8_t* bytes, size_t size) {
                       core.session_.on_reply(bytes, size);
                     }));
  bus_.start([self = weak_from_this()] {
    const auto core = self.lock();
    return core ? core->before_turn() : Bus::kTurnTime;
  });
  const Clock::time_point deadline = deadline_after(timeout);
  std::unique_lock lock(mutex_);
  while (!known_) {
    const Clock::time_point now = Clock::now();
    // Beside what cannot be read there may be what can.
    if (fault_ && now >= std::min(deadline, fault_at_ + kFaultTime)) std::rethrow_exception(fault_);
    if (server_) {
      if (const auto ended = server_->ended()) throw NoServer(*ended);
    }
    if (now >= deadline) {
      throw NoServer("no Ruedo server answered at " + url_ + " within " + text_of(timeout) +
                     " s. Is `ruedo run` started, with the same "
                     "--lcm or LCM_DEFAULT_URL? `ruedo doctor` looks for what is wrong");
    }
    ask_info();
    news_.wait_for(lock, std::chrono::milliseconds(100));
  }
  ids_ = ids_from(session_.name(), known_->utime, joined_before(known_->run_id));
  lock.unlock();
  const bool is_waited_for = server_ || regression_;
  if (is_waited_for || in_lockstep()) callbacks_.keep_all();
  if (is_waited_for && !in_lockstep()) {
    progress_.begin(
        [this](const std::string& line) {
          server_ ? server_->tell(line) : regression_->tell(line);
        },
        info()->epoch, utime());
  }
}

void Core::close() {
  if (forked_) return;
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    first = !closed_.exchange(true);
    wake_.notify_all();
    news_.notify_all();
  }
  if (!first) {
    if (may_wait_for_callbacks()) ended_.wait();
    return;
  }
  clock_.wake();
  callbacks_.stop();
  // In a callback, which is what the end waits for, another thread ends it.
  if (const auto self = weak_from_this().lock(); self && is_called_back() && ends_apart(self))
    return;
  end();
  await_callback();
}

bool Core::ends_apart(const std::shared_ptr<Core>& self) {
  try {
    auto under_way = std::make_unique<EndUnderWay>();
    std::thread([self, under_way = std::move(under_way)]() mutable {
      self->end();
      under_way = nullptr;  // the callback may be what ends the program
      self->await_callback();
    }).detach();
    return true;
  } catch (const std::system_error&) {
    return false;
  }
}

void Core::end() {
  if (repeater_.joinable()) repeater_.join();
  if (info()) session_.leave();
  bus_.stop();
  regression_.reset();
  if (server_) server_->end();
  bus_.close();
}

void Core::await_callback() {
  if (may_wait_for_callbacks()) callbacks_.await_call();
  end_.set_value();
}

void Core::check_open() const {
  if (forked_) throw NoServer(kForked);
  check_callbacks();
  if (closed_) throw NoServer(kClosed);
}

void Core::check_callbacks() const {
  if (!is_called_back()) faults_->rethrow();
}

void Core::check_may_wait() const {
  check_open();
  if (is_called_back())
    throw Error(
        "a callback cannot wait for the server, which may wait for it to return: make this call in "
        "another thread");
}

bool Core::is_called_back() const { return callbacks_.runs_here() || bus_.handling(); }

std::shared_ptr<const WorldInfo> Core::info() const {
  if (forked_) throw NoServer(kForked);
  std::lock_guard lock(mutex_);
  return known_;
}

bool Core::in_lockstep() const {
  return static_cast<uint64_t>(info()->features) >> request_t::GRANT & 1;
}

RobotInfo Core::robot_info(const std::string& name) const {
  const auto known = info();
  if (const RobotInfo* robot = known->robot(name)) return *robot;
  std::string names;
  for (const RobotInfo& robot : known->robots) names += (names.empty() ? "" : ", ") + robot.name;
  throw UnknownName("there is no robot '" + name + "'; there is " +
                    (names.empty() ? "none" : names));
}

std::shared_ptr<StreamCore> Core::stream(const ChannelInfo& channel, bool raw) {
  const std::lock_guard lock(mutex_);
  auto& stream = streams_[{channel.name, raw}];
  if (!stream || stream->type() != channel.type) {  // in the next run it may be another type
    stream = std::make_shared<StreamCore>(weak_from_this(), channel,
                                          raw ? raw_decoder() : find_decoder(channel.type),
                                          known_->step_us, faults_);
  }
  return stream;
}

std::shared_ptr<Driver> Core::driver(const std::string& robot) {
  check_open();
  const double watchdog = robot_info(robot).watchdog;
  const std::lock_guard lock(mutex_);
  auto& driver = drivers_[robot];
  if (!driver) driver = std::make_shared<Driver>(weak_from_this(), robot, watchdog);
  return driver;
}

void Core::keep_repeating(const std::shared_ptr<Driver>& driver) {
  const std::lock_guard lock(mutex_);
  repeating_.insert(driver);
  if (!repeater_.joinable() && !closed_)
    repeater_ = std::thread([this] { repeat(); });  // close() awaits its end
  wake_.notify_all();
}

void Core::repeat() {  // feeds the watchdogs in real time
  double period = 0.1;
  std::unique_lock lock(mutex_);
  while (!closed_) {
    wake_.wait_for(lock, std::chrono::duration<double>(period));
    const std::vector<std::shared_ptr<Driver>> drivers(repeating_.begin(), repeating_.end());
    lock.unlock();
    period = 0.1;
    for (const auto& driver : drivers) {
      if (!watch_.another()) driver->repeat(bus_);
      period = std::min(period, driver->period());
    }
    lock.lock();
  }
}

Subscription Core::on_new_run(std::function<void()> callback) {
  check_open();
  callbacks_.start();
  return Subscription(new_run_->add("a new run", std::move(callback)));
}

// Without the mutex. They repeat nothing any more.
void Core::end_drivers(const std::vector<std::shared_ptr<Driver>>& drivers, MotionReason reason) {
  {
    const std::lock_guard lock(mutex_);
    for (const auto& driver : drivers) repeating_.erase(driver);
  }
  for (const auto& driver : drivers) driver->end(reason);
}

// No command is repeated to a robot that is gone, nor to the next one of its name.
void Core::forget_removed(const WorldInfo& info) {
  std::set<std::string> channels;
  for (const ChannelInfo& channel : info.channel_list) channels.insert(channel.name);
  std::vector<std::shared_ptr<Driver>> drivers;
  std::vector<std::shared_ptr<StreamCore>> streams;
  {
    const std::lock_guard lock(mutex_);
    for (auto it = drivers_.begin(); it != drivers_.end();) {
      const bool gone = !info.robot(it->first);
      if (gone) drivers.push_back(it->second);
      it = gone ? drivers_.erase(it) : std::next(it);
    }
    for (auto it = streams_.begin(); it != streams_.end();) {
      const bool gone = !channels.count(it->first.first);
      if (gone) streams.push_back(it->second);
      it = gone ? streams_.erase(it) : std::next(it);
    }
  }
  end_drivers(drivers, MotionReason::removed);
  for (const auto& stream : streams) stream->end();
}

// The server was restarted, or another has taken its place.
void Core::begin_run() {
  watch_.begin();
  std::vector<std::shared_ptr<Driver>> drivers;
  std::vector<std::shared_ptr<StreamCore>> streams;
  {
    const std::lock_guard lock(mutex_);
    clock_.reset(known_->utime);
    for (const auto& [name, driver] : std::exchange(drivers_, {})) drivers.push_back(driver);
    for (const auto& [name, stream] : streams_) streams.push_back(stream);
  }
  end_drivers(drivers, MotionReason::new_run);
  for (const auto& stream : streams) stream->forget();
  is_over_ = false;
  std::fprintf(stderr, "ruedo: another run has begun at %s: commands are not repeated into it\n",
               url_.c_str());
  callbacks_.put([list = new_run_] { list->call(); }, "a new run");
}

void Core::note_use() {
  if (!is_called_back()) progress_.use(utime());
}

void Core::begin_after(int64_t utime) {
  const std::lock_guard lock(mutex_);
  ends_[std::this_thread::get_id()] = utime;
}

int64_t Core::not_before() const {
  const std::lock_guard lock(mutex_);
  const auto found = ends_.find(std::this_thread::get_id());
  return found == ends_.end() ? std::numeric_limits<int64_t>::min()
                              : std::min(found->second, utime());
}

void Core::sleep(int64_t duration) {
  check_may_wait();
  progress_.wait();
  Standstill standstill = this->standstill("sleep()");
  clock_.sleep(duration, [&] {
    check_server();
    standstill.look();
  });
}

Standstill Core::standstill(std::string call) {
  return {clock_, std::move(call),
          [this] { return why_it_stands([this] { return stepper_.whose_turn(); }); }};
}

std::string Core::why_it_stands(const std::function<std::string()>& in_lockstep) const {
  if (const double silence = clock_.silence(); silence > 3.0) {
    char text[96];
    std::snprintf(text, sizeof text, "nothing at all was heard from the server for %.1f s",
                  silence);
    return text;
  }
  if (info()->paused) return "the simulation is paused";
  return this->in_lockstep() ? in_lockstep() : "";
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

bool Core::server_has_ended() { return (server_ && server_->ended()) || !bus_.is_connected(); }

void Core::check_server() {
  check_open();
  if (is_over_) {
    const std::lock_guard lock(mutex_);
    throw RunEnded(over_);
  }
  if (server_) {
    if (const auto ended = server_->ended()) {
      if (server_->is_done()) throw RunEnded(*ended);
      throw NoServer(*ended);
    }
  }
  // A server on this machine that is stopped, or in a debugger, is waited for.
  if (clock_.silence() > kSilence && !is_there())
    throw NoServer("nothing was heard from the server at " + url_ + " for 5 s");
}

void Core::note_end(const std::string& text) {
  const std::lock_guard lock(mutex_);
  over_ = text + ", at " + url_;
  is_over_ = true;
}

bool Core::is_there() {
  const std::lock_guard lock(looking_);
  if (const auto now = Clock::now(); now >= look_at_) {
    there_ = is_claimed(url_);
    look_at_ = now + kLookTime;
  }
  return there_;
}

std::string Core::what_is_known(double rate) const {
  const double now = static_cast<double>(utime()) * 1e-6;
  char text[192];
  std::snprintf(text, sizeof text,
                "in lockstep, sim time advances only in step(), whose observations have the "
                "samples, as in sim.step(20).latest(robot.lrf()); it is at %.2f s",
                now);
  std::string why = why_it_stands([&] { return std::string(text); });
  if (!why.empty()) return why;
  if (rate == 0.0) return "it sends when something happens";
  std::snprintf(text, sizeof text, "its rate is %g Hz of sim time, which is now %.2f s", rate, now);
  return text;
}

// The receiving thread calls this before it waits; returns the longest time to wait.
std::chrono::milliseconds Core::before_turn() {
  if (const auto now = Clock::now(); server_ && now >= listen_at_) {
    listen_at_ = now + kListenTime;
    for (const std::string& line : server_->warnings())
      std::fprintf(stderr, "ruedo: the server: %s\n", line.c_str());
  }
  if (!progress_.in_use()) return Bus::kTurnTime;
  progress_.say();
  return kTurnInUse;
}

void Core::on_info(const uint8_t* bytes, size_t size) {
  const std::optional<int64_t> run_id = run_id_of(bytes, size);
  if (run_id && this->info() && !is_of_our_run(*run_id, true)) return;
  std::shared_ptr<const WorldInfo> info;
  std::exception_ptr fault;
  try {
    info = assembler_.add(bytes, size);
  } catch (const TypeMismatch&) {
    fault = std::current_exception();
  }
  std::shared_ptr<const WorldInfo> before;
  {
    const std::lock_guard lock(mutex_);
    before = known_;
    if (fault && !fault_) fault_at_ = Clock::now();
    if (fault) fault_ = fault;
    if (!fault) clock_.note_sign();
    if (info) {
      if (!before || info->epoch != before->epoch) clock_.reset(info->utime);
      known_ = info;
    }
  }
  news_.notify_all();
  if (!info) return;
  stepper_.on_info(info);
  if (before && info->epoch != before->epoch) {
    std::vector<std::shared_ptr<Driver>> drivers;
    {
      const std::lock_guard lock(mutex_);
      for (const auto& [name, driver] : drivers_) drivers.push_back(driver);
    }
    for (const auto& driver : drivers) driver->begin_epoch();
  }
  forget_removed(*info);
  if (before && info->run_id != before->run_id) begin_run();
}

void Core::on_tick(const uint8_t* bytes, size_t size) {
  if (size < 28) return;
  WireReader in(bytes, size);
  if (in.int64() != tick_t::getHash()) return;
  const int64_t utime = in.int64();
  if (!is_of_our_run(in.int64())) return;
  clock_.note_tick(utime);
  stepper_.on_tick(bytes, size);
  // Sim time may run a hundred times faster than real time: the watchdog is fed by its beat, too.
  std::vector<std::shared_ptr<Driver>> drivers;
  {
    const std::lock_guard lock(mutex_);
    drivers.assign(repeating_.begin(), repeating_.end());
  }
  for (const auto& driver : drivers) driver->repeat_at(utime, bus_);
  if (progress_.is_told()) note_progress(in.int32(), utime);
}

// All messages up to that time have arrived.
void Core::note_progress(int32_t epoch, int64_t utime) {
  if (callbacks_.is_idle()) return progress_.received(epoch, utime);
  callbacks_.put(
      [self = weak_from_this(), epoch, utime] {
        if (const auto core = self.lock()) core->progress_.received(epoch, utime);
      },
      "ticks");
}

bool Core::is_of_our_run(int64_t run_id, bool may_take_over) {
  const auto known = info();
  if (!known) return false;
  if (run_id == known->run_id) {
    watch_.hear_own();
    return true;
  }
  const bool is_over = watch_.hear_another(run_id) || is_over_;
  // Which of the two is there?
  if (Clock::now().time_since_epoch() - Clock::duration(asked_.load()) > kAskAgain) ask_info();
  return is_over && may_take_over;
}

void Core::tell_another_server(int64_t run_id) const {
  const auto known = info();
  std::fprintf(stderr,
               "ruedo: another server is at %s, too, with run %lld; this client is in run %lld, "
               "world %s. Their samples mix, and commands reach both: start one of them with "
               "another --lcm port (shown once)\n",
               url_.c_str(), static_cast<long long>(run_id), static_cast<long long>(known->run_id),
               known->world.c_str());
}

void Core::ask_info() {
  asked_ = Clock::now().time_since_epoch().count();
  request_t request{};
  request.epoch = -1;
  request.kind = request_t::INFO;
  bus_.publish(kRequestChannel, request);
}

}  // namespace ruedo::client
