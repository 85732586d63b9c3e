// Poles of spheres are turned away from the borders of their faces.
#include "server/cad/step_spheres.h"

#include <gmock/gmock.h>
#include <BRepAlgoAPI_Common.hxx>
#include <BRepGProp.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <GProp_GProps.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <STEPControl_Reader.hxx>
#include <STEPControl_Writer.hxx>
#include <StepGeom_Axis2Placement3d.hxx>
#include <StepGeom_Direction.hxx>
#include <StepGeom_SphericalSurface.hxx>
#include <XSControl_WorkSession.hxx>

#include <cmath>

#include "plant_models/spatial.h"
#include "tests/support/temporary_directory.h"

namespace takt::cad {
namespace {

constexpr double kRadius_mm = 60.0, kBall_mm3 = 4.0 / 3.0 * M_PI * kRadius_mm * kRadius_mm * kRadius_mm;

class StepSpheres : public testing::Test {
 protected:
  StepSpheres() { Message::DefaultMessenger()->ChangePrinters().Clear(); }
  ~StepSpheres() override { Interface_Static::SetIVal("write.surfacecurve.mode", 1); }

  void read(const TopoDS_Shape& shape, bool pcurves) {
    const std::string file = (directory_ / "sphere.step").string();
    STEPControl_Writer writer;
    Interface_Static::SetIVal("write.surfacecurve.mode", pcurves ? 1 : 0);
    ASSERT_EQ(writer.Transfer(shape, STEPControl_AsIs), IFSelect_RetDone);
    ASSERT_EQ(writer.Write(file.c_str()), IFSelect_RetDone);
    ASSERT_EQ(reader_.ReadFile(file.c_str()), IFSelect_RetDone);
    model_ = reader_.WS()->Model();
  }
  /// Direction of the pole of the first sphere.
  Vec3 pole() const {
    for (int i = 1; i <= model_->NbEntities(); ++i) {
      const auto sphere = Handle(StepGeom_SphericalSurface)::DownCast(model_->Value(i));
      if (sphere.IsNull()) continue;
      const auto axis = sphere->Position()->Axis();
      return Vec3(axis->DirectionRatiosValue(1), axis->DirectionRatiosValue(2), axis->DirectionRatiosValue(3))
          .normalized();
    }
    ADD_FAILURE() << "no sphere";
    return Vec3::Zero();
  }
  double volume_mm3() {
    reader_.TransferRoots();
    GProp_GProps properties;
    BRepGProp::VolumeProperties(reader_.OneShape(), properties, 1e-6);
    return properties.Mass();
  }

  test::TemporaryDirectory directory_;
  STEPControl_Reader reader_;
  Handle(Interface_InterfaceModel) model_;
};

/// Its border runs along two meridians, through both poles.
TopoDS_Shape quarter() {
  const TopoDS_Shape ball = BRepPrimAPI_MakeSphere(kRadius_mm).Shape();
  return BRepAlgoAPI_Common(ball, BRepPrimAPI_MakeBox(gp_Pnt(0, 0, -100), gp_Pnt(100, 100, 100)).Shape())
      .Shape();
}

TEST_F(StepSpheres, APoleOnTheBorderIsTurnedAwayAndTheShapeStays) {
  read(quarter(), false);
  turn_poles_from_borders(*model_);
  const Vec3 turned = pole();
  // The border is in the planes x = 0 and y = 0.
  EXPECT_GT(std::asin(std::abs(turned.x())), 0.5);
  EXPECT_GT(std::asin(std::abs(turned.y())), 0.5);
  turn_poles_from_borders(*model_);
  EXPECT_EQ(pole(), turned) << "a second time changes nothing";
  EXPECT_NEAR(volume_mm3(), 0.25 * kBall_mm3, 1e-4 * kBall_mm3);
}

TEST_F(StepSpheres, ASphereWithASeamKeepsItsPole) {
  read(BRepPrimAPI_MakeSphere(kRadius_mm).Shape(), false);
  const Vec3 before = pole();
  turn_poles_from_borders(*model_);
  EXPECT_EQ(pole(), before);
  EXPECT_NEAR(volume_mm3(), kBall_mm3, 1e-4 * kBall_mm3);
}

TEST_F(StepSpheres, ASphereWithCurvesInItsParametersKeepsItsPole) {
  read(quarter(), true);
  const Vec3 before = pole();
  turn_poles_from_borders(*model_);
  EXPECT_EQ(pole(), before);
  EXPECT_NEAR(volume_mm3(), 0.25 * kBall_mm3, 1e-4 * kBall_mm3);
}

}  // namespace
}  // namespace takt::cad
