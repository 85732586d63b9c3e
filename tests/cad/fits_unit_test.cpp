// A product of OpenCASCADE with one joint of each kind: figures by hand.
#include <gmock/gmock.h>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepFill_PipeShell.hxx>
#include <BRepLib.hxx>
#include <GCE2d_MakeSegment.hxx>
#include <Geom_CylindricalSurface.hxx>

#include "server/cad/step_reader.h"
#include "server/geometry/mesh/import.h"
#include "server/product/cell_writer.h"
#include "server/product/contacts.h"
#include "server/product/disassembly.h"
#include "server/product/fine_faces.h"
#include "tests/cad/step_files.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

using product::ContactKind;
using test::cylinder;
using test::moved_by;
using test::upright;

constexpr double kPitch_mm = 1.5;

/// A ridge around z, four turns long, from the radius `base` to `tip`.
TopoDS_Shape ridge(double base, double tip, double z, bool left_handed) {
  constexpr double kTurns = 4.0;
  const Handle(Geom_CylindricalSurface) around =
      new Geom_CylindricalSurface(gp_Ax3(gp_Pnt(0, 0, z), gp_Dir(0, 0, 1)), base);
  const gp_Pnt2d end(2.0 * M_PI * kTurns * (left_handed ? -1.0 : 1.0), kPitch_mm * kTurns);
  const TopoDS_Wire spine =
      BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(GCE2d_MakeSegment(gp_Pnt2d(0, 0), end).Value(), around))
          .Wire();
  BRepLib::BuildCurves3d(spine);
  BRepBuilderAPI_MakePolygon profile(gp_Pnt(base, 0, z - 0.45 * kPitch_mm), gp_Pnt(tip, 0, z),
                                     gp_Pnt(base, 0, z + 0.45 * kPitch_mm), true);
  BRepFill_PipeShell pipe(spine);
  pipe.Set(gp_Dir(0, 0, 1));
  pipe.Add(profile.Wire());
  pipe.Build();
  pipe.MakeSolid();
  return pipe.Shape();
}

/// How far facets between two points on a cylinder along z around (x, 0) leave it, of triangles with all corners on it (mm).
double sagitta(const TriangleMesh& mesh, double x_mm, double radius_mm) {
  const auto from_axis = [&](const Vec3& p) { return std::hypot(p.x() * 1e3 - x_mm, p.y() * 1e3); };
  double largest = 0.0;
  int facets = 0;
  for (const auto& t : mesh.triangles) {
    double low = 1e300, high = -1e300;
    for (const std::uint32_t v : t)
      low = std::min(low, mesh.vertices[v].z()), high = std::max(high, mesh.vertices[v].z());
    bool on = high - low > 1e-6;  // the end of a shaft has its corners on the circle, too
    for (const std::uint32_t v : t) on = on && std::abs(from_axis(mesh.vertices[v]) - radius_mm) < 1e-4;
    if (!on) continue;
    ++facets;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 middle = 0.5 * (mesh.vertices[t[k]] + mesh.vertices[t[(k + 1) % 3]]);
      largest = std::max(largest, radius_mm - from_axis(middle));
    }
  }
  EXPECT_GT(facets, 20);
  return largest;
}

class Fits : public testing::TestWithParam<bool> {};

