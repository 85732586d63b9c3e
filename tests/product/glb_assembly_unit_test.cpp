// GLB files as products: structure and figures by hand, faces against those of bodies whose faces are known.
#include "server/product/glb_assembly.h"

#include <gmock/gmock.h>

#include <map>
#include <set>

#include "server/geometry/mesh/import.h"
#include "server/product/contacts.h"
#include "server/product/disassembly.h"
#include "server/product/mesh_faces.h"
#include "tests/support/glb_product.h"
#include "tests/support/product_bodies.h"
#include "tests/support/temporary_directory.h"

namespace takt::product {
namespace {

using test::box_body;
using test::GlbProduct;
using test::plate_with_hole;
using test::product_of;
using test::turned_body;
using testing::ElementsAre;
using testing::HasSubstr;

class GlbAssembly : public testing::Test {
 protected:
  std::filesystem::path file() const { return directory_ / "cell.glb"; }
  static const Instance& instance(const Product& product, const std::string& name) {
    for (const Instance& one : product.instances)
      if (one.name == name) return one;
    throw std::out_of_range(name);
  }
  static Vec3 centre(const Product& product, const std::string& name) {
    const Instance& one = instance(product, name);
    return one.X_WB * product.bodies[one.body].exact.p_BBcm;
  }
  test::TemporaryDirectory directory_;
};

TEST_F(GlbAssembly, NodesBecomePartsWithPlacesColoursAndMaterials) {
  GlbProduct made("Gearbox 3");
  const int brass = made.material("Messing", {0.5, 0.0, 1.0, 0.25});
  const int bolt = made.mesh(turned_body("bolt", {0.0, 0.02}, {0.003}).mesh, brass);
  const int group = made.node("Cover group", -1, {0, 0, 0.1});
  made.node("Screw M6x20", bolt, {0.01, 0, 0}, group);
  made.node("Screw M6x20", bolt, {0.02, 0, 0}, group, Quat(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitX())));
  made.node("", made.mesh(box_body("box", {0.05, 0.04, 0.03}).mesh), {0, 0, 0.2});
  made.write(file());
  const Product product = read_glb_assembly(file(), {{"*", 1000.0}});
  EXPECT_EQ(product.name, "Gearbox 3");
  EXPECT_THAT(product.notes, testing::IsEmpty());
  ASSERT_EQ(product.bodies.size(), 2U);
  std::vector<std::string> names, paths;
  for (const Instance& one : product.instances) names.push_back(one.name), paths.push_back(one.path);
  EXPECT_THAT(names, ElementsAre("Screw_M6x20", "Screw_M6x20_2", "Gearbox_3"));
  EXPECT_THAT(paths, ElementsAre("Gearbox 3/Cover group/Screw M6x20", "Gearbox 3/Cover group/Screw M6x20",
                                 "Gearbox 3/Gearbox 3"));
  // A prism of 64 sides with its corners on the cylinder.
  const double n = test::kRoundSides, r = 0.003, h = 0.02;
  const Body& screw = product.bodies[instance(product, "Screw_M6x20").body];
  EXPECT_NEAR(screw.exact.volume, 0.5 * n * r * r * std::sin(2.0 * M_PI / n) * h, 1e-12);
  EXPECT_LT((centre(product, "Screw_M6x20") - Vec3(0.01, 0, 0.11)).norm(), 1e-8);
  EXPECT_LT((centre(product, "Screw_M6x20_2") - Vec3(0.02, -0.01, 0.1)).norm(), 1e-8);
  const Body& box = product.bodies[instance(product, "Gearbox_3").body];
  EXPECT_NEAR(box.exact.volume, 0.05 * 0.04 * 0.03, 1e-11);
  EXPECT_NEAR(box.exact.G_BBcm_B(0, 0), (0.04 * 0.04 + 0.03 * 0.03) / 12.0, 1e-10);
  EXPECT_EQ(box.material.density_kg_m3, 1000.0);
  EXPECT_FALSE(box.colour.has_value());
  EXPECT_EQ(screw.material.density_kg_m3, 8500.0);
  EXPECT_TRUE(screw.material.assumed);
  ASSERT_TRUE(screw.colour.has_value());
  EXPECT_NEAR((*screw.colour)[0], 0.73536, 1e-5);  // sRGB of one half, IEC 61966-2-1
  EXPECT_NEAR((*screw.colour)[2], 1.0, 1e-6);
  EXPECT_NEAR((*screw.colour)[3], 0.25, 1e-6);
}

TEST_F(GlbAssembly, ScaledAndMirroredUsesHaveBodiesOfTheirOwn) {
  // A tetrahedron of 1, 2 and 3 units: volume 1, centre at a quarter of the sum of its corners.
  TriangleMesh wedge;
  wedge.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  wedge.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  GlbProduct made("Pair");
  const int mesh = made.mesh(wedge);
  const int millimetres = made.node("mm", -1, Vec3::Zero(), 0, Quat::Identity(), Vec3::Constant(0.01));
  made.node("Right", mesh, {10, 0, 0}, millimetres);
  made.node("Left", mesh, {-10, 0, 0}, millimetres, Quat::Identity(), {-1, 1, 1});
  made.node("LeftToo", mesh, {-10, 0, 50}, millimetres, Quat::Identity(), {-1, 1, 1});
  made.write(file());
  const Product product = read_glb_assembly(file());
  EXPECT_EQ(product.bodies.size(), 2U);
  for (const Body& body : product.bodies) {
    EXPECT_TRUE(check_closed(body.mesh).ok());
    EXPECT_NEAR(body.exact.volume, 1e-6, 1e-12);
  }
  EXPECT_LT((centre(product, "Right") - Vec3(0.1025, 0.005, 0.0075)).norm(), 1e-8);
  EXPECT_LT((centre(product, "Left") - Vec3(-0.1025, 0.005, 0.0075)).norm(), 1e-8);
  EXPECT_LT((centre(product, "LeftToo") - Vec3(-0.1025, 0.005, 0.5075)).norm(), 1e-7);
  for (const Instance& one : product.instances) EXPECT_NEAR(one.X_WB.R.determinant(), 1.0, 1e-12);
}

TEST_F(GlbAssembly, AnOpenMeshIsReportedWithItsNode) {
  TriangleMesh open = box_body("box", {0.1, 0.1, 0.1}).mesh;
  open.triangles.pop_back();
  {
    GlbProduct made("Cell");
    const int mesh = made.mesh(open), frame = made.node("Frame", -1, Vec3::Zero());
    made.node("Cover", mesh, {0, 0, 0.5}, frame);
    made.node("Cover 2", mesh, {0, 0, 1.0}, frame);
    made.node("Base", made.mesh(box_body("b", {0.2, 0.2, 0.1}).mesh), Vec3::Zero());
    made.write(file());
  }
  const Product product = read_glb_assembly(file());
  ASSERT_EQ(product.instances.size(), 1U);
  EXPECT_EQ(product.instances[0].name, "Base");
  EXPECT_THAT(product.notes, ElementsAre(testing::AllOf(testing::StartsWith("Cell/Frame/Cover: "),
                                                        HasSubstr("bounds no solid"), HasSubstr("hole")),
                                         testing::StartsWith("Cell/Frame/Cover 2: ")));
  GlbProduct made("Cell");
  made.node("Cover", made.mesh(open), Vec3::Zero());
  made.write(file());
  try {
    read_glb_assembly(file());
    ADD_FAILURE() << "an open mesh passed for a product";
  } catch (const MeshError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("cell.glb: "), HasSubstr("Cell/Cover: "),
                                             HasSubstr("closed meshes")));
  }
  EXPECT_THROW(read_glb_assembly(directory_ / "none.glb"), MeshError);
}

