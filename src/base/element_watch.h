// Records the elements and attributes of a document that readers read: a test compares them with
// the format's own list.
#pragma once

#include <set>
#include <string>

#include "ruedo/element.h"

namespace ruedo {

// While it lives, notes the reads of its thread. An element counts by its line and name, so that
// its copies count, too.
class ElementWatch {
 public:
  ElementWatch();
  ~ElementWatch();
  ElementWatch(const ElementWatch&) = delete;

  bool read(int line, const std::string& name) const { return seen_.contains(key(line, name)); }

  // For Element: a reader read it, or its attribute.
  static void note(const Element& element) {
    if (watch_) watch_->seen_.insert(key(element.source.line, element.name));
  }
  static void note(const Element& element, std::string_view attribute) {
    if (watch_) watch_->seen_.insert(key(element.source.line, "@" + std::string(attribute)));
  }

 private:
  static std::string key(int line, const std::string& name) {
    return std::to_string(line) + " " + name;
  }

  static thread_local ElementWatch* watch_;
  std::set<std::string> seen_;
};

}  // namespace ruedo
