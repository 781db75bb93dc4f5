// The judge: what it counts as kept, failed and not judged, at the edges of each.
#include "engine/judge/judge.h"

#include <cmath>
#include <limits>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/channel_names.h"
#include "ruedo/errors.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"
#include "world/load.h"

namespace ruedo::judge {
namespace {

using testing::HasSubstr;

// A box that stands.
std::string box(const std::string& name, const std::string& pose, bool moves = true) {
  return "<model name='" + name + "'><static>" + (moves ? "false" : "true") + "</static><pose>" +
         pose +
         "</pose><link name='link'><inertial><mass>1</mass></inertial><collision name='c'>"
         "<geometry><box><size>1 1 1</size></box></geometry></collision></link></model>";
}

// A robot whose base_link is its model's frame: a box of 1 m about the point 0.6 m above it.
std::string robot(const std::string& name, const std::string& pose) {
  return "<model name='" + name + "'><pose>" + pose +
         "</pose><link name='base_link'><inertial><pose>0 0 0.6 0 0 "
         "0</pose><mass>1</mass></inertial>"
         "<collision name='c'><pose>0 0 0.6 0 0 0</pose><geometry><box><size>1 1 1</size></box>"
         "</geometry></collision><sensor name='imu' type='imu'/></link></model>";
}

std::shared_ptr<const world::WorldModel> world_of(const std::string& models) {
  return world::load_world_text("<sdf version='1.9'><world name='w'>" + models + "</world></sdf>",
                                "/tmp/w.sdf");
}

constexpr SimTime kStep = 5000;  // us

class JudgeTest : public testing::Test {
 protected:
  void judge(Expectations expected,
             const std::string& models = robot("r", "0 0 0 0 0 0") +
                                         box("box", "5 0 0.5 0 0 0", false)) {
    world_ = world_of(models);
    judge_ = std::make_unique<Judge>(world_, std::move(expected));
    begin();
  }
  // States of the world as it was loaded.
  void begin() {
    const world::BodyLayout layout(*world_);
    state_ = {};
    state_.step = -1;
    for (const world::BodyPlacement& body : layout.bodies) state_.bodies.push_back(body.X_WB);
    state_.wheel_angles.resize(layout.wheels.size());
    for (const world::RobotPlacement& robot : layout.robots) {
      RobotState state;
      state.X_WBase =
          robot.body.valid() ? state_.bodies[robot.body] * robot.X_BBase : robot.X_BBase;
      state_.robots.push_back(state);
    }
    body_ = layout.robots.at(0).body;
  }
  // The next state, with the robot there.
  void see(double x, double y = 0.0) {
    ++state_.step;
    state_.time = state_.step * kStep;
    state_.robots[RobotIndex(0)].X_WBase.translation = {x, y, 0.0};
    state_.bodies[body_].translation = {x, y, 0.0};
    judge_->see(state_);
    state_.contacts = {};
  }
  void touch(LinkIndex a, LinkIndex b, const Vec3& position, const Vec3& normal) {
    Contact contact;
    contact.link_a = a;
    contact.link_b = b;
    contact.position = position;
    contact.normal = normal;
    state_.contacts.moving().push_back(contact);
  }
  template <class Body>
  void ask(int32_t kind, const Body& body, const std::string& channel = kRequestChannel) {
    applied_t applied{};
    applied.utime = state_.time;
    applied.channel = channel;
    applied.kind = kind;
    applied.data.resize(static_cast<size_t>(body.getEncodedSize()));
    applied.size = static_cast<int32_t>(applied.data.size());
    body.encode(applied.data.data(), 0, applied.size);
    judge_->see(applied);
  }
  void say_odometry(SimTime time, double x, double y, int32_t resets = 0,
                    const std::string& channel = "r/odometry") {
    odometry_t sample{};
    sample.utime = time;
    sample.x = x;
    sample.y = y;
    sample.resets = resets;
    std::vector<uint8_t> bytes(static_cast<size_t>(sample.getEncodedSize()));
    sample.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    judge_->see(channel, bytes);
  }
  Check check(const std::string& what) const {
    for (const Check& each : judge_->verdict().checks)
      if (each.what == what) return each;
    return {"", Outcome::not_judged, "there is no such check", {}};
  }
  Outcome outcome(const std::string& what) const { return check(what).outcome; }

