// The C++ probe: does what a test asks of a client and prints the results. probe.py and Probe.java
// are its twins, with the same commands and output.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "ruedo/client.h"
#include "ruedo/joint_command_t.hpp"

namespace rc = ruedo::client;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kPatience = 300.0;         // s, for what comes sooner or later
constexpr std::chrono::seconds kAgain{60};  // for what follows soon, or never

std::string word(const std::string& text) { return text; }
std::string word(const char* text) { return text; }
std::string word(bool value) { return value ? "True" : "False"; }
std::string word(rc::MotionKind value) { return to_string(value); }
std::string word(rc::MotionState value) { return to_string(value); }
std::string word(rc::MotionReason value) {
  return value == rc::MotionReason::none ? "-" : to_string(value);
}
std::string word(double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%.6f", value);
  return text;
}
template <class Integer>
std::string word(Integer value) {
  return std::to_string(value);
}

template <class... Words>
void say(const Words&... words) {
  std::string line;
  ((line += (line.empty() ? "" : " ") + word(words)), ...);
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::puts(line.c_str());
  std::fflush(stdout);
}

void report(const std::string& what, const std::function<void()>& call) {
  try {
    call();
    say(what, "none");
  } catch (const rc::RunEnded& e) {
    say(what, "RunEnded:", e.what());
  } catch (const rc::NoServer& e) {
    say(what, "NoServer:", e.what());
  } catch (const rc::LaunchError& e) {
    say(what, "LaunchError:", e.what());
  } catch (const rc::UnknownName& e) {
    say(what, "UnknownName:", e.what());
  } catch (const rc::Timeout& e) {
    say(what, "Timeout:", e.what());
  } catch (const rc::TypeMismatch& e) {
    say(what, "TypeMismatch:", e.what());
  } catch (const rc::NotSupported& e) {
    say(what, "NotSupported:", e.what());
  } catch (const rc::MotionError& e) {
    say(what, "MotionError:", e.what());
  } catch (const rc::LeaseLost& e) {
    say(what, "LeaseLost:", e.what());
  } catch (const rc::RequestError& e) {
    say(what, "RequestError:", e.what());
  } catch (const rc::Error& e) {
    say(what, "RuedoError:", e.what());
  } catch (const std::invalid_argument& e) {
    say(what, "ValueError:", e.what());
  } catch (const std::logic_error& e) {  // what a callback threw
    say(what, e.what());
  }
}

size_t bodies_of_guest(const rc::Simulation& sim) {
  size_t count = 0;
  for (const rc::BodyInfo& body : sim.bodies()) count += body.name.rfind("guest/", 0) == 0;
  return count;
}

void list_all(const rc::Simulation& sim) {
  say("world", sim.world(), sim.seed(), sim.step_size());
  for (const rc::Robot& robot : sim.robots()) {
    const rc::RobotInfo info = robot.info();
    say("robot", robot.name(), info.drive.empty() ? "-" : info.drive, info.watchdog, info.track);
    for (const rc::DeviceInfo& d : robot.devices()) {
      say("device", robot.name(), d.name, d.kind, d.type, d.rate, d.range_max, d.elements.size());
    }
  }
  for (const rc::BodyInfo& body : sim.bodies()) say("body", body.name, body.is_static, body.mass);
}

void read(const rc::Simulation& sim, const std::string& name) {
  const rc::Robot robot = sim.robot(name);
  const auto scan = robot.lrf().latest(kPatience);
  say("scan", scan.ranges.size(), scan.angle(0), scan.angle(scan.ranges.size() - 1),
      scan.nearest(-kPi, kPi), scan.intensities.size());
  const auto reading = robot.sonar().latest(kPatience);
  say("sonar", reading.ranges.size(),
      static_cast<double>(*std::max_element(reading.ranges.begin(), reading.ranges.end())),
      reading.fired_utime.size(), reading.fresh.size());
  const auto odometry = robot.odometry().latest(kPatience);
  say("odometry", odometry.x, odometry.y, odometry.theta, odometry.wheel_angles.size());
  const auto pose = robot.pose().latest(kPatience);
  say("pose", pose.x(), pose.y(), pose.heading());
  const int64_t first = robot.lrf().next(kPatience).utime;
  const int64_t second = robot.lrf().next(kPatience).utime;
  say("next", second - first);
  for (const auto& device : robot.devices()) {
    if (device.type != "image_t") continue;
    const auto image = robot.camera().latest(kPatience);
    say("image", image.width, image.height,
        image.format == rc::Image::Format::jpeg ? "jpeg" : "other", !image.data.empty());
    break;
  }
}

