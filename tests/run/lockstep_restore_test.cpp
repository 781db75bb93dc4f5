// A run in lockstep that is saved, and another server that begins with the state: every message of
// every step is the one that followed.
#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "lockstep_client.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/velocity_command_t.hpp"

namespace ruedo::run {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kSaved = 100, kEnd = 220;  // steps

const char* const kRobot =
    "<include><uri>model://p3at</uri><name>r</name></include><model name='box'><pose>1 0.1 0.2 0 0 "
    "0</pose><link name='l'><inertial><mass>1</mass></inertial><collision name='c'><geometry><box>"
    "<size>0.4 0.4 0.4</size></box></geometry></collision></link></model>";

class LockstepRestoreTest : public testing::Test {
 protected:
  LockstepRestoreTest() {
    std::string made = (fs::temp_directory_path() / "ruedo-lockstep-XXXXXX").string();
    folder_ = ::mkdtemp(made.data());
    ::setenv("XDG_STATE_HOME", folder_.c_str(), 1);
  }
  ~LockstepRestoreTest() override { fs::remove_all(folder_); }

  // The messages of a client that drives to kEnd; from the beginning it is saved on the way, else
  // it begins with that. batches: that were computed before the client took part.
  std::map<int64_t, LockstepClient::Seen> drive(bool from_beginning, int& batches) {
    LossyBus bus({}, 1);
    std::atomic<int> computed{0};
    RunOptions options = fast(1e6);
    options.lockstep.clients = 1;
    options.lockstep.lease_s = 60.0;
    options.snapshots = folder_;
    options.simulation.fleet.disabled = {"r/camera"};
    options.simulation.before_batch = [&](const std::string& module) {
      computed += module == "kinematics";
    };
    if (!from_beginning) options.repeat = folder_ + "/here.snapshot";
    run::Run server(load_text(kRobot), options, bus);
    std::thread running([&] { server.run(); });
    LockstepClient client(bus, server.channels(), "driver");
    client.take_part();
    batches = computed;
    for (int64_t step = from_beginning ? 0 : kSaved; step < kEnd; step += 20) {
      if (from_beginning && step == kSaved) save(bus, server);
      velocity_command_t command{};
      command.vx = 0.6;
      command.omega = 0.01 * static_cast<double>(step % 60);
      client.command(step, "r/velocity", engine::encoded(command));
      client.step(20);
    }
    server.stop();
    running.join();
    return client.seen();
  }

 private:
  static void save(LossyBus& bus, run::Run& server) {
    LockstepClient other(bus, server.channels(), "saver");
    other.join();
    name_request_t body;
    body.name = "here";
    const reply_t reply = other.ask(request_t::SNAPSHOT, 1, engine::encoded(body));
    EXPECT_EQ(reply.code, reply_t::OK) << reply.text;
  }

  std::string folder_;
};

TEST_F(LockstepRestoreTest, AnotherServerBeginsWithTheState) {
  int batches = 0;
  const auto uninterrupted = drive(true, batches);
  const auto restored = drive(false, batches);
  EXPECT_EQ(batches, 0) << "it did not run there again";
  EXPECT_EQ(restored.size(), static_cast<size_t>(kEnd - kSaved));
  for (const auto& [step, seen] : restored) {
    EXPECT_EQ(seen.state_hash, uninterrupted.at(step).state_hash) << step;
    EXPECT_TRUE(seen.messages == uninterrupted.at(step).messages) << step;
  }
}

}  // namespace
}  // namespace ruedo::run
