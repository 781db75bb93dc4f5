// ruedo bench and ruedo experiments: a program of its own, ruedo-measure, so that the server does
// not contain the measurements.
#include <cerrno>
#include <cstring>

#include <unistd.h>

#include "cli/support/commands.h"
#include "ruedo/errors.h"
#include "system/installation.h"

namespace ruedo::cli {
namespace {

int pass_on(const std::string& command, const std::vector<std::string>& words) {
  const std::string program = find_installed("ruedo-measure");
  if (program.empty())
    throw EnvironmentError(
        "ruedo " + command +
        " is done by ruedo-measure, which is not beside this program: it was not installed");
  std::vector<char*> arguments{const_cast<char*>(program.c_str()),
                               const_cast<char*>(command.c_str())};
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  ::execv(program.c_str(), arguments.data());
  throw EnvironmentError(program + " cannot be started: " + std::strerror(errno));
}

// Options and help are that program's.
void add(CLI::App& app, Action& chosen, const std::string& name, const std::string& description) {
  CLI::App* command = app.add_subcommand(name, description);
  command->set_help_flag();
  command->prefix_command();
  command->callback([command, name, &chosen] {
    chosen = [name, words = command->remaining()] { return pass_on(name, words); };
  });
}

void add_all(CLI::App& app, Action& chosen) {
  add(app, chosen, "bench",
      "measure this machine: robots against real time, LCM, cameras, latency, rays");
  add(app, chosen, "experiments",
      "run the experiments of the paper that Ruedo began with, and write a page about them");
}

const RegisterCommand kRegister{80, add_all};

}  // namespace
}  // namespace ruedo::cli