  std::shared_ptr<const world::WorldModel> world_;
  std::unique_ptr<Judge> judge_;
  Snapshot state_;
  BodyIndex body_;
};

Expectations goal(double x, double y, double radius, double by_s) {
  Expectations expected;
  expected.goals = {{x, y, radius, by_s}};
  return expected;
}

TEST_F(JudgeTest, WithoutAStepNothingIsJudged) {
  Expectations expected;
  expected.no_contact = true;
  expected.clearance = 0.1;
  expected.odometry_error = 0.1;
  judge(expected);
  for (const char* what : {"run", "contact", "clearance", "odometry"})
    EXPECT_EQ(outcome(what), Outcome::not_judged) << what;
  see(0.0);  // the initial state does not count as a step
  for (const char* what : {"run", "contact", "clearance", "odometry"})
    EXPECT_EQ(outcome(what), Outcome::not_judged) << what;
  EXPECT_FALSE(judge_->verdict().passed());
  see(0.0);
  for (const char* what : {"run", "contact", "clearance"})
    EXPECT_EQ(outcome(what), Outcome::passed) << what;
  EXPECT_EQ(check("run").text, "1 steps");
}

TEST_F(JudgeTest, AGoalIsReachedOnItsCircleAndAtItsTime) {
  judge(goal(1.0, 0.0, 0.25, 0.01));
  see(0.0);
  see(0.749);
  EXPECT_EQ(outcome("goal 0"), Outcome::failed);
  see(0.75);  // at 0.01 s
  EXPECT_EQ(outcome("goal 0"), Outcome::passed);

  judge(goal(1.0, 0.0, 0.25, 0.01));
  for (const double x : {0.0, 0.0, 0.0, 1.0}) see(x);  // too late
  const Check late = check("goal 0");
  EXPECT_EQ(late.outcome, Outcome::failed);
  EXPECT_EQ(late.time, 10'000);
  EXPECT_THAT(late.text, testing::Not(HasSubstr("the run ended")));

  judge(goal(1.0, 0.0, 0.25, 9.0));
  see(0.0);
  see(0.0);
  EXPECT_THAT(check("goal 0").text, HasSubstr("the run ended at 0.005 s"));
}

TEST_F(JudgeTest, EachGoalCounts) {
  Expectations expected = goal(1.0, 0.0, 0.25, 1.0);
  expected.goals.push_back({2.0, 1.0, 0.25, 1.0});
  judge(expected);
  see(0.0);
  see(1.0);
  EXPECT_EQ(outcome("goal 0"), Outcome::passed);
  EXPECT_EQ(outcome("goal 1"), Outcome::failed);
  const auto names = [&] {
    std::vector<std::string> all;
    for (const Metric& metric : judge_->verdict().metrics) all.push_back(metric.name);
    return all;
  };
  EXPECT_THAT(names(), testing::Not(testing::Contains("goal_time_s")));
  see(2.0, 1.0);
  EXPECT_TRUE(judge_->verdict().passed());
  EXPECT_THAT(names(), testing::Contains("goal_time_s"));
  for (const Metric& metric : judge_->verdict().metrics) {
    if (metric.name == "goal_time_s") {
      EXPECT_DOUBLE_EQ(metric.value, 0.01);
    }
    if (metric.name == "goal_distance_m") {
      EXPECT_DOUBLE_EQ(metric.value, 0.0);
    }
    if (metric.name == "path_m") {
      EXPECT_DOUBLE_EQ(metric.value, 1.0 + std::sqrt(2.0));
    }
  }
}

TEST_F(JudgeTest, TheGroundBelowIsNotAContact) {
  Expectations expected;
  expected.no_contact = true;
  const LinkIndex own(0), other(1);
  judge(expected);
  see(0.0);
  touch(own, other, {0, 0, 0.019}, {0, 0, 1});      // from below
  touch(other, own, {0, 0, 0.0}, {0, 0, -1});       // the same, told the other way round
  touch(own, other, {0, 0, 0.0}, {0.7, 0, 0.714});  // of a slope
  touch(own, own, {0.5, 0, 0.5}, {1, 0, 0});
  touch(other, other, {5, 0, 0.5}, {1, 0, 0});
  touch(own, LinkIndex(), {0.5, 0, 0.5}, {1, 0, 0});
  see(0.0);
  EXPECT_EQ(outcome("contact"), Outcome::passed);
  touch(other, own, {0.5, 0, 0.5}, {1, 0, 0});
  see(0.0);
  const Check touched = check("contact");
  EXPECT_EQ(touched.outcome, Outcome::failed);
  EXPECT_EQ(touched.time, 2 * kStep);
  EXPECT_EQ(touched.text, "r/base_link touched box/link at (0.500, 0.000, 0.500)");
  see(0.0);  // once is enough
  EXPECT_EQ(outcome("contact"), Outcome::failed);
}

TEST_F(JudgeTest, TouchesFromAboveAndBesideAreContacts) {
  Expectations expected;
  expected.no_contact = true;
  for (const auto& [position, normal] :
       {std::pair(Vec3(0, 0, 0.03), Vec3(0, 0, 1)), std::pair(Vec3(0, 0, 1.1), Vec3(0, 0, -1)),
        std::pair(Vec3(0, 0, 0.0), Vec3(0.72, 0, 0.694))}) {
    judge(expected);
    see(0.0);
    touch(LinkIndex(0), LinkIndex(1), position, normal);
    see(0.0);
    EXPECT_EQ(outcome("contact"), Outcome::failed) << position.transpose();
  }
}

TEST_F(JudgeTest, ClearanceIsTheSmallestDistance) {
  Expectations expected;
  expected.clearance = 0.5;
  judge(expected);
  see(0.0);
  see(3.49);  // 0.51 m from the box
  EXPECT_EQ(outcome("clearance"), Outcome::passed);
  see(3.6);
  see(3.0);
  const Check check = this->check("clearance");
  EXPECT_EQ(check.outcome, Outcome::failed);
  EXPECT_EQ(check.time, 2 * kStep);
  EXPECT_THAT(check.text, HasSubstr("0.400 m from box/link"));
}

TEST_F(JudgeTest, ReportsADistanceWithTheDigitsThatFailIt) {
  Expectations expected;
  expected.clearance = 0.5;
  judge(expected);
  see(3.5001);
  EXPECT_THAT(check("clearance").text, HasSubstr("was 0.4999 m from box/link"));
}

// Also without any expectation: what falls touches nothing, and may pass over a goal.
TEST_F(JudgeTest, AFallingRobotFails) {
  judge({});
  RobotState& robot = state_.robots[RobotIndex(0)];
  robot.twist.linear = Vec3(0, 0, -4.9);
  see(0.0);
  EXPECT_EQ(check("fall").what, "") << "a step down";
  robot.twist.linear = Vec3(0, 0, -5.1);
  see(0.0);
  const Check check = this->check("fall");
  EXPECT_EQ(check.outcome, Outcome::failed);
  EXPECT_THAT(check.text, HasSubstr("r fell: at z = 0.00 m it went down at 5.1 m/s"));
}

TEST_F(JudgeTest, ModelsThatComeAndGoAreSeen) {
  Expectations expected;
  expected.clearance = 0.5;
  judge(expected);
  see(0.0);
  see(0.0);
  world_ = world_of(robot("r", "0 0 0 0 0 0") + box("box", "5 0 0.5 0 0 0", false) +
                    box("new", "0 1.2 0.5 0 0 0", false));
  judge_->see_world(world_, world::BodyLayout(*world_));
  EXPECT_EQ(outcome("clearance"), Outcome::passed);
  see(0.0);
  EXPECT_THAT(check("clearance").text, HasSubstr("0.200 m from new/link"));
}

TEST_F(JudgeTest, StepsWithoutTheRobotAreNotJudged) {
  Expectations expected;
  expected.no_contact = true;
  judge(expected);
  see(0.0);
  world_ = world_of(box("box", "5 0 0.5 0 0 0", false));
  judge_->see_world(world_, world::BodyLayout(*world_));
  for (int step = 1; step < 4; ++step) {
    Snapshot state;
    state.step = step;
    state.time = step * kStep;
    judge_->see(state);
  }
  EXPECT_EQ(check("run").text, "3 steps");
  EXPECT_EQ(outcome("contact"), Outcome::not_judged);
}

TEST_F(JudgeTest, ARobotThatARequestMovesHasFailed) {
  const auto asks = [](auto ask) {
    set_pose_request_t pose{};
    set_twist_request_t twist{};
    name_request_t name{};
    reset_request_t reset{};
    pose.orientation[0] = 1.0;
    pose.name = twist.name = name.name = "r";
    ask(request_t::SET_POSE, pose);
    ask(request_t::SET_TWIST, twist);
    ask(request_t::REMOVE, name);
    ask(request_t::RESET, reset);
  };
  asks([&](int32_t kind, const auto& body) {
    for (const bool allowed : {false, true}) {
      Expectations expected;
      expected.allow_requests = allowed;
      judge(expected);
      see(0.0);
      see(0.0);
      ask(kind, body);
      EXPECT_EQ(judge_->verdict().passed(), allowed) << kind;
      EXPECT_THAT(check("run").text, HasSubstr("1 requests changed the run")) << kind;
      if (!allowed) {
        EXPECT_THAT(check("requests").text, HasSubstr("r was moved by a request"));
      }
    }
  });
}

TEST_F(JudgeTest, ARobotThatAFaultCarriesAwayHasFailed) {
  for (const bool allowed : {false, true}) {
    for (const std::string kind : {"kidnapped", "freeze"}) {
      for (const std::string robot : {"r", "other"}) {
        Expectations expected;
        expected.allow_requests = allowed;
        judge(expected);
        see(0.0);
        see(0.0);
        fault_t fault{};
        fault.kind = kind;
        ask(0, fault, robot + "/fault");
        const bool moved = kind == "kidnapped" && robot == "r";
        EXPECT_EQ(judge_->verdict().passed(), allowed || !moved) << kind << robot;
        EXPECT_THAT(check("run").text, HasSubstr("fault " + kind + " of " + robot));
      }
    }
  }
}

TEST_F(JudgeTest, ReportsRequestsThatChangeTheRun) {
  judge({});
  see(0.0);
  see(0.0);
  name_request_t name{};
  name.name = "box";
  ask(request_t::REMOVE, name);
  name.name = "r";
  ask(request_t::RESET_ODOMETRY, name);
  spawn_request_t spawn{};
  spawn.name = "new";
  for (int i = 0; i < 4; ++i) ask(request_t::SPAWN, spawn);
  ask(request_t::PAUSE, name);  // changes nothing
  EXPECT_TRUE(judge_->verdict().passed());
  EXPECT_EQ(check("run").text,
            "1 steps (6 requests changed the run: REMOVE box, RESET_ODOMETRY r, SPAWN new, SPAWN "
            "new, SPAWN new, ...)");
}

TEST_F(JudgeTest, OdometryIsComparedAtItsStamp) {
  Expectations expected;
  expected.odometry_error = 0.1;
  judge(expected);
  for (int i = 0; i <= 100; ++i) see(0.01 * i);  // 2 m/s
  say_odometry(2500, 0.005, 0.0);                // between two states
  say_odometry(0, 0.1, 0.0);                     // just good enough
  say_odometry(500'000, 1.0, 0.0);
  say_odometry(600'000, 1.0, 0.0);  // after the last state
  say_odometry(-100, 0.0, 0.0);
  EXPECT_EQ(check("odometry").text, "odometry at most 0.100 m off in 5 samples");
  EXPECT_TRUE(judge_->verdict().passed());
  say_odometry(252'500, 0.6061, 0.0);  // 0.1011 m
  const Check check = this->check("odometry");
  EXPECT_EQ(check.outcome, Outcome::failed);
  EXPECT_EQ(check.time, 252'500);
  EXPECT_THAT(check.text, HasSubstr("r's odometry was 0.101 m off"));
}

TEST_F(JudgeTest, OdometryBeginsWhereTheRobotDoesAndAtItsResets) {
  Expectations expected;
  expected.odometry_error = 1e-9;
  judge(expected, robot("r", "3 1 0 0 0 1.5707963267948966"));
  const auto at = [&](double y, int32_t resets) {
    state_.robots[RobotIndex(0)].odometry_resets = resets;
    see(3.0, y);
  };
  at(1.0, 0);
  at(1.5, 0);
  say_odometry(5000, 0.5, 0.0);
  at(2.0, 0);
  at(2.5, 1);  // it was reset on the state before
  say_odometry(15'000, 0.5, 0.0, 1);
  at(3.5, 1);
  say_odometry(20'000, 1.5, 0.0, 1);
  EXPECT_EQ(outcome("odometry"), Outcome::passed) << check("odometry").text;
  say_odometry(20'000, 2.5, 0.0, 1);
  EXPECT_EQ(outcome("odometry"), Outcome::failed);
}

TEST_F(JudgeTest, OdometryThatIsNotFiniteOrOfAnotherFrameFails) {
  for (const auto& [x, resets] :
       {std::pair(std::nan(""), 0), std::pair(std::numeric_limits<double>::infinity(), 0),
        std::pair(0.0, 7)}) {
    Expectations expected;
    expected.odometry_error = 1e6;
    judge(expected);
    see(0.0);
    see(0.0);
    say_odometry(0, x, 0.0, resets);
    EXPECT_EQ(outcome("odometry"), Outcome::failed) << x << " " << resets;
  }
}

TEST_F(JudgeTest, OdometryOfOthersIsNotTheRobots) {
  Expectations expected;
  expected.odometry_error = 0.1;
  judge(expected);
  see(0.0);
  see(0.0);
  say_odometry(0, 0.0, 0.0, 0, "rr/odometry");
  say_odometry(0, 0.0, 0.0, 0, "r/odometry/twist");
  EXPECT_EQ(outcome("odometry"), Outcome::not_judged);
}

TEST_F(JudgeTest, OdometryAfterSimTimeWasReset) {
  Expectations expected;
  expected.odometry_error = 1e-9;
  expected.allow_requests = true;
  judge(expected);
  see(0.0);
  see(0.5);
  say_odometry(5000, 0.5, 0.0);
  begin();
  see(2.0);
  see(2.25);
  say_odometry(5000, 0.25, 0.0);
  EXPECT_EQ(outcome("odometry"), Outcome::passed) << check("odometry").text;
}

TEST_F(JudgeTest, JudgesTheRobotOfTheExpectation) {
  const std::string two = robot("a", "0 0 0 0 0 0") + robot("b", "3 0 0 0 0 0");
  Expectations expected = goal(3.0, 0.0, 0.1, 1.0);
  judge(expected, two);
  see(0.0);
  see(0.0);
  EXPECT_EQ(outcome("goal 0"), Outcome::failed);
  expected.robot = "b";
  judge(expected, two);
  see(0.0);
  see(0.0);
  EXPECT_EQ(outcome("goal 0"), Outcome::passed);
  expected.robot = "c";
  EXPECT_THROW(judge(expected, two), InputError);
  expected.robot = "";
  EXPECT_THROW(judge(expected, box("box", "0 0 0.5 0 0 0")), InputError);
}

TEST_F(JudgeTest, ReportsMetricsOfTheRun) {
  Expectations expected = goal(9.0, 0.0, 0.25, 1.0);
  expected.goals.push_back({1.0, 0.0, 0.25, 1.0});
  judge(expected);
  const auto metrics = [&] {
    std::map<std::string, double> all;
    for (const Metric& metric : judge_->verdict().metrics) all[metric.name] = metric.value;
    return all;
  };
  see(0.0);
  see(2.0);
  EXPECT_THAT(metrics(), testing::UnorderedElementsAre(
                             testing::Pair("time_s", 0.005), testing::Pair("x_m", 2.0),
                             testing::Pair("y_m", 0.0), testing::Pair("path_m", 2.0),
                             testing::Pair("goal_distance_m", 1.0)));  // of the last goal
  touch(LinkIndex(0), LinkIndex(1), {0.5, 0, 0.5}, {1, 0, 0});
  see(2.0);
  touch(LinkIndex(0), LinkIndex(1), {0.5, 0, 0.5}, {1, 0, 0});
  see(2.0);
  say_odometry(5000, 1.0, 0.0);
  EXPECT_DOUBLE_EQ(metrics().at("contact_time_s"), 0.01);  // of the first one
  EXPECT_DOUBLE_EQ(metrics().at("odometry_error_m"), 1.0);
  EXPECT_FALSE(metrics().contains("clearance_m"));
  EXPECT_EQ(check("contact").text, "there is no such check");  // it was not expected

  Expectations reach;
  reach.clearance_reach = 1.0;
  judge(reach);
  see(0.0);
  see(0.0);
  EXPECT_DOUBLE_EQ(metrics().at("clearance_m"), 1.0);  // nothing is as near
  see(3.5);
  EXPECT_NEAR(metrics().at("clearance_m"), 0.5, 1e-6);
}

TEST_F(JudgeTest, ReportsTheMeasuredClearance) {
  Expectations expected;
  expected.clearance = 0.25;
  judge(expected);
  see(0.0);
  see(0.0);
  EXPECT_EQ(check("clearance").text, "clearance of at least 0.250 m over 1 steps");
  expected.clearance_reach = 1.0;
  judge(expected);
  see(0.0);
  see(3.5);
  EXPECT_EQ(check("clearance").text, "clearance 0.500 m over 1 steps");
}

TEST_F(JudgeTest, TheTrackIsEveryQuarterOfASecond) {
  judge({});
  for (int i = 0; i <= 101; ++i) see(0.01 * i);
  const std::vector<Place> track = judge_->verdict().track;
  ASSERT_EQ(track.size(), 3);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_DOUBLE_EQ(track[i].time_s, 0.25 * static_cast<double>(i));
    EXPECT_DOUBLE_EQ(track[i].x, 0.5 * static_cast<double>(i));
  }
}

TEST_F(JudgeTest, ReportsEachKindOfFailure) {
  Expectations expected;
  expected.no_contact = true;
  expected.clearance = 0.5;
  judge(expected);
  see(0.0);
  touch(LinkIndex(0), LinkIndex(1), {0.5, 0, 0.5}, {1, 0, 0});
  see(3.6);
  EXPECT_EQ(outcome("contact"), Outcome::failed);
  EXPECT_EQ(outcome("clearance"), Outcome::failed);
}

TEST_F(JudgeTest, ACommandDoesNotCountAsARequest) {
  judge({});
  see(0.0);
  see(0.0);
  applied_t applied{};
  applied.channel = "r/velocity";
  applied.kind = request_t::RESET;
  judge_->see(applied);
  EXPECT_EQ(check("run").text, "1 steps");
}

TEST_F(JudgeTest, OdometryBeforeTheFirstStateIsOff) {
  Expectations expected;
  expected.odometry_error = 1e6;
  judge(expected);
  say_odometry(0, 0.0, 0.0);
  EXPECT_EQ(outcome("odometry"), Outcome::failed);
}

TEST(Goal, IsFourNumbers) {
  const Goal good = parse_goal("1,-2.5,0.2,60");
  EXPECT_EQ(good.x, 1.0);
  EXPECT_EQ(good.y, -2.5);
  EXPECT_EQ(good.radius, 0.2);
  EXPECT_EQ(good.by_s, 60.0);
  for (const char* bad : {"", "1", "1,2,3", "1,2,3,4,5", "1,2,3,4 ", "1,2,0,4", "1,2,-1,4",
                          "1,2,3,0", "1,2,3,-1", "a,2,3,4", "1,2,inf,4", "nan,2,3,4", "1,,3,4"})
    EXPECT_THROW(parse_goal(bad), InputError) << bad;
}

}  // namespace
}  // namespace ruedo::judge
