// Typed reads: what is accepted, what is refused, and that errors name the place, the element, the
// value and what is allowed.
#include "ruedo/element.h"

#include <clocale>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ruedo {
namespace {

using testing::HasSubstr;

Element& add(Element& parent, const std::string& name, const std::string& text, int line) {
  auto child = std::make_unique<Element>();
  child->name = name;
  child->text = text;
  child->source = {"robot.sdf", line};
  parent.children.push_back(std::move(child));
  return *parent.children.back();
}

Element sensor(const std::string& value_text) {
  Element root;
  root.name = "sensor";
  root.source = {"robot.sdf", 1};
  Element& range = add(root, "range", "", 2);
  add(range, "max", value_text, 3);
  return root;
}

template <class Read>
std::string error_of(Read read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Element, ReadsNumbers) {
  struct Case {
    const char* text;
    double value;
  };
  for (const Case& c : {Case{"1.5", 1.5},
                        {" 2 ", 2},
                        {"-3e-2", -0.03},
                        {"+4", 4},
                        {".5", 0.5},
                        {"5.", 5},
                        {"1e8", 1e8},
                        {"1e-400", 0.0},
                        {"\n\t7\r\n", 7},
                        {"0.1", 0.1}}) {
    EXPECT_EQ(sensor(c.text).number("range/max", -1, Allowed::any(quantity::kRange)), c.value)
        << c.text;
  }
  EXPECT_EQ(sensor("1").number("range/min", 0.25, Allowed::any(quantity::kRange)), 0.25);
  EXPECT_EQ(sensor("1").number("scan/min", 0.25, Allowed::any(quantity::kRange)), 0.25);
}

TEST(Element, RejectsMalformedNumbers) {
  for (const char* text : {"", "abc", "1,5", "1.5m", "1 2", "0x10", "--1", "+-1", "nan", "inf",
                           "-inf", "1e999", "1.5.2", "NaN", "٣"}) {
    const std::string error =
        error_of([&] { sensor(text).number("range/max", -1, Allowed::any(quantity::kRange)); });
    EXPECT_THAT(error, HasSubstr("robot.sdf:3: <sensor/range/max>: '" + std::string(text) + "'"))
        << text;
  }
}

TEST(Element, RejectsNumbersThatAreTooLarge) {
  const auto read = [](const char* text, Allowed allowed) {
    return error_of([&] { sensor(text).number("range/max", 1, allowed); });
  };
  EXPECT_EQ(read("1e300", Allowed::positive(quantity::kMass)),
            "robot.sdf:3: <sensor/range/max>: '1e300' is too large for a mass; allowed is up to "
            "1000000000 kg");
  EXPECT_EQ(read("-1000000.1", Allowed::any(quantity::kLength)),
            "robot.sdf:3: <sensor/range/max>: '-1000000.1' is too large for a length; allowed is "
            "up to 1000000 m");
  EXPECT_EQ(read("1e7", Allowed::positive(quantity::kSpeed).or_infinite()),
            "robot.sdf:3: <sensor/range/max>: '1e7' is too large for a speed; allowed is up to "
            "1000000 m/s or rad/s, or inf");
  EXPECT_EQ(read("-1000000", Allowed::any(quantity::kLength)), "no error");
  EXPECT_THAT(error_of([] {
                sensor("0 0 1e7").vector3("range/max", Vec3::Zero(),
                                          Allowed::any(quantity::kLength));
              }),
              HasSubstr("'1e7' is too large for a length"));
  EXPECT_THAT(error_of([] { sensor("0 0 1e7 0 0 0").pose("range/max"); }),
              HasSubstr("'1e7' is too large for a length"));
  EXPECT_THAT(error_of([] { sensor("0 0 1 0 1e9 0").pose("range/max"); }),
              HasSubstr("'1e9' is too large for an angle"));
}

TEST(Element, ErrorsListTheAllowedValues) {
  EXPECT_EQ(
      error_of([] { sensor("0").number("range/max", 1, Allowed::positive(quantity::kRange)); }),
      "robot.sdf:3: <sensor/range/max>: '0' is not allowed; allowed is a number above 0");
  EXPECT_EQ(
      error_of(
          [] { sensor("-0.5").number("range/max", 1, Allowed::not_negative(quantity::kRange)); }),
      "robot.sdf:3: <sensor/range/max>: '-0.5' is not allowed; allowed is a number of at least 0");
  EXPECT_EQ(
      error_of([] { sensor("1.01").number("range/max", 1, Allowed::between(0, 1)); }),
      "robot.sdf:3: <sensor/range/max>: '1.01' is not allowed; allowed is a number from 0 to 1");
  EXPECT_EQ(error_of([] { sensor("far").number("range/max", 1, Allowed::any(quantity::kRange)); }),
            "robot.sdf:3: <sensor/range/max>: 'far' is not a number; allowed is a number");
  EXPECT_EQ(sensor("0").number("range/max", 1, Allowed::between(0, 1)), 0.0);
  EXPECT_EQ(sensor("1").number("range/max", 1, Allowed::between(0, 1)), 1.0);
}

TEST(Element, AcceptsInfinityOnlyWhereAllowed) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(sensor("inf").number("range/max", 1, Allowed::any(quantity::kRange).or_infinite()),
            infinity);
  EXPECT_EQ(sensor("-inf").number("range/max", 1, Allowed::any(quantity::kRange).or_infinite()),
            -infinity);
  EXPECT_EQ(sensor("INF").number("range/max", 1, Allowed::positive(quantity::kRange).or_infinite()),
            infinity);
  EXPECT_THAT(error_of([] {
                sensor("-inf").number("range/max", 1,
                                      Allowed::positive(quantity::kRange).or_infinite());
              }),
              HasSubstr("'-inf' is not allowed; allowed is a number above 0, or inf"));
  EXPECT_THAT(error_of([] {
                sensor("nan").number("range/max", 1, Allowed::any(quantity::kRange).or_infinite());
              }),
              HasSubstr("is not finite"));
  EXPECT_THAT(
      error_of([] { sensor("inf").number("range/max", 1, Allowed::any(quantity::kRange)); }),
      HasSubstr("'inf' is not finite"));
}

