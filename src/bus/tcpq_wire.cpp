// Frames of tcpq, and LCM's channel patterns as names and beginnings of names.
#include "bus/tcpq_wire.h"

#include <algorithm>
#include <cctype>

#include "base/big_endian.h"

namespace ruedo::bus::tcpq {
namespace {

constexpr uint32_t kPublish = 1, kSubscribe = 2, kUnsubscribe = 3;
constexpr size_t kKept = 256 * 1024;  // bytes of memory that an idle client's buffer may keep

}  // namespace

std::vector<uint8_t> server_hello() {
  std::vector<uint8_t> bytes;
  append_big_endian(bytes, kServerMagic);
  append_big_endian(bytes, kVersion);
  return bytes;
}

std::vector<uint8_t> client_hello() {
  std::vector<uint8_t> bytes;
  append_big_endian(bytes, kClientMagic);
  append_big_endian(bytes, kVersion);
  return bytes;
}

namespace {

// The name is quoted as a pattern.
void append_pattern(std::vector<uint8_t>& out, uint32_t kind, std::string_view name) {
  std::string pattern;
  for (const char c : name) {
    if (std::string_view(".^$*+?{}[]\\|()").find(c) != std::string_view::npos) pattern += '\\';
    pattern += c;
  }
  append_big_endian(out, kind);
  append_big_endian(out, static_cast<uint32_t>(pattern.size()));
  for (const char c : pattern) out.push_back(static_cast<uint8_t>(c));
}

}  // namespace

void append_subscribe(std::vector<uint8_t>& out, std::string_view name) {
  append_pattern(out, kSubscribe, name);
}
void append_unsubscribe(std::vector<uint8_t>& out, std::string_view name) {
  append_pattern(out, kUnsubscribe, name);
}

void append_publish(std::vector<uint8_t>& out, std::string_view channel,
                    std::span<const uint8_t> data) {
  append_big_endian(out, kPublish);
  append_big_endian(out, static_cast<uint32_t>(channel.size()));
  out.insert(out.end(), channel.begin(), channel.end());
  append_big_endian(out, static_cast<uint32_t>(data.size()));
  out.insert(out.end(), data.begin(), data.end());
}

size_t size_of_publish(const uint8_t* frame) {
  const size_t name = read_big_endian<uint32_t>(frame + 4);
  return 8 + name + 4 + read_big_endian<uint32_t>(frame + 8 + name);
}

uint32_t Reader::number(size_t at) const { return read_big_endian<uint32_t>(&buffer_[read_ + at]); }

Reader::Result Reader::next(Frame& frame) {
  if (!greeted_) {
    if (buffer_.size() < 8) return Result::more;
    if (number(0) != kClientMagic || number(4) != kVersion) return Result::broken;
    greeted_ = true;
    read_ = 8;
  }
  const size_t left = buffer_.size() - read_;
  if (left < 8) return Result::more;
  const uint32_t kind = number(0), length = number(4);
  if (kind < kPublish || kind > kUnsubscribe) return Result::broken;
  if (length > (kind == kPublish ? kLongestChannel : kLongestPattern)) return Result::broken;
  const size_t text_end = size_t{8} + length;
  size_t end = text_end;
  if (kind == kPublish) {
    if (left < text_end + 4) return Result::more;
    const uint32_t size = number(text_end);
    if (size > kLargestMessage) return Result::broken;
    end = text_end + 4 + size;
  }
  if (left < end) return Result::more;
  const uint8_t* begin = buffer_.data() + read_;
  frame.kind = kind == kPublish     ? Frame::Kind::publish
               : kind == kSubscribe ? Frame::Kind::subscribe
                                    : Frame::Kind::unsubscribe;
  frame.channel = {reinterpret_cast<const char*>(begin + 8), length};
  frame.data =
      kind == kPublish ? std::span(begin + text_end + 4, begin + end) : std::span<const uint8_t>();
  read_ += end;
  return Result::frame;
}

void Reader::tidy() {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(read_));
  read_ = 0;
  if (buffer_.capacity() > kKept && buffer_.size() < kKept / 2) buffer_.shrink_to_fit();
}

Pattern read_pattern(std::string_view pattern) {
  Pattern read{"", true};
  for (size_t i = 0; i < pattern.size(); ++i) {
    const char c = pattern[i];
    if (c == '\\' && i + 1 < pattern.size() && pattern[i + 1] == 'Q') {  // Java quotes so
      const size_t end = std::min(pattern.find("\\E", i + 2), pattern.size());
      read.text += pattern.substr(i + 2, end - i - 2);
      i = end + 1;
    } else if (c == '\\' && i + 1 < pattern.size() &&
               !std::isalnum(static_cast<unsigned char>(pattern[i + 1]))) {
      read.text += pattern[++i];
    } else if (std::string_view(".^$*+?{}[]\\|()").find(c) == std::string_view::npos) {
      read.text += c;
    } else {
      // A quantifier may take the character before it away; an alternative, everything.
      if ((c == '*' || c == '?' || c == '{') && !read.text.empty()) read.text.pop_back();
      if (pattern.find('|', i) != std::string_view::npos) read.text.clear();
      read.whole = false;
      return read;
    }
  }
  return read;
}

void Filter::subscribe(std::string_view pattern) {
  Pattern read = read_pattern(pattern);
  auto& kept = read.whole ? names_ : beginnings_;
  const size_t most = read.whole ? kMostNames : kMostBeginnings;
  if (kept.size() >= most &&
      !kept.contains(read.text)) {  // too many subscriptions: it gets everything from now on
    ++beginnings_[""];
    return;
  }
  ++kept[std::move(read.text)];
}

void Filter::unsubscribe(std::string_view pattern) {
  const Pattern read = read_pattern(pattern);
  auto& kept = read.whole ? names_ : beginnings_;
  const auto found = kept.find(read.text);
  if (found != kept.end() && --found->second == 0) kept.erase(found);
}

bool Filter::passes(std::string_view channel) const {
  if (names_.contains(std::string(channel))) return true;
  return std::any_of(beginnings_.begin(), beginnings_.end(),
                     [&](const auto& one) { return channel.starts_with(one.first); });
}

}  // namespace ruedo::bus::tcpq
