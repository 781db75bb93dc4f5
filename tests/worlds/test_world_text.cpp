// Worlds as text: what was not edited stays as it was, byte for byte; edits read back correctly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "ruedo/errors.h"
#include "world/edit/world_text.h"
#include "world/load.h"

namespace ruedo::world {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string kWorlds = std::string(RUEDO_SOURCE_DIR) + "/worlds/";

std::string bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::vector<ModelNow> as_loaded(const WorldModel& world) {
  std::vector<ModelNow> models;
  for (const ModelInstance& model : world.models)
    models.push_back({model.name, model.X_WM, "", false});
  return models;
}

ModelNow& named(std::vector<ModelNow>& models, const std::string& name) {
  for (ModelNow& model : models) {
    if (model.name == name) return model;
  }
  throw std::out_of_range(name);
}

// A world of a few lines, and what becomes of it.
class Text {
 public:
  explicit Text(const std::string& inside, const std::string& version = "1.9")
      : text_("<?xml version=\"1.0\"?>\n<!-- first -->\n<sdf version='" + version +
              "'>\n  <world name=\"w\">\n" + inside + "  </world>\n</sdf>\n<!-- last -->\n"),
        world_(load_world_text(text_, kWorlds + "w.sdf")),
        places_(text_, *world_),
        models(as_loaded(*world_)) {}

  std::string saved() { return places_.with(models).text; }
  // Where the saved text puts a model.
  Pose put(const std::string& name) {
    const auto again = load_world_text(saved(), kWorlds + "w.sdf");
    for (const ModelInstance& model : again->models) {
      if (model.name == name) return model.X_WM;
    }
    throw std::out_of_range(name);
  }
  const std::string& text() const { return text_; }
  const WorldText& places() const { return places_; }

 private:
  std::string text_;
  std::shared_ptr<const WorldModel> world_;
  WorldText places_;

