// ruedo::Engine over the engine layer, as clients/python/engine is.
#include "ruedo/engine.h"

#include <functional>
#include <numeric>
#include <utility>

#include "engine/engine.h"
#include "system/plugins.h"
#include "world/load.h"

namespace ruedo {
namespace {

Observation::Type type_of(Primitive type) {
  switch (type) {
    case Primitive::boolean: return Observation::Type::boolean;
    case Primitive::byte: return Observation::Type::byte;
    case Primitive::int8: return Observation::Type::int8;
    case Primitive::int16: return Observation::Type::int16;
    case Primitive::int32: return Observation::Type::int32;
    case Primitive::int64: return Observation::Type::int64;
    case Primitive::float32: return Observation::Type::float32;
    default: return Observation::Type::float64;
  }
}

world::LoadOptions load_options(const EngineOptions& options) {
  world::LoadOptions load;
  for (const std::string& text : options.spawn) load.spawns.push_back(world::parse_spawn(text));
  for (const std::string& text : options.drive) load.drives.push_back(world::parse_drive(text));
  for (const auto& [key, value] : options.settings)
    load.settings.push_back(world::parse_setting(key + "=" + value.text()));
  for (const std::string& text : options.fault) load.faults.push_back(world::parse_fault(text));
  load.disabled = options.disable;
  return load;
}

std::shared_ptr<const world::WorldModel> load(const std::string& world,
                                              const EngineOptions& options) {
  for (const std::string& file : options.plugins) load_plugin(file);
  return options.text.empty() ? world::load_world(world, load_options(options))
                              : world::load_world_text(options.text, world, load_options(options));
}

engine::EngineOptions engine_options(const EngineOptions& options) {
  engine::EngineOptions made;
  made.worlds = options.worlds;
  made.threads = options.threads;
  made.fleet.seed = options.seed;
  made.fleet.noise = options.noise;
  made.fleet.disabled = options.disable;
  return made;
}

}  // namespace

void Observation::check(Type wanted, int world) const {
  static constexpr const char* kNames[] = {"bool",    "uint8_t", "int8_t", "int16_t",
                                           "int32_t", "int64_t", "float",  "double"};
  if (wanted != type_) {
    throw std::invalid_argument(std::string("the values are of type ") +
                                kNames[static_cast<int>(type_)] + ", not " +
                                kNames[static_cast<int>(wanted)]);
  }
  if (world < 0 || world >= shape_.front())
    throw std::out_of_range("world " + std::to_string(world) + ": there are " +
                            std::to_string(shape_.front()));
}

struct Engine::Impl {
  Impl(const std::string& world, const EngineOptions& options)
      : model(load(world, options)), copies(model, engine_options(options)) {
    for (const Finding& finding : model->findings)
      findings.push_back(finding.source.str() + ": " + finding.element + ": " + finding.text);
    for (int i = 0; i < options.worlds; ++i)
      seeds.push_back(options.seed + static_cast<uint64_t>(i));
  }

  void check(int world) const {
    if (world < 0 || world >= copies.worlds())
      throw std::out_of_range("world " + std::to_string(world) + ": there are " +
                              std::to_string(copies.worlds()));
  }

