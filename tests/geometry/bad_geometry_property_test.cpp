// Two hundred bad geometries: each gives an error with file and place, or a reported repair whose result
// bounds a solid.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "server/geometry/mesh/import.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;
using Triangle = std::array<std::uint32_t, 3>;

/// A sphere of rings and sectors, bumpy and oblong by chance: closed, faces outwards.
TriangleMesh good_mesh(std::mt19937& dice) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const std::uint32_t rings = 2 + static_cast<std::uint32_t>(dice() % 4),
                      sectors = 3 + static_cast<std::uint32_t>(dice() % 6);
  const Vec3 size(0.05 + unit(dice), 0.05 + unit(dice), 0.05 + unit(dice));
  TriangleMesh mesh;
  const auto add = [&](double polar, double around) {
    const Vec3 p(std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), std::cos(polar));
    mesh.vertices.push_back(p.cwiseProduct(size) * (0.9 + 0.1 * unit(dice)));
  };
  add(0.0, 0.0);
  for (std::uint32_t r = 1; r <= rings; ++r) {
    for (std::uint32_t s = 0; s < sectors; ++s) add(M_PI * r / (rings + 1), 2.0 * M_PI * s / sectors);
  }
  add(M_PI, 0.0);
  const auto last = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  const auto at = [&](std::uint32_t r, std::uint32_t s) { return 1 + r * sectors + s % sectors; };
  for (std::uint32_t s = 0; s < sectors; ++s) {
    mesh.triangles.push_back({0, at(0, s), at(0, s + 1)});
    for (std::uint32_t r = 0; r + 1 < rings; ++r) {
      mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r + 1, s + 1)});
      mesh.triangles.push_back({at(r, s), at(r + 1, s + 1), at(r, s + 1)});
    }
    mesh.triangles.push_back({at(rings - 1, s), last, at(rings - 1, s + 1)});
  }
  return mesh;
}

class BadGeometries : public testing::Test {
 protected:
  static constexpr int kOfEachKind = 25;

  std::size_t any(std::size_t n) { return dice_() % n; }
  Triangle& any_triangle(TriangleMesh& mesh) { return mesh.triangles[any(mesh.triangles.size())]; }

  std::filesystem::path write(const std::string& text) {
    directory_.write("bad.obj", text);
    return directory_ / "bad.obj";
  }
  static std::string text_of(const TriangleMesh& mesh) { return test::obj_text("part", mesh); }

  /// Empty: accepted unchanged, or repaired and reported.
  struct Answer {
    std::string error;
    RepairedMesh repaired;
  };
  Answer answer(const std::string& text, double scale = 1.0) {
    Answer result;
    try {
      result.repaired = import_repaired_solid(write(text), scale);
    } catch (const MeshError& error) {
      result.error = error.what();
    }
    return result;
  }
  void expect_error(const std::string& text, const std::string& place, double scale = 1.0) {
    const Answer got = answer(text, scale);
    ASSERT_FALSE(got.error.empty()) << "was taken";
    EXPECT_THAT(got.error, HasSubstr("bad.obj"));
    EXPECT_THAT(got.error, HasSubstr(place));
    ++errors_;
  }
  /// A reported repair that leaves a solid, or an error with the object's name.
  void expect_either(const std::string& text, const std::function<void(const TriangleMesh&)>& check = {}) {
    const Answer got = answer(text);
    if (!got.error.empty()) {
      EXPECT_THAT(got.error, AllOf(HasSubstr("bad.obj"), HasSubstr("part")));
      ++errors_;
      return;
    }
    EXPECT_FALSE(got.repaired.findings.empty()) << "no finding was reported";
    const MeshCheck closed = check_closed(got.repaired.mesh);
    EXPECT_TRUE(closed.ok()) << closed.problem;
    if (check) check(got.repaired.mesh);
    ++repairs_;
  }

  std::mt19937 dice_{20261122};
  test::TemporaryDirectory directory_;
  int errors_ = 0, repairs_ = 0;
};

