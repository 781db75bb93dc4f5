// The module ruedo._engine: the engine in the process of a Python program. ruedo/engine.py is what
// people call.
#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "arrivals.h"
#include "base/utf8.h"
#include "base/version.h"
#include "engine/engine.h"
#include "log/header.h"
#include "log_columns.h"
#include "python_thread.h"
#include "ruedo/errors.h"
#include "ruedo/math.h"
#include "system/plugins.h"
#include "watched_run.h"
#include "world/load.h"
#include "world/randomization.h"

namespace nb = nanobind;
using ruedo::Primitive;
using ruedo::engine::Engine;
using ruedo::engine::FieldArray;
using ruedo::engine::SavedWorld;

namespace {

// Of copies, 0 or 1 for each; none: all.
using Mask = std::optional<nb::ndarray<const uint8_t, nb::c_contig, nb::device::cpu>>;

std::span<const uint8_t> span_of(const Mask& mask) {
  return mask ? std::span(mask->data(), mask->size()) : std::span<const uint8_t>();
}

// A view of the engine's own memory, which stays as long as any view of it, and is written by
// step() and reset().
nb::object view_of(std::shared_ptr<const FieldArray> array) {
  const auto* held = new std::shared_ptr<const FieldArray>(std::move(array));
  const nb::capsule owner(held, [](void* pointer) noexcept {
    delete static_cast<std::shared_ptr<const FieldArray>*>(pointer);
  });
  const std::vector<size_t> shape((*held)->shape.begin(), (*held)->shape.end());
  return nb::cast(nb::ndarray<nb::numpy, nb::ro>((*held)->values.data(), shape.size(), shape.data(),
                                                 owner, nullptr, dtype_of((*held)->type)));
}

struct Recorded {
  int world;
  int64_t step;
  std::string channel;
  std::string bytes;
};

struct Saved {
  std::shared_ptr<const SavedWorld> world;
};

class PyEngine {
 public:
  PyEngine(const nb::bytes& path, const std::optional<std::string>& text, int worlds, uint64_t seed,
           bool noise, int threads, const std::vector<std::string>& spawns,
           const std::vector<std::string>& drives, const std::vector<std::string>& settings,
           const std::vector<std::string>& disabled, const std::vector<std::string>& faults,
           const std::vector<std::string>& draws, const std::vector<std::string>& plugins,
           bool record, bool allow_errors, bool allow_absolute) {
    const std::string world(path.c_str(), path.size());
    for (const std::string& one : plugins) ruedo::load_plugin(one);
    ruedo::world::LoadOptions options;
    for (const std::string& one : spawns) options.spawns.push_back(ruedo::world::parse_spawn(one));
    for (const std::string& one : drives) options.drives.push_back(ruedo::world::parse_drive(one));
    for (const std::string& one : settings)
      options.settings.push_back(ruedo::world::parse_setting(one));
    options.disabled = disabled;
    options.allow_absolute = allow_absolute;
    for (const std::string& one : faults) options.faults.push_back(ruedo::world::parse_fault(one));
    ruedo::engine::EngineOptions engine;
    engine.worlds = worlds;
    engine.threads = threads;
    engine.fleet.seed = seed;
    engine.fleet.noise = noise;
    engine.fleet.disabled = disabled;
    for (const std::string& one : draws) engine.draws.push_back(ruedo::world::parse_draw(one));
    randomized_ = !draws.empty();
    const Unlocked unlocked;
    texts_ = std::make_unique<ruedo::world::TextLoader>(world, options);
    const auto model = text ? read(*text) : ruedo::world::load_world(world, options);
    take(model->findings, allow_errors);
    engine_ = std::make_unique<Engine>(model, engine);
    take(engine_->findings().list(), allow_errors);
    world_ = model;
    for (const std::string& one : spawns) result_options_.push_back("--spawn=" + one);
    for (const std::string& one : drives) result_options_.push_back("--drive=" + one);
    for (const std::string& one : settings) result_options_.push_back("--set=" + one);
    for (const std::string& one : disabled) result_options_.push_back("--disable=" + one);
    for (const std::string& one : faults) result_options_.push_back("--fault=" + one);
    if (!noise) result_options_.push_back("--no-noise");
    if (allow_absolute) result_options_.push_back("--allow-absolute");
    for (const ruedo::Plugin& each : ruedo::loaded_plugins())
      result_options_.push_back("--plugin=" + each.name + "@" + each.sha256);
    records_ = record;
    watch(false);
  }

