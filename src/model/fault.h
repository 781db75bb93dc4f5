// Faults: what goes wrong with a robot in a run, from a time on and for a while. They are inputs of
// the run, like commands: from the world's file (<ruedo:fault>), an option (--fault), or a client
// (ROBOT/fault).
#pragma once

#include <string>
#include <vector>

#include "ruedo/errors.h"

namespace ruedo::model {

struct Fault {
  std::string robot;        // "": the first of the world
  std::string target;       // a device; for wheels and motors "left", "right" or "" for both
  std::string kind;         // see fault_kinds()
  double at_s = 0.0;        // sim time
  double duration_s = 0.0;  // 0: to the end
  double value = 0.0;
  double from = 0.0, to = 1.0;             // of the field of view, blocked
  double x = 0.0, y = 0.0, heading = 0.0;  // m, m, rad, kidnapped
  Source source;                           // file "": an option
};

struct FaultKind {
  enum class Of { device, wheels, robot, world };
  std::string name;
  Of of;
  double least, most;   // of the value; equal: it has none
  std::string meaning;  // of the value, with its unit
};
const std::vector<FaultKind>& fault_kinds();
const FaultKind* find_fault_kind(const std::string& name);

// What is wrong with it, with what is allowed; "": nothing. Whether there is such a robot or
// device, it cannot say.
std::string check_fault(const Fault& fault);

// --fault [ROBOT][/TARGET]:KIND@AT[,for=S][,value=V][,from=A][,to=B][,x=X][,y=Y][,heading=H].
// Throws InputError.
Fault parse_fault(const std::string& text);

}  // namespace ruedo::model
