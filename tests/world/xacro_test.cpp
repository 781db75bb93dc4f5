// xacro files: expanded without ROS, keeping the lines in which things were written.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "system/file_handle.h"
#include "temporary_folder.h"
#include "text_world.h"
#include "world/load.h"
#include "world/load_model.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const char* const kBase = R"xml(<robot name="bot" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="mass" default="2"/>
<xacro:property name="half" value="${0.5 * pi / pi}"/>
<xacro:include filename="$(find parts)/urdf/box.xacro"/>
<link name="base"><inertial><mass value="$(arg mass)"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<xacro:if value="${half == 0.5}"><xacro:box name="left" size="${2 * half}"/></xacro:if>
</robot>)xml";
const char* const kPart = R"xml(<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:macro name="box" params="name size">
<link name="${name}_box"><collision><geometry><box size="${size} 1 1"/></geometry></collision></link>
<joint name="${name}_joint" type="fixed"><parent link="base"/><child link="${name}_box"/></joint>
</xacro:macro></robot>)xml";

struct Packages {
  TemporaryFolder folder;
  Packages() {
    folder.write(
        "somewhere/package.xml",
        "<package format='3'><name>parts</name></package>");  // the folder's name is another
    folder.write("somewhere/urdf/box.xacro", kPart);
    folder.write("bot/package.xml", "<package><name>bot</name></package>");
  }
};

TEST(Xacro, IsExpandedWithArgumentsAndPackages) {
  const Packages packages;
  LoadOptions options;
  options.xacro_arguments = {"mass:=3.5"};
  const auto world = load_world(packages.folder.write("bot/urdf/bot.urdf.xacro", kBase), options);
  const Model& model = *world->models.back().model;
  EXPECT_EQ(model.name, "bot");
  EXPECT_EQ(link_of(model, "base").inertial.mass, 3.5);
  EXPECT_EQ(link_of(model, "left_box").collisions.at(0).geometry.size.x(), 1.0);
  EXPECT_EQ(link_of(model, "left_box").source.str(),
            packages.folder / "somewhere/urdf/box.xacro:3");
  EXPECT_EQ(link_of(model, "base").source.line, 5);
  // The header of a log has to list all of them.
  EXPECT_THAT(world->files_read,
              testing::IsSupersetOf({packages.folder / "bot/urdf/bot.urdf.xacro",
                                     packages.folder / "somewhere/urdf/box.xacro"}));
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
}

// A description that was copied without its package.xml.
TEST(Xacro, FindsAPackageByTheNameOfAFolderAbove) {
  const TemporaryFolder folder;
  folder.write("parts/urdf/box.xacro", kPart);
  const auto world = load_world(folder.write("parts/robots/bot.urdf.xacro", kBase));
  EXPECT_EQ(link_of(*world->models.back().model, "left_box").source.str(),
            folder / "parts/urdf/box.xacro:3");
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
}

TEST(Xacro, IsKnownByItsElementsToo) {
  const Packages packages;
  packages.folder.write("bot/bot.urdf", kBase);
  const auto world = load_world(packages.folder.write(
      "bot/w.sdf",
      "<sdf version='1.9'><world name='w'><include><uri>bot.urdf</uri></include></world></sdf>"));
  EXPECT_EQ(world->models.at(0).model->links.size(), 2u);
}

// Packages of an installed ROS do not hide those of the next folder.
TEST(Xacro, FindsPackagesBehindManyOthers) {
  const TemporaryFolder folder;
  for (int i = 0; i < 300; ++i) {
    const std::string name = "p" + std::to_string(i), package = "share/" + name;
    folder.write(package + "/package.xml", "<package><name>" + name + "</name></package>");
    for (const char* inside : {"a", "b", "c", "d", "e", "f"})
      std::filesystem::create_directory(folder / (package + "/" + inside));
  }
  folder.write("src/parts/package.xml", "<package><name>parts</name></package>");
  folder.write("src/parts/urdf/box.xacro", kPart);
  setenv("ROS_PACKAGE_PATH", ((folder / "share") + ":" + (folder / "src")).c_str(), 1);
  const auto world = load_world(folder.write("a/b/c/bot.xacro", kBase));
  unsetenv("ROS_PACKAGE_PATH");
  EXPECT_EQ(world->models.back().model->links.size(), 2u);
}

TEST(Xacro, SkipsAMissingInclude) {
  const Packages packages;
  const auto world = load_world(
      packages.folder.write("bot/bot.xacro",
                            "<robot name='b' xmlns:xacro='x'><xacro:include filename='$(find "
                            "nowhere)/x.xacro'/><link name='l'/></robot>"));
  EXPECT_THAT(texts(*world),
              ElementsAre("the include '$(find nowhere)/x.xacro' is not found; it is passed over"));
}

