// A list of instances that no world is using.
#include "physics/collision/detection.h"

#include <algorithm>
#include <mutex>
#include <vector>

#include <LinearMath/btPoolAllocator.h>

#include "physics/collision/collisions.h"
#include "physics/collision/convex_shapes.h"

namespace ruedo::physics {
namespace {

// Bullet's pools of pairs and contacts take 8 MB for 4096 of each, and are written when created.
// Beyond them, Bullet allocates.
int room_for(size_t bodies) {
  constexpr size_t kPairsOfABody = 8, kLeast = 16, kMost = 4096;
  return static_cast<int>(std::min(kLeast + kPairsOfABody * bodies, kMost));
}

btDefaultCollisionConstructionInfo pools(int room) {
  btDefaultCollisionConstructionInfo info;
  info.m_defaultMaxPersistentManifoldPoolSize = info.m_defaultMaxCollisionAlgorithmPoolSize = room;
  return info;
}

}  // namespace

btPersistentManifold* Dispatcher::getNewManifold(const btCollisionObject* a,
                                                 const btCollisionObject* b) {
  btPersistentManifold* manifold = btCollisionDispatcher::getNewManifold(a, b);
  manifold->setContactBreakingThreshold(std::max(gContactBreakingThreshold, seen_ahead_m));
  return manifold;
}

class Detection::Spare {
 public:
  // A world destroyed at program exit still needs it: never freed.
  static Spare& all() {
    static auto& spare = *new Spare;
    return spare;
  }
  std::unique_ptr<Parts> take(int room) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(parts_.rbegin(), parts_.rend(),
                                    [room](const auto& parts) { return parts->room == room; });
    if (found == parts_.rend()) return nullptr;
    auto taken = std::move(*found);
    parts_.erase(std::next(found).base());
    return taken;
  }
  void keep(std::unique_ptr<Parts> parts) {
    constexpr size_t kMost = 16;
    constexpr int kMostRoom = 512;  // 1 MB
    if (parts->room > kMostRoom || !parts->empty()) return;
    const std::lock_guard lock(mutex_);
    if (parts_.size() < kMost) parts_.push_back(std::move(parts));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<Parts>> parts_;
};

Detection::Parts::Parts(int pairs)
    : room(pairs), configuration(pools(pairs)), dispatcher(&configuration) {
  dispatcher.setDispatcherFlags(dispatcher.getDispatcherFlags() &
                                ~btCollisionDispatcher::CD_USE_RELATIVE_CONTACT_BREAKING_THRESHOLD);
  register_collisions(dispatcher);
}

bool Detection::Parts::empty() {
  return dispatcher.getNumManifolds() == 0 &&
         configuration.getPersistentManifoldPool()->getUsedCount() == 0 &&
         configuration.getCollisionAlgorithmPool()->getUsedCount() == 0;
}

Detection::Detection(size_t bodies) : parts_(Spare::all().take(room_for(bodies))) {
  if (!parts_) parts_ = std::make_unique<Parts>(room_for(bodies));
}

Detection::~Detection() { Spare::all().keep(std::move(parts_)); }

}  // namespace ruedo::physics
