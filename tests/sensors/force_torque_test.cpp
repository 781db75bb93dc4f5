// Force-torque sensors against statics and dynamics by hand.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/force_torque_t.hpp"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;
using testing::HasSubstr;

constexpr double kG = 9.8;  // m/s^2, SDF's default

std::string link(const std::string& name, double mass, const std::string& pose,
                 const std::string& centre = "0 0 0 0 0 0") {
  return "<link name='" + name + "'><pose>" + pose + "</pose><inertial><pose>" + centre +
         "</pose><mass>" + std::to_string(mass) +
         "</mass><inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.3</izz></inertia></inertial></link>";
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& inside) {
  return "<joint name='" + name + "' type='" + type + "'><parent>" + parent + "</parent><child>" +
         child + "</child>" + (type == "fixed" ? "" : "<axis><xyz>0 1 0</xyz></axis>") + inside +
         "</joint>";
}

std::string sensor(const std::string& inside) {
  return "<sensor name='FT' type='force_torque'><force_torque>" + inside +
         "</force_torque></sensor>";
}

// A mast on the world that carries an arm of 2 kg, whose middle is 0.5 m ahead of the joint, and at
// its end, 1 m ahead, a hand of 1 kg. The sensor stands between mast and arm.
std::string rig(const std::string& inside, const std::string& type = "revolute",
                const std::string& hand_type = "fixed") {
  return "<sdf version='1.9'><world name='w'><model name='rig'>" + link("mast", 5, "0 0 1 0 0 0") +
         link("arm", 2, "0 0 1 0 0 0", "0.5 0 0 0 0 0") + link("hand", 1, "1 0 1 0 0 0") +
         joint("base", "fixed", "world", "mast", "") +
         joint("shoulder", type, "mast", "arm", sensor(inside)) +
         joint("wrist", hand_type, "arm", "hand", "") + "</model></world></sdf>";
}

struct Bench {
  explicit Bench(const std::string& sdf, SensorBench::Options options = {})
      : bench(sdf), device(bench.make("rig", "FT", options)), now(bench.snapshot()) {}
  std::vector<force_torque_t> samples(int64_t index = 0) {
    Outbox out;
    test::step(device, now, out, index);
    return Device::decode<force_torque_t>(out);
  }
  // For a link, by its position in the model.
  size_t body(size_t link) const { return static_cast<size_t>(bench.layout.links.at(link).body); }
  SensorBench bench;
  Device device;
  Snapshot now;
};

void expect(const force_torque_t& m, const Vec3& force, const Vec3& torque) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(m.force[i], force[i], 1e-12) << "force " << i;
    EXPECT_NEAR(m.torque[i], torque[i], 1e-12) << "torque " << i;
  }
}

// The child hangs 3 kg on its parent: 3 g down, and about the shoulder 2 g 0.5 + 1 g 1 about y,
// nose down.
TEST(ForceTorque, AtRestItMeasuresTheHangingWeight) {
  for (const char* type : {"revolute", "fixed"}) {
    for (const char* hand : {"fixed", "revolute"}) {
      Bench bench(rig("", type, hand));
      expect(bench.samples().at(0), {0, 0, -3 * kG}, {0, 2 * kG, 0});
    }
  }
  expect(Bench(rig("<measure_direction>parent_to_child</measure_direction>")).samples().at(0),
         {0, 0, 3 * kG}, {0, -2 * kG, 0});
}

// The arm raised by 90 degrees: in its own axes the weight is along -x; in the mast's along -z.
TEST(ForceTorque, FramesAreThoseOfTheFormat) {
  const auto raised = [](const std::string& inside) {
    Bench bench(rig(inside));
    bench.now.bodies[bench.body(1)] = Pose::from_xyz_rpy({0, 0, 1}, {0, -M_PI / 2, 0});
    return bench.samples().at(0);
  };
  expect(raised(""), {-3 * kG, 0, 0}, {0, 0, 0});
  expect(raised("<frame>parent</frame>"), {0, 0, -3 * kG}, {0, 0, 0});
  const std::string turned = rig("<frame>sensor</frame>");
  const size_t at = turned.find("<force_torque>");
  Bench bench(turned.substr(0, at) + "<pose>0 0 0 0 0 1.5707963267948966</pose>" +
              turned.substr(at));
  expect(bench.samples().at(0), {0, 0, -3 * kG}, {2 * kG, 0, 0});
}

// Turning about the vertical at 2 rad/s: m omega^2 r of each outwards.
TEST(ForceTorque, CentrifugalForceOfATurningArm) {
  std::string sdf = rig("");
  const std::string axis = "<xyz>0 1 0</xyz>";
  sdf.replace(sdf.find(axis), axis.size(), "<xyz>0 0 1</xyz>");
  Bench bench(sdf);
  bench.now.body_twists[bench.body(1)].angular = {0, 0, 2};
  expect(bench.samples().at(0), {4 * (2 * 0.5 + 1 * 1), 0, -3 * kG}, {0, 2 * kG, 0});
}

