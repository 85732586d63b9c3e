// Contact elements on a grid over flat patches: the area and its moments of the mesh, forces in closed form, and no
// dependence on the triangulation.
#include "server/geometry/surface/resampling.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <vector>

#include "config/meshes/generator/screw_meshes.h"
#include "tests/support/contact_pairs.h"
#include "tests/support/hollow_bodies.h"
#include "tests/support/solid_mesh.h"

namespace takt::test {
namespace {

std::shared_ptr<const ContactSurface> sampled(const TriangleMesh& mesh, double edge_m,
                                              ContactResampling resampling = ContactResampling::always) {
  return std::make_shared<const ContactSurface>(mesh, ContactSurfaceOptions{edge_m, resampling});
}

/// A box whose faces are fans of needles: its edges have n pieces, and each face runs from there to its middle.
TriangleMesh needle_box(const Vec3& size, int n) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  const auto vertex = [&](const std::array<int, 3>& p) {
    const auto [entry, is_new] = numbers.try_emplace(p, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) mesh.vertices.emplace_back(Vec3(p[0], p[1], p[2]).cwiseProduct(size) / n - 0.5 * size);
    return entry->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, n}) {
      std::vector<std::uint32_t> rim;
      const auto at = [&](int u, int v) {
        std::array<int, 3> p{};
        p[axis] = side, p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
        rim.push_back(vertex(p));
      };
      for (int i = 0; i < n; ++i) at(i, 0);
      for (int i = 0; i < n; ++i) at(n, i);
      for (int i = n; i > 0; --i) at(i, n);
      for (int i = n; i > 0; --i) at(0, i);
      Vec3 middle = Vec3::Zero();
      middle[static_cast<Eigen::Index>(axis)] =
          (side == 0 ? -0.5 : 0.5) * size[static_cast<Eigen::Index>(axis)];
      const auto centre = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(middle);
      for (std::size_t i = 0; i < rim.size(); ++i) {
        const std::uint32_t a = rim[i], b = rim[(i + 1) % rim.size()];
        if (side == 0)
          mesh.triangles.push_back({centre, b, a});
        else
          mesh.triangles.push_back({centre, a, b});
      }
    }
  return mesh;
}

/// The same surface with each triangle divided towards its centre, again and again: ever more slender.
TriangleMesh with_needles(TriangleMesh mesh, int times) {
  for (int time = 0; time < times; ++time) {
    std::vector<TriangleMesh::Triangle> divided;
    for (const auto& t : mesh.triangles) {
      const auto centre = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0);
      for (std::size_t k = 0; k < 3; ++k) divided.push_back({t[k], t[(k + 1) % 3], centre});
    }
    mesh.triangles = std::move(divided);
  }
  return mesh;
}

TriangleMesh turned(TriangleMesh mesh) {
  return moved(std::move(mesh),
               {Mat3(Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, 3.0).normalized())), Vec3(0.3, -0.2, 0.1)});
}

/// Per flat region: area and first moment of the faces and of the samples, and where the samples lie.
void expect_moments_of_regions(const TriangleMesh& mesh, double edge_m) {
  const auto s = sampled(mesh, edge_m);
  const auto& data = s->data();
  const double size = data.radius_m;
  const FlatRegions flat = find_flat_regions(data);
  std::vector<double> area(flat.regions.size(), 0.0), sampled_area = area;
  std::vector<Vec3> moment(flat.regions.size(), Vec3::Zero()), sampled_moment = moment;
  for (std::size_t f = 0; f < data.faces.size(); ++f) {
    const auto c = data.corners(data.faces[f]);
    const double a = 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
    area[static_cast<std::size_t>(flat.of_face[f])] += a;
    moment[static_cast<std::size_t>(flat.of_face[f])] += a / 3.0 * (c[0] + c[1] + c[2]);
  }
  for (std::size_t e = 0; e < data.element_count(); ++e) {
    const auto region = static_cast<std::size_t>(flat.of_face[data.triangle[e]]);
    sampled_area[region] += data.area_m2[e];
    sampled_moment[region] += data.area_m2[e] * data.point(e);
    EXPECT_LT(std::sqrt(data.closest_on_face(data.faces[data.triangle[e]], data.point(e)).squared_m2),
              1e-14 * size);
    EXPECT_LT(data.area_m2[e], 0.25 * edge_m * edge_m * (1.0 + 1e-3));
    double shown = 0.0;
    for (const TriangleCorners& c : element_triangles_B(*s, e))
      shown += 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).dot(data.normal(e));
    EXPECT_GT(shown, data.area_m2[e] - 1e-7 * edge_m * edge_m);
  }
  for (std::size_t r = 0; r < area.size(); ++r) {
    EXPECT_NEAR(sampled_area[r], area[r], 1e-10 * area[r]);
    EXPECT_LT((sampled_moment[r] - moment[r]).norm(), 1e-8 * area[r] * size);
  }
  EXPECT_EQ(s->resampling().elements, s->element_count());
}

