#pragma once
// A cap screw with a hexagon socket, the bit that drives it, and the tapped block with its washer. Metres.
#include <filesystem>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

/// M8 (ISO 4762) with a short thread and a coarse mesh.
struct CapScrewParameters {
  double diameter = 0.008;  ///< nominal
  double pitch = 0.00125;
  double clearance = 6e-5;     ///< radial, between the profiles of screw and hole
  double length = 0.008;       ///< of the thread, from the head
  double head_height = 0.008;  ///< its diameter is 1.625 times the nominal one
  double recess_across_flats = 0.006;
  double recess_depth = 0.005;
  double bit_clearance = 3e-5;  ///< of the bit in the socket, per side
  double hole_depth = 0.00625;  ///< of the tapped hole, which goes through
  double contact_edge = 5e-4;   ///< of elements up and down the flanks
  int columns = 36;             ///< vertices around the screw, a multiple of 12; the hole has 12 more
};

/// Radius of the head, and inner and outer one of the washer.
double head_radius(const CapScrewParameters& p);
double washer_inner_radius(const CapScrewParameters& p);

/// Origin: centre of the bearing face, at z = 0; the head is below, the thread goes up to z = length. A crest is
/// at angle 0 and z = 0, a flat of the socket at 30 degrees.
Solid make_cap_screw(const CapScrewParameters& p);
/// Origin: centre of the lower face. A groove is at angle 0 and z = 0.
Solid make_tapped_block(const CapScrewParameters& p);
/// As high as a fifth of the diameter. Origin: centre of the lower face.
Solid make_washer(const CapScrewParameters& p);
/// A hexagon prism, 5 diameters long, a flat at 30 degrees. Origin: centre of the end at the chuck; the tip is
/// at positive z.
Solid make_hex_bit(const CapScrewParameters& p);
/// A jaw of the chuck, at positive y: its inner face at y = 0, at positive z.
Solid make_chuck_jaw(const CapScrewParameters& p);

/// cap_screw.obj, tapped_block.obj, washer.obj, hex_bit.obj and chuck_jaw.obj.
void make_cap_screw_meshes(const std::filesystem::path& directory, const CapScrewParameters& p = {});

}  // namespace takt::meshes
