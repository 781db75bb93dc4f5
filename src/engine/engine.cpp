// Each copy is computed by one task, including its modules; arrays are written by the task of the
// copy that they show.
#include "engine/engine.h"

#include <algorithm>
#include <cctype>
#include <cfenv>
#include <cmath>
#include <cstring>
#include <exception>
#include <limits>
#include <stdexcept>
#include <utility>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>

#include "engine/markers.h"
#include "engine/outcome.h"
#include "engine/parallel.h"
#include "engine/world_state.h"
#include "ruedo/errors.h"
#include "ruedo/velocity_command_t.hpp"
#include "system/enough_threads.h"

namespace ruedo::engine {
namespace {

const std::atomic<bool> kNeverLeftOff{false};
constexpr int64_t kStepsAtOnce = 200;  // between looks at whether step() may continue

// Sets rounding and denormal modes as in every computing thread, whatever the caller's program
// uses; restores them at the end.
class DefaultFloatingPoint {
 public:
  DefaultFloatingPoint() {
    std::fegetenv(&before_);
    std::fesetenv(FE_DFL_ENV);
  }
  ~DefaultFloatingPoint() { std::fesetenv(&before_); }

 private:
  std::fenv_t before_;
};

bool same_name(const std::string& a, const std::string& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](unsigned char x, unsigned char y) {
    return std::tolower(x) == std::tolower(y);
  });
}

// A file that is read otherwise than it is written gives another world.
void refuse_errors(const world::WorldModel& model) {
  for (const Finding& finding : model.findings) {
    if (finding.kind == Finding::Kind::error)
      throw InputError(finding.source, finding.element + ": " + finding.text);
  }
}

}  // namespace

struct Engine::Arena {
  tbb::task_arena tasks;
  // Scratch memory for computing a copy's steps, not read after step(): snapshots and messages. It
  // belongs to the thread, so that it stays in the cache even with many copies; there may be more
  // than one, because TBB may let a waiting thread start with another copy.
  tbb::enumerable_thread_specific<std::vector<std::unique_ptr<Batch>>> spare;
};

// Borrows one of the thread's batches.
class Engine::Borrowed {
 public:
  Borrowed(Arena& arena, const World& world) : spare_(arena.spare.local()) {
    if (spare_.empty()) {
      batch_ = std::make_unique<Batch>();
      batch_->snapshots.resize(kMaxBatchSteps);
    } else {
      batch_ = std::move(spare_.back());
      spare_.pop_back();
    }
    batch_->outputs.resize(world.modules().size());
    for (size_t m = 0; m < world.modules().size(); ++m)
      batch_->outputs[m].pieces.resize(static_cast<size_t>(world.modules()[m]->pieces()));
  }
  ~Borrowed() { spare_.push_back(std::move(batch_)); }

  Batch& operator*() { return *batch_; }

 private:
  std::vector<std::unique_ptr<Batch>>& spare_;
  std::unique_ptr<Batch> batch_;
};

struct Engine::Copy {
  std::shared_ptr<const world::WorldModel> model;  // before any draws
  uint64_t seed = 1;                               // with which it was created
  world::Drawn drawn;
  std::shared_ptr<Plan> plan;
  Channels channels;
  std::unique_ptr<World> world;
  int64_t step = -1;                         // of the current state
  bool sound = true;                         // no call failed since it was made
  bool driven = false;                       // velocities_ has rows that are not in its inbox yet
  std::vector<bool> scenes_made;             // for each module
  std::vector<std::vector<uint8_t>> newest;  // the newest message of each channel; empty: none yet
  struct Place {
    const Outbox* outbox;
    const Outbox::Entry* entry;
  };
  std::vector<Place> places;  // of the newest messages of a batch
  // For each driven robot, the links that it ran into during the last step(), in order.
  std::vector<std::vector<LinkIndex>> met;

  void make_scenes(const ReadChannels* read, const std::vector<SensorFault>* faults = nullptr);
  void keep_newest(const Batch& batch);
  void copy_from(const Copy& other);
};

class SavedWorld {
 public:
  std::shared_ptr<const char> engine;  // identity of the engine
  std::unique_ptr<Engine::Copy> copy;  // never stepped
  std::vector<int32_t> touching;       // the saved row
};

