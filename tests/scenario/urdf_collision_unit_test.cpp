// <collision> geometry of URDF links: shapes in the frame of the joint that moves them, and errors with their
// place.
#include "server/scenario/urdf_collision.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class UrdfCollision : public testing::Test {
 protected:
  /// Links world - base - (fixed) plate - (revolute) arm - (fixed) tool.
  static std::string robot(const std::string& base, const std::string& plate, const std::string& arm,
                           const std::string& tool) {
    const auto link = [](const std::string& name, const std::string& inside) {
      return "<link name='" + name + "'>" + inside + "</link>\n";
    };
    const auto joint = [](const std::string& name, const std::string& type, const std::string& parent,
                          const std::string& child, const std::string& origin) {
      return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" +
             child + "'/><origin " + origin +
             "/><axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>\n";
    };
    return "<robot name='r'>\n" +
           link("world", "<collision><geometry><sphere radius='9'/></geometry></collision>") +
           link("base", base) + link("plate", plate) + link("arm", arm) + link("tool", tool) +
           joint("stand", "fixed", "world", "base", "xyz='0 0 5'") +
           joint("screws", "fixed", "base", "plate", "xyz='0 0 0.1'") +
           joint("hinge", "revolute", "plate", "arm", "xyz='0 0 1'") +
           joint("bolt", "fixed", "arm", "tool", "xyz='1 0 0' rpy='0 0 1.5707963267948966'") + "</robot>\n";
  }
  static std::string collision(const std::string& geometry, const std::string& origin = "") {
    return "<collision>" + (origin.empty() ? "" : "<origin " + origin + "/>") + "<geometry>" + geometry +
           "</geometry></collision>";
  }
  std::vector<UrdfLinkShapes> read(const std::string& text) {
    directory_.write("r.urdf", text);
    const auto file = directory_ / "r.urdf";
    return urdf_collision(read_urdf_arm(file, "base", "tool"));
  }
  std::string error(const std::string& arm) {
    try {
      read(robot("", "", arm, ""));
    } catch (const UrdfError& e) {
      return e.what();
    }
    return "no error";
  }
  test::TemporaryDirectory directory_;
};

