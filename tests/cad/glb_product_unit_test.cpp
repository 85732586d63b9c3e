// One product as STEP and as GLB, both written by OpenCASCADE.
#include <gmock/gmock.h>

#include <cstdlib>
#include <map>

#include "server/cad/step_reader.h"
#include "server/product/contacts.h"
#include "server/product/disassembly.h"
#include "server/product/glb_assembly.h"
#include "tests/cad/step_files.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

using product::Product;
using test::box;
using test::cylinder;
using test::moved_by;

TopoDS_Shape drilled(double x, double y, double z, const std::vector<double>& holes) {
  TopoDS_Shape result = BRepPrimAPI_MakeBox(gp_Pnt(-x / 2, -y / 2, 0), x, y, z).Shape();
  for (const double at : holes)
    result = BRepAlgoAPI_Cut(result, cylinder(5.1, z).Moved(TopLoc_Location(moved_by(at, 0, 0)))).Shape();
  return result;
}

/// A plate and a cover with two bolts and nuts, a pressed pin and a turned block.
test::StepProduct clamp() {
  test::StepProduct made("Clamp");
  const auto bolt =
      BRepAlgoAPI_Fuse(cylinder(4.95, 45),
                       BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, 45), gp_Dir(0, 0, 1)), 8, 6).Shape())
          .Shape();
  const TopoDS_Shape ring = BRepAlgoAPI_Cut(cylinder(9, 8), cylinder(5, 8)).Shape();
  const TDF_Label screw = made.part("M10 bolt", bolt), nut = made.part("M10 nut", ring);
  made.colour(screw, 0.2, 0.4, 0.6);
  made.use(made.root(), made.part("Plate", drilled(140, 80, 20, {-30, 30, 50})), "Plate", moved_by(0, 0, 15));
  made.use(made.root(), made.part("Cover", drilled(100, 40, 10, {-30, 30})), "Cover", moved_by(0, 0, 35));
  made.use(made.root(), made.part("Pin", cylinder(5.1, 40)), "Pin", moved_by(50, 0, 15));
  const TDF_Label group = made.assembly("Fasteners");
  for (const double x : {-30.0, 30.0}) {
    made.use(group, screw, "M10 bolt", moved_by(x, 0, 0));
    made.use(group, nut, "M10 nut", moved_by(x, 0, 7));
  }
  made.use(made.root(), group, "Fasteners");
  gp_Trsf turned;
  turned.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), 0.5);
  made.use(made.root(), made.part("Block", box(12, 8, 6)), "Block", moved_by(-62, 25, 35) * turned);
  return made;
}

TEST(GlbProduct, IsTheProductOfTheStepFile) {
  test::TemporaryDirectory directory;
  test::StepProduct made = clamp();
  made.write(directory / "clamp.step");
  made.write_glb(directory / "clamp.glb");
  Product step = read_step(directory / "clamp.step"),
          glb = product::read_glb_assembly(directory / "clamp.glb");
  EXPECT_THAT(glb.notes, testing::IsEmpty());
  EXPECT_EQ(glb.bodies.size(), step.bodies.size());
  ASSERT_EQ(glb.instances.size(), step.instances.size());
  std::map<std::string, std::size_t> there;
  for (std::size_t i = 0; i < glb.instances.size(); ++i) there[glb.instances[i].name] = i;
  std::vector<std::size_t> same;  // by instance of STEP: that of GLB
  for (const product::Instance& a : step.instances) {
    ASSERT_TRUE(there.contains(a.name)) << a.name;
    same.push_back(there[a.name]);
    const product::Instance& b = glb.instances[same.back()];
    EXPECT_EQ(a.path, b.path);
    const product::Body &one = step.bodies[a.body], &other = glb.bodies[b.body];
    EXPECT_LT((a.X_WB * one.exact.p_BBcm - b.X_WB * other.exact.p_BBcm).norm(), 2e-5) << a.name;
    // Facets of at most 0.2 rad lie in the circle: less area by (0.2 rad)^2 / 6.
    EXPECT_NEAR(other.exact.volume, one.exact.volume, 0.007 * one.exact.volume) << a.name;
    const Mat3 inertia = a.X_WB.R * one.exact.G_BBcm_B * a.X_WB.R.transpose(),
               in_glb = b.X_WB.R * other.exact.G_BBcm_B * b.X_WB.R.transpose();
    EXPECT_LT((inertia - in_glb).norm(), 0.015 * inertia.norm()) << a.name;
    if (one.colour) {
      ASSERT_TRUE(other.colour.has_value()) << a.name;
      for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR((*one.colour)[k], (*other.colour)[k], 0.005);
    }
  }
  step.contacts = product::find_contacts(step), glb.contacts = product::find_contacts(glb);
  const auto table = [](const Product& product) {
    std::vector<std::tuple<std::string, std::string, product::ContactKind, long>> rows;
    for (const product::Contact& contact : product.contacts) {
      std::string a = product.instances[contact.first].name, b = product.instances[contact.second].name;
      if (b < a) std::swap(a, b);
      rows.emplace_back(a, b, contact.kind, std::lround(contact.clearance_m * 1e6));
    }
    std::sort(rows.begin(), rows.end());
    return rows;
  };
  EXPECT_GE(step.contacts.size(), 10U);
  EXPECT_EQ(table(glb), table(step));
  const product::Disassembly plan = product::take_apart(step), other = product::take_apart(glb);
  EXPECT_TRUE(plan.stuck.empty());
  EXPECT_EQ(other.base, same[plan.base]);
  ASSERT_EQ(other.steps.size(), plan.steps.size());
  for (std::size_t k = 0; k < plan.steps.size(); ++k) {
    std::vector<std::string> a, b;
    for (const std::size_t i : plan.steps[k].parts) a.push_back(step.instances[i].name);
    for (const std::size_t i : other.steps[k].parts) b.push_back(glb.instances[i].name);
    EXPECT_EQ(a, b);
    EXPECT_LT((plan.steps[k].direction_W - other.steps[k].direction_W).norm(), 1e-4);
    EXPECT_EQ(plan.steps[k].loosening, other.steps[k].loosening);
  }
}

TEST(GlbProduct, ARobotTakesItApartAndPutsItTogether) {
  test::TemporaryDirectory directory;
  test::StepProduct made("Stack");
  made.use(made.root(), made.part("Base", box(60, 60, 10)), "Base");
  made.use(made.root(), made.part("Block", box(20, 20, 10)), "Block", moved_by(20, 20, 10));
  made.use(made.root(), made.part("Cap", cylinder(6, 8)), "Cap", moved_by(30, 30, 20));
  made.write_glb(directory / "stack.glb");
  const std::string out = (directory / "out").string();
  const auto run = [](const std::string& command) {
    return std::system((std::string(TAKT_BIN_DIR "/") + command + " > /dev/null 2>&1").c_str());
  };
  const std::string file = (directory / "stack.glb").string();
  ASSERT_EQ(run("takt-from-cad " + file + " --robot -o " + out), 0);
  EXPECT_EQ(run("takt-run run " + out + "/Stack_robot.yaml --report " + out + "/report.json"), 0);
  std::ifstream in(out + "/report.json");
  const std::string report((std::istreambuf_iterator<char>(in)), {});
  EXPECT_THAT(report, testing::HasSubstr("lift Cap"));
  EXPECT_THAT(report, testing::HasSubstr("assemble Block"));
  EXPECT_NE(run("takt-from-cad " + file + " --deflection 0.2 -o " + out), 0);
}

}  // namespace
}  // namespace takt::cad
