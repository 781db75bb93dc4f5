// Commands that are written in Python, in the package `ruedo` of this installation.
#pragma once

#include <string>
#include <vector>

namespace ruedo::cli {

// Replaces this process by Python, which runs main() of `module` with these words. extras: what pip
// installs where a package is missing, for its error. Throws EnvironmentError without a Python.
int hand_over_to_python(const std::string& module, const std::string& extras,
                        const std::vector<std::string>& words);

}  // namespace ruedo::cli
