// Names and places of models that come and go.
#include "engine/edits/world_editor.h"

#include <gtest/gtest.h>

#include "engine/edits/edits.h"

namespace ruedo::engine {
namespace {

std::shared_ptr<const world::Model> made() { return std::make_shared<world::Model>(); }

world::WorldModel with(const std::vector<std::string>& names) {
  world::WorldModel world;
  for (const std::string& name : names) world.models.push_back({name, Pose{}, made()});
  return world;
}

TEST(WorldEditor, FindsTheFirstUnusedName) {
  EXPECT_EQ(unused_name(with({}), "cart"), "cart");
  EXPECT_EQ(unused_name(with({"cart"}), "cart"), "cart_2");
  EXPECT_EQ(unused_name(with({"cart", "cart_2", "cart_4"}), "cart"), "cart_3");
  EXPECT_EQ(unused_name(with({"cart", "cart_3"}), "cart"), "cart_2");
  // Not part of that series: 0 and 1, what is not a number, and numbers in another notation.
  EXPECT_EQ(unused_name(with({"cart", "cart_0", "cart_1", "cart_x", "cart_", "cart_02", "cart_2x",
                              "cart_-2", "carts_2"}),
                        "cart"),
            "cart_2");
  EXPECT_EQ(unused_name(with({"cart", "cart_99999999999999999999"}), "cart"), "cart_2");
}

TEST(WorldEditor, NamesOfTheRemovedAreFree) {
  world::WorldModel world = with({"cart", "cart_2"});
  WorldEditor(world).remove(InstanceIndex(0));
  EXPECT_EQ(find_model(world, "cart"), -1);
  EXPECT_EQ(find_model(world, "cart_2"), 1);
  EXPECT_EQ(unused_name(world, "cart"), "cart");
}

TEST(WorldEditor, PlacesAModelWhereOneOfItsKindWas) {
  world::WorldModel world = with({"a", "b", "c"});
  WorldEditor editor(world);
  const auto model = world.models[1].model;
  editor.remove(InstanceIndex(1));
  const WorldEditor::Placed other = editor.place("d", Pose{}, made());
  EXPECT_EQ(other.instance, 3);
  EXPECT_FALSE(other.reused);
  const Pose X_WM{Quat::Identity(), Vec3(1, 2, 3)};
  const WorldEditor::Placed same = editor.place("e", X_WM, model);
  EXPECT_EQ(same.instance, 1);
  EXPECT_TRUE(same.reused);
  EXPECT_EQ(world.models[1].name, "e");
  EXPECT_FALSE(world.models[1].removed);
  EXPECT_EQ(world.models[1].X_WM.translation, Vec3(1, 2, 3));
  EXPECT_EQ(editor.place("f", Pose{}, model).instance, 4);  // its place is occupied
}

TEST(WorldEditor, SpawnsAtTheRequestedPose) {
  spawn_request_t request{};
  request.position[0] = 1.0;
  request.position[2] = 0.5;
  request.orientation[0] = 1.0005;  // as good as a unit quaternion
  const Pose X_WM = spawn_pose(world::WorldModel{}, world::Model{}, request);
  EXPECT_EQ(X_WM.translation, Vec3(1.0, 0.0, 0.5));
  EXPECT_EQ(X_WM.rotation.w(), 1.0);
}

}  // namespace
}  // namespace ruedo::engine
