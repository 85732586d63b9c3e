#include "config/meshes/generator/cap_screw_meshes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "config/meshes/generator/screw_meshes.h"
#include "config/meshes/generator/thread_surface.h"
#include "config/meshes/generator/write_meshes.h"

namespace takt::meshes {
namespace {

void check(const CapScrewParameters& p) {
  const auto refuse = [](const char* name, double found, const std::string& allowed) {
    throw std::invalid_argument(std::string("cap_screw.") + name + " is " + std::to_string(found) +
                                "; allowed: " + allowed);
  };
  if (p.columns < 12 || p.columns % 12 != 0)
    refuse("columns", p.columns, "a multiple of 12, so that the hexagon has its corners");
  if (p.pitch >= 0.5 * p.diameter) refuse("pitch", p.pitch, "less than half of cap_screw.diameter");
  if (p.recess_across_flats >= 1.3 * p.diameter)
    refuse("recess_across_flats", p.recess_across_flats, "less than 1.3 times cap_screw.diameter");
  if (p.recess_depth >= p.head_height)
    refuse("recess_depth", p.recess_depth, "less than cap_screw.head_height");
  if (p.bit_clearance >= 0.2 * p.recess_across_flats)
    refuse("bit_clearance", p.bit_clearance, "less than a fifth of cap_screw.recess_across_flats");
}

}  // namespace

double head_radius(const CapScrewParameters& p) {
  return 0.8125 * p.diameter;
}
double washer_inner_radius(const CapScrewParameters& p) {
  return 0.525 * p.diameter;
}

Solid make_cap_screw(const CapScrewParameters& p) {
  check(p);
  MeshMaker maker("cap_screw");
  const BasicProfile profile(p.diameter, p.pitch, p.clearance);
  const Ring thread = add_bolt_thread(maker, profile, p.length, p.columns, p.contact_edge);
  const double edge = 2.0 * p.contact_edge;
  const double floor = p.recess_depth - p.head_height;
  const Ring bottom = maker.hexagon(p.recess_across_flats, p.columns, floor);
  maker.fan(reversed(bottom), {0.0, 0.0, floor});
  const Ring mouth = maker.wall(bottom, -p.head_height, edge),
             back = maker.circle(head_radius(p), p.columns, -p.head_height);
  maker.ring(mouth, back);
  const Ring bearing = maker.wall(back, 0.0, p.head_height);
  // The bearing face beside the washer's bore in rings, as elements.
  Ring outer = bearing;
  const double inner = washer_inner_radius(p);
  const int rings = std::max(1, static_cast<int>(std::ceil((head_radius(p) - inner) / edge)));
  for (int k = 1; k <= rings; ++k) {
    const Ring next = maker.circle(head_radius(p) + (inner - head_radius(p)) * k / rings, p.columns, 0.0);
    maker.ring(outer, next);
    outer = next;
  }
  maker.ring(outer, thread);
  return maker.take();
}

Solid make_tapped_block(const CapScrewParameters& p) {
  check(p);
  ScrewParameters thread;
  thread.diameter = p.diameter;
  thread.pitch = p.pitch;
  thread.nut_height = p.hole_depth;
  thread.across_flats = 3.0 * p.diameter;
  thread.contact_edge = p.contact_edge;
  thread.nut_columns = p.columns + 12;
  Solid block = make_nut(thread);
  block.name = "tapped_block";
  return block;
}

Solid make_washer(const CapScrewParameters& p) {
  check(p);
  const double height = 0.2 * p.diameter, inner = washer_inner_radius(p), outer = p.diameter;
  return make_revolved("washer", {{inner, 0.0}, {outer, 0.0}, {outer, height}, {inner, height}}, true, 64);
}

Solid make_hex_bit(const CapScrewParameters& p) {
  check(p);
  MeshMaker maker("hex_bit");
  const double across = p.recess_across_flats - 2.0 * p.bit_clearance, chamfer = 0.1 * across;
  const double length = 5.0 * p.diameter, edge = 2.0 * p.contact_edge;
  const int columns = p.columns;
  const Ring back = maker.hexagon(across, columns, 0.0);
  maker.fan(reversed(back), Vec3::Zero());
  // Fine only where it is in the socket.
  const Ring shank = maker.wall(back, length - 1.2 * p.recess_depth, length),
             tip = maker.wall(shank, length - chamfer, edge);
  const Ring end = maker.hexagon(across - 2.0 * chamfer, columns, length);
  maker.ring(tip, end);
  maker.fan(end, {0.0, 0.0, length});
  return maker.take();
}

Solid make_chuck_jaw(const CapScrewParameters& p) {
  const double size = p.diameter;
  Solid jaw = make_revolved("chuck_jaw", {{0.0, 0.0}, {size, 0.0}, {size, size}, {0.0, size}}, false, 4);
  for (Vec3& v : jaw.vertices) v.y() += size;
  return jaw;
}

void make_cap_screw_meshes(const std::filesystem::path& directory, const CapScrewParameters& p) {
  std::filesystem::create_directories(directory);
  write_solids(directory, "cap_screw", "Cap screw with an ISO metric thread and a hexagon socket.",
               {make_cap_screw(p)});
  write_solids(directory, "tapped_block", "Hexagon block with a tapped hole.", {make_tapped_block(p)});
  write_solids(directory, "washer", "Washer of the cap screw.", {make_washer(p)});
  write_solids(directory, "hex_bit", "Hexagon bit.", {make_hex_bit(p)});
  write_solids(directory, "chuck_jaw", "Jaw of a chuck.", {make_chuck_jaw(p)});
}

}  // namespace takt::meshes
