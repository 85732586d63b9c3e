// Assemblies as engineers draw them: contacts and orders of disassembly by hand, and each way out by OpenCASCADE's booleans.
#include "tests/cad/assemblies.h"

#include <gmock/gmock.h>
#include <BRepAlgoAPI_Common.hxx>
#include <BRepBndLib.hxx>
#include <BRepGProp.hxx>
#include <Bnd_Box.hxx>
#include <GProp_GProps.hxx>
#include <STEPControl_Reader.hxx>
#include <TopExp_Explorer.hxx>

#include "server/cad/step_reader.h"
#include "server/product/contacts.h"
#include "server/product/disassembly.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

using product::ContactKind;
using product::Disassembly;
using product::Loosening;
using product::Product;
using testing::ElementsAre;
using testing::IsEmpty;

struct Planned {
  Product product;
  Disassembly plan;
  std::vector<TopoDS_Shape> solids;  ///< by instance, in their places, mm
};

double volume(const TopoDS_Shape& shape) {
  GProp_GProps properties;
  BRepGProp::VolumeProperties(shape, properties);
  return properties.Mass();
}

/// The solids of the whole file, each for the instance whose centre of mass it has.
std::vector<TopoDS_Shape> solids_of(const std::filesystem::path& file, const Product& product) {
  STEPControl_Reader reader;
  reader.ReadFile(file.c_str());
  reader.TransferRoots();
  std::vector<TopoDS_Shape> solids(product.instances.size());
  for (TopExp_Explorer at(reader.OneShape(), TopAbs_SOLID); at.More(); at.Next()) {
    GProp_GProps properties;
    BRepGProp::VolumeProperties(at.Current(), properties);
    const gp_Pnt centre = properties.CentreOfMass();
    for (std::size_t i = 0; i < solids.size(); ++i) {
      const Vec3 own =
          product.instances[i].X_WB * product.bodies[product.instances[i].body].exact.p_BBcm * 1e3;
      if (solids[i].IsNull() && (own - Vec3(centre.X(), centre.Y(), centre.Z())).norm() < 1e-3 &&
          std::abs(product.bodies[product.instances[i].body].exact.volume * 1e9 - properties.Mass()) < 1e-3)
        solids[i] = at.Current();
    }
  }
  return solids;
}

Planned plan_of(test::StepProduct made) {
  const test::TemporaryDirectory directory;
  made.write(directory / "product.step");
  Planned result;
  result.product = read_step(directory / "product.step");
  result.product.contacts = product::find_contacts(result.product);
  result.plan = product::take_apart(result.product);
  result.solids = solids_of(directory / "product.step", result.product);
  return result;
}

double common_volume(const TopoDS_Shape& a, const TopoDS_Shape& b) {
  Bnd_Box box_a, box_b;
  BRepBndLib::Add(a, box_a);
  BRepBndLib::Add(b, box_b);
  return box_a.IsOut(box_b) ? 0.0 : volume(BRepAlgoAPI_Common(a, b).Shape());
}

/// What leaves overlaps nothing that stays by more than it does in its place (press fits, threads), all along its way.
void expect_free_ways(const Planned& planned) {
  constexpr double kSliver_mm3 = 0.05;
  std::vector<bool> here(planned.product.instances.size(), true);
  for (const product::RemovalStep& step : planned.plan.steps) {
    std::vector<bool> leaves(here.size(), false);
    for (const std::size_t i : step.parts) leaves[i] = true;
    for (const std::size_t i : step.parts)
      for (std::size_t b = 0; b < here.size(); ++b) {
        if (!here[b] || leaves[b] || step.loosening == Loosening::unsnap) continue;
        const double joined = common_volume(planned.solids[i], planned.solids[b]);
        for (const double way_mm : {0.7, 3.0, 8.0, 20.0, 45.0, 90.0}) {
          const Vec3 shift = way_mm * step.direction_W;
          const TopoDS_Shape moved =
              planned.solids[i].Moved(TopLoc_Location(test::moved_by(shift.x(), shift.y(), shift.z())));
          EXPECT_LE(common_volume(moved, planned.solids[b]), joined + kSliver_mm3)
              << planned.product.instances[i].name << " and " << planned.product.instances[b].name
              << " after " << way_mm << " mm";
        }
      }
    if (step.parts.size() == 1) here[step.parts[0]] = false;  // of several the rest follows
    if (step.parts.size() > 1) return;
  }
}

std::vector<std::string> steps_of(const Planned& planned) {
  std::vector<std::string> result;
  for (const product::RemovalStep& step : planned.plan.steps) {
    std::string text = product::to_string(step.loosening);
    for (const std::size_t i : step.parts) text += " " + planned.product.instances[i].name;
    const Vec3& d = step.direction_W;
    for (int axis = 0; axis < 3; ++axis)
      if (std::abs(d[axis]) > 0.999) text += std::string(d[axis] > 0.0 ? " +" : " -") + "xyz"[axis];
    result.push_back(text);
  }
  return result;
}

int count(const Planned& planned, ContactKind kind) {
  return static_cast<int>(
      std::count_if(planned.product.contacts.begin(), planned.product.contacts.end(),
                    [&](const product::Contact& contact) { return contact.kind == kind; }));
}

TEST(Assemblies, ScrewsOfNominalDiameterAreScrewedOut) {
  const Planned planned = plan_of(test::bearing_block());
  EXPECT_EQ(count(planned, ContactKind::thread), 4);
  EXPECT_TRUE(planned.plan.stuck.empty());
  const auto steps = steps_of(planned);
  for (const char* screw : {"M8_screw", "M8_screw_2", "M8_screw_3", "M8_screw_4"})
    EXPECT_THAT(steps, testing::Contains("unscrew " + std::string(screw) + " +z"));
  EXPECT_EQ(steps.back(), "lift Block +z");
  expect_free_ways(planned);
}

