#pragma once
// Where the mesh of a product has to be finer than elsewhere: on faces that touch.
#include <vector>

#include "server/product/product.h"

namespace takt::product {

/// How near the facets of a mesh have to be to each face (m), by body and face; 0: as near as they are. Facets of a shaft and
/// of its hole stand out of the circle, and press where the surfaces leave room. Cylinders that fit, and cones that lie on
/// each other, get an eighth of their clearance or interference, of at least 20 um, and at most 256 facets around.
std::vector<std::vector<double>> face_deflections(const Product& product);

}  // namespace takt::product
