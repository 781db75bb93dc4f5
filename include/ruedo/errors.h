// Errors and findings of input, in words that a user can act on.
#pragma once

#include <stdexcept>
#include <string>
#include <unordered_set>
#include <vector>

namespace ruedo {

/// A place in a file.
struct Source {
  std::string file;  ///< as it was named
  int line = 0;      ///< from 1; 0: the file as a whole
  /// @return FILE:LINE
  std::string str() const { return line > 0 ? file + ":" + std::to_string(line) : file; }
};

/// A bad input file or option: says where, what was found, and what is allowed. Exit code 3.
class InputError : public std::runtime_error {
 public:
  /// @param source where
  /// @param what was found, and what is allowed
  InputError(Source source, const std::string& what)
      : std::runtime_error(source.file.empty() ? what : source.str() + ": " + what),
        source_(std::move(source)),
        message_(what) {}
  /// @return where
  const Source& source() const { return source_; }
  /// @return the text without the place
  const std::string& message() const { return message_; }

 private:
  Source source_;
  std::string message_;
};

/// A number that is infinite, none, or too large for one.
class NotFinite : public InputError {
 public:
  using InputError::InputError;
};

/// The machine lacks something (a route, a renderer, room on a disk). The text holds the cure. Exit
/// code 4.
class EnvironmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A fault that a loader noticed, and continued.
struct Finding {
  /// Not supported, wrong and repaired, or wrong.
  enum class Kind { unsupported, repaired, error };
  Kind kind;            ///< how bad it is
  Source source;        ///< where
  std::string element;  ///< path of the element: "model p3at/link chassis/inertial"
  std::string text;     ///< what was found, and what Ruedo does instead
};

/// Collects findings; the same text about the same kind of thing is kept once per place.
class Findings {
 public:
  /// Adds something that Ruedo does not have.
  /// @param source where
  /// @param element its path
  /// @param text what was found, and what Ruedo does instead
  void unsupported(const Source& source, const std::string& element, const std::string& text) {
    add({Finding::Kind::unsupported, source, element, text});
  }
  /// Adds something wrong that was repaired.
  /// @param source where
  /// @param element its path
  /// @param text what was found, and what Ruedo does instead
  void repaired(const Source& source, const std::string& element, const std::string& text) {
    add({Finding::Kind::repaired, source, element, text});
  }
  /// Adds something wrong.
  /// @param source where
  /// @param element its path
  /// @param text what was found, and what Ruedo does instead
  void error(const Source& source, const std::string& element, const std::string& text) {
    add({Finding::Kind::error, source, element, text});
  }
  /// Adds something wrong that was thrown and caught.
  /// @param caught where; thrown again if it is a number that is refused
  /// @param element its path
  /// @param text what was found, and what Ruedo does instead
  void error(const InputError& caught, const std::string& element, const std::string& text);
  /// From now on a number that is not finite gives no finding, but ends the reading with its
  /// NotFinite: for callers that read no findings.
  void refuse_what_is_not_finite() { refuses_not_finite_ = true; }
  /// @return all of them, in the order of adding
  const std::vector<Finding>& list() const { return list_; }

 private:
  void add(Finding finding);
  std::vector<Finding> list_;
  bool refuses_not_finite_ = false;
  std::unordered_set<std::string> seen_;  // looked up only, never walked through
};

}  // namespace ruedo