/// A prism over a polygon around the origin (counter-clockwise, convex).
TriangleMesh prism(const std::vector<Eigen::Vector2d>& polygon, double height) {
  TriangleMesh mesh;
  const auto n = static_cast<std::uint32_t>(polygon.size());
  for (const double z : {0.0, height})
    for (const auto& p : polygon) mesh.vertices.emplace_back(p.x(), p.y(), z);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    if (i == 0 || j == 0) continue;
    mesh.triangles.push_back({0, j, i});
    mesh.triangles.push_back({n, n + i, n + j});
  }
  return mesh;
}

/// Points of an arc around a centre.
void arc(std::vector<Eigen::Vector2d>& polygon, double x, double radius, double from, double to, int chords) {
  for (int k = 0; k <= chords; ++k) {
    const double angle = from + (to - from) * k / chords;
    polygon.emplace_back(x + radius * std::cos(angle), radius * std::sin(angle));
  }
}

std::map<SurfaceKind, int> kinds(TriangleMesh mesh, Body& body) {
  body.mesh = std::move(mesh);
  EXPECT_TRUE(check_closed(body.mesh).ok());
  find_faces(body);
  std::map<SurfaceKind, int> count;
  for (const Face& face : body.faces) ++count[face.kind];
  return count;
}

TEST(MeshFaces, FlatsBesideArcsArePlanes) {
  std::vector<Eigen::Vector2d> slot;
  arc(slot, 0.02, 0.01, -M_PI / 2, M_PI / 2, 12);
  arc(slot, -0.02, 0.01, M_PI / 2, 3 * M_PI / 2, 12);
  Body body;
  const auto found = kinds(prism(slot, 0.03), body);
  EXPECT_EQ(found, (std::map<SurfaceKind, int>{{SurfaceKind::plane, 4}, {SurfaceKind::cylinder, 2}}));
  double planes = 0.0;
  for (const Face& face : body.faces) {
    if (face.kind == SurfaceKind::plane) {
      planes += face.area_m2;
      continue;
    }
    EXPECT_NEAR(face.radius_m, 0.01, 1e-9);
    EXPECT_FALSE(face.concave);
    EXPECT_LT(face.axis_B.cross(Vec3::UnitZ()).norm(), 1e-9);
    EXPECT_NEAR(std::abs(face.point_B.x()), 0.02, 1e-9);
  }
  // Twice 40 mm by 30 mm, and both ends: a rectangle and a polygon of 24 sides.
  EXPECT_NEAR(planes, 2 * 0.04 * 0.03 + 2 * (0.04 * 0.02 + 12 * 1e-4 * std::sin(M_PI / 12)), 1e-9);
  EXPECT_NEAR(body.deflection_m, 0.01 * (1.0 - std::cos(M_PI / 24)), 1e-6);
}

