// ruedo teleop: drives a robot with the keyboard of a terminal.
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "bus/lcm_bus.h"
#include "cli/commands.h"
#include "ruedo/errors.h"
#include "ruedo/velocity_command_t.hpp"

namespace ruedo::cli {
namespace {

constexpr int kRepeat_ms = 100;  // well within a robot's watchdog
constexpr int kCtrlC = 3;
constexpr double kStep_m_s = 0.1, kStep_rad_s = 0.2;

// Keys at once and unseen, for as long as it lives.
class RawTerminal {
 public:
  RawTerminal() {
    if (isatty(STDIN_FILENO) == 0)
      throw EnvironmentError("teleop needs a terminal to read keys from");
    tcgetattr(STDIN_FILENO, &before_);
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO |
                                          ISIG);  // Ctrl-C is a key too: the robot is stopped first
    tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  }
  ~RawTerminal() { tcsetattr(STDIN_FILENO, TCSANOW, &before_); }

 private:
  termios before_{};
};

// The next key, or 0 when none came in that time; -1 at the end of the input. An arrow key is its
// letter's.
int next_key(int timeout_ms) {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  if (poll(&input, 1, timeout_ms) <= 0) return 0;
  char bytes[8];
  const ssize_t count = read(STDIN_FILENO, bytes, sizeof bytes);
  if (count <= 0) return -1;
  if (count >= 3 && bytes[0] == '\033' && bytes[1] == '[') {
    switch (bytes[2]) {
      case 'A': return 'w';
      case 'B': return 's';
      case 'C': return 'd';
      case 'D': return 'a';
      default: return 0;
    }
  }
  return bytes[0];
}

struct TeleopArguments {
  std::string robot, lcm;
};

int teleop(const TeleopArguments& arguments) {
  bus::LcmBus bus(arguments.lcm);
  const RawTerminal terminal;
  fmt::print("w s or up down: speed   a d or left right: turn   space: stop   q: quit\n");
  const std::string channel = arguments.robot + "/velocity";
  velocity_command_t command{};
  const auto send = [&] {
    uint8_t bytes[64];
    const int size = command.encode(bytes, 0, sizeof bytes);
    bus.publish(channel, bytes, static_cast<size_t>(size));
  };
  for (int key = 0; key != 'q' && key != kCtrlC && key != -1; key = next_key(kRepeat_ms)) {
    switch (key) {
      case 'w': command.vx += kStep_m_s; break;
      case 's': command.vx -= kStep_m_s; break;
      case 'a': command.omega += kStep_rad_s; break;
      case 'd': command.omega -= kStep_rad_s; break;
      case ' ': command.vx = command.omega = 0.0; break;
      default: break;
    }
    // Steps of a decimal fraction must come back to zero.
    command.vx = std::round(command.vx / kStep_m_s) * kStep_m_s;
    command.omega = std::round(command.omega / kStep_rad_s) * kStep_rad_s;
    send();
    fmt::print("\r\033[K{}: {:+.1f} m/s, {:+.1f} rad/s", arguments.robot, command.vx,
               command.omega);
    std::fflush(stdout);
  }
  command.vx = command.omega = 0.0;
  send();
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
