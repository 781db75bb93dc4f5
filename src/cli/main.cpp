// ruedo: reads the command line, runs one command, and turns what went wrong into one line and an
// exit code.
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <iostream>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "base/option_text.h"
#include "base/utf8.h"
#include "base/version.h"
#include "base/warnings.h"
#include "cli/support/argument_rules.h"
#include "cli/support/commands.h"
#include "cli/support/progress_line.h"
#include "log/header.h"
#include "physics/state_check.h"
#include "ruedo/element.h"
#include "ruedo/errors.h"
#include "system/installation.h"
#include "system/leftovers.h"
#include "system/to_stderr.h"

namespace {

using namespace ruedo::cli;

// A log message as one line of bounded length: it may quote foreign texts from the bus.
class LoggedText : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&,
              spdlog::memory_buf_t& line) override {
    const std::string text = ruedo::one_line(
        ruedo::shortened({message.payload.data(), message.payload.size()}, ruedo::kLongestSaid));
    line.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<spdlog::custom_flag_formatter> clone() const override {
    return std::make_unique<LoggedText>();
  }
};

class KeptWarnings : public spdlog::sinks::base_sink<std::mutex> {
  void sink_it_(const spdlog::details::log_msg& message) override {
    ruedo::keep_warning(message.level == spdlog::level::warn ? "warning" : "error",
                        {message.payload.data(), message.payload.size()});
  }
  void flush_() override {}
};

void set_up_logging() {
  spdlog::set_default_logger(spdlog::stderr_color_mt("ruedo"));
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<LoggedText>('*').set_pattern("%^ruedo: %l:%$ %*");
  spdlog::set_formatter(std::move(formatter));
  auto kept = std::make_shared<KeptWarnings>();
  kept->set_level(spdlog::level::warn);
  spdlog::default_logger()->sinks().push_back(std::move(kept));
}

void say(const std::string& text) {
  const Style style = style_of(stderr);
  ruedo::to_stderr("{}{}ruedo: {}{}{}\n", style.bold, style.red, style.off, text, style.off);
}

// A hint for an unknown argument: the nearest command or option.
std::string suggestion(const CLI::App& app, int argc, char** argv) {
  const CLI::App* command = &app;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    std::vector<std::string> known;
    if (word.rfind("--", 0) == 0) {
      for (const CLI::Option* option : command->get_options()) {
        for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
      }
    } else if (command == &app) {
      for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) {
        if (subcommand->get_name() == word) command = subcommand;
        known.push_back(subcommand->get_name());
      }
    } else {
      continue;
    }
    const std::string name = word.substr(0, word.find('='));
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string near = ruedo::nearest_word(name, known);
    if (!near.empty()) return "; did you mean '" + near + "'?";
    if (command == &app && word[0] != '-')
      return fmt::format("; there is no '{}', there are {}", word, fmt::join(known, ", "));
  }
  return "";
}

// In place of a standard stream that is closed, /dev/null: the next file that is opened would take
// its number, and a log get what is printed.
void open_standard_streams() {
  for (int stream = STDIN_FILENO; stream <= STDERR_FILENO; ++stream) {
    if (::fcntl(stream, F_GETFD) < 0) ::open("/dev/null", O_RDWR);  // the lowest that is free
  }
}

[[noreturn]] void fail_of_output() {
  throw ruedo::EnvironmentError(std::string("standard output cannot be written: ") +
                                std::strerror(errno));
}

// The rest of the output may meet a full disk. A reader that has closed the pipe, as `| head` does,
// needs no more.
void flush_output() {
  if (std::fflush(stdout) != 0 && errno != EPIPE) fail_of_output();
}

// An empty variable counts as one that is not set, here and in the libraries: TMPDIR= is no folder.
void forget_empty_variables() {
  constexpr std::string_view kOurs[] = {"RUEDO_",   "LCM_",       "ROS_",     "TMP",        "TEMP",
                                        "NO_COLOR", "PYTHONHOME", "OPENSSL_", "CYCLONEDDS_"};
  std::vector<std::string> empty;
  for (char** at = environ; at != nullptr && *at != nullptr; ++at) {
    const std::string_view variable = *at;
    const bool ours = std::any_of(std::begin(kOurs), std::end(kOurs),
                                  [&](auto beginning) { return variable.starts_with(beginning); });
    if (ours && variable.find('=') + 1 == variable.size())
      empty.emplace_back(variable.substr(0, variable.size() - 1));
  }
  for (const std::string& name : empty) ::unsetenv(name.c_str());
}

// Checks resources without which threads and libraries would hang or crash, while an error can
// still be reported.
void check_limits() {
  constexpr rlim_t kFiles = 64, kMemory = rlim_t{1024} << 20, kStack = rlim_t{1} << 20;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < kFiles) {
    throw ruedo::EnvironmentError(
        fmt::format("{} open files are allowed here, and {} are needed: ulimit -n {}",
                    limit.rlim_cur, kFiles, kFiles));
  }
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur < kMemory) {
    throw ruedo::EnvironmentError(
        fmt::format("{} MB of address space are allowed here, and {} are needed: ulimit -v {}",
                    limit.rlim_cur >> 20, kMemory >> 20, kMemory >> 10));
  }
  if (getrlimit(RLIMIT_STACK, &limit) == 0 && limit.rlim_cur < kStack) {  // of every thread, too
    throw ruedo::EnvironmentError(
        fmt::format("{} kB of stack are allowed here, and {} are needed: ulimit -s {}",
                    limit.rlim_cur >> 10, kStack >> 10, kStack >> 10));
  }
}

