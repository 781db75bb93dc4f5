// Satellite navigation, magnetometer, altimeter, barometer and Pitot tube: values computed by hand,
// from published tables and from other programs; noise; errors and findings; many = single.
#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/air_pressure_t.hpp"
#include "ruedo/air_speed_t.hpp"
#include "ruedo/altimeter_t.hpp"
#include "ruedo/magnetometer_t.hpp"
#include "ruedo/navsat_t.hpp"
#include "sensors/geodesy.h"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;
using testing::HasSubstr;

constexpr double kDegree = M_PI / 180.0;

// A drone with one sensor, and a second of the same kind.
std::string world(const std::string& type, const std::string& inside = "",
                  const std::string& place = "", const std::string& pose = "0 0 0 0 0 0",
                  const std::string& model = "<pose>0 0 3 0 0 0</pose>") {
  std::string sensors;
  for (const char* name : {"ONE", "TWO"}) {
    sensors += "<sensor name='" + std::string(name) + "' type='" + type + "'><pose>" + pose +
               "</pose>" + inside + "</sensor>";
  }
  return "<sdf version='1.9'><world name='w'>" + place + "<model name='drone'>" + model +
         "<link name='base'>" + sensors + "</link></model></world></sdf>";
}

std::string place(double latitude, double longitude, double elevation, double heading = 0) {
  return "<spherical_coordinates><surface_model>EARTH_WGS84</surface_model>"
         "<world_frame_orientation>ENU</world_frame_orientation><latitude_deg>" +
         std::to_string(latitude) + "</latitude_deg><longitude_deg>" + std::to_string(longitude) +
         "</longitude_deg><elevation>" + std::to_string(elevation) + "</elevation><heading_deg>" +
         std::to_string(heading) + "</heading_deg></spherical_coordinates>";
}
const std::string kZurich = place(47.397742, 8.545594, 488);

template <class Message>
struct Bench {
  explicit Bench(const std::string& sdf, const char* name = "ONE",
                 SensorBench::Options options = {})
      : bench(sdf), device(bench.make("drone", name, options)), now(bench.snapshot()) {}
  Message sample(int64_t index = 0) {
    Outbox out;
    test::step(device, now, out, index);
    return Device::decode<Message>(out).at(0);
  }
  // Where the device's body is.
  Bench& at(const Vec3& p, const Vec3& rpy = Vec3::Zero()) {
    now.bodies.at(0) = Pose::from_xyz_rpy(p, rpy);
    return *this;
  }
  SensorBench bench;
  Device device;
  Snapshot now;
};

// The examples of GeographicLib's manual page CartConvert(1).
TEST(Geodesy, AgreesWithGeographicLib) {
  world::Environment origin;
  origin.latitude = 33 * kDegree;
  origin.longitude = 44 * kDegree;
  origin.elevation = 20;
  const Globe globe(origin);
  const Geodetic place{33.3 * kDegree, 44.4 * kDegree, 6000};
  const Vec3 p = globe.to_ecef(place);
  EXPECT_LT((p - Vec3(3816209.60, 3737108.55, 3485109.57)).norm(), 0.01);
  const Geodetic back = globe.geodetic({37288.97, 33374.29, 5783.65});
  EXPECT_NEAR(back.latitude, place.latitude, 1e-8 * kDegree * 100);
  EXPECT_NEAR(back.longitude, place.longitude, 1e-8 * kDegree * 100);
  EXPECT_NEAR(back.altitude, 6000, 0.01);
}

// There and back over all latitudes, from the deepest sea to a satellite's height.
TEST(Geodesy, BackFromEcefToRounding) {
  const Globe globe{world::Environment{}};
  for (int degree = -90; degree <= 90; degree += 5) {
    for (const double altitude : {-11e3, 0.0, 9e3, 1e6}) {
      const Geodetic place{degree * kDegree, 2.0, altitude};
      const Geodetic back = globe.from_ecef(globe.to_ecef(place));
      EXPECT_NEAR(back.latitude, place.latitude, 1e-15) << degree << " " << altitude;
      EXPECT_NEAR(back.altitude, altitude, 5e-9) << degree << " " << altitude;
      if (std::abs(degree) < 90) {
        EXPECT_NEAR(back.longitude, 2.0, 1e-13);
      }
    }
  }
}

