// A pair has an algorithm; a pair of compounds has one for each two children near each other; and
// each of these has a manifold of up to four points, with the impulses that warm-start the solver.
// Everything but the points follows from the shapes: the algorithms are created as Bullet would,
// and the points are copied.
#include "physics/collision/contact_copies.h"

#include <stdexcept>
#include <string>

#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>

namespace ruedo::physics {

namespace {

using Wrapper = btCollisionObjectWrapper;

// Accesses Bullet's private list of child algorithms: the arguments of an explicit instantiation
// may name private members.
template <auto member>
struct Opened {
  friend btHashedSimplePairCache& children_of(btCompoundCompoundCollisionAlgorithm& compounds) {
    return *(compounds.*member);
  }
};
btHashedSimplePairCache& children_of(btCompoundCompoundCollisionAlgorithm& compounds);
template struct Opened<&btCompoundCompoundCollisionAlgorithm::m_childCollisionAlgorithmCache>;

struct OpenCompound : btCompoundCollisionAlgorithm {
  static btAlignedObjectArray<btCollisionAlgorithm*>& children(
      btCompoundCollisionAlgorithm& compound) {
    return compound.*&OpenCompound::m_childCollisionAlgorithms;
  }
  static bool swapped(const btCompoundCollisionAlgorithm& compound) {
    return compound.*&OpenCompound::m_isSwapped;
  }
};

[[noreturn]] void refuse(const char* what) {
  throw std::logic_error(std::string("contacts cannot be copied: ") + what);
}

Wrapper whole(btCollisionObject& object) {
  return {nullptr, object.getCollisionShape(), &object, object.getWorldTransform(), -1, -1};
}

class Copier {
 public:
  Copier(btDispatcher& dispatcher, const btDispatcherInfo& info)
      : dispatcher_(dispatcher), info_(info) {}

