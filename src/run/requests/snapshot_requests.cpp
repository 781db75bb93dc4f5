// SNAPSHOT and RESTORE. A state that this process saved, or that the file has, is put back as it
// is; another one by running there again.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <string_view>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "engine/world_state.h"
#include "log/header.h"
#include "ruedo/errors.h"
#include "run/requests/request_table.h"
#include "run/run.h"

namespace ruedo::run {

using engine::Outcome;

namespace {

// A word of a command line.
std::string in_shell(const std::string& word) {
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string_view("_-+=./:,@%").find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

// How to go on from a snapshot of that run.
std::string command_for(const std::string& snapshot, const log_header_t& header) {
  std::string command = "ruedo run " + in_shell(header.world_file);
  for (const std::string& option : header.options) {  // "--spawn p3at@0,1"
    const size_t space = option.find(' ');
    command += " " + option.substr(0, space);
    if (space != std::string::npos) command += " " + in_shell(option.substr(space + 1));
  }
  return command + " --restore " + in_shell(snapshot) + " --view 0";
}

}  // namespace

Outcome Run::snapshot(const request_t& request) {
  name_request_t now;
  snapshot_request_t past;
  const bool is_past = read_body(request, past);
  if (!is_past && !read_body(request, now)) return bad_body<name_request_t>();
  const std::string& name = is_past ? past.name : now.name;
  if (journal_->snapshot_path(name).empty()) {
    return Outcome::refuse(reply_t::BAD_REQUEST,
                           "'" + name +
                               "' is not a name of a snapshot: 1 to 63 letters, "
                               "digits, '_', '-' and '.', not first a '.'");
  }
  saved_states_.forget(journal_->snapshot_path(name));
  if (is_past) return snapshot_of(past);
  const bool stands =
      as_made_ && publisher_.latest() && (mode_->takes_grants() ? stands_here() : stand_still());
  const std::string fault = journal_->save_snapshot(
      name, beats_.hashes.at_end(), publisher_.base_us() + publisher_.time_us(),
      stands ? written_state() : std::vector<uint8_t>{});
  if (stands && fault.empty() && keeps_states()) keep_state(journal_->snapshot_path(name));
  const Outcome outcome =
      fault.empty() ? Outcome::with(engine::encoded(state()))
                    : Outcome::refuse(reply_t::REFUSED, "the snapshot was not saved: " + fault);
  if (stands) let_go();
  return outcome;
}

// A log gets the messages of the past, too, when it is restored, and in lockstep nothing is. Where
// models have come or gone, or sim time went back, the world is not one as it is made.
bool Run::keeps_states() const {
  return as_made_ && !log_ && !watcher_ && !mode_->takes_grants() && publisher_.latest();
}

// In lockstep no state is published that the clients did not wait for.
bool Run::stands_here() {
  if (pacer_->hold() == publisher_.step()) return pacer_->wait_until_held();
  let_go();
  return false;
}

void Run::keep_state(const std::string& path) {
  SavedState saved;
  saved.world = copy_of_world(options_.simulation.fleet.seed);
  try {
    simulation_->save(*saved.world);
  } catch (const std::exception&) {  // a plugin's device: there remains the way through the past
    return;
  }
  saved.state = *publisher_.latest();
  Snapshot kept;
  saved.world->read(saved.state.step, kept);
  if (engine::state_hash(kept) != engine::state_hash(saved.state)) return;
  saved.seed = options_.simulation.fleet.seed;
  saved.sequences = publisher_.sequences();
  saved.journal = journal_->extent();
  if (edited_) saved.put = edited_->put();
  saved_states_.keep(path, std::move(saved));
}

// The state that is put back is the one that was published when it was saved.
Outcome Run::restore_kept(const SavedState& saved, const std::string& path) {
  const bool anew = !as_made_ || options_.simulation.fleet.seed != saved.seed;
  if (!stand_still()) return Outcome::refuse(reply_t::REFUSED, "the run is over");
  control_.cancel("a snapshot is restored");
  options_.simulation.fleet.seed = saved.seed;
  options_.simulation.fleet.epoch = ++epoch_;
  header_.epoch = epoch_;
  header_.seed = static_cast<int64_t>(saved.seed);
  {
    const std::lock_guard lock(simulation_mutex_);
    if (anew)
      make_simulation({pacer_->rate(), pacer_->paused()});
    else
      publisher_.begin_epoch(epoch_);
    simulation_->restore(*saved.world, epoch_);
    changed_ = saved.state;
    pacer_->go_on_from(changed_.step);
    publisher_.go_on_from(changed_, saved.sequences);
    if (edited_) edited_->begin(saved.put);
    begin_mode(*mode_, changed_.step);
  }
  announce();
  journal_->begin_with(header_, publisher_.base_us(), path, saved.journal);
  beats_.info.say();
  Outcome outcome = Outcome::with(engine::encoded(state()));
  anew ? simulation_->start(*pacer_) : let_go();
  return outcome;
}

Outcome Run::snapshot_of(const snapshot_request_t& past) {
  if (past.epoch != publisher_.epoch() || past.step < 0 || past.step > publisher_.step()) {
    return Outcome::refuse(reply_t::BAD_REQUEST,
                           "there was no step " + std::to_string(past.step) + " of epoch " +
                               std::to_string(past.epoch) + ": allowed are 0 to " +
                               std::to_string(publisher_.step()) + " of epoch " +
                               std::to_string(publisher_.epoch()));
  }
  const SimTime time_us = past.step * world_->step_us;
  const std::string fault = journal_->save_past(past.name, past.step, time_us, past.epoch,
                                                publisher_.base_us() + time_us);
  if (!fault.empty())
    return Outcome::refuse(reply_t::REFUSED, "the snapshot was not saved: " + fault);
  Outcome outcome;
  outcome.text = command_for(journal_->snapshot_path(past.name), header_);
  return outcome;
}

// In the log it is a reset and the run up to the snapshot's step, so that the log can be repeated
// without another file.
Outcome Run::restore(const request_t& request, const name_request_t& body) {
  const std::string path = journal_->snapshot_path(body.name);
  std::error_code unreadable;  // a link to itself, say
  if (path.empty() || !std::filesystem::exists(path, unreadable)) {
    return Outcome::refuse(reply_t::UNKNOWN_NAME, "there is no snapshot '" + body.name + "'");
  }
  if (const SavedState* saved = saved_states_.find(path)) return restore_kept(*saved, path);
  try {
    if (const std::optional<SavedState> saved = read_state(path)) return restore_kept(*saved, path);
    auto repeating = std::make_unique<Repeating>(path, mode_.get());
    const log_header_t& header = repeating->header();
    log::check_same_run(header, header_, path);
    if (repeating->steps() > kMostSteps) {
      return Outcome::refuse(reply_t::REFUSED,
                             fmt::format("{} is {} steps from its beginning; RESTORE repeats {} at "
                                         "most, and `ruedo run --restore` any number",
                                         path, repeating->steps(), kMostSteps));
    }
    spdlog::info("{} holds no restorable state; re-simulating {} steps (PAUSE cancels)", path,
                 repeating->steps());
    reset_request_t reset;
    reset.what = reset_request_t::ALL;
    reset.seed = header.seed == header_.seed ? -1 : header.seed;
    control_.cancel("a snapshot is restored");
    request_t noted = request;
    noted.kind = request_t::RESET;
    noted.body = engine::encoded(reset);
    noted.size = static_cast<int32_t>(noted.body.size());
    note(noted);
    begin_repeat(std::move(repeating));
  } catch (const InputError& error) {
    return Outcome::refuse(reply_t::REFUSED, error.what());
  }
  begin_epoch();
  const std::string fault = take_turns();
  return fault.empty() ? Outcome::after(0) : Outcome::refuse(reply_t::REFUSED, fault);
}

}  // namespace ruedo::run
