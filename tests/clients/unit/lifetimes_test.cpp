// Handles and callbacks that outlive their owner, or are destroyed before it. Under the sanitizers:
// no memory is used after it was freed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "fake_transport.h"

using namespace ruedo::client;
using namespace std::chrono_literals;

namespace {

constexpr Duration kPatience = 300.0;

class Lifetimes : public testing::Test {
 protected:
  // The text of the error; "" without one.
  static std::string error_of(const std::function<void()>& call) {
    try {
      call();
    } catch (const NoServer& error) {
      return error.what();
    }
    return "";
  }

  std::shared_ptr<FakeServer> server = std::make_shared<FakeServer>();
};

TEST_F(Lifetimes, HandlesOutliveTheirSimulation) {
  std::optional<Simulation> sim(simulation(server));
  const Robot robot = sim->robot("p3at");
  const Device<Odometry> odometry = robot.odometry();
  const Stream<MotionStatus> motion = robot.motion();
  server->send_odometry("p3at", 1000, 1.5);
  const auto first = [&] {
    auto got = std::async(std::launch::async, [&] { return odometry.latest(kPatience); });
    while (got.wait_for(1ms) != std::future_status::ready) server->send_odometry("p3at", 1000, 1.5);
    return got.get();
  }();
  EXPECT_EQ(first.x, 1.5);
  const Motion under_way = robot.advance(1.0);
  sim.reset();

  const std::string closed = "this simulation was closed";
  EXPECT_EQ(error_of([&] { (void)odometry.latest(); }), closed);  // though one is there
  EXPECT_EQ(error_of([&] { odometry.next(); }), closed);
  EXPECT_EQ(error_of([&] { (void)odometry.on_sample([](const Odometry&) {}); }), closed);
  EXPECT_EQ(error_of([&] { motion.next(); }), closed);
  EXPECT_EQ(error_of([&] { robot.set_velocity(0.1, 0.0); }), closed);
  EXPECT_EQ(error_of([&] { robot.advance(1.0); }), closed);
  EXPECT_EQ(error_of([&] { under_way.wait(); }), closed);
  EXPECT_EQ(robot.info().name, "p3at");  // what is known stays known
  EXPECT_EQ(odometry.channel(), "p3at/odometry");
}

TEST_F(Lifetimes, RequestsFailAfterClose) {
  Simulation sim = simulation(server);
  sim.close();
  sim.close();
  const std::vector<std::function<void()>> calls = {[&] { sim.pause(); },
                                                    [&] { sim.resume(); },
                                                    [&] { sim.step(); },
                                                    [&] { sim.set_rate(1.0); },
                                                    [&] { sim.reset(); },
                                                    [&] { sim.spawn("p3at", 0.0, 0.0); },
                                                    [&] { sim.remove("p3at"); },
                                                    [&] { sim.set_pose("p3at", 0.0, 0.0); },
                                                    [&] { sim.set_twist("p3at", {}); },
                                                    [&] { (void)sim.state(); },
                                                    [&] { sim.reset_odometry("p3at"); },
                                                    [&] { sim.snapshot("s"); },
                                                    [&] { sim.restore("s"); },
                                                    [&] { sim.quit(); },
                                                    [&] { sim.markers("layer", {}); },
                                                    [&] { sim.sleep(1.0); },
                                                    [&] { (void)sim.on_new_run([] {}); }};
  for (size_t i = 0; i < calls.size(); ++i)
    EXPECT_EQ(error_of(calls[i]), "this simulation was closed") << i;
  EXPECT_EQ(sim.world(), "memory");
}

TEST_F(Lifetimes, RequestsOfAMovedSimulationFail) {
  Simulation sim = simulation(server);
  Simulation other = std::move(sim);
  const std::string closed = "this simulation was closed";
  EXPECT_EQ(error_of([&] { (void)sim.world(); }), closed);  // NOLINT: moved from on purpose
  EXPECT_EQ(error_of([&] { sim.pause(); }), "this simulation was closed");
  EXPECT_EQ(error_of([&] { (void)sim.robot("p3at"); }), "this simulation was closed");
  sim.close();
  sim = std::move(other);
  EXPECT_EQ(sim.world(), "memory");
}

TEST_F(Lifetimes, CloseWakesWaitingThreads) {
  Simulation sim = simulation(server);
  auto waiting = std::async(std::launch::async, [&] {
    return error_of([&] { sim.robot("p3at").odometry().next(kPatience); });
  });
  auto sleeping = std::async(std::launch::async, [&] { return error_of([&] { sim.sleep(1e6); }); });
  std::this_thread::sleep_for(1ms);
  sim.close();
  EXPECT_EQ(waiting.get(), "this simulation was closed");
  EXPECT_EQ(sleeping.get(), "this simulation was closed");
}

TEST_F(Lifetimes, AClosedSubscriptionCallsNoCallback) {
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  auto count = std::make_unique<std::atomic<int>>(0);
  int others = 0;
  Subscription kept = odometry.on_sample([&](const Odometry&) { ++others; });
  {
    const Subscription own = odometry.on_sample([raw = count.get()](const Odometry&) { ++*raw; });
    server->send_odometry("p3at", 1000, 0.0);
    server->await_delivery();
    EXPECT_EQ(*count, 1);
  }
  count.reset();  // a call after this would be seen
  server->send_odometry("p3at", 2000, 0.0);
  server->await_delivery();
  kept.close();
  EXPECT_EQ(others, 2);
}

TEST_F(Lifetimes, ClosingWaitsForACallUnderWay) {
  const Simulation sim = simulation(server);
  std::promise<void> begun, go_on;
  std::atomic<bool> ended{false};
  Subscription subscription = sim.robot("p3at").odometry().on_sample([&](const Odometry&) {
    begun.set_value();
    go_on.get_future().wait();
    ended = true;
  });
  server->send_odometry("p3at", 1000, 0.0);
  begun.get_future().wait();
  std::thread later([&] {
    std::this_thread::sleep_for(20ms);
    go_on.set_value();
  });
  subscription.close();
  EXPECT_TRUE(ended);
  later.join();
}

TEST_F(Lifetimes, ACallbackMayTakeItselfBack) {
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  int count = 0;
  Subscription subscription = odometry.on_sample([&](const Odometry&) {
    ++count;
    subscription.close();
  });
  for (int i = 1; i <= 3; ++i) server->send_odometry("p3at", 1000 * i, 0.0);
  server->await_delivery();
  EXPECT_EQ(count, 1);
  EXPECT_FALSE(subscription.open());
}

TEST_F(Lifetimes, ACallbackMayDestroyTheSimulation) {
  std::optional<Simulation> sim(simulation(server));
  std::promise<void> done;
  sim->robot("p3at")
      .odometry()
      .on_sample([&](const Odometry&) {
        sim.reset();
        done.set_value();
      })
      .keep();
  server->send_odometry("p3at", 1000, 0.0);
  done.get_future().wait();
  EXPECT_FALSE(sim);
}

TEST_F(Lifetimes, CloseInACallbackRepeatsLeaveUntilItsReply) {
  server->lost_leaves = 2;
  Simulation sim = simulation(server);
  sim.pause();
  int count = 0;
  sim.robot("p3at")
      .odometry()
      .on_sample([&](const Odometry&) {
        ++count;
        sim.close();
        server->send_odometry("p3at", 2000, 0.0);
      })
      .keep();
  server->send_odometry("p3at", 1000, 0.0);
  server->await([&] { return server->leaves > 0; });
  sim.close();                   // which waits for the end
  EXPECT_GE(server->leaves, 3);  // the third is answered; a late client repeats it meanwhile
  EXPECT_LE(server->leaves, 5);
  EXPECT_EQ(count, 1);
}

enum class Meanwhile { waits, sleeps, steps };

// A program with one simulation that has a session, whose callback is called once; in the thread
// that steps, where one does.
[[noreturn]] void run_until(const std::shared_ptr<FakeServer>& server, Meanwhile meanwhile,
                            const std::function<void(std::optional<Simulation>&)>& callback) {
  static std::optional<Simulation> sim;
  auto& done = *new std::promise<void>;  // which outlives the end that a callback begins
  alarm(static_cast<unsigned>(kPatience.count()));
  if (meanwhile == Meanwhile::steps) server->features = -1;  // in lockstep
  sim.emplace(simulation(server));
  sim->pause();
  sim->robot("p3at")
      .odometry()
      .on_sample([=, &done, me = std::this_thread::get_id()](const Odometry&) {
        if (meanwhile == Meanwhile::steps && std::this_thread::get_id() != me) return;
        callback(sim);
        done.set_value();
      })
      .keep();
  std::thread([server] {
    for (;; std::this_thread::sleep_for(1ms)) server->send_odometry("p3at", 1000, 0.0);
  }).detach();
  if (meanwhile == Meanwhile::steps) sim->step(1);
  if (meanwhile == Meanwhile::sleeps) {
    EXPECT_THROW(sim->sleep(kPatience), NoServer);
  } else {
    done.get_future().wait();
  }
  std::exit(5);  // as a return from main()
}

TEST_F(Lifetimes, ACallbackThatEndsTheProgramLeaves) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto exits = [](std::optional<Simulation>&) { std::exit(5); };
  server->lost_leaves = 2;
  const testing::ExitedWithCode ended(5);
  EXPECT_EXIT(run_until(server, Meanwhile::waits, exits), ended, "a client has left");
  EXPECT_EXIT(run_until(server, Meanwhile::steps, exits), ended, "a client has left");
  EXPECT_EXIT(run_until(server, Meanwhile::sleeps, exits), ended, "a client has left");
}

