// Keeps exceptions of callbacks until a call of their connection rethrows them.
#pragma once

#include <exception>
#include <memory>
#include <mutex>
#include <string>

namespace ruedo::client {

// Of one connection; in shared_ptrs only. Thread safe. An exception that no call has rethrown
// gives the program an exit code other than 0.
class CallbackFaults : public std::enable_shared_from_this<CallbackFaults> {
 public:
  // what: the callback's channel or event. Returns whether it is kept: false if another one is.
  bool keep(std::exception_ptr fault, const std::string& what);
  void rethrow();  // the kept one, once
  // Where it cannot be thrown: in a destructor, or while another exception is thrown. The program
  // still fails, unless a call has thrown one of these before.
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

// Prints exceptions that no call has rethrown. False if there are none.
bool print_unthrown_faults();

// The message of an exception, for the terminal.
std::string text_of(const std::exception_ptr& fault);

}  // namespace ruedo::client
