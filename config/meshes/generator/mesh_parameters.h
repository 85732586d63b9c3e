#pragma once
// Parameters of the large cells' meshes by name, as takt-make-meshes takes them: chainsaw.interference=5e-5.
#include <iosfwd>
#include <string>

#include "config/meshes/generator/cap_screw_meshes.h"
#include "config/meshes/generator/chainsaw_meshes.h"
#include "config/meshes/generator/lamp_meshes.h"
#include "config/meshes/generator/rotor_meshes.h"
#include "config/meshes/generator/screw_meshes.h"

namespace takt::meshes {

struct CellParameters {
  ChainsawParameters chainsaw;
  RotorParameters rotor;
  ScrewParameters screw;
  GearParameters gear;
  CapScrewParameters cap_screw;
  LampParameters lamp;
};

/// "GROUP.NAME=VALUE". Throws std::invalid_argument with the values allowed.
void set_parameter(CellParameters& parameters, const std::string& text);

/// Lists all names with their values and the values allowed, one per line.
void list_parameters(std::ostream& out, const CellParameters& parameters);

}  // namespace takt::meshes