TEST_P(Fits, PressedLooseSnappedAndScrewedJointsAreRecognised) {
  const bool left_handed = GetParam();
  test::StepProduct made("Fits");
  TopoDS_Shape plate = BRepPrimAPI_MakeBox(gp_Pnt(-50, -15, 0), 100, 30, 10).Shape();
  for (const auto& [x, radius] : {std::pair{-35.0, 8.0}, {-10.0, 8.0}, {15.0, 4.0}})
    plate = BRepAlgoAPI_Cut(plate, cylinder(radius, 10).Moved(TopLoc_Location(moved_by(x, 0, 0)))).Shape();
  const TopoDS_Shape clip =
      BRepAlgoAPI_Fuse(BRepAlgoAPI_Fuse(upright(3.98, 0, 0, 0, 10), upright(4.3, 0, 0, -2, 0)).Shape(),
                       upright(7, 0, 0, 10, 13))
          .Shape();
  made.use(made.root(), made.part("Plate", plate), "Plate");
  made.use(made.root(), made.part("Pressed", cylinder(8.012, 14)), "Pressed", moved_by(-35, 0, 0));
  made.use(made.root(), made.part("Loose", cylinder(7.95, 14)), "Loose", moved_by(-10, 0, 0));
  made.use(made.root(), made.part("Clip", clip), "Clip", moved_by(15, 0, 0));
  made.use(made.root(), made.part("Male", ridge(4, 5, 20, left_handed)), "Male", moved_by(35, 0, 0));
  made.use(made.root(), made.part("Female", ridge(5, 4, 20.75, left_handed)), "Female", moved_by(35, 0, 0));
  test::TemporaryDirectory directory;
  made.write(directory / "fits.step");
  const StepFile file(directory / "fits.step");
  product::Product product = file.product();
  EXPECT_THAT(product.notes, testing::IsEmpty());
  product.contacts = product::find_contacts(product);
  const product::Disassembly plan = product::take_apart(product);
  EXPECT_TRUE(plan.stuck.empty());
  const auto advice = product::level_advice(product);
  int found = 0;
  for (std::size_t i = 0; i < product.contacts.size(); ++i) {
    const product::Contact& contact = product.contacts[i];
    const std::string &first = product.instances[contact.first].name,
                      &second = product.instances[contact.second].name;
    ++found;
    if (second == "Pressed") {
      EXPECT_EQ(contact.kind, ContactKind::cylinder_fit);
      EXPECT_NEAR(contact.clearance_m, -12e-6, 1e-9);
      EXPECT_EQ(advice[i].level, 3);
    } else if (second == "Loose") {
      EXPECT_EQ(contact.kind, ContactKind::cylinder_fit);
      EXPECT_NEAR(contact.clearance_m, 50e-6, 1e-9);
      EXPECT_EQ(advice[i].level, 1);
    } else if (second == "Clip" && contact.kind == ContactKind::snap) {
      EXPECT_NEAR(contact.area_m2, M_PI * (4.3 * 4.3 - 4.0 * 4.0) * 1e-6, 2e-7);
      EXPECT_EQ(advice[i].level, 3);
    } else if (second == "Clip" && contact.kind == ContactKind::plane) {
      EXPECT_NEAR(contact.area_m2, M_PI * (7.0 * 7.0 - 4.0 * 4.0) * 1e-6, 1e-6);
    } else if (second == "Clip") {
      EXPECT_EQ(contact.kind, ContactKind::cylinder_fit);
      EXPECT_NEAR(contact.clearance_m, 20e-6, 1e-9);
    } else {
      EXPECT_EQ(first, "Male");
      EXPECT_EQ(second, "Female");
      EXPECT_EQ(contact.kind, ContactKind::thread);
      EXPECT_NEAR(contact.pitch_m, (left_handed ? -1.0 : 1.0) * kPitch_mm * 1e-3, 1e-8);
      EXPECT_LT(contact.axis_W.cross(Vec3::UnitZ()).norm(), 1e-3);
      EXPECT_EQ(advice[i].level, 3);
    }
  }
  EXPECT_EQ(found, 6);
  for (const product::RemovalStep& step : plan.steps) {
    const std::string& name = product.instances[step.parts.at(0)].name;
    const product::Loosening expected = name == "Pressed" ? product::Loosening::pull
                                        : name == "Clip"  ? product::Loosening::unsnap
                                        : name == "Male"  ? product::Loosening::unscrew
                                                          : product::Loosening::lift;
    EXPECT_EQ(step.loosening, expected) << name;
  }
  // Facets of what fits are nearer to the circle than the fit is wide; others stay.
  const auto deflections = product::face_deflections(product);
  for (std::size_t b = 0; b < product.bodies.size(); ++b) {
    product::Body& body = product.bodies[b];
    if (body.name == "Male" || body.name == "Female") {
      EXPECT_THAT(deflections[b], testing::Each(0.0));
      continue;
    }
    body.contact_mesh = file.finer_mesh(b, deflections[b]);
    ASSERT_TRUE(check_closed(body.contact_mesh).ok()) << body.name;
    const double coarse = volume_properties(body.mesh).volume,
                 fine = volume_properties(body.contact_mesh).volume;
    EXPECT_LT(std::abs(fine - body.exact.volume), std::abs(coarse - body.exact.volume)) << body.name;
  }
  const auto body = [&](const char* name) -> const product::Body& {
    return *std::find_if(product.bodies.begin(), product.bodies.end(),
                         [&](const product::Body& one) { return one.name == name; });
  };
  for (const auto& [shaft, x, hole_radius, radius, clearance] :
       {std::tuple{"Pressed", -35.0, 8.0, 8.012, 0.020},
        {"Loose", -10.0, 8.0, 7.95, 0.050},
        {"Clip", 15.0, 4.0, 3.98, 0.020}}) {
    EXPECT_GT(sagitta(body("Plate").mesh, x, hole_radius), clearance / 8.0) << shaft;
    EXPECT_LE(sagitta(body("Plate").contact_mesh, x, hole_radius), clearance / 8.0 + 1e-6) << shaft;
    EXPECT_GT(sagitta(body(shaft).mesh, 0.0, radius), clearance / 8.0) << shaft;
    EXPECT_LE(sagitta(body(shaft).contact_mesh, 0.0, radius), clearance / 8.0 + 1e-6) << shaft;
  }
  const product::CellFiles files =
      product::write_cell(product, plan, product::hierarchy(product, plan), directory / "cell");
  EXPECT_EQ(import_solid(directory / "cell" / "meshes" / "Plate.obj").triangles.size(),
            body("Plate").contact_mesh.triangles.size());
}

INSTANTIATE_TEST_SUITE_P(Handed, Fits, testing::Bool(), [](const testing::TestParamInfo<bool>& hand) {
  return std::string(hand.param ? "left" : "right");
});

}  // namespace
}  // namespace takt::cad
