// gz-sim's plugins Label and Thermal: how visuals appear to segmentation, bounding-box and thermal
// cameras.
#pragma once

#include "world/model/world_model.h"

namespace ruedo::world {

// Sets labels and temperatures of the visuals of a model's own links. A visual's own plugin takes
// precedence over its link's, and that over the model's.
void read_labels_and_temperatures(const Element& model_element, const std::string& where,
                                  Findings& findings, Model& model);

}  // namespace ruedo::world
