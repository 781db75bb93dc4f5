// Bullet's collision detection without a world: which algorithm serves which two shapes, and the
// memory for pairs and contacts.
//
// Creating one costs more than the rest of a small world. Instances of finished worlds are
// therefore reused. A kept instance contains nothing of its former world.
#pragma once

#include <cstddef>
#include <memory>

#include "physics/base/bullet.h"

namespace ruedo::physics {

// Contacts are sought as far away as shapes are seen ahead.
class Dispatcher final : public btCollisionDispatcher {
 public:
  using btCollisionDispatcher::btCollisionDispatcher;
  btPersistentManifold* getNewManifold(const btCollisionObject* a,
                                       const btCollisionObject* b) override;
};

class Detection {
 public:
  // For a world with that many moving bodies. Constructor and destructor may run in any thread.
  explicit Detection(size_t bodies);
  ~Detection();  // all objects of the world must be gone
  Detection(const Detection&) = delete;

  btCollisionDispatcher& dispatcher() { return parts_->dispatcher; }
  btDefaultCollisionConfiguration& configuration() { return parts_->configuration; }

 private:
  struct Parts {
    explicit Parts(int room);
    bool empty();
    const int room;  // capacity for pairs
    btDefaultCollisionConfiguration configuration;
    Dispatcher dispatcher;
  };
  class Spare;

  std::unique_ptr<Parts> parts_;
};

}  // namespace ruedo::physics
