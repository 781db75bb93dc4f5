// tcpq's frames and channel patterns, against bytes written by hand and bytes that a stock LCM
// client sends; the ring.
#include "bus/tcpq_wire.h"

#include <random>

#include <gtest/gtest.h>

#include "bus/message_ring.h"

namespace ruedo::bus::tcpq {
namespace {

using Bytes = std::vector<uint8_t>;

Bytes bytes(std::string_view text) { return {text.begin(), text.end()}; }

// The bytes of LCM 1.5.3 for Python on subscribe("ruedo/in.*"), publish("x", b"abc"), unsubscribe
// of p3at/lrf.
const std::string kHello("\x28\x76\x17\xfb\0\0\x01\0", 8);
const std::string kStock(
    "\0\0\0\2\0\0\0\x0aruedo/in.*\0\0\0\1\0\0\0\1x\0\0\0\3abc\0\0\0\3\0\0\0\x08p3at/lrf", 50);

std::vector<std::string> read_all(Reader& reader, Reader::Result& result) {
  std::vector<std::string> read;
  Frame frame;
  while ((result = reader.next(frame)) == Reader::Result::frame) {
    const char* kind = frame.kind == Frame::Kind::publish     ? "publish "
                       : frame.kind == Frame::Kind::subscribe ? "subscribe "
                                                              : "unsubscribe ";
    read.push_back(kind + std::string(frame.channel) + " " +
                   std::string(frame.data.begin(), frame.data.end()));
  }
  reader.tidy();
  return read;
}

const std::vector<std::string> kWant{"subscribe ruedo/in.* ", "publish x abc",
                                     "unsubscribe p3at/lrf "};

TEST(TcpqReader, TakesAStockClientsStreamApart) {
  Reader reader;
  Reader::Result result;
  reader.add(bytes(kHello + kStock));
  EXPECT_EQ(read_all(reader, result), kWant);
  EXPECT_EQ(result, Reader::Result::more);
  EXPECT_EQ(reader.held(), 0u);
}

TEST(TcpqReader, InPiecesOfEverySize) {
  for (size_t piece = 1; piece < 20; ++piece) {
    Reader reader;
    Reader::Result result;
    std::vector<std::string> read;
    const Bytes stream = bytes(kHello + kStock);
    for (size_t at = 0; at < stream.size(); at += piece) {
      reader.add(std::span(stream).subspan(at, std::min(piece, stream.size() - at)));
      for (std::string& one : read_all(reader, result)) read.push_back(std::move(one));
      ASSERT_NE(result, Reader::Result::broken);
    }
    EXPECT_EQ(read, kWant) << piece;
  }
}

TEST(TcpqReader, RefusesMalformedStreams) {
  const std::string name(64, 'n');
  for (const std::string& stream : {
           std::string("GET / HTTP/1.1\r\n\r\n"),
           std::string("\x28\x76\x17\xfa\0\0\x01\0", 8),         // the server's magic
           std::string("\x28\x76\x17\xfb\0\0\x02\0", 8),         // another version
           kHello + std::string("\0\0\0\4\0\0\0\0", 8),          // no such frame
           kHello + std::string("\0\0\0\1\xff\xff\xff\xff", 8),  // lengths that lie
           kHello + std::string("\0\0\0\1\0\0\0\1x\xff\xff\xff\xff", 13),
           kHello + std::string("\0\0\0\1\0\0\0\1x\0\x40\0\1", 13),  // a byte more than 4 MiB
           kHello + std::string("\0\0\0\2\0\1\0\1", 8),              // a byte more than 64 KiB
           kHello + std::string("\0\0\0\1\0\0\0\x40", 8) + name,     // 64 characters
       }) {
    Reader reader;
    Reader::Result result;
    reader.add(bytes(stream));
    EXPECT_TRUE(read_all(reader, result).empty());
    EXPECT_EQ(result, Reader::Result::broken) << stream;
  }
}

// A hundred thousand streams of noise: nothing is read outside of the bytes (the sanitizers look),
// nothing is kept beyond them.
TEST(TcpqReader, SurvivesNoise) {
  std::mt19937 random(1);
  for (int i = 0; i < 100'000; ++i) {
    Reader reader;
    Reader::Result result;
    if (i % 2 == 0) reader.add(bytes(kHello));
    Bytes noise(random() % 64);
    for (uint8_t& byte : noise)
      byte = static_cast<uint8_t>(random() % 4 == 0 ? random() : random() % 4);
    reader.add(noise);
    read_all(reader, result);
    EXPECT_LE(reader.held(), noise.size() + 8);
  }
}

TEST(TcpqPattern, NamesAndBeginnings) {
  const struct {
    const char* pattern;
    const char* text;
    bool whole;
  } cases[] = {
      {"p3at/lrf", "p3at/lrf", true},
      {"p3at\\/lrf\\.x", "p3at/lrf.x", true},
      {"\\Qruedo/info\\E", "ruedo/info", true},  // Java's Pattern.quote
      {"\\Qa.b\\Ec", "a.bc", true},
      {"\\Qa.b", "a.b", true},
      {".*", "", false},
      {"p3at/.*", "p3at/", false},
      {"r[0-9]{1,9}/pose", "r", false},
      {"ab*c", "a", false},
      {"ab?c", "a", false},
      {"ab+c", "ab", false},
      {"ab{0}c", "a", false},
      {"a/x|b/x", "", false},
      {"a/.*|b/x", "", false},
      {"(?!a).*", "", false},
      {"a\\d", "a", false},
      {"", "", true},
      {"\\", "", false},
  };
  for (const auto& one : cases) {
    const Pattern read = read_pattern(one.pattern);
    EXPECT_EQ(read.text, one.text) << one.pattern;
    EXPECT_EQ(read.whole, one.whole) << one.pattern;
  }
}

TEST(TcpqFilter, CountsSubscriptions) {
  Filter filter;
  EXPECT_TRUE(filter.empty());
  filter.subscribe("a");
  filter.subscribe("a");
  filter.subscribe("b/.*");
  filter.unsubscribe("never");
  filter.unsubscribe("a");
  EXPECT_TRUE(filter.passes("a"));
  EXPECT_TRUE(filter.passes("b/1"));
  EXPECT_FALSE(filter.passes("b"));
  filter.unsubscribe("a");
  EXPECT_FALSE(filter.passes("a"));
  filter.unsubscribe("b/.*");
  EXPECT_TRUE(filter.empty());
}

TEST(TcpqFilter, TooManySubscriptionsPassEverything) {
  Filter filter;
  for (size_t i = 0; i < Filter::kMostNames; ++i) filter.subscribe(std::to_string(i));
  EXPECT_FALSE(filter.passes("other"));
  filter.subscribe("one more");
  EXPECT_TRUE(filter.passes("other"));
}

TEST(MessageRing, KeepsTheNewest) {
  MessageRing ring(1024);
  std::mt19937 random(2);
  std::vector<std::pair<uint32_t, Bytes>> all;
  std::vector<uint64_t> places;
  for (uint32_t i = 0; i < 2000; ++i) {
    all.emplace_back(i, Bytes(random() % (ring.largest() + 1), static_cast<uint8_t>(i)));
    places.push_back(ring.end());
    ASSERT_TRUE(ring.append(i, all.back().second));
    // The rest is the end of the stream, complete and in order, and at least the last message.
    size_t kept = 0;
    for (uint64_t place = ring.begin(); place < ring.end(); ++kept) place = ring.at(place).next;
    ASSERT_GE(kept, 1u);
    size_t index = all.size() - kept;
    for (uint64_t place = ring.begin(); place < ring.end(); ++index) {
      const MessageRing::Message message = ring.at(place);
      ASSERT_EQ(message.channel, all[index].first);
      ASSERT_TRUE(std::equal(message.bytes.begin(), message.bytes.end(), all[index].second.begin(),
                             all[index].second.end()));
      place = message.next;
    }
    ASSERT_LE(ring.end() - ring.begin(), 1024u);
  }
  EXPECT_FALSE(ring.append(0, Bytes(ring.largest() + 1)));
}

}  // namespace
}  // namespace ruedo::bus::tcpq