TEST_F(Lifetimes, AProgramThatReturnsAfterItsCallbackHasClosedLeaves) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  server->lost_leaves = 2;
  EXPECT_EXIT(run_until(server, Meanwhile::waits, [](auto& sim) { sim.reset(); }),
              testing::ExitedWithCode(5), "a client has left");
}

TEST_F(Lifetimes, AProgramThatExitsLeaves) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  server->lost_leaves = 2;
  const auto exits = [this](bool beside_a_step) {
    if (beside_a_step) server->features = -1;  // in lockstep
    Simulation sim = simulation(server);
    sim.pause();
    std::promise<void> steps;
    std::thread stepping;
    if (beside_a_step) {
      stepping = std::thread([&] {
        steps.set_value();
        sim.step(1);
      });
      steps.get_future().wait();
    }
    std::exit(5);
  };
  const testing::ExitedWithCode ended(5);
  EXPECT_EXIT(exits(false), ended, "a client has left");
  EXPECT_EXIT(exits(true), ended, "a client has left");
}

TEST_F(Lifetimes, AnExitInASignalsHandlerWaitsForNoLock) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  server->exits_on_pause = true;
  const auto exits = [this] {
    alarm(static_cast<unsigned>(kPatience.count()));
    const Simulation sim = simulation(server);
    sim.pause();
  };
  EXPECT_EXIT(exits(), testing::ExitedWithCode(5), "");
}