// enu2geodetic() of pymap3d 3.2.0.
TEST(NavSat, AgreesWithPymap3d) {
  struct Case {
    std::string place;
    Vec3 p;
    double latitude, longitude, altitude;
  };
  for (const Case& c :
       {Case{kZurich, {1000, 2000, 10}, 47.41572887314254, 8.558844309697466, 498.39218800768487},
        Case{place(-33.9, 151.2, 20),
             {-30000, 50000, 2000},
             -33.44894357936504,
             150.87745359418517,
             2287.082952233781},
        Case{place(89.9, 10, 0),
             {100, -50, 3},
             89.89954835860169,
             10.510671479312814,
             3.0009766241860327},
        // x ahead to the north, y to the west: (-2000, 1000, 10) in east, north, up
        Case{place(47.397742, 8.545594, 488, 90),
             {1000, 2000, 10},
             47.40673276487159,
             8.519097892315651,
             498.3914634047863}}) {
    const navsat_t m = Bench<navsat_t>(world("navsat", "", c.place)).at(c.p).sample();
    EXPECT_NEAR(m.latitude_deg, c.latitude, 1e-11);
    EXPECT_NEAR(m.longitude_deg, c.longitude, 1e-11);
    EXPECT_NEAR(m.altitude, c.altitude, 1e-8);
  }
}

// Half a metre ahead of the body's origin, which looks to the north and turns left at 2 rad/s.
TEST(NavSat, VelocityIsThatOfTheDeviceToEastNorthAndUp) {
  Bench<navsat_t> bench(world("gps", "", place(47, 8, 0, 90), "0.5 0 0 0 0 0"));
  bench.at({0, 0, 0});
  bench.now.body_twists[0] = {{3, 0, 0.25}, {0, 0, 2}};
  const navsat_t m = bench.sample();
  EXPECT_NEAR(m.velocity[0], -1.0, 1e-6);
  EXPECT_NEAR(m.velocity[1], 3.0, 1e-6);
  EXPECT_NEAR(m.velocity[2], 0.25, 1e-6);
}

TEST(NavSat, NoiseIsInMetresAndIndependent) {
  const std::string noisy =
      "<navsat><position_sensing>"
      "<horizontal><noise type='gaussian'><stddev>2</stddev></noise></horizontal>"
      "<vertical><noise type='gaussian'><mean>1</mean><stddev>4</stddev></noise></vertical>"
      "</position_sensing><velocity_sensing>"
      "<horizontal><noise type='gaussian'><stddev>0.1</stddev></noise></horizontal>"
      "</velocity_sensing></navsat>";
  Bench<navsat_t> bench(world("navsat", noisy, kZurich)), ideal(world("navsat", "", kZurich));
  const navsat_t truth = ideal.sample();
  // Radii of curvature at 47.397742 N: in the meridian a (1 - e^2) / w^3, across a / w.
  const double s = std::sin(47.397742 * kDegree), e2 = 6.69437999014e-3, a = 6378137.0;
  const double w = std::sqrt(1 - e2 * s * s);
  const double north = kDegree * (a * (1 - e2) / (w * w * w) + 491),
               east = kDegree * (a / w + 491) * std::sqrt(1 - s * s);
  constexpr int kSamples = 10000;
  double sums[4] = {}, squares[4] = {}, cross = 0;
  for (int k = 0; k < kSamples; ++k) {
    const navsat_t m = bench.sample(k);
    const double z[4] = {(m.longitude_deg - truth.longitude_deg) * east / 2,
                         (m.latitude_deg - truth.latitude_deg) * north / 2,
                         (m.altitude - truth.altitude - 1) / 4, m.velocity[1] / 0.1};
    for (int i = 0; i < 4; ++i) sums[i] += z[i], squares[i] += z[i] * z[i];
    cross += z[0] * z[1];
    EXPECT_EQ(m.velocity[2], 0.0);
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT(std::abs(sums[i]), 3.29 * std::sqrt(kSamples)) << i;
    EXPECT_NEAR(squares[i] / kSamples, 1.0, 3.29 * std::sqrt(2.0 / kSamples)) << i;
  }
  EXPECT_LT(std::abs(cross), 3.29 * std::sqrt(kSamples));
  SensorBench::Options quiet;
  quiet.noise = false;
  EXPECT_EQ(Bench<navsat_t>(world("navsat", noisy, kZurich), "ONE", quiet).sample().latitude_deg,
            truth.latitude_deg);
}

