#include "scene/gl/gl_context.h"

#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "ruedo/errors.h"
#include "scene/gl/mesas_environment.h"
#include "system/enough_threads.h"
#include "system/late_library.h"

namespace ruedo::scene {
namespace {

constexpr int kMesasOwnThreads = 4;  // for its caches

std::atomic<pid_t> process_of_mesa{0};  // that of the first context

bool has_mesas_threads() {
  const pid_t here = ::getpid();
  pid_t first = 0;
  return process_of_mesa.compare_exchange_strong(first, here) || first == here;
}

void require_mesas_threads() {
  if (has_mesas_threads()) return;
  throw EnvironmentError(
      "a process that was forked from one with pictures can draw none: start it by \"spawn\", as "
      "with multiprocessing.get_context(\"spawn\"), or make_vec(..., vector_kwargs={\"context\": "
      "\"spawn\"}) of Gymnasium");
}

// At a program's end Mesa waits for its threads. Registered behind Mesa, this comes before it.
void end_without_mesas_threads(int code, void* /*unused*/) {
  if (has_mesas_threads()) return;
  std::fflush(nullptr);
  ::_exit(code);
}

// Mesa draws with threads of its own, which a fork does not inherit: it would wait for them for
// ever, to draw as to let go of a context.
class ContextOfProcess : public GlContext {
 public:
  explicit ContextOfProcess(std::unique_ptr<GlContext> context) : context_(std::move(context)) {
    static const int registered = ::on_exit(end_without_mesas_threads, nullptr);
    (void)registered;
  }
  ~ContextOfProcess() override {
    if (!has_mesas_threads()) (void)context_.release();
  }
  ContextOfProcess(const ContextOfProcess&) = delete;
  ContextOfProcess& operator=(const ContextOfProcess&) = delete;

  void make_current() override {
    require_mesas_threads();
    context_->make_current();
  }
  void release() override { context_->release(); }
  Function function(const char* name) const override { return context_->function(name); }
  std::string backend() const override { return context_->backend(); }

 private:
  std::unique_ptr<GlContext> context_;
};

}  // namespace

std::unique_ptr<GlContext> make_osmesa_context(std::string& why) {
#ifdef RUEDO_OSMESA
  auto* make = late_function<GlContext*(std::string&)>(LateLibrary::osmesa,
                                                       "ruedo_make_osmesa_context", why);
  return std::unique_ptr<GlContext>(make == nullptr ? nullptr : make(why));
#else
  why = "not built in (libosmesa6-dev was absent)";
  return nullptr;
#endif
}

std::unique_ptr<GlContext> make_gl_context() {
  const char* wanted = std::getenv("RUEDO_RENDERER");
  const std::string choice = wanted == nullptr ? "" : wanted;
  if (choice != "" && choice != "auto" && choice != "osmesa" && choice != "egl") {
    throw EnvironmentError("RUEDO_RENDERER=" + choice + ": allowed are osmesa, egl and auto");
  }
  require_mesas_threads();
  // Mesa has one for each core, and waits for ever for those that could not be started.
  require_threads_for_cores(kMesasOwnThreads);
  std::string heeded;
  for (const std::string& variable : mesas_variables()) heeded += " " + variable;
  const MesasEnvironment environment;
  std::string why_not_osmesa = "not tried", why_not_egl = "not tried";
  if (choice != "egl") {
    if (auto context = make_osmesa_context(why_not_osmesa))
      return std::make_unique<ContextOfProcess>(std::move(context));
  }
  if (choice != "osmesa") {
    if (auto context = make_egl_context(why_not_egl))
      return std::make_unique<ContextOfProcess>(std::move(context));
  }
  throw EnvironmentError(
      "no renderer for cameras. OSMesa: " + why_not_osmesa + "; EGL: " + why_not_egl +
      (heeds_mesas_variables() && !heeded.empty()
           ? ". --mesa-environment heeds" + heeded
           : ". Install one: pip install 'ruedo[camera]', or libosmesa6, or libegl1 "
             "with libgl1-mesa-dri"));
}

}  // namespace ruedo::scene
