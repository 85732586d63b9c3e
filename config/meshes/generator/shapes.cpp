#include "config/meshes/generator/shapes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>

namespace takt::meshes {
namespace {

constexpr double kPi = std::numbers::pi;

double thread_radius(const Thread& thread, double z, double angle) {
  return thread.radius + thread.amplitude * std::sin(2.0 * kPi * z / thread.pitch - angle);
}

Vec3 on_circle(double radius, double angle, double z) {
  return {radius * std::cos(angle), radius * std::sin(angle), z};
}

}  // namespace

Solid make_icosphere(const std::string& name, double radius, int levels) {
  const double g = 0.5 * (1.0 + std::sqrt(5.0));
  Solid solid{name,
              {{-1, g, 0},
               {1, g, 0},
               {-1, -g, 0},
               {1, -g, 0},
               {0, -1, g},
               {0, 1, g},
               {0, -1, -g},
               {0, 1, -g},
               {g, 0, -1},
               {g, 0, 1},
               {-g, 0, -1},
               {-g, 0, 1}},
              {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
               {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
               {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  for (Vec3& v : solid.vertices) v = radius * v.normalized();
  for (int level = 0; level < levels; ++level) {
    std::map<std::array<std::uint32_t, 2>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, is_new] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                       static_cast<std::uint32_t>(solid.vertices.size()));
      if (is_new) solid.vertices.push_back(radius * (solid.vertices[a] + solid.vertices[b]).normalized());
      return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& t : solid.triangles) {
      const std::uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], ab, ca}, {t[1], bc, ab}, {t[2], ca, bc}, {ab, bc, ca}});
    }
    solid.triangles = std::move(finer);
  }
  return solid;
}

Solid make_peg(const std::string& name, const Peg& peg) {
  const Profile outline{{0.0, 0.0},
                        {peg.radius - peg.chamfer, 0.0},
                        {peg.radius, peg.chamfer},
                        {peg.radius, peg.length - peg.chamfer},
                        {peg.radius - peg.chamfer, peg.length},
                        {0.0, peg.length}};
  return make_revolved(name, subdivided(outline, peg.edge, false), false, peg.facets);
}

Solid make_bush(const std::string& name, const Bush& bush) {
  const double hole = bush.hole_radius, outer = bush.outer_radius, top = bush.depth, c = bush.chamfer;
  if (bush.floor > 0.0) {
    const Profile outline{{0.0, -bush.floor}, {outer, -bush.floor}, {outer, top}, {hole + c, top},
                          {hole, top - c},    {hole, 0.0},          {0.0, 0.0}};
    return make_revolved(name, subdivided(outline, bush.edge, false), false, bush.facets);
  }
  const Profile outline{{hole, c},    {hole + c, 0.0}, {outer, 0.0},
                        {outer, top}, {hole + c, top}, {hole, top - c}};
  return make_revolved(name, subdivided(outline, bush.edge, true), true, bush.facets);
}

Solid make_ring(const std::string& name, double ring_radius, double tube_radius, int around, int across) {
  Profile circle;
  for (int i = 0; i < across; ++i) {
    const double angle = 2.0 * kPi * i / across;
    circle.push_back({ring_radius + tube_radius * std::cos(angle), tube_radius * std::sin(angle)});
  }
  return make_revolved(name, circle, true, around);
}

