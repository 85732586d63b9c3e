// The octree of faces against a walk through all of them, and its file in the cache.
#include "server/geometry/surface/face_octree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "config/meshes/generator/screw_meshes.h"
#include "server/geometry/surface/contact_surface_data.h"
#include "server/geometry/surface/face_octree_cache.h"
#include "tests/support/contact_meshes.h"
#include "tests/support/random_shapes.h"
#include "tests/support/solid_mesh.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using test::Random;
using test::TemporaryDirectory;

TriangleMesh scaled(TriangleMesh mesh, double scale) {
  for (Vec3& v : mesh.vertices) v *= scale;
  return mesh;
}

Vec3 random_point(Random& random, const Aabb& box) {
  const Vec3 share(random.uniform(-0.05, 1.05), random.uniform(-0.05, 1.05), random.uniform(-0.05, 1.05));
  return box.lower + share.cwiseProduct(box.upper - box.lower);
}

/// What a search in the tree finds holds for the surface.
void expect_true(const FaceOctree& octree, const ContactSurface::Data& data, std::size_t points) {
  Random random(4711);
  std::size_t listed = 0;
  for (std::size_t i = 0; i < points; ++i) {
    const Vec3 x = random_point(random, data.bounds);
    const FaceOctree::Leaf* leaf = octree.find(x);
    const double distance_m = data.signed_distance_m(x);
    EXPECT_LE(octree.at_least_m(x), distance_m);
    if (leaf == nullptr) continue;
    EXPECT_LE(octree.at_least_m(*leaf, x), std::max(distance_m, 0.0));
    const NearestFace nearest = data.nearest_face(x);
    if (leaf->kind == FaceOctree::Kind::outside) {
      EXPECT_GT(distance_m, 0.0);
    }
    if (leaf->kind == FaceOctree::Kind::patch) {
      EXPECT_EQ(data.faces[static_cast<std::size_t>(nearest.face)].patch, leaf->patch);
    }
    if (!FaceOctree::has_list(*leaf)) continue;
    ++listed;
    const NearestFace found = data.nearest_face(x, *leaf);
    EXPECT_EQ(found.face, nearest.face);
    EXPECT_EQ(found.closest.q, nearest.closest.q);
  }
  EXPECT_GT(listed, points / 20);
}

TEST(FaceOctree, ItsListsHaveTheClosestFaceAtAnySize) {
  const TriangleMesh nut = test::mesh_of(meshes::make_nut(meshes::iso_metric(16)));
  // Of a millimetre, of 24 mm, of 24 m.
  for (const double scale : {0.05, 1.0, 1000.0}) {
    SCOPED_TRACE(scale);
    const ContactSurface surface(scaled(nut, scale), {});
    ASSERT_TRUE(surface.data().curved());
    expect_true(surface.data().octree, surface.data(), 4000);
  }
  const ContactSurface ball(test::ball(0.02, 4), {});
  expect_true(ball.data().octree, ball.data(), 4000);
}

class FaceOctreeEntry : public testing::Test {
 protected:
  static const TriangleMesh& mesh() {
    static const TriangleMesh ball = test::ball(0.02, 3);
    return ball;
  }
  static std::string content(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  static void write(const std::filesystem::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
  }
  std::optional<FaceOctree> find(const FaceOctreeCache& cache, const std::string& key) const {
    return cache.find(key, data_.faces.size(), data_.patches.size());
  }

  const TemporaryDirectory directory_;
  const ContactSurface surface_{mesh(), {}};
  const ContactSurface::Data& data_ = surface_.data();
  const std::string key_ = FaceOctreeCache::key(mesh());
};

TEST_F(FaceOctreeEntry, IsReadBackUnchangedAndUsedByTheSurface) {
  const FaceOctreeCache cache(directory_ / "a" / "b");  // made when needed
  EXPECT_FALSE(find(cache, key_).has_value());
  const ContactSurface first(mesh(), {}, &cache);
  EXPECT_EQ(first.data().octree.bytes(), data_.octree.bytes());
  const auto found = find(cache, key_);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->bytes(), data_.octree.bytes());
  expect_true(*found, data_, 1000);
  // The surface takes what is in the file: here that of a larger ball with as many faces.
  const ContactSurface larger(scaled(mesh(), 2.0), {});
  ASSERT_TRUE(cache.store(key_, larger.data().octree));
  EXPECT_EQ(ContactSurface(mesh(), {}, &cache).data().octree.bytes(), larger.data().octree.bytes());
}

