// A viewer's requests to a log delay no other viewer for long.
#include "console/log_source.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include <gtest/gtest.h>
#include <unistd.h>

#include "base/big_endian.h"
#include "base/lcm_log.h"

namespace ruedo::console {
namespace {

// A log of zeros, which takes no room on the disk: on each channel messages of that size at 0 s,
// 1 s, ...
class SparseLog {
 public:
  SparseLog(int channels, int messages, uint32_t size)
      : path_(std::filesystem::temp_directory_path() / (std::to_string(::getpid()) + "_sparse")) {
    std::FILE* file = std::fopen(path_.c_str(), "wb");
    for (int i = 0; i < messages * channels; ++i) {
      uint8_t head[kLogHeadSize + 1] = {};
      write_big_endian(head, kLogSync);
      write_big_endian(head + 12, int64_t{1'000'000} * (i / channels));
      write_big_endian(head + 20, uint32_t{1});
      write_big_endian(head + 24, size);
      head[kLogHeadSize] = static_cast<uint8_t>('a' + i % channels);
      std::fwrite(head, 1, sizeof head, file);
      std::fseek(file, static_cast<long>(size), SEEK_CUR);
    }
    std::fseek(file, -1, SEEK_CUR);
    std::fputc(0, file);
    std::fclose(file);
  }
  ~SparseLog() { std::filesystem::remove(path_); }
  SparseLog(const SparseLog&) = delete;
  SparseLog& operator=(const SparseLog&) = delete;
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

constexpr uint32_t kLarge = 40u << 20;

void watch_all(Board& board) {
  for (Board::Channel& channel : board.channels()) channel.watchers = 1;
}

// How many of the log's channels show something; the world's info is made beside them.
int shown(const Board& board) {
  return static_cast<int>(std::count_if(
      board.channels().begin(), board.channels().end(),
      [](const auto& channel) { return channel.name.size() == 1 && channel.last_number != 0; }));
}

// Of messages of 40 MB two pass the bound, of two viewers one each; the rest comes by and by.
TEST(LogLook, ReadsSoMuchAtATime) {
  const SparseLog log(4, 2, kLarge);
  LogSource source(log.path(), {}, 1.0);
  Board board, beside;
  const auto look = source.look();
  look->play(false, 1.0);
  look->pump(board);
  watch_all(board);
  look->pump(board);
  EXPECT_EQ(shown(board), 2);
  look->pump(board);
  EXPECT_EQ(shown(board), 4);

  const auto another = source.look();
  another->play(false, 1.0);
  another->pump(beside);
  watch_all(beside);
  another->pump(beside);
  EXPECT_EQ(shown(beside), 1);
}

// For two viewers 256 MB: six messages of 40 MB. A viewer that leaves frees its room.
TEST(LogLook, HoldsSoMuchForAllViewers) {
  const SparseLog log(4, 2, kLarge);
  LogSource source(log.path(), {}, 1.0);
  Board board, beside;
  const auto first = source.look();
  const auto hold_all = [](Look& look, Board& on) {
    look.play(false, 1.0);
    look.pump(on);
    watch_all(on);
    for (int i = 0; i < 4; ++i) look.pump(on);
  };
  hold_all(*first, board);
  EXPECT_EQ(shown(board), 4);
  auto second = source.look();
  hold_all(*second, beside);
  EXPECT_EQ(shown(beside), 2);
  first->seek(1.0);  // in the place of those before
  for (int i = 0; i < 4; ++i) first->pump(board);
  EXPECT_EQ(board.newest(), 8u + 1u) << "four and four messages, and the world's info";

  for (Board::Channel& channel : board.channels()) channel.watchers = 0;
  first->pump(board);
  second->seek(1.0);
  for (int i = 0; i < 4; ++i) second->pump(beside);
  EXPECT_EQ(shown(beside), 4);
}

TEST(LogLook, ShowsWhereItWasPutLast) {
  const SparseLog log(1, 3, 100);
  LogSource source(log.path(), {}, 1.0);
  Board board;
  const auto look = source.look();
  look->play(false, 1.0);
  look->pump(board);
  watch_all(board);
  look->pump(board);
  ASSERT_EQ(shown(board), 1);
  const uint64_t before = board.newest();
  for (int i = 0; i < 1000; ++i) {
    look->seek(i % 3);
    look->step(1);
  }
  EXPECT_EQ(board.newest(), before);
  look->pump(board);
  EXPECT_EQ(board.newest(), before + 1);
}

// 480 MB, of which 256 may be read.
TEST(LogSource, ThinsAPlotOfLargeMessages) {
  const SparseLog log(1, 12, kLarge);
  LogSource source(log.path(), {}, 1.0);
  const http::Bytes plot = source.history("a", "utime");
  double every = 0.0;
  ASSERT_GE(plot->size(), sizeof every);
  std::copy_n(plot->data(), sizeof every, reinterpret_cast<uint8_t*>(&every));
  EXPECT_EQ(every, 2.0);
}

}  // namespace
}  // namespace ruedo::console
