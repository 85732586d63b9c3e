#pragma once
// Meshes of the rotor cell and of the furnace (config/scenarios/bev_rotor.yaml, furnace.yaml): shapes of the
// kind and size of thesis 5.5. Lengths in metres.
#include <filesystem>
#include <vector>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

struct RotorParameters {
  double radius = 0.100, height = 0.200, shaft_radius = 0.030;
  int slots = 8;                    ///< for magnets, through the whole height
  double slot_radius = 0.078;       ///< of the inner faces
  double magnet_width = 0.020;      ///< tangential; the slot is as wide
  double magnet_thickness = 0.008;  ///< radial
  double magnet_length = 0.080;
  double clearance = 0.0;          ///< of a magnet in its slot, per side; negative: interference
  double contact_edge = 2e-3;      ///< of elements of magnet and slot
  double magnet_chamfer = 0.5e-3;  ///< of the lower and upper edges
};

/// Origin: centre of the lower face; the middle of the first slot lies on +x.
Solid make_rotor_core(const RotorParameters& p);
/// Origin: centre of the lower face; x is radial.
Solid make_magnet(const RotorParameters& p);
/// A ring that lies on the core. Origin: centre of the lower face.
Solid make_rotor_cover(const RotorParameters& p);
/// A block with holes for two screws, 50 mm apart along x. Origin: centre of the lower face.
Solid make_screw_rack();
/// Shank downwards from the origin, head above it.
std::vector<Solid> make_screw();
/// Half of a punch that fits a slot: of the press's tool frame, z down, the other half is this one turned
/// about z by 180 degrees. Across y it is half as wide as the punch.
Solid make_punch_half(const RotorParameters& p);
/// The support of the core in the press, which leaves its slots free; origin: centre of the upper face.
Solid make_press_mount(const RotorParameters& p);
/// Open at the top, with a stand in the middle; origin: centre of the lower face. Six convex objects.
std::vector<Solid> make_furnace();
/// Height of the stand in the furnace.
double furnace_stand_z();

void make_rotor_meshes(const std::filesystem::path& directory, const RotorParameters& p = {});

}  // namespace takt::meshes
