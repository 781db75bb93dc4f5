// Files of snapshots on a disk that is full.
#include <algorithm>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "full_disk.h"
#include "run/journal.h"

namespace fs = std::filesystem;

namespace ruedo::run {
namespace {

TEST(SnapshotFile, AFailedWriteLeavesNoFile) {
  std::string folder = (fs::temp_directory_path() / "ruedo-snapshots-XXXXXX").string();
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  {
    Journal journal(folder);
    journal.begin(log_header_t{}, 0);
    const state_hash_t state{};
    ASSERT_EQ(journal.save_snapshot("good", state, 0), "");
    const uint64_t whole = fs::file_size(folder + "/good.snapshot");
    for (uint64_t room = 0; room < whole; ++room) {
      const FullDisk disk(room);
      EXPECT_NE(journal.save_snapshot("bad", state, 0), "") << room;
    }
    ASSERT_EQ(journal.save_snapshot("again", state, 0), "");
  }
  std::vector<std::string> left;
  for (const auto& entry : fs::directory_iterator(folder))
    left.push_back(entry.path().filename().string());
  std::sort(left.begin(), left.end());
  EXPECT_EQ(left, (std::vector<std::string>{"again.snapshot", "good.snapshot"}));
  fs::remove_all(folder);
}

// Of a long journal, a thousand would fill most disks.
TEST(SnapshotFile, AFolderTakesSoMuch) {
  std::string folder = (fs::temp_directory_path() / "ruedo-snapshots-XXXXXX").string();
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  Journal journal(folder);
  journal.begin(log_header_t{}, 0);
  const state_hash_t state{};
  ASSERT_EQ(journal.save_snapshot("one", state, 0), "");
  std::ofstream(folder + "/large.snapshot").close();
  fs::resize_file(folder + "/large.snapshot", Journal::kMostBytes);  // a hole
  EXPECT_EQ(journal.save_snapshot("two", state, 0)
                .rfind("with this one the folder's snapshots would hold 10000000", 0),
            0u);
  fs::remove(folder + "/large.snapshot");
  EXPECT_EQ(journal.save_snapshot("two", state, 0), "");
  fs::remove_all(folder);
}

}  // namespace
}  // namespace ruedo::run
