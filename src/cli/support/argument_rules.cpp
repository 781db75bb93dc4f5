#include "cli/support/argument_rules.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/utf8.h"
#include "ruedo/errors.h"

namespace fs = std::filesystem;

namespace ruedo::cli {
namespace {

constexpr std::array<std::string_view, 8> kOutputs{"record", "html",  "junit", "json",
                                                   "output", "video", "out",   "OUT"};

bool is_output(const CLI::Option& option) {
  const auto is = [&](const std::string& name) {
    return std::find(kOutputs.begin(), kOutputs.end(), name) != kOutputs.end();
  };
  return option.get_items_expected_max() > 0 &&
         (is(option.get_single_name()) ||
          std::any_of(option.get_lnames().begin(), option.get_lnames().end(), is));
}

// Names of files need not be UTF-8, so that only bytes below 0x80 are looked at, and C1 controls.
bool is_control(std::string_view text, size_t i) {
  const auto byte = static_cast<unsigned char>(text[i]);
  const auto before = static_cast<unsigned char>(i > 0 ? text[i - 1] : 0);
  return byte < 0x20 || byte == 0x7f || (before == 0xc2 && byte >= 0x80 && byte <= 0x9f);
}

std::string what_is_odd(const std::string& value) {
  if (value.empty()) return "an empty value is not allowed";
  for (size_t i = 0; i < value.size(); ++i) {
    if (is_control(value, i))
      return fmt::format("the control character {:#04x} is not allowed, in \"{}\"",
                         static_cast<unsigned char>(value[i]), for_terminal(value));
  }
  return "";
}

// A flag is given or not; the parser would take --no-contact=false.
std::string is_set(const std::string& value) {
  return value == "true" ? "" : "takes no value, not '" + value + "'";
}

}  // namespace

bool same_file(const std::string& a, const std::string& b) {
  std::error_code error;
  if (fs::is_regular_file(a, error)) return fs::equivalent(a, b, error);
  if (fs::exists(a, error)) return false;            // a device
  const auto to_be = [&](const std::string& file) {  // however it is written
    return fs::weakly_canonical(fs::absolute(file, error), error);
  };
  const fs::path one = to_be(a), other = to_be(b);
  return !error && one == other;
}

void refuse_odd_values(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    for (CLI::Option* option : command->get_options()) {
      if (option->get_items_expected_max() == 0) option->check(is_set);
      if (option->get_items_expected_min() == 0) continue;  // a flag, or a value may be left out
      option->check(what_is_odd);
    }
  }
}

std::string is_seed(const std::string& text) {
  uint64_t seed = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seed);
  if (error == std::errc() && end == text.data() + text.size()) return "";
  return "'" + text + "' is not allowed; a seed is a whole number from 0 to 18446744073709551615";
}

void check_outputs(const CLI::App& command) {
  const std::vector<const CLI::Option*> options =
      command.get_options([](const CLI::Option* option) { return option->count() > 0; });
  for (const CLI::Option* output : options) {
    if (!is_output(*output)) continue;
    for (const CLI::Option* other : options) {
      if (other == output) continue;
      for (const std::string& file : other->results()) {
        std::error_code error;
        if (!is_output(*other) && !fs::exists(file, error)) continue;  // a world's name
        if (!same_file(output->results().front(), file)) continue;
        throw InputError({}, output->get_name() + " is the same file as " + other->get_name() +
                                 ", which would be lost: " + file);
      }
    }
  }
}

}  // namespace ruedo::cli
