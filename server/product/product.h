#pragma once
// The process model of a product before it becomes a scenario: its parts as CAD data give them, what touches what, and
// how. Readers of CAD formats fill it (server/cad); contacts and plans are derived from it (server/product).
// Units: m, kg, rad. W is the frame of the product, which becomes the world; B the frame of a body.
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "plant_models/spatial.h"
#include "server/geometry/mesh/triangle_mesh.h"

namespace takt::product {

/// Kind of the surface that a face lies on.
enum class SurfaceKind { plane, cylinder, cone, sphere, torus, helix, other };

/// One face of a body. A reader without B-rep faces finds planes and cylinders in the mesh.
struct Face {
  SurfaceKind kind = SurfaceKind::other;
  Vec3 point_B = Vec3::Zero();  ///< a point of the plane, of the axis, or the centre of the sphere
  Vec3 axis_B = Vec3::UnitZ();  ///< outward normal of a plane, else direction of the axis (unit)
  double radius_m = 0.0;        ///< of cylinder, sphere, torus (outer); 0 for others
  double pitch_m = 0.0;         ///< of a helix: advance per turn, positive if right-handed
  bool concave = false;         ///< material lies outside of the surface: a hole, a groove
  double area_m2 = 0.0;
};

/// What a body is made of.
struct Material {
  std::string name;  ///< empty: the file names none
  double density_kg_m3 = 0.0;
  bool assumed = false;  ///< the density is takt's assumption
};

/// One solid; several instances may share it.
struct Body {
  std::string name;
  TriangleMesh mesh;          ///< closed, in B
  TriangleMesh contact_mesh;  ///< closed, finer on faces that touch: for files; empty: `mesh` is
  std::vector<Face> faces;
  std::vector<int> triangle_faces;  ///< index into `faces` for each triangle of `mesh`
  VolumeProperties exact;           ///< of the B-rep where there is one, else of the mesh
  Material material;
  std::optional<std::array<float, 4>> colour;  ///< red, green, blue, alpha from 0 to 1
  double deflection_m = 0.0;  ///< largest distance of mesh and surface; 0: the mesh is the surface
};

/// A body at its place in the finished product.
struct Instance {
  std::string name;  ///< unique; letters, digits, `_`; a key of the scenario
  std::string path;  ///< names from the root of the product's tree, as the file has them, joined by `/`
  std::size_t body = 0;
  Pose X_WB;
};

/// How two instances touch.
enum class ContactKind { plane, cylinder_fit, thread, snap, other };

/// A contact of two instances of the finished product.
struct Contact {
  std::size_t first = 0;  ///< index of an instance; less than `second`
  std::size_t second = 0;
  ContactKind kind = ContactKind::other;
  double clearance_m = 0.0;     ///< gap of planes; difference of radii of a fit; negative: interference
  double area_m2 = 0.0;         ///< of the surface that both share
  Vec3 point_W = Vec3::Zero();  ///< in the middle of the shared surface
  Vec3 axis_W = Vec3::UnitZ();  ///< normal of a plane (from first to second), axis of a fit or thread (unit)
  double radius_m = 0.0;        ///< of a fit or thread: of the wider of its surfaces
  double pitch_m = 0.0;         ///< of a thread, positive if right-handed
  std::vector<Vec3>
      normals_W;  ///< unit outward normals of `first` where it touches `second`: `first` cannot move along
                  ///< d where d . n > 0 for one of them
};

/// A product as its file gives it.
struct Product {
  std::string name;
  std::string source;  ///< path of the file
  std::vector<Body> bodies;
  std::vector<Instance> instances;
  std::vector<Contact> contacts;   ///< sorted by first, second, kind
  std::vector<std::string> notes;  ///< what the reader assumed, repaired or left out: one sentence each
};

}  // namespace takt::product
