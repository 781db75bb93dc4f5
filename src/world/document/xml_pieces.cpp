// tinyxml2's own order: declarations, comments, CDATA, what else begins with "<!", tags, text.
#include "world/document/xml_pieces.h"

#include <algorithm>

namespace ruedo::world {
namespace {

constexpr std::string_view kSpace = " \t\r\n\f\v";

bool begins_name(char c) {
  return static_cast<unsigned char>(c) >= 0x80 || (c >= 'a' && c <= 'z') ||
         (c >= 'A' && c <= 'Z') || c == ':' || c == '_';
}

bool continues_name(char c) {
  return begins_name(c) || (c >= '0' && c <= '9') || c == '.' || c == '-';
}

}  // namespace

size_t XmlPieces::after(size_t at, std::string_view what) const {
  const size_t found = text_.find(what, at);
  return found == std::string_view::npos ? found : found + what.size();
}

size_t XmlPieces::after_space(size_t at) const {
  return std::min(text_.find_first_not_of(kSpace, at), text_.size());
}

size_t XmlPieces::after_name(size_t at) const {
  if (!begins_name(this->at(at))) return at;
  while (continues_name(this->at(at))) ++at;
  return at;
}

bool XmlPieces::next(XmlPiece& piece) {
  struct Form {
    std::string_view begin, end;
    XmlPiece::Kind kind;
  };
  static constexpr Form kForms[] = {{"<?", "?>", XmlPiece::Kind::aside},
                                    {"<!--", "-->", XmlPiece::Kind::aside},
                                    {"<![CDATA[", "]]>", XmlPiece::Kind::cdata},
                                    {"<!", ">", XmlPiece::Kind::aside}};
  if (at_ >= text_.size()) return false;
  piece.begin = at_;
  piece.name = {};
  piece.attributes.clear();
  if (text_[at_] != '<') {
    piece.kind = XmlPiece::Kind::text;
    at_ = piece.end = std::min(text_.find('<', at_), text_.size());
    return true;
  }
  for (const Form& form : kForms) {
    if (!text_.substr(at_).starts_with(form.begin)) continue;
    piece.kind = form.kind;
    at_ = piece.end = after(at_ + form.begin.size(), form.end);
    return at_ != std::string_view::npos;
  }
  return read_tag(piece);
}

bool XmlPieces::read_tag(XmlPiece& piece) {
  size_t place = after_space(piece.begin + 1);
  const bool closing = at(place) == '/';
  if (closing) ++place;
  const size_t past_name = after_name(place);
  if (past_name == place) return false;
  piece.name = text_.substr(place, past_name - place);
  piece.kind = closing ? XmlPiece::Kind::closing : XmlPiece::Kind::open;
  for (place = past_name; piece.attributes.size() <= most_attributes_;) {
    const size_t before = place;
    place = after_space(place);
    if (at(place) == '>') {
      ++place;
      break;
    }
    if (at(place) == '/' && at(place + 1) == '>') {
      piece.kind = XmlPiece::Kind::closed;
      place += 2;
      break;
    }
    if (!read_attribute(piece, before, place)) return false;
    place = piece.attributes.back().end;
  }
  at_ = piece.end = place;
  return true;
}

bool XmlPieces::read_attribute(XmlPiece& piece, size_t before, size_t begin) {
  const size_t past_name = after_name(begin);
  const size_t equals = after_space(past_name);
  if (past_name == begin || at(equals) != '=') return false;
  const size_t quote = after_space(equals + 1);
  if (at(quote) != '"' && at(quote) != '\'') return false;
  const size_t past = text_.find(text_[quote], quote + 1);
  if (past == std::string_view::npos) return false;
  piece.attributes.push_back(
      {text_.substr(begin, past_name - begin), before, past + 1, quote + 1, past});
  return true;
}

}  // namespace ruedo::world
