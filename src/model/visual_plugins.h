// gz-sim's plugins Label and Thermal: what visuals are to segmentation, boxes and thermal cameras.
#pragma once

#include "model/world_model.h"

namespace ruedo::model {

// Gives the visuals of a model's own links their labels and temperatures. A visual's own plugin
// goes before its link's, and that before the model's.
void read_labels_and_temperatures(const Element& model_element, const std::string& where,
                                  Findings& findings, Model& model);

}  // namespace ruedo::model
