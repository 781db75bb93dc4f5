// The publisher's loop, and the making of a simulation for each epoch.
#include "run/server.h"

#include <cfenv>

#include <spdlog/spdlog.h>

#include "physics/state_check.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/request_t.hpp"
#include "log/header.h"
#include "core/version.h"
#include "engine/world_state.h"

namespace ruedo::run {
namespace {

constexpr auto kStatusPeriod = std::chrono::milliseconds(500);
constexpr auto kPausedInfoPeriod = std::chrono::seconds(1);
constexpr auto kDrainPeriod = std::chrono::milliseconds(50);
constexpr auto kPatience = std::chrono::seconds(1);
constexpr Rate kHashRate{1, 1};

}  // namespace

Server::Server(std::shared_ptr<const model::WorldModel> world, ServerOptions options, Bus& bus)
    : first_world_(std::move(world)),
      world_(first_world_),
      options_(std::move(options)),
      bus_(bus),
      run_id_(random_id()),
      channels_(options_.remaps),
      recorder_(options_.record, options_.snapshots, options_.watcher),
      tick_clock_(engine::kTickRate, world_->step_us),
      info_clock_(engine::kInfoRate, world_->step_us),
      hash_clock_(kHashRate, world_->step_us),
      worker_(models_, wakeup_, options_.before_model),
      control_(run_id_, {.execute = [this](const request_t& request, const Session& session) { return ask(request, session); },
                         .state = [this] { return engine::encoded(state()); },
                         .publish = [this](const reply_t& reply) { send(own_.reply, reply); },
                         .utime = [this] { return status_.time_us; },
                         .epoch = [this] { return epoch_; },
                         .state_comes = [this] { return !latest_ && (!lockstep_ || replay_ || lockstep_->begun()); },
                         .early = [this](const request_t& request, const Session& session) { return lockstep_ && (replay_ || lockstep_->early(request, session)); },
                         .left = [this](int64_t session) { if (lockstep_) lockstep_->leave(session); },
                         .keeps = [this](int64_t session) { return lockstep_ && lockstep_->counts_on(session); }}) {
  if (options_.lockstep.clients > 0) {
    lockstep_ = std::make_unique<Lockstep>(options_.lockstep, [this](applied_t applied) {
      applied.utime = status_.time_us;
      applied.epoch = epoch_;
      recorder_.applied(applied);
    });
  }
  if (!options_.wait_for.empty()) wait_for_ = std::make_unique<WaitFor>(options_.wait_for, world_->step_us);
  if (!options_.repeat.empty()) begin_repeat(options_.repeat);
  make_simulation();
  channels_.check_remaps();
  if (recorder_.wants_messages() || recorder_.has_journal() || replay_) {
    header_ = log::make_log_header(*world_, options_.simulation.fleet.seed, options_.result_options);
    header_.epoch = epoch_;
    recorder_.begin(header_);
  }
  if (replay_ && !options_.end_with_repeat) log::check_same_run(replay_->header(), header_, options_.repeat);
}

Server::~Server() { bus_.stop(); }

// Builds the world anew. What follows equals a fresh run: everything that has a state is made here.
void Server::make_simulation() {
  const bool paused = replay_ ? false : pacer_ ? pacer_->paused() : options_.paused;
  const double rate = replay_ ? std::numeric_limits<double>::infinity() : pacer_ ? pacer_->rate() : options_.rate;
  {
    std::lock_guard lock(simulation_mutex_);
    if (wait_for_) wait_for_->detach();
    simulation_.reset();
    world_ = first_world_;
    channels_.clear();
    own_ = engine::add_simulation_channels(channels_, options_.control);
    options_.simulation.fleet.epoch = epoch_;
    findings_ = Findings();
    simulation_ = std::make_unique<engine::Simulation>(world_, options_.simulation, channels_, findings_, wakeup_);
  }
  const int64_t last_step = options_.duration_us < 0 ? std::numeric_limits<int64_t>::max() : options_.duration_us / world_->step_us;
  pacer_ = std::make_unique<Pacer>(world_->step_us, rate, last_step);
  if (paused) pacer_->pause();
  if (replay_) pacer_->set_limit(-1);
  if (wait_for_ && !replay_) {
    const std::lock_guard lock(simulation_mutex_);
    wait_for_->attach(channels_, simulation_->inbox(), *pacer_, 0);
  }
  if (lockstep_) lockstep_->attach(simulation_->inbox(), *pacer_);

  make_info();
  sequences_.assign(channels_.list().size(), 0);
  next_tick_ = next_info_ = next_hash_ = ticks_ = infos_ = hashes_ = 0;
  latest_ = nullptr;
}

void Server::make_info() {
  world_info_t head;
  head.utime = 0;
  head.run_id = run_id_;
  head.epoch = epoch_;
  head.version = version();
  head.world = world_->name;
  head.seed = static_cast<int64_t>(options_.simulation.fleet.seed);
  head.step_us = world_->step_us;
  head.features = options_.control ? features() : 0;
  head.paused = pacer_->paused();
  info_ = engine::make_world_info(head, *world_, simulation_->layout(), simulation_->devices(), channels_);
}

void Server::listen() {
  std::vector<std::string> inputs, outputs;
  const std::string request_channel = own_.request >= 0 ? channels_[own_.request].bus_name : "";
  for (const engine::Channel& channel : channels_.list()) (channel.input ? inputs : outputs).push_back(channel.bus_name);
  bus_.listen(
      inputs,
      [this, request_channel](const std::string& channel, const uint8_t* data, size_t size) {
        if (channel == request_channel) {
          if (control_.receive(data, size)) wakeup_.set();
          return;
        }
        if (repeating_) return;
        std::lock_guard lock(simulation_mutex_);
        if (wait_for_ && wait_for_->receive(channel, data, size)) return;
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

void Server::run() {
  std::fesetenv(FE_DFL_ENV);    // as in the threads that compute: in lockstep this is one of them
  listen();
  simulation_->start(*pacer_);
  last_tick_ = Clock::now();
  repeat();
  Clock::time_point next_status = Clock::now() + kStatusPeriod;
  Clock::time_point next_flush = Clock::now() + kPausedInfoPeriod;
  for (bool over = false; !over;) {
    if (stop_) simulation_->leave_off();
    while (const engine::Batch* batch = lockstep_ && lockstep_->full() && !stop_ ? nullptr : simulation_->take()) {
      publish(*batch);
      over |= simulation_->over();
      const Clock::time_point now = Clock::now();
      if (on_status_ && now >= next_status) on_status_(status_), next_status = now + kStatusPeriod;
      if (now >= next_flush) recorder_.flush(), next_flush = now + kPausedInfoPeriod;
      recorder_.check(status_.time_us);
      repeat();
      if (!replay_) control_.published(status_.step);
      control_.serve();
      spawn_ready();
      bus_.flush();
      if (stop_) simulation_->leave_off();
      if (lockstep_ && !lockstep_->full()) simulation_->go();
    }
    over |= simulation_->over();    // its last may have been taken before an edit, too
    if (over) break;
    control_.serve();
    spawn_ready();
    if (lockstep_) check_leases();
    if (lockstep_ && !lockstep_->full() && simulation_->go()) continue;
    if (!replay_) control_.published(status_.step);    // a PAUSE may wait for a state that was out already
    Clock::time_point deadline = next_status;
    // A sign of life each second, also while the run stands still, a step takes long, or a snapshot is restored.
    const Clock::time_point last_sign = std::max(last_info_, last_tick_);
    if (Clock::now() >= last_sign + kPausedInfoPeriod) publish_info();
    deadline = std::min(deadline, std::max(last_info_, last_tick_) + kPausedInfoPeriod);
    if (lockstep_) deadline = std::min(deadline, lockstep_->next_check());
    if (wait_for_ && !replay_) tell_wait();
    bus_.flush();
    const bool woken = wakeup_.wait_until(deadline);
    if (!woken && Clock::now() >= next_status) {
      status_.paused = pacer_->paused();
      if (on_status_) on_status_(status_);
      next_status = Clock::now() + kStatusPeriod;
    }
  }
  if (lockstep_) drain();
  control_.cancel("the run has ended");
  recorder_.state_hash(hash_of_state(true));
  recorder_.flush();
  recorder_.check(status_.time_us);
  if (!simulation_->end().empty()) throw physics::StateError(simulation_->end());
}

void Server::check_leases() {
  for (const int64_t session : lockstep_->check_leases(control_.sessions().list(), Clock::now())) control_.drop(session);
}

void Server::drain() {
  lockstep_->end();
  while (!stop_ && !lockstep_->drained(control_.sessions().list(), Clock::now())) {
    bus_.flush();
    wakeup_.wait_until(Clock::now() + kDrainPeriod);
    control_.serve();
  }
}

void Server::stop() {
  stop_ = true;
  wakeup_.set();
}

void Server::command(const std::string& channel, const std::vector<uint8_t>& bytes) {
  std::lock_guard lock(simulation_mutex_);
  if (wait_for_ && wait_for_->receive(channel, bytes.data(), bytes.size())) return;
  simulation_->inbox().receive(channel, bytes.data(), bytes.size());
}

void Server::publish(const engine::Batch& batch) {
  for (int i = 0; i < batch.count; ++i) publish_step(batch, batch.snapshots[static_cast<size_t>(i)]);
}

void Server::publish_step(const engine::Batch& batch, const Snapshot& snapshot) {
  const int64_t step = snapshot.step;
  record_applied(batch, step - 1);    // on the state before this one, whose messages are out
  const bool aloud = !replay_, recorded = recorder_.wants_messages();
  if (lockstep_ && aloud) lockstep_->begin_step(step);
  const bool tick = lockstep_ || step == next_tick_;
  if (tick) tick_.begin(snapshot.time, run_id_, epoch_, step, engine::state_hash(snapshot));
  simulation_->messages(batch, step, [&](int64_t, int index, const uint8_t* data, size_t size) {
    const engine::Channel& channel = channels_[index];
    if (aloud) bus_.publish(channel.bus_name, data, size);
    if (recorded) recorder_.message(snapshot.time, channel.bus_name, data, size);
    if (tick) tick_.add_message(index, sequences_[static_cast<size_t>(index)], data, size);
    if (lockstep_ && aloud) lockstep_->keep(index, sequences_[static_cast<size_t>(index)], data, size);
    ++sequences_[static_cast<size_t>(index)];
    ++status_.messages;
  });
  latest_ = &snapshot;
  if (on_state_) on_state_(snapshot);
  status_.step = step;
  status_.time_us = snapshot.time;
  if (step == next_hash_) {
    if (recorded) recorder_.state_hash(hash_of_state(false));
    next_hash_ = hash_clock_.step_of(++hashes_);
  }
  if (tick) {
    if (aloud) tell_watchdogs(snapshot);
    if (aloud) finish_tick(step), last_tick_ = Clock::now();
    next_tick_ = tick_clock_.step_of(++ticks_);
  }
  if (step == next_info_) {
    if (aloud) publish_info();
    next_info_ = info_clock_.step_of(++infos_);
  }
}

void Server::finish_tick(int64_t step) {
  const std::vector<Session>& sessions = control_.sessions().list();
  if (!lockstep_) {
    for (const Session& session : sessions) tick_.add_applied(session.client, session.last_sequence);
    return tick_.finish([this](const tick_t& part) { send(own_.tick, part); });
  }
  lockstep_->add_applied(tick_, step, sessions);
  tick_.finish([this](const tick_t& part) {
    send(own_.tick, part);
    lockstep_->keep(own_.tick, part.part, buffer_.data(), buffer_.size());
  });
  lockstep_->published(step);
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

void Server::record_applied(const engine::Batch& batch, int64_t step) {
  if (!recorder_.wants_messages() && !recorder_.has_journal()) return;
  for (int i = 0; i < batch.applied_count; ++i) {
    const engine::AppliedCommand& command = batch.applied[static_cast<size_t>(i)];
    if (command.step != step) continue;
    const engine::Input& input = simulation_->inbox().inputs()[static_cast<size_t>(command.input)];
    applied_t applied;
    applied.step = step;
    applied.utime = step * world_->step_us;
    applied.epoch = epoch_;
    applied.sequence = 0;
    const bool request = input.kind == engine::Input::Kind::reset_odometry;
    applied.channel = request ? "ruedo/request" : input.channel;
    applied.kind = request ? request_t::RESET_ODOMETRY : 0;
    applied.size = static_cast<int32_t>(command.bytes.size());
    applied.data = command.bytes;
    recorder_.applied(applied);
  }
}

state_hash_t Server::hash_of_state(bool last) const {
  state_hash_t hash;
  hash.utime = status_.time_us;
  hash.step = status_.step;
  hash.epoch = epoch_;
  hash.state_hash = latest_ ? engine::state_hash(*latest_) : 0;    // a run may end before its first state
  hash.last = last;
  return hash;
}

void Server::tell_wait() {
  if (status_.step != wait_step_ || pacer_->paused()) {
    wait_step_ = status_.step;
    wait_begin_ = Clock::now();
    wait_told_ = false;
  }
  if (wait_told_ || Clock::now() < wait_begin_ + kPatience) return;
  const std::lock_guard lock(simulation_mutex_);
  const std::string missing = wait_for_->waits_for(status_.step);
  if (missing.empty()) return;
  wait_told_ = true;
  spdlog::warn("the run waits at step {} ({:g} s): --wait-for wants {}, and nothing came for a second. Does its sender run, and did it "
               "before this server started?", status_.step, static_cast<double>(status_.time_us) * 1e-6, missing);
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

}  // namespace ruedo::run
