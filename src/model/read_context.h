// What every part of the file readers shares during one load.
#pragma once

#include <string>
#include <vector>

#include "model/document.h"
#include "model/mesh_loader.h"
#include "model/resources.h"
#include "ruedo/element.h"

namespace ruedo::model {

struct ReadContext {
  Findings& findings;
  const ResourceFinder& resources;
  DocumentStore& documents;
  MeshLoader& meshes;
  std::vector<std::string> xacro_arguments = {};  // "NAME:=VALUE"
};

// The name attribute. Throws InputError when it is absent, empty or reserved by SDF ("world",
// "__model__").
std::string required_name(const Element& element);

// Looks at the children that a reader does not read: unknown ruedo: elements are errors with a
// suggestion, known but unsupported or unknown elements are findings, those in `silent` and of
// other namespaces are passed over.
void report_other_children(const Element& element, const std::vector<std::string>& known,
                           const std::vector<std::string>& silent, const std::string& where,
                           Findings& findings);

// A file that grows without end: it is refused as a whole, not part by part.
class TooLarge : public InputError {
 public:
  using InputError::InputError;
};

// Runs read(). What is wrong with an element of the format is named, `what` is left out ("the
// shape"), and false comes back; what is wrong with one of Ruedo's own is the author's, and throws
// on.
template <class Read>
bool read_or_leave_out(const std::string& where, const std::string& what, Findings& findings,
                       Read read) {
  try {
    read();
    return true;
  } catch (const TooLarge&) {
    throw;
  } catch (const InputError& error) {
    const std::string element = error.message().substr(0, error.message().find('>'));
    if (element.find("ruedo:") != std::string::npos) throw;
    findings.error(error.source(), where, error.message() + "; " + what);
    return false;
  }
}

// "arm::wrist", as SDF scopes names, to "arm.wrist", as channels have it.
std::string dotted(const std::string& scoped);

// A number in words for messages: 0.5, not 0.500000.
std::string shown(double value);

}  // namespace ruedo::model
