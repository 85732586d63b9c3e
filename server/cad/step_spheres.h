#pragma once
// Parametrisation of spherical faces in STEP files.
#include <Interface_InterfaceModel.hxx>

namespace takt::cad {

/// OpenCASCADE's transfer may take the wrong side of a face whose border runs through a pole of its SPHERICAL_SURFACE, where
/// the longitude jumps: a shell of 23 cm^3 became a ball of 881 cm^3. Before the transfer the poles of such a sphere are turned
/// away from the borders of all its faces, which changes no shape. Spheres with a seam or with PCURVEs keep theirs.
void turn_poles_from_borders(const Interface_InterfaceModel& model);

}  // namespace takt::cad
