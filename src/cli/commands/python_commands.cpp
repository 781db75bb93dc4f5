// ruedo campaign, hunt, why, fit, retrace, docs and course: written in Python, in the package
// `ruedo` of this installation, which this hands over to.
#include "cli/support/commands.h"
#include "cli/support/python.h"

namespace ruedo::cli {
namespace {

struct PythonCommand {
  const char *name, *description, *module, *extras;
};

void add(CLI::App& app, Action& chosen, const PythonCommand& one) {
  CLI::App* command = app.add_subcommand(one.name, one.description);
  command->prefix_command();  // Python reads what follows
  command->set_help_flag();
  command->callback([command, one, &chosen] {
    chosen = [command, one] {
      std::vector<std::string> words{one.name};
      const std::vector<std::string> rest = command->remaining();
      words.insert(words.end(), rest.begin(), rest.end());
      return hand_over_to_python(one.module, one.extras, words);
    };
  });
}

void add_python_commands(CLI::App& app, Action& chosen) {
  const char* campaigns = "ruedo.campaign.cli";
  const char* extras = "'ruedo[campaign]' (for hunts 'ruedo[hunt]', for clusters 'ruedo[ray]')";
  add(app, chosen,
      {"campaign",
       "many runs: worlds, parameters, seeds and controllers of one file, judged and reported",
       campaigns, extras});
  add(app, chosen,
      {"hunt", "search for the case that breaks a controller, and shrink it to a regression test",
       campaigns, extras});
  add(app, chosen,
      {"why",
       "find the last moment at which a failed run could have been saved, and the single changes "
       "that save it",
       campaigns, extras});
  add(app, chosen,
      {"fit", "fit a robot's errors to logs of the real one", "ruedo.fit.cli", "'ruedo[fit]'"});
  add(app, chosen,
      {"retrace", "drive a simulated robot along the path, or by the commands, of a real one",
       "ruedo.fit.cli", "'ruedo[fit]'"});
  add(app, chosen, {"docs", "open the documentation in a browser", "ruedo.docs", "'ruedo[docs]'"});
  add(app, chosen,
      {"course", "copy the course of eight evenings: notebooks, labs and their marking",
       "ruedo.course", "'ruedo'"});
}

const RegisterCommand kRegister{56, add_python_commands};

}  // namespace
}  // namespace ruedo::cli
