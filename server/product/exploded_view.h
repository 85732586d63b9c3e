#pragma once
// Where the parts of a product stand in an exploded view.
#include <vector>

#include "server/product/disassembly.h"

namespace takt::product {

/// Shifts of a part, in the world, in the order in which it leaves: with its subassembly, then out of it. Their sum is its
/// place in the view.
using Explosion = std::vector<std::vector<Vec3>>;  ///< by instance

/// Each part is moved along the directions of its removals, until it lies beyond all parts that it leaves behind and whose
/// shadows it meets or touches. What is stuck, and the base, stay.
Explosion explode(const Product& product, const Disassembly& plan);

}  // namespace takt::product