TEST_F(Lifetimes, ALeaveIsRepeatedAFewTimes) {
  server->lost_leaves = 1000;
  Simulation sim = simulation(server);
  sim.pause();
  sim.close();
  EXPECT_EQ(server->leaves, 5);
}

TEST_F(Lifetimes, DoesNotWaitForAnEndedServer) {
  Simulation sim = simulation(server);
  sim.pause();
  server->gone = true;
  sim.close();
  EXPECT_EQ(server->leaves, 1);
}

TEST_F(Lifetimes, TwoSimulationsInAProcessEndInEitherOrder) {
  for (const bool first_ends_first : {true, false}) {
    const auto first_server = std::make_shared<FakeServer>(),
               second_server = std::make_shared<FakeServer>();
    std::optional<Simulation> first(simulation(first_server)), second(simulation(second_server));
    const auto odometry = first->robot("p3at").odometry(), other = second->robot("p3at").odometry();
    std::promise<void> done;
    Subscription closing = odometry.on_sample([&](const Odometry&) {
      second->close();  // by a callback of the first
      done.set_value();
    });
    first_server->send_odometry("p3at", 1000, 1.0);
    done.get_future().wait();
    closing.close();
    EXPECT_EQ(error_of([&] { other.next(); }), "this simulation was closed");
    first_server->send_odometry("p3at", 2000, 2.0);
    first_server->await_delivery();
    EXPECT_EQ(odometry.latest(kPatience).x, 2.0);  // the first continues
    (first_ends_first ? first : second).reset();
    (first_ends_first ? second : first).reset();
    EXPECT_EQ(error_of([&] { odometry.next(); }), "this simulation was closed");
    EXPECT_EQ(error_of([&] { other.next(); }), "this simulation was closed");
  }
}

