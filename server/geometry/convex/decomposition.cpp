#include "server/geometry/convex/decomposition.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <stdexcept>

#ifdef TAKT_HAS_VHACD
#define ENABLE_VHACD_IMPLEMENTATION 1
#define VHACD_DISABLE_THREADING 1
#include <VHACD.h>
#endif

namespace takt {
namespace {

void check_range(const char* name, double value, double lower, double upper) {
  if (value >= lower && value <= upper) return;
  throw std::invalid_argument(std::string(name) + " is " + std::to_string(value) + ", allowed is [" +
                              std::to_string(lower) + ", " + std::to_string(upper) + "]");
}

void check(const DecompositionParameters& p) {
  check_range("max_hulls", p.max_hulls, p.kMinHulls, p.kMaxHulls);
  check_range("resolution", p.resolution, p.kMinResolution, p.kMaxResolution);
  check_range("max_vertices_per_hull", p.max_vertices_per_hull, p.kMinVertices, p.kMaxVertices);
  if (!(p.max_volume_error > 0.0 && p.max_volume_error <= 1.0))
    throw std::invalid_argument("max_volume_error is " + std::to_string(p.max_volume_error) +
                                ", allowed is more than 0 and at most 1");
}

}  // namespace

#ifdef TAKT_HAS_VHACD

namespace {

struct Plane {
  Vec3 normal;
  double offset;  ///< normal . p <= offset inside
};

struct Part {
  std::vector<Vec3> points;
  std::vector<Plane> planes;  ///< of the hull of the points
};

/// Throws std::invalid_argument if the points span no volume.
Part make_part(std::vector<Vec3> points) {
  Part part;
  const TriangleMesh hull = convex_hull_mesh(points);
  for (const auto& t : hull.triangles) {
    const Vec3& a = hull.vertices[t[0]];
    const Vec3 normal = (hull.vertices[t[1]] - a).cross(hull.vertices[t[2]] - a);
    if (normal.norm() > 0.0) part.planes.push_back({normal.normalized(), normal.normalized().dot(a)});
  }
  part.points = std::move(points);
  return part;
}

/// Lower bound of the distance of a point outside a part; not positive inside.
double distance_out_of(const Part& part, const Vec3& p) {
  double distance = -std::numeric_limits<double>::infinity();
  for (const Plane& plane : part.planes) distance = std::max(distance, plane.normal.dot(p) - plane.offset);
  return distance;
}

/// V-HACD merges vertices nearer than a thousandth of the mesh's largest extent, each time it meets one with the nearest that it
/// has by then: one vertex can become two, the surface cracks, and the flood from outside leaves a shell. Here each vertex
/// becomes one of those kept, always the same, so that the surface stays closed and V-HACD finds nothing to merge.
TriangleMesh merge_near_vertices(const TriangleMesh& solid) {
  constexpr double kShare = 1.01e-3;
  Vec3 lower = solid.vertices.front(), upper = lower;
  for (const Vec3& v : solid.vertices) lower = lower.cwiseMin(v), upper = upper.cwiseMax(v);
  const double within = kShare * (upper - lower).maxCoeff();
  using Cell = std::array<std::int64_t, 3>;
  const auto cell_of = [&](const Vec3& v) {
    const Vec3 at = (v - lower) / within;
    return Cell{static_cast<std::int64_t>(at.x()), static_cast<std::int64_t>(at.y()),
                static_cast<std::int64_t>(at.z())};
  };
  TriangleMesh merged;
  std::map<Cell, std::vector<std::uint32_t>> cells;
  std::vector<std::uint32_t> kept;  // by vertex of the solid
  for (const Vec3& v : solid.vertices) {
    const Cell cell = cell_of(v);
    std::uint32_t nearest = static_cast<std::uint32_t>(merged.vertices.size());
    double smallest = within;
    for (std::int64_t i = -1; i <= 1; ++i)
      for (std::int64_t j = -1; j <= 1; ++j)
        for (std::int64_t k = -1; k <= 1; ++k) {
          const auto found = cells.find({cell[0] + i, cell[1] + j, cell[2] + k});
          if (found == cells.end()) continue;
          for (const std::uint32_t other : found->second) {
            const double distance = (merged.vertices[other] - v).norm();
            if (distance <= smallest) smallest = distance, nearest = other;
          }
        }
    if (nearest == merged.vertices.size()) {
      merged.vertices.push_back(v);
      cells[cell].push_back(nearest);
    }
    kept.push_back(nearest);
  }
  for (const auto& t : solid.triangles) {
    const TriangleMesh::Triangle moved{kept[t[0]], kept[t[1]], kept[t[2]]};
    if (moved[0] != moved[1] && moved[1] != moved[2] && moved[2] != moved[0])
      merged.triangles.push_back(moved);
  }
  return merged;
}

/// V-HACD ends a fraction of a voxel away from the surface, and a part that stands on a missing face falls by
/// that much. So every corner of the mesh that lies outside all parts joins the nearest one: plane faces are
/// exact, and all of the surface's corners are covered.
void grow_to_cover(const std::vector<Vec3>& corners, std::vector<Part>& parts) {
  std::vector<std::vector<Vec3>> missing(parts.size());
  for (const Vec3& corner : corners) {
    std::size_t nearest = 0;
    double smallest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < parts.size() && smallest > 0.0; ++i) {
      const double distance = distance_out_of(parts[i], corner);
      if (distance < smallest) {
        smallest = distance;
        nearest = i;
      }
    }
    if (smallest > 0.0) missing[nearest].push_back(corner);
  }
  for (std::size_t i = 0; i < parts.size(); ++i)
    parts[i].points.insert(parts[i].points.end(), missing[i].begin(), missing[i].end());
}

/// V-HACD reports percent, from zero in each of its stages; the progress must not decrease.
class ProgressReporter : public VHACD::IVHACD::IUserCallback {
 public:
  explicit ProgressReporter(const std::function<void(double)>& progress) : progress_(progress) {}
  void Update(const double overall, const double, const char* const, const char*) override {
    most_ = std::max(most_, std::min(1.0, 0.01 * overall));
    progress_(most_);
  }