TEST(ContactResamplingOracle, AreaAndFirstMomentOfEachFlatRegionAreThoseOfTheMesh) {
  expect_moments_of_regions(lattice_box({0.04, 0.03, 0.02}, std::array<int, 3>{1, 1, 1}), 0.0031);
  expect_moments_of_regions(turned(needle_box({0.04, 0.03, 0.02}, 25)), 0.0031);
  expect_moments_of_regions(turned(u_shape()), 0.07);  // cells reach from one leg to the other
  expect_moments_of_regions(ball(0.02, 2), 0.004);
  expect_moments_of_regions(mesh_of(meshes::make_gear("gear", 17, {})), 0.004);
  expect_moments_of_regions(mesh_of(meshes::make_nut(meshes::iso_metric(16))), 0.004);
}

/// As an STL file states it.
TriangleMesh in_single_precision(TriangleMesh mesh) {
  for (Vec3& v : mesh.vertices) v = v.cast<float>().cast<double>();
  return mesh;
}

TEST(ContactResamplingOracle, FlatFacesInSinglePrecisionAreFlatRegions) {
  // Each of the six faces is one region, though its needles' own planes differ.
  for (const int n : {1, 60, 150}) {
    const auto s = sampled(in_single_precision(turned(needle_box({0.04, 0.03, 0.02}, n))), 0.004);
    EXPECT_EQ(find_flat_regions(s->data()).regions.size(), 6U);
    EXPECT_EQ(s->element_count(), sampled(needle_box({0.04, 0.03, 0.02}, n), 0.004)->element_count());
  }
  // Facets of a round body stay apart.
  const auto s = sampled(in_single_precision(turned(ball(0.02, 4))), 0.004);
  EXPECT_EQ(find_flat_regions(s->data()).regions.size(), s->face_count());
}

TEST(ContactResamplingOracle, ElementsDoNotDependOnTheTriangulation) {
  for (const TriangleMesh& mesh : {lattice_box({0.04, 0.03, 0.02}, std::array<int, 3>{3, 2, 1}), u_shape()}) {
    const auto good = sampled(mesh, 0.011), needles = sampled(with_needles(mesh, 3), 0.011);
    ASSERT_EQ(good->element_count(), needles->element_count());
    // Each element of one has its like in the other.
    for (std::size_t e = 0; e < good->element_count(); ++e) {
      double nearest = INFINITY, area = 0.0;
      for (std::size_t i = 0; i < needles->element_count(); ++i) {
        const double d = (needles->data().point(i) - good->data().point(e)).norm();
        if (d < nearest) nearest = d, area = needles->data().area_m2[i];
      }
      EXPECT_LT(nearest, 1e-12);
      EXPECT_NEAR(area, good->data().area_m2[e], 1e-15);
    }
  }
}

