#pragma once
// The elements of a surface in the Base role: pieces of its triangles, and cells of a grid over flat regions
// (ContactResampling).
#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

/// Fills in the elements of a surface of which the faces are made. Throws std::invalid_argument where there would be too
/// many.
void make_elements(ContactSurface::Data& data, const ContactSurfaceOptions& options, double default_edge_m);

}  // namespace takt