TEST_F(FaceOctreeEntry, ThatIsDamagedIsIgnoredAndMadeAgain) {
  const FaceOctreeCache cache(directory_.path());
  ASSERT_TRUE(cache.store(key_, data_.octree));
  const std::string whole = content(cache.file_of(key_));
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const auto at = static_cast<std::size_t>(random.uniform(0.0, 1.0) * static_cast<double>(whole.size()));
    write(cache.file_of(key_), whole.substr(0, at));
    EXPECT_FALSE(find(cache, key_).has_value()) << at << " bytes";
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 1);
    write(cache.file_of(key_), flipped);
    EXPECT_FALSE(find(cache, key_).has_value()) << "byte " << at;
  }
  EXPECT_EQ(ContactSurface(mesh(), {}, &cache).data().octree.bytes(), data_.octree.bytes());
  EXPECT_EQ(content(cache.file_of(key_)), whole);
  // Under another's name, and for another number of faces.
  const std::string other(key_.size(), '0');
  write(cache.file_of(other), whole);
  EXPECT_FALSE(find(cache, other).has_value());
  EXPECT_TRUE(cache.find(key_, data_.faces.size(), data_.patches.size()).has_value());
  EXPECT_FALSE(cache.find(key_, data_.faces.size() - 1, data_.patches.size()).has_value());
}

TEST_F(FaceOctreeEntry, OfAnyBytesIsRefusedOrSearchedWithinItsLists) {
  const std::string whole = data_.octree.bytes();
  Random random(5);
  int read = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = whole;
    for (int k = 0; k < 4; ++k) {
      const auto at = static_cast<std::size_t>(random.uniform(0.0, 1.0) * static_cast<double>(bytes.size()));
      bytes[at] = static_cast<char>(random.uniform(-128.0, 128.0));
    }
    const auto octree = FaceOctree::from_bytes(bytes, data_.faces.size(), data_.patches.size());
    if (!octree) continue;
    ++read;
    for (int k = 0; k < 10; ++k) {
      const FaceOctree::Leaf* leaf = octree->find(random_point(random, data_.bounds));
      if (leaf == nullptr) continue;
      for (const FaceOctree::Near& near : octree->faces(*leaf))
        EXPECT_LT(static_cast<std::size_t>(near.face), data_.faces.size());
    }
  }
  EXPECT_GT(read, 0);
  EXPECT_FALSE(FaceOctree::from_bytes("", data_.faces.size(), data_.patches.size()).has_value());
  EXPECT_FALSE(FaceOctree::from_bytes(whole + "x", data_.faces.size(), data_.patches.size()).has_value());
}

TEST_F(FaceOctreeEntry, ThatWasUsedLastStaysWhenThereAreTooMany) {
  std::vector<std::string> keys;
  for (const char digit : {'0', '1', '2', '3', '4'}) keys.emplace_back(key_.size(), digit);
  const std::uintmax_t size = data_.octree.bytes().size();
  const FaceOctreeCache cache(directory_.path(), 3 * size + size / 2);
  const auto age = [&](const std::string& key, int hours) {
    std::filesystem::last_write_time(
        cache.file_of(key), std::filesystem::file_time_type::clock::now() - std::chrono::hours(hours));
  };
  for (std::size_t i = 1; i < 4; ++i) ASSERT_TRUE(cache.store(keys[i], data_.octree));
  age(keys[1], 3), age(keys[2], 2), age(keys[3], 1);
  directory_.write("other.convex", "an entry of another kind");
  EXPECT_TRUE(find(cache, keys[1]).has_value());  // its use is noted
  ASSERT_TRUE(cache.store(keys[4], data_.octree));
  EXPECT_TRUE(find(cache, keys[1]).has_value());
  EXPECT_FALSE(find(cache, keys[2]).has_value());
  EXPECT_TRUE(find(cache, keys[3]).has_value());
  EXPECT_TRUE(find(cache, keys[4]).has_value());
  EXPECT_TRUE(std::filesystem::exists(directory_ / "other.convex"));
}

TEST_F(FaceOctreeEntry, NeedsNoUsableDirectory) {
  directory_.write("file", "not a directory");
  const FaceOctreeCache cache(directory_ / "file" / "cache"), none;
  EXPECT_FALSE(cache.store(key_, data_.octree));
  EXPECT_FALSE(find(cache, key_).has_value());
  EXPECT_FALSE(none.store(key_, data_.octree));
  EXPECT_EQ(ContactSurface(mesh(), {}, &cache).data().octree.bytes(), data_.octree.bytes());
}

TEST_F(FaceOctreeEntry, IsNamedByTheContentOfTheMesh) {
  EXPECT_EQ(key_.size(), 32U);
  TriangleMesh moved = mesh();
  moved.vertices[3].x() = std::nextafter(moved.vertices[3].x(), 1.0);
  EXPECT_NE(FaceOctreeCache::key(moved), key_);
  TriangleMesh turned = mesh();
  std::rotate(turned.triangles[0].begin(), turned.triangles[0].begin() + 1, turned.triangles[0].end());
  EXPECT_NE(FaceOctreeCache::key(turned), key_);
}

}  // namespace
}  // namespace takt
