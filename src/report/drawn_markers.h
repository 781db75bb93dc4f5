// The drawings of clients in a log over time, and their appearance in a picture.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "log/index.h"
#include "log/reader.h"
#include "ruedo/markers_t.hpp"
#include "scene/pictures/render_scene.h"

namespace ruedo::report {

class DrawnMarkers {
 public:
  using Layers = std::map<std::string, markers_t>;

  DrawnMarkers(const log::Index& index, const std::string& path);

  // The drawings at that time (of the log), which must not go back from call to call.
  const Layers& at(SimTime time_us);

 private:
  struct Place {
    SimTime time_us;
    int64_t offset;
  };

  log::Reader reader_;
  log::Event event_;
  std::vector<Place> places_;  // of messages that may have some, in the order of time
  size_t next_ = 0;
  Layers layers_;
};

// X_WF: of the frame that they stand in. Lines and points face the viewer; of a text what is not
// ASCII is a question mark.
void add_facets(const markers_t& markers, const Pose& X_WF, const scene::View& view,
                std::vector<scene::Facet>& facets);

}  // namespace ruedo::report
