#include "log/zstd_file.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "ruedo/errors.h"
#include "temporary_folder.h"

namespace ruedo::log {
namespace {

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class ZstdFile : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  // Packs it, and unpacks it from within another file.
  std::string packed_and_unpacked(const std::string& bytes) const {
    std::ofstream(path("plain"), std::ios::binary) << bytes;
    pack_file(path("plain"), path("packed"));
    const std::string packed = bytes_of(path("packed"));
    std::ofstream(path("around"), std::ios::binary) << "before" << packed << "after";
    EXPECT_EQ(unpack_part(path("around"), 6, packed.size(), path("again"), bytes.size()),
              bytes.size());
    return bytes_of(path("again"));
  }

 private:
  TemporaryFolder folder_;
};

TEST_F(ZstdFile, GivesBackWhatWasPacked) {
  std::mt19937 random(1);
  std::string noise(3'000'000, '\0');
  for (char& c : noise) c = static_cast<char>(random());
  for (const std::string& bytes :
       {std::string(), std::string("a"), std::string(10'000'000, 'x'), noise, noise + "x"})
    EXPECT_TRUE(packed_and_unpacked(bytes) == bytes) << bytes.size();
}

TEST_F(ZstdFile, EndsWhereItIsLargerThanAllowed) {
  std::ofstream(path("plain")) << std::string(1'000'000, 'x');
  pack_file(path("plain"), path("packed"));
  const uint64_t size = std::filesystem::file_size(path("packed"));
  EXPECT_THROW(unpack_part(path("packed"), 0, size, path("again"), 999'999), InputError);
  EXPECT_FALSE(std::filesystem::exists(path("again")));
  EXPECT_EQ(unpack_part(path("packed"), 0, size, path("again"), 1'000'000), 1'000'000);
}

}  // namespace
}  // namespace ruedo::log