TEST(MeshFaces, PrismsOfFewSidesArePlanes) {
  for (const int sides : {3, 4, 6, 8}) {
    std::vector<Eigen::Vector2d> polygon;
    arc(polygon, 0.0, 0.01, 0.0, 2.0 * M_PI * (sides - 1) / sides, sides - 1);
    Body body;
    EXPECT_EQ(kinds(prism(polygon, 0.01), body),
              (std::map<SurfaceKind, int>{{SurfaceKind::plane, sides + 2}}))
        << sides;
    EXPECT_EQ(body.deflection_m, 0.0);
  }
}

TEST(MeshFaces, RoundSurfacesOfOtherKindsAreOneFaceEach) {
  // A ball and a frustum of a cone, by rings of 40.
  const auto lathe = [](const std::vector<std::pair<double, double>>& profile) {
    TriangleMesh mesh;
    constexpr std::uint32_t kSides = 40;
    for (const auto& [r, z] : profile)
      for (std::uint32_t i = 0; i < kSides; ++i)
        mesh.vertices.emplace_back(r * std::cos(2 * M_PI * i / kSides), r * std::sin(2 * M_PI * i / kSides),
                                   z);
    const auto rings = static_cast<std::uint32_t>(profile.size());
    for (std::uint32_t k = 0; k + 1 < rings; ++k)
      for (std::uint32_t i = 0; i < kSides; ++i) {
        const std::uint32_t a = k * kSides + i, b = k * kSides + (i + 1) % kSides;
        mesh.triangles.push_back({a, b, b + kSides});
        mesh.triangles.push_back({a, b + kSides, a + kSides});
      }
    for (std::uint32_t i = 1; i + 1 < kSides; ++i) {
      mesh.triangles.push_back({0, i + 1, i});
      const std::uint32_t top = (rings - 1) * kSides;
      mesh.triangles.push_back({top, top + i, top + i + 1});
    }
    return mesh;
  };
  Body body;
  EXPECT_EQ(kinds(lathe({{0.01, 0.0}, {0.005, 0.02}}), body),
            (std::map<SurfaceKind, int>{{SurfaceKind::plane, 2}, {SurfaceKind::other, 1}}));
  std::vector<std::pair<double, double>> ball;
  for (int k = 1; k < 20; ++k)
    ball.emplace_back(0.01 * std::sin(M_PI * k / 20), -0.01 * std::cos(M_PI * k / 20));
  // The flat caps of the ball are small, and of many triangles.
  EXPECT_EQ(kinds(lathe(ball), body)[SurfaceKind::other], 1);
}