// "1.5" is one and a half even where the user's decimal mark is a comma.
TEST(Element, KnowsNoLocale) {
  const std::string before = std::setlocale(LC_ALL, nullptr);
  const bool found = std::setlocale(LC_ALL, "de_DE.UTF-8") || std::setlocale(LC_ALL, "fr_FR.UTF-8");
  EXPECT_EQ(sensor("1.5").number("range/max", 0, Allowed::any(quantity::kRange)), 1.5);
  EXPECT_THROW(sensor("1,5").number("range/max", 0, Allowed::any(quantity::kRange)), InputError);
  std::setlocale(LC_ALL, before.c_str());
  if (!found) std::printf("no German or French locale on this machine: tried in its own only\n");
}

TEST(Element, ReadsIntegers) {
  EXPECT_EQ(sensor("181").integer("range/max", 0, Allowed::between(-0x1p63, 0x1p63)), 181);
  EXPECT_EQ(sensor("640.0").integer("range/max", 0, Allowed::between(-0x1p63, 0x1p63)), 640);
  EXPECT_EQ(sensor("1e3").integer("range/max", 0, Allowed::between(-0x1p63, 0x1p63)), 1000);
  EXPECT_EQ(
      sensor("-9223372036854775808").integer("range/max", 0, Allowed::between(-0x1p63, 0x1p63)),
      std::numeric_limits<int64_t>::min());
  EXPECT_EQ(sensor("1").integer("range/min", 7, Allowed::between(-0x1p63, 0x1p63)), 7);
  for (const char* text :
       {"", "1.5", "abc", "1e30", "99999999999999999999", "inf", "nan", "0x1F", "3 rays"}) {
    EXPECT_THROW(sensor(text).integer("range/max", 0, Allowed::between(-0x1p63, 0x1p63)),
                 InputError)
        << text;
  }
  EXPECT_EQ(error_of([] { sensor("0").integer("range/max", 0, Allowed::between(1, 10)); }),
            "robot.sdf:3: <sensor/range/max>: '0' is not allowed; allowed is a whole number from 1 "
            "to 10");
}

