// takt-from-cad: a STEP or glTF file as a running cell. Reads the product, finds what touches what, the order of disassembly and the
// hierarchy, and writes meshes and a scenario.
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <future>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "idl/command_line/commands.h"
#include "idl/command_line/numbers.h"
#include "idl/common/text.h"
#include "server/cad/step_reader.h"
#include "server/product/cell_writer.h"
#include "server/product/contacts.h"
#include "server/product/disassembly.h"
#include "server/product/duplicates.h"
#include "server/product/exploded_view.h"
#include "server/product/fine_faces.h"
#include "server/product/glb_assembly.h"
#include "server/tools/takt_from_cad/picture.h"
#include "server/tools/takt_from_cad/robot_trial.h"

namespace takt {
namespace {

constexpr int kUsage = 2;
constexpr std::size_t kMostFine = 20'000;  ///< triangles of a body; larger ones take long to load

struct Arguments {
  std::string file, directory, up = "z";
  double deflection_mm = 0.1, scale = 1.0;
  bool deflection_given = false;
  int time_limit_s = 60;
  std::vector<std::string> densities;
  bool json = false, list = false, robot = false;
};

nlohmann::json numbers(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

std::map<std::string, double> densities_of(const std::vector<std::string>& texts) {
  std::map<std::string, double> densities;
  for (const std::string& text : texts) {
    const std::size_t at = text.rfind('=');
    const std::string problem =
        at == std::string::npos ? "no '='" : command_line::positive()(text.substr(at + 1));
    if (!problem.empty())
      throw std::runtime_error("--density: found '" + text + "' (" + problem +
                               "); allowed: NAME=KG_PER_M3, e.g. Housing=2700 or '*=7850'");
    densities[text.substr(0, at)] = std::stod(text.substr(at + 1));
  }
  return densities;
}

/// Turns the product so that its axis `up` becomes world z, and scales it.
void orient(product::Product& product, const std::string& up, double scale) {
  Mat3 R = Mat3::Identity();
  const std::map<std::string, Vec3> axes{{"z", Vec3(0, 0, 1)}, {"-z", Vec3(0, 0, -1)},
                                         {"y", Vec3(0, 1, 0)}, {"-y", Vec3(0, -1, 0)},
                                         {"x", Vec3(1, 0, 0)}, {"-x", Vec3(-1, 0, 0)}};
  const Vec3& z = axes.at(up);
  if (up != "z") {
    R.row(2) = z.transpose();
    R.row(0) = (std::abs(z.x()) > 0.5 ? Vec3(0, 1, 0) : Vec3(1, 0, 0)).transpose();
    R.row(1) = z.cross(R.row(0).transpose()).transpose();
  }
  for (product::Instance& instance : product.instances)
    instance.X_WB = {R * instance.X_WB.R, R * instance.X_WB.p * scale};
  if (scale == 1.0) return;
  for (product::Body& body : product.bodies) {
    for (Vec3& v : body.mesh.vertices) v *= scale;
    for (product::Face& face : body.faces)
      face.point_B *= scale, face.radius_m *= scale, face.pitch_m *= scale, face.area_m2 *= scale * scale;
    body.exact.volume *= scale * scale * scale;
    body.exact.p_BBcm *= scale;
    body.exact.G_BBcm_B *= scale * scale;
    body.deflection_m *= scale;
  }
}

void note_size(product::Product& product) {
  double size = 0.0;
  for (const product::Instance& instance : product.instances)
    for (const Vec3& v : product.bodies[instance.body].mesh.vertices)
      size = std::max(size, (instance.X_WB * v).cwiseAbs().maxCoeff());
  if (size > 3.0)
    product.notes.push_back("a point of the product is " + std::to_string(size) +
                            " m from its origin: is the unit of the file right? --scale 0.001 makes m to mm, "
                            "0.03937 inches to mm");
}

nlohmann::json description(const product::Product& product, const product::Disassembly* plan,
                           const product::Hierarchy* hierarchy) {
  nlohmann::json result{{"name", product.name}, {"source", product.source}, {"notes", product.notes}};
  for (std::size_t i = 0; i < product.instances.size(); ++i) {
    const product::Instance& instance = product.instances[i];
    const product::Body& body = product.bodies[instance.body];
    const Quat q = instance.X_WB.quaternion();
    nlohmann::json part{{"name", instance.name},
                        {"path", instance.path},
                        {"body", instance.body},
                        {"position_m", numbers(instance.X_WB.p)},
                        {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}},
                        {"volume_m3", body.exact.volume},
                        {"center_of_mass_m", numbers(instance.X_WB * body.exact.p_BBcm)},
                        {"mass_kg", body.exact.volume * body.material.density_kg_m3},
                        {"material", body.material.name},
                        {"density_kg_m3", body.material.density_kg_m3},
                        {"density_assumed", body.material.assumed},
                        {"faces", body.faces.size()},
                        {"triangles", body.mesh.triangles.size()}};
    if (body.colour) part["color"] = *body.colour;
    if (hierarchy != nullptr) part["hierarchy"] = hierarchy->numbers[i];
    result["parts"].push_back(std::move(part));
  }
  if (plan == nullptr) return result;
  const auto name = [&](std::size_t i) { return product.instances[i].name; };
  const auto advice = product::level_advice(product);
  result["contacts"] = nlohmann::json::array();
  for (std::size_t i = 0; i < product.contacts.size(); ++i) {
    const product::Contact& contact = product.contacts[i];
    nlohmann::json one{{"parts", {name(contact.first), name(contact.second)}},
                       {"kind", product::to_string(contact.kind)},
                       {"area_m2", contact.area_m2},
                       {"clearance_m", contact.clearance_m},
                       {"axis", numbers(contact.axis_W)},
                       {"point_m", numbers(contact.point_W)},
                       {"level_of_detail", advice[i].level}};
    if (contact.kind == product::ContactKind::thread) one["pitch_m"] = contact.pitch_m;
    if (!advice[i].reason.empty()) one["reason"] = advice[i].reason;
    result["contacts"].push_back(std::move(one));
  }
  result["base"] = name(plan->base);
  result["disassembly"] = nlohmann::json::array();
  for (const product::RemovalStep& step : plan->steps) {
    nlohmann::json one{{"loosening", product::to_string(step.loosening)},
                       {"direction", numbers(step.direction_W)}};
    for (const std::size_t i : step.parts) one["parts"].push_back(name(i));
    if (!step.reason.empty()) one["reason"] = step.reason;
    result["disassembly"].push_back(std::move(one));
  }
  result["stuck"] = nlohmann::json::array();
  for (const auto& group : plan->stuck) {
    nlohmann::json names;
    for (const std::size_t i : group) names.push_back(name(i));
    result["stuck"].push_back(std::move(names));
  }
  return result;
}

void print_parts(const product::Product& product, const product::Hierarchy* hierarchy) {
  int width = 4, material_width = 8;
  for (const product::Instance& instance : product.instances) {
    width = std::max(width, static_cast<int>(instance.name.size()));
    material_width =
        std::max(material_width, static_cast<int>(product.bodies[instance.body].material.name.size()));
  }
  std::printf("%-*s  %12s  %10s  %-*s  %s%s\n", width, "part", "volume cm3", "mass kg", material_width,
              "material", hierarchy != nullptr ? "hierarchy  " : "", "in the file");
  for (std::size_t i = 0; i < product.instances.size(); ++i) {
    const product::Instance& instance = product.instances[i];
    const product::Body& body = product.bodies[instance.body];
    std::printf("%-*s  %12.6g  %10.5g  %-*s  ", width, instance.name.c_str(), body.exact.volume * 1e6,
                body.exact.volume * body.material.density_kg_m3, material_width, body.material.name.c_str());
    if (hierarchy != nullptr) std::printf("%9d  ", hierarchy->numbers[i]);
    std::printf("%s\n", instance.path.c_str());
  }
}

/// `step_file`: the file where it is one of STEP.
product::Product read(const Arguments& a, std::unique_ptr<cad::StepFile>& step_file) {
  const std::string format = lower_text(std::filesystem::path(a.file).extension().string());
  if (format == ".glb" || format == ".gltf") {
    if (a.deflection_given)
      throw std::runtime_error("--deflection: the meshes of " + a.file +
                               " are what they are; leave the option out, or give a STEP file");
    return product::read_glb_assembly(a.file, densities_of(a.densities));
  }
  cad::StepOptions options;
  options.deflection_m = a.deflection_mm * 1e-3;
  options.densities = densities_of(a.densities);
  options.time_limit_s = a.time_limit_s;
  constexpr int kReading = 10;  // a file has many solids
  options.reading_limit_s = kReading * a.time_limit_s;
  step_file = std::make_unique<cad::StepFile>(a.file, options);
  return step_file->product();
}

/// By how much coarser the mesh of a body is made that has more than kMostFine triangles. Their number falls with the
/// deflection on freeform faces, on round ones with its root: at first the lesser step.
double coarser(std::size_t triangles, bool first) {
  constexpr double kRoundedUp = 1.2;
  const double ratio = kRoundedUp * static_cast<double>(triangles) / static_cast<double>(kMostFine);
  return first ? ratio : ratio * ratio;
}

/// Meshes for files: finer on faces that touch. What has no finer mesh keeps the one that it has, with a note; likewise where
/// that would have too many triangles however coarse it is.
void refine(product::Product& product, const cad::StepFile& step, const Arguments& a) {
  constexpr int kTries = 3;
  const auto deflections = product::face_deflections(product);
  for (std::size_t b = 0; b < product.bodies.size(); ++b) {
    product::Body& body = product.bodies[b];
    std::vector<double> in_file = deflections[b];
    for (double& deflection_m : in_file) deflection_m /= a.scale;
    double factor = 1.0;
    std::size_t first = 0;  // triangles with the wanted deflections
    for (int k = 0; k < kTries; ++k) {
      if (std::all_of(in_file.begin(), in_file.end(), [](double one) { return one == 0.0; })) break;
      body.contact_mesh = step.finer_mesh(b, in_file);
      const std::size_t triangles = body.contact_mesh.triangles.size();
      if (triangles == 0)
        product.notes.push_back(
            body.name +
            ": OpenCASCADE makes no closed mesh of it that is finer where it touches other parts; its fits "
            "are as coarse as the rest");
      if (triangles <= kMostFine) break;
      if (k == 0) first = triangles;
      body.contact_mesh = {};
      const double more = coarser(triangles, k == 0);
      factor *= more;
      for (double& deflection_m : in_file) {
        deflection_m *= more;
        if (deflection_m >= 1e-3 * a.deflection_mm) deflection_m = 0.0;
      }
    }
    for (Vec3& v : body.contact_mesh.vertices) v *= a.scale;
    if (first > 0)
      product.notes.push_back(
          body.name + ": a mesh that is as fine as its fits need has " + std::to_string(first) +
          " triangles, more than " + std::to_string(kMostFine) +
          (body.contact_mesh.triangles.empty()
               ? ": its fits are as coarse as the rest"
               : ": it is " + number_text(factor, 2) + " times further from the surface than that there"));
  }
}

int run(const Arguments& a) {
  std::unique_ptr<cad::StepFile> step_file;
  product::Product product = read(a, step_file);
  orient(product, a.up, a.scale);
  note_size(product);
  product::leave_out_duplicates(product);
  if (a.list) {
    if (a.json)
      std::cout << description(product, nullptr, nullptr).dump(2) << '\n';
    else
      print_parts(product, nullptr);
    for (const std::string& note : product.notes) std::cerr << "takt-from-cad: note: " << note << '\n';
    return 0;
  }
  product.contacts = product::find_contacts(product);
  product::Disassembly plan = product::take_apart(product);
  const product::Hierarchy hierarchy = product::hierarchy(product, plan);
  if (step_file) refine(product, *step_file, a);
  product::RobotPlan robot;
  product::CellWriter writer(product, hierarchy, a.directory);
  // It is drawn while the cell is tried.
  const auto exploded = std::filesystem::path(a.directory) / "exploded.png";
  std::future<void> picture =
      std::async(std::launch::async, [&product, &exploded, explosion = product::explode(product, plan)] {
        draw_exploded(product, explosion, exploded);
      });
  product::CellFiles files = write_standing_cell(writer, product, plan, hierarchy);
  if (a.robot) files = write_tried_cell(writer, product, plan, robot).value_or(files);
  for (const std::string& note : robot.notes) std::cerr << "takt-from-cad: note: " << note << '\n';
  if (a.robot && robot.moves.empty())
    std::cerr
        << "takt-from-cad: note: the robot takes no part out of the product: there is no cell with a robot\n";
  picture.get();
  for (const std::string& note : files.notes) std::cerr << "takt-from-cad: note: " << note << '\n';
  if (a.json) {
    nlohmann::json result = description(product, &plan, &hierarchy);
    result["scenario"] = files.scenario.string();
    result["exploded_view"] = exploded.string();
    if (!files.robot_scenario.empty()) result["robot_scenario"] = files.robot_scenario.string();
    std::cout << result.dump(2) << '\n';
    return 0;
  }
  print_parts(product, &hierarchy);
  std::printf("\n%zu contacts; base: %s. Order of disassembly:\n", product.contacts.size(),
              product.instances[plan.base].name.c_str());
  int count = 0;
  for (const product::RemovalStep& step : plan.steps) {
    std::printf("%4d  %-8s", ++count, product::to_string(step.loosening));
    for (const std::size_t i : step.parts) std::printf(" %s", product.instances[i].name.c_str());
    const Vec3 d = step.direction_W + Vec3::Zero();
    std::printf("  along (%.3g, %.3g, %.3g)%s%s\n", d.x(), d.y(), d.z(), step.reason.empty() ? "" : ": ",
                step.reason.c_str());
  }
  for (const auto& group : plan.stuck) {
    std::printf("      no straight motion parts");
    for (const std::size_t i : group) std::printf(" %s", product.instances[i].name.c_str());
    std::printf("\n");
  }
  std::printf("\n%s\nExploded view: %s\nRun it: takt-run run %s\n", files.scenario.c_str(), exploded.c_str(),
              files.scenario.c_str());
  if (!files.robot_scenario.empty())
    std::printf("A robot takes it apart and puts it together: takt-run run %s\n",
                files.robot_scenario.c_str());
  return 0;
}

int main_of(int argc, char** argv) {
  CLI::App app{
      "Makes a cell from a STEP or glTF file: parts, meshes, contacts, hierarchy, order of disassembly, "
      "scenario."};
  takt::command_line::wrap_help(app);
  app.name("takt-from-cad");
  app.set_version_flag("--version", std::string(TAKT_VERSION));
  Arguments a;
  app.add_option("PRODUCT", a.file,
                 "STEP file (AP203, AP214, AP242), or glTF file (GLB, or .gltf beside its buffers) with a "
                 "node for each "
                 "part")
      ->required();
  auto* directory = app.add_option("-o,--output", a.directory, "directory for the scenario and its meshes");
  auto* list = app.add_flag("--list", a.list, "print the parts alone; write nothing");
  directory->excludes(list);
  auto* deflection = app.add_option("--deflection", a.deflection_mm,
                                    "largest distance of mesh and surface of a STEP file (mm)");
  deflection->check(command_line::number_from(1e-4, 10.0))->capture_default_str();
  app.add_option("--density", a.densities,
                 "density of a material or part; '*' for all that the file gives none")
      ->option_text("NAME=KG_PER_M3 ...")
      ->type_size(1)
      ->allow_extra_args(false);
  app.add_option("--time-limit", a.time_limit_s,
                 "processor time for the mesh of one solid (s); one that takes longer is left out, with a "
                 "note. Reading "
                 "the file has ten times as much")
      ->check(CLI::Range(1, 86400))
      ->capture_default_str();
  app.add_option("--up", a.up, "axis of the product that points upwards in the cell")
      ->check(CLI::IsMember({"x", "-x", "y", "-y", "z", "-z"}))
      ->capture_default_str();
  app.add_option("--scale", a.scale, "factor for all lengths, of a file that states a wrong unit")
      ->check(command_line::positive())
      ->capture_default_str();
  auto* robot = app.add_flag("--robot", a.robot,
                             "add a cell in which a robot takes the product apart and together again");
  robot->excludes(list);
  app.add_flag("--json", a.json, "print the result as JSON");
  app.footer("\nExample:\n  takt-from-cad gearbox.step -o gearbox && takt-run run gearbox/gearbox.yaml");
  try {
    app.parse(argc, argv);
    a.deflection_given = deflection->count() > 0;
    if (!a.list && a.directory.empty()) throw CLI::RequiredError("-o,--output (or --list)");
    return run(a);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : kUsage;
  } catch (const std::exception& error) {
    std::cerr << "takt-from-cad: " << error.what() << '\n';
    return kUsage;
  }
}

}  // namespace
}  // namespace takt

int main(int argc, char** argv) {
  // The steps allocate and free much: memory that goes back to the system between them costs a fifth of the time.
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  mallopt(M_MMAP_THRESHOLD, 32 << 20);  // the largest that glibc takes
  mallopt(M_TOP_PAD, 64 << 20);
  return takt::main_of(argc, argv);
}
