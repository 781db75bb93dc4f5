// Reads files into element trees, with tinyxml2.
#include "world/document/document.h"

#include <algorithm>
#include <set>
#include <string_view>

#include <tinyxml2.h>

#include "base/input_file.h"
#include "base/text.h"
#include "world/document/xml_pieces.h"

namespace ruedo::world {
namespace {

constexpr size_t kMaxFileBytes = 64u << 20;
// Limits of a document. Some of the parser's own costs grow with the square of these, so they are
// counted before it runs.
constexpr size_t kMaxElements = 2'000'000, kMaxAttributes = 64, kMaxDepth = 200,
                 kMaxAttributeBytes = 64 << 10, kMaxTextBytes = 1 << 20;

// Whether the bytes are UTF-8 (overlong forms and surrogates are let through: nothing here
// interprets them).
bool is_utf8(const std::string& text) {
  for (size_t i = 0; i < text.size();) {
    const unsigned char c = static_cast<unsigned char>(text[i]);
    const int more = c < 0x80 ? 0 : c >> 5 == 6 ? 1 : c >> 4 == 14 ? 2 : c >> 3 == 30 ? 3 : -1;
    if (more < 0) return false;
    for (int k = 1; k <= more; ++k) {
      if (i + k >= text.size() || (static_cast<unsigned char>(text[i + k]) & 0xC0) != 0x80)
        return false;
    }
    i += static_cast<size_t>(more) + 1;
  }
  return true;
}

// Refuses what exceeds a limit. Text that is not XML is left for the parser to report.
class Counter {
 public:
  Counter(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  void count() {
    XmlPieces pieces(text_, kMaxAttributes);
    for (XmlPiece piece; pieces.next(piece);) {
      const size_t size = piece.end - piece.begin;
      if (piece.is_tag()) {
        count(piece);
      } else if (piece.kind != XmlPiece::Kind::aside && size > kMaxTextBytes) {
        refuse(piece.begin, "a text of " + std::to_string(size) + " bytes", kMaxTextBytes);
      }
    }
  }

 private:
  void count(const XmlPiece& tag) {
    if (tag.attributes.size() > kMaxAttributes)
      refuse(tag.begin, "an element of more than " + std::to_string(kMaxAttributes) + " attributes",
             kMaxAttributes);
    for (const XmlPiece::Attribute& each : tag.attributes) {
      if (const size_t size = each.past - each.value; size > kMaxAttributeBytes)
        refuse(tag.begin, "an attribute of " + std::to_string(size) + " bytes", kMaxAttributeBytes);
    }
    if (tag.kind == XmlPiece::Kind::closing) {
      if (depth_ > 0) --depth_;
      return;
    }
    if (++elements_ > kMaxElements)
      refuse(tag.begin, "more than " + std::to_string(kMaxElements) + " elements", kMaxElements);
    if (++depth_ > kMaxDepth)
      refuse(tag.begin, "elements are nested too deep: " + std::to_string(depth_) + " levels",
             kMaxDepth);
    if (tag.kind == XmlPiece::Kind::closed) --depth_;
  }

  [[noreturn]] void refuse(size_t at, const std::string& what, size_t allowed) const {
    const auto line =
        1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    throw InputError({file_, static_cast<int>(line)},
                     what + "; allowed are " + std::to_string(allowed));
  }

  std::string_view text_;
  const std::string& file_;
  size_t elements_ = 0, depth_ = 0;
};

struct Converter {
  const std::string& file;

  std::string checked(const char* text, int line) const {
    std::string result = text ? text : "";
    if (!is_utf8(result)) {
      throw InputError({file, line}, "text that is not UTF-8; save the file as UTF-8");
    }
    return result;
  }

