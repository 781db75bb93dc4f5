// The allowed range of an option: from least to most, both included. CLI::Range takes "nan", too.
#pragma once

#include <string>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

namespace ruedo::cli {

inline CLI::Validator within(double least, double most) {
  const std::string range = fmt::format("FLOAT in [{:g} - {:g}]", least, most);
  return {[=](std::string& text) {
            double value = 0;
            const bool good =
                CLI::detail::lexical_cast(text, value) && value >= least && value <= most;
            return good ? std::string()
                        : fmt::format("Value {} not in range {:g} to {:g}", text, least, most);
          },
          range};
}

}  // namespace ruedo::cli
