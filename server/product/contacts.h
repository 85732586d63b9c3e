#pragma once
// What touches what in a finished product, and how: the contact graph, from the faces of its bodies.
#include <vector>

#include "server/product/product.h"

namespace takt::product {

struct ContactTolerances {
  double plane_gap_m = 5e-5;  ///< planes further apart do not touch, but for parts that touch nothing else
  double largest_clearance_m = 3e-4;  ///< of radii; a shaft in a wider hole is no fit
  double largest_interference_m = 2e-4;
  double least_area_m2 = 5e-8;  ///< a smaller common surface is no contact
  double surface_gap_m = 2e-5;  ///< between other surfaces, beyond the deflection of their meshes
};

/// The contacts of all pairs of instances, sorted by first, second, kind and area (largest first):
///   plane         two planes that face each other; of several with one normal the areas are added. What would touch nothing
///                 touches planes within the largest clearance, as it lies there with play
///   cylinder_fit  a shaft in a hole on one axis
///   thread        helical faces on one axis with one pitch; or, as most CAD models have plain cylinders in their place, a
///                 shaft and a hole on one axis of nearly one radius, of parts that are named as fasteners, or of the nominal
///                 and the core diameter of a thread. Its pitch is then that of the ISO coarse thread (ISO 261) of the nearest
///                 diameter
///   other         any other surfaces that lie on each other; of a part that touches nothing, one that it stands inside of, with
///                 the depth as negative clearance and no area
/// Kind `snap` follows from the ways in which parts can leave (disassembly.h).
std::vector<Contact> find_contacts(const Product& product, const ContactTolerances& tolerances = {});

}  // namespace takt::product
