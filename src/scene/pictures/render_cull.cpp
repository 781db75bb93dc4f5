#include "scene/pictures/render_cull.h"

#include <algorithm>
#include <numeric>

namespace ruedo::scene {
namespace {

// Parts with a smaller radius in pixels are left out, or drawn with few triangles.
constexpr double kInvisiblePixels = 0.3, kSmallPixels = 14.0;
// Round shapes with a smaller radius in metres cast shadows as coarse shapes.
constexpr double kCoarseShadowRadius = 0.25;

}  // namespace

bool same_drawing(const DrawList& a, const DrawList& b) {
  const auto bytes = [](const DrawList& list) { return std::as_bytes(std::span(list.instances)); };
  return a.opaque == b.opaque && std::ranges::equal(bytes(a), bytes(b));
}

Region view_region(const View& view) {
  const auto& [rotation, eye] = view.X_WCamera;
  const Vec3 ahead = rotation * Vec3::UnitX(), left = rotation * Vec3::UnitY(),
             up = rotation * Vec3::UnitZ();
  // The edges of the picture, half a pixel beyond the outermost pixel centres.
  const double l = (view.cx + 0.5) / view.fx, r = (view.width - 0.5 - view.cx) / view.fx;
  const double t = (view.cy + 0.5) / view.fy, b = (view.height - 0.5 - view.cy) / view.fy;
  Region region;
  const auto add = [&](const Vec3& normal, const Vec3& point) {
    const Vec3 n = normal.normalized();
    region.planes.push_back({n, -n.dot(point)});
  };
  if (view.orthographic) {
    add(left, eye - r * left);
    add(-left, eye + l * left);
    add(up, eye - b * up);
    add(-up, eye + t * up);
  } else {
    add(left + r * ahead, eye);
    add(-left + l * ahead, eye);
    add(up + b * ahead, eye);
    add(-up + t * ahead, eye);
  }
  add(ahead, eye + view.near_m * ahead);
  add(-ahead, eye + view.far_m * ahead);
  return region;
}

Culler::Culler(const world::BodyLayout& layout, const RenderContent& content)
    : layout_(layout),
      content_(content),
      rank_(content.batches.size()),
      M_WL_(layout.links.size()) {
  for (const LinkIndex i : layout.links.indices()) {
    const bool is_static = !layout.links[i].body.valid();
    if (is_static) M_WL_[i] = to_affine(layout.links[i].X_BL);
    if (!content.kind_of_link[i].valid()) continue;
    visible_links_.push_back(i);
    (is_static ? static_links_ : moving_links_).push_back(i);
  }
  // Sorted by program, then by texture; the ground last, as most of it is hidden by then.
  std::vector<int> order(content.batches.size());
  std::iota(order.begin(), order.end(), 0);
  const auto key = [&](int i) {
    const Batch& b = content.batches[i];
    return std::make_tuple(b.flags & kGround, b.flags, b.texture, b.mesh, b.first_index);
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  for (size_t i = 0; i < order.size(); ++i) rank_[order[i]] = static_cast<int>(i);
}

void Culler::update(const Snapshot& snapshot) {
  for (const LinkIndex i : layout_.links.indices()) {
    if (layout_.links[i].body.valid()) M_WL_[i] = to_affine(scene::link_pose(layout_, snapshot, i));
  }
}

void Culler::append(std::vector<Item>& items, const Vec3& origin, std::vector<Run>& runs,
                    std::vector<Instance>& instances) const {
  for (const Item& item : items) {
    if (runs.empty() || runs.back().batch != item.batch) {
      runs.push_back({item.batch, static_cast<uint32_t>(instances.size()), 0});
    }
    ++runs.back().count;
    Affine m = compose(M_WL_[item.link], item.part->M_LP);
    m.col(3) -= origin;
    Instance& out = instances.emplace_back();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 4; ++c) out.rows[r][c] = static_cast<float>(m(r, c));
    }
    out.diffuse = item.part->diffuse;
    out.specular = item.part->specular;
    out.emissive = item.part->emissive;
    out.label = content_.label_of_link[item.link];
  }
}

void Culler::collect(const Region& region, const Vec3& origin, double pixels_per_radian,
                     bool orthographic, DrawList& list) {
  opaque_.clear();
  transparent_.clear();
  for (const LinkIndex link : visible_links_) {
    const RenderLinkKind& kind = content_.link_kinds[content_.kind_of_link[link]];
    const Affine& M = M_WL_[link];
    if (!region.touches(M.leftCols<3>() * kind.centre_L + M.col(3), kind.radius)) continue;
    for (const RenderPart& part : kind.parts) {
      const Vec3 centre = M.leftCols<3>() * part.centre_L + M.col(3);
      if (kind.parts.size() > 1 && !region.touches(centre, part.radius)) continue;
      const double distance = (centre - origin).norm();
      // From the eye to the nearest point of the sphere; 0 in a parallel view.
      const double depth = orthographic ? 1.0 : std::max(distance - part.radius, 1e-3);
      const double pixels = pixels_per_radian > 0.0 ? part.radius * pixels_per_radian / depth : 1e9;
      if (pixels < kInvisiblePixels) continue;
      const int batch = pixels < kSmallPixels ? part.small_batch : part.batch;
      (part.transparent ? transparent_ : opaque_)
          .push_back({rank_[batch], batch, static_cast<float>(distance), link, &part});
    }
  }
  std::sort(opaque_.begin(), opaque_.end(), [](const Item& a, const Item& b) {
    return std::tie(a.rank, a.distance, a.link, a.part) <
           std::tie(b.rank, b.distance, b.link, b.part);
  });
  std::sort(transparent_.begin(), transparent_.end(), [](const Item& a, const Item& b) {
    return std::tie(b.distance, a.link, a.part) < std::tie(a.distance, b.link, b.part);
  });
  list.instances.clear();
  list.opaque.clear();
  list.transparent.clear();
  append(opaque_, origin, list.opaque, list.instances);
  append(transparent_, origin, list.transparent, list.instances);
}

void Culler::collect_casters(const Region& region, const Vec3& origin, Movers movers,
                             DrawList& list) {
  opaque_.clear();
  list.spheres.clear();
  for (const LinkIndex link : movers == Movers::only_static ? static_links_ : moving_links_) {
    const RenderLinkKind& kind = content_.link_kinds[content_.kind_of_link[link]];
    const Affine& M = M_WL_[link];
    const Vec3 link_centre = M.leftCols<3>() * kind.centre_L + M.col(3);
    if (!region.touches(link_centre, kind.radius)) continue;
    list.spheres.emplace_back(link_centre, kind.radius);
    for (const RenderPart& part : kind.parts) {
      if (!part.casts_shadow ||
          !region.touches(M.leftCols<3>() * part.centre_L + M.col(3), part.radius))
        continue;
      const int batch = part.radius < kCoarseShadowRadius ? part.small_batch : part.batch;
      opaque_.push_back({rank_[batch], batch, 0.0f, link, &part});
    }
  }
  std::sort(opaque_.begin(), opaque_.end(), [](const Item& a, const Item& b) {
    return std::tie(a.rank, a.link, a.part) < std::tie(b.rank, b.link, b.part);
  });
  list.instances.clear();
  list.opaque.clear();
  list.transparent.clear();
  append(opaque_, origin, list.opaque, list.instances);
}

}  // namespace ruedo::scene
