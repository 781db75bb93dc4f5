// RESTORE, and a run that begins with a snapshot: the state is put back as it was, from memory or
// from the file, and what follows is the same as after running there again.
// tests/engine/test_restore.py has other worlds and devices.
#include <atomic>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/input_file.h"
#include "control_client.h"
#include "log/reader.h"
#include "log/writer.h"
#include "ruedo/rate_request_t.hpp"
#include "ruedo/state_hash_t.hpp"
#include "ruedo/tick_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/world_state_t.hpp"
#include "run/repeat/replay.h"
#include "run/requests/saved_states.h"

namespace ruedo::run {
namespace {

namespace fs = std::filesystem;

const char* const kRobot =
    "<include><uri>model://p3at</uri><name>r</name></include><model name='box'><pose>1 0.1 0.2 0 0 "
    "0</pose><link name='l'><inertial><mass>1</mass></inertial><collision name='c'><geometry><box>"
    "<size>0.4 0.4 0.4</size></box></geometry></collision></link></model>";

// A robot with a sensor of each kind whose noise wanders: how far it has come is state, too.
std::string wandering_robot() {
  const auto noisy = [](const std::string& path) {
    std::string open, close;
    for (size_t at = 0, end = 0; at < path.size(); at = end + 1) {
      end = std::min(path.find('/', at), path.size());
      const std::string name = path.substr(at, end - at);
      open += "<" + name + ">";
      close.insert(0, "</" + name + ">");
    }
    return open +
           "<noise type='gaussian'><stddev>0.01</stddev><dynamic_bias_stddev>0.05"
           "</dynamic_bias_stddev></noise>" +
           close;
  };
  std::string sensors;
  for (const auto& [type, what] :
       std::map<std::string, std::string>{{"imu", noisy("imu/angular_velocity/x")},
                                          {"navsat", noisy("navsat/position_sensing/horizontal")},
                                          {"magnetometer", noisy("magnetometer/x")},
                                          {"altimeter", noisy("altimeter/vertical_position")},
                                          {"air_pressure", noisy("air_pressure/pressure")},
                                          {"air_speed", noisy("air_speed/pressure")}})
    sensors += "<sensor name='" + type + "' type='" + type + "'><update_rate>20</update_rate>" +
               what + "</sensor>";
  return robot_sdf("wandering", 5.0, 5.0, sensors);
}

class RestoreTest : public testing::Test, protected Controlled {
 protected:
  RestoreTest() {
    std::string made = (fs::temp_directory_path() / "ruedo-restore-XXXXXX").string();
    folder_ = ::mkdtemp(made.data());
    use_key("mine");
  }
  ~RestoreTest() override {
    end();
    fs::remove_all(folder_);
  }
  // The user's, from now on: files are sealed with it.
  void use_key(const std::string& whose) const {
    ::setenv("XDG_STATE_HOME", (folder_ + "/" + whose).c_str(), 1);
  }
  RunOptions with_snapshots(RunOptions options) {
    options.snapshots = folder_;
    options.simulation.fleet.disabled = {"r/camera"};
    options.simulation.before_batch = [this](const std::string& module) {
      batches_ += module == "kinematics";
    };
    return options;
  }
  // In a server that begins with it, whose log gets `record`; whether that ran the past again.
  bool begin_with(const std::string& name, const std::string& record = "") {
    end();
    batches_ = 0;
    RunOptions options = with_snapshots(paused_server());
    options.repeat = file(name);
    options.record = record;
    begin(std::move(options), kRobot + wandering_robot());
    state_reply_t back = state();
    for (int i = 0; i < 10'000 && back.step < saved_.step; ++i) back = state();  // on its way
    EXPECT_EQ(back.step, saved_.step);
    EXPECT_EQ(back.state_hash, saved_.state_hash);
    return batches_ > 5;
  }
  void start_paused(RunOptions options = paused_server()) {
    begin(with_snapshots(std::move(options)), kRobot + wandering_robot());
    velocity_command_t command{};
    command.vx = 0.6;
    command.omega = 0.1;
    bus.send("r/velocity", engine::encoded(command));
  }
  reply_t named(int32_t kind, const std::string& name) {
    name_request_t body;
    body.name = name;
    return ask(kind, engine::encoded(body));
  }
  state_reply_t save(const std::string& name) {
    const reply_t reply = named(request_t::SNAPSHOT, name);
    EXPECT_EQ(reply.code, reply_t::OK) << reply.text;
    return decoded_as<state_reply_t>(reply.body);
  }
  // Restores it; whether that ran the past again.
  bool restore(const std::string& name) {
    const int before = batches_;
    const reply_t reply = named(request_t::RESTORE, name);
    EXPECT_EQ(reply.code, reply_t::OK) << reply.text;
    const auto back = decoded_as<state_reply_t>(reply.body);
    EXPECT_EQ(back.step, saved_.step);
    EXPECT_EQ(back.state_hash, saved_.state_hash);
    EXPECT_EQ(reply.utime, saved_.utime);
    EXPECT_EQ(info().epoch, reply.epoch);
    return batches_ > before + 5;  // the end of one run and the beginning of the next are some, too
  }
  // The messages of the next steps, with a command on the way; without the epoch.
  std::vector<std::pair<std::string, std::vector<uint8_t>>> go_on(int64_t steps = 300) {
    const size_t from = bus.messages().size();
    step(steps);
    velocity_command_t command{};
    command.vx = -0.4;
    bus.send("r/velocity", engine::encoded(command));
    step(steps);
    std::vector<std::pair<std::string, std::vector<uint8_t>>> sent;
    const std::vector<Message> all = bus.messages();
    for (size_t i = from; i < all.size(); ++i) {
      if (all[i].channel == "ruedo/info" || all[i].channel == "ruedo/reply") continue;
      sent.emplace_back(all[i].channel, all[i].bytes);
      if (all[i].channel == "ruedo/world") {
        auto world = decoded_as<world_state_t>(all[i].bytes);
        world.epoch = 0;
        sent.back().second = engine::encoded(world);
      } else if (all[i].channel == "ruedo/tick") {
        auto tick = decoded_as<tick_t>(all[i].bytes);  // with the number of each message
        tick.epoch = 0;
        tick.run_id = 0;
        for (auto& manifest : tick.manifest)
          if (server().channels().list()[manifest.channel_index].name == "ruedo/world")
            manifest.crc = 0;
        tick.applied.clear();
        tick.napplied = 0;
        sent.back().second = engine::encoded(tick);
      }
    }
    EXPECT_GT(sent.size(), 300u);
    return sent;
  }
  // Makes the file another user's, of a run that ended at that step.
  void lead_to(const std::string& name, int64_t step) const {
    std::vector<log::Event> events;
    {
      log::Reader reader(file(name));
      for (log::Event event; reader.next(event);)
        if (event.channel != kStateChannel) events.push_back(event);
    }
    auto end = decoded_as<state_hash_t>(events.back().data);
    end.step = step;
    events.back().data = engine::encoded(end);
    log::Writer writer(file(name));
    for (const log::Event& event : events)
      writer.write(event.timestamp_us, event.channel, event.data.data(), event.data.size());
  }
  request_t restoring(const std::string& name) {
    name_request_t body;
    body.name = name;
    return request(request_t::RESTORE, engine::encoded(body));
  }
  std::string file(const std::string& name) const { return folder_ + "/" + name + ".snapshot"; }

  state_reply_t saved_;
  std::string folder_;
  std::atomic<int> batches_{0};
};

TEST_F(RestoreTest, ARestoredRunContinuesEqually) {
  start_paused();
  step(400);  // against the box
  saved_ = save("here");
  const auto followed = go_on();
  EXPECT_FALSE(restore("here"));
  EXPECT_EQ(go_on(), followed);
  reset(reset_request_t::ALL, 9);
  step(10);
  EXPECT_FALSE(restore("here")) << "into another seed's world";
  EXPECT_EQ(info().seed, 1);
  EXPECT_EQ(go_on(), followed);
  ASSERT_EQ(spawn(as_file(box_sdf("b", "0.2 0.2 0.2", false)), 2, 2, "b").code, reply_t::OK);
  step(10);
  EXPECT_FALSE(restore("here")) << "into a world that models came into";
  EXPECT_EQ(go_on(), followed);
  EXPECT_FALSE(restore("here"));
  ASSERT_EQ(set_pose("box", Vec3(3, 3, 0.2)).code, reply_t::OK);
  reset(reset_request_t::TIME);
  step(10);
  EXPECT_FALSE(restore("here")) << "after a reset of the time";
  EXPECT_EQ(go_on(), followed);
  fs::last_write_time(file("here"), fs::file_time_type::clock::now());
  EXPECT_FALSE(restore("here")) << "from the file, which was touched";
  EXPECT_EQ(go_on(), followed);
  use_key("another");
  fs::last_write_time(file("here"), fs::file_time_type::clock::now());
  EXPECT_TRUE(restore("here")) << "somebody else's file";
  EXPECT_EQ(go_on(), followed);
}

TEST_F(RestoreTest, AnotherServerBeginsWithTheState) {
  start_paused();
  step(400);
  saved_ = save("here");
  const auto followed = go_on();
  EXPECT_FALSE(begin_with("here"));
  EXPECT_EQ(go_on(), followed);
  EXPECT_FALSE(restore("here"));
  EXPECT_EQ(go_on(), followed);
  saved_ = save("later");
  const auto later = go_on();
  EXPECT_FALSE(begin_with("later")) << "of a run that began with a snapshot";
  EXPECT_EQ(go_on(), later);
  use_key("another");
  EXPECT_TRUE(begin_with("later")) << "somebody else's file: by what acted on both runs";
  EXPECT_EQ(go_on(), later);
}

TEST_F(RestoreTest, ALogOfARunThatBeganWithASnapshotHasThePastToo) {
  start_paused();
  step(400);
  saved_ = save("here");
  const auto followed = go_on();
  TemporaryFile log("restored.lcm");
  EXPECT_TRUE(begin_with("here", log.path()));
  EXPECT_EQ(go_on(), followed);
  saved_ = save("logged");
  const auto later = go_on();
  EXPECT_FALSE(begin_with("logged")) << "a run with a log writes states, too";
  EXPECT_EQ(go_on(), later);
}

TEST_F(RestoreTest, RefusesALinkToItself) {
  start_paused();
  step(10);
  saved_ = save("here");
  fs::remove(file("here"));
  fs::create_symlink(file("here"), file("here"));
  EXPECT_EQ(named(request_t::RESTORE, "here").code, reply_t::UNKNOWN_NAME);
  EXPECT_EQ(step(1).step, 11) << "the run goes on";
}

// A sealed state is the user's own; without its seal it is not read.
TEST_F(RestoreTest, AFileWithAByteChangedLeadsThereOrIsRefused) {
  start_paused();
  step(100);
  saved_ = save("here");
  const std::string whole = read_input(file("here"), size_t{1} << 30);
  const auto write = [&](const std::string& bytes) {
    std::ofstream(file("here"), std::ios::binary) << bytes;
  };
  const auto comes_back = [&] {
    const reply_t reply = named(request_t::RESTORE, "here");
    if (reply.code != reply_t::OK) return false;
    EXPECT_EQ(decoded_as<state_reply_t>(reply.body).state_hash, saved_.state_hash);
    return true;
  };
  int back = 0;
  for (size_t at = 0; at < whole.size(); at += whole.size() / 97) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 0x41);
    write(changed);
    back += comes_back();
    write(whole.substr(0, at));
    EXPECT_FALSE(comes_back()) << "cut off at " << at;
  }
  EXPECT_GT(back, 80) << "most of the file is the state: without it the run gets there again";
  write(whole);
  EXPECT_FALSE(restore("here"));
}

TEST_F(RestoreTest, ASnapshotAfterARestoreLeadsToItsState) {
  start_paused();
  step(400);
  saved_ = save("first");
  go_on();
  EXPECT_FALSE(restore("first"));
  ASSERT_EQ(set_pose("box", Vec3(0.5, 1.0, 0.2)).code, reply_t::OK);
  step(100);
  saved_ = save("second");
  const auto followed = go_on();
  use_key("another");
  fs::last_write_time(file("second"), fs::file_time_type::clock::now());
  EXPECT_TRUE(restore("second"));
  EXPECT_EQ(go_on(), followed);
}

TEST_F(RestoreTest, DoesNotSavePendingCommands) {
  start_paused();
  step(100);
  velocity_command_t command{};
  command.vx = -1.0;
  bus.send("r/velocity", engine::encoded(command));
  saved_ = save("here");
  step(50);
  fs::last_write_time(file("here"), fs::file_time_type::clock::now());
  EXPECT_FALSE(restore("here"));
  const auto followed = go_on();
  use_key("another");
  EXPECT_TRUE(restore("here"));
  EXPECT_EQ(go_on(), followed);
  EXPECT_TRUE(restore("here"));
  use_key("mine");
  saved_ = save("here");  // now in memory
  bus.send("r/velocity", engine::encoded(command));
  EXPECT_FALSE(restore("here"));
  EXPECT_EQ(go_on(), followed);
}

TEST_F(RestoreTest, ResimulatesAnEditedWorld) {
  start_paused();
  step(200);
  ASSERT_EQ(spawn(as_file(box_sdf("b", "0.2 0.2 0.2", false)), 2, 2, "b").code, reply_t::OK);
  step(200);
  saved_ = save("edited");
  const auto followed = go_on();
  EXPECT_TRUE(restore("edited"));
  EXPECT_EQ(go_on(), followed);
}

TEST_F(RestoreTest, ARefusedRequestCostsNoState) {
  start_paused();
  step(100);
  save("before");
  EXPECT_NE(remove("nobody").code, reply_t::OK);
  EXPECT_NE(spawn("no text", 5.0, 5.0).code, reply_t::OK);
  EXPECT_NE(spawn(robot_sdf("r", 0, 0), 0.0, 0.0).code, reply_t::OK);  // there is something
  saved_ = save("after");
  EXPECT_GE(fs::file_size(file("after")), fs::file_size(file("before")));
  const auto followed = go_on();
  EXPECT_FALSE(restore("after"));
  EXPECT_EQ(go_on(), followed);
}

TEST_F(RestoreTest, ResimulatesALoggedRun) {
  RunOptions options = paused_server();
  options.record = folder_ + "/restored.lcm";
  start_paused(options);
  step(400);
  saved_ = save("here");
  const auto followed = go_on();
  EXPECT_TRUE(restore("here"));
  EXPECT_EQ(go_on(), followed);
}

TEST_F(RestoreTest, KeepsTheNewestSnapshots) {
  start_paused();
  step(400);
  saved_ = save("0");
  for (size_t i = 1; i < SavedStates::kMost; ++i) save(std::to_string(i));
  EXPECT_FALSE(restore("0"));
  use_key("another");
  EXPECT_FALSE(restore("0"));
  save("another");
  EXPECT_TRUE(restore("0")) << "it is in the file alone, which another's key has sealed";
  EXPECT_FALSE(restore("1"));
}

TEST_F(RestoreTest, SavesAndRestoresARunningRun) {
  start_paused();
  ask(request_t::RESUME);
  rate_request_t rate;
  rate.rate = std::numeric_limits<double>::infinity();
  ask(request_t::RATE, engine::encoded(rate));
  saved_ = save("here");
  for (int i = 0; i < 20; ++i) {
    const reply_t reply = named(request_t::RESTORE, "here");
    ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
    const auto back = decoded_as<state_reply_t>(reply.body);
    ASSERT_EQ(back.step, saved_.step);
    ASSERT_EQ(back.state_hash, saved_.state_hash);
    ASSERT_FALSE(back.paused);
  }
  ask(request_t::PAUSE);
  EXPECT_FALSE(restore("here"));
}

// Hours away. The command that was read ahead does not act on what is there then.
TEST_F(RestoreTest, APauseCancelsALongResimulation) {
  start_paused();
  step(100);
  saved_ = save("far");
  lead_to("far", kMostSteps);
  const request_t restore = restoring("far");
  send(restore);
  for (int i = 0; i < 10'000 && (state().step < 10 || info().epoch == 0); ++i) {
  }
  rate_request_t rate;
  rate.rate = 2;
  const reply_t refused = ask(request_t::RATE, engine::encoded(rate));
  EXPECT_EQ(refused.code, reply_t::REFUSED) << "by others, who are told why";
  EXPECT_THAT(refused.text, testing::HasSubstr("is being restored"));
  const request_t pause = request(request_t::PAUSE);
  send(pause);
  const reply_t ended = answer(restore);
  EXPECT_EQ(ended.code, reply_t::REFUSED);
  EXPECT_THAT(ended.text, testing::HasSubstr("a PAUSE ended it at step "));
  const reply_t paused = answer(pause);
  EXPECT_EQ(paused.code, reply_t::OK) << paused.text;
  const auto there = decoded_as<state_reply_t>(paused.body);
  EXPECT_TRUE(there.paused);
  EXPECT_LT(there.step, kMostSteps);
  EXPECT_EQ(step(3).step, there.step + 3) << "the run goes on from there";
}

TEST_F(RestoreTest, RefusesUnreachableStatesBeforeAnythingChanges) {
  TemporaryFile log("refused.lcm");
  RunOptions options = paused_server();
  options.record = log.path();
  start_paused(options);
  step(100);
  saved_ = save("far");
  const auto refused = [&](const std::string& why) {
    const reply_t reply = named(request_t::RESTORE, "far");
    EXPECT_EQ(reply.code, reply_t::REFUSED);
    EXPECT_THAT(reply.text, testing::HasSubstr(why));
    EXPECT_EQ(info().epoch, 0);
    EXPECT_EQ(state().state_hash, saved_.state_hash);
  };
  for (const int64_t steps : {kMostSteps + 1, std::numeric_limits<int64_t>::max()}) {
    lead_to("far", steps);
    refused("far.snapshot is " + std::to_string(steps) +
            " steps from its beginning; RESTORE repeats 1000000000 at most");
  }
  fs::resize_file(file("far"), fs::file_size(file("far")) - 1);
  refused("far.snapshot: is not a snapshot: cut off in the event that begins at byte ");
  end();
  EXPECT_EQ(length_of(log.path()).steps, 100) << "the log has no reset that was none";
}

}  // namespace
}  // namespace ruedo::run
