// ruedo experiments: the paper's experiments, run again.
#include "bench/experiments.h"
#include "cli/support/commands.h"

namespace ruedo::bench {
namespace {

void add_experiments(CLI::App& app, cli::Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "experiments",
      "run the experiments of the paper that Ruedo began with, and write a page about them");
  const auto out = std::make_shared<std::string>("experiments");
  command->add_option("--out", *out, "folder for the page and its pictures")
      ->type_name("FOLDER")
      ->capture_default_str();
  command->callback([out, &chosen] { chosen = [out] { return run_experiments(*out); }; });
}

const cli::RegisterCommand kRegister{80, add_experiments};

}  // namespace
}  // namespace ruedo::bench
