#pragma once
// Names and materials of a product's bodies.
#include <map>
#include <string>
#include <vector>

#include "server/product/product.h"

namespace takt::product {

/// A name as a key of a scenario: letters, digits and `_`, beginning with a letter.
std::string key_of(const std::string& name);

/// Names that programs make up for uses of a part: empty, a number, NAUO1, =>[0:1:1:3] and the like.
bool is_generic(const std::string& name);

/// Names of nuts, and of screws and bolts: words (nut, screw, bolt, stud; in German, French, Italian, Spanish), a thread
/// (M5x20), and numbers of standards (ISO 4032, DIN 912).
bool is_nut(const std::string& name);
bool is_screw(const std::string& name);
/// Names of threaded inserts, which are pressed or melted into a hole and are nuts within: insert, heat-set, Helicoil.
bool is_threaded_insert(const std::string& name);

/// Appends _2, _3 and so on to names that are there already.
void make_names_unique(std::vector<Instance>& instances);

/// The material that a file states (density 0: without), completed by `densities` (kg/m^3; by name of a material or body;
/// "*": any), a table of usual materials, or else steel. What is not stated is marked as assumed.
Material material_of(const std::string& stated, const std::string& body, double density_kg_m3,
                     const std::map<std::string, double>& densities);

}  // namespace takt::product
