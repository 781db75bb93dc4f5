// Sensors and drives that call those of plugins, and the message if a call does not return.
#include "system/plugin_guard.h"

#include <algorithm>
#include <cfenv>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <utility>
#include <vector>

#include <cxxabi.h>
#include <unistd.h>

#include "base/message_size.h"
#include "base/utf8.h"
#include "ruedo/errors.h"

namespace ruedo {
namespace {

constexpr int kFailed = 4;            // exit code
constexpr size_t kLongestText = 500;  // characters of what a plugin says

thread_local const char* at_work = nullptr;  // the plugin whose code this thread is in, or null

// This thread is in a plugin's code. Its changes of this thread's arithmetic end with it.
class Call {
 public:
  explicit Call(const std::string& who) : before_(std::exchange(at_work, who.c_str())) {
    std::fegetenv(&arithmetic_);
  }
  ~Call() {
    std::fesetenv(&arithmetic_);
    at_work = before_;
  }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;

 private:
  const char* const before_;
  std::fenv_t arithmetic_;
};

// One line of bounded length.
std::string line(const char* said) {
  const std::string text = in_one_line(for_terminal(shortened(said, kLongestText)));
  return text.empty() ? "threw an error without a text" : text;
}

template <class Function>
auto call(const std::string& who, Function function) {
  const Call here(who);
  try {
    return function();
  } catch (const InputError&) {
    throw;  // names file and line
  } catch (const ArchiveError&) {
    throw;  // a snapshot that cannot be
  } catch (const std::exception& error) {
    throw std::runtime_error(who + ": " + line(error.what()));
  } catch (abi::__forced_unwind&) {
    std::terminate();  // the thread is Ruedo's, which cannot go on without it
  } catch (...) {
    throw std::runtime_error(who + ": threw something other than a std::exception");
  }
}

// Only what is safe in a signal handler.
void say(const char* what) {
  for (const char* text : {"ruedo: ", at_work, ": ", what, "\n"}) {
    if (write(STDERR_FILENO, text, std::strlen(text)) < 0) return;
  }
}

void on_exit() {
  if (!at_work) return;
  say("ended the process");
  std::_Exit(kFailed);
}

std::terminate_handler before_terminate = nullptr;

[[noreturn]] void on_terminate() {
  if (at_work) {
    say("ended the process by std::terminate()");
    std::_Exit(kFailed);
  }
  if (before_terminate) before_terminate();
  std::abort();
}

void on_crash(int signal) {
  if (at_work) {
    const char* name = signal == SIGSEGV   ? "crashed: SIGSEGV, a wrong address"
                       : signal == SIGBUS  ? "crashed: SIGBUS, a wrong address"
                       : signal == SIGFPE  ? "crashed: SIGFPE, a wrong calculation"
                       : signal == SIGABRT ? "crashed: SIGABRT"
                                           : "crashed: SIGILL, a wrong instruction";
    say(name);
  }
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

std::string fingerprint_text(uint64_t fingerprint) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(fingerprint));
  return text;
}

class GuardedSensor : public Sensor {
 public:
  GuardedSensor(const SensorKind& kind, const SensorSetup& setup, const std::string& plugin)
      : who_("the plugin " + plugin + ", " + setup.robot + "/" + setup.device) {
    SensorSetup own = setup;
    own.add_channel = [this, announce = setup.add_channel](
                          const std::string& suffix, const std::string& type, int64_t fingerprint) {
      return add_channel(announce, suffix, type, fingerprint);
    };
    sensor_ = call(who_, [&] { return kind.make(own); });
    made_ = true;
    if (!sensor_) throw std::runtime_error(who_ + ": its kind made no sensor");
  }
  ~GuardedSensor() override {
    const Call here(who_);
    sensor_.reset();
  }
  GuardedSensor(const GuardedSensor&) = delete;
  GuardedSensor& operator=(const GuardedSensor&) = delete;

  void observe(const Snapshot& snapshot, Outbox& out) override {
    const size_t before = out.entries().size();
    call(who_, [&] { sensor_->observe(snapshot, out); });
    check(out, before, snapshot.step);
  }
  bool observes() const override {
    return call(who_, [&] { return sensor_->observes(); });
  }
  void sample(const SampleInput& input, Outbox& out) override {
    const size_t before = out.entries().size();
    call(who_, [&] { sensor_->sample(input, out); });
    check(out, before, input.snapshot.step);
  }
  bool wants_visual_rays() const override {
    return call(who_, [&] { return sensor_->wants_visual_rays(); });
  }
  void shift_time(SimTime us) override {
    call(who_, [&] { sensor_->shift_time(us); });
  }
  bool copy_from(const Sensor& other) override {
    return call(who_, [&] {
      return sensor_->copy_from(*static_cast<const GuardedSensor&>(other).sensor_);
    });
  }
  bool exchange_state(StateArchive& archive) override {
    return call(who_, [&] { return sensor_->exchange_state(archive); });
  }
  void describe(device_info_t& info) const override {
    call(who_, [&] { sensor_->describe(info); });
  }

