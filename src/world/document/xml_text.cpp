// A single pass over the text, tag by tag.
#include "world/document/xml_text.h"

#include <algorithm>

#include "ruedo/errors.h"
#include "world/document/xml_pieces.h"

namespace ruedo::world {
namespace {

class Builder {
 public:
  explicit Builder(std::string_view text) : pieces_(text, text.size()) {}

  TextElement root() {
    next_tag();
    return element();
  }

 private:
  void next_tag() {
    do {
      if (!pieces_.next(piece_)) throw InputError({}, "the text is not XML");
    } while (!piece_.is_tag());
  }

  // That begins with the present tag; its last one is the present tag afterwards.
  TextElement element() {
    TextElement found;
    found.name = piece_.name;
    found.begin = piece_.begin;
    found.inside = found.past = found.end = piece_.end;
    for (const XmlPiece::Attribute& each : piece_.attributes)
      found.attributes.push_back(
          {std::string(each.name), each.begin, each.end, each.value, each.past});
    if (piece_.kind != XmlPiece::Kind::open) return found;
    for (next_tag(); piece_.kind != XmlPiece::Kind::closing; next_tag())
      found.children.push_back(element());
    found.past = piece_.begin;
    found.end = piece_.end;
    return found;
  }

  XmlPieces pieces_;
  XmlPiece piece_;
};

}  // namespace

const TextElement* TextElement::child(std::string_view wanted) const {
  const auto found = std::find_if(children.begin(), children.end(),
                                  [&](const TextElement& each) { return each.name == wanted; });
  return found == children.end() ? nullptr : &*found;
}

const TextElement::Attribute* TextElement::attribute(std::string_view wanted) const {
  const auto found = std::find_if(attributes.begin(), attributes.end(),
                                  [&](const Attribute& each) { return each.name == wanted; });
  return found == attributes.end() ? nullptr : &*found;
}

TextElement places_in(std::string_view text) { return Builder(text).root(); }

void TextPatch::replace(size_t begin, size_t end, std::string with) {
  changes_.push_back({begin, end, std::move(with)});
}

std::string TextPatch::applied_to(std::string_view text) const {
  std::vector<const Change*> in_order;
  for (const Change& change : changes_) in_order.push_back(&change);
  std::stable_sort(in_order.begin(), in_order.end(),
                   [](const Change* a, const Change* b) { return a->begin < b->begin; });
  std::string result;
  size_t at = 0;
  for (const Change* change : in_order) {
    result += text.substr(at, change->begin - at);
    result += change->with;
    at = change->end;
  }
  return result += text.substr(at);
}

}  // namespace ruedo::world
