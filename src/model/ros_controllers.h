// Files of controllers of ROS 1 (ros_controllers) and ROS 2 (ros2_controllers).
#pragma once

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/read_context.h"

namespace ruedo::model {

struct Controller {
  std::string name, type;                  // "diff_drive_controller/DiffDriveController"
  std::vector<const Element*> parameters;  // the maps that have them
  Source source;
};

// The first of these parameters that the controller has; "a.b" may be written nested or so.
const Element* parameter(const Controller& controller, std::initializer_list<const char*> names);
std::vector<std::string> names_in(const Element* list);  // of a list, or one
bool is_true(const Element* flag);
bool has_word(std::string_view words, std::string_view word);  // words with blanks between them
// A number's magnitude above 0; the controllers' "no limit" is 0, NaN or nothing.
std::optional<double> positive(const Element* written);

// One file may name the types, and another hold the parameters.
std::vector<Controller> controllers_in(const std::vector<std::unique_ptr<Element>>& files);

// Whether files of controllers say anything of a model.
bool is_controlled(const Element& model_element, const std::vector<const Element*>& plugins);
// The files in the folders of parameters of the package that `from` is in, then of those beside it,
// in the order of their names.
std::vector<std::string> files_beside(const std::string& from);
// Those that the plugins of ros_control name; one that is not found is told.
std::vector<std::string> named_files(const std::vector<const Element*>& plugins,
                                     const std::vector<std::string>& beside,
                                     const std::string& where, ReadContext& context);
// Null: it holds no controllers, or is not YAML, which is reported where a plugin names the file.
std::unique_ptr<Element> read_controllers(const std::string& path, bool named,
                                          const std::string& where, ReadContext& context);

}  // namespace ruedo::model
