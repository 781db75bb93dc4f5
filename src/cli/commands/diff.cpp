// ruedo diff: compares a log with a golden one, field by field, or two drives by their statistics.
#include <memory>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "base/utf8.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/python.h"
#include "log/diff.h"
#include "ruedo/errors.h"
#include "system/output_file.h"

namespace ruedo::cli {
namespace {

struct DiffArguments {
  std::string golden, other, junit, html, robot;
  std::vector<std::string> tolerances, ignored;
  bool partial = false, statistics = false, json = false;
};

int diff_statistics(const DiffArguments& arguments) {
  std::vector<std::string> words{"diff", arguments.golden, arguments.other};
  if (!arguments.html.empty()) words.push_back("--html=" + arguments.html);
  if (!arguments.robot.empty()) words.push_back("--robot=" + arguments.robot);
  if (arguments.json) words.emplace_back("--json");
  return hand_over_to_python("ruedo.fit.cli", "'ruedo[fit]'", words);
}

int diff(const DiffArguments& arguments) {
  if (arguments.statistics) return diff_statistics(arguments);
  read_given_types();
  const auto rules = log::DiffRule::all(arguments.tolerances, arguments.ignored);
  const log::Diff result =
      log::diff_logs(arguments.golden, arguments.other, rules, arguments.partial);
  for (const std::string& line : result.idle_rules) spdlog::warn(line);
  fmt::print("{}", for_terminal(log::diff_text(result)));
  if (!result.faults.empty() && !arguments.partial)
    fmt::print("(--partial is for a log that is known to be cut)\n");
  if (!arguments.junit.empty()) write_file(arguments.junit, log::diff_junit(result));
  if (!arguments.html.empty())
    write_file(arguments.html, log::diff_html(result, arguments.golden, arguments.other));
  return result.same() ? kGood : kCheckFailed;
}

void add_diff(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("diff", "compare a log with a golden one, field by field");
  const auto arguments = std::make_shared<DiffArguments>();
  command->add_option("GOLDEN", arguments->golden, "the log to compare with")->required();
  command->add_option("NEW", arguments->other, "the log to judge")->required();
  command
      ->add_option(
          "--tolerance", arguments->tolerances,
          "CHANNEL:FIELD=abs:1e-3,rel:0.01,angle:0.02; shell patterns; the last that fits counts")
      ->type_name("RULE")
      ->allow_extra_args(false);
  command->add_option("--ignore", arguments->ignored, "CHANNEL or CHANNEL:FIELD")
      ->type_name("PATTERN")
      ->allow_extra_args(false);
  command->add_flag("--partial", arguments->partial,
                    "accept a truncated log, and compare the messages that it has");
  command->add_option("--junit", arguments->junit, "write JUnit XML")->type_name("FILE");
  command->add_option("--html", arguments->html, "write a page with plots of what differs")
      ->type_name("FILE");
  add_types_argument(*command);
  CLI::Option* statistics =
      command->add_flag("--statistics", arguments->statistics,
                        "compare two drives, real or simulated, by their distributions");
  for (const char* other : {"--tolerance", "--ignore", "--partial", "--junit", "--types"})
    statistics->excludes(other);
  command
      ->add_option("--robot", arguments->robot,
                   "its model, for the place of its range finder, where a log does not say it")
      ->type_name("ROBOT")
      ->needs(statistics);
  command->add_flag("--json", arguments->json, "print the statistics as JSON")->needs(statistics);
  command->callback([arguments, &chosen] { chosen = [arguments] { return diff(*arguments); }; });
}

const RegisterCommand kRegister{50, add_diff};

}  // namespace
}  // namespace ruedo::cli
