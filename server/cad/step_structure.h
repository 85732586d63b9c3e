#pragma once
// Assemblies of a STEP file, before their transfer.
#include <Interface_InterfaceModel.hxx>

#include <string>

namespace takt::cad {

/// What makes a structure unreadable, which the transfer follows without an end.
struct StepStructure {
  std::string cyclic;   ///< name of an assembly that uses itself, directly or by others; empty: none does
  std::string largest;  ///< name of the assembly with most uses
  double uses = 0.0;    ///< of parts and assemblies in it, those within others counted each time
};

/// An assembly without a name is named by its label (#12).
StepStructure structure_of(const Interface_InterfaceModel& model);

}  // namespace takt::cad
