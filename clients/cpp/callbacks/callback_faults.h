// What callbacks threw, until a call of their connection throws it.
#pragma once

#include <exception>
#include <memory>
#include <mutex>
#include <string>

namespace ruedo::client {

// Of one connection; in shared_ptrs alone. Thread safe. What no call has thrown gives the program
// an exit code that is not 0.
class CallbackFaults : public std::enable_shared_from_this<CallbackFaults> {
 public:
  // what: the callback was on. Whether it is kept: false while another one is.
  bool keep(std::exception_ptr fault, const std::string& what);
  void rethrow();  // the one that is kept, once
  // Where it cannot be thrown: in a destructor, or while another exception is on its way. The
  // program still fails, unless a call has thrown one of these before.
  void print();

 private:
  struct Kept {
    std::exception_ptr fault;
    std::string what;
  };
  Kept take();

  std::mutex mutex_;
  Kept kept_;
  bool has_thrown_ = false;
};

// Prints what no call has thrown. False: there was nothing.
bool print_unthrown_faults();

// What an exception says, for the terminal.
std::string text_of(const std::exception_ptr& fault);

}  // namespace ruedo::client
