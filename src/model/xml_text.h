// Where the elements of an XML text stand in it: a part is changed, and all else stays as it was
// written, to the byte.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace ruedo::model {

struct TextElement {
  struct Attribute {
    std::string name;
    size_t begin, end;   // with the space before it
    size_t value, past;  // of what is between its quotes
  };

  std::string name;
  size_t begin = 0, end = 0;    // of all of it
  size_t inside = 0, past = 0;  // of what is between its tags; both `end` where it is <closed/>
  std::vector<Attribute> attributes;
  std::vector<TextElement> children;

  bool closed() const { return inside == end; }
  const TextElement* child(std::string_view name) const;  // the first; null: none
  const Attribute* attribute(std::string_view name) const;
};

// The root of a text that parse_document() has taken.
TextElement places_in(std::string_view text);

// Changes of a text, each of another part of it.
class TextPatch {
 public:
  void replace(size_t begin, size_t end, std::string with);
  void insert(size_t at, std::string what) { replace(at, at, std::move(what)); }
  bool empty() const { return changes_.empty(); }
  std::string applied_to(std::string_view text) const;

 private:
  struct Change {
    size_t begin, end;
    std::string with;
  };
  std::vector<Change> changes_;
};

// Text as it stands between tags and in quotes.
std::string escaped(std::string_view text);

}  // namespace ruedo::model
