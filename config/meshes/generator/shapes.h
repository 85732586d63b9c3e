#pragma once
// Shapes of the small contact scenes, each a closed solid. Lengths in metres, axis z unless said otherwise.
#include <string>

#include "config/meshes/generator/solid.h"

namespace takt::meshes {

/// An icosahedron cut into 20 * 4^levels triangles, its corners on the sphere about the origin.
Solid make_icosphere(const std::string& name, double radius, int levels);

/// An upright peg with flats (make_revolved), both ends chamfered at 45 degrees. Origin: centre of the
/// bottom.
struct Peg {
  double radius = 0.0;  ///< over the flats
  double length = 0.0;
  double chamfer = 0.0;
  int facets = 0;
  double edge = 0.0;  ///< of the mesh along its outline
};
Solid make_peg(const std::string& name, const Peg& peg);

/// A bush with flats: a hole along z in a round block, its rims chamfered at 45 degrees. Origin: centre of
/// the hole's floor, or of the lower face where the hole goes through; the top at z = depth.
struct Bush {
  double hole_radius = 0.0;   ///< over the flats
  double outer_radius = 0.0;  ///< over the flats
  double depth = 0.0;
  double floor = 0.0;  ///< thickness below the hole; 0: it goes through
  double chamfer = 0.0;
  int facets = 0;
  double edge = 0.0;
};
Solid make_bush(const std::string& name, const Bush& bush);

/// A torus about z: a ring of `around` flats with a tube of `across` ones (corners on the tube's circle).
Solid make_ring(const std::string& name, double ring_radius, double tube_radius, int around, int across);

/// A hook in the plane y = 0: a shank along -z from (0, 0, shank) to the origin, then an arc that continues
/// downwards and turns towards +x. Its lowest point is at x = arc_radius, z = -arc_radius.
struct Hook {
  double tube_radius = 0.0;
  double arc_radius = 0.0;  ///< of the tube's centre line
  double arc_angle = 0.0;   ///< rad
  double shank = 0.0;       ///< length
  int across = 0;           ///< corners around the tube
  double edge = 0.0;        ///< along it
};
Solid make_hook(const std::string& name, const Hook& hook);

/// The shared surface of bolt and socket: a wave around a cylinder that climbs by `pitch` per turn,
/// right-handed: radius(z, angle) = radius + amplitude sin(2 pi z / pitch - angle).
struct Thread {
  double radius = 0.0;  ///< mean
  double amplitude = 0.0;
  double pitch = 0.0;
  int turns = 0;
  int around = 0;        ///< columns
  int per_turn = 0;      ///< rows
  double chamfer = 0.0;  ///< 45 degrees: a bolt begins by this smaller, a hole wider than all of its thread
};
/// Thread from the origin up, then a round head.
Solid make_bolt(const std::string& name, const Thread& thread, double head_radius, double head_height);
/// The thread as a hole through a round block, from the origin up.
Solid make_socket(const std::string& name, const Thread& thread, double outer_radius, double edge);

/// An incline along x: its slope begins at the origin and falls by `angle` (rad) towards +x over `run` in x,
/// `width` in y (centred); `foot` of material below the lower end.
Solid make_wedge(const std::string& name, double angle, double run, double width, double foot);

}  // namespace takt::meshes
