// The work of the program's end, which exit() and the return of main() wait for.
#pragma once

#include <functional>

namespace ruedo::client {

// The program's end calls it while this lives, after the destructors of static objects, in another
// thread, and waits for a moment: others would wait for a client in lockstep that does not say that
// it leaves, and an exit() destroys nothing of what is on stacks.
class AtProgramEnd {
 public:
  explicit AtProgramEnd(std::function<void()> call);
  ~AtProgramEnd();
  AtProgramEnd(const AtProgramEnd&) = delete;
  AtProgramEnd& operator=(const AtProgramEnd&) = delete;

 private:
  friend void call_at_program_end();
  const std::function<void()> call_;
};

// The end of a simulation that continues in a thread of its own: while one of these lives, the
// program's end waits, for a moment.
class EndUnderWay {
 public:
  EndUnderWay();
  ~EndUnderWay();
  EndUnderWay(const EndUnderWay&) = delete;
  EndUnderWay& operator=(const EndUnderWay&) = delete;
};

}  // namespace ruedo::client
