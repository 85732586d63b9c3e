#pragma once
// Planes and cylinders in meshes: for bodies without a B-rep, and for faces that a B-rep has as splines.
#include <vector>

#include "server/product/product.h"

namespace takt::product {

/// Makes `face` the plane or cylinder that all of the vertices lie on, within 1 um or 1e-4 of the radius. `normals` are the
/// unit normals of the triangles. Any other face stays as it is.
void recognise(const std::vector<Vec3>& vertices, const std::vector<Vec3>& normals, Face& face);

/// Which way the material lies, and outward normals of planes, from the triangles of the faces.
void orient_faces(Body& body);

/// Fills `faces`, `triangle_faces` and `deflection_m` of a body with a closed mesh:
///   planes     triangles that are connected and lie in one plane
///   cylinders  triangles that are connected and whose vertices lie on one cylinder, of at least four facets that meet at
///              less than 34 degrees. A prism of 11 flats or more is taken for one
///   other      small facets that meet at less than 34 degrees, e.g. of cones, spheres and free forms
/// The deflection is estimated from the angles of the facets.
void find_faces(Body& body);

}  // namespace takt::product
