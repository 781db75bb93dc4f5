// Files to element trees, by tinyxml2.
#include "model/document.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <string_view>

#include <tinyxml2.h>

namespace ruedo::model {
namespace {

constexpr size_t kMaxFileBytes = 64u << 20;
constexpr size_t kMaxElements = 2'000'000;

std::string trimmed(const std::string& text) {
  const char* space = " \t\r\n\f\v";
  const size_t begin = text.find_first_not_of(space);
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(space) - begin + 1);
}

// Whether the bytes are UTF-8 (overlong forms and surrogates are let through: nothing here interprets them).
bool is_utf8(const std::string& text) {
  for (size_t i = 0; i < text.size();) {
    const unsigned char c = static_cast<unsigned char>(text[i]);
    const int more = c < 0x80 ? 0 : c >> 5 == 6 ? 1 : c >> 4 == 14 ? 2 : c >> 3 == 30 ? 3 : -1;
    if (more < 0) return false;
    for (int k = 1; k <= more; ++k) {
      if (i + k >= text.size() || (static_cast<unsigned char>(text[i + k]) & 0xC0) != 0x80) return false;
    }
    i += static_cast<size_t>(more) + 1;
  }
  return true;
}

struct Converter {
  const std::string& file;
  size_t elements = 0;

  std::string checked(const char* text, int line) const {
    std::string result = text ? text : "";
    if (!is_utf8(result)) {
      throw InputError({file, line}, "text that is not UTF-8; save the file as UTF-8");
    }
    return result;
  }

  std::unique_ptr<Element> convert(const tinyxml2::XMLElement& xml) {
    if (++elements > kMaxElements) {
      throw InputError({file, xml.GetLineNum()}, "more than " + std::to_string(kMaxElements) + " elements");
    }
    auto element = std::make_unique<Element>();
    element->name = checked(xml.Name(), xml.GetLineNum());
    element->source = {file, xml.GetLineNum()};
    for (auto* a = xml.FirstAttribute(); a; a = a->Next()) {
      element->attributes.emplace_back(checked(a->Name(), a->GetLineNum()), checked(a->Value(), a->GetLineNum()));
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
    case XML_ERROR_MISMATCHED_ELEMENT: return "not XML: this element is closed by another name, or not at all";
    case XML_ERROR_PARSING_ELEMENT: return "not XML: an element that is not complete";
    case XML_ERROR_PARSING_ATTRIBUTE: return "not XML: an attribute that is not complete";
    case XML_ERROR_PARSING_TEXT: return "not XML: text that never ends";
    case XML_ERROR_PARSING_COMMENT: return "not XML: a comment that never ends";
    case XML_ERROR_PARSING_CDATA: return "not XML: a CDATA section that never ends";
    case XML_ERROR_PARSING_DECLARATION: return "not XML: a declaration that is wrong or in the wrong place";
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
  if (text.find('\0') != std::string::npos) throw InputError({file, 1}, "not a text file: it holds zero bytes");
  std::string_view start = text;
  if (start.starts_with("\xEF\xBB\xBF")) start.remove_prefix(3);    // UTF-8's mark
  const size_t begin = start.find_first_not_of(" \t\r\n\f\v");
  if (begin == std::string_view::npos) throw InputError({file, 0}, "the file is empty");
  if (start[begin] != '<') throw InputError({file, 1}, "not XML: the text does not begin with '<'");
  tinyxml2::XMLDocument xml;
  xml.Parse(text.data(), text.size());
  if (xml.Error()) throw InputError({file, xml.ErrorLineNum()}, what_is_wrong(xml));
  const auto* root = xml.RootElement();
  if (!root) throw InputError({file, 1}, "the file holds no element");
  if (const auto* second = root->NextSiblingElement()) {
    throw InputError({file, second->GetLineNum()}, "not XML: a second root element <" + std::string(second->Name()) + ">");
  }
  return Converter{file}.convert(*root);
}

std::string read_text_file(const std::string& path, size_t max_bytes) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) {
    throw InputError({path, 0}, errno == ENOENT ? "no such file" : std::string("cannot be read: ") + std::strerror(errno));
  }
  if (S_ISDIR(info.st_mode)) throw InputError({path, 0}, "is a folder; a file is needed");
  if (!S_ISREG(info.st_mode)) throw InputError({path, 0}, "is not a regular file");
  if (static_cast<size_t>(info.st_size) > max_bytes) {
    throw InputError({path, 0}, "has " + std::to_string(info.st_size) + " bytes; allowed are " + std::to_string(max_bytes));
  }
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError({path, 0}, std::string("cannot be read: ") + std::strerror(errno));
  std::string text(static_cast<size_t>(info.st_size), '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<size_t>(in.gcount()));
  return text;
}

std::shared_ptr<const Element> DocumentStore::read(const std::string& path) {
  auto& document = documents_[path];
  if (!document) {
    document = parse_document(read_text_file(path, kMaxFileBytes), path);
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

void DocumentStore::add(const std::string& path, std::shared_ptr<const Element> root) {
  documents_[path] = std::move(root);
  files_.push_back(path);
}

}  // namespace ruedo::model
