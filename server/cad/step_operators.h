#pragma once
// Placements of a STEP file that mirror or scale (CARTESIAN_TRANSFORMATION_OPERATOR_3D, ISO 10303-42).
#include <Interface_InterfaceModel.hxx>
#include <TopoDS_Shape.hxx>
#include <gp_Trsf.hxx>

#include <string>
#include <vector>

namespace takt::cad {

/// OpenCASCADE's transfer takes turn and shift out of such an operator alone. So each one is made a shift, far out of any
/// product, before the transfer, and its own placement takes the place of that shift afterwards.
class StepOperators {
 public:
  /// Changes the operators of the model that place parts of assemblies, or shapes within a part (MAPPED_ITEM).
  explicit StepOperators(const Interface_InterfaceModel& model);

  /// The placement of a use of a part (mm) in place of that of the transfer. `problem` says why it cannot be found; it stays
  /// as it is otherwise.
  gp_Trsf placement(const gp_Trsf& transferred, std::string& problem) const;

  /// The shape of a part (mm) with the shapes within it at their own placements, in place of that of the transfer.
  TopoDS_Shape placed(const TopoDS_Shape& transferred, std::string& problem) const;

 private:
  std::vector<gp_Trsf> own_;  ///< by number of the shift; lengths in the unit of the file
};

}  // namespace takt::cad
