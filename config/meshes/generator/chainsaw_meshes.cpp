#include "config/meshes/generator/chainsaw_meshes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "config/meshes/generator/cell_solid.h"
#include "config/meshes/generator/write_meshes.h"

namespace takt::meshes {
namespace {

constexpr double kMm = 1e-3;
constexpr double kGripFlat = 20 * kMm;  // half the distance of the motor's flats
constexpr double kSeatTop = 25 * kMm;   // of the housing; the motor's shoulder rests on it
constexpr double kBossLength = 12 * kMm;
constexpr double kBoxFloor = 3 * kMm, kNestTop = 14 * kMm;
constexpr double kMountX = 75 * kMm, kMountY = 60 * kMm;  // half the sides of the housing's mount

/// The stages of the motor, from below: radius, lower and upper end, chamfers of both ends.
struct Stage {
  double radius, from, to, lower_chamfer, upper_chamfer;
  bool flats;
};

std::vector<Stage> motor_stages(const ChainsawParameters& p) {
  return {{p.boss_radius, 0.0, kBossLength, p.boss_chamfer, 0.0, false},
          {24 * kMm, kBossLength, 40 * kMm, 1 * kMm, 0.0, false},
          {29 * kMm, 40 * kMm, 44 * kMm, 1 * kMm, 1 * kMm, false},
          {24 * kMm, 44 * kMm, 62 * kMm, 0.0, 1 * kMm, true},
          {14 * kMm, 62 * kMm, 70 * kMm, 0.0, 1 * kMm, false}};
}

Profile stage_profile(const Stage& s) {
  Profile profile;
  if (s.lower_chamfer > 0.0) profile.push_back({s.radius - s.lower_chamfer, s.from});
  profile.push_back({s.radius, s.from + s.lower_chamfer});
  profile.push_back({s.radius, s.to - s.upper_chamfer});
  if (s.upper_chamfer > 0.0) profile.push_back({s.radius - s.upper_chamfer, s.to});
  return profile;
}

/// Turned about z, with flats across y where rows lie in a stage that has them.
Solid turned(const std::string& name, const Profile& profile, int facets, double flats_from,
             double flats_to) {
  TubeGrid grid;
  grid.rows = static_cast<int>(profile.size() - 2);
  grid.columns = facets;
  grid.first_pole = {0.0, 0.0, profile.front()[1]};
  grid.last_pole = {0.0, 0.0, profile.back()[1]};
  const double to_corner = 1.0 / std::cos(std::numbers::pi / facets);
  return make_tube(name, grid, [&](int row, int column) {
    const ProfilePoint& at = profile[static_cast<std::size_t>(row) + 1];
    const double angle = 2.0 * std::numbers::pi * (column + 0.5) / facets;
    const double r = at[0] * to_corner;
    double y = r * std::sin(angle);
    if (at[1] > flats_from && at[1] <= flats_to) y = std::clamp(y, -kGripFlat, kGripFlat);
    return Vec3(r * std::cos(angle), y, at[1]);
  });
}

double superellipse(double half_x, double half_y, double angle) {
  const double x = std::abs(std::cos(angle)) / half_x, y = std::abs(std::sin(angle)) / half_y;
  return std::pow(std::pow(x, 8.0) + std::pow(y, 8.0), -0.125);
}

}  // namespace

double seat_z() {
  return kSeatTop - kBossLength;
}
double box_floor() {
  return kBoxFloor;
}

Solid make_motor(const ChainsawParameters& p) {
  Profile outline{{0.0, 0.0}};
  for (const Stage& stage : motor_stages(p)) {
    // Elements follow the contact areas: the boss and the faces that are gripped.
    const bool contact = stage.from == 0.0 || stage.flats;
    const Profile fine = subdivided(stage_profile(stage), contact ? 3.0 * p.contact_edge : 12 * kMm, false);
    outline.insert(outline.end(), fine.begin(), fine.end());
  }
  outline.push_back({0.0, 70 * kMm});
  return turned("motor", outline, p.motor_facets, 44 * kMm, 62 * kMm);
}

std::vector<Solid> make_motor_pieces(const ChainsawParameters& p) {
  std::vector<Solid> pieces;
  for (const Stage& stage : motor_stages(p)) {
    Profile outline = stage_profile(stage);
    outline.insert(outline.begin(), {0.0, stage.from});
    outline.push_back({0.0, stage.to});
    pieces.push_back(turned("piece_" + std::to_string(pieces.size() + 1), outline, p.motor_facets,
                            stage.flats ? stage.from - kMm : 1.0, stage.flats ? stage.to : 1.0));
  }
  return pieces;
}

Solid make_housing(const ChainsawParameters& p) {
  const double bore = p.boss_radius - p.interference;
  const double cavity = 29 * kMm + p.cavity_clearance;
  // Radius: bore, its chamfered rim, the shoulder's face, wall, outside, mount.
  const double rim = 15 * kMm;
  enum : int { kOutside = 1, kMount = 2 };
  const std::vector<double> r = grid_lines(
      0.0, {{bore, 6}, {rim, 2}, {24 * kMm, 8}, {cavity, 4}, {cavity + 6 * kMm, 6}, {0.055, 8}, {0.075, 6}});
  const int at_bore = line_at(r, bore), at_cavity = line_at(r, cavity),
            at_wall = line_at(r, cavity + 6 * kMm), at_outside = line_at(r, 0.055),
            at_mount = line_at(r, 0.075);
  const double bore_floor = kSeatTop - p.seat_depth;
  const auto bore_rows =
      std::max(4, static_cast<int>(std::lround((p.seat_depth - p.seat_chamfer) / p.contact_edge)));
  const std::vector<double> z = grid_lines(0.0, {{5 * kMm, 2},
                                                 {bore_floor, 2},
                                                 {kSeatTop - p.seat_chamfer, bore_rows},
                                                 {kSeatTop, 2},
                                                 {31 * kMm, 4},
                                                 {49 * kMm, 14},
                                                 {55 * kMm, 5}});
  const int at_mount_top = line_at(z, 5 * kMm), at_bore_floor = line_at(z, bore_floor),
            at_chamfer = line_at(z, kSeatTop - p.seat_chamfer), at_seat = line_at(z, kSeatTop),
            window_from = line_at(z, 31 * kMm), window_to = line_at(z, 49 * kMm);
  const int n = p.housing_facets;
  const auto filled = [&](int i, int j, int k) {
    if (i >= at_outside) return k < at_mount_top;  // the mount's plate
    if (i >= at_wall && i < at_outside) {          // ribs around the motor's chamber
      const bool rib = (j / 5) % 4 == 0;
      return k < at_seat || rib;
    }
    if (k < at_bore_floor) return true;
    if (k < at_seat) return i >= at_bore;
    if (i < at_cavity) return false;
    // Slots for cooling, between the ribs.
    const bool slot = (j / 5) % 4 == 2 && k >= window_from && k < window_to;
    return !slot;
  };
  const auto point = [&](int i, int j, int k) {
    // Flats around: as the boss, one faces +x; the radius is that over the flats.
    const double angle = 2.0 * std::numbers::pi * (j + 0.5) / n;
    double radius = r[static_cast<std::size_t>(i)];
    if (i == at_bore && k > at_chamfer && k <= at_seat)
      radius += p.seat_chamfer * (z[static_cast<std::size_t>(k)] - z[static_cast<std::size_t>(at_chamfer)]) /
                (kSeatTop - z[static_cast<std::size_t>(at_chamfer)]);
    if (i <= at_wall) radius /= std::cos(std::numbers::pi / n);
    if (i > at_wall) {
      const double round = superellipse(0.055, 0.045, angle), plate = superellipse(kMountX, kMountY, angle);
      const double wall = r[static_cast<std::size_t>(at_wall)];
      if (i <= at_outside) {
        const double u = (radius - wall) / (r[static_cast<std::size_t>(at_outside)] - wall);
        radius = wall + u * (round - wall);
      } else {
        const double begin = r[static_cast<std::size_t>(at_outside)];
        const double u = (radius - begin) / (r[static_cast<std::size_t>(at_mount)] - begin);
        radius = round + u * (plate - round);
      }
    }
    return Vec3(radius * std::cos(angle), radius * std::sin(angle), z[static_cast<std::size_t>(k)]);
  };
  return make_cell_solid("housing",
                         {static_cast<int>(r.size()) - 1, n, static_cast<int>(z.size()) - 1, true, true},
                         filled, point);
}

Solid make_open_box(const ChainsawParameters& p) {
  const double nest = p.boss_radius + p.nest_clearance;
  const double inner = 40 * kMm, wall = 3 * kMm;
  const std::vector<double> half =
      grid_lines(0.0, {{nest, 4}, {nest + 4 * kMm, 2}, {inner, 7}, {inner + wall, 2}});
  std::vector<double> lines;
  for (auto x = half.rbegin(); x != half.rend(); ++x) lines.push_back(-*x);
  lines.insert(lines.end(), half.begin() + 1, half.end());
  const std::vector<double> z =
      grid_lines(0.0, {{kBoxFloor, 1}, {kNestTop, 6}, {59 * kMm, 15}, {60 * kMm, 1}});
  const int floor = line_at(z, kBoxFloor), nest_top = line_at(z, kNestTop), rim = line_at(z, 59 * kMm);
  const auto middle = [&](int cell) {
    return std::abs(0.5 *
                    (lines[static_cast<std::size_t>(cell)] + lines[static_cast<std::size_t>(cell) + 1]));
  };
  const auto filled = [&](int i, int j, int k) {
    const double reach = std::max(middle(i), middle(j));
    return k < floor || reach > inner || (k < nest_top && reach > nest && reach < nest + 4 * kMm);
  };
  const auto point = [&](int i, int j, int k) {
    Vec3 v(lines[static_cast<std::size_t>(i)], lines[static_cast<std::size_t>(j)],
           z[static_cast<std::size_t>(k)]);
    // The rim is chamfered inwards, where jaws and motor come by.
    const double widening =
        k > rim ? 1 * kMm * (z[static_cast<std::size_t>(k)] - z[static_cast<std::size_t>(rim)]) /
                      (z.back() - z[static_cast<std::size_t>(rim)])
                : 0.0;
    for (const int axis : {0, 1})
      if (std::abs(std::abs(v[axis]) - inner) < 1e-9) v[axis] += std::copysign(widening, v[axis]);
    return v;
  };
  const int n = static_cast<int>(lines.size()) - 1;
  return make_cell_solid("box", {n, n, static_cast<int>(z.size()) - 1}, filled, point);
}

std::vector<Solid> make_fixture(const ChainsawParameters& p) {
  // Beside the middles of the mount's sides, where they are straight.
  const double x = kMountX - p.fixture_preload, y = kMountY - p.fixture_preload, deep = 15 * kMm,
               half = 15 * kMm, top = 4 * kMm;
  const auto block = [&](const std::string& name, const Vec3& lower, const Vec3& upper) {
    return make_cell_solid(
        name, {1, 1, 1}, [](int, int, int) { return true; },
        [&](int i, int j, int k) {
          return Vec3((i == 0 ? lower : upper).x(), (j == 0 ? lower : upper).y(),
                      (k == 0 ? lower : upper).z());
        });
  };
  return {block("right", {x, -half, 0.0}, {x + deep, half, top}),
          block("left", {-x - deep, -half, 0.0}, {-x, half, top}),
          block("back", {-half, y, 0.0}, {half, y + deep, top}),
          block("front", {-half, -y - deep, 0.0}, {half, -y, top})};
}

Solid make_chainsaw_jaw() {
  // 18 x 12 x 3 cells: 1224 triangles.
  const std::vector<double> x = grid_lines(-15 * kMm, {{-13 * kMm, 1}, {13 * kMm, 10}, {15 * kMm, 1}});
  const std::vector<double> y = grid_lines(0.0, {{1 * kMm, 1}, {15 * kMm, 2}});
  const std::vector<double> z = grid_lines(0.08, {{0.198, 17}, {0.2, 1}});
  const auto point = [&](int i, int j, int k) {
    Vec3 v(x[static_cast<std::size_t>(i)], y[static_cast<std::size_t>(j)], z[static_cast<std::size_t>(k)]);
    // Edges of the grip face are chamfered by 1 mm.
    if (j > 0) return v;
    if (i == 0 || i + 1 == static_cast<int>(x.size())) v.x() -= std::copysign(1 * kMm, v.x());
    if (k + 1 == static_cast<int>(z.size())) v.z() -= 1 * kMm;
    return v;
  };
  return make_cell_solid(
      "jaw", {static_cast<int>(x.size()) - 1, static_cast<int>(y.size()) - 1, static_cast<int>(z.size()) - 1},
      [](int, int, int) { return true; }, point);
}

void make_chainsaw_meshes(const std::filesystem::path& directory, const ChainsawParameters& p) {
  const std::string origin = " Origin: centre of the lower face.";
  write_solids(directory, "motor",
               "Boss of radius 12 mm to be pressed in, body, flange, flats 40 mm across y to grip." + origin,
               {make_motor(p)});
  write_solids(directory, "motor_convex", "The motor in five convex shapes." + origin, make_motor_pieces(p));
  write_solids(
      directory, "housing",
      "Chamber with ribs and cooling slots on a mount; seat for the boss at 25 mm, 10 um too narrow." +
          origin,
      {make_housing(p)});
  write_solids(directory, "fixture", "Four stops around the housing's mount. Origin: that of the housing.",
               make_fixture(p));
  write_solids(directory, "box", "Open box, 80 x 80 x 57 mm inside, with a nest for the boss." + origin,
               {make_open_box(p)});
  write_solids(directory, "jaw", "Pad 30 x 15 x 120 mm; grip face y = 0, chamfered by 1 mm.",
               {make_chainsaw_jaw()});
}

}  // namespace takt::meshes
