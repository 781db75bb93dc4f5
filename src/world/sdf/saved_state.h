// <state>: a world that was saved while running starts as it was saved, not at its models' own
// poses.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>

#include "ruedo/element.h"
#include "world/model/world_model.h"

namespace ruedo::world {

// In the syntax of SDF 1.12 (<model_state>, ...) and of earlier versions (<model>, ...).
class SavedState {
 public:
  SavedState(const Element& world, Findings& findings);

  // Applies a model's pose and joint positions; what cannot be applied is reported.
  void apply(const std::string& name, ModelInstance& instance, Findings& findings) const;
  void apply(Light& light) const;
  // Reports the states of models and lights that the world does not have.
  void name_strangers(const std::set<std::string>& models, const std::set<std::string>& lights,
                      Findings& findings) const;

 private:
  struct SavedModel {
    std::optional<Pose> X_WM;  // without, the model's own
    Source source;
    std::map<std::string, Pose> links;     // X_WL
    std::map<std::string, double> joints;  // rad or m, for the joints that are given
  };
  void read_model(const Element& element, Findings& findings);
  void read_light(const Element& element, Findings& findings);
  void read_parts(const Element& element, const std::string& prefix, const std::string& where,
                  SavedModel& saved, Findings& findings) const;

  std::map<std::string, SavedModel> models_;
  struct SavedLight {
    std::optional<Pose> pose;
    Source source;
  };
  std::map<std::string, SavedLight> lights_;
};

}  // namespace ruedo::world
