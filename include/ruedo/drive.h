// The interface for authors of drives: the real velocity of a base for a commanded one. A drive is
// one source file: a class derived from DriveModel, and one registration at its end.
// docs/plugins.md is the story.
//
// Commands, limits, motion primitives, the watchdog and contacts stay Ruedo's: a DriveModel stands
// between the planned velocity of a step and the motion of the wheels. Its result holds as long as
// nothing is touched; against contacts the base pushes with the drive's force, as the kinematic
// drive does.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ruedo/element.h"
#include "ruedo/pose.h"
#include "ruedo/sim_time.h"

namespace ruedo {

/// Velocity of base_link in its own plane, expressed in base_link.
struct BaseVelocity {
  double ahead = 0.0;  ///< m/s
  double left = 0.0;   ///< m/s
  double turn = 0.0;   ///< rad/s, positive to the left
};

/// The description with which a drive is made.
struct DriveSetup {
  const Element&
      element;        ///< its `<ruedo:drive type="...">`; children of one's own are read from it
  std::string robot;  ///< name
  double step_s;      ///< length of a step, s
};

/// The input of a drive for a step.
struct DriveInput {
  SimTime time;         ///< us, at the beginning of the step
  BaseVelocity asked;   ///< mean over the step, by the command in force, within the robot's limits
  BaseVelocity actual;  ///< at the beginning of the step: what contacts left of it
  const Pose& X_WBase;  ///< base_link in the world
};

/// One robot's drive. It reads its input, its configuration and its own state, and nothing else: no
/// clock, no other robot, no generator seeded by anything.
class DriveModel {
 public:
  virtual ~DriveModel() = default;
  /// Called once a step, in order; not while the robot rests.
  /// @param input the commanded velocity, and the current one
  /// @return the mean velocity of base_link over the step
  /// @throws std::exception ends the run, which prints its text
  virtual BaseVelocity step(const DriveInput& input) = 0;
  /// For snapshots of an engine: becomes what another one is, the same robot's in another copy of
  /// the world. Where all that it keeps are values: `*this = static_cast<const MyDrive&>(other)`.
  /// @param other made by the same kind from the same element
  /// @return false: it cannot; then a world with this drive has no snapshots
  virtual bool copy_from([[maybe_unused]] const DriveModel& other) { return false; }
};

/// A kind of drive: `<ruedo:drive type="TYPE">`.
struct DriveKind {
  std::string type;  ///< of the attribute
  /// Reads the element; throws InputError. Called again when the robot is put somewhere or reset.
  std::function<std::unique_ptr<DriveModel>(const DriveSetup&)> make;
};

/// All registered kinds.
/// @return sorted by type
const std::vector<DriveKind>& drive_kinds();

/// Put one at namespace scope in the drive's file: static const RegisterDrive kRegister{{...}};
struct RegisterDrive {
  /// @param kind one of its own type
  explicit RegisterDrive(DriveKind kind);
};

}  // namespace ruedo
