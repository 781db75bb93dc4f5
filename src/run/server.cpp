// The publisher's loop, and the making of a simulation for each epoch.
#include "run/server.h"

#include <cfenv>

#include <spdlog/spdlog.h>

#include "physics/state_check.h"
#include "ruedo/applied_t.hpp"
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

}  // namespace

Server::Server(std::shared_ptr<const model::WorldModel> world, ServerOptions options, Bus& bus)
    : first_world_(std::move(world)),
      world_(first_world_),
      options_(std::move(options)),
      bus_(bus),
      run_id_(random_id()),
      channels_(options_.remaps),
      bus_sink_(bus),
      ticks_(publisher_, run_id_, options_.lockstep.clients > 0 ? Rate{} : engine::kTickRate, world_->step_us,
             [this](TickWriter& tick, int64_t step) { add_applied(tick, step); }),
      info_beat_(publisher_, world_->step_us, [this] { return pacer_->paused(); }),
      hashes_(publisher_, world_->step_us),
      watchdogs_(publisher_, world_->step_us, [this](size_t robot) { tell_watchdog(robot); }),
      worker_(models_, wakeup_, options_.before_model),
      control_(run_id_, {.execute = [this](const request_t& request, const Session& session) { return ask(request, session); },
                         .state = [this] { return engine::encoded(state()); },
                         .publish = [this](const reply_t& reply) { publisher_.service(own_.reply, reply); },
                         .utime = [this] { return publisher_.time_us(); },
                         .epoch = [this] { return epoch_; },
                         .state_comes = [this] { return !publisher_.latest() && (!lockstep_ || replay_ || lockstep_->begun()); },
                         .early = [this](const request_t& request, const Session& session) { return lockstep_ && (replay_ || lockstep_->early(request, session)); },
                         .left = [this](int64_t session) { if (lockstep_) lockstep_->leave(session); },
                         .keeps = [this](int64_t session) { return lockstep_ && lockstep_->counts_on(session); }}) {
  if (!options_.record.empty()) log_ = std::make_unique<LogSink>(options_.record);
  if (!options_.snapshots.empty()) journal_ = std::make_unique<Journal>(options_.snapshots);
  if (options_.watcher) watcher_ = std::make_unique<WatcherSink>(options_.watcher);
  if (options_.lockstep.clients > 0) {
    lockstep_ = std::make_unique<Lockstep>(options_.lockstep, [this](applied_t applied) {
      applied.utime = publisher_.time_us();
      applied.epoch = epoch_;
      publisher_.record(kAppliedChannel, applied);
    });
  }
  if (!options_.wait_for.empty()) wait_for_ = std::make_unique<WaitFor>(options_.wait_for, world_->step_us);
  if (!options_.repeat.empty()) begin_repeat(options_.repeat);
  make_simulation();
  channels_.check_remaps();
  add_sinks();
  if (publisher_.has_recorders() || replay_) {
    header_ = log::make_log_header(*world_, options_.simulation.fleet.seed, options_.result_options);
    header_.epoch = epoch_;
    publisher_.record(kHeaderChannel, header_);
    if (journal_) journal_->begin(header_, 0);
  }
  if (replay_ && !options_.end_with_repeat) log::check_same_run(replay_->header(), header_, options_.repeat);
}

Server::~Server() { bus_.stop(); }

// What is kept for lockstep is kept before the tick says so.
void Server::add_sinks() {
  publisher_.add(bus_sink_);
  if (log_) publisher_.add(*log_);
  if (journal_) publisher_.add(*journal_);
  if (watcher_) publisher_.add(*watcher_);
  if (lockstep_) publisher_.add(lockstep_->kept());
  publisher_.add(hashes_);
  publisher_.add(watchdogs_);
  publisher_.add(ticks_);
  publisher_.add(info_beat_);
}

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
    if (own_.request >= 0) request_channel_ = channels_[own_.request].bus_name;
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

  publisher_.begin_epoch(epoch_);
  announce();
}

void Server::announce() {
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
  publisher_.announce({channels_, own_, engine::make_world_info(head, *world_, simulation_->layout(), simulation_->devices(), channels_)});
}

void Server::receive(const std::string& channel, const uint8_t* data, size_t size) {
  if (!request_channel_.empty() && channel == request_channel_) {
    if (control_.receive(data, size)) wakeup_.set();
    return;
  }
  if (repeating_) return;
  const std::lock_guard lock(simulation_mutex_);
  if (wait_for_ && wait_for_->receive(channel, data, size)) return;
  simulation_->inbox().receive(channel, data, size);
}

