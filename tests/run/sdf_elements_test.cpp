// The elements of SDF 1.12 in a <sensor>: the devices read them when a world is made.
#include <gtest/gtest.h>

#include "engine/world.h"
#include "sdf_elements.h"

namespace ruedo {
namespace {

TEST(SdfElements, EveryElementOfASensorActsOrIsReported) {
  const auto of_sensors = [](const std::string& path) {
    return path.find("/sensor") != std::string::npos;
  };
  const auto load = [](const std::string& text, std::multiset<std::string>& found) {
    const auto world = world::load_world_text(text, "/nowhere/w.sdf");
    for (const Finding& finding : world->findings) found.insert(finding.text);
    engine::Channels channels;
    Findings of_devices;
    engine::FleetOptions options;
    options.keep_going = true;
    const engine::World made(std::make_shared<engine::Plan>(*world), options, channels, of_devices);
    for (const Finding& finding : of_devices.list()) found.insert(finding.text);
  };
  EXPECT_EQ(test::silent_ones(of_sensors, load), "");
}

// Reported when the file is read, or when the device is created, but not twice.
TEST(SdfElements, ReportsAnUnknownElementOfASensorOnce) {
  const auto count = [](const std::string& text, const std::string& word) {
    const auto world = world::load_world_text(text, "/nowhere/w.sdf");
    engine::Channels channels;
    Findings of_devices;
    engine::FleetOptions options;
    options.keep_going = true;
    const engine::World made(std::make_shared<engine::Plan>(*world), options, channels, of_devices);
    int found = 0;
    for (const Finding& each : world->findings) found += each.text.find(word) != std::string::npos;
    for (const Finding& each : of_devices.list())
      found += each.text.find(word) != std::string::npos;
    return found;
  };
  const auto sensor = [](const std::string& type, const std::string& own, const std::string& in) {
    return "<sdf version='1.9'><world name='w'><model name='m'><link name='l'><sensor name='s' "
           "type='" +
           type + "'><" + own + ">" + in + "</" + own + "></sensor></link></model></world></sdf>";
  };
  const std::string lidar =
                        "<scan><horizontal><samples>3</samples><min_angle>-1</min_angle>"
                        "<max_angle>1</max_angle></horizontal></scan><range><max>5</max>"
                        "</range>",
                    view =
                        "<near>1</near><far>5</far><horizontal_fov>1</horizontal_fov>"
                        "<aspect_ratio>1</aspect_ratio>";
  const struct {
    const char *type, *own;
    std::string needed;
  } kSensors[] = {{"camera", "camera", ""},
                  {"depth_camera", "camera", ""},
                  {"rgbd_camera", "camera", ""},
                  {"thermal_camera", "camera", ""},
                  {"wideanglecamera", "camera", ""},
                  {"boundingbox_camera", "camera", ""},
                  {"segmentation", "camera", ""},
                  {"gpu_lidar", "lidar", lidar},
                  {"ray", "ray", lidar},
                  {"imu", "imu", ""},
                  {"navsat", "navsat", ""},
                  {"altimeter", "altimeter", ""},
                  {"magnetometer", "magnetometer", ""},
                  {"air_pressure", "air_pressure", ""},
                  {"air_speed", "air_speed", ""},
                  {"logical_camera", "logical_camera", view},
                  {"contact", "contact", ""},
                  {"sonar", "sonar", "<min>0.1</min><max>5</max>"}};
  for (const auto& each : kSensors)
    EXPECT_EQ(count(sensor(each.type, each.own, each.needed + "<bogus/>"), "<bogus>"), 1)
        << each.type;
  for (const char* type :
       {"thermal", "wideanglecamera", "boundingbox", "segmentation", "camera", "rgbd"}) {
    for (const char* text : {"<save enabled='true'/>", "<visibility_mask>1</visibility_mask>",
                             "<triggered>true</triggered>", "<lens><bogus/></lens>"}) {
      const std::string word =
          std::string(text).find("bogus") != std::string::npos
              ? "<bogus>"
              : std::string(text).substr(0, std::string(text).find_first_of(" >")) + ">";
      EXPECT_EQ(count(sensor(type, "camera", text), word), 1) << type << ": " << text;
    }
    EXPECT_EQ(count(sensor(type, "camera",
                           "<image><anti_aliasing>4</anti_aliasing></image><camera_info_topic>t"
                           "</camera_info_topic><optical_frame_id>f</optical_frame_id>"),
                    "<"),
              0)
        << type;
  }
}

}  // namespace
}  // namespace ruedo
