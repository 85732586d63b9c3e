#include "server/contact/surface/face_strips.h"

#include <algorithm>
#include <cmath>

#include "server/contact/surface/face_batch.h"

namespace takt {
namespace {

/// Faces of one path, those of one flat included.
constexpr int kMostFaces = 12;

double height_m(const ContactPatch& plane, const Vec3& x) {
  return plane.normal.dot(x) - plane.offset_m;
}

void begin_strip(const ContactPatch& plane, FaceStrip& strip) {
  strip.normal_T.fill(plane.normal);
  strip.offset_m.fill(plane.offset_m);
  strip.side.fill(0.0);
}

/// From the face `first` along the path. Returns the least height on the way.
double follow_path(const ContactSurface::Data& target, std::int32_t first, const Vec3& x_T,
                   const Vec3& path_T, FaceStrip& strip) {
  const auto face_of = [&](std::int32_t i) -> const ContactFace& {
    return target.faces[static_cast<std::size_t>(i)];
  };
  const auto plane_of = [&](const ContactFace& face) -> const ContactPatch& {
    return target.patches[static_cast<std::size_t>(face.patch)];
  };
  const ContactFace* face = &face_of(first);
  begin_strip(plane_of(*face), strip);
  double least_m = height_m(plane_of(*face), x_T), at = 0.0;
  std::size_t planes = 1;
  for (int i = 0; i < kMostFaces; ++i) {
    double leaves_at = INFINITY;
    std::size_t edge = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double rate = face->inward[k].dot(path_T);
      if (!(rate < 0.0)) continue;
      const double crosses_at = -(face->inward[k].dot(x_T) + face->shift_m[k]) / rate;
      if (crosses_at < leaves_at) leaves_at = crosses_at, edge = k;
    }
    at = std::max(at, leaves_at);
    if (!(at < 1.0)) break;
    const ContactFace& next = face_of(face->neighbour[edge]);
    if (next.patch != face->patch) {
      const ContactPatch& plane = plane_of(next);
      least_m = std::min(least_m, height_m(plane, x_T + at * path_T));
      if (planes == FaceStrip::kPlanes) return least_m;
      strip.normal_T[planes] = plane.normal;
      strip.offset_m[planes] = plane.offset_m;
      strip.side[planes] = plane.normal.dot(face->inward[edge]) < 0.0 ? 1.0 : -1.0;
      ++planes;
    }
    face = &next;
  }
  return std::min(least_m, height_m(plane_of(*face), x_T + path_T));
}

}  // namespace

void find_strips(const ContactSurface::Data& target, const Pose& X_TB, std::span<const ElementPath> elements,
                 double margin_m, std::span<FaceStrip> strips) {
  FaceBatch batch;
  std::array<Vec3, FaceOctree::kBatch> points;
  std::array<double, FaceOctree::kBatch> reach_m;
  for (std::size_t i = 0; i < elements.size(); ++i)
    points[i] = elements[i].p_B, reach_m[i] = elements[i].reach_m;
  batch.find(target, X_TB, {points.data(), elements.size()}, {reach_m.data(), elements.size()});
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const FaceOctree::Leaf* leaf = batch.leaf[i];
    const Vec3& x_T = batch.x_T[i];
    FaceStrip& strip = strips[i];
    strip.near = false;
    if (batch.at_least_m[i] > reach_m[i]) continue;
    const Vec3 path_T = X_TB.R * elements[i].path_B;
    if (leaf != nullptr && leaf->kind == FaceOctree::Kind::patch &&
        path_T.squaredNorm() <= margin_m * margin_m) {
      const ContactPatch& plane = target.patches[static_cast<std::size_t>(leaf->patch)];
      begin_strip(plane, strip);
      strip.near = height_m(plane, x_T) <= 2.0 * margin_m;
      continue;
    }
    const NearestFace nearest = leaf != nullptr ? target.nearest_face(x_T, *leaf) : target.nearest_face(x_T);
    if (nearest.face < 0) continue;
    const ContactFace& face = target.faces[static_cast<std::size_t>(nearest.face)];
    const double distance_m = std::sqrt(nearest.closest.squared_m2);
    if (distance_m > reach_m[i] && !target.inside(face, nearest.closest, x_T)) continue;
    strip.near = follow_path(target, nearest.face, x_T, path_T, strip) <= margin_m;
  }
}

}  // namespace takt
