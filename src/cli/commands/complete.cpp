// ruedo complete -- WORD... =LAST: the candidates for the last word of a command line, for the
// completion of shells (packaging/completion). It is not among the commands of --help. The last
// word has a = before it, since it may be empty.
//
// It prints one word a line, then "files" in a line of its own, with a space before it, if a
// file is allowed there, too.
#include <algorithm>

#include <fmt/format.h>

#include "cli/support/commands.h"
#include "engine/fleet.h"
#include "engine/world_info.h"
#include "ruedo/errors.h"
#include "world/model/fault.h"
#include "world/world_name.h"

namespace ruedo::cli {
namespace {

using Words = std::vector<std::string>;

constexpr const char* kFiles = " files";

// The values of CLI::IsMember, which are in the option's type: "TEXT:{pause,drop,fail}".
Words members(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const size_t begin = type.find('{'), end = type.find('}');
  if (begin == type.npos || end == type.npos) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

// ROBOT/DEVICE of the first of the words that is a world.
Words devices(const Words& words) {
  for (const std::string& word : words) {
    try {
      WorldArguments arguments;
      arguments.world = word;
      const std::shared_ptr<const world::WorldModel> world = load(arguments);
      const world::BodyLayout layout(*world);
      engine::Channels channels;
      Findings findings;
      const engine::Fleet fleet = engine::make_fleet(*world, layout, {}, channels, findings);
      Words found;
      for (const world_info_t& part :
           engine::make_world_info({}, *world, layout, fleet.devices, channels)) {
        for (const device_info_t& device : part.devices)
          found.push_back(device.robot + "/" + device.name);
      }
      return found;
    } catch (const InputError&) {
      continue;
    }
  }
  return {};
}

// ROBOT/DEVICE:KIND@, up to the part that is being written.
Words faults(const Words& words, const std::string& begun) {
  const size_t colon = begun.find(':');
  if (colon == begun.npos) return devices(words);
  Words found;
  for (const world::FaultKind& kind : world::fault_kinds())
    found.push_back(begun.substr(0, colon + 1) + kind.name + "@");
  return found;
}

Words values(const CLI::Option& option, const Words& words, const std::string& begun) {
  const std::string type = option.get_type_name();
  if (Words found = members(option); !found.empty()) return found;
  if (type.starts_with("DEVICE") || type.starts_with("SETTING")) return devices(words);
  if (type.starts_with("FAULT")) return faults(words, begun);
  if (type.starts_with("URL")) return {"auto", "memq://", "tcpq://127.0.0.1:7700"};
  if (type.starts_with("R|max")) return {"1", "max"};
  return {kFiles};
}

Words options_of(const CLI::App& command) {
  Words found;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) found.push_back("--" + name);
  }
  return found;
}

Words candidates(const CLI::App& app, const Words& words) {
  const std::string& begun = words.back();
  if (words.size() == 1) {
    Words found;
    for (const CLI::App* command :
         app.get_subcommands([](const CLI::App* each) { return !each->get_group().empty(); }))
      found.push_back(command->get_name());
    return begun.starts_with('-') ? options_of(app) : found;
  }
  const std::vector<const CLI::App*> named =
      app.get_subcommands([&](const CLI::App* each) { return each->get_name() == words.front(); });
  if (named.empty()) return {kFiles};
  const CLI::App* command = named.front();
  const std::string& before = words[words.size() - 2];
  const CLI::Option* option =
      before.starts_with("--") ? command->get_option_no_throw(before) : nullptr;
  if (option != nullptr && option->get_expected_min() > 0) return values(*option, words, begun);
  if (begun.starts_with('-')) return options_of(*command);
  Words found;
  if (command->get_option_no_throw("WORLD") != nullptr) found = world::world_names();
  found.emplace_back(kFiles);
  return found;
}

void add_complete(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand("complete", "words for the completion of shells");
  command->group("");
  const auto given = std::make_shared<Words>();
  command->add_option("WORDS", *given, "after --: the words of the line, without ruedo");
  command->callback([given, &app, &chosen] {
    chosen = [given, &app] {
      Words& words = *given;
      if (words.empty() || !words.back().starts_with('='))
        throw InputError({}, "complete: the last word has to begin with =");
      words.back().erase(0, 1);
      for (const std::string& word : candidates(app, words)) {
        if (word == kFiles || word.starts_with(words.back())) fmt::print("{}\n", word);
      }
      return kGood;
    };
  });
}

const RegisterCommand kRegister{900, add_complete};

}  // namespace
}  // namespace ruedo::cli
