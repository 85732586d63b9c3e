#include "config/meshes/generator/rotor_meshes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "config/meshes/generator/cell_solid.h"
#include "config/meshes/generator/write_meshes.h"

namespace takt::meshes {
namespace {

constexpr double kMm = 1e-3;
constexpr double kPi = std::numbers::pi;
constexpr int kSideColumns = 3;  // between a slot and the middle between two slots
constexpr double kStand = 0.350;
constexpr double kShank = 3 * kMm, kShankClearance = 1 * kMm;  // of the screws, and of their bores
constexpr double kScrewCircle = 52 * kMm;                      // radius on which the screws stand

Vec3 on_circle(double radius, double angle) {
  return {radius * std::cos(angle), radius * std::sin(angle), 0.0};
}

int pieces(double length, double edge) {
  return std::max(1, static_cast<int>(std::lround(length / edge)));
}

Solid make_plain_box(const std::string& name, const Vec3& lower, const Vec3& upper) {
  return make_cell_solid(
      name, {1, 1, 1}, [](int, int, int) { return true; },
      [&](int i, int j, int k) {
        return Vec3(i == 0 ? lower.x() : upper.x(), j == 0 ? lower.y() : upper.y(),
                    k == 0 ? lower.z() : upper.z());
      });
}

/// One sector of the core: columns across a slot and beside it.
class Sector {
 public:
  Sector(const RotorParameters& p)
      : half_(0.5 * p.magnet_width + p.clearance),
        edge_angle_(kPi / p.slots),
        middle_(p.slot_radius + 0.5 * p.magnet_thickness),
        across_(pieces(p.magnet_width, p.contact_edge)) {}

  int columns() const { return across_ + 2 * kSideColumns; }
  bool in_slot(int column) const { return column >= kSideColumns && column < kSideColumns + across_; }
  /// Tangential coordinate of a column's line on a straight face at this distance.
  double across(int line, double distance) const {
    const double edge = distance * std::tan(edge_angle_);
    const int right = kSideColumns + across_;
    if (line < kSideColumns) return -edge + (edge - half_) * line / kSideColumns;
    if (line > right) return half_ + (edge - half_) * (line - right) / kSideColumns;
    return -half_ + 2.0 * half_ * (line - kSideColumns) / across_;
  }
  double angle(int line) const { return std::atan2(across(line, middle_), middle_); }