struct Engine::Observer {
  std::string device, field;
  FieldReader reader;
  std::vector<int> channels;  // of the robots, in order
  std::shared_ptr<FieldArray> array = std::make_shared<FieldArray>();
  size_t count = 0;  // values per robot
};

Engine::Engine(std::shared_ptr<const world::WorldModel> world, EngineOptions options)
    : world_(std::move(world)), options_(std::move(options)), arena_(std::make_unique<Arena>()) {
  if (options_.worlds < 1)
    throw InputError({}, "an engine has 1 world or more, not " + std::to_string(options_.worlds));
  require_threads_for_cores(0);                        // TBB's: see simulation.cpp
  const int cores = tbb::info::default_concurrency();  // for more, TBB prints a warning
  arena_->tasks.initialize(options_.threads > 0 ? std::min(options_.threads, cores) : cores);
  const DefaultFloatingPoint floating_point;
  copies_.resize(static_cast<size_t>(options_.worlds));
  copies_[0] = make_copy(
      world_, options_.fleet.seed);  // the first one reports errors, and builds what all share
  first_made_ = true;
  read_ = std::make_shared<const ReadChannels>(copies_[0]->channels.list().size(), false);
  choose_read();
  for_each(copies_.size(), [this](size_t i) {
    if (i > 0) copies_[i] = make_copy(world_, options_.fleet.seed + i);
  });
  const auto& inputs = copies_[0]->world->inbox().inputs();
  for (const InputIndex i : inputs.indices()) {
    if (inputs[i].kind != Input::Kind::velocity) continue;
    const InstanceIndex instance = copies_[0]->world->layout().robots[inputs[i].robot].instance;
    driven_.push_back(world_->models[instance].name);
    velocity_inputs_.push_back(i);
    driven_robots_.push_back(inputs[i].robot);
  }
  touching_->type = Primitive::int32;
  touching_->shape = {options_.worlds, static_cast<int64_t>(driven_.size())};
  touching_->values.resize(copies_.size() * driven_.size() * sizeof(int32_t));
  for_each(copies_.size(), [this](size_t i) {
    forget_touching(i);
    compute(i, 1);
  });
}

Engine::~Engine() = default;

std::unique_ptr<Engine::Copy> Engine::make_copy(std::shared_ptr<const world::WorldModel> model,
                                                uint64_t seed, World* ended) {
  auto copy = std::make_unique<Copy>();
  FleetOptions fleet = options_.fleet;
  fleet.seed = seed;
  Findings findings;
  const bool own = !options_.draws.empty();
  copy->plan = own ? std::make_shared<Plan>(*randomized(*model, options_.draws, seed, &copy->drawn))
                   : plan_of(model);
  copy->world = std::make_unique<World>(copy->plan, fleet, copy->channels,
                                        first_made_ ? findings : findings_, ended);
  copy->model = std::move(model);
  copy->seed = seed;
  return copy;
}

// The initial state.
std::unique_ptr<Engine::Copy> Engine::make_another(const Copy& copy) const {
  auto other = std::make_unique<Copy>();
  FleetOptions fleet = options_.fleet;
  fleet.seed = copy.seed;
  Findings findings;
  other->model = copy.model;
  other->seed = copy.seed;
  other->drawn = copy.drawn;
  other->plan = copy.plan;
  other->world = std::make_unique<World>(other->plan, fleet, other->channels, findings);
  return other;
}

std::shared_ptr<Plan> Engine::plan_of(const std::shared_ptr<const world::WorldModel>& model) {
  const std::lock_guard lock(shared_mutex_);
  std::erase_if(shared_, [](const auto& each) { return each.second.plan.expired(); });
  Shared& shared = shared_[model.get()];
  auto plan = shared.model.lock() == model ? shared.plan.lock() : nullptr;
  if (!plan) {
    plan = std::make_shared<Plan>(*model);
    shared = {model, plan};
  }
  return plan;
}

void Engine::for_each(size_t count, const std::function<void(size_t)>& body) {
  if (handler_ || state_handler_ || count == 1) {
    FirstFailure failure;
    for (size_t i = 0; i < count; ++i) failure.call(body, static_cast<int>(i));
    return failure.rethrow();
  }
  arena_->tasks.execute([&] {
    parallel_pieces(static_cast<int>(count), [&](int i) {
      const DefaultFloatingPoint floating_point;
      body(static_cast<size_t>(i));
    });
  });
}

