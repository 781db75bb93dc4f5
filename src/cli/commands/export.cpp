// ruedo export: a log as an MCAP file with Foxglove's message types, or as a ROS 2 bag.
#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>

#include <fmt/format.h>

#include "bridges/foxglove/foxglove.h"
#include "bridges/ros2/bag/rosbag.h"
#include "cli/logs/logged_run.h"
#include "cli/support/commands.h"
#include "cli/support/extensions.h"
#include "cli/support/sandboxed.h"
#include "cli/support/signal_thread.h"
#include "log/reader.h"
#include "ruedo/errors.h"
#include "run/repeat/log_worlds.h"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

struct ExportArguments {
  bool sandboxed = false, distro_given = false;
  std::string log, out, bag, distro = "jazzy";
  std::vector<std::string> remaps;
};

// The format has no times before 0; the reader lets pass none whose nanoseconds do not fit.
uint64_t nanoseconds(SimTime time_us) {
  return static_cast<uint64_t>(std::max(time_us, SimTime{0})) * 1000;
}

// So many bytes of a log foretell how large the whole will be.
constexpr int64_t kForetells = int64_t{16} << 20;

// Passes every message to `out`, and notifies it of another world. size: of the file until now.
// Returns the number of messages.
template <class Export>
uint64_t read_log(const std::string& path, const log::Index& index, const run::LogWorlds& worlds,
                  Export& out, const std::function<uint64_t()>& size) {
  log::Reader log(path, "exporting");
  const run::LogWorlds::Scene* scene = nullptr;
  log::Event event;
  SimTime now_us = index.begin_us();
  uint64_t read = 0;
  bool told = log.size() < 4 * kForetells;
  while (log.next(event)) {
    if (!told && log.offset() > kForetells) {
      told = true;
      const double share = static_cast<double>(size()) / static_cast<double>(log.offset());
      const double megabytes = static_cast<double>(log.size()) * 1e-6;
      to_stderr("ruedo: {} has {:.0f} MB; what is written will have about {:.0f} MB\n", path,
                megabytes, share * megabytes);
    }
    now_us = std::max(now_us, event.timestamp_us);  // as in the index: times never go back
    if (const auto* next = &worlds.at(now_us); next != scene) {
      scene = next;
      out.begin_scene(*scene, nanoseconds(now_us));
    }
    out.add(event.channel, nanoseconds(now_us), event.data);
    ++read;
  }
  for (const std::string& fault : {worlds.fault(), log.fault()}) {
    if (!fault.empty()) to_stderr("ruedo: {}: {}\n", path, fault);
  }
  return read;
}

std::string without_slash(std::string folder) {
  while (folder.size() > 1 && folder.ends_with('/')) folder.pop_back();
  return folder;
}

void export_bag(const ExportArguments& arguments, const log::Index& index,
                const run::LogWorlds& worlds, const run::LoggedRun& logged) {
  ros2::ConversionOptions options;
  options.distro = ros2::parse_distro(arguments.distro);
  options.channels = logged.remaps;
  options.topics = parse_remaps(arguments.remaps);
  ros2::Rosbag bag(without_slash(arguments.bag), options);
  const uint64_t read =
      read_log(arguments.log, index, worlds, bag, [&] { return bag.find_size(); });
  bag.finish(index.header(), arguments.log);
  fmt::print(
      "{}: {} messages of {}, as {} of ROS 2's types; {} are of types that ROS 2 has no message "
      "for\n",
      arguments.bag, read, arguments.log, bag.messages(), bag.left_out());
}

void export_foxglove(const ExportArguments& arguments, const log::Index& index,
                     const run::LogWorlds& worlds) {
  log::McapWriter out(arguments.out);
  foxglove::FoxgloveFile file(out);
  foxglove::FoxgloveExport exported(file);
  const uint64_t read =
      read_log(arguments.log, index, worlds, exported, [&] { return out.size(); });
  out.finish();
  fmt::print("{}: {} messages of {}, as {} of Foxglove's and Ruedo's types", arguments.out, read,
             arguments.log, out.messages());
  if (exported.left_out() > 0)
    fmt::print("; {} of types that are not known, or damaged, are left out", exported.left_out());
  fmt::print("\n");
}

int export_log(const ExportArguments& arguments) {
  if (arguments.out.empty() == arguments.bag.empty())
    throw InputError({}, "give OUT, or --ros2 FOLDER");
  if (arguments.bag.empty() && (arguments.distro_given || !arguments.remaps.empty()))
    throw InputError({}, "--remap and --distro apply to a bag only: they need --ros2");
  read_given_types();
  if (arguments.sandboxed)
    enter_sandbox(arguments.log, {arguments.out, without_slash(arguments.bag)});
  const SignalThread signals;
  const log::Index index(arguments.log, log::Index::Keeps::changes);
  run::LoggedRun logged;
  const run::LogWorlds worlds(
      index, [&](const log_header_t& header) { return logged = load_run(header, arguments.log); });
  if (arguments.bag.empty())
    export_foxglove(arguments, index, worlds);
  else
    export_bag(arguments, index, worlds, logged);
  return kGood;
}

void add_export(CLI::App& app, Action& chosen) {
  CLI::App* command = app.add_subcommand(
      "export", "write a log as an MCAP file with Foxglove's message types, or as a ROS 2 bag");
  const auto arguments = std::make_shared<ExportArguments>();
  command->add_option("LOG", arguments->log, "a standard LCM log")->required();
  command->add_option("OUT", arguments->out, "the file to write, such as run.mcap");
  command->add_option("--ros2", arguments->bag, "write a ROS 2 bag into this new folder instead")
      ->type_name("FOLDER");
  CLI::Option* distro =
      command->add_option("--distro", arguments->distro, "the ROS 2 release that the bag is for");
  distro->capture_default_str();
  command->add_option("--remap", arguments->remaps, "give a ROS topic another name: /TOPIC=/NAME")
      ->type_name("REMAP")
      ->allow_extra_args(false);
  add_types_argument(*command);
  add_sandbox_argument(*command, arguments->sandboxed);
  command->callback([arguments, distro, &chosen] {
    arguments->distro_given = distro->count() > 0;
    chosen = [arguments] { return export_log(*arguments); };
  });
}

const RegisterCommand kRegister{53, add_export};

}  // namespace
}  // namespace ruedo::cli
