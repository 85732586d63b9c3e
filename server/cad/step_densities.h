#pragma once
// Densities of materials in STEP files (MEASURE_REPRESENTATION_ITEM in a DERIVED_UNIT, ISO 10303-41).
#include <Interface_InterfaceModel.hxx>

namespace takt::cad {

/// OpenCASCADE's transfer overlooks prefixes of the unit of mass: 7850 kg/m^3 becomes 7.85. So each density is stated in g/cm^3
/// before the transfer, which leaves it as it is. Exponents do not count: exporters write m^3 for m^-3, and others.
void state_densities_in_g_per_cm3(const Interface_InterfaceModel& model);

}  // namespace takt::cad
