// A verdict, and its texts.
#include "engine/judge/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ruedo::judge {
namespace {

using testing::HasSubstr;

const Check kSteps{"run", Outcome::passed, "12 steps", {}};
const Check kClient{"client", Outcome::failed, "the client ended with exit code 1", {}};
const Check kLate{"contact", Outcome::failed, "touched <b>\nand more", 2'500'000};
const Check kEarly{"clearance", Outcome::failed, "too near", 1'000'000};
const Check kNot{"odometry", Outcome::not_judged, "there is no sample", {}};

TEST(Verdict, PassesOnEvidenceAlone) {
  EXPECT_FALSE(Verdict{}.passed());
  EXPECT_TRUE((Verdict{{kSteps}, {}, {}}.passed()));
  EXPECT_FALSE((Verdict{{kSteps, kEarly}, {}, {}}.passed()));
  EXPECT_FALSE((Verdict{{kSteps, kNot}, {}, {}}.passed()));
  EXPECT_EQ((Verdict{{kSteps, kNot, kSteps}, {}, {}}.evidence()), "12 steps; 12 steps");
}

TEST(Verdict, ListsFailuresInOrderOfTime) {
  const Verdict verdict{{kLate, kNot, kSteps, kEarly, kClient}, {}, {}};
  std::vector<std::string> lines;
  for (const Check& check : verdict.failures()) lines.push_back(to_line(check));
  EXPECT_THAT(lines, testing::ElementsAre("the client ended with exit code 1",
                                          "not judged: there is no sample", "1.000 s: too near",
                                          "2.500 s: touched <b>\nand more"));
}

TEST(Verdict, IsJson) {
  EXPECT_EQ(
      to_json({{kSteps}, {{"time_s", 0.5}}, {{0.25, 1.0, -1.0}}}),
      "{\"outcome\": \"passed\", \"evidence\": [{\"what\": \"run\", \"text\": \"12 steps\"}], "
      "\"failures\": [], \"faults\": [], \"metrics\": {\"time_s\": 0.5}, \"track\": "
      "[[0.25, 1, -1]]}\n");
  const std::string failed = to_json({{kSteps, kNot, kEarly}, {}, {}});
  EXPECT_THAT(failed, HasSubstr("\"outcome\": \"failed\""));
  EXPECT_THAT(failed, HasSubstr("{\"what\": \"odometry\", \"judged\": false, \"time_s\": null, "
                                "\"text\": \"there is no sample\"}"));
  EXPECT_THAT(failed, HasSubstr("{\"what\": \"clearance\", \"judged\": true, \"time_s\": 1, "
                                "\"text\": \"too near\"}"));
  EXPECT_THAT(failed, HasSubstr("\"evidence\": [{\"what\": \"run\", \"text\": \"12 steps\"}], "));
  EXPECT_THAT(failed, HasSubstr("\"faults\": [\"there is no sample\"]"));
  EXPECT_THAT(to_json({{kSteps, kNot}, {}, {}}), HasSubstr("\"outcome\": \"not judged\""));
  EXPECT_THAT(to_json({{}, {}, {}}), HasSubstr("\"outcome\": \"not judged\""));
}

TEST(Verdict, IsJunit) {
  EXPECT_EQ(
      to_junit({{kSteps, kLate, kNot}, {}, {}}, "a<b"),
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
      "<testsuite name=\"a&lt;b\" tests=\"3\" failures=\"2\">\n"
      "  <testcase classname=\"ruedo.regress\" name=\"run\">\n"
      "    <system-out>12 steps</system-out>\n"
      "  </testcase>\n"
      "  <testcase classname=\"ruedo.regress\" name=\"contact\">\n"
      "    <failure type=\"failed\" message=\"2.500 s: touched &lt;b&gt;\">2.500 s: touched "
      "&lt;b&gt;\nand more</failure>\n"
      "  </testcase>\n"
      "  <testcase classname=\"ruedo.regress\" name=\"odometry\">\n"
      "    <failure type=\"not judged\" message=\"not judged: there is no sample\">not judged: "
      "there is no sample</failure>\n"
      "  </testcase>\n"
      "</testsuite>\n");
}

}  // namespace
}  // namespace ruedo::judge