Solid make_hook(const std::string& name, const Hook& hook) {
  // Centre line from the shank's top: its points, and the direction of the radius in the plane, towards the
  // inside of the arc.
  std::vector<Vec3> centres, inwards;
  const int shank_pieces = std::max(1, static_cast<int>(std::lround(hook.shank / hook.edge)));
  for (int i = 0; i <= shank_pieces; ++i) {
    centres.emplace_back(0.0, 0.0, hook.shank * (shank_pieces - i) / shank_pieces);
    inwards.emplace_back(1.0, 0.0, 0.0);
  }
  const int arc_pieces =
      std::max(4, static_cast<int>(std::lround(hook.arc_radius * hook.arc_angle / hook.edge)));
  for (int i = 1; i <= arc_pieces; ++i) {
    const double angle = hook.arc_angle * i / arc_pieces;
    const Vec3 inward(std::cos(angle), 0.0, std::sin(angle));
    centres.push_back(Vec3(hook.arc_radius, 0.0, 0.0) - hook.arc_radius * inward);
    inwards.push_back(inward);
  }
  TubeGrid grid;
  grid.rows = static_cast<int>(centres.size());
  grid.columns = hook.across;
  grid.first_pole = centres.front();
  grid.last_pole = centres.back();
  return make_tube(name, grid, [&](int row, int column) {
    const auto i = static_cast<std::size_t>(row);
    const double angle = 2.0 * kPi * column / hook.across;
    // Rows run downwards, so columns run the other way round.
    return Vec3(centres[i] +
                hook.tube_radius * (std::cos(angle) * inwards[i] - std::sin(angle) * Vec3::UnitY()));
  });
}

Solid make_bolt(const std::string& name, const Thread& thread, double head_radius, double head_height) {
  const int thread_rows = thread.turns * thread.per_turn + 1;
  const double length = thread.turns * thread.pitch;
  // One ring half-way in on the lower face, and five for the head: three up its side, two on top.
  TubeGrid grid;
  grid.rows = thread_rows + 6;
  grid.columns = thread.around;
  grid.last_pole = {0.0, 0.0, length + head_height};
  return make_tube(name, grid, [&](int row, int column) {
    const double angle = 2.0 * kPi * column / thread.around;
    const int k = row - 1;
    if (k < 0) return on_circle(0.5 * thread.radius, angle, 0.0);
    if (k < thread_rows) {
      const double z = thread.pitch * k / thread.per_turn;
      const double cone = thread.radius - thread.amplitude - thread.chamfer + z;
      return on_circle(std::min(cone, thread_radius(thread, z, angle)), angle, z);
    }
    const int head = k - thread_rows;
    return on_circle(head_radius * (head < 3 ? 1.0 : (5.0 - head) / 3.0), angle,
                     length + 0.5 * head_height * std::min(head, 2));
  });
}

Solid make_socket(const std::string& name, const Thread& thread, double outer_radius, double edge) {
  const int thread_rows = thread.turns * thread.per_turn + 1;
  const double length = thread.turns * thread.pitch;
  const int outer_pieces = std::max(1, static_cast<int>(std::lround(length / edge)));
  TubeGrid grid;
  grid.rows = thread_rows + outer_pieces + 1;
  grid.columns = thread.around;
  grid.closed = true;
  return make_tube(name, grid, [&](int row, int column) {
    const double angle = 2.0 * kPi * column / thread.around;
    if (row <= outer_pieces) return on_circle(outer_radius, angle, length * row / outer_pieces);
    // Down again inside.
    const double z = thread.pitch * (thread_rows - 1 - (row - outer_pieces - 1)) / thread.per_turn;
    const double cone = thread.radius + thread.amplitude + thread.chamfer - std::min(z, length - z);
    return on_circle(std::max(cone, thread_radius(thread, z, angle)), angle, z);
  });
}

Solid make_wedge(const std::string& name, double angle, double run, double width, double foot) {
  const double fall = run * std::tan(angle);
  Solid solid{name, {}, {}};
  for (const double y : {-0.5 * width, 0.5 * width})
    for (const auto& [x, z] : {std::pair{0.0, 0.0}, {run, -fall}, {run, -fall - foot}, {0.0, -fall - foot}})
      solid.vertices.emplace_back(x, y, z);
  solid.triangles = {{0, 3, 2}, {0, 2, 1}, {4, 5, 6}, {4, 6, 7}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t k = (i + 1) % 4;
    solid.triangles.push_back({i, k, k + 4});
    solid.triangles.push_back({i, k + 4, i + 4});
  }
  return solid;
}

}  // namespace takt::meshes
