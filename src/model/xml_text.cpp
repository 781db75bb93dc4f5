// A single pass over the text. Comments, declarations and CDATA are skipped.
#include "model/xml_text.h"

#include <algorithm>

#include "ruedo/errors.h"

namespace ruedo::model {
namespace {

constexpr std::string_view kSpace = " \t\r\n\f\v";

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  TextElement root() {
    for (size_t at = next_tag(0); at < text_.size(); at = next_tag(at)) {
      if (text_[at + 1] != '/') return element(at);
      at = after(at, ">");
    }
    fail();
  }

 private:
  [[noreturn]] static void fail() { throw InputError({}, "the text is not XML"); }

  size_t after(size_t at, std::string_view what) const {
    const size_t found = text_.find(what, at);
    if (found == std::string_view::npos) fail();
    return found + what.size();
  }

  // The next '<' of an element's tag from that position.
  size_t next_tag(size_t at) const {
    for (;;) {
      at = text_.find('<', at);
      if (at == std::string_view::npos || at + 1 >= text_.size()) fail();
      const std::string_view rest = text_.substr(at);
      if (rest.starts_with("<!--"))
        at = after(at + 4, "-->");
      else if (rest.starts_with("<![CDATA["))
        at = after(at, "]]>");
      else if (rest.starts_with("<?") || rest.starts_with("<!"))
        at = after(at, ">");
      else
        return at;
    }
  }

  // The end of a name.
  size_t name_end(size_t at) const {
    return std::min(text_.find_first_of(" \t\r\n\f\v/>=", at), text_.size());
  }

  TextElement element(size_t begin) {
    TextElement found;
    found.begin = begin;
    size_t at = name_end(begin + 1);
    found.name = text_.substr(begin + 1, at - begin - 1);
    for (;;) {
      const size_t before = at;
      at = text_.find_first_not_of(kSpace, at);
      if (at == std::string_view::npos) fail();
      if (text_[at] == '/' || text_[at] == '>') break;
      found.attributes.push_back(attribute(before, at));
      at = found.attributes.back().end;
    }
    if (text_[at] == '/') {
      found.inside = found.past = found.end = after(at, ">");
      return found;
    }
    found.inside = at + 1;
    for (at = next_tag(at + 1); text_[at + 1] != '/'; at = next_tag(at)) {
      found.children.push_back(element(at));
      at = found.children.back().end;
    }
    found.past = at;
    found.end = after(at, ">");
    return found;
  }

  TextElement::Attribute attribute(size_t before, size_t at) const {
    TextElement::Attribute found;
    found.begin = before;
    const size_t end = name_end(at);
    found.name = text_.substr(at, end - at);
    const size_t quote = text_.find_first_of("\"'", end);
    if (quote == std::string_view::npos) fail();
    found.value = quote + 1;
    found.past = text_.find(text_[quote], found.value);
    if (found.past == std::string_view::npos) fail();
    found.end = found.past + 1;
    return found;
  }

  std::string_view text_;
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

TextElement places_in(std::string_view text) { return Scanner(text).root(); }

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

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      default: result += c;
    }
  }
  return result;
}

}  // namespace ruedo::model
