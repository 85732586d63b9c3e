#pragma once
// What is done to the model of a STEP file ahead of its transfer to shapes.

namespace takt::cad {

/// All later transfers of this process, of files that a file refers to as well, begin with state_densities_in_g_per_cm3() and
/// turn_poles_from_borders(). More than one call changes nothing.
void prepare_models_of_transfers();

}  // namespace takt::cad
