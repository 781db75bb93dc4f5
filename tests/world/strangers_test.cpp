// The files that the text of a SPAWN request may reach: the world's and the models' folders, and
// nothing else, explicitly or not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "temporary_folder.h"
#include "world/load_model.h"

namespace ruedo::world {
namespace {

namespace fs = std::filesystem;

// The findings and the error of a model that includes, or shows, what the uri names.
std::string told(const std::string& uri, const std::string& world, bool as_mesh) {
  const std::string shape =
      "<collision name='c'><geometry><mesh><uri>" + uri + "</uri></mesh></geometry></collision>";
  const std::string text =
      "<sdf version='1.9'><model name='m'><link name='l'>" + (as_mesh ? shape : "") + "</link>" +
      (as_mesh ? "" : "<include><uri>" + uri + "</uri><name>i</name></include>") + "</model></sdf>";
  std::string all;
  try {
    for (const Finding& finding : load_model_text(text, world).findings) all += finding.text + "\n";
  } catch (const InputError& error) {
    all += error.what();
  }
  return all;
}

TEST(Strangers, ReachTheWorldsFolderAndModelsOnly) {
  const TemporaryFolder folder;
  const std::string good = "<sdf version='1.9'><model name='good'><link name='l'/></model></sdf>",
                    secret = "the words of another";
  const fs::path top = fs::path(std::string(folder / "x")).parent_path();
  for (const char* each : {"home/worlds/models/inside", "home/models/beside", "home/.ssh",
                           "home/worlds/.hidden", "home/other"})
    fs::create_directories(top / each);
  const auto write = [&](const std::string& name, const std::string& text) {
    folder.write(name, text);
  };
  write("home/worlds/w.sdf", "<sdf version='1.9'><world name='w'/></sdf>");
  for (const char* each : {"home/worlds/near.sdf", "home/worlds/models/inside/model.sdf",
                           "home/models/beside/model.sdf"})
    write(each, good);
  for (const char* each : {"home/.ssh/id_rsa", "home/private.sdf", "home/worlds/.hidden/model.sdf",
                           "home/other/model.sdf", "home/worlds/.dot.sdf"})
    write(each, secret);
  fs::create_symlink(top / "home/other/model.sdf", top / "home/worlds/link.sdf");
  fs::create_directories(top / "home/worlds/models/linked");
  fs::create_symlink(top / "home/other/model.sdf", top / "home/worlds/models/linked/model.sdf");
  const std::string world = (top / "home/worlds/w.sdf").string();

  for (const char* uri : {"near.sdf", "model://inside", "model://beside", "../models/beside"})
    EXPECT_EQ(told(uri, world, false), "") << uri;
  for (const std::string uri :
       {"../private.sdf", "../.ssh/id_rsa", ".hidden", ".dot.sdf", "../other", "link.sdf",
        "model://linked", "model://.hidden", "model://../other", "file:///etc/passwd",
        "/etc/passwd", "/etc", "../nothing.sdf"}) {
    for (const bool as_mesh : {false, true}) {
      if (as_mesh && uri == "model://linked") continue;  // a folder, which no mesh is
      const std::string text = told(uri, world, as_mesh);
      EXPECT_THAT(text, testing::HasSubstr("is not found")) << uri;
      EXPECT_THAT(text, testing::Not(testing::HasSubstr("words"))) << uri;
      EXPECT_THAT(text, testing::Not(testing::HasSubstr(top.string()))) << uri;
    }
  }
}

TEST(Strangers, FollowNoLinksOutOfAFolderOfMaterials) {
  const TemporaryFolder folder;
  const std::string scripts = "home/worlds/models/paint/materials/scripts/";
  const std::string world = folder.write("home/worlds/w.sdf", "");
  folder.write(scripts + "own.material",
               "material Own\n{\npass\n{\ndiffuse 1 0 0 1\ntexture out.png\n}\n}\n");
  const std::string secret = "material Theirs\n{\npass\n{\ndiffuse 0 1 0 1\n}\n}\n";
  fs::create_symlink(folder.write("home/other/theirs.material", secret),
                     folder / (scripts + "theirs.material"));
  fs::create_symlink(folder.write("home/other/out.png", "a picture"),
                     folder / (scripts + "out.png"));
  const auto material = [&](const std::string& name) {
    return load_model_text(
               "<sdf version='1.9'><model name='m'><link name='l'><visual name='v'>"
               "<geometry><box/></geometry><material><script><uri>"
               "model://paint/materials/scripts</uri><name>" +
                   name + "</name></script></material></visual></link></model></sdf>",
               world)
        .model->links[0]
        .visuals[0]
        .material;
  };
  const auto own = material("Own");
  ASSERT_TRUE(own);
  EXPECT_EQ(own->diffuse, (Rgba{1, 0, 0, 1}));
  EXPECT_FALSE(own->texture) << own->texture->path;
  const auto theirs = material("Theirs");
  EXPECT_FALSE(theirs && theirs->diffuse == (Rgba{0, 1, 0, 1}));
}

// Nobody reads the server's log for a client.
TEST(Strangers, GiveFiniteNumbers) {
  const auto spawned = [](const std::string& gain) {
    return load_model_text(
        "<sdf version='1.9'><model name='m'><link name='a'/><link name='b'/><joint name='j' "
        "type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>"
        "<plugin name='gz::sim::systems::JointPositionController' filename='f'>\n<joint_name>j"
        "</joint_name><p_gain>" +
            gain + "</p_gain></plugin></model></sdf>",
        "/nowhere/w.sdf");
  };
  EXPECT_EQ(spawned("3").model->joints[0].axis.position_pid.value().p, 3.0);
  const std::pair<std::string, std::string> wrongs[] = {
      {"inf", "is not finite; allowed is a number"},
      {"nan", "is not finite; allowed is a number"},
      {"1e999", "is too large for a number"}};
  for (const auto& [wrong, fault] : wrongs) {
    try {
      spawned(wrong);
      FAIL() << wrong;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()), "the text:2: <p_gain>: '" + wrong + "' " + fault);
    }
  }
  EXPECT_NO_THROW(spawned("much"));  // left out, and told in the server's log
}