void Engine::forget_touching(size_t index) {
  std::fill_n(reinterpret_cast<int32_t*>(touching_->values.data()) + index * driven_.size(),
              driven_.size(), 0);
  std::vector<std::vector<LinkIndex>>& met = copies_[index]->met;
  met.resize(driven_.size());
  for (std::vector<LinkIndex>& one : met) one.clear();
}

void Engine::compute(size_t index, int64_t steps) {
  Copy& copy = sound_copy(index);
  copy.sound = false;
  const std::exception_ptr handlers = compute(index, copy, steps);
  copy.sound = true;
  if (handlers) std::rethrow_exception(handlers);
}

Engine::Copy& Engine::sound_copy(size_t index) const {
  Copy& copy = *copies_.at(index);
  if (!copy.sound)
    throw std::runtime_error("world " + std::to_string(index) +
                             " failed in an earlier call: reset or restore it");
  return copy;
}

// Returns a handler's exception; then the handler gets no further call, and the steps are still
// computed.
std::exception_ptr Engine::compute(size_t index, Copy& copy, int64_t steps) {
  std::exception_ptr handlers;
  World& world = *copy.world;
  Borrowed borrowed(*arena_, world);
  Batch& batch = *borrowed;
  take_velocities(index);
  batch.read = read_by_any_;
  auto* const touching =
      reinterpret_cast<int32_t*>(touching_->values.data()) + index * driven_.size();
  for (int64_t left = steps; left > 0; left -= batch.count) {
    batch.first_step = copy.step + 1;
    batch.count = static_cast<int>(std::min<int64_t>(left, kMaxBatchSteps));
    batch.applied_count = 0;
    for (int i = 0; i < batch.count; ++i, ++copy.step)
      world.advance(batch.first_step + i, batch.snapshots[i], batch);
    copy.make_scenes(batch.read.get(), batch.sensor_faults.get());
    for (size_t m = 0; m < world.modules().size(); ++m) {
      Module& module = *world.modules()[m];
      batch.outputs[m].woken = module.wants(batch);
      if (!batch.outputs[m].woken) continue;
      module.pass(copy.step);
      module.process(batch, batch.outputs[m], kNeverLeftOff);
    }
    copy.keep_newest(batch);
    count_touching(copy, batch, touching);
    if (handlers || (!handler_ && !state_handler_)) continue;
    try {
      tell(index, batch);
    } catch (...) {
      handlers = std::current_exception();
    }
  }
  for (auto& observer : observers_) update(*observer, index);
  return handlers;
}

// Creates a renderer when the first picture is read: most copies never need one.
void Engine::Copy::make_scenes(const ReadChannels* read, const std::vector<SensorFault>* faults) {
  const auto& modules = world->modules();
  scenes_made.resize(modules.size(), false);
  for (size_t m = 0; m < modules.size(); ++m) {
    if (scenes_made[m] || !modules[m]->needs_scenes(read, faults)) continue;
    modules[m]->make_scenes(world->scene_makers());
    scenes_made[m] = true;
  }
}

void Engine::Copy::keep_newest(const Batch& batch) {
  newest.resize(channels.list().size());
  places.assign(newest.size(), {});
  for (const Batch::Output& output : batch.outputs) {
    if (!output.woken) continue;
    for (const Outbox& outbox : output.pieces) {
      for (const Outbox::Entry& entry : outbox.entries()) places[entry.channel] = {&outbox, &entry};
    }
  }
  for (size_t channel = 0; channel < places.size(); ++channel) {
    if (!places[channel].entry) continue;
    const uint8_t* bytes = places[channel].outbox->data(*places[channel].entry);
    newest[channel].assign(bytes, bytes + places[channel].entry->size);
  }
}

// In the order in which a server publishes: step by step, then by the schedule.
void Engine::tell(size_t index, const Batch& batch) {
  const Copy& copy = *copies_[index];
  for (int64_t step = batch.first_step; step < batch.first_step + batch.count; ++step) {
    if (state_handler_)
      state_handler_(static_cast<int>(index), batch.snapshots[step - batch.first_step], batch);
    if (!handler_) continue;
    for (const Batch::Output& output : batch.outputs) {
      if (!output.woken) continue;
      for (const Outbox& outbox : output.pieces) {
        for (const Outbox::Entry& entry : outbox.entries()) {
          if (entry.step == step)
            handler_(static_cast<int>(index), step, copy.channels[ChannelIndex(entry.channel)],
                     {outbox.data(entry), entry.size});
        }
      }
    }
  }
}

