#pragma once
// The surface of a component prepared for surface contact, once per mesh and independent of any partner: for
// the Base role its elements (centroid, area), for the Target role its faces with a bounding hierarchy
// (Hippmann 2024; thesis 2.2.2).
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/geometry/aabb.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt {

/// Default of the longest edge of elements: a share of the body's diagonal, so that a cube of twelve
/// triangles has elements near its corners and edges.
double default_element_edge_m(const TriangleMesh& mesh);

/// Whether the elements of the Base are cells of a grid over each flat region (resampling.h) instead of pieces of its
/// triangles. `automatic`: in the regions where that does away with slender elements on a quarter of the area, with at
/// least as many elements there as pieces of triangles, if that is a tenth of the surface (needles that are parallel
/// stay); and in those that have over four times as many pieces as cells of a 32nd of the edge of a square as large.
enum class ContactResampling : std::uint8_t { automatic, always, never };

struct ContactSurfaceOptions {
  /// Triangles of the Base with a longer edge are divided (0: the mesh stays). Resampled elements are cells of at
  /// most half of it, which is as dense (0: half of default_element_edge_m; `automatic` leaves the mesh).
  double element_edge_m = 0.0;
  ContactResampling resampling = ContactResampling::never;
  bool operator==(const ContactSurfaceOptions&) const = default;
};

/// The elements before and after resampling; all zero where no region is resampled.
struct ResamplingReport {
  double spacing_m = 0.0;  ///< no cell is larger
  std::size_t elements_before = 0, elements = 0;
  double slender_share_before = 0.0, slender_share = 0.0;  ///< of the area, in elements longer than 10 widths
};

/// "N cells ... in place of M pieces ...", of a report with a spacing.
std::string sentence_of(const ResamplingReport& report);

class FaceOctreeCache;

class ContactSurface {
 public:
  /// `mesh` must be closed (check_closed) with outward normals, else throws std::invalid_argument. The result does not
  /// depend on `octrees`.
  ContactSurface(const TriangleMesh& mesh, const ContactSurfaceOptions& options,
                 const FaceOctreeCache* octrees = nullptr);
  ~ContactSurface();

  std::size_t element_count() const;
  const ResamplingReport& resampling() const;
  std::size_t face_count() const;  ///< triangles in the Target role
  double area_m2() const;          ///< of all elements together, equal to the mesh's area
  double patch_area_m2() const;    ///< mean area of the flat patches: triangles of one plane count as one
  /// Thickness of the body behind its surface along the inward normal (m): exceeded nearly everywhere.
  double wall_m() const;
  const Aabb& bounds_B() const;

  struct Data;  ///< used by PolygonalContact (contact_surface_data.h)
  const Data& data() const { return *data_; }

 private:
  std::unique_ptr<Data> data_;
};

}  // namespace takt
