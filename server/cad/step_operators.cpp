#include "server/cad/step_operators.h"

#include <BRepBuilderAPI_Transform.hxx>
#include <BRep_Builder.hxx>
#include <StepGeom_CartesianPoint.hxx>
#include <StepGeom_CartesianTransformationOperator3d.hxx>
#include <StepGeom_Direction.hxx>
#include <StepRepr_MappedItem.hxx>
#include <StepRepr_RepresentationRelationshipWithTransformation.hxx>
#include <StepRepr_Transformation.hxx>
#include <StepShape_ShapeRepresentation.hxx>
#include <TColStd_HArray1OfReal.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TopLoc_Datum3D.hxx>
#include <TopLoc_Location.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Iterator.hxx>
#include <gp_Ax1.hxx>

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "server/cad/vectors.h"

namespace takt::cad {

namespace {

using Operator = StepGeom_CartesianTransformationOperator3d;

constexpr double kFar =
    1e12;  ///< x of the shifts; y is a multiple of it. A product of that size has no digits for a mm
constexpr double kOutside = 1e-4 * kFar;  ///< no product is so far out; of a file in nm it is a shift
constexpr double kSame = 1e-9;
constexpr double kSameNumber = 1e-14;  ///< relative: a shift that was moved by 0.01 mm differs by more
constexpr double kMark_rad = 1.0;  ///< turn about z of each shift: two of them are no shift of twice the unit

Vec3 vector_of(const Handle(StepGeom_Direction) & direction) {
  Vec3 v = Vec3::Zero();
  for (int i = 0; i < std::min(3, direction->NbDirectionRatios()); ++i)
    v[i] = direction->DirectionRatiosValue(i + 1);
  return v;
}

Handle(StepGeom_Direction) direction(const Vec3& v) {
  const Handle(TColStd_HArray1OfReal) ratios = new TColStd_HArray1OfReal(1, 3);
  for (int i = 0; i < 3; ++i) ratios->SetValue(i + 1, v[i]);
  const Handle(StepGeom_Direction) made = new StepGeom_Direction;
  made->Init(new TCollection_HAsciiString(""), ratios);
  return made;
}

/// The axes as columns, by base_axis of ISO 10303-42: u3, then u1, then u2, each at right angles to those before it.
Mat3 axes_of(const Operator& op) {
  const Vec3 z = op.HasAxis3() ? vector_of(op.Axis3()).normalized() : Vec3::UnitZ();
  const Vec3 along = op.HasAxis1() ? vector_of(op.Axis1()) : Vec3::UnitX();
  Vec3 x = along - along.dot(z) * z;
  if (x.norm() < kSame) x = Vec3::UnitY() - z.y() * z;
  x.normalize();
  const Vec3 y = z.cross(x), stated = op.HasAxis2() ? vector_of(op.Axis2()) : y;
  Mat3 axes;
  axes.col(0) = x, axes.col(1) = stated.dot(y) < 0.0 ? Vec3(-y) : y, axes.col(2) = z;
  return axes;
}

double scale_of(const Operator& op) {
  return op.HasScale() ? op.Scale() : 1.0;
}

bool changes_shapes(const Operator& op) {
  return axes_of(op).determinant() < 0.0 || std::abs(scale_of(op) - 1.0) > kSame;
}

gp_Trsf transformation(const Operator& op) {
  const Mat3 A = scale_of(op) * axes_of(op);
  Vec3 p = Vec3::Zero();
  if (const auto origin = op.LocalOrigin(); !origin.IsNull())
    for (int i = 0; i < std::min(3, origin->NbCoordinates()); ++i) p[i] = origin->CoordinatesValue(i + 1);
  gp_Trsf X;
  X.SetValues(A(0, 0), A(0, 1), A(0, 2), p.x(), A(1, 0), A(1, 1), A(1, 2), p.y(), A(2, 0), A(2, 1), A(2, 2),
              p.z());
  return X;
}

void make_shift(Operator& op, const Vec3& shift) {
  const Vec3 x(std::cos(kMark_rad), std::sin(kMark_rad), 0.0);
  op.SetAxis1(direction(x)), op.SetAxis2(direction(Vec3::UnitZ().cross(x)));
  op.SetAxis3(direction(Vec3::UnitZ()));
  op.UnSetScale();
  const Handle(StepGeom_CartesianPoint) origin = new StepGeom_CartesianPoint;
  origin->Init3D(new TCollection_HAsciiString(""), shift.x(), shift.y(), shift.z());
  op.SetLocalOrigin(origin);
}

bool is_item_of_shape(const Interface_InterfaceModel& model, const Handle(StepRepr_MappedItem) & item) {
  for (int i = 1; i <= model.NbEntities(); ++i) {
    const auto shape = Handle(StepShape_ShapeRepresentation)::DownCast(model.Value(i));
    for (int k = 1; !shape.IsNull() && k <= shape->NbItems(); ++k)
      if (shape->ItemsValue(k) == item) return true;
  }
  return false;
}

}  // namespace

StepOperators::StepOperators(const Interface_InterfaceModel& model) {
  std::vector<Handle(Operator)> placing;
  const auto add = [&](const Handle(Operator) & op) {
    if (!op.IsNull() && changes_shapes(*op) && std::find(placing.begin(), placing.end(), op) == placing.end())
      placing.push_back(op);
  };
  for (int i = 1; i <= model.NbEntities(); ++i) {
    const Handle(Standard_Transient)& entity = model.Value(i);
    if (const auto item = Handle(StepRepr_MappedItem)::DownCast(entity); !item.IsNull()) {
      const auto op = Handle(Operator)::DownCast(item->MappingTarget());
      // Drawings have such items, too.
      if (!op.IsNull() && is_item_of_shape(model, item)) add(op);
    }
    if (const auto related = Handle(StepRepr_RepresentationRelationshipWithTransformation)::DownCast(entity);
        !related.IsNull())
      add(Handle(Operator)::DownCast(related->TransformationOperator().Value()));
  }
  for (const auto& op : placing) {
    own_.push_back(transformation(*op));
    make_shift(*op, kFar * Vec3(1.0, static_cast<double>(own_.size()), 0.0));
  }
}

gp_Trsf StepOperators::placement(const gp_Trsf& transferred, std::string& problem) const {
  if (own_.empty() || transferred.TranslationPart().Modulus() < kOutside) return transferred;
  const bool inverted = transferred.VectorialPart().Value(2, 1) < 0.0;
  const gp_Trsf shift = inverted ? transferred.Inverted() : transferred;
  const gp_XYZ p = shift.TranslationPart();
  gp_Trsf mark;
  mark.SetRotation(gp_Ax1(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1)), kMark_rad);
  double turn = 0.0;
  for (int r = 1; r <= 3; ++r)
    for (int c = 1; c <= 3; ++c)
      turn = std::max(turn, std::abs(shift.VectorialPart().Value(r, c) - mark.VectorialPart().Value(r, c)));
  const double number = p.Y() / p.X();
  const auto at = static_cast<std::size_t>(std::lround(std::clamp(number, 0.0, 1e6)));
  const bool alone = turn < kSame && p.X() > 0.0 && at >= 1 && at <= own_.size() &&
                     std::abs(number - static_cast<double>(at)) < kSameNumber * number &&
                     std::abs(p.Z()) < kSameNumber * p.X();
  if (!alone) {
    problem =
        "a CARTESIAN_TRANSFORMATION_OPERATOR_3D that mirrors or scales is combined with another placement, "
        "which takt "
        "does not read; allowed: one placement for each use. In the CAD program, make the part one of its "
        "own";
    return transferred;
  }
  gp_Trsf own = own_[at - 1];
  own.SetTranslationPart(gp_Vec(own.TranslationPart() * (p.X() / kFar)));
  return inverted ? own.Inverted() : own;
}

