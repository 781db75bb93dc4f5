// The one place where commands meet the console.
#include "cli/support/view.h"

#include <fmt/format.h>

#include "base/channel_names.h"
#include "ruedo/errors.h"

#ifdef RUEDO_CONSOLE

#include <filesystem>

#include "base/whole.h"
#include "cli/logs/logged_run.h"
#include "console/console.h"
#include "console/live_source.h"
#include "console/log_page.h"
#include "console/log_source.h"
#include "console/tap.h"
#include "engine/outcome.h"
#include "http/web_server.h"
#include "log/header.h"
#include "ruedo/world_info_t.hpp"
#include "run/run.h"
#include "system/to_stderr.h"

namespace ruedo::cli {
namespace {

// For logs that a page records. A page on another machine does not learn where files are.
std::vector<uint8_t> log_header(run::Run& run, uint64_t seed,
                                const std::vector<std::string>& options, bool with_folders) {
  log_header_t header = log::make_log_header(*run.world(), seed, options);
  const auto cut = [](std::string& path) {
    path = std::filesystem::path(path).filename().string();
  };
  if (!with_folders) {
    cut(header.world_file);
    for (log_file_t& file : header.files) cut(file.path);
  }
  return engine::encoded(header);
}

void print_urls(const console::Console& serving) {
  for (const std::string& url : serving.urls()) fmt::print("View it at {}\n", url);
  std::fflush(stdout);
}

}  // namespace

struct RunView::Impl {
  http::Address address;
  console::Tap tap;
  uint64_t seed = 0;  // of the run, and what else its log header says
  std::vector<std::string> result_options;
};

RunView::RunView(bool viewed, const std::string& address) {
  if (!viewed) return;
  impl_.reset(new Impl{http::parse_address(address), {}, 0, {}});
  http::check_port(impl_->address, "--view");
}

RunView::~RunView() = default;

void RunView::follow(run::RunOptions& options) {
  if (!impl_) return;
  impl_->seed = options.simulation.fleet.seed;
  impl_->result_options = options.result_options;
  options.hearer = [&tap = impl_->tap](const std::string& channel, const uint8_t* data,
                                       size_t size) { tap.hear(channel, data, size); };
}

std::shared_ptr<void> RunView::open(run::Run& run, const std::string& title,
                                    const std::string& save) {
  if (!impl_) return nullptr;
  console::Tap& tap = impl_->tap;
  run.add(tap);
  std::string info;
  for (const engine::Channel& channel : run.channels().list()) {
    if (channel.name == kInfoChannel) info = channel.bus_name;
  }
  console::LiveHost host{
      .world = [&run] { return run.world(); },
      .model_text = [&run](const std::string& name) { return run.model_text(name); },
      .on_message =
          [&run](const std::string& channel, std::span<const uint8_t> message) {
            run.on_message(channel, message.data(), message.size());
          },
      .lost = [&run] { return run.lost(); },
      .log_header =
          [&run, seed = impl_->seed, options = impl_->result_options,
           with_folders = impl_->address.loopback()] {
            return log_header(run, seed, options, with_folders);
          },
      .save_name = save.empty() ? "" : std::filesystem::path(save).filename().string()};
  auto source = std::make_unique<console::LiveSource>(tap, std::move(host), info);
  auto serving =
      std::make_shared<console::Console>(impl_->address, std::move(source), "live", title);
  print_urls(*serving);
  return serving;
}

std::shared_ptr<void> view_log(const std::string& log, const std::string& address, double speed,
                               const std::string& other, const std::function<void()>& ready) {
  const http::Address where = http::parse_address(address);
  auto source = std::make_unique<console::LogSource>(
      log, [&](const log_header_t& header) { return load_run(header, log); }, speed, other,
      [&](const log_header_t& header) { return load_run(header, other); });
  const std::string fault = source->fault();
  auto serving = std::make_shared<console::Console>(where, std::move(source), "log",
                                                    std::filesystem::path(log).filename().string());
  serving->end("ruedo play has ended.");
  if (!fault.empty()) to_stderr("ruedo: {}: {}\n", log, fault);
  ready();
  print_urls(*serving);
  return serving;
}

void write_page(const std::string& log, const std::string& path, double most_megabytes) {
  const console::LogPage page = console::write_log_page(
      log, [&](const log_header_t& header) { return load_run(header, log); }, path,
      whole<size_t>(most_megabytes * 1e6));
  std::string thinned;
  if (page.interval_s > 0)
    thinned += fmt::format(", a message of a channel each {:g} s", page.interval_s);
  if (page.pictures_s != 0)
    thinned += page.pictures_s < 0 ? ", without pictures"
                                   : fmt::format(", a picture each {:g} s", page.pictures_s);
  if (!page.fault.empty()) to_stderr("ruedo: {}: {}\n", log, page.fault);
  fmt::print("{}: {:.1f} MB{}\n", path, static_cast<double>(page.bytes) * 1e-6, thinned);
}

}  // namespace ruedo::cli

#else

namespace ruedo::cli {

namespace {

[[noreturn]] void no_console() {
  throw EnvironmentError(
      "this ruedo was built without the web console. Install nodejs, npm and libwebsockets-dev, "
      "then "
      "configure with -DRUEDO_CONSOLE=ON and build again");
}

}  // namespace

struct RunView::Impl {};

RunView::RunView(bool viewed, const std::string&) {
  if (viewed) no_console();
}

RunView::~RunView() = default;

void RunView::follow(run::RunOptions&) {}

std::shared_ptr<void> RunView::open(run::Run&, const std::string&, const std::string&) {
  return nullptr;
}

std::shared_ptr<void> view_log(const std::string&, const std::string&, double, const std::string&,
                               const std::function<void()>&) {
  no_console();
}

void write_page(const std::string&, const std::string&, double) { no_console(); }

}  // namespace ruedo::cli

#endif
