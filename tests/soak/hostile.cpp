// Sends a server everything that it must reject, COUNT times at RATE a second at most, and counts
// it: hostile URL COUNT RATE [SEED [only-bad]]; only-bad: nothing that a robot would obey.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <lcm/lcm-cpp.hpp>

#include "ruedo/join_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"
#include "ruedo/world_info_t.hpp"

namespace {

using Bytes = std::vector<uint8_t>;

template <class Message>
Bytes encoded(const Message& message) {
  Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

std::mt19937_64 random_bits;

Bytes noise(size_t size) {
  Bytes bytes(size);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random_bits());
  return bytes;
}

// A message with some of its bytes behind the fingerprint changed, or cut, or longer than it is.
Bytes broken(Bytes bytes) {
  switch (random_bits() % 3) {
    case 0:
      for (int i = 0; i < 4; ++i)
        bytes[8 + random_bits() % (bytes.size() - 8)] = random_bits() % 2 ? 0x7f : 0xff;
      break;
    case 1: bytes.resize(random_bits() % bytes.size()); break;
    default: bytes.resize(bytes.size() + 1 + random_bits() % 5000);
  }
  return bytes;
}

ruedo::velocity_command_t velocity(double v) {
  ruedo::velocity_command_t command{};
  command.vx = v;
  return command;
}

ruedo::request_t request() {
  ruedo::request_t one{};
  one.run_id = static_cast<int64_t>(random_bits());
  one.epoch = -1;
  one.session = static_cast<int64_t>(random_bits() % 100);
  one.sequence = static_cast<int64_t>(random_bits() % 1000);
  one.kind = static_cast<int32_t>(random_bits() % 64) - 8;
  one.body = noise(random_bits() % 200);
  one.size = static_cast<int32_t>(one.body.size());
  return one;
}

struct Case {
  const char* name;
  void (*make)(std::string& channel, Bytes& bytes);
  bool may_act = false;  // a robot drives on some of them, or answers why it does not
  int64_t sent = 0;
};

Case cases[] = {
    {"commands of noise",
     [](std::string& channel, Bytes& bytes) {
       channel = "p3at/velocity", bytes = noise(random_bits() % 300);
     }},
    {"commands with a right beginning",
     [](std::string& channel, Bytes& bytes) {
       channel = "p3at/velocity", bytes = broken(encoded(velocity(0.1)));
     },
     true},
    {"commands that are not finite",
     [](std::string& channel, Bytes& bytes) {
       channel = "p3at/velocity", bytes = encoded(velocity(random_bits() % 2 ? NAN : INFINITY));
     },
     true},
    {"good commands, too many",
     [](std::string& channel, Bytes& bytes) {
       channel = "p3at/velocity", bytes = encoded(velocity(0.05));
     },
     true},
    {"wheel commands whose lengths lie",
     [](std::string& channel, Bytes& bytes) {
       ruedo::wheel_command_t command{};
       command.n = 2;
       command.rate = {0.0, 0.0};
       channel = "p3at/wheels", bytes = broken(encoded(command));
     },
     true},
    {"primitives of no kind",
     [](std::string& channel, Bytes& bytes) {
       ruedo::move_command_t command{};
       command.id = static_cast<int64_t>(random_bits());
       command.kind = static_cast<int8_t>(random_bits());
       command.value = random_bits() % 2 ? NAN : 1e300;
       channel = "p3at/move", bytes = encoded(command);
     },
     true},
    {"requests of strangers",
     [](std::string& channel, Bytes& bytes) {
       channel = "ruedo/request", bytes = encoded(request());
     }},
    {"broken requests",
     [](std::string& channel, Bytes& bytes) {
       channel = "ruedo/request", bytes = broken(encoded(request()));
     }},
    {"clients that join and are gone",
     [](std::string& channel, Bytes& bytes) {
       ruedo::request_t join = request();
       join.session = 0;
       join.kind = ruedo::request_t::JOIN;
       join.sequence = static_cast<int64_t>(random_bits() >> 1);
       ruedo::join_t body{};
       body.client = std::string(random_bits() % 100, 'c');
       join.body = encoded(body);
       join.size = static_cast<int32_t>(join.body.size());
       channel = "ruedo/request", bytes = encoded(join);
     }},
    {"servers that are none",
     [](std::string& channel, Bytes& bytes) {
       ruedo::world_info_t info{};
       info.run_id = static_cast<int64_t>(random_bits());
       channel = "ruedo/info", bytes = encoded(info);
     }},
    {"channels of nobody",
     [](std::string& channel, Bytes& bytes) {
       channel = "nobody/" + std::to_string(random_bits()), bytes = noise(16);
     }},
    {"large messages",
     [](std::string& channel, Bytes& bytes) {
       channel = random_bits() % 2 ? "p3at/velocity" : "ruedo/request";
       bytes.assign(random_bits() % 50 == 0 ? 300'000 : 2'000, 0x55);
     }},
};

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  lcm::LCM bus(argv[1]);
  if (!bus.good()) return 4;
  random_bits.seed(argc > 4 ? std::strtoull(argv[4], nullptr, 10) : 1);
  const bool only_bad = argc > 5 && std::strcmp(argv[5], "only-bad") == 0;
  const double rate = std::atof(argv[3]);
  const auto begin = std::chrono::steady_clock::now();
  const int64_t count = std::atoll(argv[2]);
  std::string channel;
  Bytes bytes;
  int64_t sent = 0;
  while (sent < count) {
    const auto now = std::chrono::steady_clock::now();
    const auto due = std::min(
        count, static_cast<int64_t>(std::chrono::duration<double>(now - begin).count() * rate));
    for (int i = 0; i < 1000 && sent < due; ++i, ++sent) {
      Case& one = cases[random_bits() % std::size(cases)];
      if (only_bad && one.may_act) continue;
      one.make(channel, bytes);
      bus.publish(channel, bytes.data(), static_cast<unsigned>(bytes.size()));
      ++one.sent;
    }
    if (sent >= due) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  for (const Case& one : cases)
    std::printf("%lld %s\n", static_cast<long long>(one.sent), one.name);
}
