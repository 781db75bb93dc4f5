// Findings: what a loader noticed and went on from, each told once for each place.
#include "ruedo/errors.h"

#include <algorithm>

namespace ruedo {

void Findings::add(Finding finding) {
  // Names may hold line ends, and what follows one would look like another finding.
  for (std::string* part : {&finding.element, &finding.text})
    std::replace_if(
        part->begin(), part->end(), [](char c) { return c == '\n' || c == '\r' || c == '\t'; },
        ' ');
  std::string key = std::to_string(static_cast<int>(finding.kind));
  for (const std::string* part : {&finding.source.file, &finding.element, &finding.text}) {
    key += '\0';
    key += *part;
  }
  key += '\0' + std::to_string(finding.source.line);
  if (seen_.insert(std::move(key)).second) list_.push_back(std::move(finding));
}

}  // namespace ruedo
