// Which bodies are near each other: two trees of bounding boxes, one of what never moves, one of
// what may.
//
// Bullet's own btDbvtBroadphase shapes its trees by comparing addresses, and drops pairs a few at a
// time; here the pairs follow from the boxes alone, so that a repeated run has the same pairs at
// the same steps. It also knows at once when a body is alone, which then needs no collision
// detection and no solver at all.
#pragma once

#include <map>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btDbvt.h>

#include "physics/bullet.h"

namespace ruedo::physics {

// Says whether two objects may touch at all.
class PairFilter {
 public:
  virtual ~PairFilter() = default;
  virtual bool may_touch(const btCollisionObject& a, const btCollisionObject& b) const = 0;
};

class Broadphase final : public btBroadphaseInterface {
 public:
  explicit Broadphase(const PairFilter& filter) : filter_(filter) {}
  ~Broadphase() override;

  // Calls visit(object) for all that a body could touch.
  template <class Visit>
  void for_each_partner(const btBroadphaseProxy* proxy, Visit visit) const {
    for (const Proxy* partner : static_cast<const Proxy*>(proxy)->partners)
      visit(*static_cast<btCollisionObject*>(partner->m_clientObject));
  }
  // True when nothing is near that the body could touch.
  bool alone(const btBroadphaseProxy* proxy) const {
    return static_cast<const Proxy*>(proxy)->partners.empty();
  }
  // Finds the pairs of a body again, after the filter's answer about it, or what is static,
  // changed. An object that goes must be refused by the filter, and its neighbours be refiltered,
  // before its proxy is destroyed.
  void refilter(btBroadphaseProxy* proxy, btDispatcher* dispatcher);

  // Becomes what it is in another copy of the world, whose filter answers as this one's does. The
  // pairs are in the other one's order; nothing was done with them yet.
  void take(const Broadphase& other, btDispatcher* dispatcher);

  // What btBroadphaseInterface asks for. Objects of the static filter group never move; boxes of
  // the others are kept kSlack_m wider than given, so that few of their moves need the trees.
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
  void calculateOverlappingPairs(btDispatcher*) override {}  // setAabb has done it
  btOverlappingPairCache* getOverlappingPairCache() override { return &pairs_; }
  const btOverlappingPairCache* getOverlappingPairCache() const override { return &pairs_; }
  void getBroadphaseAabb(btVector3& low, btVector3& high) const override;
  void printStats() override {}

 private:
  struct Proxy : btBroadphaseProxy {
    btDbvtNode* leaf = nullptr;  // null: a plane, which is in no tree
    bool moves = false;
    std::vector<Proxy*> partners;  // of the pairs it is in
  };

  bool overlap(const Proxy& a, const Proxy& b) const;
  void find_pairs(Proxy& proxy, btDispatcher* dispatcher);
  void add_pair(Proxy& a, Proxy& b);
  void remove_pair(Proxy& a, Proxy& b, btDispatcher* dispatcher);

  const PairFilter& filter_;
  btDbvt fixed_, moving_;
  std::map<int, Proxy> proxies_;  // by unique id, which is the order of making
  std::vector<Proxy*> planes_;
  std::vector<Proxy*> found_;  // scratch
  int made_ = 0;
  btHashedOverlappingPairCache pairs_;
};

}  // namespace ruedo::physics
