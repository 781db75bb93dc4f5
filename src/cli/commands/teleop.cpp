// ruedo teleop: drives a robot with the keyboard of a terminal.
#include <poll.h>
#include <sys/signalfd.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/channel_names.h"
#include "bus/lcm_bus.h"
#include "cli/support/commands.h"
#include "ruedo/decode.h"
#include "ruedo/errors.h"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "system/file_handle.h"

namespace ruedo::cli {
namespace {

constexpr int kRepeat_ms = 100;  // well within a robot's watchdog
constexpr double kStep_m_s = 0.1, kStep_rad_s = 0.2;
// A text that is pasted presses "w" a thousand times.
constexpr double kMost_m_s = 20.0, kMost_rad_s = 10.0;
// Events other than a key.
constexpr int kNone = 0, kEnd = -1, kSuspend = -2, kContinue = -3;

// Signals, to be read beside the keys: the robot is stopped first, and the terminal left as it was.
// Make it before any thread, so that all inherit the blocked signals.
class Signals {
 public:
  Signals() {
    std::signal(SIGPIPE, SIG_IGN);  // printing then throws
    sigemptyset(&signals_);
    for (const int signal : {SIGINT, SIGQUIT, SIGTERM, SIGHUP, SIGTSTP, SIGCONT}) {
      struct sigaction now{};
      if (sigaction(signal, nullptr, &now) == 0 && now.sa_handler != SIG_IGN)
        sigaddset(&signals_, signal);
    }
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    file_ = FileHandle(signalfd(-1, &signals_, SFD_CLOEXEC | SFD_NONBLOCK));
  }
  int file() const { return file_.get(); }
  int take() {
    signalfd_siginfo signal{};
    if (read(file_.get(), &signal, sizeof signal) != sizeof signal) return kNone;
    const auto number = static_cast<int>(signal.ssi_signo);
    return number == SIGTSTP ? kSuspend : number == SIGCONT ? kContinue : kEnd;
  }
  // As if SIGTSTP were not blocked; returns when the process continues.
  void suspend() {
    raise(SIGTSTP);
    sigset_t suspending;
    sigemptyset(&suspending);
    sigaddset(&suspending, SIGTSTP);
    pthread_sigmask(SIG_UNBLOCK, &suspending, nullptr);
    pthread_sigmask(SIG_BLOCK, &suspending, nullptr);
  }

 private:
  sigset_t signals_{};
  FileHandle file_;
};

// Keys at once and unseen, for as long as it lives.
class RawTerminal {
 public:
  RawTerminal() {
    if (isatty(STDIN_FILENO) == 0)
      throw EnvironmentError("teleop needs a terminal to read keys from");
  }
  ~RawTerminal() { leave(); }

  // Whether this process is in the foreground. In the background the terminal is another's, and the
  // kernel stops a process that changes it.
  static bool is_ours() {
    const pid_t group = tcgetpgrp(STDIN_FILENO);
    return group < 0 || group == getpgrp();  // < 0: not a controlling terminal
  }
  // Again, too, where somebody else has changed it meanwhile, as a shell does.
  void enter() {
    if (!is_ours()) return;
    if (!std::exchange(entered_, true)) tcgetattr(STDIN_FILENO, &before_);
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  void leave() {
    if (std::exchange(entered_, false) && is_ours()) tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  }
  bool entered() const { return entered_; }

 private:
  termios before_{};
  bool entered_ = false;
};

// Keys out of what a terminal sends, in whatever pieces that comes. An arrow key is its letter's.
class Keys {
 public:
  explicit Keys(Signals& signals) : signals_(signals) {}

  // The event within that time: a key, kNone, or another one.
  int next(int timeout_ms) {
    if (taken_ == came_) {
      pollfd waiting[2] = {{STDIN_FILENO, POLLIN, 0}, {signals_.file(), POLLIN, 0}};
      if (poll(waiting, 2, timeout_ms) <= 0) return kNone;
      if (waiting[1].revents != 0) return signals_.take();
      came_ = read(STDIN_FILENO, bytes_, sizeof bytes_);
      taken_ = 0;
      if (came_ <= 0) return kEnd;
    }
    return key_of(static_cast<unsigned char>(bytes_[taken_++]));
  }

 private:
  // byte: not negative, as what comes in place of a key is.
  int key_of(int byte) {
    const Place place = std::exchange(place_, Place::between);
    if (byte == '\033') return place_ = Place::escape, kNone;
    if (place == Place::between) return byte;
    if (place == Place::escape) {
      if (byte != '[' && byte != 'O') return byte;
      return place_ = Place::sequence, kNone;
    }
    if (byte >= '0' && byte <= '?') return place_ = Place::sequence, kNone;  // its parameters
    switch (byte) {
      case 'A': return 'w';
      case 'B': return 's';
      case 'C': return 'd';
      case 'D': return 'a';
      case ' ': return ' ';  // in none: it stops, whatever came before
      default: return kNone;
    }
  }

  enum class Place { between, escape, sequence };
  Signals& signals_;
  char bytes_[64] = {};
  ssize_t came_ = 0, taken_ = 0;
  Place place_ = Place::between;
};

// Whether the robot exists and its velocity channel, by ruedo/info; until that arrives, it counts
// as existing, with the usual channel. Listens in the bus's thread.
class Presence {
 public:
  explicit Presence(const std::string& robot) : robot_(robot), channel_(robot + "/velocity") {}