TEST_F(BadGeometries, EachIsRefusedWithFileAndPlaceOrRepairedWithANote) {
  for (int i = 0; i < kOfEachKind; ++i) {
    SCOPED_TRACE("geometry " + std::to_string(i));
    const TriangleMesh good = good_mesh(dice_);
    {
      const Answer got = answer(text_of(good));
      ASSERT_EQ(got.error, "") << "the good one";
      ASSERT_TRUE(got.repaired.findings.empty());
    }
    const double volume = volume_properties(good).volume;
    const auto same_volume = [&](const TriangleMesh& mesh) {
      EXPECT_NEAR(volume_properties(mesh).volume, volume, 1e-4 * volume);
    };

    // 1: a triangle without area more.
    TriangleMesh bad = good;
    const Triangle flat = any_triangle(bad);
    bad.triangles.push_back({flat[0], flat[1], flat[0]});
    expect_either(text_of(bad), same_volume);

    // 2: a coordinate that is no number; its line is named.
    bad = good;
    std::string text = text_of(bad);
    const std::size_t vertex = any(bad.vertices.size());
    std::size_t line_begin = 0;
    for (std::size_t line = 0; line < 1 + vertex; ++line) line_begin = text.find('\n', line_begin) + 1;
    const std::size_t line_end = text.find('\n', line_begin);
    const char* const numbers[] = {"nan", "inf", "-inf", "1e39", "-1e400"};
    text.replace(line_begin, line_end - line_begin, std::string("v 0 ") + numbers[any(5)] + " 0");
    expect_error(text, "line " + std::to_string(vertex + 2) + ":");

    // 3: a triangle is missing.
    bad = good;
    bad.triangles.erase(bad.triangles.begin() + static_cast<std::ptrdiff_t>(any(bad.triangles.size())));
    expect_either(text_of(bad),
                  [](const TriangleMesh& mesh) { EXPECT_GT(volume_properties(mesh).volume, 0.0); });

    // 4: some faces are turned over.
    bad = good;
    for (std::size_t t = 0; t < 1 + any(5); ++t) {
      Triangle& turned = any_triangle(bad);
      std::swap(turned[0], turned[1]);
    }
    if (!check_closed(bad).ok()) expect_either(text_of(bad), same_volume);

    // 5: all are: the solid is inside out.
    bad = good;
    for (Triangle& t : bad.triangles) std::swap(t[1], t[2]);
    expect_either(text_of(bad), same_volume);

    // 6: larger than any number of the file's precision.
    text = text_of(good);
    expect_error("v 1e30 0 0\n" + text + "f -1 -2 -3\nf 1 2 3\n", "vertex 0", 1e300);

    // 7: half of it.
    bad = good;
    bad.triangles.resize(bad.triangles.size() / 2);
    expect_either(text_of(bad),
                  [](const TriangleMesh& mesh) { EXPECT_GT(volume_properties(mesh).volume, 0.0); });

    // 8: flat altogether.
    bad = good;
    for (Vec3& v : bad.vertices) v.z() = 0.25;
    const Answer nothing_left = answer(text_of(bad));
    EXPECT_THAT(nothing_left.error, HasSubstr("bad.obj"));
    ++errors_;
  }
  RecordProperty("errors", errors_);
  RecordProperty("repairs", repairs_);
  EXPECT_GE(errors_ + repairs_, 8 * kOfEachKind - 2 * kOfEachKind / 5);
  EXPECT_GT(errors_, 3 * kOfEachKind - 1);
  EXPECT_GT(repairs_, 2 * kOfEachKind);
}

/// A millionth of a millionth of a metre and a million million metres: accepted at the stated size.
TEST_F(BadGeometries, MeshesOfExtremeScaleKeepTheirShapeOrAreRefused) {
  for (int i = 0; i < kOfEachKind; ++i) {
    const TriangleMesh good = good_mesh(dice_);
    const double volume = volume_properties(good).volume;
    for (const double scale : {1e12, 1e-12, 1e6, 1e-6}) {
      SCOPED_TRACE(scale);
      const Answer got = answer(text_of(good), scale);
      if (!got.error.empty()) {
        EXPECT_THAT(got.error, HasSubstr("bad.obj"));
        continue;
      }
      EXPECT_TRUE(check_closed(got.repaired.mesh).ok());
      EXPECT_NEAR(volume_properties(got.repaired.mesh).volume / std::pow(scale, 3.0) / volume, 1.0, 1e-4);
    }
  }
}

}  // namespace
}  // namespace takt