// A bias of 3 m to the north-east of the horizontal, in steps of 0.5 m.
TEST(NavSat, BiasAndPrecisionAreThoseOfTheFormat) {
  const std::string biased =
      "<navsat><position_sensing><vertical><noise "
      "type='gaussian_quantized'><bias_mean>3</bias_mean>"
      "<precision>0.5</precision><stddev>0.01</stddev></noise></vertical></position_sensing>"
      "</navsat>";
  const navsat_t m = Bench<navsat_t>(world("navsat", biased, place(0, 0, 0))).sample();
  EXPECT_NEAR(m.altitude, 3.0 + 3.0, 1e-8);  // 3 m above the ground
}

TEST(NavSat, WithoutCoordinatesTheFindingGivesTheOrigin) {
  Bench<navsat_t> bench(world("navsat"));
  ASSERT_EQ(bench.bench.findings.list().size(), 1u);
  EXPECT_THAT(bench.bench.findings.list()[0].text, HasSubstr("no <spherical_coordinates>"));
  EXPECT_EQ(bench.at({0, 0, 0}).sample().latitude_deg, 0.0);
}

// The world's field, felt by a device that looks along the world's y.
TEST(Magnetometer, ShowsTheWorldsFieldInItsOwnFrame) {
  const std::string field = "<magnetic_field>1e-5 2e-5 -3e-5</magnetic_field>";
  Bench<magnetometer_t> bench(world("magnetometer", "", field, "0 0 0 0 0 1.5707963267948966"));
  const magnetometer_t m = bench.at({5, 6, 7}).sample();
  EXPECT_NEAR(m.field[0], 2e-5, 1e-19);
  EXPECT_NEAR(m.field[1], -1e-5, 1e-19);
  EXPECT_NEAR(m.field[2], -3e-5, 1e-19);
}

TEST(Magnetometer, WithoutAnythingItIsTheFormatsDefault) {
  const magnetometer_t m = Bench<magnetometer_t>(world("magnetometer")).sample();
  EXPECT_EQ(m.field[0], 5.5645e-6);
  EXPECT_EQ(m.field[1], 22.8758e-6);
  EXPECT_EQ(m.field[2], -42.3884e-6);
}

// The dipole g = (g11, h11, g10) by hand: at the pole 2 g10 upwards; where the equator meets
// Greenwich (-h11... as seen there) h11 turned: east -h11, north -g10, up 2 g11.
TEST(Magnetometer, OnEarthItIsADipole) {
  const double g10 = -29404.8e-9, g11 = -1450.9e-9, h11 = 4652.5e-9;
  const double at_equator = std::pow(6371200.0 / 6378137.0, 3),
               at_pole = std::pow(6371200.0 / 6356752.314245, 3);
  magnetometer_t m =
      Bench<magnetometer_t>(world("magnetometer", "", place(0, 0, 0))).at({0, 0, 0}).sample();
  EXPECT_NEAR(m.field[0], -h11 * at_equator, 1e-15);
  EXPECT_NEAR(m.field[1], -g10 * at_equator, 1e-15);
  EXPECT_NEAR(m.field[2], 2 * g11 * at_equator, 1e-15);
  m = Bench<magnetometer_t>(world("magnetometer", "", place(90, 0, 0))).at({0, 0, 0}).sample();
  EXPECT_NEAR(m.field[2], 2 * g10 * at_pole, 1e-15);
}

TEST(Magnetometer, EachAxisHasItsNoise) {
  const std::string noisy =
      "<magnetometer><x><noise type='gaussian'><stddev>1e-6</stddev></noise></x>"
      "<z><noise type='gaussian'><bias_mean>2e-6</bias_mean></noise></z></magnetometer>";
  Bench<magnetometer_t> bench(world("magnetometer", noisy));
  constexpr int kSamples = 10000;
  double sum = 0, squares = 0;
  for (int k = 0; k < kSamples; ++k) {
    const magnetometer_t m = bench.sample(k);
    const double z = (m.field[0] - 5.5645e-6) / 1e-6;
    sum += z, squares += z * z;
    EXPECT_EQ(m.field[1], 22.8758e-6);
    EXPECT_NEAR(m.field[2], -40.3884e-6, 1e-18);
  }
  EXPECT_LT(std::abs(sum), 3.29 * std::sqrt(kSamples));
  EXPECT_NEAR(squares / kSamples, 1.0, 3.29 * std::sqrt(2.0 / kSamples));
}

