// The user's key: with it a user recognises his own files, and no others.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "system/seal.h"

namespace ruedo {
namespace {

namespace fs = std::filesystem;

class SealTest : public testing::Test {
 protected:
  SealTest() {
    std::string made = (fs::temp_directory_path() / "ruedo-seal-XXXXXX").string();
    folder_ = ::mkdtemp(made.data());
    use_key("mine");
  }
  ~SealTest() override { fs::remove_all(folder_); }
  void use_key(const std::string& whose) const {
    ::setenv("XDG_STATE_HOME", (folder_ / whose).c_str(), 1);
  }

  fs::path folder_;
  const std::vector<uint8_t> bytes_{1, 2, 3};
};

TEST_F(SealTest, OnlyItsUserVerifiesIt) {
  const auto seal = seal_of(bytes_);
  ASSERT_TRUE(seal);
  EXPECT_TRUE(is_sealed(bytes_, *seal));
  EXPECT_EQ(seal_of(bytes_), seal);
  use_key("another");
  EXPECT_FALSE(is_sealed(bytes_, *seal)) << "there is no key";
  EXPECT_FALSE(fs::exists(folder_ / "another")) << "and none is made for it";
  EXPECT_NE(seal_of(bytes_), seal);
  EXPECT_FALSE(is_sealed(bytes_, *seal));
}

TEST_F(SealTest, HoldsForTheseBytes) {
  const auto seal = seal_of(bytes_);
  ASSERT_TRUE(seal);
  EXPECT_FALSE(is_sealed(std::vector<uint8_t>{1, 2}, *seal));
  EXPECT_FALSE(is_sealed(bytes_, std::span<const uint8_t>(*seal).first(31)));
  for (size_t i = 0; i < 8 * seal->size(); ++i) {
    Seal other = *seal;
    other[i / 8] = static_cast<uint8_t>(other[i / 8] ^ 1 << i % 8);
    EXPECT_FALSE(is_sealed(bytes_, other));
  }
}

// RFC 4231, test case 1, of HMAC-SHA256, has a key of 20 bytes; ours are of 32. This is by Python's
// hmac.new(bytes(range(32)), bytes([1, 2, 3]), "sha256").
TEST_F(SealTest, IsAnHmacOfSha256) {
  ASSERT_TRUE(seal_of(bytes_));
  const fs::path path = folder_ / "mine/ruedo/key";
  std::string key(32, '\0');
  for (size_t i = 0; i < key.size(); ++i) key[i] = static_cast<char>(i);
  std::ofstream(path, std::ios::binary) << key;
  const auto seal = seal_of(bytes_);
  ASSERT_TRUE(seal);
  std::string hex;
  for (const uint8_t byte : *seal) {
    hex += "0123456789abcdef"[byte >> 4];
    hex += "0123456789abcdef"[byte & 15];
  }
  EXPECT_EQ(hex, "0253fba63c52e1f8d8d2befce65c8b973789c8ca6be6dc8157f304666110b34d");
}

TEST_F(SealTest, TheKeyIsPrivateToItsUser) {
  ASSERT_TRUE(seal_of(bytes_));
  const fs::path path = folder_ / "mine/ruedo/key";
  struct stat status{};
  ASSERT_EQ(::stat(path.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  EXPECT_EQ(status.st_size, 32);
  for (const auto& entry : fs::directory_iterator(path.parent_path()))
    EXPECT_EQ(entry.path(), path) << "nothing else is left";
  fs::permissions(path, fs::perms::group_read, fs::perm_options::add);
  EXPECT_FALSE(seal_of(bytes_)) << "others may have read it";
  fs::permissions(path, fs::perms::group_read, fs::perm_options::remove);
  fs::resize_file(path, 31);
  EXPECT_FALSE(seal_of(bytes_));
  fs::remove(path);
  fs::create_symlink("/dev/zero", path);
  EXPECT_FALSE(seal_of(bytes_));
}

TEST_F(SealTest, WithoutAKeyFolderNothingIsSealed) {
  ::setenv("XDG_STATE_HOME", "/dev/null", 1);
  EXPECT_FALSE(seal_of(bytes_));
  EXPECT_FALSE(is_sealed(bytes_, Seal{}));
}

}  // namespace
}  // namespace ruedo