  Engine& engine() const {
    if (!engine_) throw std::runtime_error("the engine was closed");
    refuse_others();
    return *engine_;
  }

  void close() {
    refuse_others();
    engine_.reset();
  }

  void step(int64_t steps, const Mask& which) {
    Engine& engine = this->engine();
    recorded_.clear();
    bool interrupted = false;
    {
      const AtWork at_work(*this);
      engine.step(steps, span_of(which), [&interrupted] {
        interrupted = interrupts();
        return !interrupted;
      });
    }
    if (interrupted) throw nb::python_error();  // what a signal's handler raised
  }

  void drive(const nb::ndarray<const double, nb::c_contig, nb::device::cpu>& velocities,
             const Mask& which) {
    engine().drive({velocities.data(), velocities.size()}, span_of(which));
  }

  void command(int world, const std::string& channel, const nb::bytes& message) {
    engine().command(world, channel, {static_cast<const uint8_t*>(message.data()), message.size()});
  }

  // texts: none, or one for each world.
  void reset(const std::vector<int>& worlds, const std::vector<uint64_t>& seeds,
             const std::vector<std::string>& texts) {
    Engine& engine = this->engine();
    refuse_in_a_run(worlds);
    recorded_.clear();
    const AtWork at_work(*this);
    std::vector<Engine::Reset> resets;
    for (size_t i = 0; i < worlds.size(); ++i)
      resets.push_back({worlds[i], seeds[i], texts.empty() ? nullptr : read(texts[i])});
    engine.reset(resets);
  }

  std::shared_ptr<const SavedWorld> save(int world) {
    Engine& engine = this->engine();
    const AtWork at_work(*this);
    return engine.save(world);
  }

  void restore(const Saved& saved, const std::vector<int>& worlds) {
    Engine& engine = this->engine();
    refuse_in_a_run(worlds);
    recorded_.clear();
    const AtWork at_work(*this);
    engine.restore(*saved.world, worlds);
  }

  std::vector<std::pair<std::string, double>> drawn(int world) const {
    return engine().drawn(world);
  }

  // Copy 0 is reset with that seed and is watched from its first state on. log: "" or the file
  // of what acts on it.
  void begin_run(uint64_t seed, const std::vector<std::string>& goals, bool no_contact,
                 std::optional<double> clearance, std::optional<double> odometry_error,
                 double clearance_reach, const std::string& robot, const std::string& log,
                 bool everything) {
    Engine& engine = this->engine();
    if (randomized_) throw ruedo::InputError({}, "a run that is judged cannot be randomized");
    ruedo::judge::Expectations expected;
    expected.robot = robot;
    for (const std::string& goal : goals) expected.goals.push_back(ruedo::judge::parse_goal(goal));
    expected.no_contact = no_contact;
    expected.clearance = clearance;
    expected.odometry_error = odometry_error;
    expected.clearance_reach = clearance_reach;
    const AtWork at_work(*this);
    run_.reset();
    if (!header_)
      header_ = ruedo::log::make_log_header(*world_, seed,
                                            result_options_);  // it hashes the world's files: once
    header_->seed = static_cast<int64_t>(seed);
    run_ = std::make_unique<WatchedRun>(world_, std::move(expected), *header_, log);
    engine.on_state(
        [this](int copy, const ruedo::Snapshot& snapshot, const ruedo::engine::Batch& batch) {
          if (copy == 0 && run_) run_->see(snapshot, batch, engine_->inputs(0));
        });
    watch(everything);
    recorded_.clear();
    engine.reset(0, seed);
  }

  // The outcome, as the JSON of a verdict; the log is complete then.
  std::string end_run() {
    Engine& engine = this->engine();
    if (!run_) throw std::runtime_error("no run was begun");
    run_->end();
    const std::string verdict = ruedo::judge::to_json(run_->judge().verdict());
    run_.reset();
    engine.on_state({});
    watch(false);
    return verdict;
  }

