#pragma once
// A triangle mesh and its geometric properties: closedness, volume, centre of mass, inertia.
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "plant_models/spatial.h"
#include "server/geometry/aabb.h"

namespace takt {

/// Vertices in the frame B of the body (m); each triangle lists three vertices counter-clockwise seen from
/// outside.
struct TriangleMesh {
  using Triangle = std::array<std::uint32_t, 3>;

  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
};

/// The closed surface of a box between two opposite corners.
TriangleMesh box_mesh(const Vec3& lower, const Vec3& upper);

/// Box around all vertices, of which there must be one.
Aabb bounds_of(const TriangleMesh& mesh);

/// Reason why a mesh does not bound a solid; `problem` is empty if it does.
struct MeshCheck {
  std::string problem;  ///< a whole sentence with the number and place of the first fault
  bool ok() const { return problem.empty(); }
};

/// A solid's boundary: finite vertices, no triangle without area, every edge shared by exactly two triangles
/// that run through it in opposite directions, positive volume (outward normals).
MeshCheck check_closed(const TriangleMesh& mesh);

/// Volume integrals of a closed mesh at density 1 (divergence theorem; Mirtich 1996, Eberly 2002).
struct VolumeProperties {
  double volume = 0.0;           ///< m^3, negative if the faces point inwards
  Vec3 p_BBcm = Vec3::Zero();    ///< centre of volume in B
  Mat3 G_BBcm_B = Mat3::Zero();  ///< inertia about the centre for unit mass, axes of B (m^2)
};
VolumeProperties volume_properties(const TriangleMesh& mesh);

}  // namespace takt
