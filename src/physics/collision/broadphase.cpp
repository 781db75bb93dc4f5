// The two trees, and the pairs of overlapping boxes.
#include "physics/collision/broadphase.h"

#include <algorithm>

namespace ruedo::physics {

namespace {

constexpr size_t kPartners = 8,
                 kFound = 64;  // capacity reserved for results: no allocation in the running loop

// By half its longest side, at most 5 cm.
btDbvtVolume widened(const btVector3& low, const btVector3& high) {
  constexpr double kMost_m = 0.05;
  btDbvtVolume volume = btDbvtVolume::FromMM(low, high);
  const btVector3 half = volume.Extents();
  const double by = std::min(half[half.maxAxis()], kMost_m);
  volume.Expand({by, by, by});
  return volume;
}

// A plane has a half-space inside: a box overlaps it if its lowest corner along the normal is
// below.
bool reaches_plane(const btDbvtVolume& box, const btCollisionObject& object) {
  const auto* plane = static_cast<const btStaticPlaneShape*>(object.getCollisionShape());
  const btVector3 normal = object.getWorldTransform().getBasis() * plane->getPlaneNormal();
  const btVector3 on_plane =
      object.getWorldTransform() * (plane->getPlaneNormal() * plane->getPlaneConstant());
  const btVector3 half = box.Extents();
  return normal.dot(box.Center() - on_plane) <= normal.absolute().dot(half);
}

template <class Proxy>
struct Collect : btDbvt::ICollide {
  std::vector<Proxy*>& into;
  explicit Collect(std::vector<Proxy*>& to) : into(to) {}
  void Process(const btDbvtNode* leaf) override { into.push_back(static_cast<Proxy*>(leaf->data)); }
};

}  // namespace

Broadphase::~Broadphase() = default;

btBroadphaseProxy* Broadphase::createProxy(const btVector3& low, const btVector3& high,
                                           int shape_type, void* object, int group, int mask,
                                           btDispatcher* dispatcher) {
  const int id = ++made_;
  Proxy& proxy = proxies_[id];
  const bool empty = low.x() > high.x();  // a compound without shapes
  proxy.m_aabbMin = empty ? btVector3(0, 0, 0) : low;
  proxy.m_aabbMax = empty ? btVector3(0, 0, 0) : high;
  proxy.m_clientObject = object;
  proxy.m_collisionFilterGroup = group;
  proxy.m_collisionFilterMask = mask;
  proxy.m_uniqueId = id;
  proxy.moves = group != btBroadphaseProxy::StaticFilter;
  if (proxy.moves) proxy.partners.reserve(kPartners);
  found_.reserve(kFound);
  if (btBroadphaseProxy::isInfinite(shape_type)) {
    planes_.push_back(&proxy);
    return &proxy;
  }
  proxy.leaf = proxy.moves
                   ? moving_.insert(widened(proxy.m_aabbMin, proxy.m_aabbMax), &proxy)
                   : fixed_.insert(btDbvtVolume::FromMM(proxy.m_aabbMin, proxy.m_aabbMax), &proxy);
  if (proxy.moves) find_pairs(proxy, dispatcher);
  return &proxy;
}

void Broadphase::destroyProxy(btBroadphaseProxy* base, btDispatcher* dispatcher) {
  auto* proxy = static_cast<Proxy*>(base);
  while (!proxy->partners.empty()) remove_pair(*proxy, *proxy->partners.back(), dispatcher);
  if (proxy->leaf) (proxy->moves ? moving_ : fixed_).remove(proxy->leaf);
  std::erase(planes_, proxy);
  proxies_.erase(proxy->m_uniqueId);
}

void Broadphase::setAabb(btBroadphaseProxy* base, const btVector3& low, const btVector3& high,
                         btDispatcher* dispatcher) {
  auto& proxy = *static_cast<Proxy*>(base);
  proxy.m_aabbMin = low;
  proxy.m_aabbMax = high;
  if (!proxy.moves || proxy.leaf->volume.Contain(btDbvtVolume::FromMM(low, high))) return;
  btDbvtVolume volume = widened(low, high);
  moving_.update(proxy.leaf, volume);
  find_pairs(proxy, dispatcher);
}

void Broadphase::refilter(btBroadphaseProxy* base, btDispatcher* dispatcher) {
  auto& proxy = *static_cast<Proxy*>(base);
  const auto& object = *static_cast<btCollisionObject*>(proxy.m_clientObject);
  for (size_t i = proxy.partners.size(); i-- > 0;) {
    Proxy& partner = *proxy.partners[i];
    if (!filter_.may_touch(object, *static_cast<btCollisionObject*>(partner.m_clientObject))) {
      remove_pair(proxy, partner, dispatcher);
    }
  }
  find_pairs(proxy, dispatcher);
}

bool Broadphase::overlap(const Proxy& a, const Proxy& b) const {
  if (!b.leaf)
    return reaches_plane(a.leaf->volume, *static_cast<btCollisionObject*>(b.m_clientObject));
  return Intersect(a.leaf->volume, b.leaf->volume);
}

void Broadphase::find_pairs(Proxy& proxy, btDispatcher* dispatcher) {
  for (size_t i = proxy.partners.size(); i-- > 0;) {
    Proxy& partner = *proxy.partners[i];
    if (!overlap(proxy, partner)) remove_pair(proxy, partner, dispatcher);
  }
  found_.clear();
  Collect<Proxy> collect(found_);
  fixed_.collideTV(fixed_.m_root, proxy.leaf->volume, collect);
  moving_.collideTV(moving_.m_root, proxy.leaf->volume, collect);
  for (Proxy* plane : planes_) {
    if (overlap(proxy, *plane)) found_.push_back(plane);
  }
  looked_at_ += static_cast<int64_t>(found_.size());
  proxy.mark = ++searches_;
  for (Proxy* partner : proxy.partners) partner->mark = searches_;
  const auto& object = *static_cast<btCollisionObject*>(proxy.m_clientObject);
  for (Proxy* other : found_) {
    if (other->mark == searches_) continue;
    if (filter_.may_touch(object, *static_cast<btCollisionObject*>(other->m_clientObject)))
      add_pair(proxy, *other);
  }
}

// Only moving bodies keep partners: a wall needs no list of near bodies.
void Broadphase::add_pair(Proxy& a, Proxy& b) {
  pairs_.addOverlappingPair(&a, &b);
  a.partners.push_back(&b);
  if (b.moves) b.partners.push_back(&a);
}

void Broadphase::remove_pair(Proxy& a, Proxy& b, btDispatcher* dispatcher) {
  pairs_.removeOverlappingPair(&a, &b, dispatcher);
  std::erase(a.partners, &b);
  if (b.moves) std::erase(b.partners, &a);
}

void Broadphase::copy_from(const Broadphase& other, btDispatcher* dispatcher) {
  auto from = other.proxies_.begin();  // numbered the same
  for (auto& [id, proxy] : proxies_) {
    while (!proxy.partners.empty()) remove_pair(proxy, *proxy.partners.back(), dispatcher);
    const Proxy& there = (from++)->second;
    proxy.m_aabbMin = there.m_aabbMin;
    proxy.m_aabbMax = there.m_aabbMax;
    if (!proxy.moves || (proxy.leaf->volume.Mins() == there.leaf->volume.Mins() &&
                         proxy.leaf->volume.Maxs() == there.leaf->volume.Maxs()))
      continue;
    btDbvtVolume volume = there.leaf->volume;
    moving_.update(proxy.leaf, volume);
  }
  const auto here = [this](const btBroadphaseProxy& proxy) {
    return &proxies_.at(proxy.m_uniqueId);
  };
  const btBroadphasePairArray& pairs = other.pairs_.getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i)
    pairs_.addOverlappingPair(here(*pairs[i].m_pProxy0), here(*pairs[i].m_pProxy1));
  from = other.proxies_.begin();
  for (auto& [id, proxy] : proxies_) {
    for (const Proxy* partner : (from++)->second.partners) proxy.partners.push_back(here(*partner));
  }
}

