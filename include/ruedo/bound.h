// A reference to what its holder belongs to, which an assignment of the holder leaves as it is.
//
// Copies of a world hand their state over by assignment (engine::World::take): of a class whose
// references are Bound, the operator= that the compiler writes copies every value and keeps the
// references, and a member that is added later is copied, too. A plain reference instead is an
// error of the compiler's.
#pragma once

namespace ruedo {

template <class T>
class Bound {
 public:
  Bound(T& to) : to_(&to) {}  // NOLINT(google-explicit-constructor): as a reference is bound
  Bound(const Bound&) = default;
  Bound& operator=(const Bound&) { return *this; }  // NOLINT(*-self-assignment,cert-oop54-cpp)
  ~Bound() = default;

  operator T&() const { return *to_; }  // NOLINT(google-explicit-constructor)
  T& operator*() const { return *to_; }
  T* operator->() const { return to_; }

 private:
  T* to_;
};

}  // namespace ruedo
