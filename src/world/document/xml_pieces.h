// Divides an XML text into tags and what stands between them, as tinyxml2 does. Who counts a text
// or changes it must see the same elements as the parser.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace ruedo::world {

struct XmlPiece {
  enum class Kind { text, cdata, aside, open, closed, closing };  // aside: comments and the like
  struct Attribute {
    std::string_view name;
    size_t begin, end;   // with the space before it
    size_t value, past;  // the value between its quotes
  };

  Kind kind = Kind::text;
  size_t begin = 0, end = 0;
  std::string_view name;              // of a tag
  std::vector<Attribute> attributes;  // of a tag, also of a closing one

  bool is_tag() const { return kind >= Kind::open; }
};

class XmlPieces {
 public:
  // A tag is read up to the attribute after `most_attributes`. The text must outlive it.
  XmlPieces(std::string_view text, size_t most_attributes)
      : text_(text), most_attributes_(most_attributes) {}

  // False at the end, or where the text is not XML: the parser reads no further, either.
  bool next(XmlPiece& piece);

 private:
  size_t after(size_t at, std::string_view what) const;  // npos: not found
  size_t after_space(size_t at) const;
  size_t after_name(size_t at) const;
  char at(size_t place) const { return place < text_.size() ? text_[place] : '\0'; }
  bool read_tag(XmlPiece& piece);
  bool read_attribute(XmlPiece& piece, size_t before, size_t begin);

  std::string_view text_;
  size_t most_attributes_;
  size_t at_ = 0;
};

}  // namespace ruedo::world