TEST(Strangers, GiveFiniteNumbersInUrdf) {
  const std::string fine =
      "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='prismatic'>"
      "<parent link='a'/><child link='b'/><origin xyz='0 0 1' rpy='0 0 0'/><axis xyz='1 0 0'/>"
      "<limit lower='-2' upper='3' effort='4' velocity='5'/></joint></robot>";
  EXPECT_NO_THROW(load_model_text(fine, "/nowhere/w.sdf"));
  for (const char* where : {"0 0 1", "0 0 0", "1 0 0", "-2", "3", "4", "5"}) {
    for (const char* number : {"nan", "-inf", "1e999"}) {
      std::string wrong = fine;
      const std::string value = "'" + std::string(where) + "'";
      std::string instead = value;
      instead.replace(1, instead.find_first_of(" '", 1) - 1, number);
      wrong.replace(wrong.find(value), value.size(), instead);
      try {
        load_model_text(wrong, "/nowhere/w.sdf");
        FAIL() << wrong;
      } catch (const InputError& error) {  // nothing was taken instead
        EXPECT_EQ(std::string(error.what()).find(';'), std::string::npos) << error.what();
      }
    }
  }
}

TEST(Names, ThatTwoModelsShareAreFound) {
  const auto model = [](std::vector<std::string> links) {
    auto made = std::make_shared<Model>();
    for (std::string& name : links) {
      made->links.emplace_back();
      made->links.back().name = std::move(name);
    }
    return made;
  };
  const ModelInstance x{"x", {}, model({"l", "y"})}, xy{"x/y", {}, model({"z"})},
      xyz{"x/y/z", {}, model({"q"})}, deep{"x", {}, model({"y/z"})}, xl{"xl", {}, model({"y"})};
  EXPECT_EQ(shared_path(x, xy), "x/y");
  EXPECT_EQ(shared_path(xy, x), "x/y");
  EXPECT_EQ(shared_path(xy, xyz), "x/y/z");
  EXPECT_EQ(shared_path(deep, xy), "x/y/z");
  EXPECT_EQ(shared_path(x, xyz), "");
  EXPECT_EQ(shared_path(x, xl), "");
  WorldModel world;
  world.models.push_back(xyz);
  world.models.push_back(xy);
  world.models.push_back(x);
  Findings findings;
  name_shared_paths(world, findings);
  ASSERT_EQ(findings.list().size(), 2u);
  EXPECT_EQ(findings.list()[0].text,
            "'x/y/z' is a link of the model 'x/y', too; a request for it reads one of the two");
}

TEST(Strangers, TextsHaveNoFolder) {
  const TemporaryFolder folder;
  const LoadedModel loaded = load_model_text(
      "<sdf version='1.9'><model name='m'><link name='l'/>\n<nonsense/></model></sdf>",
      folder.write("w.sdf", ""));
  ASSERT_EQ(loaded.findings.size(), 1u);
  EXPECT_EQ(loaded.findings[0].source.str(), "the text:2");
}

// A world's robots find unnamed files beside them, a SPAWN's in the world's folder only.
TEST(Strangers, HaveNoControllersFromElsewhere) {
  const TemporaryFolder folder;
  const std::string gains =
      "/gazebo_ros_control: {pid_gains: {arm: {p: 77.0}}}  # of a controller\n";
  const std::string robot =
      "<robot name='r'><link name='a'/><link name='b'/><joint name='arm' type='continuous'><parent "
      "link='a'/><child link='b'/></joint><transmission name='t'><joint name='arm'>"
      "<hardwareInterface>hardware_interface/PositionJointInterface</hardwareInterface></joint>"
      "</transmission></robot>";
  folder.write("home/config/above.yaml", gains);
  const std::string world = folder.write("home/worlds/w.sdf", "");
  const auto held = [&] {
    const LoadedModel loaded = load_model_text(robot, world);
    return loaded.model->joints[0].axis.position_pid.has_value();
  };
  EXPECT_FALSE(held());
  const std::string outside = folder.write("home/other/c.yaml", gains);
  fs::create_directories(folder / "home/worlds/config");
  fs::create_symlink(outside, folder / "home/worlds/config/link.yaml");
  EXPECT_FALSE(held());
  folder.write("home/worlds/config/near.yaml", gains);
  EXPECT_TRUE(held());
}

}  // namespace
}  // namespace ruedo::world
