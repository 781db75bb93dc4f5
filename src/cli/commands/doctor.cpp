// ruedo doctor: what this machine lacks, each fault in one line with its cure, in less than a
// second (three more with --ros2).
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include <lcm/lcm_version.h>

#include "base/channel_names.h"
#include "base/sha256.h"
#include "base/utf8.h"
#include "base/version.h"
#include "bus/datagram_loss.h"
#include "bus/lcm_bus.h"
#include "bus/lcm_url.h"
#include "bus/url_claim.h"
#include "cli/support/commands.h"
#include "cli/support/ros2.h"
#include "engine/outcome.h"
#include "log/header.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/request_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "scene/gl/mesas_environment.h"
#include "scene/pictures/render_scene.h"
#include "system/output_file.h"
#include "system/sandbox.h"
#include "system/temporary_folder.h"
#include "world/load.h"
#include "world/model/body_layout.h"

namespace ruedo::cli {
namespace {

constexpr int64_t kGoodBuffer = 2'097'152;        // bytes: a raw VGA picture passes
constexpr int64_t kBufferOfPictures = 8'388'608;  // bytes: nine raw VGA pictures
constexpr int kSelfTestMs = 300;
constexpr std::chrono::milliseconds kBetweenQuestions{100};
constexpr int kQuestions = 4;  // a datagram may be lost
constexpr size_t kMostServers = 8;
constexpr size_t kLongestName = 100;  // bytes

class Report {
 public:
  void good(const std::string& what, const std::string& text) {
    line(style_.green, "ok", what, text);
  }
  void hint(const std::string& what, const std::string& text) {
    line(style_.yellow, "hint", what, text);
  }
  void fault(const std::string& what, const std::string& text) {
    line(style_.red, "FAULT", what, text);
    faulty_ = true;
  }
  bool faulty() const { return faulty_; }

