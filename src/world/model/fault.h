// Faults: failures of a robot during a run, from a given time on, for a given duration. Like
// commands, they are inputs of the run: from the world file (<ruedo:fault>), an option (--fault),
// or a client (ROBOT/fault).
#pragma once

#include <string>
#include <vector>

#include "ruedo/errors.h"

namespace ruedo::world {

struct Fault {
  std::string robot;        // "": the world's first robot
  std::string target;       // a device; for wheels and motors "left", "right" or "" for both
  std::string kind;         // see fault_kinds()
  double at_s = 0.0;        // sim time
  double duration_s = 0.0;  // 0: to the end
  double value = 0.0;
  double from = 0.0, to = 1.0;             // blocked: part of the field of view
  double x = 0.0, y = 0.0, heading = 0.0;  // kidnapped: m, m, rad
  Source source;                           // file "": given by an option
};

struct FaultKind {
  enum class Of { device, wheels, robot, world };
  std::string name;
  Of of;
  double least, most;   // range of the value; equal: it takes no value
  std::string meaning;  // what the value means, with its unit
};
const std::vector<FaultKind>& fault_kinds();
const FaultKind* find_fault_kind(const std::string& name);

// The error in it and the allowed values; "": none. Does not check that the robot or device
// exists.
std::string check_fault(const Fault& fault);

// --fault [ROBOT][/TARGET]:KIND@AT[,for=S][,value=V][,from=A][,to=B][,x=X][,y=Y][,heading=H].
// Throws InputError.
Fault parse_fault(const std::string& text);

// The same without @AT, for a fault that begins when it is set. Throws InputError.
Fault parse_fault_from_now(const std::string& text);

}  // namespace ruedo::world