// A folder or file that comes with the program, for what is built on it: printed in place of
// running a command.
void add_place(CLI::App& app, const std::string& option, const std::string& path, int above,
               const std::string& description) {
  const auto show = [=] {
    const std::string found = ruedo::find_installed(path);
    if (found.empty())
      throw ruedo::EnvironmentError("there is no " + path +
                                    " beside this program: it was not installed, or without that");
    std::filesystem::path place = found;
    for (int i = 0; i < above; ++i) place = place.parent_path();
    throw CLI::CallForVersion(place.string(), 0);
  };
  app.add_flag_callback(option, show, description);
}

// Added to each command that has no such option, and does not pass its arguments to another
// program.
void add_quiet(CLI::App& app) {
  const std::string description = "do not show on a terminal how far it is";
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (!command->get_prefix_command() && command->get_option_no_throw("--quiet") == nullptr)
      command->add_flag("--quiet", description);
  }
}

// For scripts: `ruedo --version --json`.
std::string version_as_json() {
#ifdef RUEDO_CONSOLE
  constexpr bool kConsole = true;
#else
  constexpr bool kConsole = false;
#endif
#ifdef RUEDO_ROS2
  constexpr bool kRos2 = true;
#else
  constexpr bool kRos2 = false;
#endif
  return fmt::format("{{\"version\": \"{}\", \"build\": \"{}\", \"console\": {}, \"ros2\": {}}}\n",
                     ruedo::version(), ruedo::log::own_sources(), kConsole, kRos2);
}

int run(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words == std::vector<std::string>{"--version", "--json"}) {
    fmt::print("{}", version_as_json());
    flush_output();
    return kGood;
  }
  CLI::App app{
      "Ruedo: a simulation server for mobile robots. Robots are data servers; LCM carries commands "
      "in and sensor streams out.",
      "ruedo"};
  app.set_version_flag("--version", std::string("ruedo ") + ruedo::version(),
                       "print the version and exit; with --json also the build and its parts");
  add_place(app, "--prefix", "share/ruedo/worlds", 3,
            "print where Ruedo is installed, for CMAKE_PREFIX_PATH, and exit");
  add_place(app, "--jar", "share/java/ruedo.jar", 0,
            "print where the Java client is, for the class path, and exit");
  app.require_subcommand(1);
  app.failure_message(CLI::FailureMessage::simple);
  app.footer(
      "Exit codes: 0 good, 1 the check failed, 2 wrong usage, 3 bad input file, 4 environment, 5 a "
      "state that is not finite.");
  Action action;
  for (const RegisterCommand::Add add : registered_commands()) add(app, action);
  add_quiet(app);
  refuse_odd_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {  // --help, --version
      app.exit(error);
      if (!std::cout.flush() && errno != EPIPE) fail_of_output();
      flush_output();
      return kGood;
    }
    say(std::string(error.what()) + suggestion(app, argc, argv));
    ruedo::to_stderr("Run `ruedo --help`, or `ruedo COMMAND --help`.\n");
    return kWrongUsage;
  }
  check_limits();
  const CLI::App* command = app.get_subcommands().front();
  check_outputs(*command);
  const CLI::Option* quiet = command->get_option_no_throw("--quiet");
  if (quiet == nullptr ? !command->get_prefix_command() : quiet->empty()) begin_progress_line();
  const int code = action();
  flush_output();
  return code;
}

// Says what the std::exception is that is being handled, and returns the exit code.
int tell_error() {
  try {
    throw;
  } catch (const ruedo::InputError& error) {
    say(error.what());
    const ruedo::Source& source = error.source();
    return source.file.empty() || is_option(source) ? kWrongUsage : kBadInput;
  } catch (const ruedo::physics::StateError& error) {
    say(error.what());
    return kBrokenState;
  } catch (const std::bad_alloc&) {
    say("there is not enough memory");
  } catch (const std::filesystem::filesystem_error& error) {
    say(error.what());
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again)
      say("no thread can be started: raise ulimit -u, ulimit -v or a container's pids.max");
    else if (error.code() == std::errc::operation_not_permitted)
      say("no thread can be started: the system refuses the call clone3 (EPERM), as the seccomp "
          "profiles of older Docker versions do: update Docker and libseccomp, or start the "
          "container with --security-opt seccomp=unconfined");
    else
      say(error.what());
  } catch (const std::exception& error) {
    say(error.what());
  }
  return kEnvironment;
}

// Where no handler catches it: in a thread that runs out of memory.
[[noreturn]] void end_with_error() {
  if (!std::current_exception()) std::abort();
  int code = kEnvironment;
  try {
    ruedo::remove_leftovers();
    code = tell_error();
  } catch (const std::bad_alloc&) {  // not even for these
    constexpr std::string_view kText = "ruedo: there is not enough memory\n";
    [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, kText.data(), kText.size());
  }
  std::_Exit(code);
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_streams();
  forget_empty_variables();
  // A write beyond `ulimit -f` then fails as on a full disk. Not SIG_IGN, which children inherit.
  std::signal(SIGXFSZ, [](int) {});
  std::signal(SIGCHLD, SIG_DFL);  // a parent that ignores it would have our children lost
  set_up_logging();
  std::set_terminate(end_with_error);
  try {
    return run(argc, argv);
  } catch (const std::exception&) {
    return tell_error();
  }
}
