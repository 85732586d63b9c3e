#pragma once
// Meshes of the chainsaw cell (config/scenarios/chainsaw_motor.yaml): shapes of the kind and size of thesis
// 5.4.1, whose CAD data are not public. Lengths in metres.
#include <filesystem>
#include <vector>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

struct ChainsawParameters {
  // Press fit: the motor's boss in the housing's seat.
  double boss_radius = 0.012;
  double interference = 10e-6;  ///< radial: by how much the seat is narrower than the boss; < 0: clearance
  double boss_chamfer = 1e-3, seat_chamfer = 1e-3;
  double seat_depth = 0.015;  ///< of the bore; the boss is 12 mm long
  // Elsewhere.
  double nest_clearance = -0.2e-3;  ///< of the boss in the box, per side; < 0: it is held in soft walls
  double cavity_clearance = 2e-3;   ///< of the motor's flange in the housing, radial
  double fixture_preload = 5e-6;    ///< by how much each stop presses into the mount
  // Meshes: number of flats around the axis.
  int motor_facets = 80, housing_facets = 420;
  double contact_edge = 1e-3;  ///< of elements along the bore
};

/// Origin: centre of the boss' end; z along the axis. Two flats to grip it by, 40 mm across y.
Solid make_motor(const ChainsawParameters& p);
/// Five convex shapes that together are the motor.
std::vector<Solid> make_motor_pieces(const ChainsawParameters& p);
/// With its mount; origin: centre of the lower face. The motor stands with its origin at seat_z().
Solid make_housing(const ChainsawParameters& p);
double seat_z();
/// Origin: centre of the lower face; the motor stands in it with its origin at box_floor().
Solid make_open_box(const ChainsawParameters& p);
double box_floor();
/// Four stops around the housing's mount that hold it in place. Origin: that of the housing.
std::vector<Solid> make_fixture(const ChainsawParameters& p);
/// Origin: centre of the flange side; the grip face is y = 0.
Solid make_chainsaw_jaw();

void make_chainsaw_meshes(const std::filesystem::path& directory, const ChainsawParameters& p = {});

}  // namespace takt::meshes
