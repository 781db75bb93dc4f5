// Files of controllers of ROS 1 (ros_controllers) and ROS 2 (ros2_controllers).
#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "world/read/read_context.h"

namespace ruedo::world {

struct Controller {
  std::string name, type;                  // "diff_drive_controller/DiffDriveController"
  std::vector<const Element*> parameters;  // the maps that hold them
  size_t own = 1;  // how many of them are its own; the others are ROS 2's wildcards
  Source source;
};

// The type that one is mistyped for, by some letters; "": none. ROS would not load it.
std::string mistyped(const std::string& type);

// Without "$(arg NAME)": what a launch file would put there is not known, and mostly nothing.
std::string without_arguments(std::string text);

// The first of these parameters that the controller has; "a.b" may also be nested.
const Element* parameter(const Controller& controller, std::initializer_list<const char*> names);
// the texts of a list, or of a single value
std::vector<std::string> names_in(const Element* list);
bool is_true(const Element* flag);
bool has_word(std::string_view words, std::string_view word);  // words separated by blanks
// As YAML and ROS 2's own parser write them.
bool is_nan(const std::string& text);
bool is_infinite(const std::string& text);  // of either sign
// A size, from 0; 0, NaN or nothing mean that the controller has none.
std::optional<double> positive(const Element* written);
// A limit, likewise; infinity means unlimited. `signed_`: of a number that may be below 0, as those
// backwards are, the absolute value.
std::optional<double> limit_in(const Element* written, bool signed_ = false);

// The joints that a controller moves and the model does not have, in the words of a finding.
std::string unknown_joint(const Controller& controller, const std::string& joint);

// One file may give the types, and another the parameters.
std::vector<Controller> controllers_in(const std::vector<std::shared_ptr<const Element>>& files);
// Entries with wheels or joints like a controller's that belong to none of these: a type is
// missing.
std::vector<Controller> untyped_in(const std::vector<std::shared_ptr<const Element>>& files,
                                   const std::vector<Controller>& controllers);

// Whether controller files can concern a model.
bool is_controlled(const Element& model_element, const std::vector<const Element*>& plugins);
// Those named by ros_control's plugins; a missing one is reported.
std::vector<std::string> named_files(const std::vector<const Element*>& plugins,
                                     const std::vector<std::string>& beside,
                                     const std::string& where, ReadContext& context);
// Those that are YAML and may hold controllers. Of files that a plugin names, others are reported.
std::vector<std::shared_ptr<const Element>> read_controllers(const std::vector<std::string>& paths,
                                                             bool named, const std::string& where,
                                                             ReadContext& context);

}  // namespace ruedo::world
