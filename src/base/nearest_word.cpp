// "Did you mean": the nearest of the known words by edit distance.
#include <algorithm>
#include <vector>

#include "ruedo/element.h"

namespace ruedo {
namespace {

// Insertions, deletions, substitutions and swaps of neighbours that turn a into b, whatever the
// case (optimal string alignment).
size_t edit_distance(std::string_view a, std::string_view b) {
  const auto lower = [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  };
  std::vector<size_t> before(b.size() + 1), last(b.size() + 1), now(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    now[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      now[j] = std::min({last[j] + 1, now[j - 1] + 1, last[j - 1] + (same ? 0 : 1)});
      if (i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) &&
          lower(a[i - 2]) == lower(b[j - 1])) {
        now[j] = std::min(now[j], before[j - 2] + 1);
      }
    }
    std::swap(before, last);
    std::swap(last, now);
  }
  return last[b.size()];
}

}  // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string>& known) {
  constexpr std::string_view kPrefix = "ruedo:";
  constexpr size_t kLongest = 64;  // longer words are not mistyped ones
  if (word.size() > kLongest) return "";
  const size_t written = word.size() - (word.starts_with(kPrefix) ? kPrefix.size() : 0);
  if (written < 2) return "";  // every other letter is one step away
  size_t best_distance = std::max<size_t>(1, written / 3) + 1;
  std::string best;
  for (const std::string& each : known) {
    if (each.size() > 2 * kLongest) continue;
    const size_t distance = edit_distance(word, each);
    if (distance < best_distance) {
      best_distance = distance;
      best = each;
    }
  }
  return best;
}

}  // namespace ruedo
