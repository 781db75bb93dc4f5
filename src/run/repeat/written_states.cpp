// The state in a snapshot's file: another process of the same build and user begins with it at
// once, however long the run was.
//
// A state has hundreds of values that run loops and indices, and no check of each of them would be
// whole: it counts only under this user's seal (system/seal.h). Every other file leads to the state
// by running there again.
#include <algorithm>

#include <spdlog/spdlog.h>

#include "base/message_size.h"
#include "engine/world_state.h"
#include "log/reader.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/state_archive.h"
#include "run/run.h"
#include "system/seal.h"

namespace ruedo::run {
namespace {

// The conditions under which a state's bytes are valid, beside the seed: this build on such a
// machine, with this world and these options. "" for a program without a build's id.
std::string made_for(const log_header_t& header) {
  if (header.version.find(", build ") == std::string::npos) return "";
  std::string all = header.version + '\n' + header.cpu + '\n' + header.libc + '\n' +
                    std::to_string(header.step_us);
  for (const std::string& library : header.libraries) all += '\n' + library;
  for (const log_file_t& file : header.files) all += '\n' + file.sha256;
  for (const std::string& option : header.options) all += '\n' + option;
  return all;
}

// Of a snapshot's file.
struct Parts {
  Journal::Extent journal;
  std::vector<uint8_t> state;  // with its seal; empty: none
  state_hash_t end{};
};

// None: it has no state, or is not whole.
std::optional<Parts> parts_of(const std::string& path) {
  log::Reader reader(path);
  log::Event event;
  Parts parts;
  if (!reader.next(event)) return std::nullopt;
  parts.journal.header_end = parts.journal.end = reader.offset();
  while (reader.next(event) && event.channel != kStateChannel) {
    parts.journal.end = reader.offset();
    ++parts.journal.events;
  }
  if (event.channel != kStateChannel) return std::nullopt;
  parts.state = std::move(event.data);
  if (!reader.next(event) || event.channel != kStateHashChannel ||
      decode_checked(event.data.data(), event.data.size(), parts.end) != DecodeFault::none)
    return std::nullopt;
  return parts;
}

}  // namespace

std::unique_ptr<engine::World> Run::copy_of_world(uint64_t seed) {
  if (!plan_of_saved_) plan_of_saved_ = std::make_shared<engine::Plan>(*first_world_);
  engine::Channels channels(options_.remaps);
  engine::add_simulation_channels(channels, options_.control);
  Findings findings;
  engine::FleetOptions fleet = options_.simulation.fleet;
  fleet.seed = seed;
  return std::make_unique<engine::World>(plan_of_saved_, fleet, channels, findings);
}

std::vector<uint8_t> Run::written_state() {
  std::string made = made_for(header_);
  if (made.empty()) return {};
  try {
    StateArchive archive;
    uint64_t seed = options_.simulation.fleet.seed;
    Snapshot state = *publisher_.latest();
    std::vector<int64_t> sequences = publisher_.sequences();
    std::set<std::string> put = edited_ ? edited_->put() : std::set<std::string>{};
    archive(made, seed, state, sequences, put);
    simulation_->write(archive);
    std::vector<uint8_t> bytes = archive.written();
    const std::optional<Seal> seal = seal_of(bytes);
    if (!seal) return {};
    bytes.insert(bytes.end(), seal->begin(), seal->end());
    return bytes.size() > kLargestMessage ? std::vector<uint8_t>{} : bytes;
  } catch (const ArchiveError& error) {
    spdlog::debug("the snapshot has no state in it: {}", error.what());
    return {};
  }
}

std::optional<SavedState> Run::read_state(const std::string& path) {
  if (log_ || watcher_) return std::nullopt;  // which get the messages of the past, too
  std::optional<Parts> parts = parts_of(path);
  if (!parts || parts->state.size() < sizeof(Seal)) return std::nullopt;
  const std::span<const uint8_t> whole(parts->state);
  const auto bytes = whole.first(whole.size() - sizeof(Seal));
  if (!is_sealed(bytes, whole.last(sizeof(Seal)))) return std::nullopt;
  try {
    StateArchive archive(bytes);
    SavedState saved;
    std::string made;
    archive(made);
    if (made.empty() || made != made_for(header_)) return std::nullopt;
    archive(saved.seed, saved.state, saved.sequences, saved.put);
    saved.world = copy_of_world(saved.seed);
    saved.world->exchange(archive);
    Snapshot read;
    saved.world->read(saved.state.step, read);
    const int64_t hash = engine::state_hash(saved.state);
    if (!archive.at_end() || hash != parts->end.state_hash || engine::state_hash(read) != hash)
      return std::nullopt;
    saved.journal = parts->journal;
    return saved;
  } catch (const std::exception& error) {  // Bullet's state, too
    spdlog::debug("{}: {}", path, error.what());
    return std::nullopt;
  }
}

void Run::begin_with_state() {
  if (!repeating_ || options_.end_with_repeat) return;
  const std::string path = repeating_->path();
  const std::optional<SavedState> saved = read_state(path);
  if (!saved || saved->seed != options_.simulation.fleet.seed ||
      saved->sequences.size() != publisher_.sequences().size()) {
    spdlog::info("{} holds no restorable state; re-simulating {} steps", path, repeating_->steps());
    return;
  }
  {
    const std::lock_guard lock(simulation_mutex_);
    simulation_->restore(*saved->world, epoch_);
    changed_ = saved->state;
    pacer_->set_rate(wanted_.rate);
    if (wanted_.paused) pacer_->pause();
    pacer_->go_on_from(changed_.step);
    publisher_.go_on_from(changed_, saved->sequences);
    if (edited_) edited_->begin(saved->put);
    repeating_.reset();
    publisher_.mute(false);
    begin_mode(*mode_, changed_.step);
  }
  options_.repeat.clear();
  if (journal_) journal_->begin_with(header_, publisher_.base_us(), path, saved->journal);
  beats_.info.say();
}

}  // namespace ruedo::run
