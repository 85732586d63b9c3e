#include "server/cad/step_reader.h"

#include <BRepBuilderAPI_MakeSolid.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRep_Tool.hxx>
#include <IFSelect_ReturnStatus.hxx>
#include <Message.hxx>
#include <Message_Messenger.hxx>
#include <OSD.hxx>
#include <Quantity_ColorRGBA.hxx>
#include <STEPCAFControl_ExternFile.hxx>
#include <STEPCAFControl_Reader.hxx>
#include <Standard_ErrorHandler.hxx>
#include <Standard_Failure.hxx>
#include <TCollection_AsciiString.hxx>
#include <TDF_AttributeIterator.hxx>
#include <TDF_LabelSequence.hxx>
#include <TDF_Tool.hxx>
#include <TDataStd_Name.hxx>
#include <TDataStd_TreeNode.hxx>
#include <TDocStd_Document.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <XCAFApp_Application.hxx>
#include <XCAFDoc.hxx>
#include <XCAFDoc_ColorTool.hxx>
#include <XCAFDoc_DocumentTool.hxx>
#include <XCAFDoc_Material.hxx>
#include <XCAFDoc_MaterialTool.hxx>
#include <XCAFDoc_ShapeTool.hxx>
#include <XSControl_WorkSession.hxx>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string_view>

#include "idl/common/text.h"
#include "server/cad/body_bytes.h"
#include "server/cad/child_process.h"
#include "server/cad/sewn_solids.h"
#include "server/cad/solid_mesh.h"
#include "server/cad/step_operators.h"
#include "server/cad/step_preparation.h"
#include "server/cad/step_structure.h"
#include "server/cad/step_text.h"
#include "server/cad/time_limit.h"
#include "server/product/names.h"

namespace takt::cad {

namespace {

using product::Body;
using product::Instance;
using product::is_generic;
using product::Product;

constexpr double kMm = 1e-3;
constexpr std::size_t kDeepest = 100;      ///< levels of assemblies
constexpr std::size_t kMostUses = 20'000;  ///< of parts and assemblies: each level may double them

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& reason) {
  throw CadError(file.string() + ": " + reason);
}

std::string name_of(const TDF_Label& label) {
  Handle(TDataStd_Name) name;
  if (!label.FindAttribute(TDataStd_Name::GetID(), name)) return {};
  return TCollection_AsciiString(name->Get()).ToCString();
}

std::string entry_of(const TDF_Label& label) {
  TCollection_AsciiString entry;
  TDF_Tool::Entry(label, entry);
  return entry.ToCString();
}

}  // namespace

class StepFile::Reader {
 public:
  Reader(const std::filesystem::path& file, const StepOptions& options)
      : file_(std::filesystem::absolute(file)), options_(options) {}

  const Product& product() const { return product_; }

  TriangleMesh finer_mesh(std::size_t body, const std::vector<double>& face_deflections_m) const {
    // In a process of its own, as try_make_body.
    const ChildResult result = run_in_child(
        [&] {
          Body made;
          try {
            OCC_CATCH_SIGNALS
            made.mesh = cad::finer_mesh(solids_[body], options_.deflection_m, options_.angular_deflection_rad,
                                        product_.bodies[body], face_deflections_m);
          } catch (const Standard_Failure&) {
            made.mesh = {};
          }
          return bytes_of(made, {});
        },
        options_.time_limit_s);
    if (!result.problem.empty()) return {};
    Body made;
    std::vector<std::string> notes;
    take_bytes(result.bytes, made, notes);
    return std::move(made.mesh);
  }