// Risen by 2 m, nose up by 30 degrees, climbing at 1 m/s and turning about y at -2 rad/s.
TEST(Altimeter, ShowsHeightAndClimbOfTheDevice) {
  Bench<altimeter_t> bench(world("altimeter", "", "", "0.5 0 0 0 0 0"));
  EXPECT_EQ(bench.sample().altitude, 0.0);
  bench.at({7, 8, 5}, {0, -M_PI / 6, 0});
  bench.now.body_twists[0] = {{0, 0, 1}, {0, -2, 0}};
  const altimeter_t m = bench.sample(1);
  EXPECT_NEAR(m.altitude, 2.0 + 0.5 * std::sin(M_PI / 6), 1e-15);
  EXPECT_NEAR(m.velocity, 1.0 + 2.0 * 0.5 * std::cos(M_PI / 6), 1e-15);
}

TEST(Altimeter, OnAStaticModelNothingChanges) {
  Bench<altimeter_t> bench(
      world("altimeter", "", "", "0 0 0 0 0 0", "<static>true</static><pose>0 0 3 0 0 0</pose>"));
  EXPECT_EQ(bench.sample().altitude, 0.0);
  EXPECT_EQ(bench.sample(1).velocity, 0.0);
}

// U.S. Standard Atmosphere, 1976, table I: geometric altitude, pressure, temperature, density.
TEST(Air, IsTheStandardAtmosphere) {
  struct Row {
    double altitude, pressure, temperature, density;
  };
  for (const Row& row :
       {Row{0, 101325, 288.150, 1.2250}, Row{1000, 89876, 281.651, 1.1117},
        Row{5000, 54048, 255.676, 0.73643}, Row{10000, 26500, 223.252, 0.41351},
        Row{15000, 12111, 216.650, 0.19476}, Row{-1000, 113930, 294.651, 1.3470}}) {
    const std::string height = "<pose>0 0 " + std::to_string(row.altitude) + " 0 0 0</pose>";
    const std::string still = "0 0 0 0 0 0";
    EXPECT_NEAR(
        Bench<air_pressure_t>(world("air_pressure", "", "", still, height)).sample().pressure,
        row.pressure, 1e-4 * row.pressure);
    Bench<air_speed_t> pitot(world("air_speed", "", "", still, height));
    pitot.now.body_twists[0].linear = {-10, 0, 0};
    EXPECT_NEAR(pitot.sample().temperature, row.temperature, 2e-3);
    EXPECT_NEAR(pitot.sample().differential_pressure, -50 * row.density, 2e-4 * 50 * row.density);
  }
}

// Sea level of that day, and the height of the place: 500 m of air of 10 degrees Celsius.
TEST(Air, IsThatOfTheWorld) {
  const std::string day =
      "<atmosphere type='adiabatic'><temperature>283.15</temperature><temperature_gradient>0"
      "</temperature_gradient><pressure>100000</pressure></atmosphere>";
  const double h = 6356766.0 * 500 / (6356766.0 + 500);
  const double expected = 1e5 * std::exp(-9.80665 * h / (287.05287 * 283.15));
  const auto pressure = [](const std::string& inside, const std::string& world_elements) {
    return Bench<air_pressure_t>(world("air_pressure", inside, world_elements))
        .at({0, 0, 100})
        .sample()
        .pressure;
  };
  EXPECT_NEAR(pressure("", day + place(47, 8, 400)), expected, 1e-9 * expected);
  EXPECT_NEAR(pressure("<air_pressure><reference_altitude>400</reference_altitude></air_pressure>",
                       day + place(47, 8, 0)),
              expected, 1e-9 * expected);
}