void Broadphase::exchange(StateArchive& archive, btDispatcher* dispatcher) {
  for (auto& [id, proxy] : proxies_) {
    while (archive.reads() && !proxy.partners.empty())
      remove_pair(proxy, *proxy.partners.back(), dispatcher);
    archive.raw(proxy.m_aabbMin);
    archive.raw(proxy.m_aabbMax);
    if (!proxy.moves) continue;
    btDbvtVolume volume = proxy.leaf->volume;
    archive.raw(volume);
    if (archive.reads()) moving_.update(proxy.leaf, volume);
  }
  exchange_pairs(archive);
  for (auto& [id, proxy] : proxies_) exchange_partners(archive, proxy);
}

void Broadphase::exchange_pairs(StateArchive& archive) {
  const btBroadphasePairArray& pairs = pairs_.getOverlappingPairArray();
  std::vector<std::pair<int, int>> ids;
  for (int i = 0; i < pairs.size(); ++i)
    ids.emplace_back(pairs[i].m_pProxy0->m_uniqueId, pairs[i].m_pProxy1->m_uniqueId);
  archive(ids);
  if (!archive.reads()) return;
  for (const auto& [a, b] : ids) pairs_.addOverlappingPair(&numbered(a), &numbered(b));
  if (static_cast<size_t>(pairs.size()) != ids.size()) archive.refuse("a pair is there twice");
}

void Broadphase::exchange_partners(StateArchive& archive, Proxy& proxy) {
  std::vector<int> ids;
  for (const Proxy* partner : proxy.partners) ids.push_back(partner->m_uniqueId);
  archive(ids);
  if (!archive.reads()) return;
  for (const int id : ids) proxy.partners.push_back(&numbered(id));
}

Broadphase::Proxy& Broadphase::numbered(int id) {
  const auto found = proxies_.find(id);
  if (found == proxies_.end()) StateArchive::refuse("there is no such object");
  return found->second;
}

void Broadphase::getAabb(btBroadphaseProxy* proxy, btVector3& low, btVector3& high) const {
  low = proxy->m_aabbMin;
  high = proxy->m_aabbMax;
}

void Broadphase::aabbTest(const btVector3& low, const btVector3& high,
                          btBroadphaseAabbCallback& callback) {
  for (auto& [id, proxy] : proxies_) {
    if (TestAabbAgainstAabb2(low, high, proxy.m_aabbMin, proxy.m_aabbMax)) callback.process(&proxy);
  }
}

// Rays are cast by the scene; this only completes the interface.
void Broadphase::rayTest(const btVector3&, const btVector3&, btBroadphaseRayCallback& callback,
                         const btVector3&, const btVector3&) {
  for (auto& [id, proxy] : proxies_) callback.process(&proxy);
}

void Broadphase::getBroadphaseAabb(btVector3& low, btVector3& high) const {
  low = btVector3(-BT_LARGE_FLOAT, -BT_LARGE_FLOAT, -BT_LARGE_FLOAT);
  high = -low;
}

}  // namespace ruedo::physics
