// A state as bytes: what is written is read, and what is cut off is refused.
#include <gtest/gtest.h>

#include "ruedo/state_archive.h"

namespace ruedo {
namespace {

struct Inner {
  Vec3 p = Vec3::Zero();
  std::vector<std::pair<BodyIndex, double>> work;
  void exchange(StateArchive& archive) { archive(p, work); }
};

struct Kept {
  int64_t time = 0;
  bool on = false;
  std::optional<SimTime> since;
  std::vector<Inner> inner;
  IndexedVector<BodyIndex, Pose> poses{2};
  std::string name;
  std::set<std::string> names;
  Snapshot state;
  void exchange(StateArchive& archive) {
    archive(time, on, since, inner, name, names, state);
    archive.each(poses);
  }
};

Kept example() {
  Kept kept;
  kept.time = -7;
  kept.on = true;
  kept.since = 12;
  kept.inner = {{Vec3(1, 2, 3), {{BodyIndex(4), 0.5}}}, {}};
  kept.poses[BodyIndex(1)] = Pose::from_xyz_rpy({1, 0, 0}, {0, 0, 1});
  kept.name = "a name";
  kept.names = {"one", "two"};
  kept.state.step = 9;
  kept.state.contacts.moving().resize(3);
  kept.state.robots.resize(1);
  return kept;
}

std::vector<uint8_t> written(Kept kept) {
  StateArchive archive;
  archive(kept);
  return archive.written();
}

TEST(StateArchive, ReadsBackWrittenValues) {
  const std::vector<uint8_t> bytes = written(example());
  StateArchive archive(bytes);
  Kept kept;
  kept.names = {"others"};
  archive(kept);
  EXPECT_TRUE(archive.at_end());
  EXPECT_EQ(kept.since, 12);
  EXPECT_EQ(kept.inner.at(0).work.at(0).first, BodyIndex(4));
  EXPECT_EQ(kept.names, (std::set<std::string>{"one", "two"}));
  EXPECT_EQ(kept.state.contacts.size(), 3u);
  EXPECT_EQ(kept.time, -7);
  EXPECT_TRUE(kept.on);
  EXPECT_EQ(kept.inner.at(0).p, Vec3(1, 2, 3));
  EXPECT_EQ(kept.inner.at(0).work.at(0).second, 0.5);
  EXPECT_EQ(kept.inner.size(), 2u);
  const Pose pose = example().poses[BodyIndex(1)];
  EXPECT_EQ(kept.poses[BodyIndex(1)].translation, pose.translation);
  EXPECT_EQ(kept.poses[BodyIndex(1)].rotation.coeffs(), pose.rotation.coeffs());
  EXPECT_EQ(kept.name, "a name");
  EXPECT_EQ(kept.state.step, 9);
  EXPECT_EQ(kept.state.robots.size(), 1u);
  // Not the bytes written once more: those between the members of a struct are anything.
}

TEST(StateArchive, RefusesTruncatedData) {
  const std::vector<uint8_t> bytes = written(example());
  for (size_t size = 0; size < bytes.size(); ++size) {
    const std::span<const uint8_t> all(bytes);
    StateArchive archive(all.first(size));
    Kept kept;
    EXPECT_THROW(archive(kept), ArchiveError) << size;
  }
}

TEST(StateArchive, RefusesAListThatHasAnotherLength) {
  const std::vector<uint8_t> bytes = written(example());
  StateArchive archive(bytes);
  Kept kept;
  kept.poses.resize(3);
  EXPECT_THROW(archive(kept), ArchiveError);
}

TEST(StateArchive, RefusesAListThatIsLongerThanTheRest) {
  const std::vector<uint8_t> bytes(16, 0xff);
  StateArchive archive(bytes);
  std::vector<double> list;
  EXPECT_THROW(archive(list), ArchiveError);
  EXPECT_TRUE(list.empty());
}

}  // namespace
}  // namespace ruedo
