// Convex decomposition: invariants of the parts, and reliability of the cache.
#include "server/geometry/convex/decomposition.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "server/geometry/convex/decomposition_cache.h"
#include "server/geometry/convex/volume_comparison.h"
#include "server/geometry/mesh/import.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::test {
namespace {

using testing::HasSubstr;

DecompositionParameters coarse() {
  DecompositionParameters p;
  p.resolution = 100'000;
  return p;
}

TriangleMesh block(const std::string& name) {
  return import_solid(std::filesystem::path(TAKT_CONFIG_DIR) / "meshes" / (name + ".obj"));
}

/// Planes through three points with all others on one side: the faces of the hull by brute force.
class Hull {
 public:
  explicit Hull(const std::vector<Vec3>& points) {
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t j = i + 1; j < points.size(); ++j)
        for (std::size_t k = j + 1; k < points.size(); ++k) add(points, i, j, k);
  }
  /// Not positive inside.
  double distance_out(const Vec3& p) const {
    double largest = -std::numeric_limits<double>::infinity();
    for (const auto& [normal, offset] : planes_) largest = std::max(largest, normal.dot(p) - offset);
    return largest;
  }

 private:
  void add(const std::vector<Vec3>& points, std::size_t i, std::size_t j, std::size_t k) {
    const Vec3 cross = (points[j] - points[i]).cross(points[k] - points[i]);
    if (!(cross.norm() > 1e-10)) return;  // m^2: a sliver does not define a plane
    for (const Vec3& normal : {Vec3(cross.normalized()), Vec3(-cross.normalized())}) {
      const double offset = normal.dot(points[i]);
      const bool is_face = std::all_of(points.begin(), points.end(),
                                       [&](const Vec3& p) { return normal.dot(p) <= offset + 1e-9; });
      if (is_face) planes_.emplace_back(normal, offset);
    }
  }
  std::vector<std::pair<Vec3, double>> planes_;
};

void expect_covers(const TriangleMesh& mesh, const std::vector<ConvexShape>& parts, double largest_error) {
  const VolumeComparison volumes = compare_volumes(mesh, parts);
  EXPECT_LE(volumes.error(), largest_error) << "lost " << volumes.lost << ", gained " << volumes.gained;
  std::vector<Hull> hulls;
  for (const ConvexShape& part : parts) hulls.emplace_back(part.vertices);
  double farthest = 0.0;
  for (const Vec3& v : mesh.vertices) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Hull& hull : hulls) nearest = std::min(nearest, hull.distance_out(v));
    farthest = std::max(farthest, nearest);
  }
  EXPECT_LE(farthest, 1e-8) << "a vertex of the mesh is in no part";
  const std::vector<Vec3> corners = convex_hull_vertices(mesh.vertices);
  const TriangleMesh whole = convex_hull_mesh(corners);
  for (const ConvexShape& part : parts) {
    for (const Vec3& v : part.vertices) {
      for (const auto& t : whole.triangles) {
        const Vec3& a = whole.vertices[t[0]];
        const Vec3 n = (whole.vertices[t[1]] - a).cross(whole.vertices[t[2]] - a).normalized();
        EXPECT_LE(n.dot(v - a), 1e-8) << "a part reaches out of the convex hull";
      }
    }
  }
}

bool overlaps(const std::vector<ConvexShape>& parts, const TriangleMesh& probe) {
  const ConvexShape shape = ConvexShape::from_points(probe.vertices);
  return std::any_of(parts.begin(), parts.end(), [&](const ConvexShape& part) {
    return convex_overlap(part, Pose{}, shape, Pose{}, 0.0);
  });
}

class Decomposition : public testing::Test {
 protected:
  void SetUp() override {
    if (!decomposition_available()) GTEST_SKIP() << "built without V-HACD";
  }
};

/// Edge of a voxel (m): the box around the body has as many as the resolution.
double voxel_size(const Vec3& size, const DecompositionParameters& p) {
  return std::cbrt(size.prod() / p.resolution);
}