  void read() {
    const TimeLimit limit("takt-from-cad: " + file_.string() + ": reading it takes more than " +
                              std::to_string(options_.reading_limit_s) +
                              " s of computing; it may be damaged. A larger --time-limit gives it more time",
                          options_.reading_limit_s);
    load();
    product_.name = file_.stem().string();
    product_.source = file_.string();
    shapes_ = XCAFDoc_DocumentTool::ShapeTool(document_->Main());
    colours_ = XCAFDoc_DocumentTool::ColorTool(document_->Main());
    TDF_LabelSequence roots;
    shapes_->GetFreeShapes(roots);
    for (int i = 1; i <= roots.Length(); ++i) {
      if (i == 1 && roots.Length() == 1 && !is_generic(name_of(roots.Value(1))))
        product_.name = name_of(roots.Value(1));
      visit(roots.Value(i), gp_Trsf(), "", {});
    }
    note_unread_files();
    if (product_.instances.empty()) {
      std::string reason = "found no solid";
      for (const std::string& note : product_.notes) reason += "; " + note;
      fail(
          file_,
          reason +
              (files_missing_
                   ? "; put the files that it refers to into its folder, under the names that it states"
                   : "; allowed: a STEP file with solids (in the CAD program, export solids, not surfaces)"));
    }
    product::make_names_unique(product_.instances);
  }