  std::vector<nb::bytes> files_read() const {
    std::vector<nb::bytes> paths;
    for (const std::string& path : world_->files_read) paths.emplace_back(path.data(), path.size());
    return paths;
  }

  nb::object touching() const { return view_of(engine().touching()); }

  auto collisions(int world) const { return engine().collisions(world); }

  nb::object observe(const std::string& device, const std::string& field) {
    return view_of(engine().observe(device, field));
  }

  nb::list messages() const {
    engine();  // throws
    nb::list list;
    for (const Recorded& one : recorded_)
      list.append(nb::make_tuple(one.world, one.step, one.channel,
                                 nb::bytes(one.bytes.data(), one.bytes.size())));
    return list;
  }

  std::vector<std::tuple<std::string, std::string, std::string>> devices() const {
    std::vector<std::tuple<std::string, std::string, std::string>> list;
    for (const auto& device : engine().devices())
      list.emplace_back(device.robot, device.name, device.kind);
    return list;
  }

  std::vector<std::string> findings() const {
    std::vector<std::string> texts;
    for (const std::string& text : findings_) texts.push_back(ruedo::printable(text));
    return texts;
  }

 private:
  // Other Python threads run, and may not use this engine meanwhile.
  class AtWork {
   public:
    explicit AtWork(PyEngine& engine) : mark_(engine.at_work_) {}

   private:
    struct Mark {
      explicit Mark(bool& which) : at_work(which) { at_work = true; }
      ~Mark() { at_work = false; }
      bool& at_work;
    };
    Mark mark_;
    Unlocked unlocked_;  // locked again first
  };
  void take(const std::vector<ruedo::Finding>& findings, bool allow_errors) {
    for (const ruedo::Finding& finding : findings) {
      const std::string text = finding.element + ": " + finding.text;
      if (finding.kind == ruedo::Finding::Kind::error && !allow_errors)
        throw ruedo::InputError(finding.source,
                                text + "; allow_errors=True takes the world as it is");
      findings_.push_back(finding.source.str() + ": " + text);
    }
  }

  void refuse_others() const {
    if (at_work_)
      throw std::runtime_error(
          "the engine is at work in another thread: it is for one at a time; make one for each");
  }

  // Messages are kept, judged and logged as they are wanted. everything: the log has all of them.
  void watch(bool everything) {
    if (!records_ && !run_) return engine_->on_message({});
    std::function<bool(const ruedo::engine::Channel&)> wants;
    if (!records_ && !everything)
      wants = [](const ruedo::engine::Channel& one) { return one.name.ends_with("/odometry"); };
    engine_->on_message(
        [this, everything](int copy, int64_t step, const ruedo::engine::Channel& channel,
                           std::span<const uint8_t> bytes) {
          if (records_)
            recorded_.push_back({copy,
                                 step,
                                 channel.bus_name,
                                 {reinterpret_cast<const char*>(bytes.data()), bytes.size()}});
          if (copy != 0 || !run_) return;
          run_->judge().see(channel.name, bytes);
          if (everything) run_->record_message(channel.bus_name, bytes);
        },
        std::move(wants));
  }

  void refuse_in_a_run(const std::vector<int>& worlds) const {
    if (run_ && std::find(worlds.begin(), worlds.end(), 0) != worlds.end())
      throw ruedo::InputError({}, "a run that is judged goes ahead alone: end_run() comes first");
  }

  // Texts that come again are read once.
  std::shared_ptr<const ruedo::world::WorldModel> read(const std::string& text) {
    constexpr size_t kMostKept = 256;
    if (const auto known = read_.find(text); known != read_.end()) return known->second;
    auto model = texts_->load(text);
    if (read_.size() == kMostKept) read_.clear();
    return read_[text] = std::move(model);
  }

  std::unique_ptr<ruedo::world::TextLoader> texts_;
  std::unordered_map<std::string, std::shared_ptr<const ruedo::world::WorldModel>> read_;
  std::unique_ptr<Engine> engine_;
  bool randomized_ = false, records_ = false, at_work_ = false;
  std::shared_ptr<const ruedo::world::WorldModel> world_;
  std::vector<std::string> findings_, result_options_;
  std::optional<ruedo::log_header_t> header_;
  std::unique_ptr<WatchedRun> run_;
  std::vector<Recorded> recorded_;
};

// Raised in Python with its text; paths in it need not be UTF-8.
template <class Error>
void add_exception(nb::module_& module, const char* name, PyObject* base) {
  const nb::exception<Error> type(module, name, base);
  nb::register_exception_translator(
      [](const std::exception_ptr& error, void* raised) {
        try {
          std::rethrow_exception(error);
        } catch (const Error& told) {
          PyErr_SetString(static_cast<PyObject*>(raised), ruedo::printable(told.what()).c_str());
        }
      },
      type.ptr());
}

}  // namespace