 private:
  void line(const char* colour, const char* verdict, const std::string& what,
            const std::string& text) {
    fmt::print("{}{:<5}{}  {:<16} {}\n", colour, verdict, style_.off, what, text);
  }
  Style style_ = style_of(stdout);
  bool faulty_ = false;
};

void check_multicast(Report& report, const bus::LcmUrl& url) {
  try {
    bus::check_route(url);
  } catch (const EnvironmentError& error) {
    return report.fault(
        "multicast",
        std::string(error.what()) + "; or do without: ruedo run WORLD --lcm tcpq://127.0.0.1:7700");
  }
  if (bus::hears_itself(url, kSelfTestMs)) {
    report.good("multicast", url.str() + ": a datagram to the group comes back");
  } else {
    report.fault("multicast", url.str() +
                                  ": a datagram to the group does not come back: run: sudo ip link "
                                  "set lo multicast on; sudo ip route add " +
                                  url.host + "/32 dev lo; or let the firewall pass UDP port " +
                                  std::to_string(url.port));
  }
}

// Datagrams that listeners on this machine have lost, as counted by the kernel.
void check_loss(Report& report, const bus::LcmUrl& url) {
  const auto loss = bus::datagram_loss(static_cast<uint16_t>(url.port));
  if (!loss) return report.hint("datagrams", "whether any were lost is not known on this system");
  if (loss->of_machine == 0)
    return report.good("datagrams", "none was lost at a full receive buffer so far");
  const std::string all =
      fmt::format("{} were lost at full receive buffers, of all ports, since this machine began",
                  loss->of_machine);
  if (loss->at_port == 0)
    return report.good("datagrams",
                       all + fmt::format("; none by the listeners on port {} now", url.port));
  report.hint("datagrams", all +
                               fmt::format("; the listeners on port {} now may have lost some "
                                           "({} were dropped or filtered there): ",
                                           url.port, loss->at_port) +
                               bus::cure_of_datagram_loss());
}

std::string line_about(const world_info_t& info) {
  const auto name = [](const std::string& text) {
    return in_one_line(for_terminal(shortened(text, kLongestName)));
  };
  return fmt::format("run {}, world {}, ruedo {}", info.run_id, name(info.world),
                     name(info.version));
}

// The servers that answer on the bus, wherever they run: a line about each, by the ids of their
// runs.
std::map<int64_t, std::string> servers_on(const bus::LcmUrl& url) {
  std::mutex mutex;
  std::map<int64_t, std::string> servers;
  try {
    bus::LcmBus bus(url.str());
    bus.listen({kInfoChannel}, [&](const std::string&, const uint8_t* data, size_t size) {
      world_info_t info;
      if (decode_checked(data, size, info) != DecodeFault::none) return;
      const std::lock_guard lock(mutex);
      if (servers.size() < kMostServers) servers.emplace(info.run_id, line_about(info));
    });
    request_t question{};
    question.epoch = -1;
    question.kind = request_t::INFO;
    const std::vector<uint8_t> bytes = engine::encoded(question);
    for (int i = 0; i < kQuestions; ++i) {
      bus.publish(kRequestChannel, bytes.data(), bytes.size());
      std::this_thread::sleep_for(kBetweenQuestions);
    }
    bus.stop();
  } catch (const EnvironmentError&) {
    // Nothing listens, or there is no route.
  }
  return servers;
}

std::string advice_on_no_server(const bus::LcmUrl& url) {
  const bool local = url.scheme == "udpm" && url.option("ttl", "0") == "0";
  return "no server answers on " + url.str() +
         (local ? " (this machine only; ?ttl=1 reaches others)" : "") +
         ": start one with `ruedo run WORLD`, or set LCM_DEFAULT_URL or --lcm to its address";
}

// The address that is served, or would be: by this machine's claims, and by the server's replies.
void check_server(Report& report, const bus::LcmUrl& url) {
  if (url.scheme == "memq")
    return report.good("server", url.str() + " stays inside of one process");
  const std::string owner = url.scheme == "unix" ? "" : bus::claimed_by(url);
  if (!owner.empty()) report.good("server", url.str() + ": " + owner);
  const bool open = url.scheme == "udpm" || bus::is_served(url, kSelfTestMs);
  const auto servers = open ? servers_on(url) : std::map<int64_t, std::string>();
  for (const auto& [run, line] : servers) {
    if (owner.ends_with(fmt::format("run {}", run))) continue;
    report.good("server", fmt::format("{}: {} answers{}", url.str(), line,
                                      url.scheme == "udpm" ? " from another machine" : ""));
  }
  if (!owner.empty() || !servers.empty()) return;
  if (url.scheme == "udpm" || !open) return report.hint("server", advice_on_no_server(url));
  report.good("server", url.str() + ": something listens there; no server of Ruedo answers");
}

void check_bus(Report& report, const std::string& text) {
  const bus::LcmUrl url = bus::parse_url(text);
  if (url.scheme == "udpm") {
    check_multicast(report, url);
    check_loss(report, url);
  }
  const char* environment = std::getenv("LCM_DEFAULT_URL");
  const bool asked = !text.empty() || (environment && *environment);
  check_server(report, asked || bus::has_route(url) ? url : bus::parse_url("tcpq://"));
}

void check_buffers(Report& report) {
  const int64_t limit = bus::receive_buffer_limit();
  if (limit < 0) return report.hint("receive buffers", "not known on this system");
  if (limit >= kGoodBuffer)
    return report.good("receive buffers", fmt::format("up to {} bytes", limit));
  report.hint("receive buffers",
              fmt::format("at most {} bytes: raw pictures get lost (JPEG passes). For raw ones "
                          "run: sudo sysctl -w net.core.rmem_max={}",
                          limit, kGoodBuffer));
}

void check_renderer(Report& report) {
  try {
    const world::WorldModel world;
    const world::BodyLayout layout(world);
    report.good("renderer", scene::make_renderer(world, layout)->description());
  } catch (const EnvironmentError& error) {
    report.fault("renderer", error.what());
  }
}

// Settings of the host for libraries, from which Ruedo shields them.
void check_environment(Report& report) {
  std::vector<std::string> variables;
  for (const std::string& variable : scene::mesas_variables())
    variables.push_back(for_terminal(shortened(variable, kLongestName)));
  if (!variables.empty())
    report.hint("environment",
                fmt::format("has no effect on pictures: {} (--mesa-environment lets it act)",
                            fmt::join(variables, ", ")));
}

// Whether --ros2 would work. On a machine without ROS, a failure is not a fault.
void check_ros2(Report& report) {
  constexpr const char* kVariables[] = {
      "ROS_DISTRO",          "ROS_DOMAIN_ID",    "ROS_AUTOMATIC_DISCOVERY_RANGE",
      "ROS_LOCALHOST_ONLY",  "ROS_STATIC_PEERS", "RMW_IMPLEMENTATION",
      "ROS_SECURITY_ENABLE", "CYCLONEDDS_URI"};
  const bool asked = std::any_of(std::begin(kVariables), std::end(kVariables), [](const char* one) {
    const char* value = std::getenv(one);
    return value && *value;
  });
  const auto tell = [&](const std::string& text) {
    const std::string line = in_one_line(for_terminal(text));
    asked ? report.fault("ROS 2", line) : report.hint("ROS 2", line);
  };
  try {
    report.good("ROS 2", ros2_network());
    if (const std::string deaf = nodes_that_do_not_hear(); !deaf.empty()) tell(deaf);
  } catch (const InputError& error) {
    tell(error.what());
  } catch (const EnvironmentError& error) {
    tell(error.what());
  }
}

// Whether raw pictures reach readers with the QoS of sensor data, which does not retransmit.
void check_pictures(Report& report) {
  constexpr const char* kWhat = "pictures on DDS";
  try {
    const Ros2Pictures count = ros2_pictures();
    const std::string text = fmt::format(
        "{} of {} raw ones of 640 x 480 arrived at a best-effort reader with a receive buffer of "
        "{} bytes, this system's default",
        count.arrived, count.sent, count.buffer);
    if (count.arrived == count.sent) return report.good(kWhat, text);
    report.hint(kWhat, text + fmt::format(". Run: sudo sysctl -w net.core.rmem_default={0} "
                                          "net.core.rmem_max={0}; or read image_raw/compressed, "
                                          "or raw ones with a reliable reader",
                                          kBufferOfPictures));
  } catch (const EnvironmentError& error) {
    report.fault(kWhat, in_one_line(for_terminal(error.what())));
  }
}

// Python and what the environment says to it.
void check_xacro(Report& report) {
  try {
    const TemporaryFolder folder("doctor");
    const std::string file = folder / "robot.urdf.xacro";
    write_file(file, R"(<robot name="robot"><link name="base_link"/></robot>)");
    world::load_world(file);
    report.good("xacro files", "a file was expanded");
  } catch (const InputError& error) {
    report.hint("xacro files", in_one_line(for_terminal(error.message())));
  } catch (const EnvironmentError&) {  // told by check_temporary_folder()
  }
}

// Where logs of campaigns, meshes and xacro files lie for a while.
void check_temporary_folder(Report& report) {
  try {
    const TemporaryFolder folder("doctor");
    report.good("temporary files",
                std::filesystem::path(folder / "").parent_path().parent_path().string());
  } catch (const EnvironmentError& error) {
    report.fault("temporary files",
                 std::string(error.what()) + "; set TMPDIR to one that is writable");
  }
}

void check_digests(Report& report) {
  try {
    sha256(nullptr, 0);
  } catch (const EnvironmentError& error) {
    report.fault("digests", error.what());
  }
}

void check_sandbox(Report& report) {
  const std::string missing = missing_for_sandbox();
  if (missing.empty())
    return report.good(
        "sandbox", "Landlock and seccomp: --sandbox works, meshes and xacro files are read in one");
  report.hint("sandbox",
              missing +
                  ": no --sandbox; meshes and xacro files are read with limits of time and memory "
                  "only, and a xacro file may run any program");
}

int doctor(const std::string& url, bool ros2) {
  Report report;
  report.good("version", fmt::format("ruedo {}, LCM {}.{}.{}, {}, CPU with {}", version(),
                                     LCM_VERSION_MAJOR, LCM_VERSION_MINOR, LCM_VERSION_PATCH,
                                     log::libc_version(), log::cpu_features()));
  check_bus(report, url);
  check_buffers(report);
  check_renderer(report);
  check_environment(report);
  check_temporary_folder(report);
  check_xacro(report);
  check_ros2(report);
  if (ros2) check_pictures(report);
  check_digests(report);
  check_sandbox(report);
  return report.faulty() ? kEnvironment : kGood;
}

void add_doctor(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("doctor",
                                         "check this machine: multicast route, buffers, renderer, "
                                         "versions; print how to fix each fault");
  const auto url = std::make_shared<std::string>();
  command->add_option("--lcm", *url, "LCM address to check")->type_name("URL");
  const auto ros2 = std::make_shared<bool>(false);
  command->add_flag("--ros2", *ros2,
                    "also measure for three seconds how many raw pictures get through DDS");
  command->callback([=, &chosen] { chosen = [=] { return doctor(*url, *ros2); }; });
}

const RegisterCommand kRegister{70, add_doctor};

}  // namespace
}  // namespace ruedo::cli
