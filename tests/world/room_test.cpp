// The cost of finding room: it depends on the things in the world, not on the metres they cover.
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "world/drives/placement.h"
#include "world/load.h"

namespace ruedo::world {
namespace {

std::string box(const std::string& name, const std::string& pose, const std::string& size,
                const std::string& inside = "") {
  return "<model name='" + name + "'><pose>" + pose +
         "</pose><link name='l'><collision name='c'><geometry><box><size>" + size +
         "</size></box></geometry></collision>" + inside + "</link></model>";
}

class Rooms : public testing::Test {
 protected:
  std::shared_ptr<const WorldModel> load(const std::string& models) const {
    return load_world(folder.write(
        "world.sdf", "<sdf version='1.9'><world name='w'>" + models + "</world></sdf>"));
  }
  TemporaryFolder folder;
};

// A search by cells of 2 m took hours for the room of 900 km.
TEST_F(Rooms, OfSomethingHugeIsFoundAtOnce) {
  const auto world =
      load(box("far", "1000 0 0 0 0 0", "1 1 1") + box("high", "0 0 9 0 0 0", "1 1 1"));
  const auto guest = load(box("huge", "0 0 0 0 0 0", "900000 900000 1"));
  const Model& huge = *guest->models[InstanceIndex(0)].model;
  EXPECT_EQ(overlapped(*world, huge, {}), "far");
  EXPECT_EQ(overlapped(*world, huge, {Quat::Identity(), {0, 0, 9}}), "high");
  EXPECT_EQ(overlapped(*world, huge, {Quat::Identity(), {0, 0, 5}}), "");
  EXPECT_DOUBLE_EQ(standing_on(*world, huge, 0, 0, 0).translation.z(), 0.5);
}

// A storey above the ground: a height near one of them selects it.
TEST_F(Rooms, StandOnTheRequestedStorey) {
  const auto fixed = [](const std::string& name, double top) {
    return "<model name='" + name + "'><static>true</static><pose>0 0 " +
           std::to_string(top - 0.1) +
           " 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>9 9 0.2</size>"
           "</box></geometry></collision></link></model>";
  };
  const auto world = load(fixed("cellar", -2.5) + fixed("ground", 0) + fixed("upstairs", 3));
  const auto guest = load(box("bot", "0 0 0 0 0 0", "0.6 0.8 0.4"));
  const Model& bot = *guest->models[InstanceIndex(0)].model;
  const auto height = [&](std::optional<double> near_z) {
    return standing_on(*world, bot, 1, 1, 0, near_z).translation.z() - 0.2;
  };
  EXPECT_NEAR(height({}), -2.5, 1e-9) << "without one, the lowest";
  EXPECT_NEAR(height(0.0), 0, 1e-9);
  EXPECT_NEAR(height(3.02), 3, 1e-9);
  EXPECT_NEAR(height(2.6), 3, 1e-9) << "half a metre off at most";
  EXPECT_NEAR(height(1.5), -2.5, 1e-9) << "nothing is near that";
}

// Storing each of them in every cell that the mesh covers took gigabytes.
TEST_F(Rooms, AmongTrianglesThatCoverTheWholeMesh) {
  constexpr int kTriangles = 100000;
  std::string mesh;
  mesh.reserve(2000000);
  for (int i = 0; i < kTriangles; ++i) {
    const std::string z = std::to_string(-1e-6 * i);
    mesh += "v -10 -10 " + z + "\nv 10 -10 " + z + "\nv 0 10 " + z + "\n";
  }
  for (int corner = 1; corner <= 3 * kTriangles; corner += 3)
    mesh += "f " + std::to_string(corner) + " " + std::to_string(corner + 1) + " " +
            std::to_string(corner + 2) + "\n";
  folder.write("leaves.obj", mesh);
  const auto world = load(
      "<model name='leaves'><static>true</static><link name='l'><collision name='c'><geometry>"
      "<mesh><uri>leaves.obj</uri></mesh></geometry></collision></link></model>");
  const auto guest = load(box("bot", "0 0 0 0 0 0", "0.6 0.8 0.4"));
  const Model& bot = *guest->models[InstanceIndex(0)].model;
  EXPECT_NEAR(ground_height(*world, 0, 0), 0, 1e-6);
  EXPECT_NEAR(standing_on(*world, bot, 1, 1, 0.5).translation.z(), 0.2, 1e-6);
  EXPECT_EQ(overlapped(*world, bot, {Quat::Identity(), {0, 0, 0.1}}), "leaves");
}

}  // namespace
}  // namespace ruedo::world