TEST(ContactResamplingOracle, AFlatPressIsTheClosedForm) {
  // p = (K/b) u on all of the face; tilted by a small angle about y, the moment is (K/b) angle I.
  const Vec3 size(0.04, 0.03, 0.02);
  const ContactLaw law = frictionless_law();
  const auto floor = surface(floor_mesh());
  const double u = 1e-5, angle = 2e-4, edge_m = 0.004;
  const double area = size.x() * size.y(), inertia = size.y() * std::pow(size.x(), 3) / 12.0;
  const Mat3 tilt = Eigen::AngleAxisd(angle, Vec3::UnitY()).toRotationMatrix();
  const auto moment_error = [&](const TriangleMesh& mesh, ContactResampling resampling) {
    PolygonalContact contact(sampled(mesh, edge_m, resampling), floor, law);
    const Vec3 p(0.0, 0.0, 0.5 * size.z() - u);
    EXPECT_NEAR(evaluate(contact, at_rest(p)).normal_force_N, law.stiffness_Pa_per_m * u * area,
                1e-9 * law.stiffness_Pa_per_m * u * area);
    const Wrench F =
        evaluate(contact, at_rest(tilt * Vec3(0.0, 0.0, 0.5 * size.z()) - Vec3(0.0, 0.0, u), tilt)).F_B_T;
    return std::abs(-F.t.y() / (law.stiffness_Pa_per_m * angle * inertia) - 1.0);
  };
  const TriangleMesh good = lattice_box(size, std::array<int, 3>{1, 1, 1}), needles = needle_box(size, 60);
  // Cells of 2 mm leave out (2/40)^2 of the second moment; the divided good mesh is as dense.
  const double bound = 1.2 * std::pow(0.5 * edge_m / size.x(), 2);
  EXPECT_LT(moment_error(needles, ContactResampling::always), bound);
  EXPECT_LT(moment_error(good, ContactResampling::always), bound);
  EXPECT_LT(moment_error(good, ContactResampling::never), 2.0 * bound);
  // The same number as for the good mesh, where the needles took twenty times as many.
  EXPECT_EQ(sampled(needles, edge_m)->element_count(), sampled(good, edge_m)->element_count());
  EXPECT_GT(sampled(needles, edge_m, ContactResampling::never)->element_count(),
            5 * sampled(needles, edge_m)->element_count());
}

TEST(ContactResamplingOracle, ABallPressedIntoAPlateHasTheForceOfItsDepths) {
  // Depths R - |x| over the disc in which the plane of the plate cuts the ball, at the height h below its centre:
  // pi R a^2 - 2/3 pi (R^3 - h^3). The facets of the ball lie up to 2 % of the depth inside of it.
  const double radius = 0.02, u = 1e-3, height = radius - u;
  const ContactLaw law = frictionless_law();
  const auto target = surface(ball(radius, 5));
  const double exact = law.stiffness_Pa_per_m * std::numbers::pi *
                       (radius * (radius * radius - height * height) -
                        2.0 / 3.0 * (std::pow(radius, 3) - std::pow(height, 3)));
  std::vector<double> forces;
  for (const TriangleMesh& plate :
       {lattice_box({0.04, 0.03, 0.01}, std::array<int, 3>{8, 6, 2}), needle_box({0.04, 0.03, 0.01}, 60)}) {
    PolygonalContact contact(sampled(plate, 0.0008), target, law);
    forces.push_back(evaluate(contact, at_rest({0.0003, 0.0004, -height - 0.005})).normal_force_N);
    EXPECT_NEAR(forces.back(), exact, 0.03 * exact);
  }
  EXPECT_NEAR(forces[0], forces[1], 1e-6 * exact);
}

