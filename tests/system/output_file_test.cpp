// Files that are written whole or not at all.
#include "system/output_file.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "ruedo/errors.h"
#include "system/file_handle.h"

namespace fs = std::filesystem;

namespace ruedo {
namespace {

class OutputFileTest : public testing::Test {
 protected:
  OutputFileTest() {
    std::string name = (fs::temp_directory_path() / "ruedo_output_XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
  }
  ~OutputFileTest() override { fs::remove_all(folder_); }

  std::string path() const { return folder_ / "file"; }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& each : fs::directory_iterator(folder_)) all.push_back(each.path().filename());
    return all;
  }
  std::string text() const {
    std::ifstream file(path());
    return {std::istreambuf_iterator<char>(file), {}};
  }

  fs::path folder_;
};

TEST_F(OutputFileTest, GetsItsNameWhenComplete) {
  for (const std::string words : {"one", "another"}) {
    OutputFile file(path());
    const std::string before = text();
    file.write(words);
    EXPECT_EQ(text(), before);
    file.keep();
    EXPECT_EQ(text(), words);
  }
  EXPECT_EQ(names(), std::vector<std::string>{"file"});
}

TEST_F(OutputFileTest, IsWrittenByAnotherProgram) {
  OutputFile file(path());
  const pid_t child = ::fork();
  if (child == 0) {
    std::ofstream(file.part()) << "by a child";
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  file.keep();
  EXPECT_EQ(text(), "by a child");
}

TEST_F(OutputFileTest, LeavesTheOldFileUnlessKept) {
  write_file(path(), "earlier");
  {
    OutputFile(path()).write("half");
  }
  EXPECT_EQ(text(), "earlier");
  EXPECT_EQ(names(), std::vector<std::string>{"file"});
}

TEST_F(OutputFileTest, LeavesTheOldFileWhenItsProcessIsKilled) {
  if (const FileHandle file(::open(folder_.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666)); !file)
    GTEST_SKIP() << "the file system of " << folder_ << " has no files without a name";
  write_file(path(), "earlier");
  const pid_t child = ::fork();
  if (child == 0) {
    OutputFile file(path());
    file.write(std::string(1'000'000, '.'));
    std::raise(SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(text(), "earlier");
  EXPECT_EQ(names(), std::vector<std::string>{"file"});
}

TEST_F(OutputFileTest, KeepsThePermissionsAndTheLinkOfTheOldFile) {
  write_file(path(), "earlier");
  fs::permissions(path(), fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("file", folder_ / "link");
  write_file((folder_ / "link").string(), "later");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(text(), "later");
  EXPECT_EQ(fs::status(path()).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(OutputFileTest, CreatesTheTargetOfADanglingLink) {
  fs::create_symlink("file", folder_ / "link");
  write_file((folder_ / "link").string(), "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(text(), "new");
  fs::create_symlink("loop", folder_ / "loop");
  EXPECT_THROW(write_file((folder_ / "loop").string(), "new"), EnvironmentError);
}

// Killed in a container, where the next process has its number.
TEST_F(OutputFileTest, IgnoresAnOldPartFile) {
  const std::string left = path() + ".part" + std::to_string(::getpid());
  std::ofstream(left) << "left";
  write_file(path(), "new");
  EXPECT_EQ(text(), "new");
  EXPECT_TRUE(fs::exists(left));
}

TEST_F(OutputFileTest, AppendsAtADescriptorsPosition) {
  const FileHandle file(::open(path().c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666));
  ASSERT_EQ(write_all(file.get(), "before ", 7), 7U);
  write_file("/dev/fd/" + std::to_string(file.get()), "it ");
  ASSERT_EQ(write_all(file.get(), "after", 5), 5U);
  EXPECT_EQ(text(), "before it after");
  EXPECT_EQ(names(), std::vector<std::string>{"file"});
}

TEST_F(OutputFileTest, ReportsAFileThatCannotBeWritten) {
  try {
    const OutputFile file((folder_ / "none" / "file").string());
    FAIL() << "it was opened";
  } catch (const EnvironmentError& error) {
    EXPECT_EQ(std::string(error.what()),
              folder_.string() + "/none/file cannot be written: No such file or directory");
  }
}

}  // namespace
}  // namespace ruedo
