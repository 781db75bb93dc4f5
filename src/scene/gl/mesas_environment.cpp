// The process's array of variables is exchanged for another, whole: setting and removing single
// ones would move them under the eyes of other threads.
#include "scene/gl/mesas_environment.h"

#include <unistd.h>

#include <algorithm>
#include <deque>
#include <string_view>

namespace ruedo::scene {
namespace {

// The names of Mesa's variables begin so, those of its drivers and of its OpenGL for EGL, too.
constexpr std::string_view kOfMesa[] = {
    "MESA_", "mesa_",  "GALLIUM_", "GALLIVM_", "LP_",       "DRAW_",  "LIBGL_",
    "DRI_",  "EGL_",   "GLSL_",    "NIR_",     "SOFTPIPE_", "ST_",    "TGSI_",
    "ZINK_", "D3D12_", "U_",       "UTIL_",    "vblank_",   "force_", "allow_"};
// But these say where files lie, and how many threads draw.
constexpr std::string_view kHarmless[] = {"MESA_SHADER_CACHE_", "MESA_GLSL_CACHE_",
                                          "LIBGL_DRIVERS_PATH=", "LP_NUM_THREADS="};

char cache_as_database[] = "MESA_DISK_CACHE_DATABASE=true";
char cpu[] = "GALLIUM_OVERRIDE_CPU_CAPS=sse4.1";

std::mutex mutex;
bool fast = false, heeds = false;

template <size_t kCount>
bool begins_with_one_of(std::string_view text, const std::string_view (&beginnings)[kCount]) {
  return std::any_of(std::begin(beginnings), std::end(beginnings),
                     [&](std::string_view beginning) { return text.starts_with(beginning); });
}

bool is_mesas(std::string_view variable) {
  return begins_with_one_of(variable, kOfMesa) && !begins_with_one_of(variable, kHarmless);
}

std::vector<char*> mesas_view(char** all) {
  std::vector<char*> view = {cache_as_database};
#ifdef __x86_64__
  if (!fast && __builtin_cpu_supports("sse4.1")) view.push_back(cpu);
#endif
  for (; all != nullptr && *all != nullptr; ++all) {
    if (heeds || !is_mesas(*all)) view.push_back(*all);
  }
  view.push_back(nullptr);
  return view;
}

// Another thread may be reading an array: those that were in use stay. There is a new one only
// where variables have changed since.
char** kept(std::vector<char*> view) {
  static std::deque<std::vector<char*>> views;
  if (views.empty() || views.back() != view) views.push_back(std::move(view));
  return views.back().data();
}

}  // namespace

MesasEnvironment::MesasEnvironment()
    : alone_(mutex), before_(environ), ours_(kept(mesas_view(before_))) {
  environ = ours_;
}

MesasEnvironment::~MesasEnvironment() {
  if (environ == ours_) environ = before_;  // else a thread has set a variable meanwhile
}

std::vector<std::string> mesas_variables() {
  std::vector<std::string> variables;
  for (char** at = environ; at != nullptr && *at != nullptr; ++at) {
    if (is_mesas(*at)) variables.emplace_back(*at);
  }
  std::sort(variables.begin(), variables.end());
  return variables;
}

void draw_as_fast_as_it_goes() { fast = true; }
void heed_mesas_variables() { heeds = true; }
bool heeds_mesas_variables() { return heeds; }

}  // namespace ruedo::scene