TEST_F(UrdfCollision, ShapesLieInTheFrameOfTheirJoint) {
  const auto links = read(robot("", collision("<box size='0.2 0.4 0.6'/>"),
                                collision("<sphere radius='0.3'/>", "xyz='0 0 2'"),
                                collision("<box size='0.2 0.4 0.6'/>", "xyz='0 1 0'")));
  ASSERT_EQ(links.size(), 3U) << "links without geometry, and what is above the base, are left out";
  EXPECT_EQ(links[0].link, "plate");
  EXPECT_EQ(links[0].joint, -1);
  EXPECT_NEAR((links[0].shapes[0].core.box.center_B - Vec3(0, 0, 0.1)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((links[0].shapes[0].core.box.half_B - Vec3(0.1, 0.2, 0.3)).norm(), 0.0, 1e-12);
  EXPECT_EQ(links[1].link, "arm");
  EXPECT_EQ(links[1].joint, 0);
  EXPECT_EQ(links[1].shapes[0].radius_m, 0.3);
  EXPECT_NEAR((links[1].shapes[0].core.vertices[0] - Vec3(0, 0, 2)).norm(), 0.0, 1e-12);
  EXPECT_EQ(links[2].link, "tool");
  EXPECT_EQ(links[2].joint, 0);
  // Turned by 90 degrees about z: the origin 1 m along y of the tool is at -1 m along x from the bolt.
  EXPECT_NEAR((links[2].shapes[0].core.box.center_B - Vec3(0, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((links[2].shapes[0].core.box.half_B - Vec3(0.2, 0.1, 0.3)).norm(), 0.0, 1e-12);
}

TEST_F(UrdfCollision, ACylinderIsEnclosedClosely) {
  const auto links = read(robot("", "", collision("<cylinder radius='0.1' length='0.5'/>"), ""));
  const ConvexShape& prism = links.at(0).shapes.at(0).core;
  for (const Vec3& v : prism.vertices) {
    EXPECT_EQ(std::abs(v.z()), 0.25);
    EXPECT_LE(v.head<2>().norm(), 0.1 * 1.005);
  }
  for (int i = 0; i < 360; ++i) {
    const double angle = i * std::numbers::pi / 180.0;
    std::uint32_t start = ConvexShape::kNoVertex;
    EXPECT_GE(prism.extreme_height(Vec3(std::cos(angle), std::sin(angle), 0.0), start), 0.1 - 1e-12);
  }
}

TEST_F(UrdfCollision, AMeshIsFoundBesideTheUrdfAndScaled) {
  directory_.write("wedge.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto links =
      read(robot("", "", collision("<mesh filename='wedge.obj' scale='0.1 0.2 0.3'/>", "xyz='0 0 1'"), ""));
  const ConvexShape& hull = links.at(0).shapes.at(0).core;
  ASSERT_EQ(hull.vertices.size(), 4U);
  EXPECT_NEAR((hull.box.half_B - Vec3(0.05, 0.1, 0.15)).norm(), 0.0, 1e-7);
  EXPECT_NEAR(hull.box.center_B.z(), 1.15, 1e-7);
}

TEST_F(UrdfCollision, AMeshMayBeAFileUriAndAnOriginMayOnlyRotate) {
  directory_.write("wedge.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto links = read(robot("", collision("<box size='0.2 0.4 0.6'/>", "rpy='0 0 1.5707963267948966'"),
                                collision("<mesh filename='file://wedge.obj'/>"), ""));
  EXPECT_NEAR((links.at(0).shapes.at(0).core.box.half_B - Vec3(0.2, 0.1, 0.3)).norm(), 0.0, 1e-12);
  EXPECT_EQ(links.at(1).shapes.at(0).core.vertices.size(), 4U);
}

TEST_F(UrdfCollision, MistakesAreReportedWithTheirPlace) {
  EXPECT_THAT(error(collision("<mesh filename='arm.stl' scale='1 0 1'/>")), HasSubstr("arm.stl"));
  directory_.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 2\n");
  EXPECT_THAT(error(collision("<mesh filename='flat.obj' scale='1 -1 1'/>")),
              AllOf(HasSubstr("r.urdf: line 5"), HasSubstr("link 'arm'"), HasSubstr("<mesh>: scale"),
                    HasSubstr("found '1 -1 1'"), HasSubstr("3 finite numbers > 0")));
  EXPECT_THAT(error(collision("<cylinder radius='0' length='1'/>")),
              AllOf(HasSubstr("<cylinder>: radius: found '0'"), HasSubstr("a finite number > 0")));
  EXPECT_THAT(error(collision("<cylinder radius='1' length='-2'/>")),
              HasSubstr("<cylinder>: length: found '-2'"));
  EXPECT_THAT(error(collision("<mesh filename='package://ur/elbow.stl'/>")),
              AllOf(HasSubstr("r.urdf: line 5"), HasSubstr("link 'arm'"), HasSubstr("package://ur/elbow.stl"),
                    HasSubstr("in the package 'ur'"), HasSubstr("--packages")));
  EXPECT_NE(error(collision("<mesh filename='missing.stl'/>")), "no error");
  EXPECT_THAT(error(collision("<box size='0.2 0 0.6'/>")), HasSubstr("3 finite numbers > 0"));
  EXPECT_THAT(error(collision("<sphere radius='-1'/>")), HasSubstr("a finite number > 0"));
}

TEST(UrdfCollisionUr10e, EachMovingLinkHasSimplifiedShapes) {
  const auto file = std::filesystem::path(TAKT_CONFIG_DIR) / "robots" / "ur10e.urdf";
  const auto links = urdf_collision(read_urdf_arm(file, "base_link", "tool0"));
  ASSERT_EQ(links.size(), 7U);
  for (std::size_t i = 0; i < links.size(); ++i) {
    EXPECT_EQ(links[i].joint, static_cast<int>(i) - 1) << links[i].link;
    EXPECT_FALSE(links[i].shapes.empty());
  }
}

}  // namespace
}  // namespace takt