TEST(AirSpeed, MeasuresTheFlowAlongItsAxis) {
  Bench<air_speed_t> bench(world("air_speed", "", "", "0 0 0 0 0 1.5707963267948966"));
  bench.at({0, 0, 0});
  bench.now.body_twists[0].linear = {7, 20, 3};  // it looks along y
  EXPECT_NEAR(bench.sample().differential_pressure, 0.5 * 1.225 * 400, 1e-2);
  bench.now.wind = {0, 30, 0};  // it comes from behind
  EXPECT_NEAR(bench.sample().differential_pressure, -0.5 * 1.225 * 100, 1e-2);
}

TEST(Instruments, RefusedConfigurations) {
  struct Case {
    const char* type;
    const char* inside;
    const char* error;
  };
  for (const Case& c :
       {Case{"altimeter",
             "<altimeter><vertical_position><noise type='pink'/></vertical_position></altimeter>",
             "type 'pink' is not allowed"},
        Case{
            "navsat",
            "<navsat><position_sensing><vertical><noise type='gaussian'><stddev>-1</stddev></noise>"
            "</vertical></position_sensing></navsat>",
            "'-1' is not allowed; allowed is a number of at least 0"},
        Case{"magnetometer",
             "<magnetometer><y><noise type='gaussian'><mean>x</mean></noise></y></magnetometer>",
             "'x' is not a number"},
        Case{"air_pressure",
             "<air_pressure><reference_altitude>nan</reference_altitude></air_pressure>", "'nan'"},
        Case{"air_speed",
             "<air_speed><pressure><noise "
             "type='gaussian'><precision>-1</precision></noise></pressure></air_speed>",
             "'-1' is not allowed"},
        Case{"altimeter", "<ruedo:fase>1</ruedo:fase>", "<ruedo:fase> is not known in <sensor>"}}) {
    try {
      Bench<altimeter_t> bench(world(c.type, c.inside));
      ADD_FAILURE() << c.inside;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("bench.sdf:1: "));
      EXPECT_THAT(error.what(), HasSubstr(c.error));
    }
  }
}

TEST(Instruments, ReportElementsWithoutEffect) {
  for (const auto& [type, inside, named] :
       {std::tuple{"altimeter", "<altimeter><vertical_postion/></altimeter>",
                   "<vertical_postion> is not known and left out; did you mean "
                   "<vertical_position>?"},
        std::tuple{"magnetometer", "<magnetometer><w/></magnetometer>", "<w> is not supported"},
        std::tuple{"gps", "<gps><satellites>5</satellites></gps>", "<satellites> is not supported"},
        std::tuple{"air_pressure", "<air_pressure><drag/></air_pressure>",
                   "<drag> is not supported"}}) {
    SensorBench bench(world(type, inside, kZurich));
    bench.make("drone", "ONE");
    ASSERT_EQ(bench.findings.list().size(), 1u) << type;
    EXPECT_THAT(bench.findings.list()[0].text, HasSubstr(named));
    EXPECT_EQ(bench.findings.list()[0].source.line, 1);
  }
}

template <class Message>
std::vector<uint8_t> encoded(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// A device served among others publishes the same as alone.
TEST(Instruments, ManyEqualSingle) {
  const std::string noise =
      "<noise type='gaussian'><stddev>2</stddev><dynamic_bias_stddev>1"
      "</dynamic_bias_stddev></noise>";
  const std::string sdf = world("navsat",
                                "<navsat><position_sensing><horizontal>" + noise +
                                    "</horizontal></position_sensing></navsat>",
                                kZurich);
  Bench<navsat_t> alone(sdf);
  SensorBench both(sdf);
  Device first = both.make("drone", "ONE"), second = both.make("drone", "TWO");
  Snapshot now = both.snapshot();
  for (int k = 0; k < 20; ++k) {
    now.time = alone.now.time = 200'000 * k;
    Outbox out, other;
    test::step(second, now, other, k);
    test::step(first, now, out, k);
    EXPECT_EQ(encoded(Device::decode<navsat_t>(out).at(0)), encoded(alone.sample(k)));
    EXPECT_NE(encoded(Device::decode<navsat_t>(other).at(0)),
              encoded(Device::decode<navsat_t>(out).at(0)));
  }
}

}  // namespace
}  // namespace ruedo