double chord(double v, double omega, double time) {
  return std::abs(omega == 0.0 ? v * time : 2.0 * v / omega * std::sin(omega * time / 2.0));
}

// At the commanded speed, and for that long without a gap: a client that was not scheduled for a
// long time has to start over.
void drive(const rc::Simulation& sim, const std::vector<std::string>& a, bool wheels) {
  const rc::Robot robot = sim.robot(a[0]);
  const double first = std::stod(a[1]), second = std::stod(a[2]);
  wheels ? robot.set_wheels(first, second) : robot.set_velocity(first, second);
  const double v = wheels ? robot.info().wheel_radius * first : first,
               omega = wheels ? 0.0 : second;  // both sides alike
  (void)robot.pose().latest(kPatience);
  rc::MotionStatus status;
  double moved = 0.0, turned = 0.0, time = 0.0;
  for (bool steady = false; !steady;) {
    status = robot.motion().next(kPatience);
    if (std::abs(status.v - v) > 1e-6 || std::abs(status.omega - omega) > 1e-6) continue;
    const auto begin = robot.pose().next(kPatience);
    sim.sleep(std::stod(a[3]));
    const auto end = robot.pose().next(kPatience);
    time = end.time() - begin.time();
    moved = std::hypot(end.x() - begin.x(), end.y() - begin.y());
    turned = std::remainder(end.heading() - begin.heading(), 2 * kPi);
    steady = std::abs(moved - chord(v, omega, time)) < 1e-3 &&
             std::abs(std::remainder(turned - omega * time, 2 * kPi)) < 1e-3;
  }
  say("status", status.kind, status.state, status.v, status.omega);
  say("moved", moved, turned, time);
  robot.stop().wait(kPatience);
  say("stopped", robot.motion().next(kPatience).v);
}

void primitives(const rc::Simulation& sim, const std::string& name) {
  const rc::Robot robot = sim.robot(name);
  robot.stop().wait(kPatience);
  const auto run = [&](const char* what, const std::function<rc::Motion()>& start) {
    const auto begin = robot.pose().next(kPatience);
    sim.pause();  // else it may be over for a late client
    const rc::Motion motion = start();
    const bool early = motion.done();
    sim.resume();
    motion.wait(kPatience);
    const auto end = robot.pose().next(kPatience);
    say(what, early, motion.done(), motion.state(), motion.reason(),
        std::hypot(end.x() - begin.x(), end.y() - begin.y()),
        std::remainder(end.heading() - begin.heading(), 2 * kPi));
  };
  run("advance", [&] { return robot.advance(0.4, {.speed = 0.5}); });
  run("rotate", [&] { return robot.rotate(1.2); });
  run("turn_to", [&] { return robot.turn_to(0.0); });
  run("arc", [&] { return robot.arc(0.8, 0.5); });
  const rc::Motion replaced =
      robot.advance(5.0, {.speed = 0.05});  // slowly: a late client finds it under way
  sim.sleep(0.5);
  robot.stop().wait(kPatience);
  report("replaced", [&] { replaced.wait(); });
  const rc::Motion running = robot.advance(5.0, {.speed = 0.05});
  report("refused",
         [&] { robot.advance(2e6).wait(); });  // further than allowed: the current one continues
  report("too_long", [&] { running.wait(0.3); });
  robot.stop().wait(kPatience);
}

// Into the wall, off it, and into it again.
void collisions(const rc::Simulation& sim, const std::string& name) {
  const rc::Robot robot = sim.robot(name);
  const auto stream = robot.collisions();
  const auto or_none = [](const std::string& text) { return text.empty() ? "-" : text; };
  const rc::Collisions first = stream.latest(kPatience);
  say("free", first.points.size(), or_none(first.blocked_by));
  std::string met = "met";
  std::mutex mutex;
  {
    const rc::Subscription subscription = robot.on_collision([&](const rc::Collisions& sample) {
      const std::lock_guard lock(mutex);
      met += " " + sample.points.at(0).body;
    });
    for (const std::string what : {"once", "twice"}) {
      const rc::Motion motion = robot.advance(20.0);
      report(what, [&] { motion.wait(); });
      say(what + "_by", motion.blocked_by());
      const rc::Collisions seen = stream.latest(kPatience);
      std::set<std::string> bodies;
      for (const rc::ContactPoint& point : seen.points) bodies.insert(point.body);
      std::string line = what + "_seen " + seen.blocked_by;
      for (const std::string& body : bodies) line += " " + body;
      say(line);
      robot.advance(-0.5).wait(kPatience);
      while (!stream.next(kPatience).points.empty()) continue;
    }
  }
  say(met);
  say("off", or_none(stream.latest(kPatience).blocked_by));
}