 private:
  void load() {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file_, error)) fail(file_, "there is no such file");
    std::ifstream in(file_, std::ios::binary);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    constexpr std::size_t kEnds = 4096;  // where begin and end of the exchange structure are looked for
    if (std::string_view(text).substr(0, kEnds).find("ISO-10303-21") == text.npos)
      fail(file_, "it does not begin with ISO-10303-21; allowed: a STEP file (AP203, AP214, AP242)");
    if (std::string_view(text).substr(text.size() - std::min(text.size(), kEnds)).find("END-ISO-10303-21") ==
        text.npos)
      fail(file_, "it ends before END-ISO-10303-21: the file is cut off; allowed: a whole STEP file");
    product_.notes = damage_of_step_text(text);
    if (std::string note = unread_tessellation(text); !note.empty())
      product_.notes.push_back(std::move(note));
    Message::DefaultMessenger()->ChangePrinters().Clear();
    XCAFApp_Application::GetApplication()->NewDocument("MDTV-XCAF", document_);
    prepare_models_of_transfers();
    STEPCAFControl_Reader reader;
    reader.SetColorMode(true);
    reader.SetNameMode(true);
    reader.SetMatMode(true);
    const std::string encoded = with_encoded_apostrophes(text);
    std::istringstream in_memory(encoded);
    const IFSelect_ReturnStatus status = encoded.empty()
                                             ? reader.ReadFile(file_.c_str())
                                             : reader.ChangeReader().ReadStream(file_.c_str(), in_memory);
    if (status != IFSelect_RetDone)
      fail(file_,
           "it cannot be read as STEP: its entities are damaged, or not those of AP203, AP214 or AP242");
    const StepStructure structure = structure_of(*reader.ChangeReader().WS()->Model());
    if (!structure.cyclic.empty())
      fail(
          file_,
          "assembly '" + structure.cyclic +
              "' uses itself, directly or by others; allowed: assemblies of other parts (NEXT_ASSEMBLY_USAGE_"
              "OCCURRENCE). In the CAD program, export the product again");
    if (structure.uses > static_cast<double>(kMostUses)) fail_of_size(structure.largest);
    operators_.emplace(*reader.ChangeReader().WS()->Model());
    if (!reader.Transfer(document_))
      fail(file_, "its shapes cannot be transferred: entities are missing or damaged");
    uses_ = structure.uses;
    find_unread_files(reader);
  }

  [[noreturn]] void fail_of_size(const std::string& assembly) const {
    fail(file_, "assembly '" + assembly + "' uses parts and assemblies more than " +
                    std::to_string(kMostUses) +
                    " times, those within others counted each time; allowed: at most so many. In the CAD "
                    "program, export "
                    "a part of the product");
  }

  void find_unread_files(const STEPCAFControl_Reader& reader) {
    using Files = NCollection_DataMap<TCollection_AsciiString, Handle(STEPCAFControl_ExternFile)>;
    for (Files::Iterator at(reader.ExternFiles()); at.More(); at.Next())
      if (at.Value().IsNull() || at.Value()->GetLoadStatus() != IFSelect_RetDone ||
          !at.Value()->GetTransferStatus()) {
        unread_files_.emplace_back(at.Key().ToCString());
      }
  }

  /// CATIA names the source of each part, and writes its shape into the file all the same.
  void note_unread_files() {
    files_missing_ =
        !unread_files_.empty() && (uses_ >= static_cast<double>(visited_) || !shapeless_.empty());
    if (!files_missing_) return;
    for (const std::string& file : unread_files_)
      product_.notes.push_back("the file '" + file +
                               "', which it refers to, cannot be read beside it; its parts are missing");
  }

  void visit(const TDF_Label& label, const gp_Trsf& X_WP, const std::string& above,
             std::vector<TDF_Label> uses) {
    if (uses.size() > kDeepest)
      fail(file_, "its structure is nested deeper than " + std::to_string(kDeepest) + " levels");
    if (++visited_ > kMostUses) fail_of_size(above);
    TDF_Label part = label;
    gp_Trsf X = X_WP;
    uses.push_back(label);
    std::string name = name_of(label);
    if (XCAFDoc_ShapeTool::IsReference(label)) {
      std::string problem;
      X = X_WP * operators_->placement(XCAFDoc_ShapeTool::GetLocation(label).Transformation(), problem);
      if (!problem.empty()) fail(file_, "'" + above + "': " + problem);
      XCAFDoc_ShapeTool::GetReferredShape(label, part);
      if (is_generic(name)) name = name_of(part);
    }
    if (is_generic(name)) name = above.empty() ? "Part" : above.substr(above.rfind('/') + 1);
    const std::string path = above.empty() ? name : above + "/" + name;
    if (XCAFDoc_ShapeTool::IsAssembly(part)) {
      TDF_LabelSequence components;
      XCAFDoc_ShapeTool::GetComponents(part, components, false);
      for (int i = 1; i <= components.Length(); ++i) visit(components.Value(i), X, path, uses);
      return;
    }
    add_part(part, X, name, path, uses);
  }

  void add_part(const TDF_Label& part, const gp_Trsf& X, const std::string& name, const std::string& path,
                const std::vector<TDF_Label>& uses) {
    // A mirrored or scaled use needs a body of its own.
    const bool rigid = !X.IsNegative() && std::abs(X.ScaleFactor() - 1.0) < 1e-9;
    const std::vector<std::size_t>& bodies = this->bodies(
        part, name, rigid ? "" : "|" + path + "|" + std::to_string(product_.instances.size()), X, rigid);
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      Instance instance;
      instance.name = product::key_of(bodies.size() == 1 ? name : name + "_" + std::to_string(i + 1));
      instance.path = path;
      instance.body = bodies[i];
      if (rigid) {
        const gp_Mat R = X.VectorialPart();
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3; ++c) instance.X_WB.R(r, c) = R.Value(r + 1, c + 1);
        instance.X_WB.p =
            Vec3(X.TranslationPart().X(), X.TranslationPart().Y(), X.TranslationPart().Z()) * kMm;
      }
      Body& body = product_.bodies[bodies[i]];
      if (!body.colour) body.colour = colour_of(part, uses);
      product_.instances.push_back(std::move(instance));
    }
  }

  const std::vector<std::size_t>& bodies(const TDF_Label& part, const std::string& name,
                                         const std::string& extra, const gp_Trsf& X, bool rigid) {
    const std::string key = entry_of(part) + extra;
    const auto known = made_.find(key);
    if (known != made_.end()) return known->second;
    std::vector<std::size_t>& made = made_[key];
    TopoDS_Shape shape = XCAFDoc_ShapeTool::GetShape(part);
    if (shape.IsNull() || !TopExp_Explorer(shape, TopAbs_FACE).More()) shapeless_.push_back(name);
    if (shape.IsNull()) return made;
    std::string problem;
    shape = operators_->placed(shape, problem);
    if (!problem.empty()) fail(file_, "'" + name + "': " + problem);
    if (!rigid) shape = BRepBuilderAPI_Transform(shape, X, true).Shape();
    for (const TopoDS_Shape& solid : solids_of(shape, name)) {
      Body body;
      body.name = name;
      if (!try_make_body(solid, body)) continue;
      body.material = material_of(part, name);
      made.push_back(product_.bodies.size());
      product_.bodies.push_back(std::move(body));
      solids_.push_back(solid);
    }
    return made;
  }

  /// A fault in one solid leaves the others: in a process of its own it may hang or crash.
  bool try_make_body(const TopoDS_Shape& solid, Body& body) {
    constexpr char kMade = '1', kNone = '0';
    const ChildResult result = run_in_child(
        [&] {
          Body made;
          made.name = body.name;
          std::vector<std::string> notes;
          const bool whole = make_body_or_note(solid, made, notes);
          return (whole ? kMade : kNone) + bytes_of(made, notes);
        },
        options_.time_limit_s);
    if (!result.problem.empty()) {
      product_.notes.push_back(body.name + ": OpenCASCADE does not mesh it (" + result.problem +
                               "); the body is left out. --time-limit gives it more time");
      return false;
    }
    take_bytes(result.bytes.substr(1), body, product_.notes);
    return result.bytes.front() == kMade;
  }

  bool make_body_or_note(const TopoDS_Shape& solid, Body& body, std::vector<std::string>& notes) const {
    try {
      OCC_CATCH_SIGNALS
      return make_body(solid, options_.deflection_m, options_.angular_deflection_rad, body, notes);
    } catch (const Standard_Failure& failure) {
      notes.push_back(body.name + ": OpenCASCADE cannot mesh it (" + failure.GetMessageString() +
                      "); the body is left out");
      return false;
    }
  }

  std::vector<TopoDS_Shape> solids_of(const TopoDS_Shape& shape, const std::string& name) {
    std::vector<TopoDS_Shape> solids;
    for (TopExp_Explorer at(shape, TopAbs_SOLID); at.More(); at.Next()) solids.push_back(at.Current());
    std::vector<TopoDS_Shape> open_surfaces;
    for (TopExp_Explorer at(shape, TopAbs_SHELL, TopAbs_SOLID); at.More(); at.Next()) {
      const TopoDS_Shell shell = TopoDS::Shell(at.Current());
      BRepBuilderAPI_MakeSolid made(shell);
      if (BRep_Tool::IsClosed(shell) && made.IsDone()) {
        solids.push_back(static_cast<const TopoDS_Shape&>(made.Solid()));
        product_.notes.push_back(name + ": a closed shell is taken for a solid");
      } else {
        open_surfaces.push_back(shell);
      }
    }
    for (TopExp_Explorer at(shape, TopAbs_FACE, TopAbs_SHELL); at.More(); at.Next())
      open_surfaces.push_back(at.Current());
    if (open_surfaces.empty()) return solids;
    const SewnSolids sewn = sew(open_surfaces);
    solids.insert(solids.end(), sewn.solids.begin(), sewn.solids.end());
    if (!sewn.solids.empty())
      product_.notes.push_back(name + ": its surfaces are sewn to " +
                               counted(sewn.solids.size(), "solid", "solids") + ", over gaps of at most " +
                               number_text(sewn.largest_gap_mm, 2) + " mm");
    const int open = sewn.left;
    if (open > 0)
      product_.notes.push_back(name + ": " + std::to_string(open) +
                               (open == 1 ? " surface bounds no solid and is left out"
                                          : " surfaces bound no solid and are left out"));
    return solids;
  }

  std::optional<std::array<float, 4>> colour_of(const TDF_Label& part,
                                                const std::vector<TDF_Label>& uses) const {
    Quantity_ColorRGBA colour;
    const auto found = [&](const TDF_Label& label) {
      return colours_->GetColor(label, XCAFDoc_ColorSurf, colour) ||
             colours_->GetColor(label, XCAFDoc_ColorGen, colour);
    };
    const auto value = [&]() -> std::array<float, 4> {
      Standard_Real r = 0.0, g = 0.0, b = 0.0;
      colour.GetRGB().Values(r, g, b, Quantity_TOC_sRGB);
      return {static_cast<float>(r), static_cast<float>(g), static_cast<float>(b), colour.Alpha()};
    };
    for (auto use = uses.rbegin(); use != uses.rend(); ++use)
      if (found(*use)) return value();
    if (found(part)) return value();
    const TopoDS_Shape shape = XCAFDoc_ShapeTool::GetShape(part);
    for (const TopAbs_ShapeEnum kind : {TopAbs_SOLID, TopAbs_SHELL, TopAbs_FACE})
      for (TopExp_Explorer at(shape, kind); at.More(); at.Next())
        if (colours_->GetColor(at.Current(), XCAFDoc_ColorSurf, colour) ||
            colours_->GetColor(at.Current(), XCAFDoc_ColorGen, colour))
          return value();
    return std::nullopt;
  }

  product::Material material_of(const TDF_Label& part, const std::string& name) {
    std::string stated;
    double density_g_cm3 = 0.0;
    Handle(TDataStd_TreeNode) node;
    if (part.FindAttribute(XCAFDoc::MaterialRefGUID(), node) && node->HasFather()) {
      Handle(TCollection_HAsciiString) text, description, density_name, density_type;
      XCAFDoc_DocumentTool::MaterialTool(document_->Main())
          ->GetMaterial(node->Father()->Label(), text, description, density_g_cm3, density_name,
                        density_type);
      if (!text.IsNull()) stated = text->ToCString();
    }
    double density_kg_m3 = density_g_cm3 * 1000.0;
    constexpr double kLightest = 1.0, kHeaviest = 30'000.0;  // kg/m^3: aerogel, osmium
    if (density_kg_m3 != 0.0 && !(density_kg_m3 >= kLightest && density_kg_m3 <= kHeaviest)) {
      product_.notes.push_back(
          name + ": its density is " + number_text(density_kg_m3, 3) +
          " kg/m3 in the file, which no solid has: that of the material's name is assumed, or else steel");
      density_kg_m3 = 0.0;
    }
    return product::material_of(stated, name, density_kg_m3, options_.densities);
  }

  const std::filesystem::path file_;
  const StepOptions options_;
  Product product_;
  std::vector<TopoDS_Shape> solids_;  ///< by body
  Handle(TDocStd_Document) document_;
  Handle(XCAFDoc_ShapeTool) shapes_;
  Handle(XCAFDoc_ColorTool) colours_;
  std::optional<StepOperators> operators_;
  std::size_t visited_ = 0;
  double uses_ = 0.0;                                     ///< of parts and assemblies, as the file states
  std::vector<std::string> unread_files_;                 ///< which the file refers to
  std::vector<std::string> shapeless_;                    ///< parts
  bool files_missing_ = false;                            ///< which hold parts
  std::map<std::string, std::vector<std::size_t>> made_;  ///< bodies by label of the part
};

StepFile::StepFile(const std::filesystem::path& file, const StepOptions& options)
    : reader_(std::make_unique<Reader>(file, options)) {
  try {
    OSD::SetSignal(false);  // a crash in OpenCASCADE becomes an exception
    OCC_CATCH_SIGNALS
    reader_->read();
  } catch (const Standard_Failure& failure) {
    fail(file, std::string("OpenCASCADE cannot read it: ") + failure.GetMessageString());
  }
}

StepFile::~StepFile() = default;

const product::Product& StepFile::product() const {
  return reader_->product();
}

TriangleMesh StepFile::finer_mesh(std::size_t body, const std::vector<double>& face_deflections_m) const {
  return reader_->finer_mesh(body, face_deflections_m);
}

product::Product read_step(const std::filesystem::path& file, const StepOptions& options) {
  return StepFile(file, options).product();
}

}  // namespace takt::cad
