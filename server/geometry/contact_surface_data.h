#pragma once
// What ContactSurface prepared, for the Polygonal Contact Model alone. All in the frame of the body.
#include <array>
#include <cstdint>
#include <vector>

#include "server/geometry/box_tree.h"
#include "server/geometry/contact_surface.h"

namespace takt {

/// Triangles of one plane that hang together count as one face for depths.
struct ContactPatch {
  Vec3 normal = Vec3::Zero();  ///< outwards
  double offset_m = 0.0;       ///< normal . x on the plane
};

struct ContactFace {
  std::array<std::uint32_t, 3> vertex{};
  std::int32_t patch = -1;
  std::int32_t region = -1;                 ///< faces connected by edges that are not sharp
  std::array<std::int32_t, 3> neighbour{};  ///< face beyond the edge from vertex k to k+1
  std::array<std::int32_t, 3> rim{};        ///< that edge's number if it is sharp and convex, else -1
  /// Signed distance of a point of the plane to edge k, positive inside: inward[k] . x + shift_m[k].
  std::array<Vec3, 3> inward;
  std::array<double, 3> shift_m{};
};

/// Faces of one patch that nearly fill a rectangle, or one face.
struct ContactPiece {
  std::int32_t patch = -1;
  std::array<Vec3, 4> corner;        ///< of the rectangle, or of the face, the last one twice
  std::uint32_t begin = 0, end = 0;  ///< in piece_faces
};

/// A sharp convex edge.
struct ContactRim {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  std::array<std::int32_t, 2> region{};  ///< of the faces on both sides
};

/// Elements that lie together and look into similar directions: a range of them, and a box around their
/// beginnings. A tree of such ranges; the first child of a cluster is the next one.
struct ContactCluster {
  Vec3 center_B = Vec3::Zero(), half_m = Vec3::Zero();
  Mat3 axes_B = Mat3::Identity();  ///< of the box, columns; the last is the mean normal, where there is one
  double radius_m = 0.0;           ///< of the sphere about the centre around the box
  double cone_cos = -1.0;          ///< least cosine of an element's normal with the last axis
  std::uint32_t begin = 0, end = 0;
  std::int32_t second = -1;  ///< child; -1 if this is not divided
};

/// Edges with a larger angle between the normals of their faces are sharp (cosine of 20 degrees).
inline constexpr double kSharpCosine = 0.93969262078590838;

struct ContactSurface::Data {
  // Elements, in the order of the clusters.
  std::vector<double> px, py, pz;  ///< centroid
  std::vector<double> nx, ny, nz;  ///< outward unit normal
  std::vector<double> area_m2;
  std::vector<double> line_m;            ///< length of the penetration line, inwards
  std::vector<double> fade_m;            ///< width of the fade at rims of the Target: half the element's size
  std::vector<std::uint32_t> triangle;   ///< of the mesh
  std::vector<ContactCluster> clusters;  ///< the first is of all elements
  double largest_fade_m = 0.0;
  double surface_area_m2 = 0.0;

  std::vector<Vec3> vertices;
  std::vector<ContactFace> faces;
  std::vector<ContactPatch> patches;
  std::vector<std::int32_t> patch_region;  ///< per patch
  std::vector<ContactRim> rims;
  BoxTree face_tree;
  BoxTree rim_tree;
  std::vector<ContactPiece> pieces;  ///< cover all faces
  std::vector<std::int32_t> piece_faces;
  BoxTree piece_tree;  ///< labelled with the patches

  Aabb bounds;
  BodyBox box;            ///< the same
  double radius_m = 0.0;  ///< of the sphere about its centre around all vertices

  std::size_t element_count() const { return area_m2.size(); }
  Vec3 point(std::size_t element) const { return {px[element], py[element], pz[element]}; }
  Vec3 normal(std::size_t element) const { return {nx[element], ny[element], nz[element]}; }
  std::array<Vec3, 3> corners(const ContactFace& face) const {
    return {vertices[face.vertex[0]], vertices[face.vertex[1]], vertices[face.vertex[2]]};
  }
  /// Whether the line p + t d, which meets the plane of the face at x, goes through the face. An edge beyond
  /// which the surface goes on is wide by 1 nm, so that no line slips through between two faces. At an edge
  /// where it turns back as seen along the line, both faces decide by the same number: it meets both or none.
  bool pierces(const ContactFace& face, const Vec3& p, const Vec3& d, const Vec3& x) const;
};

inline constexpr double kEdgeWidth_m = 1e-9;

}  // namespace takt