TEST(ContactResamplingOracle, ANutAndAGearWithNeedlesPressAsThoseWithGoodTriangles) {
  const ContactLaw law = frictionless_law();
  const auto floor = surface(floor_mesh());
  const Mat3 tilt = Eigen::AngleAxisd(2e-4, Vec3(1.0, 0.4, 0.0).normalized()).toRotationMatrix();
  for (const TriangleMesh& mesh :
       {mesh_of(meshes::make_nut(meshes::iso_metric(16))), mesh_of(meshes::make_gear("gear", 17, {}))}) {
    PolygonalContact good(sampled(mesh, 0.003), floor, law),
        needles(sampled(with_needles(mesh, 2), 0.003), floor, law);
    const RelativeMotion motion = at_rest({0.0, 0.0, -1e-6}, tilt);
    const Wrench a = evaluate(good, motion).F_B_T, b = evaluate(needles, motion).F_B_T;
    EXPECT_GT(a.f.z(), 0.0);
    EXPECT_LT((a.f - b.f).norm(), 1e-6 * a.f.norm());
    EXPECT_LT((a.t - b.t).norm(), 1e-6 * a.f.norm() * 0.02);
  }
}

TEST(ContactResamplingOracle, ADiscOfNeedlesHasForceStiffnessAndFrictionInClosedForm) {
  // Under the pressure p = (K/b) u a disc slides with mu p A and spins with mu p 2/3 pi R^3; tilted by a small angle it
  // has the moment (K/b) angle pi R^4 / 4.
  const double radius = 0.01, height = 0.02, u = 1e-5, omega = 200.0, angle = 2e-4;
  ContactParameters parameters;
  parameters.friction = 0.25;
  parameters.areal_damping_N_s_per_m3 = 0.0;
  const ContactLaw law = contact_law(parameters);
  const auto floor = surface(floor_mesh());
  const Vec3 place(0.0, 0.0, 0.5 * height - u);
  const double pressure = law.stiffness_Pa_per_m * u, area = std::numbers::pi * radius * radius;
  constexpr std::uint32_t kSides = 200;
  const double round =
      1.5 * std::pow(std::numbers::pi / kSides, 2);  // area and moments of the polygon, and more
  std::vector<Wrench> spins;
  for (const bool of_needles : {false, true}) {
    const auto disc = sampled(prism(radius, height, kSides, of_needles), 0.002);
    EXPECT_LT(disc->resampling().slender_share, of_needles ? disc->resampling().slender_share_before : 1.0);
    PolygonalContact contact(disc, floor, law);
    RelativeMotion motion = at_rest(place);
    EXPECT_NEAR(evaluate(contact, motion).normal_force_N, pressure * area, round * pressure * area);
    motion.V_TB_T.v = Vec3(0.6, -0.8, 0.0);
    const Vec3 sliding = evaluate(contact, motion).F_B_T.f;
    EXPECT_NEAR(sliding.x(), -0.6 * law.friction * pressure * area, 2.0 * round * pressure * area);
    EXPECT_NEAR(sliding.y(), 0.8 * law.friction * pressure * area, 2.0 * round * pressure * area);
    motion.V_TB_T = {};
    motion.V_TB_T.w = Vec3(0.0, 0.0, omega);
    spins.push_back(evaluate(contact, motion).F_B_T);
    const double torque = law.friction * pressure * 2.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
    EXPECT_NEAR(spins.back().t.z(), -torque, 5e-3 * torque);
    const Mat3 tilt = Eigen::AngleAxisd(angle, Vec3::UnitY()).toRotationMatrix();
    const Wrench tilted =
        evaluate(contact, at_rest(tilt * Vec3(0.0, 0.0, 0.5 * height) - Vec3(0.0, 0.0, u), tilt)).F_B_T;
    const double moment = law.stiffness_Pa_per_m * angle * 0.25 * std::numbers::pi * std::pow(radius, 4);
    EXPECT_NEAR(-tilted.t.y(), moment, 0.02 * moment);
  }
  EXPECT_NEAR(spins[0].t.z(), spins[1].t.z(), 2e-3 * std::abs(spins[0].t.z()));
}