  btCollisionAlgorithm* made(const Wrapper& a, const Wrapper& b) {
    return dispatcher_.findAlgorithm(&a, &b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }

  void copy_compounds(btCompoundCompoundCollisionAlgorithm& from,
                      btCompoundCompoundCollisionAlgorithm& to, const Wrapper& a,
                      const Wrapper& b) {
    const btSimplePairArray& children = children_of(from).getOverlappingPairArray();
    for (int i = 0; i < children.size(); ++i) {
      const btSimplePair& child = children[i];
      on_child(a, child.m_indexA, [&](const Wrapper& child_a) {
        on_child(b, child.m_indexB, [&](const Wrapper& child_b) {
          btCollisionAlgorithm* algorithm = made(child_a, child_b);
          children_of(to).addOverlappingPair(child.m_indexA, child.m_indexB)->m_userPointer =
              algorithm;
          copy_points(*static_cast<btCollisionAlgorithm*>(child.m_userPointer), *algorithm, child_a,
                      child_b);
        });
      });
    }
  }

  void copy_compound(btCompoundCollisionAlgorithm& from, btCompoundCollisionAlgorithm& to,
                     const Wrapper& a, const Wrapper& b) {
    const bool swapped = OpenCompound::swapped(from);
    const Wrapper &compound = swapped ? b : a, &other = swapped ? a : b;
    auto &here = OpenCompound::children(from), &there = OpenCompound::children(to);
    for (int i = 0; i < here.size(); ++i) {
      if (!here[i]) continue;
      on_child(compound, i, [&](const Wrapper& child) {
        if (!there[i]) there[i] = made(child, other);
        copy_points(*here[i], *there[i], child, other);
      });
    }
  }

  // For two shapes that are not compounds.
  void copy_points(btCollisionAlgorithm& from, btCollisionAlgorithm& to, const Wrapper& a,
                   const Wrapper& b) {
    here_.resizeNoInitialize(0);
    from.getAllContactManifolds(here_);
    if (here_.size() == 0) return;
    if (here_.size() > 1) refuse("two shapes with several manifolds");
    btPersistentManifold& there = emptied_manifold(to, a, b);
    for (int i = 0; i < here_[0]->getNumContacts(); ++i)
      there.addManifoldPoint(here_[0]->getContactPoint(i));
  }

  // ---- The same, in bytes.

  void exchange_compounds(StateArchive& archive, btCompoundCompoundCollisionAlgorithm& both,
                          const Wrapper& a, const Wrapper& b) {
    std::vector<std::pair<int, int>> numbers;
    const btSimplePairArray& children = children_of(both).getOverlappingPairArray();
    for (int i = 0; i < children.size(); ++i)
      numbers.emplace_back(children[i].m_indexA, children[i].m_indexB);
    archive(numbers);
    for (size_t i = 0; i < numbers.size(); ++i) {
      const int in_a = numbers[i].first, in_b = numbers[i].second;
      on_child(a, in_a, [&](const Wrapper& child_a) {
        on_child(b, in_b, [&](const Wrapper& child_b) {
          void* algorithm = archive.reads() ? made(child_a, child_b)
                                            : children[static_cast<int>(i)].m_userPointer;
          if (archive.reads())
            children_of(both).addOverlappingPair(in_a, in_b)->m_userPointer = algorithm;
          exchange_points(archive, *static_cast<btCollisionAlgorithm*>(algorithm), child_a,
                          child_b);
        });
      });
    }
  }

  void exchange_compound(StateArchive& archive, btCompoundCollisionAlgorithm& one, const Wrapper& a,
                         const Wrapper& b) {
    const bool swapped = OpenCompound::swapped(one);
    const Wrapper &compound = swapped ? b : a, &other = swapped ? a : b;
    auto& children = OpenCompound::children(one);
    for (int i = 0; i < children.size(); ++i) {
      bool there = children[i];
      archive(there);
      if (!there) continue;
      on_child(compound, i, [&](const Wrapper& child) {
        if (!children[i]) children[i] = made(child, other);
        exchange_points(archive, *children[i], child, other);
      });
    }
  }

  void exchange_points(StateArchive& archive, btCollisionAlgorithm& algorithm, const Wrapper& a,
                       const Wrapper& b) {
    here_.resizeNoInitialize(0);
    algorithm.getAllContactManifolds(here_);
    if (!archive.reads() && here_.size() > 1) archive.refuse("two shapes with several manifolds");
    int count = here_.size() == 1 && !archive.reads() ? here_[0]->getNumContacts() : -1;
    archive(count);
    if (count < 0) return;
    if (count > MANIFOLD_CACHE_SIZE) archive.refuse("too many points of a contact");
    btPersistentManifold& manifold =
        archive.reads() ? emptied_manifold(algorithm, a, b) : *here_[0];
    for (int i = 0; i < count; ++i) {
      btManifoldPoint point;
      if (!archive.reads()) point = manifold.getContactPoint(i);
      point.m_userPersistentData = nullptr;
      archive.raw(point);
      if (archive.reads()) manifold.addManifoldPoint(point);
    }
  }

 private:
  template <class Do>
  static void on_child(const Wrapper& of, int index, Do&& act) {
    const auto& compound = static_cast<const btCompoundShape&>(*of.getCollisionShape());
    if (index < 0 || index >= compound.getNumChildShapes()) refuse("there is no such shape");
    const btTransform X_WC = of.getWorldTransform() * compound.getChildTransform(index);
    act(Wrapper(&of, compound.getChildShape(index), of.getCollisionObject(), X_WC, -1, index));
  }
  // Created by adding points, which are then removed.
  btPersistentManifold& emptied_manifold(btCollisionAlgorithm& of, const Wrapper& a,
                                         const Wrapper& b) {
    if (!manifold_of(of)) {
      btManifoldResult result(&a, &b);
      of.processCollision(&a, &b, info_, &result);
    }
    btPersistentManifold* manifold = manifold_of(of);
    if (!manifold) refuse("two shapes without a manifold");
    manifold->clearManifold();
    return *manifold;
  }
  btPersistentManifold* manifold_of(btCollisionAlgorithm& algorithm) {
    there_.resizeNoInitialize(0);
    algorithm.getAllContactManifolds(there_);
    return there_.size() == 1 ? there_[0] : nullptr;
  }

  btDispatcher& dispatcher_;
  const btDispatcherInfo& info_;
  btManifoldArray here_, there_;
};

}  // namespace

void copy_contacts(const btBroadphasePair& from, btBroadphasePair& to, btDispatcher& dispatcher,
                   const btDispatcherInfo& info) {
  if (!from.m_algorithm) return;
  auto& object_a = *static_cast<btCollisionObject*>(to.m_pProxy0->m_clientObject);
  auto& object_b = *static_cast<btCollisionObject*>(to.m_pProxy1->m_clientObject);
  const Wrapper a = whole(object_a), b = whole(object_b);
  Copier copier(dispatcher, info);
  to.m_algorithm = copier.made(a, b);
  if (auto* both = dynamic_cast<btCompoundCompoundCollisionAlgorithm*>(from.m_algorithm))
    copier.copy_compounds(
        *both, dynamic_cast<btCompoundCompoundCollisionAlgorithm&>(*to.m_algorithm), a, b);
  if (auto* one = dynamic_cast<btCompoundCollisionAlgorithm*>(from.m_algorithm))
    copier.copy_compound(*one, dynamic_cast<btCompoundCollisionAlgorithm&>(*to.m_algorithm), a, b);
  else
    copier.copy_points(*from.m_algorithm, *to.m_algorithm, a, b);
}

void exchange_contacts(StateArchive& archive, btBroadphasePair& pair, btDispatcher& dispatcher,
                       const btDispatcherInfo& info) {
  bool has = pair.m_algorithm;
  archive(has);
  if (!has) return;
  auto& object_a = *static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
  auto& object_b = *static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
  const Wrapper a = whole(object_a), b = whole(object_b);
  Copier copier(dispatcher, info);
  if (archive.reads()) pair.m_algorithm = copier.made(a, b);
  if (!pair.m_algorithm) refuse("two shapes that nothing brings together");
  if (auto* both = dynamic_cast<btCompoundCompoundCollisionAlgorithm*>(pair.m_algorithm))
    copier.exchange_compounds(archive, *both, a, b);
  if (auto* one = dynamic_cast<btCompoundCollisionAlgorithm*>(pair.m_algorithm))
    copier.exchange_compound(archive, *one, a, b);
  else
    copier.exchange_points(archive, *pair.m_algorithm, a, b);
}

}  // namespace ruedo::physics
