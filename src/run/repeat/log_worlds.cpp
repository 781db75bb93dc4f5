// Executes the log's requests on its world as the server did, except for motion, so that names and
// indices of bodies are those of the run.
#include "run/repeat/log_worlds.h"

#include <algorithm>
#include <set>

#include "base/utf8.h"
#include "engine/edits/edits.h"
#include "engine/edits/world_editor.h"
#include "engine/fleet.h"
#include "engine/world_info.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "world/model/body_layout.h"

namespace ruedo::run {
namespace {

constexpr size_t kMostPlaced = 50'000;  // models of all scenes together: each scene lists its own

using world::WorldModel;

template <class Body>
bool read_body(const applied_t& applied, Body& body) {
  return decode_checked(applied.data.data(), applied.data.size(), body) == DecodeFault::none;
}

// The world after a request; null when it changed no model.
std::shared_ptr<const WorldModel> edited(const applied_t& applied,
                                         const std::shared_ptr<const WorldModel>& before,
                                         const std::shared_ptr<const WorldModel>& first,
                                         engine::ModelStore& models) {
  switch (applied.kind) {
    case request_t::RESET: {
      reset_request_t body;
      const bool all = read_body(applied, body) && body.what == reset_request_t::ALL;
      return all && before != first ? first : nullptr;
    }
    case request_t::REMOVE: {
      name_request_t body;
      if (!read_body(applied, body)) return nullptr;
      const InstanceIndex instance = engine::find_model(*before, body.name);
      if (!instance.valid()) return nullptr;
      auto world = std::make_shared<WorldModel>(*before);
      engine::WorldEditor(*world).remove(instance);
      return world;
    }
    case request_t::SET_POSE: {
      set_pose_request_t body;
      if (!read_body(applied, body) || !engine::is_fixed(*before, body.name)) return nullptr;
      auto world = std::make_shared<WorldModel>(*before);
      engine::WorldEditor editor(*world);
      const InstanceIndex instance = engine::find_model(*before, body.name);
      const auto model = world->models[instance].model;
      editor.remove(instance);
      editor.place(body.name, engine::pose_of(body), model);
      return world;
    }
    default: {
      spawn_request_t body;
      if (!read_body(applied, body) || engine::check_spawn(body).code != reply_t::OK)
        return nullptr;
      auto world = std::make_shared<WorldModel>(*before);
      const world::LoadedModel loaded = models.load(body);
      const std::string name =
          body.name.empty() ? engine::unused_name(*world, loaded.name) : body.name;
      const Pose X_WM = engine::spawn_pose(*world, *loaded.model, body);
      engine::WorldEditor(*world).place(name, X_WM, loaded.model);
      return world;
    }
  }
}

// ruedo/info of that world with the channels that the log has.
std::vector<std::vector<uint8_t>> make_info(const log::Index& index, const LoggedRun& run,
                                            const WorldModel* world) {
  world_info_t head{};
  std::vector<world_info_t> parts;
  if (index.header()) {
    head.version = index.header()->version;
    head.world = index.header()->world;
    head.seed = index.header()->seed;
    head.step_us = index.header()->step_us;
  }
  if (world) {
    const world::BodyLayout layout(*world);
    engine::Channels channels(run.remaps);
    std::vector<device_info_t> devices;
    Findings findings;
    for (const RobotIndex r : layout.robots.indices()) {
      if (world->models[layout.robots[r].instance].removed) continue;
      const engine::FleetOptions options{
          .disabled = run.disabled, .keep_going = true, .only_robot = r};
      engine::Fleet fleet = engine::make_fleet(*world, layout, options, channels, findings);
      devices.insert(devices.end(), fleet.devices.begin(), fleet.devices.end());
    }
    parts = engine::make_world_info(head, *world, layout, devices, channels);
  } else {
    parts.push_back(head);
    parts.back().nparts = 1;
  }
  std::set<std::string> missing;
  for (const log::Index::Channel& channel : index.channels()) missing.insert(channel.name);
  for (world_info_t& part : parts) {
    std::erase_if(part.channels, [&](const channel_info_t& channel) {
      return channel.input || missing.erase(channel.name) == 0;
    });
  }
  for (const log::Index::Channel& channel : index.channels()) {
    if (!missing.contains(channel.name)) continue;
    const Schema* schema = find_schema(channel.fingerprint);
    channel_info_t info{};
    info.name = printable(channel.name);
    info.type = schema ? schema->name : "";
    info.fingerprint = channel.fingerprint;
    parts.back().channels.push_back(info);
  }
  std::vector<std::vector<uint8_t>> messages;
  for (world_info_t& part : parts) {
    part.nchannels = static_cast<int32_t>(part.channels.size());
    messages.push_back(engine::encoded(part));
  }
  return messages;
}

}  // namespace

LogWorlds::LogWorlds(const log::Index& index, const LoadRun& load) {
  LoggedRun run;
  try {
    if (index.header()) {
      run = load(*index.header());
      fault_ = run.warning;
    } else {
      fault_ =
          "The log has no ruedo/header, so its world is not known: it was not recorded by ruedo "
          "run --record. Its channels are shown.";
    }
  } catch (const std::exception& error) {
    fault_ = std::string("The world of the log cannot be shown: ") + error.what();
  }
  scenes_.push_back({index.begin_us(), run.world, make_info(index, run, run.world.get())});
  if (!run.world) return;
  size_t placed = 0;  // models of all scenes together
  engine::ModelStore models(index.header()->world_file);
  for (const log::Index::Edit& edit : index.edits()) {
    try {
      if (placed += scenes_.back().world->models.size(); placed > kMostPlaced) {
        fault_ += (fault_.empty() ? "" : " ") +
                  std::string("Only the first changes of the world are shown.");
        return;
      }
      auto world = edited(edit.applied, scenes_.back().world, run.world, models);
      if (!world) continue;
      auto info = make_info(index, run, world.get());
      scenes_.push_back({edit.time_us, std::move(world), std::move(info)});
    } catch (const std::exception& error) {
      fault_ += (fault_.empty() ? "" : " ") +
                std::string("What was spawned in the log cannot be shown: ") + error.what();
      return;  // the poses of later models are then unknown
    }
  }
  if (index.edits().size() >= log::Index::kMostEdits)
    fault_ += "Only the first changes of the world are shown.";
}

size_t LogWorlds::number(SimTime time_us) const {
  const auto after =
      std::upper_bound(scenes_.begin(), scenes_.end(), time_us,
                       [](SimTime time, const Scene& scene) { return time < scene.from_us; });
  return after == scenes_.begin() ? 0 : static_cast<size_t>(after - scenes_.begin()) - 1;
}

}  // namespace ruedo::run