  void hear(const uint8_t* data, size_t size) {
    world_info_t info;
    if (decode_checked(data, size, info) != DecodeFault::none) return;
    if (info.part == 0) next_part_ = 0, found_ = false;
    if (info.part != next_part_++) return;  // one was lost
    for (const robot_info_t& robot : info.robots) found_ |= robot.name == robot_;
    for (const channel_info_t& each : info.channels) {
      if (!each.input || each.robot != robot_ || each.type != "velocity_command_t") continue;
      const std::lock_guard lock(mutex_);
      channel_ = each.name;  // another one with --remap
    }
    if (next_part_ != info.nparts) return;
    is_there_ = found_;
    if (!found_) has_left_ = true;
  }
  bool is_there() const { return is_there_; }
  std::string channel() const {
    const std::lock_guard lock(mutex_);
    return channel_;
  }
  // Whether it was not there at some time since the last call: what is there now is another one.
  bool has_left() { return has_left_.exchange(false); }

 private:
  const std::string robot_;
  int next_part_ = 0;
  bool found_ = false;  // in the parts received
  std::atomic<bool> is_there_{true}, has_left_{false};
  mutable std::mutex mutex_;
  std::string channel_;
};

// One robot's speed; at the end, whatever the reason, it stands.
class Driver {
 public:
  Driver(const std::string& robot, bus::LcmBus& bus, Presence& presence)
      : robot_(robot), bus_(bus), presence_(presence) {}
  ~Driver() { stop(); }

  void stop() {
    command_.vx = command_.omega = 0.0;
    send();
  }
  void press(int key) {
    if (presence_.has_left()) command_.vx = command_.omega = 0.0;
    if (!presence_.is_there()) return say("not there");
    steer(key);
    const uint64_t failed = bus_.failed();
    send();
    say(fmt::format("{:+.1f} m/s, {:+.1f} rad/s{}", command_.vx, command_.omega,
                    bus_.failed() == failed ? "" : " (not sent)"));
  }

 private:
  void steer(int key) {
    switch (key) {
      case 'w': command_.vx += kStep_m_s; break;
      case 's': command_.vx -= kStep_m_s; break;
      case 'a': command_.omega += kStep_rad_s; break;
      case 'd': command_.omega -= kStep_rad_s; break;
      case ' ': command_.vx = command_.omega = 0.0; break;
      default: break;
    }
    // Steps of a decimal fraction must come back to zero.
    const auto tidy = [](double speed, double step, double most) {
      return std::clamp(std::round(speed / step) * step, -most, most);
    };
    command_.vx = tidy(command_.vx, kStep_m_s, kMost_m_s);
    command_.omega = tidy(command_.omega, kStep_rad_s, kMost_rad_s);
  }
  void say(const std::string& text) const {
    fmt::print("\r\033[K{}: {}", robot_, text);
    std::fflush(stdout);
  }
  void send() {
    uint8_t bytes[64];
    const int size = command_.encode(bytes, 0, sizeof bytes);
    bus_.publish(presence_.channel(), bytes, static_cast<size_t>(size));
  }

  std::string robot_;
  bus::LcmBus& bus_;
  Presence& presence_;
  velocity_command_t command_{};
};

struct TeleopArguments {
  std::string robot, lcm;
};

int teleop(const TeleopArguments& arguments) {
  Signals signals;
  Presence presence(arguments.robot);
  bus::LcmBus bus(arguments.lcm);
  bus.listen({kInfoChannel}, [&](const std::string&, const uint8_t* data, size_t size) {
    presence.hear(data, size);
  });
  RawTerminal terminal;
  fmt::print(
      "w s or up down: speed   a d or left right: turn   space: stop   q: quit   (at most {:g} "
      "m/s, {:g} rad/s)\n",
      kMost_m_s, kMost_rad_s);
  Keys keys(signals);
  Driver driver(arguments.robot, bus, presence);
  const auto nobody_reads = [] { return std::ferror(stdout) != 0; };
  for (int key = kContinue; key != 'q' && key != kEnd && !nobody_reads();
       key = keys.next(kRepeat_ms)) {
    if (key == kSuspend || (key == kContinue && !RawTerminal::is_ours())) {
      driver.stop();
      terminal.leave();
      signals.suspend();
      continue;  // with the signal that ended it: it continues, or must end
    }
    if (key == kContinue || !terminal.entered()) terminal.enter();
    driver.press(key);
  }
  fmt::print("\n");
  return kGood;
}

void add_teleop(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("teleop", "drive a robot with the keyboard");
  const auto arguments = std::make_shared<TeleopArguments>();
  command->add_option("ROBOT", arguments->robot, "its name, such as p3at")->required();
  command
      ->add_option("--lcm", arguments->lcm,
                   "LCM address (default: $LCM_DEFAULT_URL, or LCM's group)")
      ->type_name("URL");
  command->callback([arguments, &chosen] { chosen = [arguments] { return teleop(*arguments); }; });
}

const RegisterCommand kRegister{62, add_teleop};

}  // namespace
}  // namespace ruedo::cli