TEST(Assemblies, ThreadedInsertsArePressedInAndHoldScrews) {
  // As libraries of parts draw them: the screw has the nominal diameter of the insert's hole, the insert is wider than its own.
  test::StepProduct made("Printed box");
  made.use(made.root(),
           made.part("Box", test::cut(test::block(-20, -20, 0, 40, 40, 20), test::upright(2.0, 0, 0, 8, 20))),
           "Box");
  made.use(
      made.root(),
      made.part("M3 heatset", test::cut(test::upright(2.3, 0, 0, 14, 20), test::upright(1.5, 0, 0, 13, 21))),
      "M3 heatset");
  made.use(
      made.root(),
      made.part("Cover", test::cut(test::block(-20, -20, 20, 40, 40, 3), test::upright(1.7, 0, 0, 19, 24))),
      "Cover");
  made.use(made.root(),
           made.part("M3x12 SHCS",
                     test::fuse(test::upright(1.5, 0, 0, 11, 23), test::upright(2.75, 0, 0, 23, 26))),
           "M3x12 SHCS");
  const Planned planned = plan_of(std::move(made));
  EXPECT_EQ(count(planned, ContactKind::thread), 1) << "screw and insert alone";
  EXPECT_THAT(steps_of(planned), ElementsAre("unscrew M3x12_SHCS +z", "lift Cover +z", "pull M3_heatset +z"));
}

TEST(Assemblies, TheShippedProductIsThisOne) {
  const test::TemporaryDirectory directory;
  test::bearing_block().write(directory / "product.step");
  const Product made = read_step(directory / "product.step"),
                shipped = read_step(TAKT_CONFIG_DIR "/cad/bearing_block.step");
  ASSERT_EQ(shipped.instances.size(), made.instances.size());
  for (std::size_t i = 0; i < made.instances.size(); ++i) {
    const product::Body &a = made.bodies[made.instances[i].body],
                        &b = shipped.bodies[shipped.instances[i].body];
    EXPECT_EQ(shipped.instances[i].path, made.instances[i].path);
    EXPECT_NEAR(b.exact.volume, a.exact.volume, 1e-12);
    EXPECT_LT((shipped.instances[i].X_WB * b.exact.p_BBcm - made.instances[i].X_WB * a.exact.p_BBcm).norm(),
              1e-9);
    EXPECT_EQ(b.colour, a.colour);
    EXPECT_EQ(b.material.density_kg_m3, a.material.density_kg_m3);
  }
}

TEST(Assemblies, WhatHasPlayIsHeldByWhatIsNear) {
  const Planned planned = plan_of(test::slide());
  const Product& product = planned.product;
  EXPECT_TRUE(product::hierarchy(product, planned.plan).floating.empty());
  const auto found =
      std::find_if(product.contacts.begin(), product.contacts.end(), [&](const product::Contact& contact) {
        return product.instances[contact.first].name == "Rail" &&
               product.instances[contact.second].name == "Slider" && contact.axis_W.z() > 0.999;
      });
  ASSERT_NE(found, product.contacts.end());
  EXPECT_NEAR(found->clearance_m, 1e-4, 1e-9);
  const auto steps = steps_of(planned);
  EXPECT_THAT(steps, testing::Contains("unscrew ISO_4762_M5x20 +y"));
  EXPECT_THAT(steps, testing::Contains(testing::AnyOf("lift Slider +y", "lift Slider -y")));
  expect_free_ways(planned);
}

TEST(Assemblies, BearingsLeaveBlindBoresByTheirOpenSide) {
  const Planned planned = plan_of(test::gearbox());
  EXPECT_TRUE(planned.plan.stuck.empty());
  EXPECT_EQ(count(planned, ContactKind::thread), 4);
  for (const product::RemovalStep& step : planned.plan.steps)
    for (const std::size_t i : step.parts) {
      const std::string& name = planned.product.instances[i].name;
      if (name.starts_with("Bearing_lower")) {
        EXPECT_GT(step.direction_W.z(), 0.999) << name;
      }
    }
  expect_free_ways(planned);
}

TEST(Assemblies, OfEqualPartsTheLowestIsTheBase) {
  const Planned planned = plan_of(test::flanges());
  EXPECT_EQ(planned.product.instances[planned.plan.base].name, "Lower_pipe");
  EXPECT_EQ(count(planned, ContactKind::thread), 3);
  EXPECT_TRUE(planned.plan.stuck.empty());
  const auto steps = steps_of(planned);
  for (const char* bolt : {"Bolt_M10", "Bolt_M10_2", "Bolt_M10_3"})
    EXPECT_THAT(steps, testing::Contains("unscrew " + std::string(bolt) + " +z"));
  expect_free_ways(planned);
}

TEST(Assemblies, HooksOfALidAreUnsnapped) {
  const Planned planned = plan_of(test::snap_box());
  EXPECT_THAT(steps_of(planned), ElementsAre("unsnap Lid +z", "lift Battery +z"));
}

TEST(Assemblies, TheSmallestUndercutGivesWay) {
  const Planned planned = plan_of(test::clevis());
  const auto steps = steps_of(planned);
  ASSERT_EQ(steps.size(), 3U);
  EXPECT_EQ(steps[0], "unsnap E_ring -z");
  EXPECT_EQ(steps[1], "lift Pin -x");
  EXPECT_THAT(steps[2], testing::StartsWith("lift Eye"));
  expect_free_ways(planned);
}

}  // namespace
}  // namespace takt::cad
