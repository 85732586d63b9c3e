#pragma once
// STEP files of products, made with OpenCASCADE. Lengths in mm.
#include <BRepAlgoAPI_Cut.hxx>
#include <BRepAlgoAPI_Fuse.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepMesh_IncrementalMesh.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <Interface_Static.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <Quantity_Color.hxx>
#include <RWGltf_CafWriter.hxx>
#include <STEPCAFControl_Writer.hxx>
#include <TColStd_IndexedDataMapOfStringString.hxx>
#include <TCollection_HAsciiString.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDataStd_Name.hxx>
#include <TDocStd_Document.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_MaterialTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <filesystem>
#include <string>

namespace takt::test {

class StepProduct {
 public:
  explicit StepProduct(const std::string& name) {
    Message::DefaultMessenger()->ChangePrinters().Clear();
    XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document_);
    shapes_ = XCAFDoc_DocumentTool::ShapeTool(document_->Main());
    root_ = shapes_->NewShape();
    TDataStd_Name::Set(root_, name.c_str());
  }
  TDF_Label root() const { return root_; }
  TDF_Label part(const std::string& name, const TopoDS_Shape& shape) {
    const TDF_Label label = shapes_->AddShape(shape, false);
    TDataStd_Name::Set(label, name.c_str());
    return label;
  }
  TDF_Label assembly(const std::string& name) {
    const TDF_Label label = shapes_->NewShape();
    TDataStd_Name::Set(label, name.c_str());
    return label;
  }
  void use(const TDF_Label& above, const TDF_Label& part, const std::string& name,
           const gp_Trsf& where = {}) {
    TDataStd_Name::Set(shapes_->AddComponent(above, part, TopLoc_Location(where)), name.c_str());
  }
  void colour(const TDF_Label& part, double r, double g, double b) {
    XCAFDoc_DocumentTool::ColorTool(document_->Main())
        ->SetColor(part, Quantity_Color(r, g, b, Quantity_TOC_sRGB), XCAFDoc_ColorSurf);
  }
  void material(const TDF_Label& part, const std::string& name, double density_g_cm3) {
    const auto text = [](const std::string& t) { return new TCollection_HAsciiString(t.c_str()); };
    XCAFDoc_DocumentTool::MaterialTool(document_->Main())
        ->SetMaterial(part, text(name), text(name), density_g_cm3, text("density measure"),
                      text("POSITIVE_RATIO_MEASURE"));
  }
  void write(const std::filesystem::path& file, const char* unit = "MM") {
    shapes_->UpdateAssemblies();
    STEPCAFControl_Writer writer;
    Interface_Static::SetCVal("write.step.unit", unit);
    writer.Transfer(document_);
    writer.Write(file.c_str());
    Interface_Static::SetCVal("write.step.unit", "MM");
  }
  /// Facets are within 0.1 mm and 0.2 rad of the surface, y is up, lengths are in m.
  void write_glb(const std::filesystem::path& file) {
    shapes_->UpdateAssemblies();
    TDF_LabelSequence roots;
    shapes_->GetFreeShapes(roots);
    for (int i = 1; i <= roots.Length(); ++i)
      BRepMesh_IncrementalMesh(XCAFDoc_ShapeTool::GetShape(roots.Value(i)), 0.1, false, 0.2, false);
    RWGltf_CafWriter writer(file.c_str(), true);
    writer.ChangeCoordinateSystemConverter().SetInputLengthUnit(0.001);
    writer.ChangeCoordinateSystemConverter().SetInputCoordinateSystem(RWMesh_CoordinateSystem_Zup);
    writer.Perform(document_, TColStd_IndexedDataMapOfStringString(), Message_ProgressRange());
  }
  /// Each part in a file of its own beside `file`, whose names begin with `prefix`.
  void write_apart(const std::filesystem::path& file, const char* prefix) {
    shapes_->UpdateAssemblies();
    STEPCAFControl_Writer writer;
    writer.Transfer(document_, STEPControl_AsIs, prefix);
    writer.Write(file.c_str());
  }

 private:
  Handle(TDocStd_Document) document_;
  Handle(XCAFDoc_ShapeTool) shapes_;
  TDF_Label root_;
};

inline TopoDS_Shape box(double x, double y, double z) {
  return BRepPrimAPI_MakeBox(x, y, z).Shape();
}

inline TopoDS_Shape cylinder(double radius, double height) {
  return BRepPrimAPI_MakeCylinder(radius, height).Shape();
}

inline TopoDS_Shape rod(const gp_Pnt& from, const gp_Dir& along, double radius, double length) {
  return BRepPrimAPI_MakeCylinder(gp_Ax2(from, along), radius, length).Shape();
}
/// A cylinder along z.
inline TopoDS_Shape upright(double radius, double x, double y, double from, double to) {
  return rod(gp_Pnt(x, y, from), gp_Dir(0, 0, 1), radius, to - from);
}

inline gp_Trsf moved_by(double x, double y, double z) {
  gp_Trsf X;
  X.SetTranslation(gp_Vec(x, y, z));
  return X;
}

}  // namespace takt::test
