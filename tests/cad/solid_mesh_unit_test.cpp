// Solids that OpenCASCADE's mesher leaves open: figures by hand.
#include "server/cad/solid_mesh.h"

#include <gmock/gmock.h>
#include <BRepAlgoAPI_Cut.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_NurbsConvert.hxx>
#include <BRepGProp.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRep_Builder.hxx>
#include <GProp_GProps.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>

#include <cmath>
#include <fstream>

#include "server/cad/step_reader.h"
#include "tests/cad/noisy_disc.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;

TEST(SolidMesh, RoundedNumbersOfTranslatorsLeaveNoFaceOut) {
  const test::TemporaryDirectory directory;
  const auto file = directory / "disc.step";
  const double R = 0.013, H = 0.007, r = 0.005, s = 0.011, depth = s - r;
  const double volume = M_PI * (R * R * H - r * r * (H - depth) - depth / 3.0 * (s * s + s * r + r * r));
  for (const double noise_mm : {0.0, 1e-14, 1e-13}) {
    std::ofstream(file) << test::NoisyDisc(noise_mm).text();
    const product::Product product = read_step(file);
    EXPECT_THAT(product.notes, IsEmpty()) << noise_mm;
    ASSERT_EQ(product.bodies.size(), 1U);
    const product::Body& body = product.bodies[0];
    EXPECT_NEAR(body.exact.volume, volume, 1e-6 * volume) << noise_mm;
    EXPECT_TRUE(check_closed(body.mesh).ok()) << noise_mm;
    EXPECT_NEAR(volume_properties(body.mesh).volume, volume, 0.01 * volume) << noise_mm;
    double cone = 0.0;  // area of the countersink
    for (std::size_t i = 0; i < body.mesh.triangles.size(); ++i) {
      if (body.faces[static_cast<std::size_t>(body.triangle_faces[i])].kind != product::SurfaceKind::cone)
        continue;
      const auto& t = body.mesh.triangles[i];
      const Vec3& a = body.mesh.vertices[t[0]];
      cone += 0.5 * (body.mesh.vertices[t[1]] - a).cross(body.mesh.vertices[t[2]] - a).norm();
    }
    EXPECT_NEAR(cone, M_PI * (s + r) * depth * std::sqrt(2.0), 0.01 * cone) << noise_mm;
  }
}

TEST(SolidMesh, SolidsOfSplinesHaveTheirExactMassProperties) {
  // Half a hollow ball, as some translators write it: without a sphere. A rule of fixed order is 1 % beside.
  const double R = 0.06, r = 0.059;
  const TopoDS_Shape half = BRepPrimAPI_MakeSphere(gp_Ax2(), R * 1e3, 0.0, M_PI / 2.0).Shape();
  const TopoDS_Shape shell = BRepAlgoAPI_Cut(half, BRepPrimAPI_MakeSphere(r * 1e3).Shape()).Shape();
  product::Body body;
  body.name = "Shell";
  std::vector<std::string> notes;
  ASSERT_TRUE(make_body(BRepBuilderAPI_NurbsConvert(shell, true).Shape(), 1e-4, 0.2, body, notes))
      << testing::PrintToString(notes);
  const auto between = [&](int power) { return std::pow(R, power) - std::pow(r, power); };
  const double volume = 2.0 / 3.0 * M_PI * between(3), height = 3.0 / 8.0 * between(4) / between(3);
  EXPECT_NEAR(body.exact.volume, volume, 1e-5 * volume);
  EXPECT_LT((body.exact.p_BBcm - Vec3(0, 0, height)).norm(), 1e-5 * R);
  EXPECT_NEAR(body.exact.G_BBcm_B(2, 2), 0.4 * between(5) / between(3), 1e-5 * R * R);
  double area = 0.0;
  for (const product::Face& face : body.faces) area += face.area_m2;
  EXPECT_NEAR(area, 2.0 * M_PI * (R * R + r * r) + M_PI * (R * R - r * r), 1e-5 * area);
}

/// A plate of 20 x 30 x 10 mm one of whose edges is cut by 0.5 mm at 45 deg, without one of its faces: the `largest`, else
/// the smallest, which is the cut.
TopoDS_Solid open_plate(bool largest) {
  BRepBuilderAPI_MakePolygon outline;
  for (const gp_Pnt& corner :
       {gp_Pnt(0, 0, 0), gp_Pnt(20, 0, 0), gp_Pnt(20, 29.5, 0), gp_Pnt(19.5, 30, 0), gp_Pnt(0, 30, 0)})
    outline.Add(corner);
  outline.Close();
  const TopoDS_Shape plate =
      BRepPrimAPI_MakePrism(BRepBuilderAPI_MakeFace(outline.Wire()).Face(), gp_Vec(0, 0, 10)).Shape();
  TopoDS_Shape left_out;
  double extreme = largest ? 0.0 : 1e9;
  for (TopExp_Explorer at(plate, TopAbs_FACE); at.More(); at.Next()) {
    GProp_GProps area;
    BRepGProp::SurfaceProperties(at.Current(), area);
    if (largest ? area.Mass() <= extreme : area.Mass() >= extreme) continue;
    extreme = area.Mass();
    left_out = at.Current();
  }
  const BRep_Builder builder;
  TopoDS_Shell shell;
  builder.MakeShell(shell);
  for (TopExp_Explorer at(plate, TopAbs_FACE); at.More(); at.Next())
    if (!at.Current().IsSame(left_out)) builder.Add(shell, at.Current());
  TopoDS_Solid solid;
  builder.MakeSolid(solid);
  builder.Add(solid, shell);
  return solid;
}

TEST(SolidMesh, AHoleIsClosedWhereTheVolumeConfirmsIt) {
  product::Body body;
  body.name = "Plate";
  std::vector<std::string> notes;
  ASSERT_TRUE(make_body(open_plate(false), 1e-4, 0.2, body, notes)) << testing::PrintToString(notes);
  EXPECT_TRUE(check_closed(body.mesh).ok());
  EXPECT_NEAR(volume_properties(body.mesh).volume, (0.02 * 0.03 - 0.0005 * 0.0005 / 2.0) * 0.01, 1e-14);
  EXPECT_EQ(body.triangle_faces.size(), body.mesh.triangles.size());
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_THAT(notes[0], AllOf(HasSubstr("Plate: its surface had 1 hole of at most 10 mm"),
                              HasSubstr("flat triangles")));

  product::Body other;
  other.name = "Plate";
  notes.clear();
  EXPECT_FALSE(make_body(open_plate(true), 1e-4, 0.2, other, notes));
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_THAT(notes[0],
              AllOf(HasSubstr("bounds no solid"), HasSubstr("left out"), HasSubstr("check the solid")));
}

}  // namespace
}  // namespace takt::cad
