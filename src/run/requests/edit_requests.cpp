// Requests that change the world between two steps, or the time.
//
// The pacer holds, what is under way is published, and then nothing moves: the simulation's thread
// waits in the pacer, the modules at their queues. So the change needs no lock against any of them.
#include <map>

#include <spdlog/spdlog.h>

#include "base/channel_names.h"
#include "engine/edits/edits.h"
#include "engine/world_state.h"
#include "log/header.h"
#include "ruedo/applied_t.hpp"
#include "run/run.h"

namespace ruedo::run {
namespace {

constexpr size_t kFindingsTold = 5;

}  // namespace

bool Run::stand_still() {
  const int64_t last = pacer_->hold();
  while (publisher_.step() < last) {
    if (simulation_->over()) return false;  // a run whose state became invalid has ended early
    if (const engine::Batch* batch = simulation_->next_batch())
      publish(*batch);
    else
      wakeup_.wait();
  }
  return pacer_->wait_until_held();
}

void Run::let_go() {
  pacer_->release();
  wakeup_.set();  // for requests that came meanwhile
}

Run::Outcome Run::change(const request_t& request, Changes what,
                         const std::function<Outcome()>& apply) {
  if (!mode().has_room())
    return Outcome::refuse(reply_t::REFUSED,
                           "not all clients have the messages of the last steps: ask again");
  if (!stand_still()) return Outcome::refuse(reply_t::REFUSED, "the run is over");
  const bool models = what == Changes::models;
  Outcome outcome;
  {
    const std::lock_guard lock(simulation_mutex_);
    outcome = apply();
    if (models && outcome.code == reply_t::OK) {
      as_made_ = false;
      world_ = std::make_shared<const world::WorldModel>(simulation_->world());
      mode().models_changed(stage(), publisher_.step());
    }
  }
  if (outcome.code == reply_t::OK) {
    note(request);
    changed_ = publisher_.latest() ? *publisher_.latest() : Snapshot{};
    simulation_->robots().read(changed_);
    changed_.step = publisher_.step();
    changed_.time = publisher_.time_us();
    publisher_.change_latest(changed_);
    if (models) announce();
    if (models && !repeating_) beats_.info.say();
    show_change();
  }
  let_go();
  return outcome;
}

// Shows the change to an editor of a world that stands still, where no new state would. It is a
// service message, which is in no log: a log is the same with and without viewers.
void Run::show_change() {
  if (!options_.edited || repeating_ || !pacer_->paused() || !publisher_.latest()) return;
  for (const engine::ChannelIndex channel : channels_.list().indices()) {
    if (channels_[channel].name != kWorldChannel) continue;
    for (const world_state_t& state :
         engine::world_states(*world_, simulation_->layout(), epoch_, changed_))
      publisher_.service(channel, state, state.part);
  }
}

void Run::note(const request_t& request) {
  applied_t applied;
  applied.utime = publisher_.time_us();
  applied.step = publisher_.step();
  applied.epoch = epoch_;
  applied.sequence = request.sequence;
  applied.channel = kRequestChannel;
  applied.kind = request.kind;
  applied.size = request.size;
  applied.data = request.body;
  publisher_.record(kAppliedChannel, applied);
}

void Run::note_files(const std::vector<std::string>& files) {
  if (files.empty() || !header_made_) return;
  log_header_t header = header_;
  header.utime = publisher_.time_us();
  header.files = log::hashed_files(files);
  header.nfiles = static_cast<int32_t>(header.files.size());
  publisher_.record(kHeaderChannel, header);
}

Run::Outcome Run::reset(const request_t& request, const reset_request_t& body) {
  const auto bad = [](std::string text) {
    return Outcome::refuse(reply_t::BAD_REQUEST, std::move(text));
  };
  switch (body.what) {
    case reset_request_t::ALL:
      return body.seed < -1 ? bad("seed must be 0 or more, or -1 to keep the current one")
                            : reset_all(request, body.seed);
    case reset_request_t::TIME:
    case reset_request_t::POSES:
      if (body.seed != -1)
        return bad("another seed goes with a reset of everything; -1 is allowed here");
      return body.what == reset_request_t::TIME ? reset_time(request) : reset_poses(request);
    default:
      return bad("a reset of kind " + std::to_string(body.what) +
                 "; there are 0 (all), 1 (time) and 2 (poses)");
  }
}

Run::Outcome Run::reset_all(const request_t& request, int64_t seed) {
  if (!repeating_) control_.cancel("the world was reset");
  note(request);
  if (seed >= 0) options_.simulation.fleet.seed = static_cast<uint64_t>(seed);
  begin_epoch();
  return Outcome::after(0);
}

Run::Outcome Run::reset_poses(const request_t& request) {
  const Outcome outcome = change(request, Changes::states,
                                 [&] { return engine::reset_poses(*simulation_), Outcome{}; });
  return outcome.code == reply_t::OK ? Outcome::with(engine::encoded(state())) : outcome;
}

Run::Outcome Run::reset_time(const request_t& request) {
  if (!stand_still()) return Outcome::refuse(reply_t::REFUSED, "the run is over");
  if (!repeating_) control_.cancel("sim time was reset");
  note(request);
  header_.epoch = ++epoch_;
  pacer_->reset_time();
  publisher_.begin_epoch(epoch_);
  {
    const std::lock_guard lock(simulation_mutex_);
    simulation_->reset_time(epoch_);
    as_made_ = false;
    begin_mode(mode(), -1);
  }
  announce();
  let_go();
  return Outcome::after(0);
}

Run::Outcome Run::spawn(const request_t& request, const spawn_request_t& body) {
  if (Outcome outcome = engine::check_spawn(body); outcome.code != reply_t::OK) return outcome;
  if (!repeating_) return worker_.add({request, body});
  try {
    return put_in(request, body, models_.load(body));
  } catch (const InputError& error) {
    return Outcome::refuse(reply_t::BAD_REQUEST, error.what());
  }
}

// Granted steps are computed first, so that the client knows at which step the request acts.
void Run::spawn_ready() {
  const auto pending = [this](const request_t& request) {
    return control_.is_pending(request.session, request.sequence);
  };
  worker_.keep(pending);
  for (;; made_.reset()) {
    if (!made_) {
      made_ = worker_.take_made();
      if (!made_) return;
      enters_at_ = mode().granted();
    }
    const request_t& request = made_->request;
    if (!pending(request)) continue;  // the world was reset meanwhile, or its client left
    if (publisher_.step() < enters_at_ && !pacer_->paused()) return;
    control_.finish(request.session, request.sequence,
                    made_->fault.empty() ? put_in(request, made_->body, made_->loaded)
                                         : Outcome::refuse(reply_t::BAD_REQUEST, made_->fault));
  }
}

Run::Outcome Run::put_in(const request_t& request, const spawn_request_t& body,
                         const world::LoadedModel& loaded) {
  std::string name;
  Findings made;  // of its devices, which are made with it
  const Outcome outcome = change(request, Changes::models, [&] {
    return engine::spawn(body, loaded, publisher_.step() + 1, *simulation_, channels_, name, made);
  });
  if (outcome.code == reply_t::OK) note_files(loaded.files_read);
  if (outcome.code == reply_t::OK && edited_) edited_->spawned(name, body);
  if (outcome.code != reply_t::OK || repeating_) return outcome;
  spdlog::info("{} was spawned at step {}", name, publisher_.step());
  std::vector<Finding> findings = loaded.findings;
  findings.insert(findings.end(), made.list().begin(), made.list().end());
  note_error(findings);
  for (size_t i = 0; i < std::min(findings.size(), kFindingsTold); ++i)
    spdlog::warn("{}: {}: {}", findings[i].source.str(), findings[i].element, findings[i].text);
  name_request_t which;  // the answer gives its name and its pose
  which.name = name;
  return publisher_.latest() ? get_state(request, which) : outcome;
}

Run::Outcome Run::remove(const request_t& request, const name_request_t& body) {
  const Outcome outcome = change(
      request, Changes::models, [&] { return engine::remove(body.name, *simulation_, channels_); });
  if (outcome.code == reply_t::OK && edited_) edited_->removed(body.name);
  return outcome;
}

Run::Outcome Run::set_pose(const request_t& request, const set_pose_request_t& body) {
  // A fixed model is removed and added again.
  const Changes what = engine::is_fixed(*world_, body.name) ? Changes::models : Changes::states;
  const Outcome outcome = change(request, what, [&] {
    return engine::set_pose(body, publisher_.step() + 1, *simulation_, channels_);
  });
  if (outcome.code == reply_t::OK && edited_) edited_->put(body.name);
  return outcome;
}

// The file gets the poses of the last published state.
Run::Outcome Run::save(const request_t& request) {
  name_request_t how;
  if (!request.body.empty() && !read_body(request, how)) return bad_body<name_request_t>();
  const std::map<std::string, EditedWorld::How> kHow{{"", EditedWorld::How::kept},
                                                     {"overwrite", EditedWorld::How::overwritten},
                                                     {"copy", EditedWorld::How::copied}};
  const auto found = kHow.find(how.name);
  if (found == kHow.end())
    return Outcome::refuse(reply_t::BAD_REQUEST,
                           "'" + how.name + "' is not allowed; '', 'overwrite' or 'copy' is");
  const world::BodyLayout& layout = simulation_->layout();
  const auto X_WM = [&](size_t instance) {
    const world::ModelInstance& model = world_->models[instance];
    const world::LinkPlacement& link = layout.links[layout.first_link[instance]];
    if (!link.body.valid()) return link.X_BL * model.model->links[0].X_ML.inverse();
    return publisher_.latest()->bodies[link.body] * link.X_BL *
           model.model->links[0].X_ML.inverse();
  };
  const EditedWorld::Saved saved = edited_->save(*world_, X_WM, found->second);
  if (!saved.fault.empty()) return Outcome::refuse(reply_t::REFUSED, saved.fault);
  spdlog::info("the world is saved");
  Outcome outcome;
  outcome.text = saved.file + (saved.file.empty() || saved.note.empty() ? "" : "; ") + saved.note;
  return outcome;
}

std::string Run::model_text(const std::string& name) const {
  return edited_ ? edited_->model_text(name) : "";
}

Run::Outcome Run::set_twist(const request_t& request, const set_twist_request_t& body) {
  return change(request, Changes::states, [&] { return engine::set_twist(body, *simulation_); });
}

}  // namespace ruedo::run
