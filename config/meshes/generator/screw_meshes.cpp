#include "config/meshes/generator/screw_meshes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "config/meshes/generator/shapes.h"
#include "config/meshes/generator/thread_surface.h"
#include "config/meshes/generator/write_meshes.h"

namespace takt::meshes {
namespace {

constexpr double kPi = std::numbers::pi;

void check(const ScrewParameters& p) {
  for (const auto& [name, columns] : {std::pair{"bolt", p.bolt_columns}, std::pair{"nut", p.nut_columns}})
    if (columns < 12 || columns % 12 != 0)
      throw std::invalid_argument(std::string("screw.") + name + "_columns is " + std::to_string(columns) +
                                  "; allowed: a multiple of 12, so that the hexagon has its corners");
  if (p.across_flats <= 1.1 * p.diameter)
    throw std::invalid_argument("screw.across_flats is " + std::to_string(p.across_flats) +
                                " m; allowed: more than 1.1 times screw.diameter");
  if (p.pitch >= 0.5 * p.diameter)
    throw std::invalid_argument("screw.pitch is " + std::to_string(p.pitch) +
                                " m; allowed: less than half of screw.diameter");
}

}  // namespace

ScrewParameters iso_metric(int size) {
  struct Size {
    int diameter_mm;
    double pitch, across_flats, nut_height, head_height;  // mm
  };
  constexpr std::array<Size, 5> kSizes{{{8, 1.25, 13.0, 6.8, 5.3},
                                        {10, 1.5, 16.0, 8.4, 6.4},
                                        {12, 1.75, 18.0, 10.8, 7.5},
                                        {16, 2.0, 24.0, 14.8, 10.0},
                                        {20, 2.5, 30.0, 18.0, 12.5}}};
  for (const Size& s : kSizes) {
    if (s.diameter_mm != size) continue;
    ScrewParameters p;
    p.diameter = 1e-3 * size;
    p.pitch = 1e-3 * s.pitch;
    p.across_flats = 1e-3 * s.across_flats;
    p.nut_height = 1e-3 * s.nut_height;
    p.head_height = 1e-3 * s.head_height;
    p.length = 13.0 * p.pitch;
    p.clearance = 0.05 * p.pitch;
    p.contact_edge = 0.175 * p.pitch;
    return p;
  }
  throw std::invalid_argument("no ISO metric size M" + std::to_string(size) +
                              "; allowed: M8, M10, M12, M16, M20");
}

Solid make_bolt(const ScrewParameters& p) {
  check(p);
  MeshMaker maker("bolt");
  const BasicProfile profile(p.diameter, p.pitch, p.clearance);
  const Ring thread = add_bolt_thread(maker, profile, p.length, p.bolt_columns, p.contact_edge);
  const Ring bearing = maker.hexagon(p.across_flats, p.bolt_columns, 0.0),
             back = maker.hexagon(p.across_flats, p.bolt_columns, -p.head_height);
  maker.ring(bearing, thread);
  maker.ring(back, bearing);
  maker.fan(reversed(back), {0.0, 0.0, -p.head_height});
  return maker.take();
}

Solid make_nut(const ScrewParameters& p) {
  check(p);
  MeshMaker maker("nut");
  const BasicProfile profile(p.diameter, p.pitch, 0.0);
  // Countersunk at 120 degrees to a little more than the nominal diameter.
  const double end_radius = 0.52 * p.diameter, slope = std::tan(kPi / 3.0);
  const ThreadEnds thread =
      add_thread(maker, {p.pitch, 0.0, p.nut_height, p.nut_columns, profile.rows(p.contact_edge), false},
                 [&](double along, double z) {
                   return std::max(profile.radius(along), end_radius - slope * std::min(z, p.nut_height - z));
                 });
  const Ring lower = maker.hexagon(p.across_flats, p.nut_columns, 0.0),
             upper = maker.hexagon(p.across_flats, p.nut_columns, p.nut_height);
  maker.ring(lower, upper);
  maker.ring(upper, thread.upper);
  maker.ring(thread.lower, lower);
  return maker.take();
}

Solid make_spacer(const ScrewParameters& p) {
  check(p);
  const double inner = 0.55 * p.diameter, outer = p.diameter, height = p.spacer_height;
  return make_revolved("spacer", {{inner, 0.0}, {outer, 0.0}, {outer, height}, {inner, height}}, true, 64);
}

Solid make_gear(const std::string& name, int teeth, const GearParameters& p) {
  if (teeth < 8)
    throw std::invalid_argument("a gear with " + std::to_string(teeth) + " teeth; allowed: 8 or more");
  const double pitch_radius = 0.5 * p.module * teeth, base_radius = pitch_radius * std::cos(p.pressure_angle);
  const double tip_radius = pitch_radius + p.module, root_radius = pitch_radius - 1.25 * p.module;
  if (p.bore_radius >= 0.95 * root_radius)
    throw std::invalid_argument("gear.bore_radius is " + std::to_string(p.bore_radius) +
                                " m; allowed: less than 0.95 of the root circle of " +
                                std::to_string(root_radius) + " m");
  const auto involute = [](double radius, double base) {
    const double angle = std::acos(std::min(1.0, base / radius));
    return std::tan(angle) - angle;
  };
  // Half of a tooth's angle at a radius of its involute.
  const double half_at_pitch = 0.25 * (p.module * kPi - 2.0 * p.backlash) / pitch_radius;
  const auto half_angle = [&](double radius) {
    return half_at_pitch + involute(pitch_radius, base_radius) - involute(radius, base_radius);
  };
  const double foot_radius = std::max(base_radius, root_radius);
  const auto pieces = [&](double length) {
    return std::max(1, static_cast<int>(std::ceil(length / p.contact_edge - 1e-9)));
  };
  // (radius, angle) from the middle of the gap before a tooth to that behind it.
  std::vector<std::array<double, 2>> tooth;
  const double step = 2.0 * kPi / teeth;
  const auto add = [&](double radius, double angle) { tooth.push_back({radius, angle}); };
  const double foot_half = half_angle(foot_radius);
  const int in_gap = pieces(0.5 * root_radius * (step - 2.0 * foot_half));
  const int on_flank = std::max(3, pieces(tip_radius - foot_radius));
  const int on_tip = pieces(2.0 * tip_radius * half_angle(tip_radius));
  for (int i = 0; i < in_gap; ++i) add(root_radius, -0.5 * step + (0.5 * step - foot_half) * i / in_gap);
  if (foot_radius > root_radius) add(root_radius, -foot_half);
  for (int i = 0; i < on_flank; ++i) {
    const double radius = foot_radius + (tip_radius - foot_radius) * i / on_flank;
    add(radius, -half_angle(radius));
  }
  for (int i = 0; i < on_tip; ++i) add(tip_radius, half_angle(tip_radius) * (2.0 * i / on_tip - 1.0));
  for (int i = on_flank; i >= 0; --i) {
    const double radius = foot_radius + (tip_radius - foot_radius) * i / on_flank;
    add(radius, half_angle(radius));
  }
  if (foot_radius > root_radius) add(root_radius, foot_half);
  for (int i = 1; i < in_gap; ++i) add(root_radius, foot_half + (0.5 * step - foot_half) * i / in_gap);

  MeshMaker maker(name);
  const int layers = pieces(p.width);
  // One line along the width for each point of the outline: keys are z.
  std::vector<Row> outline;
  std::vector<double> angles;
  for (int t = 0; t < teeth; ++t)
    for (const auto& [radius, angle] : tooth) {
      Row line;
      angles.push_back(angle + step * t);
      for (int k = 0; k <= layers; ++k) {
        line.key.push_back(k);
        line.vertex.push_back(maker.vertex(cylindrical(radius, angles.back(), p.width * k / layers)));
      }
      outline.push_back(line);
    }
  for (std::size_t i = 0; i < outline.size(); ++i) maker.strip(outline[i], outline[(i + 1) % outline.size()]);
  const int around = 6 * std::max(4, pieces(2.0 * kPi * p.bore_radius / 6.0));
  std::array<std::vector<std::uint32_t>, 2> bore;
  for (int i = 0; i < around; ++i)
    for (const int end : {0, 1})
      bore[static_cast<std::size_t>(end)].push_back(
          maker.vertex(cylindrical(p.bore_radius, -0.5 * step + 2.0 * kPi * i / around, p.width * end)));
  maker.ring(bore[1], bore[0]);
  // End faces: strips from the bore to the outline, keys are angles.
  for (const int end : {0, 1}) {
    Row outer, inner;
    for (std::size_t i = 0; i <= outline.size(); ++i) {
      const Row& line = outline[i % outline.size()];
      outer.vertex.push_back(end == 1 ? line.vertex.back() : line.vertex.front());
      outer.key.push_back(i < outline.size() ? angles[i] : angles[0] + 2.0 * kPi);
    }
    const auto& ring = bore[static_cast<std::size_t>(end)];
    for (std::size_t i = 0; i <= ring.size(); ++i) {
      inner.vertex.push_back(ring[i % ring.size()]);
      inner.key.push_back(-0.5 * step + 2.0 * kPi * static_cast<double>(i) / around);
    }
    if (end == 1)
      maker.strip(inner, outer);
    else
      maker.strip(outer, inner);
  }
  return maker.take();
}

Solid make_gear_pin(const GearParameters& p) {
  return make_peg("gear_pin",
                  {p.bore_radius - p.pin_clearance, 2.0 * p.width, 0.1 * p.bore_radius, 64, p.width});
}

void make_screw_meshes(const std::filesystem::path& directory, const ScrewParameters& screw,
                       const GearParameters& gear) {
  std::filesystem::create_directories(directory);
  write_solids(directory, "bolt", "Hexagon bolt with an ISO metric thread.", {make_bolt(screw)});
  write_solids(directory, "nut", "Hexagon nut with an ISO metric thread.", {make_nut(screw)});
  write_solids(directory, "spacer", "Ring between the head of the bolt and its nut.", {make_spacer(screw)});
  write_solids(directory, "pinion", "Spur gear with involute teeth.",
               {make_gear("pinion", gear.pinion_teeth, gear)});
  write_solids(directory, "wheel", "Spur gear with involute teeth.",
               {make_gear("wheel", gear.wheel_teeth, gear)});
  write_solids(directory, "gear_pin", "Pin for the bores of the gears.", {make_gear_pin(gear)});
}

}  // namespace takt::meshes