void Server::run() {
  std::fesetenv(FE_DFL_ENV);    // as in the threads that compute: in lockstep this is one of them
  bus_sink_.listen([this](const std::string& channel, const uint8_t* data, size_t size) { receive(channel, data, size); });
  simulation_->start(*pacer_);
  repeat();
  Clock::time_point next_status = Clock::now() + kStatusPeriod;
  for (bool over = false; !over;) {
    if (stop_) simulation_->leave_off();
    while (const engine::Batch* batch = lockstep_ && lockstep_->full() && !stop_ ? nullptr : simulation_->take()) {
      publish(*batch);
      over |= simulation_->over();
      const Clock::time_point now = Clock::now();
      if (on_status_ && now >= next_status) on_status_(status()), next_status = now + kStatusPeriod;
      if (log_) log_->check(publisher_.time_us());
      repeat();
      if (!replay_) control_.published(publisher_.step());
      control_.serve();
      spawn_ready();
      publisher_.flush();
      if (stop_) simulation_->leave_off();
      if (lockstep_ && !lockstep_->full()) simulation_->go();
    }
    over |= simulation_->over();    // its last may have been taken before an edit, too
    if (over) break;
    control_.serve();
    spawn_ready();
    if (lockstep_) check_leases();
    if (lockstep_ && !lockstep_->full() && simulation_->go()) continue;
    if (!replay_) control_.published(publisher_.step());    // a PAUSE may wait for a state that was out already
    Clock::time_point deadline = next_status;
    // A sign of life each second, also while the run stands still, a step takes long, or a snapshot is restored.
    const Clock::time_point last_sign = std::max(info_beat_.last(), ticks_.last());
    if (Clock::now() >= last_sign + kPausedInfoPeriod) info_beat_.say();
    deadline = std::min(deadline, std::max(info_beat_.last(), ticks_.last()) + kPausedInfoPeriod);
    if (lockstep_) deadline = std::min(deadline, lockstep_->next_check());
    if (wait_for_ && !replay_) tell_wait();
    publisher_.flush();
    const bool woken = wakeup_.wait_until(deadline);
    if (!woken && Clock::now() >= next_status) {
      if (on_status_) on_status_(status());
      next_status = Clock::now() + kStatusPeriod;
    }
  }
  if (lockstep_) drain();
  control_.cancel("the run has ended");
  publisher_.record(kStateHashChannel, hashes_.now(true));
  if (log_) {
    log_->drain();
    log_->check(publisher_.time_us());
  }
  if (!simulation_->end().empty()) throw physics::StateError(simulation_->end());
}

void Server::check_leases() {
  for (const int64_t session : lockstep_->check_leases(control_.sessions().list(), Clock::now())) control_.drop(session);
}

void Server::drain() {
  lockstep_->end();
  while (!stop_ && !lockstep_->drained(control_.sessions().list(), Clock::now())) {
    publisher_.flush();
    wakeup_.wait_until(Clock::now() + kDrainPeriod);
    control_.serve();
  }
}

void Server::stop() {
  stop_ = true;
  wakeup_.set();
}

Status Server::status() const { return {publisher_.step(), publisher_.time_us(), publisher_.messages(), pacer_->paused()}; }

void Server::publish(const engine::Batch& batch) {
  for (int i = 0; i < batch.count; ++i) publish_step(batch, batch.snapshots[static_cast<size_t>(i)]);
}

void Server::publish_step(const engine::Batch& batch, const Snapshot& snapshot) {
  record_applied(batch, snapshot.step - 1);    // on the state before this one, whose messages are out
  publisher_.publish(*simulation_, batch, snapshot);
  if (lockstep_ && !replay_) lockstep_->published(snapshot.step);
  if (on_state_) on_state_(snapshot);
}

void Server::add_applied(TickWriter& tick, int64_t step) {
  const std::vector<Session>& sessions = control_.sessions().list();
  if (lockstep_) return lockstep_->add_applied(tick, step, sessions);
  for (const Session& session : sessions) tick.add_applied(session.client, session.last_sequence);
}

void Server::tell_watchdog(size_t index) {
  const model::ModelInstance& robot = world_->models[static_cast<size_t>(simulation_->layout().robots[index].instance)];
  spdlog::warn("{} was stopped by its watchdog: no command came for {:g} s of sim time. A velocity or wheel command "
               "wants repeating (this is said once)", robot.name, static_cast<double>(robot.model->drive->watchdog_us) * 1e-6);
}

void Server::record_applied(const engine::Batch& batch, int64_t step) {
  if (!publisher_.has_recorders()) return;
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
    publisher_.record(kAppliedChannel, applied);
  }
}

void Server::tell_wait() {
  if (publisher_.step() != wait_step_ || pacer_->paused()) {
    wait_step_ = publisher_.step();
    wait_begin_ = Clock::now();
    wait_told_ = false;
  }
  if (wait_told_ || Clock::now() < wait_begin_ + kPatience) return;
  const std::lock_guard lock(simulation_mutex_);
  const std::string missing = wait_for_->waits_for(publisher_.step());
  if (missing.empty()) return;
  wait_told_ = true;
  spdlog::warn("the run waits at step {} ({:g} s): --wait-for wants {}, and nothing came for a second. Does its sender run, and did it "
               "before this server started?", publisher_.step(), static_cast<double>(publisher_.time_us()) * 1e-6, missing);
}

}  // namespace ruedo::run