TEST(ContactResamplingOracle, ANutWithNeedlesTurnsOnItsBoltUnderTheSameForces) {
  meshes::ScrewParameters p = meshes::iso_metric(16);
  p.contact_edge *= 4.0;
  p.bolt_columns = p.nut_columns = 24;
  ContactParameters parameters;
  parameters.friction = 0.2;
  const ContactLaw law = contact_law(parameters);
  const auto bolt = surface(mesh_of(meshes::make_bolt(p)));
  const TriangleMesh nut = mesh_of(meshes::make_nut(p));
  PolygonalContact good(sampled(nut, 0.002), bolt, law),
      needles(sampled(with_needles(nut, 2), 0.002), bolt, law);
  const double start_m = 3.0 * p.pitch - p.clearance * std::tan(std::numbers::pi / 6.0) - 1e-5;
  double largest = 0.0;
  for (int i = 0; i < 12; ++i) {
    const double angle = -0.05 * i;
    RelativeMotion motion = at_rest({0.0, 0.0, start_m + p.pitch * angle / (2.0 * std::numbers::pi)},
                                    Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix());
    motion.V_TB_T.w = Vec3(0.0, 0.0, -5.0);
    const Wrench a = evaluate(good, motion).F_B_T, b = evaluate(needles, motion).F_B_T;
    largest = std::max(largest, a.f.norm());
    EXPECT_LT((a.f - b.f).norm(), 1e-6 * a.f.norm());
    EXPECT_LT((a.t - b.t).norm(), 1e-6 * a.f.norm() * p.pitch);
  }
  EXPECT_GT(largest, 0.1);
}

TEST(ContactResamplingOracle, TheAutomaticChoiceFollowsTheNeedles) {
  const auto chosen = [](const TriangleMesh& mesh, double edge_m) {
    return sampled(mesh, edge_m, ContactResampling::automatic)->resampling();
  };
  const Vec3 size(0.04, 0.03, 0.02);
  const ResamplingReport needles = chosen(needle_box(size, 60), 0.01);
  // At least 240 on each face.
  EXPECT_LE(needles.spacing_m, std::sqrt(size.x() * size.y() / 240.0));
  EXPECT_GT(needles.slender_share_before, 0.5);
  EXPECT_LT(needles.slender_share, 0.01);
  EXPECT_GE(needles.elements, needles.elements_before);
  EXPECT_LT(needles.elements, 1.3 * static_cast<double>(needles.elements_before));
  EXPECT_EQ(chosen(lattice_box(size, std::array<int, 3>{1, 1, 1}), 0.004).spacing_m, 0.0);
  // Strips that are narrow themselves stay as slender in cells: nothing is gained.
  EXPECT_EQ(chosen(lattice_box({0.1, 0.1, 0.0005}, std::array<int, 3>{1, 1, 1}), 0.02).spacing_m, 0.0);
  // The triangles of the mesh are asked for.
  EXPECT_EQ(chosen(needle_box(size, 60), 0.0).spacing_m, 0.0);
}

/// A box whose faces of needles are beside faces of good triangles: the lid of `needle_box` alone has needles.
TriangleMesh box_with_a_needle_lid(const Vec3& size, int n) {
  TriangleMesh mesh = needle_box(size, n);
  TriangleMesh result;
  result.vertices = mesh.vertices;
  const double top = 0.5 * size.z();
  std::map<std::array<int, 3>, std::uint32_t> rim;
  for (const auto& t : mesh.triangles) {
    const auto height = [&](std::uint32_t v) { return mesh.vertices[v].z(); };
    if (height(t[0]) == top && height(t[1]) == top && height(t[2]) == top) result.triangles.push_back(t);
  }
  // Sides and bottom as triangles of the lattice of the rim, square by square.
  const auto grid = [&](std::size_t axis, int side) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto vertex = [&](int i, int k) {
      std::array<int, 3> p{};
      p[axis] = side, p[u] = i, p[v] = k;
      const Vec3 x = Vec3(p[0], p[1], p[2]).cwiseProduct(size) / n - 0.5 * size;
      for (std::uint32_t known = 0; known < mesh.vertices.size(); ++known)
        if (mesh.vertices[known] == x) return known;
      const auto [entry, is_new] = rim.try_emplace(p, static_cast<std::uint32_t>(result.vertices.size()));
      if (is_new) result.vertices.push_back(x);
      return entry->second;
    };
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) {
        const std::array<std::uint32_t, 4> c{vertex(i, k), vertex(i + 1, k), vertex(i + 1, k + 1),
                                             vertex(i, k + 1)};
        if (side == 0) {
          result.triangles.push_back({c[0], c[2], c[1]});
          result.triangles.push_back({c[0], c[3], c[2]});
        } else {
          result.triangles.push_back({c[0], c[1], c[2]});
          result.triangles.push_back({c[0], c[2], c[3]});
        }
      }
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, n})
      if (axis != 2 || side == 0) grid(axis, side);
  return result;
}

