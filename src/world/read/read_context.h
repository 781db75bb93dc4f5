// State shared by all readers of the files of one load.
#pragma once

#include <string>
#include <vector>

#include "base/option_text.h"
#include "ruedo/element.h"
#include "world/document/controller_files.h"
#include "world/document/document.h"
#include "world/document/resources.h"
#include "world/mesh/mesh_loader.h"
#include "world/mesh/texture_store.h"
#include "world/read/triangle_count.h"

namespace ruedo::world {

struct ReadContext {
  Findings& findings;
  const ResourceFinder& resources;
  DocumentStore& documents;
  MeshLoader& meshes;
  TextureStore& textures;
  std::vector<std::string> xacro_arguments = {};  // "NAME:=VALUE"
  bool has_xacro = false;                         // a file was expanded
  TriangleCount triangles = {};
  ControllerFiles controllers{resources};
};

// The name attribute. Throws InputError if it is missing, empty or reserved by SDF ("world",
// "__model__").
std::string required_name(const Element& element);

// Reports an unknown element, `what`: an error if it is nearly the name of another, since the
// intended one is missing; else it may be a plugin's own.
void report_unknown(const Element& element, const std::string& what, const std::string& near,
                    const std::string& where, Findings& findings);

// Checks the children that a reader does not read: unknown ruedo: elements are errors with a
// suggestion, unsupported or unknown elements are findings, and those in `silent` or of other
// namespaces are ignored.
void report_other_children(const Element& element, const std::vector<std::string>& known,
                           const std::vector<std::string>& silent, const std::string& where,
                           Findings& findings);

// A file that grows without end is refused as a whole, not part by part.
class TooLarge : public InputError {
 public:
  using InputError::InputError;
};

// Runs read(). An error in a standard element is reported, `what` ("the shape") is left out, and
// the result is false. An error in one of Ruedo's own elements is rethrown, and so is that of an
// option: its author can fix it.
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
    if (element.find("ruedo:") != std::string::npos || is_option(error.source())) throw;
    findings.error(error, where, error.message() + "; " + what);
    return false;
  }
}

// From "arm::wrist", SDF's scoped name, to "arm.wrist", as in channel names.
std::string dotted(const std::string& scoped);

}  // namespace ruedo::world