TEST_F(GlbAssembly, ContactsOrderAndHierarchyAreThoseOfTheKnownFaces) {
  for (const double turn : {0.0, 0.7}) {
    Product known = product_of({{plate_with_hole("Base", 0.10, 0.02, 0.00505), {0, 0, 0.03}},
                                {plate_with_hole("Lid", 0.06, 0.01, 0.00505), {0, 0, 0.045}},
                                {turned_body("Bolt", {-0.05, 0.0, 0.006}, {0.005, 0.0085}), {0, 0, 0.05}},
                                {plate_with_hole("Nut", 0.017, 0.008, 0.005), {0, 0, 0.016}},
                                {box_body("Block", {0.01, 0.02, 0.01}), {0.04, 0.01, 0.045}}});
    GlbProduct made("product");
    const Quat q(Eigen::AngleAxisd(turn, Vec3(1, 2, 3).normalized()));
    const int frame = made.node("Frame", -1, {0.3, 0.2, 0.1}, 0, q);
    for (const Instance& one : known.instances)
      made.node(one.name, made.mesh(known.bodies[one.body].mesh), one.X_WB.p, frame);
    made.write(file());
    for (Instance& one : known.instances)
      one.X_WB = Pose{q.toRotationMatrix(), Vec3(0.3, 0.2, 0.1)} * one.X_WB;
    Product read = read_glb_assembly(file());
    known.contacts = find_contacts(known), read.contacts = find_contacts(read);
    ASSERT_EQ(read.contacts.size(), known.contacts.size()) << turn;
    for (std::size_t i = 0; i < known.contacts.size(); ++i) {
      const Contact &a = known.contacts[i], &b = read.contacts[i];
      EXPECT_EQ(a.first, b.first);
      EXPECT_EQ(a.second, b.second);
      EXPECT_EQ(a.kind, b.kind);
      EXPECT_NEAR(a.clearance_m, b.clearance_m, 1e-7);
      EXPECT_NEAR(a.area_m2, b.area_m2, 0.03 * a.area_m2);
      EXPECT_LT(a.axis_W.cross(b.axis_W).norm(), 1e-4);
      EXPECT_EQ(a.pitch_m, b.pitch_m);
    }
    const Disassembly plan = take_apart(known), other = take_apart(read);
    EXPECT_EQ(plan.base, other.base);
    EXPECT_EQ(plan.order, other.order) << turn;
    ASSERT_EQ(plan.steps.size(), other.steps.size());
    for (std::size_t k = 0; k < plan.steps.size(); ++k)
      EXPECT_LT((plan.steps[k].direction_W - other.steps[k].direction_W).norm(), 1e-4);
    EXPECT_EQ(hierarchy(known, plan).numbers, hierarchy(read, other).numbers);
  }
}

}  // namespace
}  // namespace takt::product
