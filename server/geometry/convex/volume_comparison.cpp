#include "server/geometry/convex/volume_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

#include "server/geometry/mesh/shells.h"

namespace takt {
namespace {

constexpr int kCellsPerSide = 96;  // 3 x 96 x 96 rays
constexpr std::uint64_t kSeed = 0x243F6A8885A308D3ULL;

/// splitmix64 (Steele, Lea, Flood 2014). The standard library's distributions differ between libraries.
double uniform(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
}

/// Intersection of a ray with a surface: the counts of enclosing solids and parts change by the given
/// numbers.
struct Crossing {
  double height;
  std::int8_t solid;
  std::int8_t part;
};

/// The rays along one axis, over a rectangle of the other two, and their crossings.
class RayBundle {
 public:
  RayBundle(int axis, const Vec3& lower, const Vec3& upper, std::uint64_t& random)
      : axis_(axis), u_((axis + 1) % 3), v_((axis + 2) % 3) {
    lower_ = {lower[u_], lower[v_]};
    cell_ = {(upper[u_] - lower[u_]) / kCellsPerSide, (upper[v_] - lower[v_]) / kCellsPerSide};
    rays_.resize(std::size_t{kCellsPerSide} * kCellsPerSide);
    for (int j = 0; j < kCellsPerSide; ++j) {
      for (int i = 0; i < kCellsPerSide; ++i) {
        Ray& ray = rays_[number(i, j)];
        ray.u = lower_[0] + (i + uniform(random)) * cell_[0];
        ray.v = lower_[1] + (j + uniform(random)) * cell_[1];
      }
    }
  }

  void add(const TriangleMesh& mesh, bool is_solid) {
    for (const auto& t : mesh.triangles)
      add(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]], is_solid);
  }

  /// Adds the volumes (lengths times the area of a cell) of solid, parts, only solid and only parts.
  void measure(std::array<double, 4>& volumes) {
    std::array<double, 4> lengths{};
    for (const std::span<Crossing> crossings : by_ray()) {
      std::sort(crossings.begin(), crossings.end(),
                [](const Crossing& a, const Crossing& b) { return a.height < b.height; });
      int in_solid = 0;
      int in_part = 0;
      for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
        in_solid += crossings[i].solid;
        in_part += crossings[i].part;
        const double length = crossings[i + 1].height - crossings[i].height;
        if (in_solid > 0) lengths[0] += length;
        if (in_part > 0) lengths[1] += length;
        if (in_solid > 0 && in_part <= 0) lengths[2] += length;
        if (in_solid <= 0 && in_part > 0) lengths[3] += length;
      }
    }
    for (std::size_t i = 0; i < lengths.size(); ++i) volumes[i] += lengths[i] * cell_[0] * cell_[1];
  }

 private:
  struct Ray {
    double u = 0.0, v = 0.0;
  };

  static std::size_t number(int i, int j) {
    return static_cast<std::size_t>(j) * kCellsPerSide + static_cast<std::size_t>(i);
  }

  /// The crossings of each ray, in the order in which they were found.
  std::vector<std::span<Crossing>> by_ray() {
    std::vector<std::size_t> end(rays_.size(), 0);
    for (const std::uint32_t ray : ray_of_) ++end[ray];
    std::partial_sum(end.begin(), end.end(), end.begin());
    std::vector<std::span<Crossing>> result;
    sorted_.resize(found_.size());
    for (std::size_t ray = 0; ray < end.size(); ++ray) {
      const std::size_t begin = ray == 0 ? 0 : end[ray - 1];
      result.push_back(std::span(sorted_).subspan(begin, end[ray] - begin));
    }
    for (std::size_t i = found_.size(); i-- > 0;) sorted_[--end[ray_of_[i]]] = found_[i];
    return result;
  }

  int cell_of(double x, int side) const {
    const auto s = static_cast<std::size_t>(side);
    const double number = cell_[s] > 0.0 ? std::floor((x - lower_[s]) / cell_[s]) : 0.0;
    return static_cast<int>(std::clamp(number, 0.0, kCellsPerSide - 1.0));
  }

  // Twice the signed area of (a, b, ray). The same two end points give the same number up to its sign in both
  // triangles of the edge: no ray passes between two triangles or counts for both.
  double side_of(const Vec3& a, const Vec3& b, const Ray& ray) const {
    const bool swapped = a[u_] > b[u_] || (a[u_] == b[u_] && a[v_] > b[v_]);
    const Vec3& p = swapped ? b : a;
    const Vec3& q = swapped ? a : b;
    const double area = (q[u_] - p[u_]) * (ray.v - p[v_]) - (q[v_] - p[v_]) * (ray.u - p[u_]);
    return swapped ? -area : area;
  }

  void add(const Vec3& a, const Vec3& b, const Vec3& c, bool is_solid) {
    const double area = (b[u_] - a[u_]) * (c[v_] - a[v_]) - (b[v_] - a[v_]) * (c[u_] - a[u_]);
    if (area == 0.0) return;  // seen from the edge
    const int first_i = cell_of(std::min({a[u_], b[u_], c[u_]}), 0);
    const int last_i = cell_of(std::max({a[u_], b[u_], c[u_]}), 0);
    const int first_j = cell_of(std::min({a[v_], b[v_], c[v_]}), 1);
    const int last_j = cell_of(std::max({a[v_], b[v_], c[v_]}), 1);
    // A surface seen from outside (normal towards the eye) ends the ray's way through the body.
    const auto change = static_cast<std::int8_t>(area > 0.0 ? -1 : 1);
    const double sign = area > 0.0 ? 1.0 : -1.0;
    for (int j = first_j; j <= last_j; ++j) {
      for (int i = first_i; i <= last_i; ++i) {
        const Ray& ray = rays_[number(i, j)];
        const double wa = sign * side_of(b, c, ray);
        const double wb = sign * side_of(c, a, ray);
        const double wc = sign * side_of(a, b, ray);
        if (!(wa > 0.0 && wb > 0.0 && wc > 0.0)) continue;
        const double height = (wa * a[axis_] + wb * b[axis_] + wc * c[axis_]) / (wa + wb + wc);
        ray_of_.push_back(static_cast<std::uint32_t>(number(i, j)));
        found_.push_back({height, is_solid ? change : std::int8_t{0}, is_solid ? std::int8_t{0} : change});
      }
    }
  }

  int axis_, u_, v_;
  std::array<double, 2> lower_{}, cell_{};
  std::vector<Ray> rays_;
  std::vector<Crossing> found_, sorted_;
  std::vector<std::uint32_t> ray_of_;  ///< by crossing found
};