 private:
  struct Announced {
    int channel;
    std::string type;
    uint64_t fingerprint;
  };
  using Announce = std::function<int(const std::string&, const std::string&, int64_t)>;

  int add_channel(const Announce& announce, const std::string& suffix, const std::string& type,
                  int64_t fingerprint) {
    if (made_) throw std::logic_error("channels are announced while the sensor is made, not later");
    for (const std::string& text : {suffix, type}) {
      if (const auto wrong = std::find_if(text.begin(), text.end(),
                                          [](unsigned char c) { return c <= ' ' || c >= 0x7f; });
          wrong != text.end()) {
        throw std::logic_error("'" + line(text.c_str()) +
                               "' is not a name of a channel or a type: printable ASCII characters "
                               "without spaces are allowed");
      }
    }
    if (type.empty()) throw std::logic_error("a channel's type has no name");
    const int channel = announce(suffix, type, fingerprint);
    announced_.push_back({channel, type, static_cast<uint64_t>(fingerprint)});
    return channel;
  }

  void check(const Outbox& out, size_t before, int64_t step) const {
    const auto wrong = [&](const std::string& what) {
      throw std::runtime_error(who_ + ": " + what);
    };
    const std::vector<Outbox::Entry>& entries = out.entries();
    if (entries.size() < before) wrong("took back messages of other sensors");
    for (size_t i = before; i < entries.size(); ++i) {
      const Outbox::Entry& entry = entries[i];
      const auto announced =
          std::find_if(announced_.begin(), announced_.end(),
                       [&](const Announced& one) { return one.channel == entry.channel; });
      if (announced == announced_.end())
        wrong("published on the channel " + std::to_string(entry.channel) +
              ", which it did not announce");
      if (entry.step != step)
        wrong("published for step " + std::to_string(entry.step) + " in step " +
              std::to_string(step));
      if (entry.size > kLargestMessage)
        wrong("published a message of " + std::to_string(entry.size) + " bytes; at most " +
              std::to_string(kLargestMessage) + " are allowed");
      uint64_t found = 0;
      for (size_t k = 0; k < 8 && k < entry.size; ++k) found = found << 8 | out.data(entry)[k];
      if (entry.size < 8 || found != announced->fingerprint)
        wrong("published a message of another type (fingerprint " + fingerprint_text(found) +
              ") than it announced, " + announced->type + " (" +
              fingerprint_text(announced->fingerprint) + ")");
    }
  }

  const std::string who_;
  bool made_ = false;
  std::vector<Announced> announced_;
  std::unique_ptr<Sensor> sensor_;
};

class GuardedDrive : public DriveModel {
 public:
  GuardedDrive(const DriveKind& kind, const DriveSetup& setup, const std::string& plugin)
      : who_("the plugin " + plugin + ", " + setup.robot + "'s drive '" + kind.type + "'"),
        drive_(call(who_, [&] { return kind.make(setup); })) {
    if (!drive_) throw std::runtime_error(who_ + ": its kind made no drive");
  }
  ~GuardedDrive() override {
    const Call here(who_);
    drive_.reset();
  }
  GuardedDrive(const GuardedDrive&) = delete;
  GuardedDrive& operator=(const GuardedDrive&) = delete;

  BaseVelocity step(const DriveInput& input) override {
    return call(who_, [&] { return drive_->step(input); });
  }
  bool copy_from(const DriveModel& other) override {
    return call(who_,
                [&] { return drive_->copy_from(*static_cast<const GuardedDrive&>(other).drive_); });
  }

 private:
  const std::string who_;
  std::unique_ptr<DriveModel> drive_;
};

}  // namespace

SensorKind guarded(SensorKind kind, const std::string& plugin) {
  const std::string who = "the plugin " + plugin;
  SensorKind made = kind;
  if (kind.drive_rate) {
    made.drive_rate = [who, rate = kind.drive_rate](const world::DriveDescription& drive) {
      return call(who, [&] { return rate(drive); });
    };
  }
  if (kind.settings) {
    made.settings = [who, settings = kind.settings](const std::string& type) {
      return call(who, [&] { return settings(type); });
    };
  }
  made.make = [kind = std::move(kind),
               plugin](const SensorSetup& setup) -> std::unique_ptr<Sensor> {
    return std::make_unique<GuardedSensor>(kind, setup, plugin);
  };
  return made;
}

DriveKind guarded(DriveKind kind, const std::string& plugin) {
  DriveKind made = kind;
  made.make = [kind = std::move(kind),
               plugin](const DriveSetup& setup) -> std::unique_ptr<DriveModel> {
    return std::make_unique<GuardedDrive>(kind, setup, plugin);
  };
  return made;
}

void watch_plugin_calls() {
  static const bool once = [] {
    std::atexit(on_exit);
    std::at_quick_exit(on_exit);
    before_terminate = std::set_terminate(on_terminate);
    for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
      struct sigaction now{};
      if (sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_DFL)
        std::signal(signal, on_crash);
    }
    return true;
  }();
  static_cast<void>(once);
}

}  // namespace ruedo
