// TBB distributes the devices over cores in pieces that depend on the devices alone.
#include "engine/module.h"

#include <algorithm>

#include "engine/faults/sensor_faults.h"
#include "engine/parallel.h"

namespace ruedo::engine {
namespace {

// For all pieces together: less work is done before another thread wakes up, and TBB's threads keep
// looking for work for as long again, on a core that somebody else could use.
constexpr int64_t kQuickNs = 200'000;

}  // namespace

void DueSteps::add(const SampleClock& clock, int64_t first, int64_t sample) {
  // A thousand devices with one rate share an entry: the first few samples distinguish clocks well
  // enough, since a superfluous entry costs time but changes nothing.
  const auto same = [&](const Entry& entry) {
    return entry.first == first && entry.sample == sample &&
           entry.clock.every_step() == clock.every_step() &&
           entry.clock.step_of(0) == clock.step_of(0) &&
           entry.clock.step_of(1) == clock.step_of(1) &&
           entry.clock.step_of(1'000'003) == clock.step_of(1'000'003);
  };
  if (std::none_of(entries_.begin(), entries_.end(), same))
    entries_.push_back({clock, first, sample, first + clock.step_of(sample)});
  update();
}

void DueSteps::pass(int64_t step) {
  if (next_ > step) return;
  for (Entry& entry : entries_) {
    while (entry.step <= step) entry.step = entry.first + entry.clock.step_of(++entry.sample);
  }
  update();
}

void DueSteps::update() {
  next_ = INT64_MAX;
  for (const Entry& entry : entries_) next_ = std::min(next_, entry.step);
}

Module::Module(ModuleSetup setup) : setup_(std::move(setup)) {
  for (const Device& device : setup_.devices) slots_.push_back(slot_of(device));
  count_due();
}

Module::Slot Module::slot_of(const Device& device) const {
  const SampleClock clock(device.rate, setup_.step_us, device.phase_us);
  return {clock, 0, device.first_step + clock.step_of(0), device.sensor->observes(),
          device.visual_rays};
}

// From each device's due samples; every earlier batch has been passed on and finished.
void Module::count_due() {
  observes_ = false;
  to_hand_over_.clear();
  for (size_t i = 0; i < slots_.size(); ++i) {
    observes_ |= slots_[i].observes;
    to_hand_over_.add(slots_[i].clock, setup_.devices[i].first_step, slots_[i].sample);
  }
  to_sample_ = to_hand_over_;
}

void Module::add(ModuleSetup more) {
  for (Device& device : more.devices) {
    const auto after =
        std::find_if(setup_.devices.begin(), setup_.devices.end(),
                     [&](const Device& other) { return other.robot > device.robot; });
    slots_.insert(slots_.begin() + (after - setup_.devices.begin()), slot_of(device));
    setup_.wants_visual_rays |= device.visual_rays;
    setup_.devices.insert(after, std::move(device));
  }
  count_due();
}

void Module::remove(RobotIndex robot) {
  for (size_t i = setup_.devices.size(); i-- > 0;) {
    if (setup_.devices[i].robot != robot) continue;
    setup_.devices.erase(setup_.devices.begin() + static_cast<std::ptrdiff_t>(i));
    slots_.erase(slots_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  count_due();
}

void Module::replace_sensor(std::unique_ptr<Sensor> sensor) {
  setup_.devices[0].sensor = std::move(sensor);
}

void Module::reset_time(SimTime us) {
  for (size_t i = 0; i < slots_.size(); ++i) {
    setup_.devices[i].first_step = 0;
    setup_.devices[i].sensor->shift_time(us);
    slots_[i] = slot_of(setup_.devices[i]);
  }
  count_due();
}

// Scenes show the step looked at last, and depend on nothing earlier.
const Device* Module::copy_from(const Module& other) {
  for (size_t k = 0; k < slots_.size(); ++k) {
    Device& device = setup_.devices[k];
    const Device& there = other.setup_.devices[k];
    const bool keeps_nothing = setup_.wants_renderer && !slots_[k].observes;
    if (!keeps_nothing && !device.sensor->copy_from(*there.sensor)) return &device;
    device.first_step = there.first_step;
    device.random = there.random;
  }
  slots_ = other.slots_;
  to_hand_over_ = other.to_hand_over_;
  to_sample_ = other.to_sample_;
  return nullptr;
}

const Device* Module::exchange(StateArchive& archive) {
  for (size_t k = 0; k < slots_.size(); ++k) {
    Slot& slot = slots_[k];
    const Device& device = setup_.devices[k];
    const bool keeps_nothing = setup_.wants_renderer && !slot.observes;
    if (!keeps_nothing && !device.sensor->exchange_state(archive)) return &device;
    bool passed = slot.passed_over != nullptr;
    archive(slot.sample, slot.step, slot.passed_sample, slot.passed_seed, passed);
    if (!passed) continue;
    if (!slot.passed_over) slot.passed_over = std::make_unique<Snapshot>();
    archive(*slot.passed_over);
  }
  if (archive.reads()) count_due();
  return nullptr;
}

void Module::make_scenes(const SceneMakers& makers) {
  if (setup_.wants_rays) rays_ = makers.rays();
  if (setup_.wants_visual_rays) visual_rays_ = makers.visual_rays();
  if (!setup_.wants_renderer) return;
  renderer_.reset();  // one context at a time
  renderer_ = makers.renderer();
}

// Not only where a sample is due: a faulty device may let go at any step what it kept.
bool Module::looks_at_each_step(const Batch& batch) const {
  if (observes_ || !batch.sensor_faults) return observes_;
  return std::any_of(
      batch.sensor_faults->begin(), batch.sensor_faults->end(), [&](const SensorFault& fault) {
        return fault.begin < batch.first_step + batch.count && fault.end > batch.first_step &&
               std::any_of(setup_.devices.begin(), setup_.devices.end(), [&](const Device& device) {
                 return device.robot == fault.robot && device.name == fault.device;
               });
      });
}

void Module::process(const Batch& batch, Batch::Output& output, const std::atomic<bool>& left_off) {
  for (Outbox& outbox : output.pieces) outbox.clear();
  const int64_t end = batch.first_step + batch.count;
  const bool each_step = looks_at_each_step(batch);
  if (!rays_ && !visual_rays_ && (each_step || pieces() > 1)) {
    process_pieces(batch, output, 0, batch.count, left_off);
    to_sample_.pass(end - 1);
    return;
  }
  if (!rays_ && !visual_rays_) {  // one thread, and no device observes the steps between samples
    for (int64_t due = to_sample_.next(); due < end; due = to_sample_.next()) {
      const auto i = static_cast<int>(due - batch.first_step);
      if (i >= 0) process_pieces(batch, output, i, i + 1, left_off);
      to_sample_.pass(due);
    }
    return;
  }
  // The scene of the movers shows one step at a time, and only where a device looks.
  int begin = 0;
  for (int i = 0; i < batch.count; ++i) {
    if (to_sample_.next() != batch.first_step + i) continue;
    if (rays_) rays_->update(batch.snapshots[i]);
    if (visual_rays_) visual_rays_->update(batch.snapshots[i]);
    process_pieces(batch, output, begin, i + 1, left_off);
    begin = i + 1;
    to_sample_.pass(batch.first_step + i);
  }
  if (each_step && begin < batch.count) process_pieces(batch, output, begin, batch.count, left_off);
}

void Module::process_pieces(const Batch& batch, Batch::Output& output, int begin, int end,
                            const std::atomic<bool>& left_off) {
  const auto process_one = [&](int piece) {
    process_piece(batch, output.pieces[piece], piece, begin, end, left_off);
  };
  const auto timed = [&](int piece) {
    const auto before = std::chrono::steady_clock::now();
    process_one(piece);
    if (piece == 0) note_cost(std::chrono::steady_clock::now() - before);
  };
  const bool one_thread = renderer_ != nullptr;  // all that the renderer supports
  if (pieces() == 1 || one_thread || piece_ns_ < kQuickNs / pieces()) {
    for (int piece = 0; piece < pieces(); ++piece) timed(piece);
    return;
  }
  parallel_pieces(pieces(), timed);
}

// The last one, or the remainder of a longer one: samples are not due every time.
void Module::note_cost(std::chrono::nanoseconds of_piece) {
  piece_ns_ = std::max<int64_t>(of_piece.count(), piece_ns_ - piece_ns_ / 8);
}

SampleInput Module::input_of(const Slot& slot, const Snapshot& snapshot) const {
  return {snapshot, slot.sample, slot.visual_rays ? visual_rays_.get() : rays_.get(),
          renderer_.get()};
}

// The device itself is not affected: its output is changed afterwards.
void Module::sample_with_faults(const Batch& batch, const Snapshot& snapshot, size_t k,
                                Outbox& outbox) {
  Slot& slot = slots_[k];
  const Device& device = setup_.devices[k];
  const bool faulty = std::any_of(batch.sensor_faults->begin(), batch.sensor_faults->end(),
                                  [&](const SensorFault& fault) {
                                    return fault.acts_on(device.robot, device.name, snapshot.step);
                                  });
  Outbox own;
  own.begin_step(snapshot.step);
  Outbox& out = faulty ? own : outbox;
  if (slot.observes) device.sensor->observe(snapshot, out);
  if (slot.step == snapshot.step) take_sample(batch, snapshot, k, out);
  if (!faulty) return slot.faults.reset();
  if (!slot.faults) slot.faults = std::make_unique<FaultFilter>(setup_.step_us);
  slot.faults->pass(own, *batch.sensor_faults, device.robot, device.name, snapshot.step, outbox);
}

void Module::process_piece(const Batch& batch, Outbox& outbox, int piece, int begin, int end,
                           const std::atomic<bool>& left_off) {
  const size_t first = static_cast<size_t>(piece) * setup_.piece_size;
  const size_t last = std::min(first + setup_.piece_size, slots_.size());
  for (int i = begin; i < end; ++i) {
    const Snapshot& snapshot = batch.snapshots[i];
    outbox.begin_step(snapshot.step);
    for (size_t k = first; k < last; ++k) {
      Slot& slot = slots_[k];
      Sensor& sensor = *setup_.devices[k].sensor;
      at_work_.store(static_cast<int>(k), std::memory_order_relaxed);
      if (batch.reseedings) reseed(k, *batch.reseedings, snapshot.step);
      if (batch.sensor_faults) {
        sample_with_faults(batch, snapshot, k, outbox);
        continue;
      }
      if (slot.observes) sensor.observe(snapshot, outbox);
      if (slot.step != snapshot.step) continue;
      if (left_off.load(std::memory_order_relaxed))
        return;  // there may be a thousand pictures in the batch
      take_sample(batch, snapshot, k, outbox);
    }
  }
}

void Module::take_sample(const Batch& batch, const Snapshot& snapshot, size_t k, Outbox& out) {
  Slot& slot = slots_[k];
  if (is_read(k, batch.read.get(), batch.sensor_faults.get())) {
    setup_.devices[k].sensor->sample(input_of(slot, snapshot), out);
    slot.passed_sample = -1;
  } else {
    pass_over(k, snapshot);
  }
  slot.step = setup_.devices[k].first_step + slot.clock.step_of(++slot.sample);
}

// Only pictures may stay undrawn: their samples do not depend on earlier ones
// (SensorKind::needs_renderer), except in a faulty device.
bool Module::is_read(size_t k, const ReadChannels* read,
                     const std::vector<SensorFault>* faults) const {
  const Device& device = setup_.devices[k];
  if (!setup_.wants_renderer || !read || slots_[k].observes) return true;
  const auto is_of_it = [&](const SensorFault& fault) {
    return fault.robot == device.robot && fault.device == device.name;
  };
  if (faults && std::any_of(faults->begin(), faults->end(), is_of_it)) return true;
  return std::any_of(device.channels.begin(), device.channels.end(), [&](int channel) {
    return static_cast<size_t>(channel) >= read->size() || (*read)[channel];
  });
}

bool Module::needs_scenes(const ReadChannels* read, const std::vector<SensorFault>* faults) const {
  if (!setup_.wants_renderer) return true;
  for (size_t k = 0; k < slots_.size(); ++k) {
    if (is_read(k, read, faults)) return true;
  }
  return false;
}

void Module::reseed(size_t k, const std::vector<Reseeding>& reseedings, int64_t step) {
  auto& random = setup_.devices[k].random;
  const Reseeding* now = reseeding_at(reseedings, step);
  if (random && now && now->seed != random->seed()) random->reseed(now->seed);
}

void Module::pass_over(size_t k, const Snapshot& snapshot) {
  Slot& slot = slots_[k];
  if (!slot.passed_over) slot.passed_over = std::make_unique<Snapshot>();
  *slot.passed_over = snapshot;
  slot.passed_sample = slot.sample;
  if (const auto& random = setup_.devices[k].random) slot.passed_seed = random->seed();
}

void Module::catch_up(int channel, Outbox& out) {
  for (size_t k = 0; k < slots_.size(); ++k) {
    Slot& slot = slots_[k];
    const std::vector<int>& channels = setup_.devices[k].channels;
    if (slot.passed_sample < 0 ||
        std::find(channels.begin(), channels.end(), channel) == channels.end())
      continue;
    SampleInput input = input_of(slot, *slot.passed_over);
    input.sample = slot.passed_sample;
    out.begin_step(slot.passed_over->step);
    auto& random = setup_.devices[k].random;
    const uint64_t seed = random ? random->seed() : 0;
    if (random) random->reseed(slot.passed_seed);
    setup_.devices[k].sensor->sample(input, out);
    if (random) random->reseed(seed);
    slot.passed_sample = -1;
  }
}

}  // namespace ruedo::engine