TEST(ContactResamplingOracle, OnlyFacesOfNeedlesAreReplacedAndKeepTheirResolution) {
  const Vec3 size(0.04, 0.03, 0.02);
  constexpr int kPieces = 25;
  const TriangleMesh mesh = box_with_a_needle_lid(size, kPieces);
  const double edge_m = default_element_edge_m(mesh);
  const auto before = sampled(mesh, edge_m, ContactResampling::never),
             after = sampled(mesh, edge_m, ContactResampling::automatic);
  const auto on_lid = [&](const ContactSurface& s) {
    std::size_t count = 0;
    for (std::size_t e = 0; e < s.element_count(); ++e) count += s.data().nz[e] > 0.5 ? 1 : 0;
    return count;
  };
  EXPECT_GT(after->resampling().slender_share_before, 0.1);
  EXPECT_LT(after->resampling().slender_share, 1e-3);
  EXPECT_GE(on_lid(*after), on_lid(*before));
  EXPECT_EQ(after->resampling().elements, after->element_count());
  EXPECT_EQ(after->resampling().elements_before, before->element_count());
  // The others are the elements of before, and shown as such.
  std::set<std::array<double, 3>> known;
  for (std::size_t e = 0; e < before->element_count(); ++e)
    known.insert({before->data().px[e], before->data().py[e], before->data().pz[e]});
  std::size_t same = 0;
  for (std::size_t e = 0; e < after->element_count(); ++e) {
    if (after->data().nz[e] > 0.5) continue;
    same += known.count({after->data().px[e], after->data().py[e], after->data().pz[e]});
    double shown = 0.0;
    for (const TriangleCorners& c : element_triangles_B(*after, e))
      shown += 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).dot(after->data().normal(e));
    EXPECT_NEAR(shown, after->data().area_m2[e], 1e-6 * after->data().area_m2[e]);
  }
  EXPECT_EQ(same, before->element_count() - on_lid(*before));
  EXPECT_EQ(same, after->element_count() - on_lid(*after));
}

TEST(ContactResamplingOracle, TheAutomaticChoiceIsNoWorseThanTheNeedles) {
  // Moments of a tilted press about both axes against the closed form (K/b) angle I, for fans of any fineness.
  const Vec3 size(0.04, 0.03, 0.02);
  const ContactLaw law = frictionless_law();
  const auto floor = surface(floor_mesh());
  const double u = 1e-5, angle = 2e-4;
  for (const int n : {12, 25, 60, 150}) {
    const TriangleMesh mesh = needle_box(size, n);
    const auto worst = [&](ContactResampling resampling) {
      PolygonalContact contact(sampled(mesh, default_element_edge_m(mesh), resampling), floor, law);
      double error = 0.0;
      for (const int axis : {0, 1}) {
        const Mat3 tilt = Eigen::AngleAxisd(angle, Vec3::Unit(axis)).toRotationMatrix();
        const Vec3 place = tilt * Vec3(0.0, 0.0, 0.5 * size.z()) - Vec3(0.0, 0.0, u);
        const double moment =
            law.stiffness_Pa_per_m * angle * size[axis] * std::pow(size[1 - axis], 3) / 12.0;
        const double found = std::abs(evaluate(contact, at_rest(place, tilt)).F_B_T.t[axis]);
        error = std::max(error, std::abs(found / moment - 1.0));
      }
      return error;
    };
    const double never = worst(ContactResampling::never), automatic = worst(ContactResampling::automatic);
    EXPECT_LE(automatic, never) << n;
    EXPECT_LT(automatic, 0.02) << n;
  }
}

