// XML files as trees of elements that know their file and line. tinyxml2 is used in document.cpp
// only.
//
// Bad files give one InputError: too large, too deep, not UTF-8, a folder, no permission, not XML.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ruedo/element.h"

namespace ruedo::world {

// Entities other than XML's own five are not expanded: a file cannot grow while it is read.
std::unique_ptr<Element> parse_document(const std::string& text, const std::string& file);

// The documents of one load, each read once. Paths are absolute.
class DocumentStore {
 public:
  std::shared_ptr<const Element> read(const std::string& path);
  void add(const std::string& path, std::shared_ptr<const Element> root);
  // Other files that the world was read from: pictures, scripts.
  void note(const std::string& path);
  // In order of first reading, each once.
  std::vector<std::string> files_read() const;

 private:
  std::map<std::string, std::shared_ptr<const Element>> documents_;
  std::vector<std::string> files_;
};

}  // namespace ruedo::world