TEST_F(Lifetimes, TwoCallbacksMayCloseEachOthersSimulation) {
  for (int round = 0; round < 20; ++round) {
    const auto first_server = std::make_shared<FakeServer>(),
               second_server = std::make_shared<FakeServer>();
    std::optional<Simulation> first(simulation(first_server)), second(simulation(second_server));
    std::promise<void> here[2], done[2];
    const auto meet = [&](int me, Simulation& other) {
      here[me].set_value();
      here[1 - me].get_future().wait();
      other.close();
      done[me].set_value();
    };
    first->robot("p3at").odometry().on_sample([&](const Odometry&) { meet(0, *second); }).keep();
    second->robot("p3at").odometry().on_sample([&](const Odometry&) { meet(1, *first); }).keep();
    first_server->send_odometry("p3at", 1000, 1.0);
    second_server->send_odometry("p3at", 1000, 1.0);
    for (std::promise<void>& one : done) one.get_future().wait();
  }
}

TEST_F(Lifetimes, TwoCallbacksMayCloseEachOther) {
  for (int round = 0; round < 20; ++round) {
    const std::shared_ptr<FakeServer> servers[] = {std::make_shared<FakeServer>(),
                                                   std::make_shared<FakeServer>()};
    const Simulation sims[] = {simulation(servers[0]), simulation(servers[1])};
    Subscription subscriptions[2];
    std::promise<void> here[2], done[2];
    for (const size_t me : {size_t{0}, size_t{1}}) {
      subscriptions[me] = sims[me].robot("p3at").odometry().on_sample([&, me](const Odometry&) {
        here[me].set_value();
        here[1 - me].get_future().wait();
        subscriptions[1 - me].close();
        done[me].set_value();
      });
    }
    for (const auto& one : servers) one->send_odometry("p3at", 1000, 1.0);
    for (std::promise<void>& one : done) one.get_future().wait();
  }
}

// The first line that anybody writes to it meanwhile.
std::string first_line_of_stderr(const std::function<void()>& meanwhile) {
  int ends[2];
  const int before = dup(STDERR_FILENO);
  EXPECT_EQ(pipe(ends), 0);
  dup2(ends[1], STDERR_FILENO);
  close(ends[1]);
  meanwhile();
  std::string line;
  for (char c = 0; c != '\n' && read(ends[0], &c, 1) == 1;) line += c;
  dup2(before, STDERR_FILENO);
  close(before);
  close(ends[0]);
  return line;
}

TEST_F(Lifetimes, ReportsACallbackThatDoesNotReturn) {
  for (const bool by_subscription : {true, false}) {
    Simulation sim = simulation(server);
    std::promise<void> here, go_on;
    Subscription told = sim.robot("p3at").odometry().on_sample([&](const Odometry&) {
      here.set_value();
      go_on.get_future().wait();
    });
    server->send_odometry("p3at", 1000, 1.0);
    here.get_future().wait();
    std::future<void> closing;
    EXPECT_EQ(first_line_of_stderr([&] {
                closing = std::async(std::launch::async,
                                     [&] { by_subscription ? told.close() : sim.close(); });
              }),
              "ruedo: a callback on p3at/odometry has not returned for 5 s: close() waits for "
              "it\n");
    go_on.set_value();
    closing.get();
  }
}

TEST_F(Lifetimes, WaitingInACallbackFailsAtOnce) {
  const Simulation sim = simulation(server);
  const Robot robot = sim.robot("p3at");
  const auto odometry = robot.odometry();
  const auto motion = robot.advance(1.0);
  const std::vector<std::function<void()>> waits = {
      [&] { odometry.next(kPatience); },
      [&] { sim.pause(); },
      [&] { sim.sleep(1.0); },
      [&] { motion.wait(); },
      [&] { sim.step(1); },
      [&] { (void)sim.state(); },
      [&] { sim.restore("s"); },
      [&] { sim.remove("x"); },
      [&] { sim.spawn("p3at", 0, 0); },
  };
  std::promise<std::vector<std::string>> said;
  const Subscription waiting = odometry.on_sample([&](const Odometry&) {
    std::vector<std::string> errors;
    (void)odometry.latest();  // it is there: nothing is waited for
    for (const auto& wait : waits) {
      try {
        wait();
        errors.emplace_back("none");
      } catch (const Error& error) {
        errors.emplace_back(error.what());
      }
    }
    said.set_value(errors);
  });
  server->send_odometry("p3at", 1000, 1.0);
  EXPECT_THAT(said.get_future().get(),
              testing::AllOf(testing::SizeIs(waits.size()),
                             testing::Each(testing::StartsWith("a callback cannot wait"))));
}