/// A pocket of a body, its frame at the centre of its floor, open towards +z: a probe must go into it, two
/// voxels away from its walls and floor, and must be stopped by each of them.
void expect_open_pocket(const std::vector<ConvexShape>& parts, const Vec3& pocket, const Vec3& floor,
                        double voxel) {
  const double gap = 2.0 * voxel;
  const auto probe = [&](double dx, double dy, double dz) {
    return overlaps(parts,
                    box_mesh(pocket - Vec3(2.0 * gap, 2.0 * gap, 0.0), floor + Vec3(dx, dy, gap + dz)));
  };
  EXPECT_FALSE(probe(0.0, 0.0, 0.0)) << "the pocket is not empty";
  const double through = gap + 1e-4;
  EXPECT_TRUE(probe(through, 0.0, 0.0));
  EXPECT_TRUE(probe(-through, 0.0, 0.0));
  EXPECT_TRUE(probe(0.0, through, 0.0));
  EXPECT_TRUE(probe(0.0, -through, 0.0));
  EXPECT_TRUE(probe(0.0, 0.0, -through));
}

TEST_F(Decomposition, AUShapeKeepsItsPocket) {
  const auto parts = decompose(u_shape(), coarse());
  EXPECT_GE(parts.size(), 3U);
  expect_covers(u_shape(), parts, 0.03);
  // The pocket is x 20..80, y 20..80 mm, open at three sides.
  const double gap = 2.0 * voxel_size({0.1, 0.08, 0.05}, coarse());
  const auto probe = [&](double width, double bottom) {
    return overlaps(parts, box_mesh({width, 0.05, 0.05}, {0.05, bottom + 0.025, 0.0}));
  };
  EXPECT_FALSE(probe(0.06 - 2.0 * gap, 0.02 + gap));
  EXPECT_TRUE(probe(0.0602, 0.02 + gap));
  EXPECT_TRUE(probe(0.06 - 2.0 * gap, 0.0199));
}

TEST_F(Decomposition, AnOpenBoxKeepsItsOpening) {
  const Vec3 size(0.20, 0.24, 0.10);
  const TriangleMesh box = open_box(size, 0.012);
  const auto parts = decompose(box, coarse());
  EXPECT_GE(parts.size(), 5U);
  expect_covers(box, parts, 0.08);
  expect_open_pocket(parts, {0.176, 0.216, 0.088}, {0.0, 0.0, 0.012}, voxel_size(size, coarse()));
}

TEST_F(Decomposition, BlockBKeepsItsPockets) {
  const TriangleMesh b = block("B");
  const auto parts = decompose(b, coarse());
  EXPECT_LE(parts.size(), 32U);
  expect_covers(b, parts, 0.03);
  const double voxel = voxel_size({0.22, 0.12, 0.06}, coarse());
  expect_open_pocket(parts, {0.060, 0.080, 0.040}, {-0.060, 0.0, 0.020}, voxel);
  expect_open_pocket(parts, {0.080, 0.080, 0.040}, {0.040, 0.0, 0.020}, voxel);
}

TEST_F(Decomposition, BlockOKeepsItsPocket) {
  const TriangleMesh o = block("O");
  const auto parts = decompose(o, coarse());
  expect_covers(o, parts, 0.03);
  expect_open_pocket(parts, {0.030, 0.030, 0.050}, {0.015, 0.0, 0.030},
                     voxel_size({0.079, 0.079, 0.08}, coarse()));
}

