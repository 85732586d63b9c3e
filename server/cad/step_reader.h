#pragma once
// Reads STEP files (AP203, AP214, AP242) with OpenCASCADE into a product: structure, names, placements, colours,
// materials, exact mass properties, closed meshes, faces.
#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>

#include "server/product/product.h"

namespace takt::cad {

/// The file is unusable; what() has the file and the reason.
class CadError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct StepOptions {
  double deflection_m = 1e-4;           ///< largest distance of mesh and surface
  double angular_deflection_rad = 0.2;  ///< largest angle between neighbouring facets of a curved face
  /// Densities (kg/m^3) by name of a material in the file or of a body; "*": of all that the file gives none.
  std::map<std::string, double> densities{};
  int time_limit_s = 60;  ///< of the processor's time for one solid; at least 1
};

/// Lengths in m, whatever the unit of the file. Solids of one part become bodies of their own. Bodies that are mirrored
/// or scaled where they are used become bodies of their own. Surfaces that bound no solid are left out, with a note; so is a solid that OpenCASCADE does not mesh
/// within its time, or crashes on.
/// Throws CadError for a missing or unreadable file, and one without a solid. The same file gives the same product.
product::Product read_step(const std::filesystem::path& file, const StepOptions& options = {});

}  // namespace takt::cad
