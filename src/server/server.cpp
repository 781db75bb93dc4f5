// The publisher's loop, and the making of a simulation for each epoch.
#include "server/server.h"

#include <spdlog/spdlog.h>

#include "ruedo/applied_t.hpp"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/request_t.hpp"
#include "server/log_header.h"
#include "server/version.h"
#include "server/world_state.h"

namespace ruedo::server {
namespace {

constexpr auto kStatusPeriod = std::chrono::milliseconds(500);
constexpr auto kPausedInfoPeriod = std::chrono::seconds(1);

}  // namespace

Server::Server(std::shared_ptr<const model::WorldModel> world, ServerOptions options, Bus& bus)
    : world_(std::move(world)),
      options_(std::move(options)),
      bus_(bus),
      run_id_(random_id()),
      channels_(options_.remaps),
      tick_clock_(kTickRate, world_->step_us),
      info_clock_(kInfoRate, world_->step_us),
      control_(run_id_, {.execute = [this](const request_t& request, const Session&) { return execute(request); },
                         .state = [this] { return encoded(state()); },
                         .publish = [this](const reply_t& reply) { send(own_.reply, reply); },
                         .utime = [this] { return status_.time_us; },
                         .epoch = [this] { return epoch_; }}) {
  make_simulation();
  channels_.check_remaps();
  if (!options_.record.empty()) begin_log();
}

Server::~Server() { bus_.stop(); }

// Builds the world anew. What follows equals a fresh run: everything that has a state is made here.
void Server::make_simulation() {
  const bool paused = pacer_ ? pacer_->paused() : options_.paused;
  const double rate = pacer_ ? pacer_->rate() : options_.rate;
  {
    std::lock_guard lock(simulation_mutex_);
    simulation_.reset();
    channels_.clear();
    own_ = add_simulation_channels(channels_, options_.control);
    options_.simulation.fleet.epoch = epoch_;
    findings_ = Findings();
    simulation_ = std::make_unique<Simulation>(world_, options_.simulation, channels_, findings_, wakeup_);
  }
  const int64_t last_step = options_.duration_us < 0 ? std::numeric_limits<int64_t>::max() : options_.duration_us / world_->step_us;
  pacer_ = std::make_unique<Pacer>(world_->step_us, rate, last_step);
  if (paused) pacer_->pause();

  world_info_t head;
  head.utime = 0;
  head.run_id = run_id_;
  head.epoch = epoch_;
  head.version = version();
  head.world = world_->name;
  head.seed = static_cast<int64_t>(options_.simulation.fleet.seed);
  head.step_us = world_->step_us;
  head.features = options_.control ? features() : 0;
  head.paused = paused;
  info_ = make_world_info(head, *world_, simulation_->layout(), simulation_->devices(), channels_);
  sequences_.assign(channels_.list().size(), 0);
  next_tick_ = next_info_ = ticks_ = infos_ = 0;
  latest_ = nullptr;
}

void Server::begin_log() {
  log_ = std::make_unique<LogWriter>(options_.record);
  const log_header_t header = make_log_header(*world_, options_.simulation.fleet.seed, options_.result_options);
  record("ruedo/header", 0, header);
}

void Server::listen() {
  std::vector<std::string> inputs, outputs;
  const std::string request_channel = own_.request >= 0 ? channels_[own_.request].bus_name : "";
  for (const Channel& channel : channels_.list()) (channel.input ? inputs : outputs).push_back(channel.bus_name);
  bus_.listen(
      inputs,
      [this, request_channel](const std::string& channel, const uint8_t* data, size_t size) {
        if (channel == request_channel) {
          if (control_.receive(data, size)) wakeup_.set();
          return;
        }
        std::lock_guard lock(simulation_mutex_);
        simulation_->inbox().receive(channel, data, size);
      },
      outputs);
}

template <class Message>
void Server::send(int channel, const Message& message) {
  buffer_.resize(static_cast<size_t>(message.getEncodedSize()));
  message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  bus_.publish(channels_[channel].bus_name, buffer_.data(), buffer_.size());
  ++status_.messages;
}

template <class Message>
void Server::record(const std::string& channel, int64_t utime, const Message& message) {
  if (!log_) return;
  buffer_.resize(static_cast<size_t>(message.getEncodedSize()));
  message.encode(buffer_.data(), 0, static_cast<int>(buffer_.size()));
  log_->write(log_base_us_ + utime, channel, buffer_.data(), buffer_.size());
}

void Server::run() {
  listen();
  simulation_->start(*pacer_);
  Clock::time_point next_status = Clock::now() + kStatusPeriod;
  Clock::time_point next_flush = Clock::now() + kPausedInfoPeriod;
  for (bool over = false; !over;) {
    if (stop_) pacer_->stop();
    while (const Batch* batch = simulation_->take()) {
      publish(*batch);
      over = batch->last;
      const Clock::time_point now = Clock::now();
      if (on_status_ && now >= next_status) on_status_(status_), next_status = now + kStatusPeriod;
      if (log_ && now >= next_flush) log_->flush(), next_flush = now + kPausedInfoPeriod;
      check_log();
      control_.published(status_.step);
      control_.serve();
      if (stop_) pacer_->stop();
    }
    if (over) break;
    control_.serve();
    control_.published(status_.step);    // a PAUSE may wait for a state that was out already
    Clock::time_point deadline = next_status;
    if (pacer_->paused()) {
      if (Clock::now() >= last_info_ + kPausedInfoPeriod) publish_info();
      deadline = std::min(deadline, last_info_ + kPausedInfoPeriod);
    }
    const bool woken = wakeup_.wait_until(deadline);
    if (!woken && Clock::now() >= next_status) {
      status_.paused = pacer_->paused();
      if (on_status_) on_status_(status_);
      next_status = Clock::now() + kStatusPeriod;
    }
  }
  control_.cancel("the run has ended");
  if (log_) log_->flush();
  check_log();
}

void Server::stop() {
  stop_ = true;
  wakeup_.set();
}

void Server::command(const std::string& channel, const std::vector<uint8_t>& bytes) {
  std::lock_guard lock(simulation_mutex_);
  simulation_->inbox().receive(channel, bytes.data(), bytes.size());
}

void Server::check_log() const {
  if (log_ && !log_->error().empty()) {
    throw EnvironmentError("--record: " + log_->path() + ": " + log_->error() + ". The log is readable up to " +
                           std::to_string(status_.time_us / 1000000) + " s of sim time: make room, or record elsewhere");
  }
}

void Server::publish(const Batch& batch) {
  for (int i = 0; i < batch.count; ++i) publish_step(batch, batch.snapshots[static_cast<size_t>(i)]);
}

void Server::publish_step(const Batch& batch, const Snapshot& snapshot) {
  const int64_t step = snapshot.step;
  record_applied(batch, step - 1);    // on the state before this one, whose messages are out
  const bool tick = step == next_tick_;
  if (tick) tick_.begin(snapshot.time, run_id_, epoch_, step, state_hash(snapshot));
  simulation_->messages(batch, step, [&](int64_t, int index, const uint8_t* data, size_t size) {
    const Channel& channel = channels_[index];
    bus_.publish(channel.bus_name, data, size);
    if (log_) log_->write(log_base_us_ + snapshot.time, channel.bus_name, data, size);
    if (tick) tick_.add_message(index, sequences_[static_cast<size_t>(index)], data, size);
    ++sequences_[static_cast<size_t>(index)];
    ++status_.messages;
  });
  latest_ = &snapshot;
  status_.step = step;
  status_.time_us = snapshot.time;
  if (tick) {
    tell_watchdogs(snapshot);
    for (const Session& session : control_.sessions().list()) tick_.add_applied(session.client, session.last_sequence);
    tick_.finish([this](const tick_t& part) { send(own_.tick, part); });
    next_tick_ = tick_clock_.step_of(++ticks_);
  }
  if (step == next_info_) {
    publish_info();
    next_info_ = info_clock_.step_of(++infos_);
  }
}

void Server::tell_watchdogs(const Snapshot& snapshot) {
  watchdog_told_.resize(snapshot.robots.size(), false);
  for (size_t i = 0; i < snapshot.robots.size(); ++i) {
    if (snapshot.robots[i].motion.reason != motion_status_t::REASON_WATCHDOG || watchdog_told_[i]) continue;
    watchdog_told_[i] = true;
    const model::ModelInstance& robot = world_->models[static_cast<size_t>(simulation_->layout().robots[i].instance)];
    spdlog::warn("{} was stopped by its watchdog: no command came for {:g} s of sim time. A velocity or wheel command "
                 "wants repeating (this is said once)", robot.name, static_cast<double>(robot.model->drive->watchdog_us) * 1e-6);
  }
}

void Server::record_applied(const Batch& batch, int64_t step) {
  if (!log_) return;
  for (int i = 0; i < batch.applied_count; ++i) {
    const AppliedCommand& command = batch.applied[static_cast<size_t>(i)];
    if (command.step != step) continue;
    const Input& input = simulation_->inbox().inputs()[static_cast<size_t>(command.input)];
    applied_t applied;
    applied.step = step;
    applied.utime = step * world_->step_us;
    applied.epoch = epoch_;
    applied.sequence = 0;
    const bool request = input.kind == Input::Kind::reset_odometry;
    applied.channel = request ? "ruedo/request" : input.channel;
    applied.kind = request ? request_t::RESET_ODOMETRY : 0;
    applied.size = static_cast<int32_t>(command.bytes.size());
    applied.data = command.bytes;
    record("ruedo/applied", applied.utime, applied);
  }
}

void Server::publish_info() {
  const bool paused = pacer_->paused();
  for (world_info_t& part : info_) {
    part.utime = status_.time_us;
    part.paused = paused;
    send(own_.info, part);
  }
  last_info_ = Clock::now();
}

}  // namespace ruedo::server
