// The publisher's loop.
#include "run/run.h"

#include <algorithm>
#include <cfenv>
#include <cmath>
#include <thread>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/channel_names.h"
#include "log/header.h"
#include "physics/state_check.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/errors.h"
#include "ruedo/request_t.hpp"
#include "run/live.h"
#include "run/requests/request_table.h"

namespace ruedo::run {
namespace {

constexpr auto kStatusPeriod = std::chrono::milliseconds(500);
constexpr auto kPausedInfoPeriod = std::chrono::seconds(1);
constexpr auto kTickAgainPeriod = std::chrono::milliseconds(100);
// Steps that the publisher computes itself rather than wake another thread for them: it is waited
// for meanwhile.
constexpr int kFewGranted = 4, kFewAhead = 16;
constexpr auto kDrainPeriod = std::chrono::milliseconds(50);
// The last word goes out so often where it may be lost.
constexpr int kLastWords = 3;
constexpr auto kLastWordPeriod = std::chrono::milliseconds(20);

// record: writes joins and ended leases into the log.
std::unique_ptr<Mode> make_mode(const RunOptions& options, int64_t step_us,
                                std::function<void(applied_t)> record) {
  if (options.lockstep.clients > 0)
    return std::make_unique<Lockstep>(options.lockstep, std::move(record));
  return std::make_unique<Live>(options.wait_for, step_us);
}

}  // namespace

Run::Run(std::shared_ptr<const world::WorldModel> world, RunOptions options, Bus& bus)
    : first_world_(std::move(world)),
      world_(first_world_),
      options_(std::move(options)),
      bus_(bus),
      run_id_(random_id()),
      channels_(options_.remaps),
      backpressure_(world_->step_us),
      mode_(make_mode(options_, world_->step_us,
                      [this](applied_t applied) {
                        applied.utime = publisher_.time_us();
                        applied.epoch = epoch_;
                        publisher_.record(kAppliedChannel, applied);
                      })),
      wanted_{options_.rate, options_.paused},
      bus_sink_(bus, !mode_->takes_grants()),
      beats_{.hashes = {publisher_, world_->step_us},
             .watchdogs = {publisher_, world_->step_us,
                           [this](RobotIndex robot) -> const auto& { return instance_of(robot); }},
             .ticks = {publisher_, run_id_, mode_->takes_grants() ? Rate{} : engine::kTickRate,
                       world_->step_us,
                       [this](TickWriter& tick, int64_t step) {
                         mode().add_applied(tick, step, control_.sessions().list());
                       },
                       [this](int64_t step) { return launcher_wants_tick(step); }},
             .info = {publisher_, world_->step_us, [this] { return pacer_->paused(); }}},
      on_stall_(
          [](const std::string& reason) { spdlog::warn("the run makes no progress: {}", reason); }),
      worker_(models_, wakeup_, options_.before_model),
      control_(run_id_, control_host()),
      stall_watch_({.tell = [this](const std::string& reason) { on_stall_(reason); },
                    .takes_none = [this] { return takes_no_messages(); }}) {
  if (!options_.snapshots.empty()) journal_ = std::make_unique<Journal>(options_.snapshots);
  if (options_.edited || !options_.save.empty())
    edited_ = std::make_unique<EditedWorld>(*first_world_, options_.save);
  if (options_.watcher) watcher_ = std::make_unique<WatcherSink>(options_.watcher);
  if (!options_.repeat.empty()) {
    begin_repeat(std::make_unique<Repeating>(options_.repeat,
                                             options_.end_with_repeat ? nullptr : mode_.get()));
    epoch_ = repeating_->header().epoch;
  }
  make_world();
  channels_.check_remaps();
  if (!options_.record.empty())
    log_ = std::make_unique<LogSink>(options_.record, options_.record_limit);
  add_sinks();
  if (publisher_.has_recorders() || repeating_) {
    header_ =
        log::make_log_header(*world_, options_.simulation.fleet.seed, options_.result_options);
    header_made_ = true;
    header_.epoch = epoch_;
  }
  if (repeating_ && !options_.end_with_repeat)
    log::check_same_run(repeating_->header(), header_, options_.repeat);
}

Run::~Run() { bus_.stop(); }

// Not before run(): a refusal of the run until then leaves the log of an earlier one as it is.
void Run::begin_log() {
  if (!header_made_) return;
  if (log_)
    log_->begin([this] {
      if (stop_) throw EnvironmentError("--record: nobody reads " + options_.record);
    });
  publisher_.record(kHeaderChannel, header_);
  if (journal_) journal_->begin(header_, 0);
}

// The mode keeps messages for clients before the tick says that they were sent.
void Run::add_sinks() {
  publisher_.add(bus_sink_);
  if (log_) publisher_.add(*log_);
  if (journal_) publisher_.add(*journal_);
  if (watcher_) publisher_.add(*watcher_);
  if (Sink* sink = mode_->sink()) publisher_.add(*sink);
  publisher_.add(beats_.hashes);
  publisher_.add(beats_.watchdogs);
  publisher_.add(beats_.ticks);
  publisher_.add(beats_.info);
}

Control::Host Run::control_host() {
  return {.execute = [this](const request_t& request,
                            const Session& session) { return admit(request, session); },
          .state = [this] { return engine::encoded(state()); },
          .publish = [this](const reply_t& reply) { publisher_.service(own_.reply, reply); },
          .utime = [this] { return publisher_.time_us(); },
          .epoch = [this] { return epoch_; },
          .state_comes = [this] { return !publisher_.latest() && mode().state_comes(); },
          .early = [this](const request_t& request,
                          const Session& session) { return mode().early(request, session); },
          .left = [this](int64_t session) { mode_->left(session); },
          .keeps = [this](int64_t session) { return mode_->keeps(session); }};
}

void Run::on_message(const std::string& channel, const uint8_t* data, size_t size) {
  if (options_.hearer) options_.hearer(channel, data, size);
  if (!request_channel_.empty() && channel == request_channel_) {
    if (control_.on_request(data, size)) wakeup_.set();
    return;
  }
  const std::lock_guard lock(simulation_mutex_);
  if (!mode().on_message(channel, data, size)) simulation_->inbox().put(channel, data, size);
}

void Run::stop() {
  stop_ = true;
  wakeup_.set();
}

void Run::run() {
  std::fesetenv(FE_DFL_ENV);  // as in the threads that compute: in lockstep this is one of them
  bus_sink_.listen([this](const std::string& channel, const uint8_t* data, size_t size) {
    on_message(channel, data, size);
  });
  begin_log();
  tell_readers();
  begin_with_state();
  simulation_->start(*pacer_);
  take_turns();
  next_status_ = Clock::now() + kStatusPeriod;
  for (;;) {
    publish_what_is_ready();
    if (simulation_->over()) break;
    serve();
    const Clock::time_point next = attend();
    if (compute_here()) continue;
    if (!repeating_)
      control_.published(publisher_.step());  // a PAUSE may wait for a state that was out already
    publisher_.flush();
    stall_watch_.beat(StallWatch::At::rest);
    if (!wakeup_.wait_until(next)) tell_status();
  }
  finish();
}

void Run::publish_what_is_ready() {
  for (;;) {
    stall_watch_.beat(StallWatch::At::messages);
    if (stop_) simulation_->leave_off();
    const engine::Batch* batch = has_room() || stop_ ? simulation_->next_batch() : nullptr;
    if (!batch) return;
    publish(*batch);
    tell_status();
    if (log_) log_->check(publisher_.time_us());
    take_turns();
    if (!repeating_) control_.published(publisher_.step());
    serve();
    publisher_.flush();
    if (stop_) simulation_->leave_off();
    compute_here();
  }
}

// A tick lists the published samples: a client that has it has the samples before it.
bool Run::has_room() {
  if (!mode().has_room()) return false;
  if (backpressure_.has_room()) return true;
  if (beats_.ticks.told_us() != publisher_.time_us()) beats_.ticks.say();
  return false;
}

void Run::publish(const engine::Batch& batch) {
  for (int i = 0; i < batch.count; ++i) {
    const Snapshot& state = batch.snapshots[i];
    record_applied(batch, state.step - 1);  // on the state before this one, whose messages are out
    publisher_.publish(*simulation_, batch, state);
    if (on_state_) on_state_(state);
  }
  tell_readers();
  if (batch.count == 0) return;
  mode().published(publisher_.step());
  backpressure_.published(publisher_.time_us(), bus_sink_.bytes());
  stall_watch_.moved(Clock::now());
}

void Run::record_applied(const engine::Batch& batch, int64_t step) {
  if (!publisher_.has_recorders()) return;
  for (int i = 0; i < batch.applied_count; ++i) {
    const engine::AppliedCommand& command = batch.applied[i];
    if (command.step != step) continue;
    const engine::Input& input = simulation_->inbox().inputs()[command.input];
    applied_t applied;
    applied.step = step;
    applied.utime = step * world_->step_us;
    applied.epoch = epoch_;
    applied.sequence = 0;
    const bool request = input.kind == engine::Input::Kind::reset_odometry;
    applied.channel = request ? kRequestChannel : input.channel;
    applied.kind = request ? request_t::RESET_ODOMETRY : 0;
    applied.size = static_cast<int32_t>(command.bytes.size());
    applied.data = command.bytes;
    publisher_.record(kAppliedChannel, applied);
  }
}

void Run::tell_readers() {
  const uint64_t audience = publisher_.audience();
  if (audience == audience_) return;
  audience_ = audience;
  simulation_->set_read_channels(publisher_.read());
}

bool Run::compute_here() {
  const bool is_paced_by_clients = mode().takes_grants() || backpressure_.acts();
  if (!is_paced_by_clients || !mode().has_room() || !backpressure_.has_room()) return false;
  stall_watch_.beat(StallWatch::At::steps);
  return simulation_->go(mode().takes_grants() ? kFewGranted : kFewAhead);
}

void Run::serve() {
  stall_watch_.beat(StallWatch::At::messages);  // replies
  control_.serve();
  spawn_ready();
}

Run::Clock::time_point Run::attend() {
  const Clock::time_point now = Clock::now();
  // A sign of life each second, also while the run stands still, a step takes long, or a snapshot
  // is restored.
  const auto last_sign = [this] { return std::max(beats_.info.last(), beats_.ticks.last()); };
  if (now >= last_sign() + kPausedInfoPeriod) beats_.info.say();
  const Clock::time_point next_tick = attend_follower(now);
  Mode::Attended attended;
  {
    const std::lock_guard lock(simulation_mutex_);
    const Sessions& sessions = control_.sessions();
    attended = mode().attend(sessions.list(), publisher_.step(), sessions.listened());
  }
  for (const int64_t session : attended.dropped) control_.drop(session);
  if (pacer_->rests()) stall_watch_.moved(now);
  stall_watch_.idle(now, [this] { return why_idle(); });
  return std::min({next_status_, last_sign() + kPausedInfoPeriod, next_tick, attended.next});
}

// The run can go no further without an answer; in real time the answer is requested earlier.
bool Run::launcher_wants_tick(int64_t step) const {
  if (!backpressure_.acts() || repeating_) return false;
  const auto [at_any_rate, at_highest_rate] = backpressure_.limits();
  if (std::isinf(pacer_->rate())) return step >= std::min(at_any_rate, at_highest_rate);
  const SimTime since = step * world_->step_us - beats_.ticks.told_us();
  return step >= at_any_rate || since < 0 || since >= Backpressure::kMostAhead / 2;
}

// Ticks may be lost on the way to the program that the run waits for.
Run::Clock::time_point Run::attend_follower(Clock::time_point now) {
  if (!backpressure_.acts() || repeating_) return Clock::time_point::max();
  if (!waits_for_launcher() && backpressure_.has_room()) return Clock::time_point::max();
  if (now >= beats_.ticks.last() + kTickAgainPeriod) beats_.ticks.say();
  return beats_.ticks.last() + kTickAgainPeriod;
}

Status Run::status() const {
  return {publisher_.step(), publisher_.time_us(), publisher_.messages(), pacer_->paused(),
          repeating_ != nullptr};
}

void Run::tell_status() {
  const Clock::time_point now = Clock::now();
  if (now < next_status_) return;
  if (on_status_) on_status_(status());
  next_status_ = now + kStatusPeriod;
}

std::string Run::why_idle() {
  std::string who;
  {
    const std::lock_guard lock(simulation_mutex_);
    who = mode().waits_for(publisher_.step());
  }
  const bool starts = publisher_.step() < 0;  // as its program does, which may take seconds
  if (who.empty() && !starts && waits_for_launcher())
    who =
        "its program, which has not read the samples so far: is it stopped, or is a callback slow?";
  std::string why = who.empty() ? simulation_->at_work() : "it waits for " + who;
  if (why.empty()) return "";
  return starts ? why + " (before the first step)"
                : fmt::format("{} (the last step was {})", why, publisher_.step());
}

bool Run::waits_for_launcher() const {
  return backpressure_.acts() && !repeating_ && pacer_->is_limited();
}

std::string Run::takes_no_messages() const {
  return log_ && log_->waits() ? "the disk of --record does not take the log as fast as it grows"
                               : "the bus takes no messages";
}

const world::ModelInstance& Run::instance_of(RobotIndex robot) const {
  return world_->models[simulation_->layout().robots[robot].instance];
}

// Clients may still fetch what they have lost.
void Run::finish() {
  mode().end();
  while (!stop_ && !mode().finished(control_.sessions().list(), control_.sessions().listened())) {
    publisher_.flush();
    wakeup_.wait_until(Clock::now() + kDrainPeriod);
    control_.serve();
  }
  control_.cancel("the run has ended", reply_t::ENDED);
  publisher_.record(kStateHashChannel, beats_.hashes.at_end());
  publisher_.flush();
  if (log_) {
    log_->drain();
    log_->look_for_file();
    log_->check(publisher_.time_us());
  }
  if (!simulation_->end().empty()) throw physics::StateError(simulation_->end());
  say_ended();
}

// To the clients alone: of a run that was interrupted, or ended by itself, the log is the same.
void Run::say_ended() {
  reply_t last;
  last.utime = publisher_.time_us();
  last.run_id = run_id_;
  last.epoch = epoch_;
  last.session = last.sequence = 0;
  last.kind = 0;
  last.code = reply_t::ENDED;
  last.text = fmt::format("the run has ended at step {}", publisher_.step());
  last.size = 0;
  const std::vector<uint8_t> bytes = engine::encoded(last);
  for (int i = 0; i < (bus_.loses_messages() ? kLastWords : 1); ++i) {
    if (i > 0) std::this_thread::sleep_for(kLastWordPeriod);
    bus_.publish(kReplyChannel, bytes.data(), bytes.size());
    bus_.flush();
  }
}

}  // namespace ruedo::run
