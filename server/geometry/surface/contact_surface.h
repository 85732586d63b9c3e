#pragma once
// The surface of a component prepared for surface contact, once per mesh and independent of any partner: as
// Base its elements (centroid, area), as Target its faces with a bounding hierarchy. (Hippmann 2024; thesis
// 2.2.2.)
#include <memory>
#include <vector>

#include "server/geometry/aabb.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// The longest edge of elements where none is asked for: a share of the body's diagonal, so that a cube of
/// twelve triangles stands on its corners and edges and not on its centroids.
double default_element_edge_m(const TriangleMesh& mesh);

struct ContactSurfaceOptions {
  /// Triangles of the Base with a longer edge are divided until none has one (0: the mesh as it is).
  double element_edge_m = 0.0;
  bool operator==(const ContactSurfaceOptions&) const = default;
};

class ContactSurface {
 public:
  /// `mesh` must be closed (check_closed), outward normals. Throws std::invalid_argument else.
  ContactSurface(const TriangleMesh& mesh, const ContactSurfaceOptions& options);
  ~ContactSurface();

  std::size_t element_count() const;
  std::size_t face_count() const;  ///< triangles as Target
  double area_m2() const;          ///< of all elements together: the mesh's own
  double patch_area_m2() const;    ///< mean, of what is flat: triangles of one plane count as one
  /// Thickness of the body behind its surface, along the inward normal: exceeded nearly everywhere (m).
  double wall_m() const;
  const Aabb& bounds_B() const;

  struct Data;  ///< what PolygonalContact reads (contact_surface_data.h)
  const Data& data() const { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

}  // namespace takt
