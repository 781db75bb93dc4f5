// The loop: wait for the pace, take commands, step, pass on; and the ring of batches between
// threads.
#include "engine/simulation.h"

#include <algorithm>
#include <cfenv>
#include <chrono>
#include <stdexcept>

#include <pthread.h>
#include <sys/prctl.h>

#include "physics/state_check.h"
#include "system/enough_threads.h"

namespace ruedo::engine {
namespace {

constexpr size_t kMaxSnapshotMemory = 64u << 20;  // bytes of all batches together
constexpr int kModuleThreads = 12;                // and those of the run
constexpr int64_t kQuickNs =
    1'000'000;  // for which the publisher may wait for a step: it also sends the signs of life

// Large worlds gain nothing from many steps in flight, and have large snapshots.
int batch_steps(const world::BodyLayout& layout) {
  const size_t snapshot = sizeof(Snapshot) +
                          layout.bodies.size() * (sizeof(Pose) + sizeof(Twist) + sizeof(Vec3)) +
                          layout.wheels.size() * 16 + layout.joints.size() * 24 +
                          layout.robots.size() * sizeof(RobotState);
  return static_cast<int>(
      std::clamp<size_t>(kMaxSnapshotMemory / snapshot / Simulation::kBatches, 1, kMaxBatchSteps));
}

// TBB, with which Embree works too, waits for ever for a thread that could not be started. So those
// of TBB and of the modules have to be possible before the first of them is needed.
std::shared_ptr<Plan> plan_of(const world::WorldModel& world) {
  require_threads_for_cores(kModuleThreads);
  return std::make_shared<Plan>(world);
}

}  // namespace

Simulation::Simulation(std::shared_ptr<const world::WorldModel> world,
                       const SimulationOptions& options, Channels& channels, Findings& findings,
                       Wakeup& finished)
    : world_(plan_of(*world), options.fleet, channels, findings),
      before_batch_(options.before_batch),
      finished_(finished),
      batches_(kBatches) {
  const int steps = options.batch_steps > 0 ? options.batch_steps : batch_steps(layout());
  for (Batch& batch : batches_) batch.snapshots.resize(static_cast<size_t>(steps));
  fit_threads();
}

Simulation::~Simulation() {
  if (!thread_.joinable()) return;
  leave_off();
  while (!last_taken_) {  // the simulation thread needs free batches to finish
    if (!advance()) finished_.wait();
  }
  thread_.join();
}

void Simulation::start(Pace& pace) {
  pace_ = &pace;
  const SceneMakers makers = world_.scene_makers();
  started_ = true;
  for (auto& thread : threads_) thread->start(makers);
  thread_ = std::thread([this] { simulate(); });
}

void Simulation::fit_threads() {
  std::vector<std::unique_ptr<ModuleThread>> threads;
  for (auto& module : world_.modules()) {
    const auto known = std::find_if(threads_.begin(), threads_.end(), [&](const auto& thread) {
      return thread && &thread->module() == module.get();
    });
    threads.push_back(known == threads_.end()
                          ? std::make_unique<ModuleThread>(
                                *module, ModuleThread::Host{finished_, left_off_, before_batch_})
                          : std::move(*known));
  }
  threads_ = std::move(threads);
  cursors_.resize(threads_.size());
  for (Batch& batch : batches_) batch.outputs.resize(threads_.size());
  for (size_t m = 0; m < threads_.size(); ++m) {
    const auto pieces = static_cast<size_t>(threads_[m]->module().pieces());
    threads_[m]->set_index(m);
    cursors_[m].assign(pieces, 0);
    for (Batch& batch : batches_) {
      batch.outputs[m].pieces.resize(pieces);
      batch.outputs[m].woken = false;
    }
  }
}

InstanceIndex Simulation::add_model(const std::string& name, const Pose& X_WM,
                                    std::shared_ptr<const world::Model> model, int64_t step,
                                    Channels& channels, Findings& findings) {
  const InstanceIndex instance =
      world_.add_model(name, X_WM, std::move(model), step, channels, findings);
  fit_threads();
  if (!started_) return instance;
  try {
    const SceneMakers makers = world_.scene_makers();
    for (auto& thread : threads_)
      thread->running() ? thread->renew_scenes(makers) : thread->start(makers);
  } catch (...) {
    remove_model(instance, channels);
    throw;
  }
  return instance;
}

void Simulation::remove_model(InstanceIndex instance, Channels& channels) {
  world_.remove_model(instance, channels);
  fit_threads();
  if (!started_) return;
  const SceneMakers makers = world_.scene_makers();
  try {
    for (auto& thread : threads_) {
      if (thread->running()) thread->renew_scenes(makers);
    }
  } catch (const std::exception&
               error) {  // without its scene or renderer, a module would sample nothing, or crash
    throw SceneLost(std::string("cannot rebuild the sensors' scene after a change of the world: ") +
                    error.what());
  }
}

void Simulation::save(World& copy) const {
  copy.copy_from(world_);
  copy.inbox().clear();
}

void Simulation::restore(const World& copy, int epoch) {
  world_.copy_from(copy);
  world_.set_epoch(epoch);
}

void Simulation::simulate() {
  pthread_setname_np(pthread_self(), "kinematics");
  std::fesetenv(FE_DFL_ENV);
  prctl(PR_SET_TIMERSLACK, 1);  // ns: otherwise the kernel may wake us 50 us late
  const int limit = static_cast<int>(batches_[0].snapshots.size());
  for (int64_t first_step = 0;;) {
    const int count = pace_->wait(first_step, limit);
    Batch& batch = batches_[round_ % batches_.size()];
    while (batch.pending.load(std::memory_order_acquire) != Batch::kFree) batch_freed_.wait();
    if (before_batch_) before_batch_("kinematics");
    compute(batch, first_step, count);
    const bool last = batch.last;
    dispatch(batch, false);
    if (last) return;
  }
}

bool Simulation::go(int most) {
  int64_t first_step = 0;
  const int limit =
      step_ns_ > kQuickNs ? 0 : std::min(most, static_cast<int>(batches_[0].snapshots.size()));
  const int count = pace_->borrow(first_step, limit);
  if (count == 0) return false;
  Batch& batch = batches_[round_ % batches_.size()];
  if (batch.pending.load(std::memory_order_acquire) != Batch::kFree) {
    pace_->give_back(count);
    return false;
  }
  if (before_batch_) before_batch_("kinematics");
  compute(batch, first_step, count);
  dispatch(batch, true);
  pace_->give_back(0);
  return true;
}

void Simulation::set_read_channels(ReadChannels read) {
  auto changed = std::make_shared<const ReadChannels>(std::move(read));
  const std::lock_guard lock(read_mutex_);
  read_ = std::move(changed);
}

void Simulation::compute(Batch& batch, int64_t first_step, int count) {
  ++round_;
  batch.first_step = first_step;
  batch.count = count;
  batch.last = count == 0;
  batch.applied_count = 0;
  batch.end.clear();
  {
    const std::lock_guard lock(read_mutex_);
    batch.read = read_;
  }
  const auto begin = std::chrono::steady_clock::now();
  computing_.store(first_step, std::memory_order_relaxed);
  try {
    for (int i = 0; i < count && !batch.last; ++i) {
      if (left_off_)
        batch.count = 0;  // the publisher still holds the last state, in a batch that is free again
      if (batch.count == 0) break;
      try {
        world_.advance(first_step + i, batch.snapshots[i], batch);
      } catch (const physics::StateError& error) {  // the steps before it are valid
        batch.end = error.what();
        batch.count = i;
        batch.last = true;
      }
    }
  } catch (const std::exception& error) {
    if (!batch.failed.exchange(true))
      batch.failure = std::string("module kinematics: ") + error.what();
    batch.count = 0;
    batch.last = true;
  }
  computing_.store(-1, std::memory_order_relaxed);
  if (count > 0)
    step_ns_ = (std::chrono::steady_clock::now() - begin) / std::chrono::nanoseconds(count);
}

void Simulation::dispatch(Batch& batch, bool here) {
  const int64_t last_step = batch.first_step + batch.count - 1;
  int woken = 0;
  for (size_t m = 0; m < threads_.size(); ++m) {
    batch.outputs[m].woken = batch.count > 0 && threads_[m]->module().wants(batch);
    woken += batch.outputs[m].woken;
  }
  // One more than the modules: it is not finished before all have received it.
  batch.pending.store(woken + 1, std::memory_order_release);
  bool any_here = false;
  for (size_t m = 0; m < threads_.size(); ++m) {
    Batch::Output& output = batch.outputs[m];
    output.here = here && output.woken && threads_[m]->is_quick();
    any_here |= output.here;
    if (output.woken && !output.here) threads_[m]->hand_over(batch, last_step);
  }
  for (size_t m = 0; any_here && m < threads_.size(); ++m) {  // beside those that were woken
    if (batch.outputs[m].here) threads_[m]->work_here(batch, last_step);
  }
  if (batch.pending.fetch_sub(1, std::memory_order_acq_rel) == 1) finished_.set();
}

std::string Simulation::at_work() const {
  for (const auto& thread : threads_) {
    const Module& module = thread->module();
    if (!thread->has_batches()) continue;
    const int place = module.at_work();
    if (place < 0 || place >= module.devices())
      return "the module " + module.name() + " is computing";
    const Device& device = module.device(place);
    std::string name = device.name;
    if (device.robot.valid()) {
      const InstanceIndex instance = layout().robots[device.robot].instance;
      name = world().models[instance].name + "/" + name;
    }
    return "the module " + module.name() + " is computing " + name;
  }
  const int64_t step = computing_.load(std::memory_order_relaxed);
  return step < 0 ? "" : "step " + std::to_string(step) + " is being computed";
}

void Simulation::leave_off() {
  left_off_ = true;
  pace_->stop();
}

const Batch* Simulation::next_batch() {
  const Batch* batch = advance();
  if (batch && batch->failed) throw std::runtime_error(batch->failure);
  return batch;
}

const Batch* Simulation::advance() {
  Batch& batch = batches_[next_batch_ % batches_.size()];
  if (last_taken_ || batch.pending.load(std::memory_order_acquire) != 0) return nullptr;
  if (taken_) {
    taken_->pending.store(Batch::kFree, std::memory_order_release);
    batch_freed_.set();
  }
  if (left_off_) batch.count = 0;
  ++next_batch_;
  taken_ = &batch;
  last_taken_ = batch.last;
  if (!batch.end.empty()) end_ = batch.end;
  for (auto& cursors : cursors_) std::fill(cursors.begin(), cursors.end(), 0);
  return taken_;
}

}  // namespace ruedo::engine
