// The table of well-formed byte sequences of the Unicode standard (table 3-7), as conditions.
#include "base/utf8.h"

#include <algorithm>
#include <cstdint>
#include <iterator>

namespace ruedo {
namespace {

// Bytes of the UTF-8 character that begins there; 0 where none does.
size_t character_size(std::string_view text) {
  const auto byte = [&](size_t i) {
    return i < text.size() ? static_cast<uint8_t>(text[i]) : uint8_t{0};
  };
  const auto follows = [&](size_t i) { return (byte(i) & 0xc0) == 0x80; };
  const uint8_t first = byte(0), second = byte(1);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0) return follows(1) ? 2 : 0;
  if (first >= 0xe0 && first < 0xf0) {  // neither longer than needed nor a half of a UTF-16 pair
    const bool fits =
        follows(1) && (first != 0xe0 || second >= 0xa0) && (first != 0xed || second < 0xa0);
    return fits && follows(2) ? 3 : 0;
  }
  if (first < 0xf0 || first > 0xf4) return 0;
  const bool fits =
      follows(1) && (first != 0xf0 || second >= 0x90) && (first != 0xf4 || second < 0x90);
  return fits && follows(2) && follows(3) ? 4 : 0;
}

// Codes from first to last that a terminal obeys: Unicode's control characters, its line ends, and
// the marks that change the order of what is beside them.
struct Codes {
  uint32_t first, last;
};
constexpr Codes kObeyed[] = {{0x0000, 0x001f}, {0x007f, 0x009f}, {0x061c, 0x061c},
                             {0x200e, 0x200f}, {0x2028, 0x202e}, {0x2066, 0x2069}};

// Of a well-formed character.
uint32_t code_of(std::string_view character) {
  const auto first = static_cast<uint8_t>(character[0]);
  uint32_t code = character.size() == 1 ? first : first & (0x7fu >> character.size());
  for (const char c : character.substr(1)) code = code << 6 | (static_cast<uint8_t>(c) & 0x3fu);
  return code;
}

// But for line ends and tabs.
bool is_control(std::string_view character) {
  const uint32_t code = code_of(character);
  return code != '\n' && code != '\t' &&
         std::any_of(std::begin(kObeyed), std::end(kObeyed),
                     [=](const Codes& codes) { return codes.first <= code && code <= codes.last; });
}

std::string cleaned(std::string_view text, bool of_controls) {
  std::string result;
  result.reserve(text.size());
  while (!text.empty()) {
    const size_t size = character_size(text);
    const std::string_view character = text.substr(0, size);
    if (size == 0 || (of_controls && is_control(character)))
      result += '?';
    else
      result += character;
    text.remove_prefix(std::max<size_t>(1, size));
  }
  return result;
}

}  // namespace

std::string printable(std::string_view text) { return cleaned(text, false); }

std::string for_terminal(std::string_view text) { return cleaned(text, true); }

std::string in_one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return text;
}

std::string shortened(std::string_view text, size_t longest) {
  if (text.size() <= longest) return std::string(text);
  size_t end = longest;
  while (end > 0 && (static_cast<uint8_t>(text[end]) & 0xc0) == 0x80) --end;
  return std::string(text.substr(0, end)) + "...";
}

bool is_one_line(std::string_view text) {
  return text.find_first_of("\n\t") == std::string_view::npos && for_terminal(text) == text;
}

}  // namespace ruedo
