// <link> and its contents: inertia, collisions, visuals, lights, sensors. Also <light> anywhere
// else.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// The pose of a link's child (<pose>, with relative_to) in the link's frame.
using PoseInLink = std::function<Pose(const Element&)>;

// The link, without its X_ML; its sensors are appended to `sensors`, with the index `link`. moves:
// not a part of a static model.
Link read_link(const Element& element, const PoseInLink& pose_in_link, const std::string& where,
               ReadContext& context, bool moves, ModelLinkIndex link,
               std::vector<SensorDescription>& sensors);

// A light at `pose`.
Light read_light(const Element& element, const Pose& pose, const std::string& where,
                 ReadContext& context);

// A sensor, with its name as written except that "::" becomes ".".
SensorDescription read_sensor(const Element& element, ModelLinkIndex link, const Pose& X_LS);

}  // namespace ruedo::world
