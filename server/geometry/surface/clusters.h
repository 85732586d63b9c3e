#pragma once
// Groups of contact elements and of faces, so that what holds for a group is looked at once.
#include "server/geometry/surface/contact_surface_data.h"

namespace takt {

/// Brings the elements of `data` into the order of a tree of clusters, and makes that.
void make_clusters(ContactSurface::Data& data);

/// Divides the patches of `data`, whose faces are there, into pieces.
void make_pieces(ContactSurface::Data& data);

}  // namespace takt
