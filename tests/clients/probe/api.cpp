// The client's API for textbook programs, in C++; api.py and Api.java are its twins, with the
// same commands and output.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "ruedo/client.h"

namespace rc = ruedo::client;

namespace {

constexpr double kPatience = 300.0;  // s, for what comes sooner or later

std::string word(const std::string& text) { return text; }
std::string word(const char* text) { return text; }
std::string word(bool value) { return value ? "True" : "False"; }
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

void attempt(const std::string& what, const std::function<void()>& call) {
  try {
    call();
    say(what, "none");
  } catch (const rc::UnknownName& error) {
    say(what, "UnknownName:", error.what());
  } catch (const rc::NotSupported& error) {
    say(what, "NotSupported:", error.what());
  } catch (const rc::Timeout& error) {
    say(what, "Timeout:", error.what());
  } catch (const rc::RequestError& error) {
    say(what, "RequestError:", error.what());
  } catch (const std::invalid_argument& error) {
    say(what, "ValueError:", error.what());
  } catch (const rc::Error& error) {
    say(what, "Error:", error.what());
  }
}

void joints(const rc::Simulation& sim) {
  const rc::Robot robot = sim.robot("arm");
  for (const std::string& name : sim.joint_limits("arm").names) {
    const rc::Joint joint = robot.joint(name);
    say(name, joint.kind(), joint.takes_commands(), joint.holds(), joint.lower(), joint.upper());
    say(name + "_most", joint.max_velocity(), joint.max_effort());
  }
  attempt("unknown", [&] { (void)robot.joint("elbo"); });
  attempt("unknown_command", [&] { robot.command_joints({{"elbo", 1.0}}); });
  attempt("nan", [&] { robot.command_joints({{"elbow", std::nan("")}}); });
  attempt("mimic", [&] { robot.command_joints({{"finger", 0.1}}); });
  attempt("unknown_state", [&] { (void)robot.joints().latest(kPatience).position("elbo"); });
  robot.command_joints({{"shoulder", 0.5}, {"wrist", -0.25}});
  while (std::abs(robot.joint("shoulder").position() - 0.5) > 1e-3) sim.sleep(0.05);
  sim.sleep(1.0);
  const rc::Joints state = robot.joints().next(kPatience);
  say("reached", state.position("shoulder"), state.position("wrist"), state.position("elbow"));
  const rc::Joint joint = robot.joint("elbow");
  joint.set_velocity(0.2);
  sim.sleep(1.0);
  say("velocity", joint.velocity());
  robot.command_joints({{"elbow", 0.0}}, rc::JointMode::velocity);
  robot.joint("wrist").set_position(9.0);  // beyond its limit
  sim.sleep(2.0);
  say("limited", robot.joint("wrist").position());
}

void joints_in_lockstep(const rc::Simulation& sim) {
  const rc::Robot robot = sim.robot("arm");
  sim.step(0);
  attempt("at_once", [&] { robot.command_joints({{"elbow", 0.1}}); });
  const rc::Observations seen = sim.step(400, {robot.joint_command({{"elbow", 0.1}})});
  say("reached", seen.latest(robot.joints())->position("elbow"));
}

// The robot turns about a circle: at each moment its place follows from its heading.
void in_step(const rc::Simulation& sim) {
  const rc::Robot robot = sim.robot("p3at");
  robot.set_velocity(0.5, 0.5);
  (void)robot.lrf().latest(kPatience);
  std::vector<int64_t> stamps;
  bool rising = true;
  double worst = 0.0;
  for (const auto& [scan, pose] : sim.synchronised(robot.lrf(), robot.pose())) {
    rising = rising && (stamps.empty() || stamps.back() < scan.utime);
    stamps.push_back(scan.utime);
    worst = std::max(worst, std::abs(static_cast<double>(scan.utime - pose.utime)));
    if (stamps.size() == 10) break;
  }
  say("joined", stamps.size(), worst, rising);
  for (const auto& [scan, pose, odometry] :
       sim.synchronised(robot.lrf(), robot.pose(), robot.odometry())) {
    say("three", 0, pose.utime - scan.utime, odometry.utime - scan.utime);
    break;
  }
  const int64_t last = stamps.back();
  const rc::Pose between = robot.pose().at(last - 7000);  // poses come each 20 ms
  const rc::Pose before = robot.pose().at(last - 20000), after = robot.pose().at(last);
  const double share = 13.0 / 20.0, expected = (1 - share) * before.x() + share * after.x();
  say("between", between.utime - last, between.x() - expected, before.x() != after.x());
  say("nearest", robot.lrf().at(last + 130000, kPatience).utime - last);  // each 100 ms
  attempt("early", [&] { (void)robot.odometry().at(0); });
  int count = 0;
  for (const rc::Scan& scan : robot.lrf()) {
    if (!scan.ranges.empty() && ++count == 3) break;
  }
  std::vector<double> times;
  for (const double t : sim.every(0.25)) {
    times.push_back(t);
    if (times.size() == 4) break;
  }
  say("every", times[1] - times[0], times[2] - times[1], times[3] - times[2],
      std::fmod(times[0] / 0.25, 1.0));
  attempt("period", [&] { (void)sim.every(0.0); });
  sim.quit();
  int rest = 0, ticks = 0;
  for (const rc::Scan& scan : robot.lrf()) rest += !scan.ranges.empty();
  for (const double t : sim.every(0.1)) ticks += t > 0.0;
  say("ended", rest < 1000, ticks < 1000);
}

// Paused; a scan each 20 steps.
void queue(const rc::Simulation& sim) {
  rc::Device<rc::Scan> lrf = sim.robot("p3at").lrf();
  std::atomic<int> came{0};
  const rc::Subscription counting = lrf.on_sample([&](const rc::Scan&) { ++came; });
  lrf.set_queue_depth(4);
  const auto wait_for = [&](int count) {
    while (came < count) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  (void)sim.step(20);
  wait_for(1);
  const int64_t first = lrf.next(kPatience).utime, begin = lrf.dropped();
  (void)sim.step(120);
  wait_for(7);
  std::string line = "queue";
  for (int i = 0; i < 4; ++i) line += " " + word(lrf.next(kPatience).utime - first);
  say(line, lrf.dropped() - begin, lrf.queue_depth(), sim.robot("p3at").lrf().queue_depth());
  lrf.set_queue_depth(1);
  (void)sim.step(60);
  wait_for(10);
  const int64_t newest = lrf.next(kPatience).utime;
  say("newest", newest - first, lrf.dropped() - begin);
  for (const int64_t depth : {0, 1001})
    attempt("depth" + word(depth), [&] { lrf.set_queue_depth(depth); });
}

// A log as a run: what would change it is refused, and it ends.
void played(const rc::Simulation& sim) {
  const rc::Robot robot = sim.robot("p3at");
  say("world", sim.world(), robot.lrf().info().range_max > 1.0);
  attempt("drive", [&] { robot.set_velocity(0.1, 0.0); });
  attempt("pause", [&] { sim.pause(); });
  std::vector<double> xs;
  for (const auto& [scan, pose] : sim.synchronised(robot.lrf(), robot.pose()))
    xs.push_back(pose.x());
  say("went", xs.size(), xs.back(), sim.time());
}

void map_files(const std::string& folder) {
  const rc::Map map = rc::load_map(folder + "/given.yaml");
  say("map", map.rows(), map.columns(), map.resolution(), map.origin().x, map.origin().y,
      map.origin().heading);
  std::string line = "cells";
  for (const int8_t cell : map.cells()) line += " " + word(int{cell});
  say(line);
  map.save(folder + "/saved.yaml");
  attempt("name", [&] { map.save(folder + "/saved.png"); });
  for (const char* wrong : {"none", "missing", "resolution", "origin", "short", "picture"})
    attempt(wrong, [&] { (void)rc::load_map(folder + "/" + wrong + ".yaml"); });
}

// The depth of one camera among several, and the boxes of two.
void devices_by_name(const rc::Simulation& sim) {
  const rc::Robot robot = sim.robot("rig");
  say("width", robot.camera("right").latest(kPatience).width);
  say("depth", robot.camera("right").depth().latest(kPatience).width);
  std::string line = "boxes";
  for (const rc::Box2D& box : robot.boxes_2d().latest(kPatience).boxes)
    line += " " + box.name + " " + word(box.label);
  say(line);
  const rc::Box3D box = robot.boxes_3d().latest(kPatience).boxes.at(0);
  say("solid", box.name, box.center[0], box.center[1], box.center[2]);
}

void bodies(const rc::Simulation& sim) {
  const rc::Body crate = sim.body("crate");
  say("crate", crate.is_static, crate.mass, crate.pose().x(), crate.pose().y(),
      crate.pose().heading());
  crate.set_pose(1.0, 2.0, 0.5);
  say("put", crate.pose().x(), crate.pose().y(), crate.pose().heading());
  crate.set_twist({{0.0, 0.0, 3.0}, {}});
  (void)sim.step(10);
  say("rises", crate.twist().linear[2] < 3.0, crate.twist().linear[2] > 1.0,
      crate.pose().z() > 0.1);
  attempt("unknown", [&] { (void)sim.body("crat"); });
  say("all", sim.bodies().size() > 1, sim.bodies().at(0).name);
}

void geometry(const rc::Simulation& sim) {
  const rc::Transform a = rc::Transform::of(1.0, 2.0, 0.3);
  const rc::Transform b{{0.5, -1.0, 0.25}, {0.5, 0.5, 0.5, 0.5}};
  const rc::Transform product = a * b, identity = product * product.inverse();
  const auto& [x, y, z] = product.position;
  const auto& [qw, qx, qy, qz] = product.orientation;
  say("product", x, y, z, qw, qx, qy, qz);
  const auto& [ix, iy, iz] = identity.position;
  say("identity", ix, iy, iz, std::abs(identity.orientation[0]), std::abs(identity.orientation[1]),
      std::abs(identity.orientation[2]), std::abs(identity.orientation[3]));
  const rc::Vector3 applied = a.apply({1.0, 0.0, 0.0});
  say("apply", applied[0], applied[1], applied[2]);
  say("angles", rc::normalize_angle(3.5), rc::normalize_angle(-3.5), rc::normalize_angle(7.0),
      rc::normalize_angle(0.25), rc::normalize_angle(-100.0));
  const rc::Robot robot = sim.robot("p3at");
  const rc::Scan scan = robot.lrf().latest(kPatience);
  const rc::Pose pose = robot.pose().latest(kPatience);
  double wall = 0.0;
  for (const rc::Vector3& point : scan.points(pose.transform() * robot.lrf().transform())) {
    if (std::abs(point[1]) < 1.0) wall = std::max(wall, point[0]);
  }
  say("wall", wall);
}

void driving(const rc::Simulation& sim) {
  const rc::Robot robot = sim.robot("p3at");
  const double begin = robot.pose().latest(kPatience).x();
  {
    const rc::Driving driving = robot.driving(0.3, 0.0);
    sim.sleep(2.0);
  }
  while (robot.motion().next(kPatience).v > 0.0) continue;
  say("went", robot.pose().next(kPatience).x() - begin > 0.3);
  sim.publish("p3at/velocity", robot.velocity_command(0.1, 0.0).bytes);
  double fastest = 0.0;
  while (fastest == 0.0 || robot.motion().latest(kPatience).v > 0.0)
    fastest = std::max(fastest, robot.motion().next(kPatience).v);
  say("published", fastest);  // it lapsed: nothing repeats it
}

void saves(const rc::Simulation& sim) {
  const int64_t begin = sim.state().step;
  const rc::State saved = sim.save("here");
  (void)sim.step(40);
  const rc::State back = sim.restore(saved);
  say("back", back.step - begin, sim.state().step - begin);
}

// 8 x 6 m with walls of a cell, about the origin, and a pillar of a cell.
void chart() {
  constexpr size_t kRows = 60, kColumns = 80;
  std::vector<int8_t> cells(kRows * kColumns, 0);
  for (size_t row = 0; row < kRows; ++row) {
    for (size_t column = 0; column < kColumns; ++column) {
      const bool wall = row == 0 || row + 1 == kRows || column == 0 || column + 1 == kColumns;
      if (wall || (row == 40 && column == 50)) cells[row * kColumns + column] = 100;
    }
  }
  const rc::Map map(cells, kColumns, 0.1, {-4.0, -3.0, 0.0});
  say("at", map.at(0.0, 0.0), map.at(1.05, 1.05), map.at(9.0, 0.0));
  std::string line = "rays";
  for (int i = 0; i < 63; ++i) line += " " + word(map.ray(-0.5, -0.75, 0.1 * i));
  say(line, map.ray(0.0, 0.0, 0.0, 1.0));
  const std::vector<double> field = map.distance_field();
  line = "field";
  for (size_t row = 0; row < kRows; row += 7) {
    for (size_t column = 0; column < kColumns; column += 9)
      line += " " + word(field[row * kColumns + column]);
  }
  say(line);
  const rc::Map grown = map.inflated(0.25);
  say("grown", grown.occupied(1.05, 1.25), grown.occupied(1.05, 1.35));
}

void fixes(const rc::Simulation& sim) {
  const rc::NavSat first = sim.robot("here").gps().latest(kPatience);
  const rc::Vector3 enu = sim.robot("there").gps().latest(kPatience).enu(first);
  say("enu", enu[0], enu[1], enu[2]);
  say("heading", sim.robot("there").imu().latest(kPatience).heading());
  attempt("none", [&] { (void)sim.robot("here").magnetometer(); });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const rc::Simulation sim = rc::connect(argv[1], {.name = "api", .timeout = 60.0});
  const std::map<std::string, std::function<void()>> commands{
      {"joints", [&] { joints(sim); }},
      {"in_step", [&] { in_step(sim); }},
      {"bodies", [&] { bodies(sim); }},
      {"geometry", [&] { geometry(sim); }},
      {"driving", [&] { driving(sim); }},
      {"chart", [&] { chart(); }},
      {"saves", [&] { saves(sim); }},
      {"fixes", [&] { fixes(sim); }},
      {"queue", [&] { queue(sim); }},
      {"played", [&] { played(sim); }},
      {"map_files", [&] { map_files(argv[3]); }},
      {"devices_by_name", [&] { devices_by_name(sim); }},
      {"joints_in_lockstep", [&] { joints_in_lockstep(sim); }},
  };
  commands.at(argv[2])();
}