TEST(ContactResamplingOracle, FlatsOfFarTooManyTrianglesAreDividedByTheirShape) {
  const ContactLaw law = frictionless_law();
  const auto automatic = [](const TriangleMesh& mesh) {
    return sampled(mesh, default_element_edge_m(mesh), ContactResampling::automatic);
  };
  // 7200 triangles on each face. The moment of a tilted press is (K/b) angle I, of which n cells across leave out 1/n^2.
  const Vec3 size(0.04, 0.03, 0.02);
  const auto dense = automatic(lattice_box(size, std::array<int, 3>{60, 60, 60}));
  EXPECT_EQ(dense->resampling().elements, dense->element_count());
  EXPECT_LT(8 * dense->resampling().elements, 2 * dense->resampling().elements_before);
  EXPECT_GE(dense->element_count(), 6U * 32U * 32U);
  PolygonalContact contact(dense, surface(floor_mesh()), law);
  const double u = 1e-5, angle = 2e-4;
  for (const int axis : {0, 1}) {
    const Mat3 tilt = Eigen::AngleAxisd(angle, Vec3::Unit(axis)).toRotationMatrix();
    const Wrench F =
        evaluate(contact, at_rest(tilt * Vec3(0.0, 0.0, 0.5 * size.z()) - Vec3(0.0, 0.0, u), tilt)).F_B_T;
    const double force = law.stiffness_Pa_per_m * u * size.x() * size.y();
    const double moment = law.stiffness_Pa_per_m * angle * size[axis] * std::pow(size[1 - axis], 3) / 12.0;
    EXPECT_NEAR(F.f.z(), force, 1e-6 * force);
    EXPECT_NEAR(std::abs(F.t[axis]), moment, 1.2 * moment / (28.0 * 28.0));
  }
  // Where the contact is a small part of the face: a ball whose radius there is a sixth of it.
  const double radius = 0.02, deep = 1e-3, height = radius - deep;
  PolygonalContact pressed(dense, surface(ball(radius, 5)), law);
  const double exact = law.stiffness_Pa_per_m * std::numbers::pi *
                       (radius * (radius * radius - height * height) -
                        2.0 / 3.0 * (std::pow(radius, 3) - std::pow(height, 3)));
  EXPECT_NEAR(evaluate(pressed, at_rest({0.0003, 0.0004, -height - 0.5 * size.z()})).normal_force_N, exact,
              0.03 * exact);
  // Not too many; a strip that needs them; the triangles of the mesh.
  EXPECT_EQ(automatic(lattice_box(size, std::array<int, 3>{40, 40, 40}))->resampling().spacing_m, 0.0);
  EXPECT_EQ(
      automatic(lattice_box({0.1, 0.002, 0.002}, std::array<int, 3>{400, 8, 8}))->resampling().spacing_m,
      0.0);
  EXPECT_EQ(sampled(lattice_box(size, std::array<int, 3>{60, 60, 60}), 0.0, ContactResampling::automatic)
                ->resampling()
                .spacing_m,
            0.0);
}

TEST(ContactResamplingOracle, SlendernessIsTheRatioOfRadiiOfInertia) {
  const double h = std::sqrt(0.75);
  EXPECT_NEAR(slenderness({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0.5, h, 0)}), 1.0, 1e-9);
  EXPECT_NEAR(slenderness({Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1, 1)}), std::sqrt(3.0), 1e-12);
  // An isosceles one of height L on the base b: sqrt(L^2/18) to sqrt(b^2/24).
  EXPECT_NEAR(slenderness({Vec3(0, -0.5, 0), Vec3(0, 0.5, 0), Vec3(20, 0, 0)}), 20.0 * std::sqrt(24.0 / 18.0),
              1e-9);
  EXPECT_EQ(slenderness({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0)}), INFINITY);
}

}  // namespace
}  // namespace takt::test