void errors(const rc::Simulation& sim, const std::string& name) {
  report("robot", [&] { (void)sim.robot("nobody"); });
  const rc::Robot robot = sim.robot(name);
  report("device", [&] { (void)robot.device<rc::Scan>("nothing"); });
  report("nan", [&] { robot.set_velocity(std::nan(""), 0.0); });
  report("radius", [&] { robot.arc(1.0, 0.0); });
  report("limit", [&] { robot.advance(1.0, {.speed = -1.0}); });
  report("spawn", [&] { sim.spawn("no such model", 0.0, 0.0); });
}

void markers(const rc::Simulation& sim, const std::string& name) {
  namespace rm = rc::markers;
  const rc::Color red{1.0f, 0.0f, 0.0f, 0.5f};
  const std::vector<rc::Marker> all{rm::lines({{0, 0, 0}, {1, 0, 0}}, red, 0.02),
                                    rm::path({{0, 0, 0}, {1, 0, 0}, {1, 2, 0}}, red, 0.02),
                                    rm::points({{0, 0, 1}}, red, 0.1),
                                    rm::text("goal", {1, 2, 0.5}, red, 0.3),
                                    rm::map({0, 100, 255, 50}, 2, 0.5, {1, 1, 0}, kPi / 2, red)};
  sim.markers("plan", all, name);
  sim.markers("gone");
  report("lines", [&] { (void)rm::lines({{0, 0, 0}}, red, 0.02); });
  report("size", [&] { (void)rm::points({}, red, 0.0); });
  report("color", [&] { (void)rm::points({}, {2.0f, 0.0f, 0.0f, 1.0f}, 0.1); });
  report("cells", [&] { (void)rm::map({101}, 1, 0.5, {}, 0.0, red); });
  report("layer", [&] { sim.markers(""); });
  report("large", [&] { sim.markers("large", {rm::points(rm::Points(6000), red, 0.1)}); });
  (void)sim.state();
  sim.sleep(0.2);
}

void streams(const rc::Simulation& sim, const std::string& name, double lrf, double odometry) {
  const rc::Robot robot = sim.robot(name);
  report("lrf", [&] { (void)robot.lrf().latest(lrf); });
  report("odometry", [&] { (void)robot.odometry().latest(odometry); });
}

void control(const rc::Simulation& sim, const std::string& name) {
  sim.pause();
  const auto before = sim.state();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  say("paused", before.paused, sim.state().step == before.step);
  say("step", sim.step(7).step - before.step);
  say("name", sim.state(name).name, sim.state(name).position[0]);
  sim.set_rate(2.0);
  sim.resume();
  sim.sleep(0.2);
  say("rate", sim.state().rate);
  sim.pause();
  sim.reset();
  say("reset", sim.state().step);
  report("unknown", [&] { (void)sim.state("nobody"); });
  report("steps", [&] { sim.step(0); });
}

void snapshots(const rc::Simulation& sim) {
  const std::string first = sim.spawn("p3at", 3.0, 1.0), second = sim.spawn("p3at", 3.0, -1.0);
  say("names", first, second, sim.spawn("p3at", -3.0, 1.0, {.name = "guest"}));
  sim.step(40);
  const rc::State saved = sim.snapshot("here");
  const rc::State later = sim.step(60);
  const rc::State back = sim.restore("here");
  say("same", back.step == saved.step, back.state_hash == saved.state_hash,
      sim.step(60).state_hash == later.state_hash);
  say("steps", saved.step, later.step);
}

void sleeps(const rc::Simulation& sim, double seconds) {
  double begin = sim.time();
  sim.sleep(rc::Duration(seconds));
  say("slept", begin, sim.time() - begin);
  sim.snapshot("here");
  begin = sim.restore("here").time();
  sim.sleep(rc::Duration(seconds));
  say("slept_again", begin, sim.time() - begin);
}