void Engine::count_touching(Copy& copy, const Batch& batch, int32_t* counts) const {
  for (int i = 0; i < batch.count; ++i) {
    const Snapshot& state = batch.snapshots[i];
    if (state.collisions.empty()) continue;
    for (size_t robot = 0; robot < driven_robots_.size(); ++robot) {
      bool touched = false;
      for (const Collision& collision : state.collisions) {
        if (collision.robot != driven_robots_[robot]) continue;
        touched = true;
        const Contact& contact = state.contacts[collision.contact];
        const LinkIndex other = collision.as_a ? contact.link_b : contact.link_a;
        std::vector<LinkIndex>& met = copy.met[robot];
        if (std::find(met.begin(), met.end(), other) == met.end()) met.push_back(other);
      }
      counts[robot] += touched;
    }
  }
}

std::vector<std::vector<std::string>> Engine::collisions(int world) const {
  const Copy& copy = *copies_.at(static_cast<size_t>(world));
  std::vector<std::vector<std::string>> names;
  for (const std::vector<LinkIndex>& links : copy.met) {
    std::vector<std::string>& of_robot = names.emplace_back();
    for (const LinkIndex link : links)
      of_robot.push_back(world::body_name(copy.world->model(), copy.world->layout(), link));
    std::sort(of_robot.begin(), of_robot.end());
    of_robot.erase(std::unique(of_robot.begin(), of_robot.end()), of_robot.end());
  }
  return names;
}

namespace {

// For a device that has not published yet: NaN, or 0 for integers.
void put_nothing(Primitive type, std::byte* row, size_t size) {
  const auto fill = [&](auto nothing) {
    for (size_t at = 0; at < size; at += sizeof nothing)
      std::memcpy(row + at, &nothing, sizeof nothing);
  };
  if (type == Primitive::float32)
    fill(std::numeric_limits<float>::quiet_NaN());
  else if (type == Primitive::float64)
    fill(std::numeric_limits<double>::quiet_NaN());
  else
    fill(std::byte{0});
}

}  // namespace

void Engine::update(Observer& observer, size_t world) {
  const size_t row_size = observer.count * observer.reader.value_size();
  for (size_t robot = 0; robot < observer.channels.size(); ++robot) {
    const std::vector<uint8_t>& message = copies_[world]->newest[observer.channels[robot]];
    std::byte* row =
        observer.array->values.data() + (world * observer.channels.size() + robot) * row_size;
    if (message.empty()) {
      put_nothing(observer.reader.type(), row, row_size);
      continue;
    }
    if (observer.reader.read(message, row, observer.count)) continue;
    throw std::runtime_error("the number of values in " + observer.device + "." + observer.field +
                             " changes from message to message: an array cannot hold them");
  }
}

void Engine::step(int64_t steps, std::span<const uint8_t> which,
                  const std::function<bool()>& go_on) {
  if (steps < 1) throw InputError({}, "step() takes 1 step or more, not " + std::to_string(steps));
  if (!which.empty() && which.size() != copies_.size())
    throw InputError({}, "which worlds to step: " + std::to_string(copies_.size()) +
                             " values, one for each, not " + std::to_string(which.size()));
  const DefaultFloatingPoint floating_point;
  for (int64_t done = 0; done < steps; done += kStepsAtOnce) {
    if (done > 0 && go_on && !go_on()) return;
    for_each(copies_.size(), [&](size_t i) {
      if (!which.empty() && which[i] == 0) return;
      if (done == 0) forget_touching(i);
      compute(i, std::min(steps - done, kStepsAtOnce));
    });
  }
}

void Engine::drive(std::span<const double> velocities, std::span<const uint8_t> which) {
  const size_t rows = copies_.size() * velocity_inputs_.size();
  if (velocities.size() != 3 * rows)
    throw InputError({}, "velocities are " + std::to_string(rows) +
                             " rows of 3, one for each driven robot of each world");
  if (std::any_of(velocities.begin(), velocities.end(), [](double v) { return std::isinf(v); }))
    throw InputError({}, "commands are finite numbers, or NaN for none; one is infinite");
  for (size_t i = 0; i < copies_.size(); ++i) take_velocities(i);  // from an earlier call
  velocities_.assign(velocities.begin(), velocities.end());
  for (size_t i = 0; i < copies_.size(); ++i) copies_[i]->driven = which.empty() || which[i];
}

