#include "server/geometry/convex_decomposition.h"

#include <cstdint>
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
  if (!(p.max_volume_error > 0.0 && p.max_volume_error < 1.0))
    throw std::invalid_argument("max_volume_error is " + std::to_string(p.max_volume_error) +
                                ", allowed is more than 0 and less than 1");
}

}  // namespace

#ifdef TAKT_HAS_VHACD

bool decomposition_available() {
  return true;
}

std::string decomposition_version() {
  return "V-HACD " + std::to_string(VHACD_VERSION_MAJOR) + "." + std::to_string(VHACD_VERSION_MINOR);
}

std::vector<ConvexShape> decompose(const TriangleMesh& solid, const DecompositionParameters& parameters) {
  check(parameters);
  std::vector<double> points;
  points.reserve(3 * solid.vertices.size());
  for (const Vec3& v : solid.vertices) points.insert(points.end(), {v.x(), v.y(), v.z()});
  std::vector<std::uint32_t> triangles;
  triangles.reserve(3 * solid.triangles.size());
  for (const auto& t : solid.triangles) triangles.insert(triangles.end(), t.begin(), t.end());

  VHACD::IVHACD::Parameters p;
  p.m_maxConvexHulls = static_cast<std::uint32_t>(parameters.max_hulls);
  p.m_resolution = static_cast<std::uint32_t>(parameters.resolution);
  p.m_minimumVolumePercentErrorAllowed = 100.0 * parameters.max_volume_error;
  p.m_maxNumVerticesPerCH = static_cast<std::uint32_t>(parameters.max_vertices_per_hull);
  p.m_findBestPlane = parameters.best_plane;
  p.m_asyncACD = false;
  const auto release = [](VHACD::IVHACD* vhacd) { vhacd->Release(); };
  const std::unique_ptr<VHACD::IVHACD, decltype(release)> vhacd(VHACD::CreateVHACD(), release);
  vhacd->Compute(points.data(), static_cast<std::uint32_t>(solid.vertices.size()), triangles.data(),
                 static_cast<std::uint32_t>(solid.triangles.size()), p);

  std::vector<ConvexShape> parts;
  for (std::uint32_t i = 0; i < vhacd->GetNConvexHulls(); ++i) {
    VHACD::IVHACD::ConvexHull hull;
    vhacd->GetConvexHull(i, hull);
    std::vector<Vec3> vertices;
    for (const VHACD::Vertex& v : hull.m_points) vertices.emplace_back(v.mX, v.mY, v.mZ);
    try {
      parts.push_back(ConvexShape::from_points(convex_hull_vertices(vertices)));
    } catch (const std::invalid_argument&) {
      // Moving the corners of a thin piece to the surface can leave it flat: it has no volume to lose.
    }
  }
  if (parts.empty())
    throw std::invalid_argument("V-HACD found no part with volume at a resolution of " +
                                std::to_string(parameters.resolution) + " voxels; a higher one may help");
  return parts;
}

#else

bool decomposition_available() {
  return false;
}

std::string decomposition_version() {
  return "none";
}

std::vector<ConvexShape> decompose(const TriangleMesh&, const DecompositionParameters& parameters) {
  check(parameters);
  throw std::invalid_argument(
      "this program was built without V-HACD; either install npm (with access to its registry), configure "
      "and "
      "build again, or use a decomposition made by hand: convex: a file with one object per convex part");
}

#endif

}  // namespace takt