TEST(Element, ReadsBooleans) {
  for (const char* text : {"true", "1", "True", " TRUE "})
    EXPECT_TRUE(sensor(text).boolean("range/max", false)) << text;
  for (const char* text : {"false", "0", "False"})
    EXPECT_FALSE(sensor(text).boolean("range/max", true)) << text;
  for (const char* text : {"", "yes", "2", "on"})
    EXPECT_THROW(sensor(text).boolean("range/max", true), InputError) << text;
}

TEST(Element, ReadsVectorsAndRates) {
  EXPECT_EQ(sensor("1  2\n3").vector3("range/max", Vec3::Zero(), Allowed::any(quantity::kLength)),
            Vec3(1, 2, 3));
  for (const char* text : {"", "1 2", "1 2 3 4", "1 2 x", "1,2,3", "1 2 inf"}) {
    EXPECT_THROW(sensor(text).vector3("range/max", Vec3::Zero(), Allowed::any(quantity::kLength)),
                 InputError)
        << text;
  }
  EXPECT_EQ(sensor("29.97").rate("range/max", {1, 1}), (Rate{2997, 100}));
  EXPECT_THAT(error_of([] { sensor("-5").rate("range/max", {1, 1}); }),
              HasSubstr("robot.sdf:3: <sensor/range/max>: '-5' is not a rate"));
}

TEST(Element, ReadsPoses) {
  Element root;
  root.name = "link";
  EXPECT_EQ(root.pose("pose", {Quat::Identity(), {1, 2, 3}}).translation, Vec3(1, 2, 3));
  Element& pose = add(root, "pose", "1 2 3 0 0 90", 5);
  pose.attributes = {{"degrees", "true"}};
  Pose X = root.pose("pose");
  EXPECT_EQ(X.translation, Vec3(1, 2, 3));
  EXPECT_TRUE((X.rotation * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-15));
  // Roll about x, then pitch about y, then yaw about z, all fixed: (0,0,1) goes to -y, stays, goes
  // to x.
  pose.text = "0 0 0 1.5707963267948966 0 1.5707963267948966";
  pose.attributes.clear();
  EXPECT_TRUE((root.pose("pose").rotation * Vec3::UnitZ()).isApprox(Vec3::UnitX(), 1e-15));
  // Half a turn about z, and not of length 1.
  pose.text = "4 5 6 0 0 2 0";
  pose.attributes = {{"rotation_format", "quat_xyzw"}};
  X = root.pose("pose");
  EXPECT_EQ(X.translation, Vec3(4, 5, 6));
  EXPECT_EQ(X.rotation.coeffs(), Quat(0, 0, 0, 1).coeffs());
  pose.text = "";
  EXPECT_EQ(root.pose("pose").translation, Vec3::Zero());
}

TEST(Element, RejectsMalformedPoses) {
  struct Case {
    const char* text;
    std::vector<std::pair<std::string, std::string>> attributes;
    const char* error;
  };
  const Case cases[] = {
      {"1 2 3", {}, "has 3 numbers"},
      {"1 2 3 0 0 0 0", {}, "has 7 numbers"},
      {"1 2 3 0 0 x", {}, "'x' is not a number"},
      {"1 2 3 0 0 nan", {}, "'nan' is not finite"},
      {"1 2 3 0 0 0", {{"degrees", "yes"}}, "'yes' is not allowed for degrees"},
      {"1 2 3 0 0 0", {{"rotation_format", "matrix"}}, "allowed are euler_rpy and quat_xyzw"},
      {"1 2 3 0 0 0", {{"rotation_format", "quat_xyzw"}}, "has 6 numbers"},
      {"1 2 3 0 0 0 0", {{"rotation_format", "quat_xyzw"}}, "its quaternion is zero"},
      {"1 2 3 0 0 0 1", {{"rotation_format", "quat_xyzw"}, {"degrees", "true"}}, "no degrees"},
  };
  for (const Case& c : cases) {
    Element root;
    root.name = "link";
    add(root, "pose", c.text, 9).attributes = c.attributes;
    const std::string error = error_of([&] { root.pose("pose"); });
    EXPECT_THAT(error, HasSubstr("robot.sdf:9: <link/pose>: ")) << c.text;
    EXPECT_THAT(error, HasSubstr(c.error)) << c.text;
  }
}

