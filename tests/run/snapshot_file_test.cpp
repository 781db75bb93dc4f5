// Files of snapshots on a disk that is full.
#include <algorithm>
#include <csignal>
#include <filesystem>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "run/journal.h"

namespace fs = std::filesystem;

namespace ruedo::run {
namespace {

// Files of this process get no larger, as on a full disk.
class FileLimit {
 public:
  explicit FileLimit(uint64_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST(SnapshotFile, OneThatFailsLeavesNothing) {
  std::string folder = (fs::temp_directory_path() / "ruedo-snapshots-XXXXXX").string();
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  {
    Journal journal(folder);
    journal.begin(log_header_t{}, 0);
    const state_hash_t state{};
    ASSERT_EQ(journal.save_snapshot("good", state, 0), "");
    const uint64_t whole = fs::file_size(folder + "/good.snapshot");
    for (const uint64_t room :
         {whole - 1, whole / 4}) {  // for all but its end; not even for its beginning
      const FileLimit limit(room);
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

}  // namespace
}  // namespace ruedo::run