void world(const rc::Simulation& sim, const std::string& text) {
  sim.spawn("p3at", 3.0, 1.0, {.name = "guest"});
  const rc::Robot guest = sim.robot("guest");
  say("there", sim.state("guest").position[0], sim.robots().size(), bodies_of_guest(sim));
  guest.set_velocity(0.3, 0.0);
  while (sim.state("guest").position[0] <= 3.05) sim.sleep(0.1);
  say("drives", true, guest.lrf().latest(kPatience).ranges.size());
  guest.stop().wait(kPatience);
  sim.set_pose("guest", 3.0, 2.0, 1.0);
  say("put", sim.state("guest").position[1]);
  sim.spawn("", -3.0, 2.0, {.name = "ball", .text = text});
  sim.set_twist("ball", {0.0, 1.0, 0.0});
  sim.sleep(0.3);
  say("rolls", sim.state("ball").position[1] > 2.05);
  report("taken", [&] { sim.spawn("p3at", -3.0, -2.0, {.name = "guest"}); });
  report("room", [&] { sim.spawn("p3at", 3.0, 2.0); });
  report("text", [&] { sim.spawn("", 0.0, -3.0, {.text = "<sdf"}); });
  report("driven", [&] { sim.set_twist("guest", {1.0, 0.0, 0.0}); });
  sim.reset(rc::Reset::poses);
  say("poses", sim.state("guest").position[1], sim.state().time() > 1.0);
  sim.pause();
  sim.reset(rc::Reset::time);
  say("time", sim.state().time() < 1.0, sim.robots().size());
  sim.resume();
  sim.remove("guest");
  say("gone", sim.robots().size(), bodies_of_guest(sim));
  report("unknown", [&] { sim.remove("guest"); });
}

// CRC-32, as zlib's.
uint32_t crc32(uint32_t crc, const uint8_t* bytes, size_t size) {
  crc = ~crc;
  for (size_t i = 0; i < size; ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
  }
  return ~crc;
}

void lockstep(const rc::Simulation& sim, const std::vector<std::string>& a) {
  const rc::Robot robot = sim.robot(a[1]);
  const int64_t steps = std::stol(a[2]), chunk = std::stol(a[3]);
  const auto pose = robot.pose();
  const auto odometry_device = robot.odometry();
  uint32_t digest = 0;
  size_t messages = 0, poses = 0;
  rc::Odometry odometry;
  const auto take = [&](const rc::Observations& observations) {
    for (const auto& message : observations.messages) {
      digest = crc32(digest, reinterpret_cast<const uint8_t*>(message.channel.data()),
                     message.channel.size());
      digest = crc32(digest, message.bytes.data(), message.bytes.size());
      ++messages;
    }
    poses += observations.all(pose).size();
    if (const auto latest = observations.latest(odometry_device)) odometry = *latest;
  };
  rc::Observations last = sim.step(0);
  say("begin", last.step, last.time());
  take(last);
  for (int64_t step = 0; step < steps; step += chunk) {
    std::vector<rc::Command> commands;
    for (int64_t k = 0; k < chunk; ++k)
      commands.push_back(
          robot.velocity_command(std::stod(a[4]), 0.1 * static_cast<double>(k)).at(k));
    last = sim.step(chunk, commands);
    take(last);
  }
  say("end", last.step, last.state_hash, messages, poses, digest);
  say("odometry", odometry.utime, odometry.x);
  report("past", [&] { sim.step(1, {robot.velocity_command(0.1, 0.0).at(1)}); });
}

void given_up(const rc::Simulation& sim) {
  sim.step(0);
  try {
    sim.step(2000, {}, 0.0);
    say("given_up", "no");
  } catch (const rc::Timeout&) {
    say("given_up", "Timeout");
  }
  const int64_t first = sim.step(1).step;
  say("then", first, sim.step(1).step);
}

void visited(const rc::Simulation& sim, const std::vector<std::string>& a) {
  const rc::Robot robot = sim.robot(a[1]);
  uint32_t digest = 0;
  size_t messages = 0, of_guest = 0;
  std::string guest;
  rc::Observations last;
  for (int turn = 0; turn < 9; ++turn) {
    if (turn == 3) {
      guest = sim.spawn("p3at", 3.0, 1.0);
      say("guest", guest);
    }
    if (turn == 6) sim.remove(guest);
    std::vector<rc::Command> commands{robot.velocity_command(0.3, 0.2)};
    if (turn >= 3 && turn < 6)
      commands.push_back(sim.robot(guest).velocity_command(0.2, -0.3).at(5));
    last = sim.step(10, commands);
    for (const auto& message : last.messages) {
      digest = crc32(digest, reinterpret_cast<const uint8_t*>(message.channel.data()),
                     message.channel.size());
      digest = crc32(digest, message.bytes.data(), message.bytes.size());
      ++messages;
      of_guest += message.channel.rfind("p3at_2/", 0) == 0;
    }
  }
  say("end", last.step, last.state_hash, messages, of_guest, digest);
}

