// Helpers of all readers: names, unknown elements, numbers in messages.
#include "world/read/read_context.h"

#include <algorithm>
#include <charconv>

#include "world/document/reserved_names.h"

namespace ruedo::world {

std::string required_name(const Element& element) {
  const std::string* name = element.attribute("name");
  if (!name) element.fail("has no name; the attribute name is required");
  if (name->empty()) element.fail("has an empty name");
  if (is_reserved_name(*name)) element.fail("'" + *name + "' is a reserved name; choose another");
  return *name;
}

std::string name_of_model(const Element& element) {
  const std::string* name = element.attribute("name");
  return name && *name == "world" ? kModelNamedWorld : required_name(element);
}

void report_unknown(const Element& element, const std::string& what, const std::string& near,
                    const std::string& where, Findings& findings) {
  if (near.empty())
    findings.unsupported(element.source, where, what + " is not supported and left out");
  else
    findings.error(element.source, where,
                   what + " is not known and left out; did you mean <" + near + ">?");
}

void report_other_children(const Element& element, const std::vector<std::string>& known,
                           const std::vector<std::string>& silent, const std::string& where,
                           Findings& findings) {
  const auto in = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  element.refuse_unknown(known, true);
  for (const auto& child : element.children) {
    if (in(known, child->name) || in(silent, child->name) ||
        child->name.find(':') != std::string::npos)
      continue;
    const std::string with_prefix = "ruedo:" + child->name;
    const std::string near =
        in(known, with_prefix) ? with_prefix : nearest_word(child->name, known);
    report_unknown(*child, "<" + child->name + ">", near, where, findings);
  }
}

std::string dotted(const std::string& scoped) {
  std::string result = scoped;
  for (size_t at = result.find("::"); at != std::string::npos; at = result.find("::", at))
    result.replace(at, 2, ".");
  return result;
}

}  // namespace ruedo::world