TopoDS_Shape StepOperators::placed(const TopoDS_Shape& transferred, std::string& problem) const {
  if (own_.empty()) return transferred;
  // A location is a product of those that the shape went through, each as it was made.
  gp_Trsf X;
  bool changed = false;
  for (TopLoc_Location rest = transferred.Location(); !rest.IsIdentity(); rest = rest.NextLocation()) {
    const gp_Trsf one = rest.FirstDatum()->Trsf();
    changed = changed || one.TranslationPart().Modulus() >= kOutside;
    const gp_Trsf own = placement(one, problem);
    for (int i = 0; i < std::abs(rest.FirstPower()); ++i)
      X.Multiply(rest.FirstPower() > 0 ? own : own.Inverted());
  }
  TopoDS_Shape shape = transferred.Located(TopLoc_Location());
  if (shape.ShapeType() == TopAbs_COMPOUND) {
    TopoDS_Compound whole;
    BRep_Builder builder;
    builder.MakeCompound(whole);
    for (TopoDS_Iterator at(shape, false, false); at.More(); at.Next())
      builder.Add(whole, placed(at.Value(), problem));
    whole.Orientation(shape.Orientation());
    shape = whole;
  }
  if (changed) return BRepBuilderAPI_Transform(shape, X, true).Shape();
  return shape.Moved(transferred.Location());
}

}  // namespace takt::cad