// Commands that go with no step.
void beside(const rc::Simulation& sim, const std::vector<std::string>& a) {
  const rc::Robot robot = sim.robot(a[1]);
  report("before", [&] { robot.set_velocity(0.3, 0.0); });
  sim.step(0);
  report("velocity", [&] { robot.set_velocity(0.3, 0.0); });
  report("wheels", [&] { robot.set_wheels(1.0, 1.0); });
  report("advance", [&] { robot.advance(1.0); });
  report("rotate", [&] { robot.rotate(1.0); });
  report("turn_to", [&] { robot.turn_to(1.0); });
  report("arc", [&] { robot.arc(1.0, 0.5); });
  report("stop", [&] { robot.stop(); });
  const rc::Observations last = sim.step(200);
  say("end", last.step, last.state_hash, last.messages.size());
}

// Sends them all to 0.2, in lockstep.
void joints(const rc::Simulation& sim, const std::vector<std::string>& a) {
  ruedo::joint_command_t order{};
  order.name.assign(a.begin() + 2, a.end());
  order.n = static_cast<int32_t>(order.name.size());
  order.mode.assign(order.name.size(), ruedo::joint_command_t::POSITION);
  order.value.assign(order.name.size(), 0.2);
  std::vector<uint8_t> bytes(static_cast<size_t>(order.getEncodedSize()));
  order.encode(bytes.data(), 0, order.getEncodedSize());
  sim.step(0);
  report("joints", [&] { sim.step(1, {{a[1] + "/joint_command", bytes}}); });
  say("then", sim.step(1).step);
}

void sideways(const rc::Simulation& sim, const std::string& name) {
  const rc::Robot robot = sim.robot(name);
  report("command", [&] { static_cast<void>(robot.velocity_command(0.2, 0.1, 0.3)); });
  report("velocity", [&] { robot.set_velocity(0.2, 0.1, 0.3); });
  report("none", [&] { robot.set_velocity(0.0, 0.0, 0.0); });
}

// Lockstep in which others act.
void watches(const rc::Simulation& sim, const std::vector<std::string>& a) {
  const rc::Observations seen = sim.step(0);
  say("begin", seen.step, seen.time(), seen.state_hash);
  const rc::Observations last = sim.step(std::stoi(a[1]));
  uint32_t digest = 0;
  for (const auto& message : last.messages) {
    digest = crc32(digest, reinterpret_cast<const uint8_t*>(message.channel.data()),
                   message.channel.size());
    digest = crc32(digest, message.bytes.data(), message.bytes.size());
  }
  say("end", last.step, last.state_hash, last.messages.size(), digest);
}

[[noreturn]] void launched(const std::vector<std::string>& a) {
  rc::LaunchOptions options;
  options.seed = 3;
  options.args.assign(a.begin() + 1, a.end());
  const rc::Simulation sim = rc::launch(a[0], options);
  say("url", sim.url());
  say("ready", sim.robots().at(0).odometry().latest(kPatience).time() >= 0.0);
  while (true) std::this_thread::sleep_for(std::chrono::seconds(1));
}

// text: of a world, instead of the world.
void launched_with(const std::string& world, const std::string& text) {
  rc::LaunchOptions options;
  options.seed = 5;
  options.lockstep = 1;
  options.spawn = {"p3at:guest@2,0"};
  options.disable = {"p3at/camera", "guest/camera"};
  options.settings = {{"p3at/lrf.update_rate", 20}};
  options.noise = false;
  options.text = text;
  options.timeout = 400.0;
  const rc::Simulation sim = rc::launch(world, options);
  std::string names;
  for (const rc::Robot& robot : sim.robots()) names += (names.empty() ? "" : " ") + robot.name();
  say("robots", names);
  say("seed", sim.seed());
  const rc::Robot robot = sim.robot("p3at");
  std::string devices;
  for (const rc::DeviceInfo& device : robot.devices()) devices += device.name + " ";
  say("devices", devices);
  say("rate", robot.lrf().info().rate);
  const rc::Observations seen = sim.step(20, {robot.velocity_command(0.3, 0.0)});
  say("scans", seen.all(robot.lrf()).size(), seen.latest(robot.lrf())->ranges[90]);
}

