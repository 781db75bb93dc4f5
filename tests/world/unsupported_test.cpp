// Elements that Ruedo does not simulate: each one is reported, and the rest of the world is
// loaded.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "world/load.h"

namespace ruedo::world {
namespace {

struct Part {
  const char* name;
  std::string inside;  // of a model with the links a and b
  const char* finding;
};
std::ostream& operator<<(std::ostream& out, const Part& part) { return out << part.name; }

std::string joint(const std::string& type, const std::string& inside = "") {
  return "<joint name='j' type='" + type +
         "'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz>" + inside + "</axis></joint>";
}
std::string plugin(const std::string& file, const std::string& name) {
  return "<plugin filename='" + file + "' name='" + name + "'><left_joint>x</left_joint></plugin>";
}

std::string surface(const std::string& inside) {
  return "<link name='c'><collision "
         "name='c'><geometry><sphere><radius>1</radius></sphere></geometry><surface>" +
         inside + "</surface></collision></link>";
}
std::string driven() {
  const auto wheel = [](const std::string& name, const std::string& y) {
    return "<link name='" + name + "'><pose>0 " + y +
           " 0.1 0 0 0</pose><collision "
           "name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link>"
           "<joint name='j" +
           name + "' type='revolute'><parent>b</parent><child>" + name +
           "</child><axis><xyz>0 1 0</xyz></axis></joint>";
  };
  return "<link name='b'/>" + wheel("l", "0.2") + wheel("r", "-0.2") +
         "<ruedo:drive><ruedo:left_joint>jl</ruedo:left_joint><ruedo:right_joint>jr</"
         "ruedo:right_joint></ruedo:drive>";
}

class Unsupported : public testing::TestWithParam<Part> {};

TEST_P(Unsupported, IsReportedOnceWithItsLine) {
  const auto world = load_world_text(
      "<sdf version='1.9'><world name='w'>\n<model name='m'><link name='a'/><link name='b'/>\n" +
          GetParam().inside + "</model></world></sdf>",
      "/nowhere/w.sdf");
  ASSERT_EQ(world->findings.size(), 1u);
  EXPECT_EQ(world->findings[0].text, GetParam().finding);
  EXPECT_EQ(world->findings[0].kind, Finding::Kind::unsupported);
  EXPECT_EQ(world->findings[0].source.line, 3);
  EXPECT_GE(world->models.at(0).model->links.size(), 2u);
  EXPECT_EQ(world->models[0].model->drive.has_value(),
            GetParam().inside.find("<ruedo:drive>") != std::string::npos ||
                GetParam().inside.find("tracked-vehicle") != std::string::npos);
  EXPECT_FALSE(world->models[0].model->commanded);
}

INSTANTIATE_TEST_SUITE_P(
    Table, Unsupported,
    testing::Values(
        Part{"OtherPlugin", plugin("libx.so", "x") + plugin("libx.so", "y"),
             "plugins are not loaded: libx.so"},
        Part{"Planar", joint("planar"),
             "joints of type 'planar' are not supported; this one is held fixed"},
        Part{"InitialPositionOfABall", joint("ball", "<initial_position>0.5</initial_position>"),
             "<initial_position> is not supported in such a joint: it begins at 0"},
        Part{"VelocityDecay",
             "<link name='c'><velocity_decay/></link><link "
             "name='d'><velocity_decay><linear>0.1</linear></velocity_decay></link>",
             "<velocity_decay> is not supported: nothing slows the link in the air"},
        Part{"SelfCollideOfALink", "<link name='c'><self_collide>1</self_collide></link>",
             "<self_collide> of a link is not supported; a model may have it"},
        Part{"CollideBitmask",
             surface("<contact><collide_bitmask>0x00</collide_bitmask></contact>"),
             "<collide_bitmask> is not supported: the shape collides with everything"},
        Part{
            "CollideWithoutContact",
            surface("<contact><collide_bitmask>0xffff</collide_bitmask><collide_without_contact>1</"
                    "collide_without_contact></contact>"),
            "<collide_without_contact> is not supported: the shape collides as others do"},
        Part{"LoneTrackOfAVehicle",
             "<plugin filename='gz-sim-track-controller-system' name='x'><link>a</link></plugin>"
             "<plugin filename='gz-sim-track-controller-system' name='x'><link>b</link></plugin>"
             "<plugin filename='gz-sim-tracked-vehicle-system' name='x'><left_track><link>a</link>"
             "</left_track><tracks_separation>0.4</tracks_separation></plugin>",
             "the plugin TrackController has no effect here: its belt would follow commands; "
             "<ruedo:belt> has a fixed velocity"},
        Part{"LoneTrack",
             "<plugin filename='gz-sim-track-controller-system' "
             "name='gz::sim::systems::TrackController'/>",
             "the plugin TrackController has no effect here: its belt would follow commands; "
             "<ruedo:belt> has a fixed velocity"},
        Part{
            "BounceThreshold",
            surface("<bounce><restitution_coefficient>0.5</restitution_coefficient><threshold>0.1"
                    "</threshold></bounce>") +
                "<link name='d'><collision "
                "name='c'><geometry><sphere><radius>1</radius></sphere></geometry><surface><bounce>"
                "<threshold>100000.0</threshold></bounce></surface></collision></link>",
            "<threshold> is not supported: bodies bounce at any speed"},
        Part{"SoftStops",
             joint("revolute",
                   "<limit><lower>-1</lower><upper>1</upper><stiffness>100</stiffness><dissipation>"
                   "1.0</dissipation></limit>"),
             "<stiffness> is not supported: a joint's stops are stiff"},
        Part{"VisibilityFlags",
             "<link name='c'><visual name='v'><visibility_flags>1</visibility_flags><geometry>"
             "<box><size>1 1 1</size></box></geometry></visual></link>",
             "<visibility_flags> is not supported: every camera sees every visual"},
        Part{"SoftContact",
             surface("<soft_contact><dart><stiffness>1</stiffness></dart></soft_contact>"),
             "<soft_contact> is not supported: nothing is soft"},
        Part{"SecondDrive",
             "<model name='n'>" + driven() + "</model><model name='k'>" + driven() + "</model>",
             "a second drive, of the nested model 'k', is not supported: its wheels turn freely"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Mimic, UrdfAndSdfNameTheLeader) {
  const auto world = load_world_text(
      "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>\n"
      "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>\n"
      "<joint name='k' type='continuous'><parent link='a'/><child link='c'/><mimic joint='j' "
      "multiplier='-2' offset='0.5'/></joint></robot>",
      "/nowhere/r.urdf");
  EXPECT_TRUE(world->findings.empty());
  const Joint& k = world->models.at(world->models.size() - 1).model->joints.at(1);
  EXPECT_EQ(k.leader, 0);
  EXPECT_EQ(k.mimic_multiplier, -2.0);
  EXPECT_EQ(k.mimic_offset, 0.5);
  const auto sdf = load_world_text(
      "<sdf version='1.11'><world name='w'><model name='m'><link name='a'/><link name='b'/><link "
      "name='c'/>" +
          joint("revolute") +
          "<joint name='k' type='revolute'><parent>a</parent><child>c</child><axis><xyz>0 0 "
          "1</xyz><mimic joint='j'><multiplier>3</multiplier>"
          "<offset>1</offset><reference>0.25</reference></mimic></axis></joint></model></world></"
          "sdf>",
      "/nowhere/w.sdf");
  EXPECT_TRUE(sdf->findings.empty());
  EXPECT_EQ(sdf->models.at(0).model->joints.at(1).leader, 0);
  EXPECT_EQ(sdf->models[0].model->joints[1].mimic_reference, 0.25);
}

TEST(Mimic, APluginOfClassicNamesTheLeader) {
  const auto world = [](const std::string& leader) {
    return load_world_text(
        "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>\n"
        "<joint name='j' type='continuous'><parent link='a'/><child link='b'/></joint>\n"
        "<joint name='k' type='continuous'><parent link='a'/><child "
        "link='c'/></joint><gazebo><plugin "
        "name='m' filename='libroboticsgroup_upatras_gazebo_mimic_joint_plugin.so'><joint>" +
            leader +
            "</joint><mimicJoint>k</mimicJoint><multiplier>-1</multiplier><offset>0.2</offset>"
            "</plugin></gazebo></robot>",
        "/nowhere/r.urdf");
  };
  const auto good = world("j");
  EXPECT_TRUE(good->findings.empty());
  const Joint& k = good->models.back().model->joints.at(1);
  EXPECT_EQ(k.leader, 0);
  EXPECT_EQ(k.mimic_multiplier, -1.0);
  EXPECT_EQ(k.mimic_offset, 0.2);
  EXPECT_THAT(world("k")->findings.at(0).text, testing::HasSubstr("a joint cannot follow itself"));
  EXPECT_THAT(world("l")->findings.at(0).text,
              testing::HasSubstr("'l' is not one of the model's joints"));
}

// A leader that does not exist, or that follows its own follower, is an error; the joint then moves
// on its own.
TEST(Mimic, RejectsMissingLeadersAndCycles) {
  const auto finding = [](const std::string& leader) {
    const auto world = load_world_text(
        "<sdf version='1.9'><world name='w'>\n<model name='m'><link name='a'/><link name='b'/>\n" +
            joint("revolute", "<mimic joint='" + leader + "'/>") + "</model></world></sdf>",
        "/nowhere/w.sdf");
    EXPECT_EQ(world->findings.size(), 1u);
    EXPECT_EQ(world->findings.at(0).kind, Finding::Kind::error);
    EXPECT_EQ(world->findings[0].source.line, 3);
    EXPECT_EQ(world->models.at(0).model->joints.at(0).leader, -1);
    return world->findings[0].text;
  };
  EXPECT_THAT(finding("k"), testing::HasSubstr("joint 'k' is not one of the model's joints"));
  EXPECT_THAT(finding("j"), testing::HasSubstr("cannot follow itself"));
}

// An axis by another frame's directions, in the model's (before SDF 1.5), and by the switch of 1.5
// and 1.6.
TEST(JointAxes, AreWrittenInSeveralFrames) {
  const auto axis = [](const std::string& version, const std::string& xyz,
                       const std::string& more = "") {
    const auto world = load_world_text(
        "<sdf version='" + version +
            "'><world name='w'><model name='m'><link name='a'/><link name='b'><pose>0 0 0 0 0 "
            "1.5707963267948966</pose></link>"
            "<joint name='j' type='continuous'><parent>a</parent><child>b</child><axis>" +
            xyz + more + "</axis></joint></model></world></sdf>",
        "/nowhere/w.sdf");
    const Joint& j = world->models.at(0).model->joints.at(0);
    return Vec3(j.X_MJ.rotation * j.axis.axis_in_J);  // in the model's frame
  };
  EXPECT_LT((axis("1.9", "<xyz>1 0 0</xyz>") - Vec3(0, 1, 0)).norm(),
            1e-12);  // the joint's frame is that of b
  EXPECT_LT((axis("1.9", "<xyz expressed_in='a'>1 0 0</xyz>") - Vec3(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((axis("1.9", "<xyz expressed_in='__model__'>0 3 0</xyz>") - Vec3(0, 1, 0)).norm(),
            1e-12);
  EXPECT_LT((axis("1.4", "<xyz>1 0 0</xyz>") - Vec3(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT(
      (axis("1.6", "<xyz>1 0 0</xyz>", "<use_parent_model_frame>true</use_parent_model_frame>") -
       Vec3(1, 0, 0))
          .norm(),
      1e-12);
  EXPECT_LT((axis("1.6", "<xyz>1 0 0</xyz>") - Vec3(0, 1, 0)).norm(), 1e-12);
}

}  // namespace
}  // namespace ruedo::world