NB_MODULE(_engine, module) {
  nb::set_leak_warnings(false);  // a daemon thread may hold an engine when the program ends
  spdlog::set_default_logger(spdlog::stderr_color_mt("ruedo"));  // not on standard output
  spdlog::set_pattern("ruedo: %l: %v");
  module.attr("version") = ruedo::version();
  module.attr("build") = ruedo::log::own_version();
  add_exception<ruedo::InputError>(module, "InputError", PyExc_ValueError);
  add_exception<ruedo::EnvironmentError>(module, "EnvironmentError", PyExc_OSError);
  // Python's own are the C library's, whose last bit differs from one system to the next.
  module.def("sin", &ruedo::math::sin);
  module.def("cos", &ruedo::math::cos);
  add_arrivals(module);
  add_log_columns(module);
  nb::class_<Saved>(module, "Saved");
  nb::class_<PyEngine>(module, "Engine")
      .def(nb::init<const nb::bytes&, const std::optional<std::string>&, int, uint64_t, bool, int,
                    const std::vector<std::string>&, const std::vector<std::string>&,
                    const std::vector<std::string>&, const std::vector<std::string>&,
                    const std::vector<std::string>&, const std::vector<std::string>&,
                    const std::vector<std::string>&, bool, bool, bool>(),
           nb::arg("world"), nb::kw_only(), nb::arg("text") = nb::none(), nb::arg("worlds") = 1,
           nb::arg("seed") = 1, nb::arg("noise") = true, nb::arg("threads") = 0,
           nb::arg("spawn") = nb::list(), nb::arg("drive") = nb::list(),
           nb::arg("set") = nb::list(), nb::arg("disable") = nb::list(),
           nb::arg("fault") = nb::list(), nb::arg("randomize") = nb::list(),
           nb::arg("plugin") = nb::list(), nb::arg("record") = false,
           nb::arg("allow_errors") = false, nb::arg("allow_absolute") = false)
      .def("close", &PyEngine::close)
      .def("step", &PyEngine::step, nb::arg("steps"), nb::arg("which") = nb::none())
      .def("drive", &PyEngine::drive, nb::arg("velocities"), nb::arg("which") = nb::none())
      .def("command", &PyEngine::command)
      .def("reset", &PyEngine::reset, nb::arg("worlds"), nb::arg("seeds"),
           nb::arg("texts") = nb::list())
      .def("save", [](PyEngine& self, int world) { return Saved{self.save(world)}; })
      .def("restore", &PyEngine::restore)
      .def("drawn", &PyEngine::drawn)
      .def("observe", &PyEngine::observe)
      .def("begin_run", &PyEngine::begin_run, nb::arg("seed"), nb::kw_only(), nb::arg("goals"),
           nb::arg("no_contact"), nb::arg("clearance") = nb::none(),
           nb::arg("odometry_error") = nb::none(), nb::arg("clearance_reach"), nb::arg("robot"),
           nb::arg("log"), nb::arg("everything"))
      .def("end_run", &PyEngine::end_run)
      .def("files_read", &PyEngine::files_read)
      .def("touching", &PyEngine::touching)
      .def("collisions", &PyEngine::collisions)
      .def("messages", &PyEngine::messages)
      .def("devices", &PyEngine::devices)
      .def("findings", &PyEngine::findings)
      .def("worlds", [](const PyEngine& self) { return self.engine().worlds(); })
      .def("step_us", [](const PyEngine& self) { return self.engine().step_us(); })
      .def("current_step",
           [](const PyEngine& self, int world) { return self.engine().current_step(world); })
      .def("driven", [](const PyEngine& self) { return self.engine().driven(); })
      .def("state_hash",
           [](const PyEngine& self, int world) { return self.engine().state_hash(world); });
}