double ahead(const rc::Scan& scan) {
  return *std::min_element(scan.ranges.begin() + 60, scan.ranges.begin() + 120);
}

// Of the newest sample, s of sim time; without the real time that the question takes, in which sim
// time goes on.
template <class Stream>
void say_age(const rc::Simulation& sim, const Stream& stream) {
  const auto begin = std::chrono::steady_clock::now();
  const double newest = stream.latest(kPatience).time();
  const double now = sim.state().time();
  const std::chrono::duration<double> asked = std::chrono::steady_clock::now() - begin;
  say("age", now - newest - asked.count());
}

// A program in a run that it launched: it reads now and then, works in a callback, and acts on its
// samples.
void keeps_up(const std::string& rate) {
  const auto nap = [](double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); };
  rc::LaunchOptions options;
  options.rate = rate == "max" ? rc::kFast : std::stod(rate);
  options.noise = false;
  options.disable = {"p3at/camera"};
  const rc::Simulation sim = rc::launch("arena", options);
  const rc::Robot robot = sim.robot("p3at");
  const auto lrf = robot.lrf();
  for (int i = 0; i < 5; ++i) {
    nap(0.2);
    say_age(sim, robot.pose());
  }
  std::vector<double> seen;
  {
    const rc::Subscription subscription = lrf.on_sample([&](const rc::Scan& scan) {
      seen.push_back(scan.time());
      nap(0.15);
    });
    sim.sleep(2.0);
    say_age(sim, robot.odometry());
  }
  double gap = 0.0;
  for (size_t i = 1; i < seen.size(); ++i) gap = std::max(gap, seen[i] - seen[i - 1]);
  say("seen", seen.size(), gap, lrf.dropped());
  for (int i = 0; i < 10; ++i) {
    robot.rotate(0.1).wait(kPatience);
    const double heading = robot.pose().next(kPatience).heading();
    sim.sleep(0.2);
    say("after", std::abs(robot.pose().latest(kPatience).heading() - heading));
  }
  robot.turn_to(0.0).wait(kPatience);
  while (ahead(lrf.next(kPatience)) > 0.8) robot.set_velocity(0.4, 0.0);
  robot.set_velocity(0.0, 0.0);
  sim.sleep(2.0);
  say("stands", ahead(lrf.next(kPatience)));
}

