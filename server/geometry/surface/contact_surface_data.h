#pragma once
// The prepared data of ContactSurface, for the Polygonal Contact Model alone. All in the frame of the body.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/geometry/box_tree.h"
#include "server/geometry/surface/contact_surface.h"
#include "server/geometry/surface/face_octree.h"

namespace takt {

/// Connected triangles of one plane count as one face for depths.
struct ContactPatch {
  Vec3 normal = Vec3::Zero();  ///< outwards
  double offset_m = 0.0;       ///< normal . x on the plane
};

struct ContactFace {
  std::array<std::uint32_t, 3> vertex{};
  std::int32_t patch = -1;
  std::array<std::int32_t, 3> neighbour{};  ///< face beyond the edge from vertex k to k+1
  std::uint8_t sharp_inwards =
      0;  ///< bit k: edge k is a corner that goes inwards; 3 + k: the face beyond has one
  /// Signed distance of a point of the plane to edge k, positive inside: inward[k] . x + shift_m[k].
  std::array<Vec3, 3> inward;
  std::array<double, 3> shift_m{};
};

/// Faces of one patch that nearly fill a rectangle, or one face.
struct ContactPiece {
  std::int32_t patch = -1;
  std::array<Vec3, 4> corner;        ///< of the rectangle; of a triangle, the last one twice
  std::uint32_t begin = 0, end = 0;  ///< in piece_faces
};

/// The point of a face closest to another point, and the feature of the face that has it.
struct ClosestOnFace {
  enum class Feature : std::uint8_t { inside, edge, vertex };
  Feature feature = Feature::inside;
  std::uint8_t number = 0;  ///< of the edge (from vertex k to k+1) or of the vertex
  Vec3 q = Vec3::Zero();
  double squared_m2 = 0.0;  ///< distance
};

/// Faces that are further away than the closest one by more than rounding are skipped.
inline constexpr double kFurther = 1.0 + 1e-9;
/// Centroids closer than this to an edge or a vertex have no direction to it: they are on the surface.
inline constexpr double kOnSurface_m = 1e-12;

/// The closest face so far, and its point.
struct NearestFace {
  std::int32_t face = -1;
  ClosestOnFace closest{.squared_m2 = std::numeric_limits<double>::infinity()};
};

/// Neighbouring elements with similar normals: a range of elements, and a box around their centroids. The
/// clusters form a tree; the first child of a cluster is the next one.
struct ContactCluster {
  Vec3 center_B = Vec3::Zero(), half_m = Vec3::Zero();
  Mat3 axes_B = Mat3::Identity();  ///< of the box, as columns; the last is the mean normal if that exists
  double radius_m = 0.0;           ///< of the sphere about the centre around the box
  double cone_cos = -1.0;          ///< smallest cosine between an element's normal and the last axis
  std::uint32_t begin = 0, end = 0;
  std::int32_t second = -1;  ///< child; -1 for a leaf
};

struct ContactSurface::Data {
  // Elements, in the order of the clusters.
  std::vector<double> px, py, pz;  ///< centroid
  std::vector<double> nx, ny, nz;  ///< outward unit normal
  std::vector<double> area_m2;
  std::vector<std::uint32_t> triangle;  ///< of the mesh; of a resampled element the one that has its centroid
  struct Outline {
    std::uint32_t begin = 0, end = 0;  ///< in outline_points
  };
  /// For pictures: of the elements, empty for pieces of triangles; without resampling there are none.
  std::vector<Outline> outlines;
  std::vector<Vec3> outline_points;
  std::size_t strip_count = 0;  ///< elements more than without strips along rims
  ResamplingReport resampling;
  std::vector<ContactCluster> clusters;  ///< the first has all elements
  double surface_area_m2 = 0.0;

  std::vector<Vec3> vertices;
  /// Per vertex: normals of its faces weighted by their angles there; their sign separates inside from
  /// outside (Baerentzen, Aanaes: Signed distance computation using the angle weighted pseudonormal, IEEE
  /// TVCG 2005).
  std::vector<Vec3> vertex_normal;
  std::vector<std::int32_t> vertex_patch;  ///< the patch of all its faces; -1: several patches
  std::vector<ContactFace> faces;
  std::vector<ContactPatch> patches;
  BoxTree face_tree;
  FaceOctree octree;                 ///< empty unless curved()
  std::vector<ContactPiece> pieces;  ///< cover all faces
  std::vector<std::int32_t> piece_faces;
  BoxTree piece_tree;  ///< labelled with the patches

  Aabb bounds;
  BodyBox box;            ///< equal to `bounds`
  double radius_m = 0.0;  ///< of the sphere about its centre around all vertices
  double wall_m = 0.0;    ///< see ContactSurface::wall_m()

