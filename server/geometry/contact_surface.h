#pragma once
// The surface of a component prepared for surface contact, once per mesh and independent of any partner: as
// Base its elements (position, inward normal, area, length of the penetration line), as Target its faces with
// a bounding hierarchy. (Hippmann 2024; thesis 2.2.2.)
#include <memory>
#include <vector>

#include "server/geometry/aabb.h"
#include "server/geometry/triangle_mesh.h"

namespace takt {

struct ContactSurfaceOptions {
  /// Triangles of the Base with a longer edge are divided until none has one (0: the mesh as it is).
  double element_edge_m = 0.0;
  /// Longest penetration line. Each line also ends half-way to the opposite wall of its own body.
  double line_length_m = 0.02;
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
  const Aabb& bounds_B() const;

  struct Data;  ///< what PolygonalContact reads (contact_surface_data.h)
  const Data& data() const { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

}  // namespace takt