 private:
  const std::function<void(double)>& progress_;
  double most_ = 0.0;
};

}  // namespace

bool decomposition_available() {
  return true;
}

std::string decomposition_version() {
  // The last number is the version of takt's own changes to the parts.
  return "V-HACD " + std::to_string(VHACD_VERSION_MAJOR) + "." + std::to_string(VHACD_VERSION_MINOR) +
         ", takt 2";
}

std::vector<ConvexShape> decompose(const TriangleMesh& solid, const DecompositionParameters& parameters,
                                   const std::function<void(double)>& progress) {
  check(parameters);
  const TriangleMesh merged = merge_near_vertices(solid);
  std::vector<double> coordinates;
  coordinates.reserve(3 * merged.vertices.size());
  for (const Vec3& v : merged.vertices) coordinates.insert(coordinates.end(), {v.x(), v.y(), v.z()});
  std::vector<std::uint32_t> triangles;
  triangles.reserve(3 * merged.triangles.size());
  for (const auto& t : merged.triangles) triangles.insert(triangles.end(), t.begin(), t.end());

  VHACD::IVHACD::Parameters p;
  p.m_maxConvexHulls = static_cast<std::uint32_t>(parameters.max_hulls);
  p.m_resolution = static_cast<std::uint32_t>(parameters.resolution);
  p.m_minimumVolumePercentErrorAllowed = 100.0 * parameters.max_volume_error;
  p.m_maxNumVerticesPerCH = static_cast<std::uint32_t>(parameters.max_vertices_per_hull);
  p.m_findBestPlane = parameters.best_plane;
  p.m_asyncACD = false;
  ProgressReporter reporter(progress);
  if (progress) p.m_callback = &reporter;
  const auto release = [](VHACD::IVHACD* vhacd) { vhacd->Release(); };
  const std::unique_ptr<VHACD::IVHACD, decltype(release)> vhacd(VHACD::CreateVHACD(), release);
  vhacd->Compute(coordinates.data(), static_cast<std::uint32_t>(merged.vertices.size()), triangles.data(),
                 static_cast<std::uint32_t>(merged.triangles.size()), p);

  std::vector<Part> parts;
  for (std::uint32_t i = 0; i < vhacd->GetNConvexHulls(); ++i) {
    VHACD::IVHACD::ConvexHull hull;
    vhacd->GetConvexHull(i, hull);
    std::vector<Vec3> points;
    for (const VHACD::Vertex& v : hull.m_points) points.emplace_back(v.mX, v.mY, v.mZ);
    try {
      parts.push_back(make_part(std::move(points)));
    } catch (const std::invalid_argument&) {
      // A thin piece can become flat when its corners move to the surface: it has no volume and is dropped.
    }
  }
  if (parts.empty())
    throw std::invalid_argument("V-HACD found no part with volume at a resolution of " +
                                std::to_string(parameters.resolution) + " voxels; a higher one may help");
  grow_to_cover(solid.vertices, parts);
  std::vector<ConvexShape> shapes;
  for (const Part& part : parts)
    shapes.push_back(ConvexShape::from_points(convex_hull_vertices(part.points)));
  return shapes;
}

#else

bool decomposition_available() {
  return false;
}

std::string decomposition_version() {
  return "none";
}

std::vector<ConvexShape> decompose(const TriangleMesh&, const DecompositionParameters& parameters,
                                   const std::function<void(double)>&) {
  check(parameters);
  throw std::invalid_argument(
      "this program was built without V-HACD; either install npm (with access to its registry), configure "
      "and "
      "build again, or use a decomposition made by hand: convex: a file with one object per convex part");
}

#endif

}  // namespace takt