 private:
  double half_, edge_angle_, middle_;
  int across_;
};

}  // namespace

Solid make_rotor_core(const RotorParameters& p) {
  const Sector sector(p);
  const double inner = p.slot_radius - p.clearance, outer = p.slot_radius + p.magnet_thickness + p.clearance;
  const std::vector<double> r = grid_lines(
      p.shaft_radius, {{inner, 4}, {outer, pieces(p.magnet_thickness, p.contact_edge)}, {p.radius, 3}});
  const double fine = p.magnet_length + 0.020;
  const std::vector<double> z = grid_lines(
      0.0, {{fine, pieces(fine, 2.0 * p.contact_edge)}, {p.height, pieces(p.height - fine, 0.01)}});
  const int slot_from = line_at(r, inner), slot_to = line_at(r, outer), n = sector.columns();
  const auto filled = [&](int i, int j, int) {
    return !(i >= slot_from && i < slot_to && sector.in_slot(j % n));
  };
  // Straight at the slot's faces, round at shaft and outside, interpolated in between.
  const auto point = [&](int i, int j, int k) {
    const int line = j % n;
    const auto straight = [&](double distance) { return Vec3(distance, sector.across(line, distance), 0.0); };
    const double radius = r[static_cast<std::size_t>(i)];
    Vec3 local;
    if (i < slot_from) {
      const double u = (radius - p.shaft_radius) / (inner - p.shaft_radius);
      local = (1.0 - u) * on_circle(p.shaft_radius, sector.angle(line)) + u * straight(inner);
    } else if (i <= slot_to) {
      local = straight(radius);
    } else {
      const double u = (radius - outer) / (p.radius - outer);
      local = (1.0 - u) * straight(outer) + u * on_circle(p.radius, sector.angle(line));
    }
    const double turn = 2.0 * kPi * (j / n) / p.slots;
    const double c = std::cos(turn), s = std::sin(turn);
    return Vec3(c * local.x() - s * local.y(), s * local.x() + c * local.y(), z[static_cast<std::size_t>(k)]);
  };
  return make_cell_solid(
      "rotor_core",
      {static_cast<int>(r.size()) - 1, n * p.slots, static_cast<int>(z.size()) - 1, true, false}, filled,
      point);
}

Solid make_magnet(const RotorParameters& p) {
  const double x = 0.5 * p.magnet_thickness, y = 0.5 * p.magnet_width, c = p.magnet_chamfer;
  const std::vector<double> lx = grid_lines(-x, {{x, pieces(2.0 * x, p.contact_edge)}});
  const std::vector<double> ly = grid_lines(-y, {{y, pieces(2.0 * y, p.contact_edge)}});
  const std::vector<double> lz = grid_lines(
      0.0,
      {{c, 1}, {p.magnet_length - c, pieces(p.magnet_length, 2.0 * p.contact_edge)}, {p.magnet_length, 1}});
  const auto point = [&](int i, int j, int k) {
    Vec3 v(lx[static_cast<std::size_t>(i)], ly[static_cast<std::size_t>(j)], lz[static_cast<std::size_t>(k)]);
    if (k > 0 && k + 1 < static_cast<int>(lz.size())) return v;
    if (std::abs(std::abs(v.x()) - x) < 1e-12) v.x() -= std::copysign(c, v.x());
    if (std::abs(std::abs(v.y()) - y) < 1e-12) v.y() -= std::copysign(c, v.y());
    return v;
  };
  return make_cell_solid(
      "magnet",
      {static_cast<int>(lx.size()) - 1, static_cast<int>(ly.size()) - 1, static_cast<int>(lz.size()) - 1},
      [](int, int, int) { return true; }, point);
}

Solid make_rotor_cover(const RotorParameters& p) {
  const double from = p.shaft_radius, to = 0.075, c = 0.5 * kMm, height = 8 * kMm;
  // The holes for the screws' shanks are square: cells left out, wide enough for a shank and its clearance.
  const double hole = kShank + kShankClearance, reach = std::asin(hole / kScrewCircle);
  const std::vector<double> r =
      grid_lines(from, {{kScrewCircle - hole, 2}, {kScrewCircle + hole, 1}, {to - 2.0 * c, 3}, {to, 1}});
  const std::vector<double> z = grid_lines(0.0, {{c, 1}, {height - c, 2}, {height, 1}});
  const std::vector<double> angles = grid_lines(-reach, {{reach, 2}, {kPi - reach, 22}});
  const int n = 2 * (static_cast<int>(angles.size()) - 1), half = n / 2;
  const int hole_row = line_at(r, kScrewCircle - hole), rim = static_cast<int>(r.size()) - 1,
            top = static_cast<int>(z.size()) - 1;
  return make_cell_solid(
      "cover", {rim, n, top, true, false}, [&](int i, int j, int) { return i != hole_row || j % half >= 2; },
      [&](int i, int j, int k) {
        const double angle = angles[static_cast<std::size_t>(j % half)] + (j % n < half ? 0.0 : kPi);
        // Edges of the rim are chamfered.
        const double radius = i == rim && (k == 0 || k == top) ? to - c : r[static_cast<std::size_t>(i)];
        return Vec3(radius * std::cos(angle), radius * std::sin(angle), z[static_cast<std::size_t>(k)]);
      });
}

std::vector<Solid> make_screw() {
  const Profile shank{
      {0.0, -20 * kMm}, {kShank - kMm, -20 * kMm}, {kShank, -19 * kMm}, {kShank, 0.0}, {0.0, 0.0}};
  const Profile head{{0.0, 0.0}, {6 * kMm, 0.0}, {6 * kMm, 11 * kMm}, {5 * kMm, 12 * kMm}, {0.0, 12 * kMm}};
  return {make_revolved("shank", shank, false, 16), make_revolved("head", head, false, 16)};
}

Solid make_screw_rack() {
  const double hole = kShank + kShankClearance, from = 25 * kMm, end = 45 * kMm, side = 20 * kMm;
  const std::vector<double> x =
      grid_lines(-end, {{-from - hole, 4}, {-from + hole, 1}, {from - hole, 8}, {from + hole, 1}, {end, 4}});
  const std::vector<double> y = grid_lines(-side, {{-hole, 4}, {hole, 1}, {side, 4}});
  const std::vector<double> z = grid_lines(0.0, {{24 * kMm, 2}});
  const int left = line_at(x, -from - hole), right = line_at(x, from - hole), row = line_at(y, -hole);
  return make_cell_solid(
      "screw_rack",
      {static_cast<int>(x.size()) - 1, static_cast<int>(y.size()) - 1, static_cast<int>(z.size()) - 1},
      [&](int i, int j, int) { return j != row || (i != left && i != right); },
      [&](int i, int j, int k) {
        return Vec3(x[static_cast<std::size_t>(i)], y[static_cast<std::size_t>(j)],
                    z[static_cast<std::size_t>(k)]);
      });
}

Solid make_punch_half(const RotorParameters& p) {
  // 1 mm narrower than the slot on each side; the tip is chamfered by 1 mm, but not where the halves meet.
  const double x = 0.5 * p.magnet_thickness - kMm, y = 0.5 * p.magnet_width - kMm, c = kMm;
  const std::vector<double> lx = grid_lines(-x, {{-x + c, 1}, {x - c, 2}, {x, 1}});
  const std::vector<double> ly = grid_lines(0.0, {{y - c, 4}, {y, 1}});
  const std::vector<double> lz = grid_lines(0.02, {{0.279, 13}, {0.28, 1}});
  const auto point = [&](int i, int j, int k) {
    Vec3 v(lx[static_cast<std::size_t>(i)], ly[static_cast<std::size_t>(j)], lz[static_cast<std::size_t>(k)]);
    if (k + 1 < static_cast<int>(lz.size())) return v;
    if (i == 0 || i + 1 == static_cast<int>(lx.size())) v.x() -= std::copysign(0.9 * c, v.x());
    if (j + 1 == static_cast<int>(ly.size())) v.y() -= 0.9 * c;
    return v;
  };
  return make_cell_solid(
      "punch_half",
      {static_cast<int>(lx.size()) - 1, static_cast<int>(ly.size()) - 1, static_cast<int>(lz.size()) - 1},
      [](int, int, int) { return true; }, point);
}

Solid make_press_mount(const RotorParameters& p) {
  const double outer = p.slot_radius - 18 * kMm, c = 1 * kMm, height = 0.6;
  const Profile outline{{0.0, -height}, {outer, -height}, {outer, -c}, {outer - c, 0.0}, {0.0, 0.0}};
  return make_revolved("press_mount", outline, false, 64);
}

double furnace_stand_z() {
  return 0.050 + kStand;
}

std::vector<Solid> make_furnace() {
  // 0.70 m inside, walls and floor 50 mm.
  const double in = 0.35, out = 0.40, floor = 0.05, top = 0.75;
  return {make_plain_box("floor", {-out, -out, 0.0}, {out, out, floor}),
          make_plain_box("wall_1", {-out, -out, floor}, {-in, out, top}),
          make_plain_box("wall_2", {in, -out, floor}, {out, out, top}),
          make_plain_box("wall_3", {-in, -out, floor}, {in, -in, top}),
          make_plain_box("wall_4", {-in, in, floor}, {in, out, top}),
          make_plain_box("stand", {-0.08, -0.08, floor}, {0.08, 0.08, furnace_stand_z()})};
}

void make_rotor_meshes(const std::filesystem::path& directory, const RotorParameters& p) {
  const std::string origin = " Origin: centre of the lower face.";
  write_solids(
      directory, "rotor_core",
      "Radius 100 mm, height 200 mm, bore of 30 mm, 8 slots of 20 x 8 mm for magnets; the first on +x." +
          origin,
      {make_rotor_core(p)});
  write_solids(directory, "magnet",
               "20 (tangential, y) x 8 (radial, x) x 80 mm, ends chamfered by 0.5 mm." + origin,
               {make_magnet(p)});
  write_solids(directory, "cover", "Ring, radii 30 and 75 mm, 8 mm high, holes for two screws." + origin,
               {make_rotor_cover(p)});
  write_solids(directory, "screw_rack", "90 x 40 x 24 mm with holes for two screws." + origin,
               {make_screw_rack()});
  write_solids(directory, "screw", "Shank of radius 3 mm, 20 mm down from the origin; head above.",
               make_screw());
  write_solids(directory, "punch_half",
               "Half of a punch of 18 x 6 mm, z 20 to 280 mm down from the tool's frame.",
               {make_punch_half(p)});
  write_solids(directory, "press_head", "60 x 60 x 18 mm. Origin: centre of the face at the ram.",
               {make_plain_box("press_head", {-0.03, -0.03, 0.0}, {0.03, 0.03, 0.018})});
  write_solids(directory, "tray", "120 x 120 x 20 mm. Origin: centre of the upper face.",
               {make_plain_box("tray", {-0.06, -0.06, -0.02}, {0.06, 0.06, 0.0})});
  write_solids(directory, "press_mount", "Radius 60 mm, 600 mm high. Origin: centre of the upper face.",
               {make_press_mount(p)});
  write_solids(directory, "furnace", "0.70 m inside, open at the top, a stand up to z = 0.40 m." + origin,
               make_furnace());
}

}  // namespace takt::meshes