// Nobody has a folder with the name that replaces a missing package.
TEST(Xacro, ReportsFilesOfMissingPackagesAsWritten) {
  const Packages packages;
  const auto world = load_world(packages.folder.write(
      "bot/bot.xacro",
      "<robot name='b' xmlns:xacro='x'><link name='l'><visual><geometry><mesh "
      "filename='file://$(find nowhere)/m.stl'/></geometry></visual></link><gazebo><plugin "
      "name='c' filename='libgz_ros2_control-system.so'><parameters>$(find nowhere)/c.yaml"
      "</parameters></plugin></gazebo></robot>"));
  EXPECT_THAT(texts(*world),
              testing::UnorderedElementsAre(
                  "the mesh 'package://nowhere/m.stl' is not found; the shape is left out",
                  "the controllers' file 'package://nowhere/c.yaml' is not found"));
}

TEST(Xacro, ReportsErrorsInOneLine) {
  const Packages packages;
  const auto error_of = [&](const std::string& text) {
    try {
      load_world(packages.folder.write("bot/bad.xacro", text));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string head = "<robot name='b' xmlns:xacro='x'>";
  EXPECT_THAT(error_of(head + "<link name='${nothing}'/></robot>"),
              testing::AllOf(HasSubstr("bad.xacro: the xacro file cannot be expanded: "),
                             HasSubstr("'nothing' is not defined")));
  EXPECT_THAT(error_of(head + "<xacro:unknown/></robot>"),
              HasSubstr("unknown macro name: xacro:unknown"));
  EXPECT_THAT(error_of(head + "<link name='${range(1)[7]}'/></robot>"),
              testing::AllOf(HasSubstr("index out of range"), testing::Not(HasSubstr("warning"))));
  EXPECT_THAT(error_of(head + "<link"), HasSubstr("not XML"));
  EXPECT_THAT(error_of("<robot xmlns:xacro='x'><xacro:macro name='m' params=''><link name='l'/>"
                       "</xacro:macro></robot>"),
              HasSubstr("a file of xacro macros alone is for others to include"));
}

// xacro's check for odd names does not look into functions: this is Python's module os, or another.
std::string robot_of(const std::string& expression) {
  return "<robot name='b' xmlns:xacro='x'><xacro:property name='os' value=\"${(lambda: "
         "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == "
         "'_wrap_close'][0].__init__.__globals__)()}\"/>\n"
         "<xacro:property name='load' value=\"${(lambda: os['__builtins__']['__import__'])()}\"/>\n"
         "<link name=\"l${" +
         expression + "}\"/></robot>";
}

TEST(Xacro, UntrustedExpressionsReachNothing) {
  const TemporaryFolder folder, elsewhere;
  const std::string secret = elsewhere.write("secret.yaml", "word: hunter2");
  const std::string own = folder.write("bot/urdf/own.txt", "own");
  const auto error_of = [&](const std::string& expression) {
    try {
      load_world(folder.write("bot/urdf/bot.xacro", robot_of(expression)));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(error_of("len(os['listdir']('" + (folder / "bot/urdf") + "'))"), "");
  EXPECT_EQ(error_of("load('yaml').dump(1)"), "");
  for (const std::string& path : {secret, std::string("/etc/passwd")}) {
    EXPECT_THAT(error_of("os['open']('" + path + "', 0)"), HasSubstr("Permission denied")) << path;
    EXPECT_THAT(error_of("xacro.load_yaml('" + path + "')"), HasSubstr("Permission denied"));
  }
  const FileHandle left_open(::open(secret.c_str(), O_RDONLY)), high(::dup2(left_open.get(), 200));
  EXPECT_THAT(error_of("os['fstat'](200)"), HasSubstr("Bad file descriptor"));
  EXPECT_THAT(error_of("os['open']('" + (folder / "bot/urdf/new.txt") + "', 65)"),
              HasSubstr("Permission denied"));
  EXPECT_THAT(error_of("os['open']('" + own + "', 1)"), HasSubstr("Permission denied"));
  EXPECT_THAT(error_of("os['remove']('" + own + "')"), HasSubstr("Permission denied"));
  for (const std::string& call :
       {std::string("os['chmod']('" + own + "', 0)"), std::string("os['utime']('" + own + "')"),
        std::string("os['fork']()"), std::string("os['kill'](os['getppid'](), 0)"),
        std::string("load('socket').socket()"),
        std::string("load('fcntl').ioctl(1, load('termios').TIOCSTI, b'x')")})
    EXPECT_THAT(error_of(call), HasSubstr("Operation not permitted")) << call;
  EXPECT_EQ(error_of("os['system']('true') == 0 and 1 / 0"), "") << "a program was run";
}

// A hash of it would be in each log.
TEST(Xacro, NamesOnlyFilesThatItMayRead) {
  const TemporaryFolder folder, elsewhere;
  const std::string secret = elsewhere.write("secret.yaml", "word: hunter2");
  const auto world = load_world(folder.write(
      "bot/urdf/bot.xacro", robot_of("os['write'](3, b'read\\t" + secret + "\\n') and 0")));
  EXPECT_THAT(world->files_read, testing::Not(testing::Contains(secret)));
}

// Text that comes with a request is never executed; only files on the disk are.
TEST(Xacro, OfATextIsRefused) {
  const Packages packages;
  EXPECT_THROW(load_model_text(kBase, packages.folder.write("bot/w.sdf", "")), InputError);
}

}  // namespace
}  // namespace ruedo::world