 public:
  std::vector<ModelNow> models;
};

std::string box(const std::string& name, const std::string& pose) {
  return "    <model name=\"" + name + "\">\n      <static>1</static>\n" + pose +
         "      <link name=\"l\"><collision name=\"c\"><geometry><box><size>1 1 1</size></box>"
         "</geometry></collision></link>\n    </model>\n";
}

void expect_near(const Pose& a, const Pose& b) {
  EXPECT_LT((a.translation - b.translation).norm(), 2e-6);
  EXPECT_LT(a.rotation.angularDistance(b.rotation), 5e-6);
}

class TextOfOurWorlds : public testing::TestWithParam<const char*> {};

TEST_P(TextOfOurWorlds, GoThroughToTheByte) {
  const auto world = load_world(kWorlds + GetParam());
  const WorldText::Written written =
      WorldText(bytes(kWorlds + GetParam()), *world).with(as_loaded(*world));
  EXPECT_EQ(written.text, bytes(kWorlds + GetParam()));
  EXPECT_TRUE(written.left_out.empty());
}

INSTANTIATE_TEST_SUITE_P(
    All, TextOfOurWorlds,
    testing::Values("arena.sdf", "rooms.sdf", "maze.sdf", "office.sdf", "warehouse.sdf",
                    "field.sdf", "crossing.sdf", "fleet.sdf", "terrain.sdf", "empty.sdf"),
    [](const auto& info) {
      return std::string(info.param).substr(0, std::string(info.param).find('.'));
    });

TEST(WorldTextTest, AMovedModelChangesItsPoseOnly) {
  Text world(box("a", "      <pose>1 2 0.5 0 0 0</pose>  <!-- here -->\n") + box("b", ""));
  named(world.models, "a").X_WM = Pose::from_xyz_rpy({3, -1.25, 0.5}, {0, 0, 0.5});
  std::string expected = world.text();
  expected.replace(expected.find("1 2 0.5 0 0 0"), 13, "3 -1.25 0.5 0 0 0.5");
  EXPECT_EQ(world.saved(), expected);
  named(world.models, "b").X_WM = Pose::from_xyz_rpy({0, 7, 0}, {0.1, -0.2, 3});
  expect_near(world.put("b"), Pose::from_xyz_rpy({0, 7, 0}, {0.1, -0.2, 3}));
  EXPECT_THAT(world.saved(),
              HasSubstr("<static>1</static>\n      <pose>0 7 0 0.1 -0.2 3</pose>\n"));
}

TEST(WorldTextTest, EveryRotationReadsBack) {
  Text world(box("a", ""));
  for (const Vec3& rpy : {Vec3(0.3, M_PI / 2, 1), Vec3(0.3, -M_PI / 2, 1), Vec3(3, 1, -3),
                          Vec3(0, 0, M_PI), Vec3(M_PI, 0, 0)}) {
    const Pose X = Pose::from_xyz_rpy({1e-3, 2, 3}, rpy);
    named(world.models, "a") = {"a", X, "", true};
    expect_near(world.put("a"), X);
  }
}

TEST(WorldTextTest, SavesPlacedModelsAndIgnoresTheSolversMotion) {
  Text world(box("a", ""));
  named(world.models, "a").X_WM.translation.z() = -5e-4;
  EXPECT_EQ(world.saved(), world.text());
  named(world.models, "a").put = true;
  EXPECT_NEAR(world.put("a").translation.z(), -5e-4, 1e-9);
}

TEST(WorldTextTest, ARemovedModelTakesItsLinesAlong) {
  Text world("    <!-- of a -->\n" + box("a", "") + box("b", ""));
  std::erase_if(world.models, [](const ModelNow& model) { return model.name == "a"; });
  std::string expected = world.text();
  expected.erase(expected.find(box("a", "")), box("a", "").size());
  EXPECT_EQ(world.saved(), expected);
}

TEST(WorldTextTest, AppendsANewModelUnderItsName) {
  Text world(box("a", ""));
  world.models.push_back({"c & d", Pose::from_xyz_rpy({1, 0, 0}, {0, 0, 0}),
                          "<sdf version='1.9'>" + box("x", "") + "</sdf>", true});
  world.models.push_back(
      {"guest", Pose::from_xyz_rpy({0, 2, 0}, {0, 0, 1}),
       "<sdf version='1.9'>\n<include>\n      <uri>model://p3dx</uri>\n    </include>\n</sdf>",
       true});
  const std::string saved = world.saved();
  EXPECT_EQ(saved.substr(0, saved.find("    <model name=\"c &amp; d\">")),
            world.text().substr(0, world.text().find("  </world>")));
  EXPECT_THAT(saved,
              HasSubstr("<include>\n      <uri>model://p3dx</uri>\n      <name>guest</name>\n"
                        "      <pose>0 2 0 0 0 1</pose>\n    </include>\n  </world>"));
  expect_near(world.put("guest"), Pose::from_xyz_rpy({0, 2, 0}, {0, 0, 1}));
}

TEST(WorldTextTest, ANewModelTakesThePlaceOfTheLastOne) {
  Text world(box("a", "") + box("b", "") + box("c", ""));
  for (const char* name : {"c", "b"}) {
    std::erase_if(world.models, [&](const ModelNow& model) { return model.name == name; });
    std::vector<ModelNow> with_new = world.models;
    const std::string text = "<sdf version='1.9'>" + box("x", "") + "</sdf>";
    with_new.push_back({"d", Pose::from_xyz_rpy({1, 0, 0}, {0, 0, 0}), text, true});
    const std::string saved = world.places().with(with_new).text;
    const auto again = load_world_text(saved, kWorlds + "w.sdf");
    ASSERT_EQ(again->models.size(), with_new.size()) << saved;
    EXPECT_EQ(again->models.back().name, "d");
  }
}

// In quotes of both kinds, and in an <include>.
TEST(WorldTextTest, ANameThatASpawnMayHaveReadsBack) {
  for (const std::string name :
       {"it's", "a' static='x", "'><static>0</static><x y='", "\"", "]]>"}) {
    for (const std::string model :
         {"<model name='m'><link name='l'/></model>", "<model name=\"m\"><link name='l'/></model>",
          "<include><uri>model://desk</uri></include>"}) {
      Text world(box("a", ""));
      const Pose X = Pose::from_xyz_rpy({1, 0, 0}, {0, 0, 0});
      world.models.push_back({name, X, "<sdf version='1.9'>" + model + "</sdf>", true});
      expect_near(world.put(name), X);
    }
  }
}

// Text in a declaration or a comment is not a model, whatever it looks like.
TEST(WorldTextTest, IgnoresModelsInCommentsAndDeclarations) {
  for (const std::string before : {"<?xml version='1.0' x='><sdf><model name=\"i\"/></sdf>' ?>",
                                   "<!--><sdf><model name='i'/></sdf><!-- -->"}) {
    Text world(box("a", ""));
    world.models.push_back({"b", Pose::from_xyz_rpy({1, 0, 0}, {0, 0, 0}),
                            before + "<sdf version='1.9'>" + box("x", "") + "</sdf>", true});
    expect_near(world.put("b"), Pose::from_xyz_rpy({1, 0, 0}, {0, 0, 0}));
  }
}

// Before SDF 1.5 an axis was in the model's frame. By hand: the joint's frame is turned by a
// quarter about x, so that the model's y is the joint's -z, and its z the joint's y.
TEST(WorldTextTest, AxesMeanTheSameInAFileOfAnotherVersion) {
  const auto arm = [](const std::string& version, const std::string& axis) {
    return "<sdf version='" + version +
           "'><model name='m'><static>0</static><link name='a'/><link name='b'>"
           "<pose>0 0 1 1.5707963267948966 0 0</pose></link><joint name='j' type='revolute'>"
           "<parent>a</parent><child>b</child>" +
           axis + "</joint></model></sdf>";
  };
  struct Case {
    std::string file, text, axis;
    Vec3 in_joint;
  };
  for (const Case& each : std::vector<Case>{
           {"1.9", "1.4", "<axis><xyz>0 1 0</xyz></axis>", {0, 0, -1}},
           {"1.9", "1.4", "<axis><limit><lower>0</lower></limit></axis>", {0, 1, 0}},
           {"1.9", "1.4", "<axis/>", {0, 1, 0}},
           {"1.9", "1.6", "<axis><xyz>0 1 0</xyz></axis>", {0, 1, 0}},
           {"1.4", "1.9", "<axis><xyz>0 1 0</xyz></axis>", {0, 1, 0}},
           {"1.4",
            "1.6",
            "<axis><xyz>0 1 0</xyz><use_parent_model_frame>1</use_parent_model_frame></axis>",
            {0, 0, -1}},
           {"1.4", "1.4", "<axis><xyz>0 1 0</xyz></axis>", {0, 0, -1}}}) {
    Text world(box("a", ""), each.file);
    world.models.push_back({"arm", Pose(), arm(each.text, each.axis), true});
    const auto again = load_world_text(world.saved(), kWorlds + "w.sdf");
    const Model& model = *again->models.back().model;
    ASSERT_EQ(model.joints.size(), 1u);
    EXPECT_LT((model.joints[ModelJointIndex(0)].axis.axis_in_J - each.in_joint).norm(), 1e-9)
        << each.file << " " << each.text << " " << each.axis;
  }
}

TEST(WorldTextTest, AUrdfThatWasSpawnedIsWrittenAsSdf) {
  Text world(box("a", ""));
  world.models.push_back({"u", Pose::from_xyz_rpy({4, 0, 0}, {0, 0, 0}),
                          "<robot name='r'><link name='l'><inertial><mass value='2'/><inertia "
                          "ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/></inertial>"
                          "</link></robot>",
                          true});
  expect_near(world.put("u"), Pose::from_xyz_rpy({4, 0, 0}, {0, 0, 0}));
}

TEST(WorldTextTest, ARemovedAndRestoredModelIsUnchanged) {
  Text world(box("a", "      <pose>1 2 3 0 0 0</pose>\n") +
             "    <include><uri>model://p3dx</uri></include>\n");
  for (const char* name : {"a", "p3dx"}) {
    named(world.models, name).spawned = world.places().model_text(name);
    named(world.models, name).put = true;
  }
  EXPECT_EQ(world.saved(), world.text());
}

TEST(WorldTextTest, MovingAModelsFrameMovesNoOtherModel) {
  Text world(box("table", "      <pose>5 0 0 0 0 0</pose>\n") +
             "    <frame name=\"top\" attached_to=\"table\"><pose>0 0 1 0 0 0</pose></frame>\n" +
             box("cup", "      <pose relative_to=\"top\">0.1 0 0 0 0 0</pose>\n") +
             box("far", "      <pose relative_to=\"world\">9 0 0 0 0 0</pose>\n"));
  named(world.models, "table").X_WM.translation.x() = 6;
  expect_near(world.put("cup"), Pose::from_xyz_rpy({5.1, 0, 1}, {0, 0, 0}));
  EXPECT_THAT(world.saved(), HasSubstr("<pose relative_to=\"world\">9 0 0 0 0 0</pose>"));
  EXPECT_THAT(world.saved(), Not(HasSubstr("relative_to=\"top\"")));
}

TEST(WorldTextTest, ASavedStateOfAMovedModelIsDropped) {
  Text world(
      box("a", "") + box("b", "") +
      "    <state world_name=\"w\">\n      <model name=\"a\"><pose>1 1 0 0 0 0</pose></model>\n"
      "      <model name=\"b\"><pose>2 2 0 0 0 0</pose></model>\n    </state>\n");
  named(world.models, "a").X_WM.translation.x() = 3;
  expect_near(world.put("a"), Pose::from_xyz_rpy({3, 1, 0}, {0, 0, 0}));
  expect_near(world.put("b"), Pose::from_xyz_rpy({2, 2, 0}, {0, 0, 0}));
}

TEST(WorldTextTest, ReportsPosesThatTheFileCannotHold) {
  Text world(box("a", "") +
             "    <ruedo:fleet name=\"r\"><include><uri>model://p3dx</uri></include>"
             "<ruedo:count>3</ruedo:count></ruedo:fleet>\n");
  EXPECT_TRUE(world.places().with(world.models).left_out.empty());
  named(world.models, "r_2").X_WM.translation.x() += 1;
  const WorldText::Written written = world.places().with(world.models);
  EXPECT_EQ(written.text, world.text());
  ASSERT_EQ(written.left_out.size(), 1u);
  EXPECT_THAT(written.left_out[0], HasSubstr("'r_2'"));
}

// Files below a folder of this test's own.
std::filesystem::path folder_with(const std::string& name, const std::vector<std::string>& files) {
  const auto folder = std::filesystem::canonical(testing::TempDir()) / name;
  std::filesystem::remove_all(folder);
  for (const std::string& file : files) {
    std::filesystem::create_directories((folder / file).parent_path());
    std::ofstream(folder / file) << "x";
  }
  return folder;
}

TEST(WorldTextTest, PathsLeadToTheSameFilesFromAnotherFolder) {
  const auto folder =
      folder_with("moved", {"worlds/a/m.dae", "worlds/a/t.png", "worlds/models/box/model.sdf",
                            "worlds/models/desk/model.sdf", "models/cup/model.sdf",
                            "worlds/rock.png", "other/README"});
  const auto sdf = [](const std::string& mesh, const std::string& box, const std::string& desk,
                      const std::string& rock) {
    return "<sdf><uri>" + mesh + "</uri><uri>" + box + "</uri><uri>" + desk +
           "</uri><texture><diffuse>" + rock +
           "</diffuse></texture><material><diffuse>1 0 0 1</diffuse></material>"
           "<uri>model://p3dx</uri><uri>model://cup</uri><uri>no/such</uri></sdf>";
  };
  const std::string from = folder / "worlds/w.sdf";
  const std::string text = sdf("a/m.dae", "model://box", "model://desk", "rock.png");
  // Ruedo has a desk, too; cups are in a folder that both search.
  const Moved beside = moved_to(text, from, folder / "other/w.sdf");
  EXPECT_EQ(beside.text, sdf("../worlds/a/m.dae", "../worlds/models/box", "../worlds/models/desk",
                             "../worlds/rock.png"));
  EXPECT_TRUE(beside.out_of_reach.empty());
  EXPECT_EQ(moved_to(text, from, folder / "other/../worlds/v.sdf").text, text);
}

TEST(WorldTextTest, SaysWhichFoldersAWorldElsewhereDoesNotFind) {
  const auto folder = folder_with("far", {"one/worlds/a/m.dae", "one/worlds/models/box/model.sdf"});
  const Moved moved =
      moved_to("<sdf><uri>a/m.dae</uri><uri>model://box</uri><uri>model://p3dx</uri></sdf>",
               folder / "one/worlds/w.sdf", folder / "two/worlds/w.sdf");
  EXPECT_EQ(moved.out_of_reach,
            (std::set<std::string>{folder / "one/worlds/a", folder / "one/worlds/models"}));
}

TEST(WorldTextTest, PathsMayHoldCharactersThatXmlEscapes) {
  const auto folder = folder_with("escaped", {"a & <b>/c & d.dae"});
  EXPECT_EQ(
      moved_to("<sdf><uri> c &amp; d.dae\n</uri></sdf>", folder / "a & <b>/w.sdf", folder / "w.sdf")
          .text,
      "<sdf><uri>a &amp; &lt;b&gt;/c &amp; d.dae</uri></sdf>");
}

TEST(WorldTextTest, ARobotStandsOnAFloorThatReadsBack) {
  const auto world = load_world(kWorlds + "robots/p3dx/model.sdf");
  const std::string text = world_text_of(*world);
  const auto again = load_world_text(text, kWorlds + "robots/p3dx/w.sdf");
  ASSERT_EQ(again->models.size(), 2u);
  EXPECT_EQ(again->models[1].name, world->models[1].name);
  expect_near(again->models[1].X_WM, world->models[1].X_WM);
  EXPECT_EQ(WorldText(text, *world).with(as_loaded(*world)).text, text);
}

}  // namespace
}  // namespace ruedo::world
