// Findings: faults that a loader noticed without stopping, each reported once for each place.
#include "ruedo/errors.h"

#include <utility>

#include "base/utf8.h"

namespace ruedo {

void Findings::add(Finding finding) {
  finding.element = in_one_line(std::move(finding.element));
  finding.text = in_one_line(std::move(finding.text));
  std::string key = std::to_string(static_cast<int>(finding.kind));
  for (const std::string* part : {&finding.source.file, &finding.element, &finding.text}) {
    key += '\0';
    key += *part;
  }
  key += '\0' + std::to_string(finding.source.line);
  if (seen_.insert(std::move(key)).second) list_.push_back(std::move(finding));
}

void Findings::error(const InputError& caught, const std::string& element,
                     const std::string& text) {
  const auto* not_finite = dynamic_cast<const NotFinite*>(&caught);
  if (refuses_not_finite_ && not_finite) throw NotFinite(*not_finite);
  error(caught.source(), element, text);
}

}  // namespace ruedo
