// Bullet's collision detection with no world in it: which algorithm serves which two shapes, and
// the memory of pairs and contacts.
//
// Making one costs more than the rest of a small world. So those of worlds that have ended serve
// the next ones: a world that is made again finds its tables filled. Nothing of a world is left in
// one that is kept.
#pragma once

#include <cstddef>
#include <memory>

#include "physics/bullet.h"

namespace ruedo::physics {

class Detection {
 public:
  // For a world of so many bodies that move. Any thread, as its end.
  explicit Detection(size_t bodies);
  ~Detection();  // all objects of the world are gone
  Detection(const Detection&) = delete;

  btCollisionDispatcher& dispatcher() { return parts_->dispatcher; }
  btDefaultCollisionConfiguration& configuration() { return parts_->configuration; }

 private:
  struct Parts {
    explicit Parts(int room);
    bool empty();
    const int room;  // of pairs
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher;
  };
  class Spare;

  std::unique_ptr<Parts> parts_;
};

}  // namespace ruedo::physics
