// Plugins of gazebo_plugins, hector_gazebo_plugins and gz-sim that make a sensor without a
// <sensor>.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "text_world.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const Allowed kAny = Allowed::any(quantity::kRange);

// A model of two links and a joint with that plugin.
std::shared_ptr<const WorldModel> with(const std::string& library, const std::string& inside,
                                       const std::string& name = "device") {
  return world_of(
      "<model name='m'><link name='a'/><link name='b'><pose>0 0 1 0 0 0</pose></link>"
      "<joint name='j' type='revolute'><parent>a</parent><child>b</child><axis/></joint>"
      "<plugin name='" +
      name + "' filename='" + library + "'>" + inside + "</plugin></model>");
}

const SensorDescription& only(const WorldModel& world) {
  EXPECT_THAT(texts(world), IsEmpty());
  return world.models.at(0).model->sensors.at(0);
}

// hector's: 0.5 m of white noise, drift of 2 m with 0.01 Hz: sigma = 2 sqrt(2 0.01), tau = 100 s.
TEST(SensorPlugins, HectorsGps) {
  const auto world = with("libhector_gazebo_ros_gps.so",
                          "<updateRate>4</updateRate><bodyName>b</bodyName>"
                          "<referenceLatitude>47.5</referenceLatitude><referenceLongitude>8.5"
                          "</referenceLongitude><referenceAltitude>400</referenceAltitude>"
                          "<referenceHeading>30</referenceHeading>"
                          "<offset>0 0 3</offset><drift>2 2 2</drift><driftFrequency>0.01"
                          "</driftFrequency><gaussianNoise>0.5 0.5 0.75</gaussianNoise>"
                          "<velocityGaussianNoise>0.125</velocityGaussianNoise>");
  const SensorDescription& gps = only(*world);
  EXPECT_EQ(gps.type, "navsat");
  EXPECT_EQ(gps.name, "device");
  EXPECT_EQ(world->models[0].model->links[gps.link].name, "b");
  const auto number = [&](const char* path) { return gps.element->number(path, -1, kAny); };
  EXPECT_EQ(number("update_rate"), 4);
  EXPECT_EQ(number("navsat/position_sensing/horizontal/noise/stddev"), 0.5);
  EXPECT_EQ(number("navsat/position_sensing/vertical/noise/stddev"), 0.75);
  EXPECT_EQ(number("navsat/position_sensing/vertical/noise/bias_mean"), 3);
  EXPECT_NEAR(number("navsat/position_sensing/horizontal/noise/dynamic_bias_stddev"),
              2 * std::sqrt(0.02), 1e-15);
  EXPECT_EQ(number("navsat/position_sensing/horizontal/noise/dynamic_bias_correlation_time"), 100);
  EXPECT_EQ(number("navsat/velocity_sensing/vertical/noise/stddev"), 0.125);
  EXPECT_EQ(number("ruedo:place/ruedo:latitude_deg"), 47.5);
  EXPECT_EQ(number("ruedo:place/ruedo:longitude_deg"), 8.5);
  EXPECT_EQ(number("ruedo:place/ruedo:elevation"), 400);
  EXPECT_EQ(number("ruedo:place/ruedo:heading_deg"), 60);  // x to 30 degrees east of north
}

TEST(SensorPlugins, HectorsImuDrifts) {
  const auto world = with("libhector_gazebo_ros_imu.so",
                          "<accelOffset>0.1 0.2 0.3</accelOffset><rateDrift>0.5</rateDrift>"
                          "<rateDriftFrequency>0.02</rateDriftFrequency><gaussianNoise>0.25"
                          "</gaussianNoise><rpyOffset>0 0 1.5</rpyOffset>");
  const SensorDescription& imu = only(*world);
  const auto number = [&](const char* path) { return imu.element->number(path, -1, kAny); };
  EXPECT_EQ(number("imu/linear_acceleration/y/noise/bias_mean"), 0.2);
  EXPECT_EQ(number("imu/linear_acceleration/y/noise/stddev"), 0.25);
  EXPECT_EQ(number("imu/angular_velocity/z/noise/stddev"), 0.25);
  EXPECT_NEAR(number("imu/angular_velocity/z/noise/dynamic_bias_stddev"), 0.5 * 0.2, 1e-15);
  EXPECT_NEAR(heading(imu.X_LS.rotation), 1.5, 1e-15);
}

TEST(SensorPlugins, HectorsMagnetometerAndBarometer) {
  const auto magnetic =
      with("libhector_gazebo_ros_magnetic.so",
           "<magnitude>2</magnitude><inclination>60</inclination><referenceHeading>90"
           "</referenceHeading>");
  const Vec3 field = only(*magnetic).element->vector3("ruedo:magnetic_field", Vec3::Zero(), kAny);
  EXPECT_LT((field - Vec3(0, 1, -std::sqrt(3.0))).norm(), 1e-15);
  const auto baro = with("libhector_gazebo_ros_baro.so",
                         "<elevation>500</elevation><gaussianNoise>0.5"
                         "</gaussianNoise>");
  const SensorDescription& pressure = only(*baro);
  EXPECT_EQ(pressure.type, "air_pressure");
  EXPECT_EQ(pressure.element->number("air_pressure/reference_altitude", 0, kAny), 500);
  EXPECT_NEAR(pressure.element->number("air_pressure/pressure/noise/stddev", 0, kAny), 6.0065,
              1e-12);
}