/// A square plate with a round hole of so many facets, meshed as CAD kernels do: fans from the corners to the rim.
TriangleMesh plate_with_fine_hole(double size, double thickness, double radius, std::uint32_t facets) {
  TriangleMesh mesh;
  for (const Vec3& corner : {Vec3(1, 1, 0), Vec3(-1, 1, 0), Vec3(-1, -1, 0), Vec3(1, -1, 0)})
    for (const double z : {-0.5, 0.5})
      mesh.vertices.push_back(0.5 * size * corner + z * thickness * Vec3::UnitZ());
  for (std::uint32_t i = 0; i < facets; ++i)
    for (const double z : {-0.5, 0.5})
      mesh.vertices.emplace_back(radius * std::cos(2.0 * M_PI * i / facets),
                                 radius * std::sin(2.0 * M_PI * i / facets), z * thickness);
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  const auto rim = [&](std::uint32_t i) { return 8 + 2 * (i % facets); };
  for (std::uint32_t i = 0; i < facets; ++i) {
    const std::uint32_t corner = 2 * (i * 4 / facets), a = rim(i), b = rim(i + 1);
    quad(a, a + 1, b + 1, b);
    mesh.triangles.push_back({corner + 1, b + 1, a + 1});
    mesh.triangles.push_back({corner, a, b});
  }
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::uint32_t a = 2 * k, b = 2 * ((k + 1) % 4), between = rim((k + 1) * facets / 4);
    quad(a, b, b + 1, a + 1);
    mesh.triangles.push_back({a + 1, b + 1, between + 1});
    mesh.triangles.push_back({a, between, b});
  }
  return mesh;
}

TEST_F(Decomposition, AFineHoleLeavesThePlateItsInside) {
  // Facets of 0.04 mm are less than the thousandth of the plate within which V-HACD merges vertices.
  const TriangleMesh plate = plate_with_fine_hole(0.1, 0.02, 0.015, 2400);
  ASSERT_TRUE(check_closed(plate).ok());
  ASSERT_NEAR(volume_properties(plate).volume, 0.02 * (0.01 - M_PI * 0.015 * 0.015), 1e-9);
  const VolumeComparison volumes = compare_volumes(plate, decompose(plate, DecompositionParameters()));
  EXPECT_LT(volumes.lost, 0.01);
  EXPECT_LT(volumes.gained, 0.08);
}

TEST_F(Decomposition, PiecesStandWhereTheSolidStands) {
  // C in the pocket of B, O on the table: plane faces are where they are in the mesh, to 1 um, not to a
  // voxel.
  const auto b = decompose(block("B"), coarse());
  const TriangleMesh c = box_mesh({0.040, 0.060, 0.08}, {-0.060, 0.0, 0.020 - 1e-6});
  EXPECT_TRUE(overlaps(b, c));
  const auto o = decompose(block("O"), coarse());
  EXPECT_TRUE(overlaps(o, box_mesh({0.5, 0.5, 0.04}, {0.0, 0.0, -0.04 + 1e-6})));
  EXPECT_FALSE(overlaps(o, box_mesh({0.5, 0.5, 0.04}, {0.0, 0.0, -0.04 - 1e-6})));
}

TEST_F(Decomposition, AConvexBodyStaysWhole) {
  const TriangleMesh box = box_mesh({0.1, 0.2, 0.3});
  const auto parts = decompose(box, coarse());
  EXPECT_EQ(parts.size(), 1U);
  expect_covers(box, parts, 0.005);
}

TEST_F(Decomposition, PiecesAreNeverMoreThanAllowed) {
  for (const int hulls : {1, 2, 7}) {
    DecompositionParameters p = coarse();
    p.max_hulls = hulls;
    EXPECT_LE(decompose(u_shape(), p).size(), static_cast<std::size_t>(hulls));
  }
}

TEST_F(Decomposition, TheScaleDoesNotMatter) {
  TriangleMesh small = u_shape();
  for (Vec3& v : small.vertices) v = v / 64.0 + Vec3(1.0, 2.0, 3.0);
  const auto parts = decompose(small, coarse());
  EXPECT_NEAR(compare_volumes(small, parts).error(),
              compare_volumes(u_shape(), decompose(u_shape(), coarse())).error(), 0.01);
}

