// Cuts the worst part in two until the hulls fit, and joins hulls that are as good as one.
#include "world/convex/convex_pieces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include <Eigen/Geometry>

#include "base/whole.h"
#include "world/convex/solid.h"

namespace ruedo::world {
namespace {

using Eigen::Vector3d;

constexpr double kConvex = 0.05;   // less excess, of the volume, is not worth pieces
constexpr double kAllowed = 0.04;  // excess of all pieces together
constexpr double kCut = 0.02;      // before pieces are joined
// In the score of a cut, where the first cuts of a ring gain nothing: of the difference between the
// two volumes, so that it is halved, and of the section, so that it is not sliced.
constexpr double kBalance = 0.05, kSection = 0.005;
constexpr size_t kMostParts = 200, kMostTriangles = 200'000;
constexpr size_t kTrianglesToCut = 400'000;  // by the planes that are tried for one cut

// The triangles of each connected part; corners in the same place are one.
std::vector<std::vector<Triangle>> connected(std::span<const Vector3d> positions,
                                             std::span<const std::array<uint32_t, 3>> triangles) {
  std::map<std::tuple<double, double, double>, uint32_t> places;
  std::vector<uint32_t> parent(positions.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (uint32_t i = 0; i < positions.size(); ++i) {
    const Vector3d& p = positions[i];
    parent[i] = places.try_emplace({p.x(), p.y(), p.z()}, i).first->second;
  }
  for (const auto& t : triangles) {
    parent[root(t[1])] = root(t[0]);
    parent[root(t[2])] = root(t[0]);
  }
  std::map<uint32_t, size_t> number;
  std::vector<std::vector<Triangle>> parts;
  for (const auto& t : triangles) {
    const Triangle corners{positions[t[0]], positions[t[1]], positions[t[2]]};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    const auto [at, is_new] = number.try_emplace(root(t[0]), parts.size());
    if (is_new) parts.emplace_back();
    parts[at->second].push_back(corners);
  }
  return parts;
}

// Planes that may cut a part, of those through its concave edges evenly from the heaviest to the
// lightest, and three across.
std::vector<HalfSpace> planes_for(const Part& part) {
  struct Candidate {
    HalfSpace plane;
    double weight = 0.0;
  };
  std::map<std::array<int64_t, 4>, Candidate> candidates;  // by the plane, rounded
  const auto add = [&](Vector3d normal, const Vector3d& through, double weight) {
    normal.normalize();
    std::array<int64_t, 4> key;
    for (int i = 0; i < 3; ++i) key[i] = rounded(normal[i] * 1e4);
    if (key < std::array<int64_t, 4>{}) {
      normal = -normal;
      for (int64_t& each : key) each = -each;
    }
    key[3] = rounded(normal.dot(through) * 1e4);
    Candidate& candidate = candidates[key];
    if (candidate.weight == 0.0) candidate.plane = {normal, normal.dot(through)};
    candidate.weight += weight;
  };
  for (const ConcaveEdge& edge : part.concave()) {
    const double bend = edge.normal1.cross(edge.normal2).norm();
    const double weight = bend * (edge.to - edge.from).norm();
    add(edge.normal1 - edge.normal2, edge.from, weight);
    if (bend < 0.2) continue;
    add(edge.normal1, edge.from, weight);
    add(edge.normal2, edge.from, weight);
  }
  std::vector<Candidate> sorted;
  for (const auto& [key, candidate] : candidates) sorted.push_back(candidate);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Candidate& a, const Candidate& b) { return a.weight > b.weight; });
  const std::vector<Vector3d> corners = part.corners();
  const size_t most =
      std::min(sorted.size(), std::clamp<size_t>(kTrianglesToCut / corners.size(), 4, 40));
  std::vector<HalfSpace> planes;
  for (size_t i = 0; i < most; ++i) planes.push_back(sorted[i * sorted.size() / most].plane);
  Vector3d low = corners[0], high = low;
  for (const Vector3d& p : corners) low = low.cwiseMin(p), high = high.cwiseMax(p);
  for (int i = 0; i < 3; ++i) planes.push_back({Vector3d::Unit(i), (low[i] + high[i]) / 2});
  return planes;
}

std::optional<std::pair<Part, Part>> best_cut(const Part& part) {
  std::optional<std::pair<Part, Part>> best;
  double best_score = 0.0;
  for (const HalfSpace& plane : planes_for(part)) {
    auto above = part.in(plane);
    if (!above) continue;
    auto below = part.in({-plane.normal, -plane.distance});
    if (!below) continue;
    const double score = above->excess() + below->excess() +
                         kBalance * std::abs(above->volume() - below->volume()) +
                         kSection * above->section() * std::sqrt(above->section());
    if (best && score >= best_score) continue;
    best_score = score;
    best.emplace(std::move(*above), std::move(*below));
  }
  return best;
}

// Cuts until the hulls of all parts exceed them by `allowed` together, or there are `most` parts.
void cut(std::vector<Part>& parts, size_t most, double allowed) {
  std::vector<bool> whole(parts.size(), false);  // cannot be cut
  while (parts.size() < most) {
    double excess = 0.0;
    size_t worst = parts.size();
    for (size_t i = 0; i < parts.size(); ++i) {
      excess += parts[i].excess();
      if (!whole[i] && (worst == parts.size() || parts[i].excess() > parts[worst].excess()))
        worst = i;
    }
    if (worst == parts.size() || excess <= allowed) return;
    auto halves = best_cut(parts[worst]);
    if (!halves) {
      whole[worst] = true;
      continue;
    }
    parts[worst] = std::move(halves->first);
    parts.push_back(std::move(halves->second));
    whole.push_back(false);
  }
}

// Joins the pair of pieces whose hull gains the least, as long as all hulls together have at most
// that volume, or there are more than `most`.
void join(std::vector<ConvexPiece>& pieces, size_t most, double allowed) {
  std::vector<double> volumes;
  for (const ConvexPiece& piece : pieces) volumes.push_back(volume_of(piece));
  const auto both = [&](size_t i, size_t j) {
    std::vector<Vector3d> points = pieces[i].corners;
    points.insert(points.end(), pieces[j].corners.begin(), pieces[j].corners.end());
    return hull_of(points);
  };
  std::map<std::pair<size_t, size_t>, double> gains;
  const auto measure = [&](size_t i, size_t j) {
    gains[{i, j}] = volume_of(both(i, j)) - volumes[i] - volumes[j];
  };
  for (size_t i = 0; i < pieces.size(); ++i) {
    for (size_t j = i + 1; j < pieces.size(); ++j) measure(i, j);
  }
  double total = std::accumulate(volumes.begin(), volumes.end(), 0.0);
  size_t left = pieces.size();
  while (!gains.empty()) {
    const auto least =
        std::min_element(gains.begin(), gains.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    if (left <= most && total + least->second > allowed) break;
    const auto [i, j] = least->first;
    total += least->second;
    --left;
    pieces[i] = both(i, j);
    volumes[i] = volume_of(pieces[i]);
    pieces[j].corners.clear();
    for (auto each = gains.begin(); each != gains.end();) {
      const auto [a, b] = each->first;
      each = a == i || a == j || b == i || b == j ? gains.erase(each) : std::next(each);
    }
    for (size_t k = 0; k < pieces.size(); ++k) {
      if (k != i && !pieces[k].corners.empty()) measure(std::min(i, k), std::max(i, k));
    }
  }
  std::erase_if(pieces, [](const ConvexPiece& piece) { return piece.corners.empty(); });
}

}  // namespace

std::vector<ConvexPiece> convex_pieces(std::span<const Vector3d> positions,
                                       std::span<const std::array<uint32_t, 3>> triangles,
                                       size_t most) {
  if (triangles.size() > kMostTriangles || most == 0) return {};
  Vector3d low = positions[triangles[0][0]], high = low;
  for (const auto& t : triangles) {
    for (const uint32_t i : t) {
      low = low.cwiseMin(positions[i]);
      high = high.cwiseMax(positions[i]);
    }
  }
  const Vector3d center = (low + high) / 2;
  const double size = (high - low).maxCoeff();
  if (!(size > 0.0)) return {};
  std::vector<Vector3d> of_size_1;
  for (const Vector3d& p : positions) of_size_1.emplace_back((p - center) / size);

  std::vector<std::vector<Triangle>> solids = connected(of_size_1, triangles);
  if (solids.size() > kMostParts) return {};
  // A cavity is a part whose surface looks inwards: it belongs to the one around it.
  if (std::any_of(solids.begin(), solids.end(),
                  [](const auto& solid) { return volume_of(solid) <= 0.0; })) {
    for (size_t i = 1; i < solids.size(); ++i)
      solids[0].insert(solids[0].end(), solids[i].begin(), solids[i].end());
    solids.resize(1);
  }
  std::vector<Part> parts;
  double volume = 0.0, excess = 0.0;
  for (const auto& solid : solids) {
    auto concave = concave_edges(solid);
    if (!concave) return {};
    parts.emplace_back(solid, std::move(*concave));
    volume += parts.back().volume();
    excess += parts.back().excess();
  }
  if (!(volume > 0.0)) return {};
  if (parts.size() <= most && excess <= kConvex * volume) return {};

  cut(parts, 2 * most, kCut * volume);
  std::vector<ConvexPiece> pieces;
  for (const Part& part : parts) pieces.push_back(hull_of(part.corners()));
  join(pieces, most, (1.0 + kAllowed) * volume);
  for (ConvexPiece& piece : pieces) {
    for (Vector3d& p : piece.corners) p = p * size + center;
  }
  return pieces;
}

}  // namespace ruedo::world