TEST(Element, ChoicesAndUnknownElements) {
  EXPECT_EQ(sensor("arc").choice("range/max", "x", {"arc", "trapezoid"}), "arc");
  EXPECT_EQ(sensor("arc").choice("range/min", "x", {"arc", "trapezoid"}), "x");
  EXPECT_EQ(error_of([] { sensor("ark").choice("range/max", "x", {"arc", "trapezoid"}); }),
            "robot.sdf:3: <sensor/range/max>: 'ark' is not allowed; allowed: arc, trapezoid");
  Element root = sensor("1");
  add(root, "ruedo:rat", "5", 12);
  EXPECT_EQ(error_of([&] { root.refuse_unknown({"ruedo:rate", "ruedo:integrator"}); }),
            "robot.sdf:12: <ruedo:rat> is not known in <sensor>; did you mean <ruedo:rate>?");
  EXPECT_EQ(error_of([&] { root.refuse_unknown({"ruedo:integrator"}); }),
            "robot.sdf:12: <ruedo:rat> is not known in <sensor>; known: <ruedo:integrator>");
  EXPECT_NO_THROW(root.refuse_unknown({"ruedo:rat"}));
  EXPECT_THAT(error_of([&] { root.refuse_unknown({"ruedo:rat"}, false); }),
              HasSubstr("robot.sdf:2: <range> is not known"));
}

TEST(Element, LongAndStrangeValuesDoNotSpoilTheMessage) {
  const std::string error = error_of([] {
    sensor(std::string(100000, 'x') + "\n\x1b[31m")
        .number("range/max", 0, Allowed::any(quantity::kRange));
  });
  EXPECT_LT(error.size(), 200u);
  EXPECT_THAT(error_of([] {
                sensor("a\x1b[31m\nb").number("range/max", 0, Allowed::any(quantity::kRange));
              }),
              HasSubstr("'a [31m b'"));
}

TEST(Element, CloneIsDeep) {
  Element root = sensor("1");
  root.attributes = {{"type", "ray"}};
  const auto copy = root.clone();
  root.child("range/max")->text = "2";
  EXPECT_EQ(copy->number("range/max", 0, Allowed::any(quantity::kRange)), 1.0);
  EXPECT_EQ(*copy->attribute("type"), "ray");
  EXPECT_EQ(copy->attribute("name"), nullptr);
  EXPECT_EQ(copy->child("range/max")->source.line, 3);
  EXPECT_EQ(root.all("range").size(), 1u);
}

TEST(NearestWord, FindsTypingMistakesOnly) {
  const std::vector<std::string> known{"ruedo:rate", "ruedo:integrator", "ruedo:track_error",
                                       "lidar"};
  EXPECT_EQ(nearest_word("ruedo:Rate", known), "ruedo:rate");
  EXPECT_EQ(nearest_word("ruedo:intergator", known), "ruedo:integrator");
  EXPECT_EQ(nearest_word("lidra", known), "lidar");
  EXPECT_EQ(nearest_word("ruedo:colour", known), "");
  EXPECT_EQ(nearest_word("", known), "");
  EXPECT_EQ(nearest_word(std::string(100000, 'a'), known), "");
}

TEST(Findings, KeepsTheSameTextOnceForEachPlace) {
  Findings findings;
  for (int i = 0; i < 3; ++i) {
    findings.unsupported({"a.sdf", 4}, "world/physics", "no such engine");
    findings.unsupported({"a.sdf", 5}, "world/physics", "no such engine");
    findings.repaired({"a.sdf", 4}, "world/physics", "no such engine");
  }
  ASSERT_EQ(findings.list().size(), 3u);
  EXPECT_EQ(findings.list()[1].source.line, 5);
  EXPECT_EQ(findings.list()[2].kind, Finding::Kind::repaired);
}

}  // namespace
}  // namespace ruedo