void expect_same_bits(const std::vector<ConvexShape>& a, const std::vector<ConvexShape>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].vertices, b[i].vertices);
    EXPECT_EQ(a[i].center_B, b[i].center_B);
    EXPECT_EQ(a[i].radius, b[i].radius);
    EXPECT_EQ(a[i].is_box, b[i].is_box);
    EXPECT_EQ(a[i].box.center_B, b[i].box.center_B);
    EXPECT_EQ(a[i].box.half_B, b[i].box.half_B);
  }
}

TEST_F(Decomposition, RepeatedRunsGiveTheSameBits) {
  const TriangleMesh o = block("O");
  expect_same_bits(decompose(o, coarse()), decompose(o, coarse()));
}

TEST_F(Decomposition, ProgressRisesAndChangesNoBit) {
  std::vector<double> reported;
  const auto parts = decompose(u_shape(), coarse(), [&](double part) { reported.push_back(part); });
  ASSERT_GE(reported.size(), 3U);
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  EXPECT_GE(reported.front(), 0.0);
  EXPECT_LE(reported.back(), 1.0);
  EXPECT_GT(reported.back(), 0.5);
  const auto quiet = decompose(u_shape(), coarse());
  ASSERT_EQ(parts.size(), quiet.size());
  for (std::size_t i = 0; i < parts.size(); ++i) EXPECT_EQ(parts[i].vertices, quiet[i].vertices) << i;
}

TEST_F(Decomposition, TheCacheReturnsTheSameBits) {
  const TemporaryDirectory directory;
  const DecompositionCache cache(directory / "a" / "b");  // created when needed
  const CachedDecomposition made = decompose_cached(u_shape(), coarse(), cache);
  EXPECT_FALSE(made.from_cache);
  const CachedDecomposition found = decompose_cached(u_shape(), coarse(), cache);
  EXPECT_TRUE(found.from_cache);
  expect_same_bits(found.shapes, made.shapes);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory / "a" / "b"))
    files += entry.is_regular_file();
  EXPECT_EQ(files, 1) << "nothing temporary is left";
}

std::string content(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::vector<ConvexShape> two_shapes() {
  std::vector<ConvexShape> shapes;
  shapes.push_back(ConvexShape::from_points(box_mesh({0.1, 0.2, 1.0 / 3.0}).vertices));
  shapes.push_back(
      ConvexShape::from_points({{0, 0, 0}, {1e-300, 0, 0}, {0, -1e17, 0}, {0, 0, 0.1}, {-0.0, 7, 7}}));
  return shapes;
}

TEST(DecompositionCache, AnEntryIsReadBackUnchanged) {
  const TemporaryDirectory directory;
  const DecompositionCache cache(directory.path());
  EXPECT_FALSE(cache.find("0123").has_value());
  ASSERT_TRUE(cache.store("0123", two_shapes()));
  const auto found = cache.find("0123");
  ASSERT_TRUE(found.has_value());
  expect_same_bits(*found, two_shapes());
  EXPECT_FALSE(cache.find("4567").has_value());
}

TEST(DecompositionCache, DamagedEntriesAreIgnored) {
  const TemporaryDirectory directory;
  const DecompositionCache cache(directory.path());
  ASSERT_TRUE(cache.store("0123", two_shapes()));
  const std::string whole = content(cache.file_of("0123"));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    std::ofstream(cache.file_of("0123"), std::ios::binary) << whole.substr(0, length);
    EXPECT_FALSE(cache.find("0123").has_value()) << length << " bytes";
  }
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string flipped = whole;
    flipped[i] = static_cast<char>(flipped[i] ^ 1);
    std::ofstream(cache.file_of("0123"), std::ios::binary) << flipped;
    EXPECT_FALSE(cache.find("0123").has_value()) << "byte " << i;
  }
  // An intact entry under another's name.
  std::ofstream(cache.file_of("4567"), std::ios::binary) << whole;
  EXPECT_FALSE(cache.find("4567").has_value());
  ASSERT_TRUE(cache.store("0123", two_shapes()));
  EXPECT_TRUE(cache.find("0123").has_value());
}

