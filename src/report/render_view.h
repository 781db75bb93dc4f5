// Where ruedo render looks from: a pose on the command line, or one that frames the whole world.
#pragma once

#include <optional>
#include <string>

#include "ruedo/pose.h"
#include "scene/pictures/render_scene.h"

namespace ruedo::report {

struct Size {
  int width = 0, height = 0;  // pixels; 0: not given
};

// A finite number, all of the text; nullopt for other text.
std::optional<double> parse_number(const std::string& text);

// "WxH". Throws InputError.
Size parse_size(const std::string& text);

// text: "top" (parallel, from above, x to the right), "iso" (from above at an angle), or
// "x,y,z,roll,pitch,yaw" (m, rad; x ahead). bounds: of what there is to see; sunlight: which way it
// goes, so that iso looks at the lit sides. A size that is not given is chosen. Throws InputError.
scene::View parse_view(const std::string& text, Size size, const scene::Bounds& bounds,
                       const Vec3& sunlight);

}  // namespace ruedo::report