  /// Most faces are flats of their own, and there are many: regions and candidate lists hold for short ways
  /// only.
  bool curved() const { return patches.size() > 64 && 4 * patches.size() > faces.size(); }
  /// Mean edge of a square with the area of a face (m).
  double face_size_m() const { return std::sqrt(surface_area_m2 / static_cast<double>(faces.size())); }
  std::size_t element_count() const { return area_m2.size(); }
  Vec3 point(std::size_t element) const { return {px[element], py[element], pz[element]}; }
  Vec3 normal(std::size_t element) const { return {nx[element], ny[element], nz[element]}; }
  std::array<Vec3, 3> corners(const ContactFace& face) const {
    return {vertices[face.vertex[0]], vertices[face.vertex[1]], vertices[face.vertex[2]]};
  }
  ClosestOnFace closest_on_face(const ContactFace& face, const Vec3& x) const;
  /// Whether the closest point is on a flat patch: an edge between two faces of one patch, or a vertex in its
  /// middle, is not there.
  bool is_flat(const ContactFace& face, const ClosestOnFace& closest) const {
    using Feature = ClosestOnFace::Feature;
    if (closest.feature == Feature::inside) return true;
    return closest.feature == Feature::edge
               ? faces[static_cast<std::size_t>(face.neighbour[closest.number])].patch == face.patch
               : vertex_patch[face.vertex[closest.number]] == face.patch;
  }
  /// Direction of the edge that has the closest point; zero if it is a vertex.
  Vec3 edge_direction(const ContactFace& face, const ClosestOnFace& closest) const {
    if (closest.feature != ClosestOnFace::Feature::edge) return Vec3::Zero();
    const std::size_t k = closest.number;
    return (vertices[face.vertex[(k + 1) % 3]] - vertices[face.vertex[k]]).normalized();
  }
  /// Keeps this face if it is closer to x than the one so far; of equally close ones the lower number.
  /// Returns whether it does.
  bool take_nearer(std::int32_t face, const Vec3& x, NearestFace& nearest) const {
    const ContactFace& candidate = faces[static_cast<std::size_t>(face)];
    if (least_squared_m2(candidate, x) > kFurther * nearest.closest.squared_m2) return false;
    const ClosestOnFace closest = closest_on_face(candidate, x);
    const double before_m2 = nearest.closest.squared_m2;
    if (!(closest.squared_m2 < before_m2 || (closest.squared_m2 == before_m2 && face < nearest.face)))
      return false;
    nearest = {face, closest};
    return true;
  }
  /// Bounds the distance of a point from a face but for rounding: within its plane a face is no nearer than the line of
  /// an edge that the point is beyond.
  struct FaceBound {
    double height_m, beyond_m;  ///< above the plane; to the furthest of these lines, negative, or 0
    double squared_m2() const { return height_m * height_m + beyond_m * beyond_m; }
  };
  FaceBound bound_of(const ContactFace& face, const Vec3& x) const {
    const ContactPatch& plane = patches[static_cast<std::size_t>(face.patch)];
    FaceBound bound{plane.normal.dot(x) - plane.offset_m, 0.0};
    for (std::size_t k = 0; k < 3; ++k)
      bound.beyond_m = std::min(bound.beyond_m, face.inward[k].dot(x) + face.shift_m[k]);
    return bound;
  }
  /// Lower bound of the squared distance (m^2).
  double least_squared_m2(const ContactFace& face, const Vec3& x) const {
    return bound_of(face, x).squared_m2();
  }
  /// Walks the hierarchy of all faces. No face for an x that is not finite. A `guess` that is close spares most of
  /// the walk; the result is the same.
  NearestFace nearest_face(const Vec3& x, std::int32_t guess = -1) const;
  /// The same face for an x of this leaf of the octree, from the faces that the leaf lists, if it does.
  NearestFace nearest_face(const Vec3& x, const FaceOctree::Leaf& leaf) const;
  /// Distance of x to the surface (m), negative inside. Walks the hierarchy of all faces. `nearest`: the closest
  /// face, before the call that of a point near x.
  double signed_distance_m(const Vec3& x, NearestFace& nearest) const;
  double signed_distance_m(const Vec3& x) const {
    NearestFace nearest;
    return signed_distance_m(x, nearest);
  }
  /// Whether x, whose closest point on the surface is `closest` of this face, is inside.
  bool inside(const ContactFace& face, const ClosestOnFace& closest, const Vec3& x) const;
};

inline constexpr double kEdgeWidth_m = 1e-9;

}  // namespace takt
