// The contact graph against figures by hand, and against distances of the meshes alone.
#include "server/product/contacts.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "server/product/cell_writer.h"
#include "tests/support/product_bodies.h"

namespace takt::product {
namespace {

using test::box_body;
using test::plate_with_hole;
using test::product_of;
using test::turned_body;

const Contact* find(const Product& product, const std::string& a, const std::string& b, ContactKind kind) {
  for (const Contact& contact : product.contacts) {
    const std::string &first = product.instances[contact.first].name,
                      &second = product.instances[contact.second].name;
    if (contact.kind == kind && ((first == a && second == b) || (first == b && second == a))) return &contact;
  }
  return nullptr;
}

TEST(Contacts, TestBodiesAreClosed) {
  for (const Body& body : {box_body("b", {1, 2, 3}), plate_with_hole("p", 0.1, 0.02, 0.02),
                           turned_body("t", {0, 0.01, 0.05, 0.06}, {0.02, 0.01, 0.015})})
    EXPECT_EQ(check_closed(body.mesh).problem, "") << body.name;
}

TEST(Contacts, BoxesOnEachOtherShareTheSmallerFace) {
  Product product = product_of({{box_body("Base", {0.2, 0.1, 0.02}), {0, 0, 0.01}},
                                {box_body("Block", {0.05, 0.04, 0.03}), {0.09, 0, 0.035}},
                                {box_body("Far", {0.05, 0.04, 0.03}), {-0.05, 0, 0.0355}}});
  product.contacts = find_contacts(product);
  ASSERT_EQ(product.contacts.size(), 1U);  // Far stands 0.5 mm above
  const Contact& contact = product.contacts[0];
  EXPECT_EQ(contact.kind, ContactKind::plane);
  EXPECT_NEAR(contact.area_m2, 0.035 * 0.04, 1e-12);  // 15 mm of the block hang over
  EXPECT_LT((contact.point_W - Vec3(0.0825, 0.0, 0.02)).norm(), 1e-9);
  EXPECT_LT((contact.normals_W.at(0) - Vec3::UnitZ()).norm(), 1e-12);
}

TEST(Contacts, FitsHaveTheirClearance) {
  for (const double clearance : {20e-6, 0.0, -12e-6}) {
    Product product = product_of({{plate_with_hole("Plate", 0.06, 0.01, 0.008 + clearance), {0, 0, 0}},
                                  {turned_body("Peg", {0.0, 0.03}, {0.008}), {0, 0, -0.005}}});
    product.contacts = find_contacts(product);
    ASSERT_EQ(product.contacts.size(), 1U);
    const Contact& contact = product.contacts[0];
    EXPECT_EQ(contact.kind, ContactKind::cylinder_fit);
    EXPECT_NEAR(contact.clearance_m, clearance, 1e-12);
    EXPECT_NEAR(contact.area_m2, 2.0 * M_PI * 0.008 * 0.01, 0.02 * 2.0 * M_PI * 0.008 * 0.01);
    EXPECT_LT(contact.axis_W.cross(Vec3::UnitZ()).norm(), 1e-12);
    const LevelAdvice advice = level_advice(product).at(0);
    EXPECT_EQ(advice.level, clearance < 0.0 ? 3 : 1) << clearance;
  }
  Product loose = product_of({{plate_with_hole("Plate", 0.06, 0.01, 0.0085), {0, 0, 0}},
                              {turned_body("Peg", {0.0, 0.03}, {0.008}), {0, 0, -0.005}}});
  EXPECT_TRUE(find_contacts(loose).empty());  // 0.5 mm of play is no fit
}

TEST(Contacts, NamesOfFastenersMakeACosmeticThread) {
  const auto kinds = [](const std::string& shaft, const std::string& plate, double difference) {
    Product product = product_of({{plate_with_hole(plate, 0.017, 0.0084, 0.005 - difference), {0, 0, 0.02}},
                                  {turned_body(shaft, {0.0, 0.006, 0.04}, {0.0085, 0.005}), {0, 0, 0}}});
    product.contacts = find_contacts(product);
    const Contact* thread = find(product, shaft, plate, ContactKind::thread);
    return thread == nullptr ? 0.0 : thread->pitch_m;
  };
  EXPECT_EQ(kinds("M10_bolt", "nut_10", 0.0), 1.5e-3);     // ISO 261
  EXPECT_EQ(kinds("M10_bolt", "nut_10", 0.0005), 1.5e-3);  // bored to the minor diameter
  EXPECT_EQ(kinds("M10_bolt", "nut_10", 0.0014), 1.5e-3);  // drawn without a thread in mind
  EXPECT_EQ(kinds("M10_bolt", "plate", 0.0014), 0.0);
  EXPECT_EQ(kinds("pin", "plate", 0.0), 0.0);
  EXPECT_EQ(kinds("bolt", "plate", 0.0), 0.0);  // a clearance hole of zero
}

TEST(Contacts, AScrewOfNominalDiameterInItsCoreHoleIsAThread) {
  // Nominal diameter, pitch, minor diameter D1 of the nut thread (ISO 724), mm.
  for (const auto& [d, pitch, core] : {std::tuple{2.0, 0.4, 1.567},
                                       {3.0, 0.5, 2.459},
                                       {5.0, 0.8, 4.134},
                                       {8.0, 1.25, 6.647},
                                       {12.0, 1.75, 10.106},
                                       {20.0, 2.5, 17.294}}) {
    const auto contacts_of = [&, d = d](const char* name, double hole_mm) {
      Product product =
          product_of({{plate_with_hole("Plate", 4e-3 * d, 2e-3 * d, 0.5e-3 * hole_mm), {0, 0, 0}},
                      {turned_body(name, {-4e-3 * d, 2e-3 * d}, {0.5e-3 * d}), {0, 0, 0}}});
      return find_contacts(product);
    };
    const auto contacts = contacts_of("Screw", core);
    ASSERT_EQ(contacts.size(), 1U) << d;
    EXPECT_EQ(contacts[0].kind, ContactKind::thread) << d;
    EXPECT_NEAR(contacts[0].pitch_m, 1e-3 * pitch, 1e-12);
    EXPECT_EQ(contacts_of("Peg", core).at(0).kind, ContactKind::thread) << d;  // the diameters alone say it
    // Deeper than a thread, it stands in the plate.
    EXPECT_EQ(contacts_of("Peg", 0.99 * core).at(0).kind, ContactKind::other) << d;
    EXPECT_EQ(contacts_of("Screw", d - 1.4 * pitch).at(0).kind, ContactKind::other) << d;
  }
}

TEST(Contacts, AScrewThatCutsItsThreadIsNotPressedIn) {
  const auto kind = [](const char* name, double hole_m) {
    Product product = product_of({{plate_with_hole("Plate", 0.02, 0.006, 0.5 * hole_m), {0, 0, 0}},
                                  {turned_body(name, {-0.01, 0.006}, {0.0015}), {0, 0, 0}}});
    return find_contacts(product).at(0).kind;
  };
  EXPECT_EQ(kind("M3x8 screw", 0.0029), ContactKind::thread);  // in a printed hole
  EXPECT_EQ(kind("M3x8 screw", 0.00298), ContactKind::cylinder_fit);
  EXPECT_EQ(kind("Pin", 0.0029), ContactKind::cylinder_fit);
}

/// Distance of two boxes that are parallel to the axes, from the vertices of their meshes.
double distance_of(const Product& product, std::size_t a, std::size_t b) {
  Vec3 gap = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    double a_low = 1e300, a_high = -1e300, b_low = 1e300, b_high = -1e300;
    for (const Vec3& v : product.bodies[product.instances[a].body].mesh.vertices) {
      const double x = v[axis] + product.instances[a].X_WB.p[axis];
      a_low = std::min(a_low, x), a_high = std::max(a_high, x);
    }
    for (const Vec3& v : product.bodies[product.instances[b].body].mesh.vertices) {
      const double x = v[axis] + product.instances[b].X_WB.p[axis];
      b_low = std::min(b_low, x), b_high = std::max(b_high, x);
    }
    gap[axis] = std::max({0.0, a_low - b_high, b_low - a_high});
  }
  return gap.norm();
}

TEST(Contacts, TheGraphIsThatOfTheDistancesOfTheMeshes) {
  std::mt19937 random(7);
  const auto pick = [&](double from, double to) {
    return from + (to - from) * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
  };
  int touching = 0;
  for (int round = 0; round < 20; ++round) {
    // Towers of boxes, some of which stand off by more than the tolerance.
    std::vector<std::pair<Body, Vec3>> bodies;
    double z = 0.0;
    for (int i = 0; i < 8; ++i) {
      const Vec3 size(pick(0.03, 0.08), pick(0.03, 0.08), pick(0.01, 0.03));
      const double gap = random() % 3 == 0 ? 2e-4 : 0.0;
      bodies.emplace_back(box_body("B" + std::to_string(i), size),
                          Vec3(pick(-0.02, 0.02), pick(-0.02, 0.02), z + gap + 0.5 * size.z()));
      z += gap + size.z();
    }
    Product product = product_of(std::move(bodies));
    std::set<std::pair<std::size_t, std::size_t>> found, expected;
    for (const Contact& contact : find_contacts(product)) found.insert({contact.first, contact.second});
    for (std::size_t a = 0; a < product.instances.size(); ++a)
      for (std::size_t b = a + 1; b < product.instances.size(); ++b)
        if (distance_of(product, a, b) < 5e-5) expected.insert({a, b});
    // What touches nothing is held by what is within the play of a loose fit.
    std::vector<bool> alone(product.instances.size(), true);
    for (const auto& [a, b] : expected) alone[a] = alone[b] = false;
    for (std::size_t a = 0; a < product.instances.size(); ++a)
      for (std::size_t b = a + 1; b < product.instances.size(); ++b)
        if ((alone[a] || alone[b]) && distance_of(product, a, b) < 3e-4) expected.insert({a, b});
    EXPECT_EQ(found, expected) << round;
    touching += static_cast<int>(expected.size());
  }
  EXPECT_GT(touching, 60);
}

}  // namespace
}  // namespace takt::product
