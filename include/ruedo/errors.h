// What can be wrong with input, in words that a user can act on.
#pragma once

#include <stdexcept>
#include <string>
#include <unordered_set>
#include <vector>

namespace ruedo {

// A place in a file. line 0: the file as a whole.
struct Source {
  std::string file;
  int line = 0;
  std::string str() const { return line > 0 ? file + ":" + std::to_string(line) : file; }
};

// A bad input file or option: says where, what was found, and what is allowed. Exit code 3.
class InputError : public std::runtime_error {
 public:
  InputError(Source source, const std::string& what)
      : std::runtime_error(source.file.empty() ? what : source.str() + ": " + what),
        source_(std::move(source)),
        message_(what) {}
  const Source& source() const { return source_; }
  const std::string& message() const { return message_; }  // without the place

 private:
  Source source_;
  std::string message_;
};

// The machine lacks something (a route, a renderer, room on a disk). The text holds the cure. Exit
// code 4.
class EnvironmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What a loader noticed and went on from.
struct Finding {
  enum class Kind { unsupported, repaired, error };
  Kind kind;
  Source source;
  std::string element;  // path of the element: "model p3at/link chassis/inertial"
  std::string text;     // what was found, and what Ruedo does instead
};

// Collects findings; the same text about the same kind of thing is kept once per place.
class Findings {
 public:
  void unsupported(const Source& source, const std::string& element, const std::string& text) {
    add({Finding::Kind::unsupported, source, element, text});
  }
  void repaired(const Source& source, const std::string& element, const std::string& text) {
    add({Finding::Kind::repaired, source, element, text});
  }
  void error(const Source& source, const std::string& element, const std::string& text) {
    add({Finding::Kind::error, source, element, text});
  }
  const std::vector<Finding>& list() const { return list_; }

 private:
  void add(Finding finding);
  std::vector<Finding> list_;
  std::unordered_set<std::string> seen_;  // looked up only, never walked through
};

}  // namespace ruedo