// A program that does something else after it has launched a run at the highest rate.
void begins_late(const std::string& first_call) {
  const auto begun = std::chrono::steady_clock::now();
  const auto since = [](const auto& begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  rc::LaunchOptions options;
  options.rate = rc::kFast;
  options.noise = false;
  options.disable = {"p3at/camera"};
  const rc::Simulation sim = rc::launch("arena", options);
  const auto poses = sim.robot("p3at").pose();
  double stands = 0.0;
  while ((stands = sim.state().time()) < 2.0)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  say("before", stands, since(begun));
  if (first_call == "latest") say("latest", poses.latest(kPatience).time(), since(begun));
  const auto called = std::chrono::steady_clock::now();
  if (first_call == "on_sample") {
    std::promise<void> done;
    const rc::Subscription subscription = poses.on_sample([&](const rc::Pose& pose) {
      if (pose.time() >= 100.0 && pose.time() < 100.005) done.set_value();
    });
    done.get_future().wait_for(std::chrono::duration<double>(kPatience));
  } else {
    sim.sleep(100.0 - sim.time());
  }
  say("after", since(called));
}

void many_primitives(const rc::Simulation& sim, const std::string& name, int count) {
  const rc::Robot robot = sim.robot(name);
  int done = 0;
  for (int i = 0; i < count; ++i)
    done += robot.rotate(i % 2 ? 0.02 : -0.02).wait(kPatience).done() ? 1 : 0;
  say("done", done);
}

// Of the server that takes the place of this one.
void heard_again(const rc::Simulation& sim, const std::string& name) {
  std::promise<void> begun;
  const rc::Subscription news = sim.on_new_run([&] { begun.set_value(); });
  sim.robot(name).pose().next(kPatience);
  say("heard", "first");
  if (begun.get_future().wait_for(kAgain) == std::future_status::timeout) return;
  sim.robot(name).pose().next(kPatience);
  say("heard", "again");
}

void read_log(const std::vector<std::string>& a) {
  const rc::Log log = rc::read_log(a[0]);
  std::string names;
  for (const std::string& name : log.channels()) names += (names.empty() ? "" : " ") + name;
  say("channels", names);
  const auto scans = log.samples<rc::Scan>("p3at/lrf");
  say("scans", scans.size(), log.count("p3at/lrf"), scans.back().utime, scans.back().ranges[90]);
  const auto poses = log.samples<rc::Pose>("p3at/pose");
  say("poses", poses.size(), poses.back().utime, poses.back().position[0]);
  say("raw", log.samples<rc::RawSample>("p3at/pose").back().bytes.size());
  say("fault", log.fault());
  std::vector<int64_t> times;
  const double begin = a.size() > 1 ? std::stod(a[1]) : 0.3;
  log.each<rc::Pose>(
      "p3at/pose", [&](const rc::Pose& each) { times.push_back(each.utime); }, begin, begin + 0.2);
  say("range", times.size(), times.front(), times.back());
  log.each<rc::Pose>("p3at/pose", [&](const rc::Pose& each) { times.push_back(each.utime); }, 1e6);
  say("beyond", times.size());
  report("unknown", [&] { static_cast<void>(log.samples<rc::Scan>("nobody")); });
  report("mismatch", [&] { static_cast<void>(log.samples<rc::Scan>("p3at/pose")); });
}

// In a callback, while the step that calls it is under way.
void leaves(rc::Simulation& sim, const std::vector<std::string>& a) {
  const rc::Subscription calls =
      sim.robot(a[1]).odometry().on_sample([&](const rc::Odometry&) { sim.close(); });
  try {
    static_cast<void>(sim.step(1000));
  } catch (const rc::NoServer&) {
    say("left");
  }
}

// Primitives of another client of this process, or of the same name, are not its own.
void apart(const std::string& url, const std::string& name) {
  for (int i = 0; i < 8; ++i) {
    const std::string own = i % 2 == 0 ? "" : "driver";
    const std::string what = own.empty() ? "unnamed" : own;
    const rc::Simulation first = rc::connect(url, {.name = own, .timeout = 60.0});
    const rc::Motion running = first.robot(name).advance(5.0, {.speed = 0.05});
    while (running.progress() == 0.0 && !running.done())  // done: lost on the way
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const rc::Simulation second = rc::connect(url, {.name = own, .timeout = 60.0});
    report(what, [&] { second.robot(name).advance(0.02).wait(kPatience); });
    report("first_" + what, [&] { running.wait(kPatience); });
  }
}

void pause_for(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

// A callback does. how: what the program does then.
void fails(const std::string& url, const std::string& how) {
  std::atomic<bool> failed{false};
  std::atomic<int> others{0};
  auto sim = std::make_unique<rc::Simulation>(rc::connect(url, {.name = "", .timeout = 60.0}));
  const rc::Robot robot = sim->robot("p3at");
  const auto odometry = robot.odometry();
  odometry.on_sample([&](const rc::Odometry&) { ++others; }).keep();
  odometry  // the last call before the one that throws
      .on_sample([&](const rc::Odometry&) {
        if (!failed.exchange(true)) throw std::logic_error("a fault of the user's");
      })
      .keep();
  while (!failed && how != "sleep") pause_for(0.01);
  if (how != "sleep") pause_for(0.3);  // that it is kept
  if (how == "forget") {
    static_cast<void>(sim.release());
    std::exit(0);  // what the callbacks refer to stays
  }
  if (how == "close") {
    report("raised", [&] { sim->close(); });
    report("once", [&] { sim->close(); });
  } else if (how == "other") {
    try {
      const auto there = std::move(sim);
      throw std::out_of_range("another fault");
    } catch (const std::out_of_range& error) {
      say("won", error.what());
    }
  } else if (how != "leave") {
    report("raised", [&] {
      if (how == "latest") static_cast<void>(odometry.latest());
      if (how == "sleep") sim->sleep(kPatience);
      if (how == "command") robot.set_velocity(0.0, 0.0);
      if (how == "request") static_cast<void>(sim->state());
    });
    report("once", [&] { static_cast<void>(odometry.latest()); });
    // The next sample comes sooner or later.
    for (double waited = 0.0; others < 2 && waited < kPatience; waited += 0.01) pause_for(0.01);
    say("others", others > 1);
  }
}

// The run does, while a call waits for it.
void ends(const std::string& url, const std::string& call) {
  std::atomic<bool> ended{false};
  rc::Simulation sim = rc::connect(url, {.name = "", .timeout = 60.0});
  const rc::Robot robot = sim.robot("p3at");
  if (call == "uncaught_failed") {
    robot.odometry()
        .on_sample([&](const rc::Odometry&) {
          while (!ended) pause_for(0.01);
          throw std::logic_error("a fault of the user's");
        })
        .keep();
  }
  if (!sim.lockstep()) sim.resume();
  say("joined");
  if (call.rfind("uncaught", 0) == 0) {
    try {
      sim.sleep(kPatience);
    } catch (...) {
      ended = true;
      pause_for(0.3);
      throw;
    }
  }
  report("ended", [&] {
    while (call == "next") static_cast<void>(robot.odometry().next(kPatience));
    if (call == "sleep") sim.sleep(kPatience);
    if (call == "wait") robot.advance(5.0, {.speed = 0.01}).wait();
    while (call == "step") static_cast<void>(sim.step(20));
  });
  report("request", [&] { static_cast<void>(sim.state()); });
}

// Sim time does.
void stands(const std::string& url, const std::string& call) {
  rc::Simulation sim = rc::connect(url, {.name = "waits", .timeout = 60.0});
  if (call == "stepped") static_cast<void>(sim.step(1));
  std::optional<rc::Motion> motion;
  if (call == "wait" || call == "sleep") {
    motion = sim.robot("p3at").advance(1.0);
    report("timeout", [&] { motion->wait(1.2); });
  }
  std::thread closing([&] {
    pause_for(8.0);
    sim.close();
  });
  report("ended", [&] { call == "wait" ? static_cast<void>(motion->wait()) : sim.sleep(1.0); });
  closing.join();
}

void act(const std::string& url, const std::string& command, const std::vector<std::string>& a) {
  if (command == "launch") launched(a);
  if (command == "launch_with") return launched_with(a[0], a.size() > 1 ? a[1] : "");
  if (command == "keeps_up") return keeps_up(a[0]);
  if (command == "begins_late") return begins_late(a[0]);
  if (command == "log") return read_log(a);
  if (command == "apart") return apart(url, a[0]);
  const bool named =
      std::set<std::string>{"lockstep", "visited", "watches", "leaves", "beside", "joints"}
          .contains(command);
  rc::Simulation sim =
      rc::connect(url, {.name = named ? a[0] : "", .timeout = command == "connect" ? 2.0 : 60.0});
  if (command == "leaves") leaves(sim, a);
  if (command == "lockstep") lockstep(sim, a);
  if (command == "visited") visited(sim, a);
  if (command == "watches") watches(sim, a);
  if (command == "beside") beside(sim, a);
  if (command == "joints") joints(sim, a);
  if (command == "sideways") sideways(sim, a[0]);
  if (command == "given_up") given_up(sim);
  if (command == "connect") say("connected", sim.world());
  if (command == "list") list_all(sim);
  if (command == "read") read(sim, a[0]);
  if (command == "velocity") drive(sim, a, false);
  if (command == "wheels") drive(sim, a, true);
  if (command == "primitives") primitives(sim, a[0]);
  if (command == "many_primitives") many_primitives(sim, a[0], std::stoi(a[1]));
  if (command == "heard_again") heard_again(sim, a[0]);
  if (command == "collisions") collisions(sim, a[0]);
  if (command == "errors") errors(sim, a[0]);
  if (command == "markers") markers(sim, a[0]);
  if (command == "streams") streams(sim, a[0], std::stod(a[1]), std::stod(a[2]));
  if (command == "control") control(sim, a[0]);
  if (command == "world") world(sim, a[0]);
  if (command == "snapshots") snapshots(sim);
  if (command == "sleeps") sleeps(sim, std::stod(a[0]));
  if (command == "quit") {
    sim.quit();
    say("quit", true);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const std::string command = argv[2];
  void (*const of_endings)(const std::string&, const std::string&) = command == "fails"  ? fails
                                                                     : command == "ends" ? ends
                                                                     : command == "stands"
                                                                         ? stands
                                                                         : nullptr;
  if (of_endings) return of_endings(argv[1], argv[3]), 0;
  bool failed = true;
  report("failed", [&] {
    act(argv[1], argv[2], {argv + 3, argv + argc});
    failed = false;
    std::exit(0);
  });
  return failed;
}
