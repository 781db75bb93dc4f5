// golden_runs [--threads N] [NAME...]: runs each world of this folder's list for some seconds with
// fixed commands, and prints its name and the SHA-256 of every message that it made: step, channel,
// bytes. The same on every processor and with any number of threads; what it should print is kept
// in hashes.txt.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <openssl/evp.h>
#include <spdlog/spdlog.h>

#include "engine/engine.h"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/math.h"
#include "world/load.h"

namespace ruedo {
namespace {

struct Run {
  const char* name;
  const char* world;  // by name, or of this folder
  double seconds;
  std::vector<std::string> spawns = {}, disabled = {};
  const char* arm = "";  // the robot whose joints are commanded
};

const Run kRuns[] = {
    {.name = "arena",
     .world = "arena",
     .seconds = 2.0,
     .spawns = {"p3dx:guest@3.8,3.8,-2.4"},
     .disabled = {"p3at/camera"}},
    {.name = "fleet", .world = "fleet", .seconds = 2.0, .disabled = {"alice/camera", "bob/camera"}},
    {.name = "bases",
     .world = "arena",
     .seconds = 2.0,
     .spawns = {"car@-3,0", "mecanum@-4,3", "omni@0,-3", "tricycle@3.8,-3.8,2", "crawler@-4,-4,1",
                "puck@0,4"},
     .disabled = {"p3at/camera"}},
    {.name = "wheels", .world = "wheels.sdf", .seconds = 2.0},
    {.name = "arms", .world = "arms.sdf", .seconds = 2.0, .arm = "lift"},
    {.name = "meshes", .world = "office", .seconds = 0.4},
    {.name = "camera", .world = "camera.sdf", .seconds = 0.2},
};

class Hash {
 public:
  Hash() : context_(EVP_MD_CTX_new()) { EVP_DigestInit_ex(context_, EVP_sha256(), nullptr); }
  ~Hash() { EVP_MD_CTX_free(context_); }
  Hash(const Hash&) = delete;
  Hash& operator=(const Hash&) = delete;
  void add(const void* data, size_t size) { EVP_DigestUpdate(context_, data, size); }
  std::string hex() {
    unsigned char digest[EVP_MAX_MD_SIZE];
    unsigned int size = 0;
    EVP_DigestFinal_ex(context_, digest, &size);
    std::string text;
    for (unsigned int i = 0; i < size; ++i) text += fmt::format("{:02x}", digest[i]);
    return text;
  }

 private:
  EVP_MD_CTX* context_;
};

// Every robot wanders on a path of its own; every so often one stops or backs off.
void drive(engine::Engine& engine, int turn) {
  std::vector<double> commands;
  for (size_t i = 0; i < engine.driven().size(); ++i) {
    const double phase = 0.7 * turn + 1.3 * static_cast<double>(i);
    commands.insert(commands.end(), {turn % 7 == 6 ? -0.2 : 0.4 + 0.3 * math::sin(phase),
                                     0.1 * math::cos(phase), 0.9 * math::sin(2.0 * phase)});
  }
  engine.drive(commands);
}

void move_arm(engine::Engine& engine, const std::string& robot, int turn) {
  joint_command_t command;
  command.utime = 0;
  command.name = {"pan", "tilt", "fork"};
  command.mode = {joint_command_t::POSITION, joint_command_t::VELOCITY, joint_command_t::POSITION};
  command.value = {math::sin(0.5 * turn), turn % 4 < 2 ? 0.4 : -0.4,
                   0.2 + 0.2 * math::cos(0.3 * turn)};
  command.n = 3;
  std::vector<uint8_t> bytes(static_cast<size_t>(command.getEncodedSize()));
  command.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  engine.command(0, robot + "/joint_command", bytes);
}

std::string run(const Run& run, int threads) {
  world::LoadOptions load;
  for (const std::string& spawn : run.spawns) load.spawns.push_back(world::parse_spawn(spawn));
  load.disabled = run.disabled;
  const std::string name = run.world,
                    world = name.ends_with(".sdf") ? RUEDO_GOLDEN_DIR "/" + name : name;
  engine::EngineOptions options;
  options.threads = threads;
  options.fleet.seed = 7;
  options.fleet.disabled = run.disabled;
  engine::Engine engine(world::load_world(world, load), options);
  Hash hash;
  engine.on_message(
      [&](int, int64_t step, const engine::Channel& channel, std::span<const uint8_t> bytes) {
        const std::string head = fmt::format("{} {} {}\n", step, channel.bus_name, bytes.size());
        hash.add(head.data(), head.size());
        hash.add(bytes.data(), bytes.size());
      });
  constexpr int kTurn_us = 100'000;
  const int turns = std::max(1, static_cast<int>(run.seconds * 1e6 / kTurn_us));
  for (int turn = 0; turn < turns; ++turn) {
    if (!engine.driven().empty()) drive(engine, turn);
    if (*run.arm != '\0') move_arm(engine, run.arm, turn);
    engine.step(kTurn_us / engine.step_us());
  }
  const uint64_t state = engine.state_hash(0);
  hash.add(&state, sizeof state);
  return hash.hex();
}

}  // namespace
}  // namespace ruedo

int main(int argc, char** argv) {
  spdlog::set_level(spdlog::level::off);  // of commands that a robot refuses
  int threads = 1;
  std::vector<std::string> wanted;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--threads" && i + 1 < argc)
      threads = std::atoi(argv[++i]);
    else
      wanted.push_back(word);
  }
  for (const ruedo::Run& run : ruedo::kRuns) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), run.name) == wanted.end())
      continue;
    std::printf("%s %s\n", run.name, ruedo::run(run, threads).c_str());
    std::fflush(stdout);
  }
}