  std::shared_ptr<const world::WorldModel> model;
  engine::Engine copies;
  std::vector<std::string> findings;
  std::vector<uint64_t> seeds;
};

Engine::Engine(const std::string& world, const EngineOptions& options)
    : impl_(std::make_unique<Impl>(world, options)) {}

Engine::Engine(Engine&&) noexcept = default;
Engine& Engine::operator=(Engine&&) noexcept = default;
Engine::~Engine() = default;

int Engine::worlds() const { return impl_->copies.worlds(); }
double Engine::step_size() const { return 1e-6 * static_cast<double>(impl_->copies.step_us()); }
const std::vector<std::string>& Engine::robots() const { return impl_->copies.driven(); }
const std::vector<std::string>& Engine::findings() const { return impl_->findings; }

std::vector<EngineDevice> Engine::devices() const {
  std::vector<EngineDevice> list;
  for (const device_info_t& device : impl_->copies.devices())
    list.push_back({device.robot, device.name, device.kind});
  return list;
}

void Engine::step(int64_t n) {
  if (n < 1) throw std::invalid_argument("n is " + std::to_string(n) + ": it must be 1 or more");
  impl_->copies.step(n);
}

void Engine::step(int64_t n, const std::vector<double>& velocities) {
  const size_t wanted = 3 * static_cast<size_t>(worlds()) * robots().size();
  if (velocities.size() != wanted) {
    throw std::invalid_argument(std::to_string(velocities.size()) +
                                " velocities: " + std::to_string(worlds()) + " worlds with " +
                                std::to_string(robots().size()) + " driven robots take " +
                                std::to_string(wanted));
  }
  if (n < 1) throw std::invalid_argument("n is " + std::to_string(n) + ": it must be 1 or more");
  impl_->copies.drive(velocities);
  impl_->copies.step(n);
}

void Engine::command(int world, const std::string& channel, const std::vector<uint8_t>& message) {
  impl_->check(world);
  impl_->copies.command(world, channel, message);
}

Observation Engine::observe(const std::string& name) {
  const size_t dot = name.rfind('.');
  if (dot == std::string::npos || dot == 0 || dot + 1 == name.size())
    throw InputError({}, "'" + name + "' is not a DEVICE.FIELD; for example 'lrf.ranges'");
  const auto array = impl_->copies.observe(name.substr(0, dot), name.substr(dot + 1));
  Observation made;
  made.type_ = type_of(array->type);
  made.shape_ = array->shape;
  made.size_ = static_cast<size_t>(std::accumulate(array->shape.begin() + 1, array->shape.end(),
                                                   int64_t{1}, std::multiplies<>()));
  made.bytes_ = {array, array->values.data()};
  return made;
}

void Engine::reset(int world, uint64_t seed) {
  impl_->check(world);
  impl_->copies.reset(world, seed);
  impl_->seeds[static_cast<size_t>(world)] = seed;
}

void Engine::reset() {
  for (int i = 0; i < worlds(); ++i) impl_->copies.reset(i, impl_->seeds[static_cast<size_t>(i)]);
}

SavedWorld Engine::save(int world) {
  impl_->check(world);
  SavedWorld made;
  made.saved_ = impl_->copies.save(world);
  made.world_ = world;
  made.step_ = impl_->copies.current_step(world);
  made.seed_ = impl_->seeds[static_cast<size_t>(world)];
  return made;
}

void Engine::restore(const SavedWorld& saved, const std::vector<int>& worlds) {
  const std::vector<int> which = worlds.empty() ? std::vector{saved.world_} : worlds;
  for (const int world : which) impl_->check(world);
  if (!saved.saved_) throw InputError({}, "that world was never saved");
  impl_->copies.restore(*saved.saved_, which);
  for (const int world : which) impl_->seeds[static_cast<size_t>(world)] = saved.seed_;
}

int64_t Engine::current_step(int world) const {
  impl_->check(world);
  return impl_->copies.current_step(world);
}

double Engine::time(int world) const {
  return static_cast<double>(current_step(world)) * step_size();
}

uint64_t Engine::state_hash(int world) const {
  impl_->check(world);
  return impl_->copies.state_hash(world);
}

void Engine::on_message(std::function<void(const EngineMessage&)> handler) {
  if (!handler) return impl_->copies.on_message({});
  impl_->copies.on_message([handler = std::move(handler)](int world, int64_t step,
                                                          const engine::Channel& channel,
                                                          std::span<const uint8_t> bytes) {
    handler({world, step, channel.bus_name, bytes.data(), bytes.size()});
  });
}

}  // namespace ruedo