bool shells_may_overlap(const TriangleMesh& mesh) {
  const std::vector<Shell> shells = find_shells(mesh);
  for (std::size_t i = 0; i < shells.size(); ++i)
    for (std::size_t k = i + 1; k < shells.size(); ++k)
      if ((shells[i].box.upper.cwiseMin(shells[k].box.upper) -
           shells[i].box.lower.cwiseMax(shells[k].box.lower))
              .minCoeff() > 0.0)
        return true;
  return false;
}

}  // namespace

VolumeComparison compare_volumes(const TriangleMesh& solid, std::span<const ConvexShape> parts) {
  VolumeComparison result;
  if (solid.vertices.empty()) return result;
  Vec3 lower = solid.vertices.front();
  Vec3 upper = lower;
  const auto include = [&](const Vec3& p) {
    lower = lower.cwiseMin(p);
    upper = upper.cwiseMax(p);
  };
  for (const Vec3& p : solid.vertices) include(p);
  std::vector<TriangleMesh> hulls;
  for (const ConvexShape& part : parts) {
    hulls.push_back(convex_hull_mesh(part.vertices));
    for (const Vec3& p : part.vertices) include(p);
  }
  std::array<double, 4> volumes{};
  std::uint64_t random = kSeed;
  for (int axis = 0; axis < 3; ++axis) {
    RayBundle rays(axis, lower, upper, random);
    rays.add(solid, true);
    for (const TriangleMesh& hull : hulls) rays.add(hull, false);
    rays.measure(volumes);
  }
  result.solid_volume = volumes[0] / 3.0;
  result.union_volume = volumes[1] / 3.0;
  if (volumes[0] > 0.0) {
    result.lost = volumes[2] / volumes[0];
    result.gained = volumes[3] / volumes[0];
  }
  return result;
}

VolumeComparison compare_with_hull(const TriangleMesh& solid, const ConvexShape& hull) {
  if (shells_may_overlap(solid)) return compare_volumes(solid, {&hull, 1});
  VolumeComparison result;
  result.solid_volume = volume_properties(solid).volume;
  result.union_volume =
      std::max(result.solid_volume, volume_properties(convex_hull_mesh(hull.vertices)).volume);
  if (result.solid_volume > 0.0)
    result.gained = (result.union_volume - result.solid_volume) / result.solid_volume;
  return result;
}

}  // namespace takt
