// Which bodies are near each other: two trees of bounding boxes, one of bodies that never
// move, one of the others.
//
// Bullet's own btDbvtBroadphase shapes its trees by comparing addresses, and drops pairs a few at a
// time. Here the pairs follow from the boxes alone, so that a repeated run has the same pairs at
// the same steps. It also knows at once when a body is alone, which then needs neither collision
// detection nor the solver.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include "physics/base/bullet.h"
#include "ruedo/state_archive.h"

namespace ruedo::physics {

// Decides whether two objects may touch at all.
class PairFilter {
 public:
  virtual ~PairFilter() = default;
  virtual bool may_touch(const btCollisionObject& a, const btCollisionObject& b) const = 0;
};

class Broadphase final : public btBroadphaseInterface {
 public:
  explicit Broadphase(const PairFilter& filter) : filter_(filter) {}
  ~Broadphase() override;

  // Calls visit(object) for everything that a body could touch.
  template <class Visit>
  void for_each_partner(const btBroadphaseProxy* proxy, Visit visit) const {
    for (const Proxy* partner : static_cast<const Proxy*>(proxy)->partners)
      visit(*static_cast<btCollisionObject*>(partner->m_clientObject));
  }
  // The same, with the pair: visit(pair, object). Pairs stay in their places until one is added or
  // removed.
  template <class Visit>
  void for_each_pair(btBroadphaseProxy* proxy, Visit visit) {
    for (Proxy* partner : static_cast<Proxy*>(proxy)->partners)
      visit(*pairs_.findPair(proxy, partner),
            *static_cast<const btCollisionObject*>(partner->m_clientObject));
  }
  // Whether nothing is near that the body could touch.
  bool alone(const btBroadphaseProxy* proxy) const {
    return static_cast<const Proxy*>(proxy)->partners.empty();
  }
  // A measure of the work done: how many objects were near a visited one, whether they may touch or
  // not.
  int64_t looked_at() const { return looked_at_; }
  // Recomputes the pairs of a body after the filter's answer about it, or the static set, has
  // changed. Before an object's proxy is destroyed, the filter must refuse it and its neighbours
  // must be refiltered.
  void refilter(btBroadphaseProxy* proxy, btDispatcher* dispatcher);

  // Takes the state of the broadphase of another copy of the world, whose filter gives the same
  // answers. The pairs get the other one's order, and are new to the dispatcher.
  void copy_from(const Broadphase& other, btDispatcher* dispatcher);
  // Writes that state, or reads it into a broadphase with the same objects.
  void exchange(StateArchive& archive, btDispatcher* dispatcher);

  // The btBroadphaseInterface. Objects of the static filter group never move; the boxes of others
  // are enlarged, so that few of their moves update the trees.
  btBroadphaseProxy* createProxy(const btVector3& low, const btVector3& high, int shape_type,
                                 void* object, int group, int mask,
                                 btDispatcher* dispatcher) override;
  void destroyProxy(btBroadphaseProxy* proxy, btDispatcher* dispatcher) override;
  void setAabb(btBroadphaseProxy* proxy, const btVector3& low, const btVector3& high,
               btDispatcher* dispatcher) override;
  void getAabb(btBroadphaseProxy* proxy, btVector3& low, btVector3& high) const override;
  void rayTest(const btVector3&, const btVector3&, btBroadphaseRayCallback&, const btVector3&,
               const btVector3&) override;
  void aabbTest(const btVector3& low, const btVector3& high,
                btBroadphaseAabbCallback& callback) override;
  void calculateOverlappingPairs(btDispatcher*) override {}  // done in setAabb
  btOverlappingPairCache* getOverlappingPairCache() override { return &pairs_; }
  const btOverlappingPairCache* getOverlappingPairCache() const override { return &pairs_; }
  void getBroadphaseAabb(btVector3& low, btVector3& high) const override;
  void printStats() override {}

 private:
  struct Proxy : btBroadphaseProxy {
    btDbvtNode* leaf = nullptr;  // null: a plane, which is in no tree
    bool moves = false;
    std::vector<Proxy*> partners;  // from the pairs it is in
    int64_t mark = 0;              // of the last search that knows it already
  };

  bool overlap(const Proxy& a, const Proxy& b) const;
  void find_pairs(Proxy& proxy, btDispatcher* dispatcher);
  void add_pair(Proxy& a, Proxy& b);
  void remove_pair(Proxy& a, Proxy& b, btDispatcher* dispatcher);
  void exchange_pairs(StateArchive& archive);
  void exchange_partners(StateArchive& archive, Proxy& proxy);
  Proxy& numbered(int id);

  const PairFilter& filter_;
  btDbvt fixed_, moving_;
  std::map<int, Proxy> proxies_;  // by unique id, that is in order of creation
  std::vector<Proxy*> planes_;
  std::vector<Proxy*> found_;  // scratch
  int made_ = 0;
  int64_t searches_ = 0, looked_at_ = 0;
  btHashedOverlappingPairCache pairs_;
};

}  // namespace ruedo::physics
