#include "server/contact/surface/face_strips.h"

#include <algorithm>
#include <cmath>

#include "server/contact/surface/face_batch.h"

namespace takt {
namespace {

/// Faces of one piece, those of one flat included.
constexpr int kMostFaces = 12;

/// Sine of the angle between two planes of one flat face (CAD exports).
constexpr double kLeastFold = 1e-3;

double height_m(const ContactPatch& plane, const Vec3& x) {
  return plane.normal.dot(x) - plane.offset_m;
}

/// In front of an edge sharper than a right angle a point may be below the plane of one of its faces.
std::int32_t highest_at(const ContactSurface::Data& target, const NearestFace& nearest, const Vec3& x_T) {
  using Feature = ClosestOnFace::Feature;
  const auto height = [&](std::int32_t i) {
    return height_m(target.patches[static_cast<std::size_t>(target.faces[static_cast<std::size_t>(i)].patch)],
                    x_T);
  };
  std::int32_t highest = nearest.face;
  if (nearest.closest.feature == Feature::inside) return highest;
  const ContactFace& face = target.faces[static_cast<std::size_t>(nearest.face)];
  const std::size_t k = nearest.closest.number;
  const bool edge = nearest.closest.feature == Feature::edge;
  for (const std::size_t beside : {k, edge ? k : (k + 2) % 3})
    if (height(face.neighbour[beside]) > height(highest)) highest = face.neighbour[beside];
  return highest;
}

}  // namespace

void find_nearest(const ContactSurface::Data& target, const Pose& X_TB, std::span<const ElementPath> elements,
                  double margin_m, std::span<NearFace> faces) {
  FaceBatch batch;
  std::array<Vec3, FaceOctree::kBatch> points;
  std::array<double, FaceOctree::kBatch> reach_m;
  for (std::size_t i = 0; i < elements.size(); ++i)
    points[i] = elements[i].p_B, reach_m[i] = elements[i].reach_m;
  batch.find(target, X_TB, {points.data(), elements.size()}, {reach_m.data(), elements.size()});
  for (std::size_t i = 0; i < elements.size(); ++i) {
    faces[i] = {};
    if (batch.at_least_m[i] > reach_m[i]) continue;
    const FaceOctree::Leaf* leaf = batch.leaf[i];
    const Vec3& x_T = batch.x_T[i];
    const NearestFace nearest = leaf != nullptr ? target.nearest_face(x_T, *leaf) : target.nearest_face(x_T);
    if (nearest.face < 0) continue;
    const ContactFace& face = target.faces[static_cast<std::size_t>(nearest.face)];
    const bool inside = target.inside(face, nearest.closest, x_T);
    if (!inside && nearest.closest.squared_m2 > reach_m[i] * reach_m[i]) continue;
    faces[i] = {nearest.face, !inside && nearest.closest.squared_m2 > margin_m * margin_m};
    if (!inside) faces[i].face = highest_at(target, nearest, x_T);
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
  const double path_m = path_T.norm();
  const double beside = path_m > beside_m ? beside_m / path_m : 1.0;
  std::int32_t now = face;
  double at = -beside;
  strip.planes = 1;
  strip.plane[0] = &plane_of(face_of(now));
  strip.side[0] = 0.0;
  strip.least_m = height_m(*strip.plane[0], x_T + at * path_T);
  strip.beside[0] = nullptr;
  double corner_m = INFINITY;  // how far the path is from the corner beside the last plane
  double missed_m = 0.0;       // by so much would the height be wrong without the plane beside it
  std::int32_t previous = -1;
  bool begins_on = true;  // on the last plane, by the sides of all before
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
    const double from = at;
    at = std::max(at, leaves_at);
    const Vec3 begin = x_T + from * path_T, end = x_T + std::min(at, 1.0 + beside) * path_T;
    const auto put_beside = [&](const ContactPatch& plane, double side) {
      strip.beside[strip.planes - 1] = &plane;
      strip.beside_side[strip.planes - 1] = side;
      if (side < 0.0) strip.least_m = std::min({strip.least_m, height_m(plane, begin), height_m(plane, end)});
    };
    if (here.sharp_inwards != 0) {
      const double low_m = std::min(height_m(plane_of(here), begin), height_m(plane_of(here), end));
      const double behind_m = beside_m + 2.0 * std::max(0.0, -low_m);
      const auto look_at = [&](const ContactFace& near) {
        for (std::size_t k = 0; k < 3; ++k) {
          if ((near.sharp_inwards >> k & 1U) == 0) continue;
          const double beside_edge_m =
              std::min(near.inward[k].dot(begin), near.inward[k].dot(end)) + near.shift_m[k];
          if (low_m > beside_m || beside_edge_m < -behind_m || beside_edge_m > std::min(corner_m, beside_m))
            continue;
          const Vec3& a = target.vertices[near.vertex[k]];
          const Vec3 along = target.vertices[near.vertex[(k + 1) % 3]] - a;
          const double length_m = along.norm(), first = along.dot(begin - a), last = along.dot(end - a);
          if (std::max(first, last) < -length_m * beside_m ||
              std::min(first, last) > length_m * (length_m + beside_m))
            continue;
          corner_m = beside_edge_m;
          put_beside(plane_of(face_of(near.neighbour[k])), -1.0);
        }
      };
      look_at(here);
      for (std::size_t k = 0; k < 3; ++k)
        if ((here.sharp_inwards >> (3 + k) & 1U) != 0) look_at(face_of(here.neighbour[k]));
    }
    for (std::size_t k = 0; k < 3 && corner_m == INFINITY; ++k) {
      if ((k == edge && at < 1.0 + beside) || here.neighbour[k] == previous) continue;
      const double beside_edge_m =
          std::min(here.inward[k].dot(begin), here.inward[k].dot(end)) + here.shift_m[k];
      const ContactFace& beyond = face_of(here.neighbour[k]);
      if (!(beside_edge_m < beside_m) || beyond.patch == here.patch) continue;
      const ContactPatch& plane = plane_of(beyond);
      const double fold = -plane.normal.dot(here.inward[k]);  // its sine, positive where convex
      const double wrong_m = std::abs(fold) * (beside_m - beside_edge_m);
      if (!(std::abs(fold) > kLeastFold && wrong_m > missed_m)) continue;
      missed_m = wrong_m;
      put_beside(plane, fold > 0.0 ? 1.0 : -1.0);
    }
    if (!(at < 1.0 + beside)) break;
    const ContactFace& next = face_of(here.neighbour[edge]);
    if (next.patch != here.patch) {
      if (strip.planes == FaceStrip::kPlanes) break;
      const ContactPatch& plane = plane_of(next);
      const double side = plane.normal.dot(here.inward[edge]) < 0.0 ? 1.0 : -1.0;
      begins_on =
          begins_on && side * (height_m(plane, x_T) - height_m(*strip.plane[strip.planes - 1], x_T)) > 0.0;
      // An element that comes from afar: the face does not reach to where it is.
      if (begins_on && at > beside) break;
      strip.least_m = std::min({strip.least_m, height_m(*strip.plane[strip.planes - 1], x_T + at * path_T),
                                height_m(plane, x_T + at * path_T)});
      strip.plane[strip.planes] = &plane;
      strip.beside[strip.planes] = nullptr;
      corner_m = INFINITY, missed_m = 0.0;
      strip.side[strip.planes] = side;
      ++strip.planes;
    }
    previous = now;
    now = here.neighbour[edge];
    if (at < 1.0 - beside) face = now;
  }
  strip.least_m =
      std::min(strip.least_m, height_m(*strip.plane[strip.planes - 1], x_T + (1.0 + beside) * path_T));
}

}  // namespace takt