// Moves what drive() was given into the copy's inbox: in the thread that computes the copy.
void Engine::take_velocities(size_t index) {
  Copy& copy = *copies_[index];
  if (!std::exchange(copy.driven, false)) return;
  uint8_t bytes[64];
  for (size_t robot = 0; robot < velocity_inputs_.size(); ++robot) {
    const double* v = velocities_.data() + 3 * (index * velocity_inputs_.size() + robot);
    if (std::isnan(v[0]) || std::isnan(v[1]) || std::isnan(v[2])) continue;
    velocity_command_t command;
    command.utime = 0;
    command.vx = v[0];
    command.vy = v[1];
    command.omega = v[2];
    const int size = command.encode(bytes, 0, sizeof bytes);
    copy.world->inbox().schedule(copy.step, velocity_inputs_[robot], bytes,
                                 static_cast<size_t>(size));
  }
}

void Engine::command(int world, const std::string& channel, std::span<const uint8_t> message) {
  Copy& copy = *copies_.at(static_cast<size_t>(world));
  take_velocities(static_cast<size_t>(world));  // it came first
  CommandInbox& inbox = copy.world->inbox();
  const auto input = std::find_if(inbox.inputs().begin(), inbox.inputs().end(),
                                  [&](const Input& one) { return one.channel == channel; });
  if (channel.empty() || input == inbox.inputs().end())
    throw InputError({}, "no robot takes commands on '" + channel + "'");
  switch (inbox.schedule(copy.step, InputIndex(input - inbox.inputs().begin()), message.data(),
                         message.size())) {
    case CommandInbox::Scheduled::kept: return;
    case CommandInbox::Scheduled::full:
      throw InputError({}, "more commands wait than a world keeps: step it first");
    case CommandInbox::Scheduled::faulty:
      if (fault_t fault;
          input->kind == Input::Kind::fault &&
          decode_checked(message.data(), message.size(), fault) == DecodeFault::none) {
        throw InputError({}, channel + ": " + world::check_fault(fault_of(fault)));
      }
      if (markers_t markers;
          input->kind == Input::Kind::markers &&
          decode_checked(message.data(), message.size(), markers) == DecodeFault::none) {
        throw InputError({}, channel + ": " + check_markers(markers));
      }
      throw InputError({}, "the message does not decode as the type of " + channel);
    case CommandInbox::Scheduled::late:
      throw InputError({}, "the message does not decode as the type of " + channel);
  }
}

void Engine::reset(std::span<const Reset> resets) {
  const DefaultFloatingPoint floating_point;
  std::vector<bool> named(copies_.size(), false);
  for (const Reset& reset : resets) {
    if (named.at(static_cast<size_t>(reset.world)))
      throw InputError({},
                       "world " + std::to_string(reset.world) + " is to be reset twice at once");
    named[reset.world] = true;
  }
  // Everything that may be refused is made before any change.
  std::vector<std::unique_ptr<Copy>> made(resets.size());
  for_each(resets.size(), [&](size_t i) { made[i] = make_other(resets[i]); });
  for_each(resets.size(), [&](size_t i) { reset_one(resets[i], std::move(made[i])); });
}

// Null where the reset needs no other plan.
std::unique_ptr<Engine::Copy> Engine::make_other(const Reset& reset) {
  const Copy& before = *copies_[static_cast<size_t>(reset.world)];
  const bool other = reset.model && reset.model != before.model;
  if (!other && options_.draws.empty()) return nullptr;
  if (other) refuse_errors(*reset.model);
  if (other && reset.model->step_us != world_->step_us)
    throw InputError({reset.model->file}, "its steps have " + std::to_string(reset.model->step_us) +
                                              " us, those of " + world_->file + " have " +
                                              std::to_string(world_->step_us) +
                                              ": an engine's worlds have the same");
  auto copy = make_copy(other ? reset.model : before.model, reset.seed);
  const auto same = [](const Channel& a, const Channel& b) {
    return a.name == b.name && a.fingerprint == b.fingerprint;
  };
  const std::vector<Channel>&here = before.channels.list(), &there = copy->channels.list();
  if (!std::equal(here.begin(), here.end(), there.begin(), there.end(), same)) {
    const auto found_in = [&](const std::vector<Channel>& channels, const Channel& one) {
      return std::any_of(channels.begin(), channels.end(),
                         [&](const Channel& other) { return same(one, other); });
    };
    std::string what = "its robots are in another order";
    for (const Channel& one : here) {
      if (!found_in(there, one)) what = "it lacks '" + one.name + "'";
    }
    for (const Channel& one : there) {
      if (!found_in(here, one)) what = "it has '" + one.name + "', unlike " + world_->file;
    }
    throw InputError({copy->model->file},
                     what + ": an engine's worlds have the same robots and devices, in one order");
  }
  return copy;
}

