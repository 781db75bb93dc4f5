// Ends of simulations that go on in threads of their own: the program's end waits for them.
#pragma once

namespace ruedo::client {

// While one of these lives, exit() and the return of main() wait, for a moment, since others would
// wait for a client in lockstep that does not say that it leaves.
class EndUnderWay {
 public:
  EndUnderWay();
  ~EndUnderWay();
  EndUnderWay(const EndUnderWay&) = delete;
  EndUnderWay& operator=(const EndUnderWay&) = delete;
};

}  // namespace ruedo::client
