// A program that is run to its end for what it prints.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace ruedo {

// Its standard error: goes where ours goes, or nowhere.
enum class ItsErrors { shown, dropped };

// The output of words[0], a path, with these arguments. nullopt: it could not be started, or its
// exit code was not 0.
std::optional<std::string> output_of(std::vector<std::string> words, ItsErrors errors);

}  // namespace ruedo
