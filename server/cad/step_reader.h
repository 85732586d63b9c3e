#pragma once
// Reads STEP files (AP203, AP214, AP242) with OpenCASCADE into a product: structure, names, placements, colours,
// materials, exact mass properties, closed meshes, faces.
#include <filesystem>
#include <map>
#include <memory>
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
  int reading_limit_s =
      600;  ///< of the processor's time for the file without the meshes of its solids; at least 1
};

/// A STEP file. Lengths in m, whatever the unit of the file. Solids of one part become bodies of their own, and so do
/// bodies that are mirrored or scaled where they are used. Surfaces that bound no solid are left out, with a note; so is a
/// solid that OpenCASCADE does not mesh within its time, or crashes on. The same file gives the same product.
class StepFile {
 public:
  /// Throws CadError for a missing or unreadable file, and one without a solid. Ends the program where the file takes longer
  /// than its limit (TimeLimit).
  explicit StepFile(const std::filesystem::path& file, const StepOptions& options = {});
  ~StepFile();
  StepFile(const StepFile&) = delete;
  StepFile& operator=(const StepFile&) = delete;

  const product::Product& product() const;
  /// The mesh of a body with facets within these distances (m) of its faces, in the order of Body::faces; 0: within the
  /// deflection of the file. Empty where OpenCASCADE makes no such closed mesh.
  TriangleMesh finer_mesh(std::size_t body, const std::vector<double>& face_deflections_m) const;

 private:
  class Reader;
  std::unique_ptr<Reader> reader_;
};

/// The product of the file alone.
product::Product read_step(const std::filesystem::path& file, const StepOptions& options = {});

}  // namespace takt::cad
