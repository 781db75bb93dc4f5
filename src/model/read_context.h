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
};

// The name attribute. Throws InputError when it is absent, empty or reserved by SDF ("world", "__model__").
std::string required_name(const Element& element);

// Looks at the children that a reader does not read: unknown ruedo: elements are errors with a suggestion, known
// but unsupported or unknown elements are findings, those in `silent` and of other namespaces are passed over.
void report_other_children(const Element& element, const std::vector<std::string>& known,
                           const std::vector<std::string>& silent, const std::string& where, Findings& findings);

// "arm::wrist", as SDF scopes names, to "arm.wrist", as channels have it.
std::string dotted(const std::string& scoped);

// A number in words for messages: 0.5, not 0.500000.
std::string shown(double value);

}  // namespace ruedo::model
