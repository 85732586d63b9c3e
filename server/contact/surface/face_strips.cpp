#include "server/contact/surface/face_strips.h"

#include <algorithm>
#include <cmath>

#include "server/contact/surface/face_batch.h"

namespace takt {
namespace {

/// Faces of one piece, those of one flat included.
constexpr int kMostFaces = 12;

double height_m(const ContactPatch& plane, const Vec3& x) {
  return plane.normal.dot(x) - plane.offset_m;
}

}  // namespace

void find_nearest(const ContactSurface::Data& target, const Pose& X_TB, std::span<const ElementPath> elements,
                  std::span<std::int32_t> faces) {
  FaceBatch batch;
  std::array<Vec3, FaceOctree::kBatch> points;
  std::array<double, FaceOctree::kBatch> reach_m;
  for (std::size_t i = 0; i < elements.size(); ++i)
    points[i] = elements[i].p_B, reach_m[i] = elements[i].reach_m;
  batch.find(target, X_TB, {points.data(), elements.size()}, {reach_m.data(), elements.size()});
  for (std::size_t i = 0; i < elements.size(); ++i) {
    faces[i] = -1;
    if (batch.at_least_m[i] > reach_m[i]) continue;
    const FaceOctree::Leaf* leaf = batch.leaf[i];
    const Vec3& x_T = batch.x_T[i];
    const NearestFace nearest = leaf != nullptr ? target.nearest_face(x_T, *leaf) : target.nearest_face(x_T);
    if (nearest.face < 0) continue;
    const ContactFace& face = target.faces[static_cast<std::size_t>(nearest.face)];
    if (nearest.closest.squared_m2 <= reach_m[i] * reach_m[i] || target.inside(face, nearest.closest, x_T))
      faces[i] = nearest.face;
  }
}

void follow_path(const ContactSurface::Data& target, const Vec3& x_T, const Vec3& path_T, double beside_m,
                 std::int32_t& face, FaceStrip& strip) {
  const auto face_of = [&](std::int32_t i) -> const ContactFace& {
    return target.faces[static_cast<std::size_t>(i)];
  };
  const auto plane_of = [&](const ContactFace& of) -> const ContactPatch& {
    return target.patches[static_cast<std::size_t>(of.patch)];
  };
  const double length_m = path_T.norm();
  const double beside = length_m > beside_m ? beside_m / length_m : 1.0;
  std::int32_t now = face;
  double at = -beside;
  strip.planes = 1;
  strip.plane[0] = &plane_of(face_of(now));
  strip.side[0] = 0.0;
  strip.least_m = height_m(*strip.plane[0], x_T + at * path_T);
  for (int i = 0; i < kMostFaces; ++i) {
    const ContactFace& here = face_of(now);
    double leaves_at = INFINITY;
    std::size_t edge = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double rate = here.inward[k].dot(path_T);
      if (!(rate < 0.0)) continue;
      const double crosses_at = -(here.inward[k].dot(x_T) + here.shift_m[k]) / rate;
      if (crosses_at < leaves_at) leaves_at = crosses_at, edge = k;
    }
    at = std::max(at, leaves_at);
    if (!(at < 1.0 + beside)) break;
    const ContactFace& next = face_of(here.neighbour[edge]);
    if (next.patch != here.patch) {
      if (strip.planes == FaceStrip::kPlanes) break;
      const ContactPatch& plane = plane_of(next);
      strip.least_m = std::min({strip.least_m, height_m(*strip.plane[strip.planes - 1], x_T + at * path_T),
                                height_m(plane, x_T + at * path_T)});
      strip.plane[strip.planes] = &plane;
      strip.side[strip.planes] = plane.normal.dot(here.inward[edge]) < 0.0 ? 1.0 : -1.0;
      ++strip.planes;
    }
    now = here.neighbour[edge];
    if (at < 1.0 - beside) face = now;
  }
  strip.least_m =
      std::min(strip.least_m, height_m(*strip.plane[strip.planes - 1], x_T + (1.0 + beside) * path_T));
}

}  // namespace takt