  std::unique_ptr<Element> convert(const tinyxml2::XMLElement& xml) {
    auto element = std::make_unique<Element>();
    element->name = checked(xml.Name(), xml.GetLineNum());
    element->source = {file, xml.GetLineNum()};
    for (auto* a = xml.FirstAttribute(); a; a = a->Next()) {
      std::string name = checked(a->Name(), a->GetLineNum());
      // Paths, which xacro makes from that of its file, need not be UTF-8.
      const bool is_path = name == "filename" || name == "ruedo_at";
      element->attributes.emplace_back(std::move(name),
                                       is_path ? a->Value() : checked(a->Value(), a->GetLineNum()));
    }
    std::string text;
    for (auto* node = xml.FirstChild(); node; node = node->NextSibling()) {
      if (const auto* child = node->ToElement()) {
        element->children.push_back(convert(*child));
      } else if (const auto* piece = node->ToText()) {
        text += checked(piece->Value(), piece->GetLineNum());
      }
    }
    element->text = trimmed(text);
    return element;
  }
};

std::string what_is_wrong(const tinyxml2::XMLDocument& xml) {
  using namespace tinyxml2;
  switch (xml.ErrorID()) {
    case XML_ERROR_EMPTY_DOCUMENT: return "the file is empty";
    case XML_ERROR_MISMATCHED_ELEMENT:
      return "not XML: this element has no closing tag of the same name";
    case XML_ERROR_PARSING_ELEMENT: return "not XML: an element that is not complete";
    case XML_ERROR_PARSING_ATTRIBUTE: return "not XML: an attribute that is not complete";
    case XML_ERROR_PARSING_TEXT: return "not XML: text that never ends";
    case XML_ERROR_PARSING_COMMENT: return "not XML: a comment that never ends";
    case XML_ERROR_PARSING_CDATA: return "not XML: a CDATA section that never ends";
    case XML_ERROR_PARSING_DECLARATION:
      return "not XML: a declaration that is wrong or in the wrong place";
    case XML_ERROR_PARSING_UNKNOWN: return "not XML: a '<!' that never ends";
    case XML_ELEMENT_DEPTH_EXCEEDED: return "elements are nested too deep";
    default: return std::string("not XML: ") + xml.ErrorName();
  }
}

}  // namespace

std::unique_ptr<Element> parse_document(const std::string& text, const std::string& file) {
  if (text.size() > kMaxFileBytes) throw InputError({file, 0}, "larger than 64 MB");
  if (text.rfind("\xFF\xFE", 0) == 0 || text.rfind("\xFE\xFF", 0) == 0) {
    throw InputError({file, 1}, "the text is UTF-16; save the file as UTF-8");
  }
  if (text.find('\0') != std::string::npos)
    throw InputError({file, 1}, "not a text file: it holds zero bytes");
  std::string_view start = text;
  if (start.starts_with("\xEF\xBB\xBF")) start.remove_prefix(3);  // the UTF-8 byte order mark
  const size_t begin = start.find_first_not_of(" \t\r\n\f\v");
  if (begin == std::string_view::npos) throw InputError({file, 0}, "the file is empty");
  if (start[begin] != '<') throw InputError({file, 1}, "not XML: the text does not begin with '<'");
  Counter(start, file).count();
  tinyxml2::XMLDocument xml;
  xml.Parse(text.data(), text.size());
  if (xml.Error()) throw InputError({file, xml.ErrorLineNum()}, what_is_wrong(xml));
  const auto* root = xml.RootElement();
  if (!root) throw InputError({file, 1}, "the file holds no element");
  if (const auto* second = root->NextSiblingElement()) {
    throw InputError({file, second->GetLineNum()},
                     "not XML: a second root element <" + std::string(second->Name()) + ">");
  }
  return Converter{file}.convert(*root);
}

std::shared_ptr<const Element> DocumentStore::read(const std::string& path) {
  auto& document = documents_[path];
  if (!document) {
    document = parse_document(read_input(path, kMaxFileBytes), path);
    files_.push_back(path);
  }
  return document;
}

std::vector<std::string> DocumentStore::files_read() const {
  std::vector<std::string> files;
  std::set<std::string_view> known;
  for (const std::string& file : files_) {
    if (known.insert(file).second) files.push_back(file);
  }
  return files;
}

void DocumentStore::note(const std::string& path) {
  if (std::find(files_.begin(), files_.end(), path) != files_.end()) return;
  files_.push_back(path);
  note_read(path);
}

void DocumentStore::add(const std::string& path, std::shared_ptr<const Element> root) {
  documents_[path] = std::move(root);
  note(path);
}

}  // namespace ruedo::world
