// Where the elements of an XML text are: a part can be changed while all else stays as written,
// byte for byte.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace ruedo::world {

struct TextElement {
  struct Attribute {
    std::string name;
    size_t begin, end;   // with the space before it
    size_t value, past;  // the value between its quotes
  };

  std::string name;
  size_t begin = 0, end = 0;    // the whole element
  size_t inside = 0, past = 0;  // the content between its tags; both `end` for <closed/>
  std::vector<Attribute> attributes;
  std::vector<TextElement> children;

  bool closed() const { return inside == end; }
  // the first child of that name; null: none
  const TextElement* child(std::string_view name) const;
  const Attribute* attribute(std::string_view name) const;
};

// The root of a text that parse_document() has accepted.
TextElement places_in(std::string_view text);

// Changes to a text, each to a different part.
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

}  // namespace ruedo::world
