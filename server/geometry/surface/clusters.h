#pragma once
// Groups of contact elements and of faces, so that one test serves a whole group.
#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

/// Builds the tree of clusters of `data` and sorts the elements into its order.
void make_clusters(ContactSurface::Data& data);

/// Divides the patches of `data` into pieces; the faces must exist already.
void make_pieces(ContactSurface::Data& data);

}  // namespace takt