TEST_F(Lifetimes, AForkedChildCannotUseOrEndTheSimulation) {
  auto sim = std::make_unique<Simulation>(simulation(server));
  const Robot robot = sim->robot("p3at");
  const auto odometry = robot.odometry();
  auto hearing = std::make_unique<Subscription>(odometry.on_sample([](const Odometry&) {}));
  robot.set_velocity(0.1, 0.0);  // there is a thread that repeats it
  const pid_t child = fork();
  if (child == 0) {
    alarm(60);
    const std::string forked =
        "this simulation is the parent process's: connect() again after a fork";
    const bool told = error_of([&] { sim->pause(); }) == forked &&
                      error_of([&] { (void)odometry.latest(); }) == forked &&
                      error_of([&] { robot.set_velocity(0.2, 0.0); }) == forked &&
                      error_of([&] { (void)sim->robots(); }) == forked;
    hearing.reset();
    sim.reset();
    _exit(told ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  server->send_odometry("p3at", 2000, 2.0);
  server->await_delivery();
  EXPECT_EQ(odometry.latest(kPatience).x, 2.0);  // the parent's continues
}

TEST_F(Lifetimes, RefusesInvalidArgumentsAtOnce) {
  const Simulation sim = simulation(server);
  SpawnOptions options;
  options.text = "<sdf>" + std::string(size_t{5} << 20, 'x');
  EXPECT_THROW(sim.spawn("", 0.0, 0.0, options), Error);
  EXPECT_THROW((void)sim.robot("p3at").odometry().on_sample({}), std::invalid_argument);
  EXPECT_THROW((void)sim.on_new_run({}), std::invalid_argument);
  EXPECT_THROW(sim.sleep(std::nan("")), std::invalid_argument);
  for (const std::string& name : {std::string(64, 'x'), std::string(10'000'000, 'x'),
                                  std::string("a\nb"), std::string("\xe9"), std::string("\u202e")})
    EXPECT_THROW((void)connect("memq://", {.name = name}), std::invalid_argument);
}

TEST_F(Lifetimes, ATimeThatNoNumberHoldsIsLong) {
  Simulation sim = simulation(server);
  auto sleeping =
      std::async(std::launch::async, [&] { return error_of([&] { sim.sleep(1e300); }); });
  EXPECT_EQ(sleeping.wait_for(100ms), std::future_status::timeout);
  sim.close();
  EXPECT_EQ(sleeping.get(), "this simulation was closed");
}

TEST_F(Lifetimes, ACallbackOfANewRunMayDestroyTheSimulation) {
  std::optional<Simulation> sim(simulation(server));
  std::promise<void> done;
  sim->on_new_run([&] {
       sim.reset();
       done.set_value();
     })
      .keep();
  server->run_id = 8;
  auto ended = done.get_future();
  while (ended.wait_for(1ms) != std::future_status::ready) server->send_tick(1000);
  EXPECT_FALSE(sim);
}

TEST_F(Lifetimes, TheNextCallRethrowsAnErrorOfACallback) {
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  int heard = 0;
  testing::internal::CaptureStderr();
  const Subscription first = odometry.on_sample(
      [](const Odometry&) { throw std::runtime_error("a fault of the user's"); });
  const Subscription second = odometry.on_sample([](const Odometry&) { throw 42; });
  const Subscription third = odometry.on_sample([&](const Odometry&) { ++heard; });
  for (int i = 1; i <= 3; ++i) server->send_odometry("p3at", 1000 * i, 0.0);
  server->await_delivery();
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "ruedo: a callback on p3at/odometry failed: it threw something other than a "
            "std::exception; it "
            "stays subscribed (shown once)\n"
            "ruedo: a callback on p3at/odometry failed: a fault of the user's; it stays subscribed "
            "(shown once)\n");
  EXPECT_EQ(heard, 3);
  EXPECT_THROW((void)odometry.latest(), std::runtime_error);
  EXPECT_EQ(odometry.latest().utime, 3000);
}

TEST_F(Lifetimes, EachReaderHasACursorOfItsOwn) {
  const Simulation sim = simulation(server);
  const Robot robot = sim.robot("p3at");
  const auto first = robot.odometry(), second = robot.odometry();
  const auto told = robot.odometry().on_sample([](const Odometry&) {});
  server->send_odometry("p3at", 1000, 1.0);
  server->await_delivery();
  EXPECT_EQ(first.next(kPatience).x, 1.0);
  EXPECT_EQ(second.next(kPatience).x, 1.0);  // it is not stolen
  EXPECT_THROW(robot.odometry().next(0.01),
               Timeout);  // a new one begins where the channel was last read
  EXPECT_EQ(robot.odometry().latest(kPatience).x, 1.0);
  server->send_odometry("p3at", 2000, 2.0);
  server->await_delivery();
  EXPECT_EQ(robot.odometry().next(kPatience).x, 2.0);
  EXPECT_EQ(first.next(kPatience).x, 2.0);
}

TEST_F(Lifetimes, ANewRobotOfTheSameNameDoesNotGetTheOldCommands) {
  const Simulation sim = simulation(server);
  const Robot robot = sim.robot("p3at");
  robot.set_velocity(0.1, 0.0);
  const Motion motion = robot.advance(1.0);
  robot.set_velocity(0.2, 0.0);
  server->await([&] { return server->heard("p3at/velocity") >= 4; });  // it is repeated
  server->robots = {"other"};
  server->send_info();
  server->await_delivery();
  EXPECT_EQ(motion.state(), MotionState::ended);
  EXPECT_EQ(motion.reason(), MotionReason::removed);
  server->robots = {"p3at"};
  server->send_info();
  server->await_delivery();
  const int64_t before = server->heard("p3at/velocity");
  for (int i = 1; i <= 20; ++i) server->send_tick(20'000 * i);  // each was a repetition
  for (int i = 1; i <= 20; ++i)
    server->send_motion("p3at", 1000 * i, 0, ruedo::motion_status_t::STATE_RUNNING);
  server->await_delivery();
  EXPECT_EQ(server->heard("p3at/velocity"), before);
  robot.set_velocity(0.3, 0.0);  // the old handle drives the new robot
  server->send_motion("p3at", 30'000, 0, ruedo::motion_status_t::STATE_RUNNING);
  server->await([&] { return server->heard("p3at/velocity") >= before + 3; });
}

TEST_F(Lifetimes, ANewRunIsNoticedAndNotDriven) {
  const Simulation sim = simulation(server);
  const Robot robot = sim.robot("p3at");
  const auto odometry = robot.odometry();
  std::atomic<int> events{0};
  const Subscription event = sim.on_new_run([&] { ++events; });
  const Subscription told = odometry.on_sample([](const Odometry&) {});
  server->send_odometry("p3at", 5'000'000, 1.0);
  server->await_delivery();
  const Motion motion = robot.advance(1.0);
  robot.set_velocity(0.2, 0.0);
  server->send_motion("p3at", 5'000'000, motion.id(), ruedo::motion_status_t::STATE_RUNNING);
  server->send_motion(
      "p3at", 1000, 0,
      ruedo::motion_status_t::STATE_IDLE);  // of the next run, whose first word it is
  server->await_delivery();
  EXPECT_EQ(motion.state(), MotionState::running);
  testing::internal::CaptureStderr();
  server->run_id = 8;
  server->await([&] {
    server->send_tick(1000);  // it requests the other's info
    return events == 1;
  });
  server->await_delivery();
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "ruedo: another run has begun at memq://: commands are not repeated into it\n");
  const int64_t before = server->heard("p3at/velocity");
  for (int i = 2; i <= 20; ++i) server->send_tick(20'000 * i);
  server->await_delivery();
  EXPECT_EQ(server->heard("p3at/velocity"), before);
  EXPECT_EQ(motion.reason(), MotionReason::new_run);
  EXPECT_THROW((void)odometry.latest(0.01), Timeout);  // what is known is of the run before
  EXPECT_LT(sim.time(), 1.0);
  sim.pause();  // it joins again
}

TEST_F(Lifetimes, MessagesOfAnotherServerEndNothing) {
  const Simulation sim = simulation(server);
  int events = 0;
  const Subscription event = sim.on_new_run([&] { ++events; });
  const Motion motion = sim.robot("p3at").advance(1.0);
  server->send_motion("p3at", 1000, motion.id(), ruedo::motion_status_t::STATE_RUNNING);
  testing::internal::CaptureStderr();
  for (int i = 1; i <= 10; ++i) {
    server->run_id = 8;
    server->send_tick(9'000'000 + i);
    server->send_info();
    server->run_id = 7;
    server->send_tick(1000 + i);
  }
  server->await_delivery();
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "ruedo: another server is at memq://, too, with run 8; this client is in run 7, world "
            "memory. Their samples mix, and commands reach both: start one of them with another "
            "--lcm port (shown once)\n");
  EXPECT_EQ(motion.state(), MotionState::running);
  EXPECT_EQ(events, 0);
  EXPECT_LT(sim.time(), 1.0);
}

TEST_F(Lifetimes, AFalseTimeOutlastsNoTick) {
  Simulation sim = simulation(server);
  const Subscription told = sim.robot("p3at").odometry().on_sample([](const Odometry&) {});
  server->send_odometry("p3at", int64_t{1} << 60, 0.0);
  server->await_delivery();
  auto sleeping = std::async(std::launch::async, [&] { return error_of([&] { sim.sleep(0.5); }); });
  int64_t utime = 0;
  while (sleeping.wait_for(1ms) != std::future_status::ready && utime < 60'000'000)
    server->send_tick(utime += 10'000);
  EXPECT_GE(utime, 500'000);
  EXPECT_LT(utime, 60'000'000);
  sim.close();
  EXPECT_EQ(sleeping.get(), "");
}

TEST_F(Lifetimes, AFalseTypeOutlastsNoInfo) {
  server->falsehood = 1;
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  EXPECT_THROW((void)odometry.latest(kPatience), TypeMismatch);
  server->falsehood = 0;
  server->send_info();
  server->await_delivery();
  const Subscription told = odometry.on_sample([](const Odometry&) {});
  server->send_odometry("p3at", 1000, 1.0);
  EXPECT_EQ(odometry.latest(kPatience).x, 1.0);
  EXPECT_EQ(sim.robot("p3at").odometry().latest(kPatience).x, 1.0);
}

TEST_F(Lifetimes, UnknownMotionStatesReadAsUnknown) {
  const Simulation sim = simulation(server);
  const auto motion = sim.robot("p3at").motion();
  const Subscription told = motion.on_sample([](const MotionStatus&) {});
  server->send_motion("p3at", 1000, 0, 99, 98);
  server->await_delivery();
  const MotionStatus status = motion.latest(kPatience);
  EXPECT_EQ(status.state, MotionState::unknown);
  EXPECT_STREQ(to_string(status.reason), "unknown");
  EXPECT_STREQ(to_string(MotionReason::not_finite), "not finite");
}

TEST_F(Lifetimes, EightThreadsAndAllThatAClientMayDo) {
  auto sim = std::make_shared<Simulation>(simulation(server));
  std::vector<std::thread> threads;
  std::atomic<int> unexpected{0};
  for (int number = 0; number < 8; ++number) {
    threads.emplace_back([&, number, sim = sim] {
      const Robot robot = sim->robot("p3at");
      for (int i = 0; i < 60; ++i) {
        try {
          const Subscription one = robot.odometry().on_sample([](const Odometry&) {});
          server->send_odometry("p3at", 1000 * i, i);
          robot.set_velocity(0.1, 0.0);
          if (number == 0 && i % 10 == 5) server->send_info();
          if (number == 1) (void)sim->robots();
          if (number == 2) sim->pause();
          if (number == 3) robot.advance(0.1);
          if (number == 7 && i == 50) sim->close();
        } catch (const NoServer&) {  // NOLINT(bugprone-empty-catch): once it was closed
        } catch (...) {
          ++unexpected;
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(unexpected, 0);
}

}  // namespace