void Engine::reset_one(const Reset& reset, std::unique_ptr<Copy> made) {
  const auto index = static_cast<size_t>(reset.world);
  if (!made) {
    Copy& ended = *copies_[index];
    const bool reusable = std::exchange(ended.sound, false);  // from here on it is no more
    made = make_copy(ended.model, reset.seed, reusable ? ended.world.get() : nullptr);
  }
  copies_[index] = std::move(made);
  forget_touching(index);
  compute(index, 1);
}

void Engine::Copy::copy_from(const Copy& other) {
  world->copy_from(*other.world);
  step = other.step;
  driven = false;
  newest = other.newest;
  met = other.met;
}

std::shared_ptr<const SavedWorld> Engine::save(int world) {
  const auto index = static_cast<size_t>(world);
  const Copy& copy = sound_copy(index);
  const DefaultFloatingPoint floating_point;
  take_velocities(index);
  auto saved = std::make_shared<SavedWorld>();
  saved->engine = identity_;
  saved->copy = make_another(copy);
  saved->copy->copy_from(copy);
  const auto* touching = reinterpret_cast<const int32_t*>(touching_->values.data());
  saved->touching.assign(touching + index * driven_.size(),
                         touching + (index + 1) * driven_.size());
  return saved;
}

void Engine::restore(const SavedWorld& saved, std::span<const int> worlds) {
  if (saved.engine != identity_) throw InputError({}, "another engine saved that world");
  const DefaultFloatingPoint floating_point;
  std::vector<bool> named(copies_.size(), false);
  for (const int world : worlds) {
    if (named.at(static_cast<size_t>(world)))
      throw InputError({}, "world " + std::to_string(world) + " is to be restored twice at once");
    named[world] = true;
  }
  for_each(worlds.size(), [&](size_t i) { restore_one(saved, static_cast<size_t>(worlds[i])); });
}

// A copy with another plan or seed is created again: what it drew on creation would remain.
void Engine::restore_one(const SavedWorld& saved, size_t world) {
  const Copy& from = *saved.copy;
  if (!copies_[world]->sound || copies_[world]->plan != from.plan ||
      copies_[world]->seed != from.seed)
    copies_[world] = make_another(from);
  Copy& copy = *copies_[world];
  copy.sound = false;
  copy.copy_from(from);
  std::copy(saved.touching.begin(), saved.touching.end(),
            reinterpret_cast<int32_t*>(touching_->values.data()) + world * driven_.size());
  copy.make_scenes(read_.get());
  for (size_t channel = 0; channel < read_->size(); ++channel)
    if ((*read_)[channel]) catch_up(copy, static_cast<int>(channel));
  for (auto& observer : observers_) update(*observer, world);
  copy.sound = true;
}

const world::Drawn& Engine::drawn(int world) const {
  return copies_.at(static_cast<size_t>(world))->drawn;
}

std::vector<int> Engine::channels_of(const std::string& device) const {
  std::vector<int> channels;
  const std::vector<device_info_t>& devices = copies_[0]->world->devices();
  // Of "camera/depth": the device, and which of the channels below its own.
  const size_t slash = std::min(device.find('/'), device.size());
  const std::string name = device.substr(0, slash), below = device.substr(slash);
  for (const bool by_kind : {false, true}) {
    std::string last_robot;
    for (const device_info_t& one : devices) {
      if (!same_name(by_kind ? one.kind : one.name, name)) continue;
      if (one.robot == last_robot)
        throw InputError({}, "robot " + one.robot + " has several devices of kind '" + name +
                                 "': give one's name");
      last_robot = one.robot;
      const std::vector<Channel>& list = copies_[0]->channels.list();
      const auto found = std::find_if(list.begin(), list.end(), [&](const Channel& channel) {
        return channel.name == one.robot + "/" + one.name + below;
      });
      if (found != list.end()) channels.push_back(static_cast<int>(found - list.begin()));
    }
    if (!channels.empty()) return channels;
  }
  std::string names;
  for (const device_info_t& one : devices)
    names += (names.empty() ? "" : ", ") + one.robot + "/" + one.name;
  throw InputError({}, "no robot has a device '" + device + "'; there are " + names);
}