TEST(SensorPlugins, Poses) {
  const auto p3d = with("libgazebo_ros_p3d.so",
                        "<body_name>b</body_name><frame_name>map</frame_name><update_rate>30"
                        "</update_rate><xyz_offsets>1 2 3</xyz_offsets><gaussian_noise>0.01"
                        "</gaussian_noise>");
  const SensorDescription& pose = only(*p3d);
  EXPECT_EQ(pose.type, "ruedo:pose");
  EXPECT_EQ(pose.X_LS.translation, Vec3(1, 2, 3));
  EXPECT_EQ(pose.element->number("ruedo:pose/ruedo:turn_rate/noise/stddev", 0, kAny), 0.01);
  const auto odometry = with("gz-sim-odometry-publisher-system", "<dimensions>2</dimensions>",
                             "gz::sim::systems::OdometryPublisher");
  EXPECT_EQ(only(*odometry).name, "odometry_publisher");
  EXPECT_EQ(only(*odometry).element->integer("ruedo:pose/ruedo:dimensions", 3, kAny), 2);
}

TEST(SensorPlugins, AForceTorqueSensorIsInItsJoint) {
  const auto world =
      with("libgazebo_ros_ft_sensor.so", "<jointName>j</jointName><updateRate>50</updateRate>");
  const SensorDescription& sensor = only(*world);
  EXPECT_EQ(sensor.joint, 0);
  EXPECT_EQ(sensor.link, 1);
  EXPECT_THAT(texts(*with("libgazebo_ros_ft_sensor.so", "<jointName>k</jointName>")),
              ElementsAre(HasSubstr("'k' is not a joint")));
}

TEST(SensorPlugins, ReportsErrorsAndElementsWithoutEffect) {
  struct Case {
    const char* library;
    const char* inside;
    const char* text;
  };
  for (const Case& c :
       {Case{"libhector_gazebo_ros_imu.so", "<rateScaleError>0.1</rateScaleError>",
             "<rateScaleError> of the plugin hector_gazebo_ros_imu is not supported"},
        Case{"libhector_gazebo_ros_baro.so", "<qnh>1000</qnh>", "<qnh> of the plugin"},
        Case{"libgazebo_ros_p3d.so", "<frameName>other_link</frameName>",
             "'other_link' is not supported: the pose is relative to the world"},
        Case{"libgazebo_ros_p3d.so", "<bodyName>nowhere</bodyName>", "the sensor is left out"},
        Case{"libhector_gazebo_ros_gps.so", "<referenceLatitude>95</referenceLatitude>",
             "'95' is not allowed"},
        Case{"libhector_gazebo_ros_gps.so", "<gaussianNoise>1 2</gaussianNoise>",
             "allowed are one number or three"},
        Case{"gz-sim-odometry-publisher-system", "<dimensions>4</dimensions>",
             "'4' is not allowed"}})
    EXPECT_THAT(texts(*with(c.library, c.inside)), ElementsAre(HasSubstr(c.text))) << c.inside;
}

// A sensor in a joint has the joint's frame; in URDF it is written in <gazebo>.
TEST(JointSensors, AreRead) {
  const auto world = world_of(
      "<model name='m'><link name='a'/><link name='b'><pose>0 0 1 0 0 0</pose></link>"
      "<joint name='i' type='fixed'><parent>world</parent><child>a</child></joint>"
      "<joint name='j' type='fixed'><pose>0.5 0 0 0 0 0</pose><parent>a</parent><child>b</child>"
      "<sensor name='s' type='force_torque'><pose>0 0.25 0 0 0 0</pose></sensor></joint></model>");
  const SensorDescription& sensor = only(*world);
  EXPECT_EQ(sensor.joint, 1);
  EXPECT_EQ(sensor.link, 1);
  EXPECT_LT((sensor.X_LS.translation - Vec3(0.5, 0.25, 0)).norm(), 1e-15);
  const auto urdf = load_world_text(
      "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='fixed'>"
      "<parent link='a'/><child link='b'/></joint><gazebo reference='j'>"
      "<sensor name='s' type='force_torque'/></gazebo></robot>",
      "/nowhere/r.urdf");
  EXPECT_TRUE(urdf->findings.empty());
  EXPECT_EQ(urdf->models.back().model->sensors.at(0).joint, 0);
}

TEST(SensorPlugins, ReportsMalformedTriggers) {
  const std::string touch = "gz-sim-touch-plugin-system", name = "gz::sim::systems::TouchPlugin",
                    detector = "gz::sim::systems::PerformerDetector";
  EXPECT_THAT(texts(*with(touch, "<time>1</time><enabled>true</enabled>", name)),
              ElementsAre("<plugin>: TouchPlugin has no <target>; the sensor is left out"));
  EXPECT_THAT(texts(*with(touch, "<target>a</target><enabled>true</enabled>", name)),
              ElementsAre("<plugin>: TouchPlugin has no <time>; the sensor is left out"));
  EXPECT_THAT(texts(*with(touch, "<target>a</target><time>1</time>", name)),
              ElementsAre(HasSubstr("is enabled from the start")));
  EXPECT_THAT(
      texts(*with("x", "", detector)),
      ElementsAre(
          "<plugin>: PerformerDetector has no <geometry><box><size>; the sensor is left out"));
  EXPECT_THAT(texts(*with("x", "<geometry><box><size>1 1 1</size></box></geometry>", detector)),
              ElementsAre("PerformerDetector detects nobody: the world has no <performer>"));
}

TEST(SensorPlugins, ReportsMissingPerformersAndLevels) {
  const auto world = world_of(
      "<plugin name='ignition::gazebo' filename='dummy'><performer name='p'><ref>robot</ref>"
      "<geometry><box><size>1 1 1</size></box></geometry></performer><performer name='q'><ref>m"
      "</ref></performer><level name='l'/></plugin><model name='m'><link name='l'/></model>");
  EXPECT_THAT(texts(*world),
              ElementsAre(HasSubstr("levels are not supported"), HasSubstr("<geometry>"),
                          HasSubstr("the world has no model 'robot'")));
}

}  // namespace
}  // namespace ruedo::world