// 1 rad/s^2 about y on top of the weight: the moments of inertia about the shoulder are
// 0.2 + 2 0.5^2 and 0.2 + 1 1^2.
TEST(ForceTorque, AnArmThatBeginsToTurn) {
  Bench bench(rig(""));
  bench.samples();
  ++bench.now.step;
  bench.now.time = 5000;
  bench.now.body_twists[bench.body(1)].angular = {0, 1e-9, 0};  // so slow that omega^2 is nothing
  const force_torque_t m = bench.samples(1).at(0);
  const double alpha = 1e-9 / 5e-3;
  EXPECT_NEAR(m.torque[1], 2 * kG - (0.4 + 0.5 + 1.0) * alpha, 1e-12);
  EXPECT_NEAR(m.force[2], -3 * kG + (2 * 0.5 + 1) * alpha, 1e-12);
}

// The hand lies on a table that supports 4 N of it and rubs it with 1 N to the left.
TEST(ForceTorque, ContactsTakeTheirPart) {
  Bench bench(rig(""));
  Contact contact;
  contact.link_a = LinkIndex(2);
  contact.body_a = BodyIndex(bench.body(2));
  contact.position = {1, 0, 1};
  contact.normal = {0, 0, 1};
  contact.force = 4;
  contact.friction = {0, 1, 0};
  bench.now.contacts = {contact};
  expect(bench.samples().at(0), {0, 1, -3 * kG + 4}, {0, 2 * kG - 4, 1});
  std::swap(bench.now.contacts.moving()[0].link_a, bench.now.contacts.moving()[0].link_b);
  bench.now.contacts.moving()[0].normal = {0, 0, -1};
  bench.now.contacts.moving()[0].friction = {0, -1, 0};
  expect(bench.samples(1).at(0), {0, 1, -3 * kG + 4}, {0, 2 * kG - 4, 1});
}

// The child is the side that is held: a ceiling's arm upside down, its parent hangs free.
TEST(ForceTorque, WeighsTheSideThatIsFree) {
  Bench bench("<sdf version='1.9'><world name='w'><model name='rig'>" +
              link("load", 2, "0.5 0 0 0 0 0") + link("hook", 1, "0 0 1 0 0 0") +
              joint("hang", "fixed", "load", "hook", sensor("")) +
              joint("ceiling", "revolute", "world", "hook", "") + "</model></world></sdf>");
  // The load pulls the hook down by 2 g, so the child puts 2 g upwards on its parent; about the
  // hook with the arm (0.5, 0, -1).
  expect(bench.samples().at(0), {0, 0, 2 * kG}, {0, -kG, 0});
}

TEST(ForceTorque, WarnsAboutLoopsAndTwoHeldSides) {
  const std::string two = "<sdf version='1.9'><world name='w'><model name='rig'>" +
                          link("a", 1, "0 0 0 0 0 0") + link("b", 1, "0 0 1 0 0 0");
  Bench held(two + joint("j", "fixed", "a", "b", sensor("")) +
             joint("k", "revolute", "world", "a", "") + joint("l", "fixed", "world", "b", "") +
             "</model></world></sdf>");
  EXPECT_TRUE(held.samples().empty());
  EXPECT_THAT(held.bench.findings.list().at(0).text, HasSubstr("both sides"));
  Bench loop(two + link("c", 1, "0 1 0 0 0 0") + joint("j", "revolute", "a", "b", sensor("")) +
             joint("k", "revolute", "b", "c", "") + joint("l", "revolute", "a", "c", "") +
             "</model></world></sdf>");
  EXPECT_TRUE(loop.samples().empty());
  EXPECT_THAT(loop.bench.findings.list().at(0).text, HasSubstr("loop"));
}

TEST(ForceTorque, NoiseIsOfEachAxis) {
  const std::string noisy =
      "<force><x><noise type='gaussian'><stddev>0.5</stddev></noise></x></force>"
      "<torque><z><noise type='gaussian'><mean>2</mean></noise></z></torque>";
  Bench bench(rig(noisy));
  constexpr int kSamples = 5000;
  double sum = 0, squares = 0;
  for (int k = 0; k < kSamples; ++k) {
    const force_torque_t m = bench.samples(k).at(0);
    sum += m.force[0] / 0.5, squares += m.force[0] * m.force[0] / 0.25;
    EXPECT_NEAR(m.torque[2], 2, 1e-12);
    EXPECT_NEAR(m.force[2], -3 * kG, 1e-12);
  }
  EXPECT_LT(std::abs(sum), 3.29 * std::sqrt(kSamples));
  EXPECT_NEAR(squares / kSamples, 1.0, 3.29 * std::sqrt(2.0 / kSamples));
}

TEST(ForceTorque, RefusedConfigurations) {
  struct Case {
    const char* inside;
    const char* error;
  };
  for (const Case& c : {Case{"<frame>world</frame>", "'world' is not allowed"},
                        Case{"<measure_direction>up</measure_direction>", "'up' is not allowed"}}) {
    try {
      Bench bench(rig(c.inside));
      ADD_FAILURE() << c.inside;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("bench.sdf:1: "));
      EXPECT_THAT(error.what(), HasSubstr(c.error));
    }
  }
}

}  // namespace
}  // namespace ruedo
