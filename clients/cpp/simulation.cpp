// connect(), launch(), and the requests of simulation control.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core.h"
#include "ruedo/request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"
#include "ruedo/step_request_t.hpp"
#include "server_process.h"
#include "transport/address.h"

namespace ruedo::client {
namespace {

constexpr Duration kReplyTime = 5.0, kSlowReplyTime = 60.0;

Quaternion about_z(double heading) {
  return {std::cos(heading / 2.0), 0.0, 0.0, std::sin(heading / 2.0)};
}

}  // namespace

Simulation connect(const std::string& url, const ConnectOptions& options) {
  const std::string name =
      options.name.empty() ? "client-" + std::to_string(getpid()) : options.name;
  auto core = std::make_shared<Core>(resolve_url(url), name, nullptr);
  core->join(options.timeout);
  return Simulation(std::move(core));
}

Simulation launch(const std::string& world, const LaunchOptions& options) {
  auto server = std::make_unique<ServerProcess>(world, options);
  ServerProcess& process = *server;
  try {
    auto core = std::make_shared<Core>(process.url(), options.name, std::move(server));
    core->join(options.timeout);
    return Simulation(std::move(core));
  } catch (const NoServer& error) {
    throw LaunchError(error.what());
  }
}

namespace {

// In a fork's child the parent's connection is kept as it is: it can be neither used nor ended.
void end(std::shared_ptr<Core> core) {
  if (!core) return;
  core->close();
  if (!core->forked()) core->faults().print();
  static auto* const parents = new std::vector<std::shared_ptr<Core>>;
  if (core->forked()) parents->push_back(std::move(core));
}

}  // namespace

Simulation::~Simulation() { end(std::move(core_)); }

Simulation& Simulation::operator=(Simulation&& other) noexcept {
  if (this != &other) {
    end(std::move(core_));
    core_ = std::move(other.core_);
  }
  return *this;
}

Simulation::Simulation(std::shared_ptr<Core> core) : Requests(std::move(core)) {}

std::shared_ptr<Core> Requests::core() const {
  if (!core_) throw NoServer(kClosed);
  return core_;
}

void Simulation::close() {
  const auto core = core_;
  if (!core) return;
  core->close();
  if (core->forked() || core->is_called_back()) return;
  if (std::uncaught_exceptions() > 0)
    core->faults().print();
  else
    core->faults().rethrow();
}

std::string Simulation::url() const { return core()->url(); }
std::string Simulation::version() const { return core()->info()->version; }
std::string Simulation::world() const { return core()->info()->world; }
int64_t Simulation::seed() const { return core()->info()->seed; }
double Simulation::step_size() const { return static_cast<double>(core()->info()->step_us) * 1e-6; }
double Simulation::time() const { return static_cast<double>(core()->utime()) * 1e-6; }
bool Simulation::paused() const { return core()->info()->paused; }

std::vector<BodyInfo> Simulation::bodies() const { return core()->info()->bodies; }

std::vector<Robot> Simulation::robots() const {
  const auto info = core()->info();  // the receiving thread may replace it at any time
  std::vector<Robot> robots;
  for (const RobotInfo& robot : info->robots) robots.emplace_back(core(), robot.name);
  return robots;
}

Robot Simulation::robot(const std::string& name) const {
  core()->robot_info(name);
  return {core(), name};
}

void Simulation::sleep(Duration time) const {
  constexpr double kLongest = 1e12;  // s
  if (std::isnan(time.count())) throw std::invalid_argument("a time of nan s");
  const auto core = this->core();
  const double seconds = std::clamp(time.count(), -kLongest, kLongest);
  core->sleep(std::llround(seconds * 1e6));
}

void Simulation::publish(const std::string& channel, const std::vector<uint8_t>& bytes) const {
  const auto core = this->core();
  core->check_open();
  core->bus().publish(channel, bytes.data(), bytes.size());
}

Every Simulation::every(Duration period) const {
  const int64_t period_us = std::isfinite(period.count()) ? std::llround(period.count() * 1e6) : 0;
  if (period_us < 1)
    throw std::invalid_argument("period is " + text_of(period) +
                                ": it must be a number of seconds above 0");
  return {core(), period_us};
}

// Until the next multiple of the period; those that have passed meanwhile are left out.
std::optional<double> Every::next() const {
  core_->check_open();
  if (core_->in_lockstep()) throw NotSupported("in lockstep, only sim.step(n) advances time");
  const int64_t begin = core_->utime();
  const int64_t following = (begin / period_us_ + 1) * period_us_;
  const bool in_time = begin < next_us_ + period_us_ && next_us_ + period_us_ <= following;
  next_us_ = in_time ? next_us_ + period_us_ : following;  // the first, late, or a reset
  try {
    core_->sleep(next_us_ - begin);
  } catch (const RunEnded&) {
    return std::nullopt;
  }
  return static_cast<double>(next_us_) * 1e-6;
}

Subscription Simulation::on_new_run(std::function<void()> callback) const {
  return core()->on_new_run(std::move(callback));
}

Observations Simulation::step(int64_t n, const std::vector<Command>& commands,
                              Duration timeout) const {
  if (lockstep()) return core()->stepper().step(n, commands, timeout);
  if (!commands.empty()) {
    throw NotSupported(
        "commands go with steps where the server runs in lockstep: start it with `ruedo run "
        "--lockstep N`");
  }
  step_request_t body;
  body.steps = n;
  return {state_of(core()->session().request(request_t::STEP, encoded(body), timeout)), {}};
}

bool Simulation::lockstep() const { return core()->in_lockstep(); }

void Simulation::reset(Reset what, int64_t seed) const {
  reset_request_t body;
  body.what = what == Reset::all    ? reset_request_t::ALL
              : what == Reset::time ? reset_request_t::TIME
                                    : reset_request_t::POSES;
  body.seed = seed;
  core()->session().request(request_t::RESET, encoded(body), kSlowReplyTime);
  if (what == Reset::poses) return;
  core()->clock().reset(0);
  core()->stepper().forget();
}

std::string Simulation::spawn(const std::string& model, double x, double y,
                              const SpawnOptions& options) const {
  spawn_request_t body{};
  body.name = options.name;
  body.model = model;
  body.text = options.text;
  body.on_ground = options.on_ground;
  body.position[0] = x;
  body.position[1] = y;
  body.position[2] = options.z;
  const Quaternion orientation = about_z(options.heading);
  std::copy(orientation.begin(), orientation.end(), body.orientation);
  const auto before = core()->info();
  const Reply reply = core()->session().request(request_t::SPAWN, encoded(body), kSlowReplyTime);
  core()->refresh_info(before);
  return state_of(reply).name;
}

void Simulation::remove(const std::string& name) const {
  const auto before = core()->info();
  Requests::remove(name);
  core()->refresh_info(before);
}

void Simulation::set_pose(const std::string& name, const Vector3& position,
                          const Quaternion& orientation) const {
  set_pose_request_t body;
  body.name = name;
  std::copy(position.begin(), position.end(), body.position);
  std::copy(orientation.begin(), orientation.end(), body.orientation);
  core()->session().request(request_t::SET_POSE, encoded(body), kReplyTime);
}

void Simulation::set_pose(const std::string& name, double x, double y, double heading,
                          double z) const {
  set_pose(name, {x, y, z}, about_z(heading));
}

State Simulation::restore(const std::string& name) const {
  const State state = Requests::restore(name);
  core()->clock().reset(state.utime);
  core()->stepper().forget();
  return state;
}

void Simulation::quit() const {
  try {
    Requests::quit();
  } catch (const RunEnded&) {  // its last word may come before the reply, or without
  }
}

}  // namespace ruedo::client
