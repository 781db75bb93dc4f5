// Faulty world files, each with the complete error that its author reads.
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "world/load.h"

namespace ruedo::world {
namespace {

struct BadWorld {
  const char* name;
  std::string text;
  const char* error;              // after "world.sdf"
  const char* instead = nullptr;  // what is done with it; null: the file is refused
};

// A world of one model around `inside`, which begins in line 4.
std::string in_model(const std::string& inside) {
  return "<sdf version='1.9'>\n<world name='w'>\n<model name='m'>\n" + inside +
         "\n</model></world></sdf>";
}
// The same, around the content of a link, which begins in line 5.
std::string in_link(const std::string& inside) {
  return in_model("<link name='l'>\n" + inside + "\n</link>");
}
// The same, around a collision's geometry, which begins in line 5.
std::string shape(const std::string& geometry) {
  return in_link("<collision name='c'><geometry>" + geometry + "</geometry></collision>");
}
std::string in_world(const std::string& inside) {
  return "<sdf version='1.9'>\n<world name='w'>\n" + inside + "\n</world></sdf>";
}
// Two links and a joint between them, which begins in line 5.
std::string joint(const std::string& text) {
  return in_model("<link name='a'/><link name='b'/>\n" + text);
}
// A robot with two wheels, around what its <ruedo:drive> (line 8) says.
std::string drive(const std::string& inside, const std::string& attributes = "") {
  return in_model(
      "<link name='base'/><link name='l'><pose>0 0.2 0.1 0 0 0</pose></link><link name='r'><pose>0 "
      "-0.2 0.1 0 0 0</pose></link>\n"
      "<joint name='jl' type='revolute'><parent>base</parent><child>l</child><axis><xyz>0 1 "
      "0</xyz></axis></joint>\n"
      "<joint name='jr' type='revolute'><parent>base</parent><child>r</child><axis><xyz>0 1 "
      "0</xyz></axis></joint>\n"
      "<joint name='fix' type='fixed'><parent>world</parent><child>base</child></joint>\n"
      "<ruedo:drive" +
      attributes + ">" + inside + "</ruedo:drive>");
}

const std::vector<BadWorld>& table() {
  static const std::string kJoints =
      "<ruedo:left_joint>jl</ruedo:left_joint><ruedo:right_joint>jr</ruedo:right_joint>";
  static const std::vector<BadWorld> worlds = {
      // The file as a whole.
      {"Empty", "", ": the file is empty"},
      {"OnlySpace", " \n\t\n", ": the file is empty"},
      {"OnlyAMark", "\xEF\xBB\xBF\n", ": the file is empty"},
      {"NoXml", "hello", ":1: not XML: the text does not begin with '<'"},
      {"NotClosed", "<sdf version='1.9'>\n<world name='w'>\n</sdf>",
       ":2: not XML: this element has no closing tag of the same name"},
      {"AttributeWithoutQuotes", "<sdf version=1.9/>",
       ":1: not XML: an attribute that is not complete"},
      {"CommentWithoutEnd", "<sdf version='1.9'><!-- \n", ":1: not XML: a comment that never ends"},
      {"TwoRoots", "<sdf version='1.9'/>\n<sdf version='1.9'/>",
       ":2: not XML: a second root element <sdf>"},
      {"Utf16", std::string("\xFF\xFE<\0s\0", 6), ":1: the text is UTF-16; save the file as UTF-8"},
      {"Zeroes", std::string("<sdf\0>", 6), ":1: not a text file: it holds zero bytes"},
      {"NotUtf8", "<sdf version='1.9'>\n<world name='w\xE9'/></sdf>",
       ":2: text that is not UTF-8; save the file as UTF-8"},
      {"Html", "<html/>", ":1: <html>: is not SDF: the root element is not <sdf>"},
      {"OldGazebo", "<gazebo version='1.2'/>",
       ":1: <gazebo>: this is the format of Gazebo before 1.0; Ruedo reads SDF 1.4 to 1.12 (gz sdf "
       "-p converts it)"},
      {"NoVersion", "<sdf/>",
       ":1: <sdf>: has no version; the attribute version is required, as in version=\"1.9\""},
      {"BadVersion", "<sdf version='new'/>",
       ":1: <sdf>: version 'new' is not a version; allowed are 1.4 to 1.12"},
      {"TooOld", "<sdf version='1.0'/>",
       ":1: <sdf>: version '1.0' is too old; allowed are 1.4 to 1.12"},
      {"OtherMajor", "<sdf version='2.0'/>",
       ":1: <sdf>: version '2.0' is not known; allowed are 1.4 to 1.12"},
      {"NothingInside", "<sdf version='1.9'/>",
       ":1: <sdf>: holds no <world>, <model>, <light> or <actor>"},
      // Names.
      {"EmptyName", in_world("<model name=''/>"), ":3: <model>: has an empty name",
       "the model is left out"},
      {"ReservedName", in_model("<link name='__model__'/>"),
       ":4: <link>: '__model__' is a reserved name; choose another", "the link is left out"},
      {"TwoLinks", in_model("<link name='a'/>\n<link name='a'/>"),
       ":5: <link>: the name 'a' is taken by <link> in FILE:4; names are unique in model m",
       "the link is left out"},
      {"TwoCollisions",
       in_link("<collision name='c'><geometry><empty/></geometry></collision>\n"
               "<collision name='c'><geometry><empty/></geometry></collision>"),
       ":6: <collision>: a second <collision> named 'c' in this link", "the shape is left out"},
      {"RobotNamedRuedo",
       in_world("<model name='ruedo'><link name='l'><sensor name='s' type='imu'/></link></model>"),
       ":3: the model name 'ruedo' is kept for Ruedo's own channels; choose another"},
      {"ChannelTooLong",
       in_link("<sensor name='a23456789012345678901234567890123456789012345678901234567890xy' "
               "type='imu'/>"),
       ":5: the channel 'm/a23456789012345678901234567890123456789012345678901234567890xy' has 64 "
       "characters; allowed are 63"},
      // Numbers.
      {"PoseOfFour", in_link("<pose>0 0 0 0</pose>"),
       ":5: <link/pose>: '0 0 0 0' has 4 numbers; allowed are x y z roll pitch yaw",
       "the link is left out"},
      {"CommaInPose", in_link("<pose>0 0 1,5 0 0 0</pose>"),
       ":5: <link/pose>: '1,5' is not a number; allowed is a number", "the link is left out"},
      {"NanInPose", in_link("<pose>0 nan 0 0 0 0</pose>"),
       ":5: <link/pose>: 'nan' is not finite; allowed is a number", "the link is left out"},
      {"HugeNumber", in_link("<pose>1e999 0 0 0 0 0</pose>"),
       ":5: <link/pose>: '1e999' is too large for a number", "the link is left out"},
      {"TextForMass", in_link("<inertial><mass>heavy</mass></inertial>"),
       ":5: <inertial/mass>: 'heavy' is not a number; allowed is a number",
       "a mass of 1 kg is taken"},
      {"Boolean", in_model("<static>maybe</static><link name='l'/>"),
       ":4: <model/static>: 'maybe' is neither true nor false; allowed are true, false, 1, 0",
       "the model is left out"},
      {"StepZero", in_world("<physics type='ode'><max_step_size>0</max_step_size></physics>"),
       ":3: <max_step_size>: '0' is not allowed; allowed is a number from 1e-06 to 1",
       "the defaults are used"},
      {"GravityTooLarge", in_world("<gravity>1e101 0.1 -9.7</gravity>"),
       ":3: <world/gravity>: '1e101' is too large for a gravity; allowed is up to 1000 m/s^2",
       "the defaults are used"},
      {"GravityOfPhysicsTooLarge",
       in_world("<physics type='ode'><gravity>0 0 -1e9</gravity></physics>"),
       ":3: <physics/gravity>: '-1e9' is too large for a gravity; allowed is up to 1000 m/s^2",
       "the defaults are used"},
      {"GravityOfTwo", in_world("<gravity>0 -9.8</gravity>"),
       ":3: <world/gravity>: '0 -9.8' has 2 numbers; allowed are three", "the defaults are used"},
      {"ColourOfTwo",
       in_link("<visual "
               "name='v'><geometry><sphere><radius>1</radius></sphere></"
               "geometry>\n<material><diffuse>1 0</diffuse></material></visual>"),
       ":6: <diffuse>: '1 0' has 2 numbers; allowed are r g b and r g b a, from 0 to 1",
       "the material is left out"},
      // Shapes.
      {"NoGeometry", in_link("<collision name='c'/>"), ":5: <collision>: has no <geometry>",
       "the shape is left out"},
      {"NegativeBox", shape("<box><size>1 -1 1</size></box>"),
       ":5: <size>: '1 -1 1' is not allowed; sizes are above 0", "the shape is left out"},
      {"NegativeRadius", shape("<sphere><radius>-2</radius></sphere>"),
       ":5: <sphere/radius>: '-2' is not allowed; allowed is a number of at least 0",
       "the shape is left out"},
      {"CylinderWithoutLength", shape("<cylinder><radius>1</radius></cylinder>"),
       ":5: <cylinder>: has no <length>", "the shape is left out"},
      {"ZeroNormal", shape("<plane><normal>0 0 0</normal></plane>"),
       ":5: <normal>: '0 0 0' is not allowed; a normal is not zero", "the shape is left out"},
      {"TwoShapes", shape("<box><size>1 1 1</size></box><sphere><radius>1</radius></sphere>"),
       ":5: <sphere>: is a second shape; <geometry> holds one", "the shape is left out"},
      {"MeshWithoutUri", shape("<mesh/>"), ":5: <mesh>: has no <uri>", "the shape is left out"},
      {"FlatMesh", shape("<mesh><uri>x.stl</uri><scale>1 0 1</scale></mesh>"),
       ":5: <scale>: '1 0 1' has a zero; a mesh cannot be flat", "the shape is left out"},
      {"PointOfThree", shape("<polyline><point>1 2 3</point></polyline>"),
       ":5: <point>: '1 2 3' has 3 numbers; allowed are x y", "the shape is left out"},
      // Frames.
      {"UnknownFrame",
       in_model("<link name='base'/><link name='l'>\n<pose relative_to='bass'>0 0 0 0 0 "
                "0</pose></link>"),
       ":4: <link>: there is no frame 'bass' in model m; did you mean 'base'?",
       "the model is left out"},
      {"FramesInACircle",
       in_model("<link name='a'><pose relative_to='b'/></link>\n<link name='b'><pose "
                "relative_to='a'/></link>"),
       ":4: <link>: 'a' is placed relative to itself, through other frames",
       "the model is left out"},
      {"UnknownCanonicalLink",
       "<sdf version='1.9'>\n<model name='m' canonical_link='x'><link name='base'/></model></sdf>",
       ":2: <model>: there is no frame 'x' in model m", "its first link is taken"},
      {"UnknownPlacementFrame",
       "<sdf version='1.9'>\n<world name='w'><model name='m' placement_frame='x'><link "
       "name='base'/></model></world></sdf>",
       ":2: <model>: placement_frame 'x' is not a frame of the model 'm'", "the model is left out"},
      // Joints.
      {"JointWithoutType", joint("<joint name='j'><parent>a</parent><child>b</child></joint>"),
       ":5: <joint>: has no type", "the joint is left out"},
      {"MistypedJoint",
       joint("<joint name='j' type='revolut'><parent>a</parent><child>b</child></joint>"),
       ":5: <joint>: type 'revolut' is not allowed; allowed are fixed, revolute, continuous, "
       "prismatic, ball, universal, screw, gearbox; did you mean 'revolute'?",
       "the joint is left out"},
      {"JointWithoutChild", joint("<joint name='j' type='fixed'><parent>a</parent></joint>"),
       ":5: <joint>: has no <child>", "the joint is left out"},
      {"JointToNoLink",
       joint("<joint name='j' type='fixed'><parent>a</parent>\n<child>c</child></joint>"),
       ":6: <child>: there is no frame 'c' in model m", "the joint is left out"},
      {"JointToItself",
       joint("<joint name='j' type='fixed'><parent>a</parent><child>a</child></joint>"),
       ":5: <joint>: joins the link 'a' to itself", "the joint is left out"},
      {"WorldAsChild",
       joint("<joint name='j' type='fixed'><parent>a</parent><child>world</child></joint>"),
       ":5: <child>: 'world' is not allowed as the child of a joint", "the joint is left out"},
      {"NoAxis",
       joint("<joint name='j' type='prismatic'><parent>a</parent><child>b</child></joint>"),
       ":5: <joint>: has no <axis>; joints of type 'prismatic' need one", "the joint is left out"},
      {"ZeroAxis",
       joint("<joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 0 "
             "0</xyz></axis></joint>"),
       ":5: <xyz>: '0 0 0' is not allowed; an axis is not zero", "the joint is left out"},
      // Lights, sensors, includes.
      {"LightType", in_world("<light name='l' type='laser'/>"),
       ":3: <light>: type 'laser' is not allowed; allowed are directional, point, spot",
       "the light is left out"},
      {"SensorWithoutType", in_link("<sensor name='s'/>"), ":5: <sensor>: has no type",
       "the sensor is left out"},
      {"IncludeWithoutUri", in_world("<include/>"), ":3: <include>: has no <uri>",
       "the model is left out"},
      // Ruedo's own elements.
      {"UnknownRuedoElement", in_model("<link name='l'/>\n<ruedo:driv/>"),
       ":5: <ruedo:driv> is not known in <model>; did you mean <ruedo:drive>?"},
      {"DriveWithoutJoints", drive(""), ":8: <ruedo:drive>: has no <ruedo:left_joint>"},
      {"DriveType", drive(kJoints, " type='hover'"),
       ":8: <ruedo:drive>: type 'hover' is not allowed; allowed are kinematic, wheels and none"},
      {"NoDriveWithElements", drive(kJoints, " type='none'"),
       ":8: <ruedo:left_joint>: is not allowed with type 'none', which has no elements"},
      {"DriveJointUnknown", drive("<ruedo:left_joint>jx</ruedo:left_joint>"),
       ":8: <ruedo:left_joint>: there is no joint 'jx' in the model 'm'; did you mean 'jl'?"},
      {"DriveJointFixed", drive("<ruedo:left_joint>fix</ruedo:left_joint>"),
       ":8: <ruedo:left_joint>: the joint 'fix' does not turn; a wheel's joint is revolute or "
       "continuous"},
      {"DriveWithoutRadius", drive(kJoints),
       ":8: <ruedo:drive>: has no <ruedo:wheel_radius>, and the wheel has no collision shape to "
       "take it from"},
      {"NegativeTrack",
       drive(kJoints + "<ruedo:wheel_radius>0.1</ruedo:wheel_radius><ruedo:track>-1</ruedo:track>"),
       ":8: <ruedo:drive/ruedo:track>: '-1' is not allowed; allowed is a number above 0"},
      {"MistypedLimit", drive(kJoints + "<ruedo:max_sped>1</ruedo:max_sped>"),
       ":8: <ruedo:max_sped> is not known in <ruedo:drive>; did you mean <ruedo:max_speed>?"},
      {"OdometryWithoutDrive", in_model("<link name='l'/>\n<ruedo:odometry/>"),
       ":5: <ruedo:odometry>: needs a drive: the model has no <ruedo:drive>"},
      {"Reflectance",
       in_link(
           "<collision name='c'><geometry><sphere><radius>1</radius></sphere></geometry>\n"
           "<surface><ruedo:laser_reflectance>2</ruedo:laser_reflectance></surface></collision>"),
       ":6: <surface/ruedo:laser_reflectance>: '2' is not allowed; allowed is a number from 0 to "
       "1"},
      {"UrdfWithXacro", "<robot name='r'>\n<xacro:include filename='x'/></robot>",
       ":2: <xacro:include>: is xacro; expand it first: xacro FILE > robot.urdf"},
      {"UrdfWithoutLinks", "<robot name='r'/>",
       ":1: <robot>: urdfdom cannot read it: No link elements found in urdf file"},
      {"UrdfJointWithoutLimits",
       "<robot name='r'><link name='a'/><link name='b'/>\n<joint name='j' type='revolute'><parent "
       "link='a'/><child link='b'/></joint></robot>",
       ":2: a revolute joint without <limit>", "it has none"},
      {"UrdfTwoRoots", "<robot name='r'>\n<link name='a'/><link name='b'/></robot>",
       ":2: is not connected to 'a'", "the link is left out"},
      {"JointToAnotherModel",
       joint("<joint name='j' type='fixed'><parent>table::top</parent><child>a</child></joint>"),
       ":5: <parent>: there is no frame 'table::top' in model m; it can be of this model or of one "
       "that is nested in it",
       "the joint is left out"},
      {"UrdfTwoLinks", "<robot name='r'><link name='a'/>\n<link name='a'/></robot>",
       ":2: a second <link> of the name 'a'", "the link is left out"},
  };
  return worlds;
}

std::ostream& operator<<(std::ostream& out, const BadWorld& world) { return out << world.name; }

class BadWorlds : public testing::TestWithParam<BadWorld> {};

TEST_P(BadWorlds, GiveOneClearError) {
  const std::string file = "/nowhere/world.sdf";
  std::string expected = file + GetParam().error;
  if (const size_t at = expected.find("FILE:"); at != std::string::npos)
    expected.replace(at, 4, file);
  try {
    const auto world = load_world_text(GetParam().text, file);
    ASSERT_TRUE(GetParam().instead) << "loaded; expected: " << expected;
    ASSERT_FALSE(world->findings.empty());
    const Finding& finding = world->findings[0];
    EXPECT_EQ(finding.kind, Finding::Kind::error);
    EXPECT_EQ(finding.source.str() + ": " + finding.text, expected + "; " + GetParam().instead);
  } catch (const InputError& error) {
    EXPECT_EQ(error.what(), expected);
    EXPECT_FALSE(GetParam().instead);
  }
}

INSTANTIATE_TEST_SUITE_P(Table, BadWorlds, testing::ValuesIn(table()),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(BadWorldsTable, IsLongEnough) { EXPECT_GE(table().size(), 40u); }

std::string error_of(const std::string& path) {
  try {
    load_world(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(BadFiles, AreReportedWithTheirPath) {
  TemporaryFolder folder;
  EXPECT_EQ(error_of(folder / "none.sdf"), folder / "none.sdf: no such file");
  EXPECT_EQ(error_of(folder.path()), folder.path() + ": is a folder; a file is needed");
  EXPECT_EQ(error_of("/dev/zero"), "/dev/zero: is not a regular file");
}

TEST(BadFiles, EntitiesDoNotExplode) {
  std::string text = "<?xml version='1.0'?><!DOCTYPE lolz [<!ENTITY a0 'lol'>";
  for (int i = 1; i < 12; ++i) {
    text += "<!ENTITY a" + std::to_string(i) + " '";
    for (int k = 0; k < 10; ++k) text += "&a" + std::to_string(i - 1) + ";";
    text += "'>";
  }
  text += "]><sdf version='1.9'><world name='&a11;'/></sdf>";
  EXPECT_EQ(load_world_text(text, "/nowhere/world.sdf")->name, "&a11;");  // as it is written
}

TEST(BadFiles, DeepNestingIsRefused) {
  std::string text;
  for (int i = 0; i < 100'000; ++i) text += "<a>";
  EXPECT_THROW(load_world_text(text, "/nowhere/world.sdf"), InputError);
}

TEST(BadFiles, IncludesInACircle) {
  TemporaryFolder folder;
  const auto model = [&](const std::string& name, const std::string& included) {
    return folder.write(name + ".sdf", "<sdf version='1.9'><model name='" + name +
                                           "'>\n<link name='l'/><include><uri>" + included +
                                           ".sdf</uri></include></model></sdf>");
  };
  const auto first_finding = [](const std::string& path) {
    const auto world = load_world(path);
    return world->findings.empty()
               ? ""
               : world->findings[0].source.str() + ": " + world->findings[0].text;
  };
  const std::string a = model("a", "b");
  const std::string b = model("b", "a");
  EXPECT_EQ(first_finding(a), b + ":2: <include>: an include that never ends: a.sdf includes b.sdf "
                                  "includes a.sdf; the part is left out");
  const std::string self = model("self", "self");
  EXPECT_EQ(first_finding(self), self +
                                     ":2: <include>: an include that never ends: self.sdf includes "
                                     "self.sdf; the part is left out");
}

// Thirty files, each including the next one twice: 2^30 links.
TEST(BadFiles, IncludesThatMultiplyAreRefused) {
  TemporaryFolder folder;
  folder.write("m30.sdf", "<sdf version='1.9'><model name='m30'><link name='l'/></model></sdf>");
  for (int i = 29; i >= 0; --i) {
    const std::string next = "<include><uri>m" + std::to_string(i + 1) + ".sdf</uri><name>";
    folder.write("m" + std::to_string(i) + ".sdf",
                 "<sdf version='1.9'><model name='m" + std::to_string(i) + "'>" + next +
                     "a</name></include>" + next + "b</name></include></model></sdf>");
  }
  EXPECT_NE(error_of(folder / "m0.sdf").find("the model has more than 20000 links"),
            std::string::npos);
}

// From a file as from a text: two folders up is refused, by whatever path, unless the user allows
// absolute paths.
TEST(BadFiles, AreNotReadOutsideTheSearchPath) {
  TemporaryFolder folder;
  const std::string model =
      "<sdf version='1.9'><model name='secret'><link name='l'/></model></sdf>";
  const std::string secret = folder.write("secret/model.sdf", model);
  folder.write("a/b/near.sdf", model);
  const std::string root = std::filesystem::path(secret).parent_path().parent_path().string();
  const std::string out = "leads out of the folders that are searched (RUEDO_PATH=" + root +
                          " lets it in)",
                    absolute =
                        "lies outside the folders that are searched (--allow-absolute lets it in)";
  const std::pair<std::string, std::string> cases[] = {{secret, absolute},
                                                       {"file://" + secret, absolute},
                                                       {"model://../../secret", "is not found"},
                                                       {"model://b/../../secret", "is not found"},
                                                       {"../../secret/model.sdf", out},
                                                       {"%2e%2e/%2e%2e/secret/model.sdf", out},
                                                       {"../b/../../secret/model.sdf", out},
                                                       {"secret/model.sdf", "is not found"}};
  for (const auto& [uri, why] : cases) {
    const std::string text = "<sdf version='1.9'><world name='w'><include><uri>" + uri +
                             "</uri></include></world></sdf>";
    const std::string path = folder.write("a/b/world.sdf", text);
    for (const auto& world : {load_world(path), load_world_text(text, path)}) {
      EXPECT_TRUE(world->models.empty()) << uri;
      ASSERT_EQ(world->findings.size(), 1u) << uri;
      EXPECT_EQ(world->findings[0].text, "'" + uri + "' " + why + "; the world runs without it");
    }
    LoadOptions options;
    options.allow_absolute = true;
    EXPECT_EQ(load_world(path, options)->models.size(), why == absolute ? 1u : 0u) << uri;
  }
  // Absolute paths into the search folders, and links that lead out of them, are the user's own
  // choice.
  std::filesystem::create_symlink(secret, folder / "a/b/link.sdf");
  for (const std::string& uri : {folder / "a/b/near.sdf", std::string("link.sdf")}) {
    EXPECT_EQ(load_world(folder.write("a/b/world.sdf",
                                      "<sdf version='1.9'><world name='w'><include><uri>" + uri +
                                          "</uri></include></world></sdf>"))
                  ->models.size(),
              1u);
  }
}

}  // namespace
}  // namespace ruedo::world
