// <link> and what it holds: inertia, collisions, visuals, lights, sensors. And <light>, wherever it
// is.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

// The pose of a link's child (its <pose>, relative_to included) in the link's frame.
using PoseInLink = std::function<Pose(const Element&)>;

// The link without its X_ML; its sensors are appended to `sensors` with the index `link`.
Link read_link(const Element& element, const PoseInLink& pose_in_link, const std::string& where,
               ReadContext& context, ModelLinkIndex link, std::vector<SensorDescription>& sensors);

// A light at `pose`.
Light read_light(const Element& element, const Pose& pose, const std::string& where,
                 ReadContext& context);

// A sensor; its name as written, with "::" as ".".
SensorDescription read_sensor(const Element& element, ModelLinkIndex link, const Pose& X_LS);

// Files of another layout than SDF's sensors say what plugins they name.
void collect_plugins(const Element& element, std::vector<const Element*>& plugins);

}  // namespace ruedo::model
