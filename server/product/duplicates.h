#pragma once
// Solids that a file has twice at one place: hidden copies, an assembly inserted twice.
#include "server/product/product.h"

namespace takt::product {

/// Leaves out each instance that fills the space of an earlier one: volume, centre, inertia and bounding box are equal
/// within 1e-6. A note names both and the remedy. Bodies stay, without instances. Before find_contacts().
void leave_out_duplicates(Product& product);

}  // namespace takt::product
