#pragma once
// One solid of a B-rep as a body: mesh, faces, exact volume.
#include <TopoDS_Shape.hxx>
#include <string>
#include <vector>

#include "server/product/product.h"

namespace takt::cad {

/// Fills mesh, faces, triangle_faces, exact and deflection_m of `body` from a solid whose lengths are in mm. `notes` gets
/// one sentence for each thing that is not as the file has it. False: no closed mesh could be made; the reason is in `notes`.
bool make_body(const TopoDS_Shape& solid_mm, double deflection_m, double angle_rad, product::Body& body,
               std::vector<std::string>& notes);

/// The mesh of that solid whose faces, those of `body.faces`, are within distances of their own (m; 0: `deflection_m`).
/// Empty where it is not closed, or the faces are not those of the solid: the body's mesh was repaired.
TriangleMesh finer_mesh(const TopoDS_Shape& solid_mm, double deflection_m, double angle_rad,
                        const product::Body& body, const std::vector<double>& face_deflections_m);

}  // namespace takt::cad
