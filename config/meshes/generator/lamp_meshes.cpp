#include "config/meshes/generator/lamp_meshes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "config/meshes/generator/thread_surface.h"
#include "config/meshes/generator/write_meshes.h"

namespace takt::meshes {
namespace {

constexpr double kTip = 0.005;    // radius of the lamp's contact
constexpr double kBulb = 0.030;   // radius of the bulb
constexpr double kNeck = 0.0115;  // radius between thread and bulb

KnuckleProfile profile(const LampParameters& p, double outwards) {
  return {p.crest_radius + outwards, p.root_radius + outwards, p.pitch};
}

void check(const LampParameters& p) {
  const double depth = p.crest_radius - p.root_radius;
  if (p.pitch <= 2.0 * depth)
    throw std::invalid_argument("lamp.pitch is " + std::to_string(p.pitch) +
                                " m; allowed: more than twice the thread's depth of " +
                                std::to_string(depth) + " m");
}

}  // namespace

double thread_height(const LampParameters& p) {
  return p.root_radius - kTip;
}

double axial_play(const LampParameters& p) {
  // The crests' arcs of cap and socket, of equal radius, touch where their centres are two radii apart.
  const double two = 2.0 * profile(p, 0.0).arc_radius(),
               beside = two - (p.crest_radius - p.root_radius) + p.clearance;
  return 0.5 * p.pitch - std::sqrt(two * two - beside * beside);
}

Solid make_lamp(const LampParameters& p) {
  check(p);
  MeshMaker maker("lamp");
  const KnuckleProfile thread = profile(p, 0.0);
  const double from = thread_height(p), top = from + p.thread_length;
  const Ring contact = maker.circle(kTip, p.columns, 0.0);
  maker.fan(reversed(contact), Vec3::Zero());
  // Both ends run out at 45 degrees to the root.
  const ThreadEnds ends =
      add_thread(maker, {p.pitch, from, p.thread_length, p.columns, thread.rows(p.contact_edge), true},
                 [&](double along, double z) {
                   return std::min(thread.radius(along), p.root_radius + std::min(z, p.thread_length - z));
                 });
  maker.ring(contact, ends.lower);
  // Neck and bulb.
  Ring last = maker.circle(kNeck, p.columns, top + 0.5 * kNeck);
  maker.ring(ends.upper, last);
  const double begins = std::asin(kNeck / kBulb), center = top + kNeck + kBulb * std::cos(begins);
  constexpr int kRings = 12;
  for (int k = 0; k < kRings; ++k) {
    const double angle = begins + (std::numbers::pi - begins) * k / kRings;
    const Ring next = maker.circle(kBulb * std::sin(angle), p.columns, center - kBulb * std::cos(angle));
    maker.ring(last, next);
    last = next;
  }
  maker.fan(last, {0.0, 0.0, center + kBulb});
  return maker.take();
}

Solid make_lamp_socket(const LampParameters& p) {
  check(p);
  MeshMaker maker("lamp_socket");
  const KnuckleProfile thread = profile(p, p.clearance);
  const int columns = p.columns + 12;
  const double crest = p.crest_radius + p.clearance, height = p.thread_length;
  const ThreadEnds ends =
      add_thread(maker, {p.pitch, 0.0, height, columns, thread.rows(p.contact_edge), false},
                 [&](double along, double z) {
                   return std::max(thread.radius(along), crest - std::min(z, height - z));
                 });
  const Ring lower = maker.circle(1.3 * crest, columns, 0.0),
             upper = maker.circle(1.3 * crest, columns, height);
  maker.ring(lower, upper);
  maker.ring(upper, ends.upper);
  maker.ring(ends.lower, lower);
  return maker.take();
}

Solid make_lamp_contact(const LampParameters& p) {
  const double radius = 0.5 * p.root_radius;
  return make_revolved("lamp_contact", {{0.0, -0.003}, {radius, -0.003}, {radius, 0.0}, {0.0, 0.0}}, false,
                       24);
}

void make_lamp_meshes(const std::filesystem::path& directory, const LampParameters& p) {
  std::filesystem::create_directories(directory);
  write_solids(directory, "lamp", "Lamp with an E27 cap.", {make_lamp(p)});
  write_solids(directory, "lamp_socket", "Threaded tube of an E27 socket.", {make_lamp_socket(p)});
  write_solids(directory, "lamp_contact", "Contact of an E27 socket.", {make_lamp_contact(p)});
}

}  // namespace takt::meshes