TEST_F(Decomposition, ADamagedEntryIsMadeAgain) {
  const TemporaryDirectory directory;
  const DecompositionCache cache(directory.path());
  const CachedDecomposition made = decompose_cached(u_shape(), coarse(), cache);
  const auto file = cache.file_of(DecompositionCache::key(u_shape(), coarse()));
  const std::string whole = content(file);
  ASSERT_FALSE(whole.empty());
  std::ofstream(file, std::ios::binary) << whole.substr(0, whole.size() / 2);
  const CachedDecomposition again = decompose_cached(u_shape(), coarse(), cache);
  EXPECT_FALSE(again.from_cache);
  expect_same_bits(again.shapes, made.shapes);
  EXPECT_EQ(content(file), whole);
}

TEST(DecompositionCache, AnUnusableDirectoryIsNoError) {
  const TemporaryDirectory directory;
  directory.write("file", "not a directory");
  const DecompositionCache cache(directory / "file" / "cache");
  EXPECT_FALSE(cache.store("0123", two_shapes()));
  EXPECT_FALSE(cache.find("0123").has_value());
  const DecompositionCache none;
  EXPECT_FALSE(none.store("0123", two_shapes()));
  EXPECT_FALSE(none.find("0123").has_value());
  EXPECT_FALSE(std::filesystem::exists("0123.convex"));
}

TEST(DecompositionCache, TheKeyFollowsContentAlone) {
  const std::string key = DecompositionCache::key(u_shape(), {});
  EXPECT_EQ(key.size(), 32U);
  EXPECT_EQ(DecompositionCache::key(u_shape(), {}), key);
  TriangleMesh moved = u_shape();
  moved.vertices[3].x() = std::nextafter(moved.vertices[3].x(), 1.0);
  EXPECT_NE(DecompositionCache::key(moved, {}), key);
  TriangleMesh turned = u_shape();
  std::rotate(turned.triangles[0].begin(), turned.triangles[0].begin() + 1, turned.triangles[0].end());
  EXPECT_NE(DecompositionCache::key(turned, {}), key);
  const auto changed = [](auto change) {
    DecompositionParameters p;
    change(p);
    return DecompositionCache::key(u_shape(), p);
  };
  EXPECT_NE(changed([](auto& p) { ++p.max_hulls; }), key);
  EXPECT_NE(changed([](auto& p) { ++p.resolution; }), key);
  EXPECT_NE(changed([](auto& p) { p.max_volume_error *= 2.0; }), key);
  EXPECT_NE(changed([](auto& p) { ++p.max_vertices_per_hull; }), key);
  EXPECT_NE(changed([](auto& p) { p.best_plane = !p.best_plane; }), key);
}

TEST(DecompositionParameters, ParametersOutOfBoundsAreRefused) {
  const auto refusal = [](auto change) -> std::string {
    DecompositionParameters p;
    change(p);
    try {
      decompose(u_shape(), p);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_THAT(refusal([](auto& p) { p.max_hulls = 0; }), HasSubstr("max_hulls is 0"));
  EXPECT_THAT(refusal([](auto& p) { p.resolution = 9'999; }), HasSubstr("resolution is 9999"));
  EXPECT_THAT(refusal([](auto& p) { p.max_vertices_per_hull = 3; }), HasSubstr("max_vertices_per_hull is 3"));
  EXPECT_THAT(refusal([](auto& p) { p.max_volume_error = std::numeric_limits<double>::quiet_NaN(); }),
              HasSubstr("max_volume_error"));
  if (!decomposition_available()) {
    EXPECT_THAT(refusal([](auto&) {}), HasSubstr("built without V-HACD"));
  }
}

}  // namespace
}  // namespace takt::test