std::shared_ptr<const FieldArray> Engine::observe(const std::string& device,
                                                  const std::string& field) {
  const auto refuse_nothing = [&](const std::vector<int>& channels) {
    if (copies_[0]->newest[static_cast<size_t>(channels[0])].empty())
      throw InputError({}, device + "." + field + " has no sample yet: step the engine first");
  };
  for (const auto& known : observers_) {
    if (known->device != device || known->field != field) continue;
    refuse_nothing(known->channels);  // after a reset
    return known->array;
  }
  const std::vector<int> channels = channels_of(device);
  const Schema* schema = find_schema(copies_[0]->channels[ChannelIndex(channels[0])].fingerprint);
  if (!schema)
    throw InputError({}, "the messages of '" + device + "' are of a type without a description");
  auto observer =
      std::make_unique<Observer>(Observer{device, field, FieldReader(*schema, field), channels});
  read(channels);
  refuse_nothing(channels);
  const std::vector<uint8_t>& sample = copies_[0]->newest[channels[0]];
  FieldArray& array = *observer->array;
  array.type = observer->reader.type();
  array.shape = {static_cast<int64_t>(copies_.size()), static_cast<int64_t>(channels.size())};
  observer->count = 1;
  for (const int64_t size : observer->reader.shape(sample)) {
    array.shape.push_back(size);
    observer->count *= static_cast<size_t>(size);
  }
  array.values.resize(copies_.size() * channels.size() * observer->count *
                      observer->reader.value_size());
  observers_.push_back(std::move(observer));
  for (size_t i = 0; i < copies_.size(); ++i) update(*observers_.back(), i);
  return observers_.back()->array;
}

// From now on they are read, including their newest messages, which may not have been computed.
void Engine::read(const std::vector<int>& channels) {
  auto read = std::make_shared<ReadChannels>(*read_);
  for (const int channel : channels) (*read)[channel] = true;
  const DefaultFloatingPoint floating_point;
  for_each(copies_.size(), [&](size_t i) {
    copies_[i]->make_scenes(read.get());
    for (const int channel : channels) catch_up(*copies_[i], channel);
  });
  read_ = std::move(read);
  choose_read();
}

void Engine::on_message(MessageHandler handler, std::function<bool(const Channel&)> wants) {
  handler_ = std::move(handler);
  handler_wants_ = std::move(wants);
  choose_read();
}

void Engine::choose_read() {
  read_by_any_ = handler_ && !handler_wants_ ? nullptr : read_;
  if (!handler_ || !handler_wants_) return;
  auto read = std::make_shared<ReadChannels>(*read_);
  for (const ChannelIndex channel : copies_[0]->channels.list().indices()) {
    if (handler_wants_(copies_[0]->channels[channel])) (*read)[static_cast<size_t>(channel)] = true;
  }
  read_by_any_ = std::move(read);
}

void Engine::catch_up(Copy& copy, int channel) {
  Outbox made;
  for (auto& module : copy.world->modules()) module->catch_up(channel, made);
  copy.newest.resize(copy.channels.list().size());
  for (const Outbox::Entry& entry : made.entries())
    copy.newest[entry.channel].assign(made.data(entry), made.data(entry) + entry.size);
}

int64_t Engine::current_step(int world) const {
  return copies_.at(static_cast<size_t>(world))->step;
}
const std::vector<device_info_t>& Engine::devices() const { return copies_[0]->world->devices(); }
const std::vector<Input>& Engine::inputs(int world) const {
  return copies_.at(static_cast<size_t>(world))->world->inbox().inputs();
}
const std::vector<Channel>& Engine::channels() const { return copies_[0]->channels.list(); }

uint64_t Engine::state_hash(int world) const {
  const Copy& copy = *copies_.at(static_cast<size_t>(world));
  Snapshot state;
  copy.world->read(copy.step, state);
  return static_cast<uint64_t>(engine::state_hash(state));
}

}  // namespace ruedo::engine
