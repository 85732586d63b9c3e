#include "server/product/cell_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <utility>

#include "idl/common/text.h"
#include "server/geometry/convex/convex_shape.h"
#include "server/geometry/mesh/obj_writer.h"
#include "server/product/convex_pieces.h"
#include "server/product/geometry.h"
#include "server/product/names.h"
#include "server/product/overlaps.h"
#include "server/product/support.h"

namespace takt::product {

namespace {

namespace fs = std::filesystem;

constexpr int kDigits = 10;  ///< of lengths, masses and inertias
/// Files of the robot.
constexpr const char *kGantry = "gantry.urdf", *kBody = "meshes/gripper_body.obj",
                     *kJaw = "meshes/gripper_jaw.obj", *kTray = "meshes/Tray.obj";

std::string list(const Vec3& v, int digits = kDigits) {
  // A pose out of a matrix has 1e-17 where a zero is meant.
  const auto length = [&](double x) { return number_text(std::abs(x) < 1e-12 ? 0.0 : x, digits); };
  return "[" + length(v.x()) + ", " + length(v.y()) + ", " + length(v.z()) + "]";
}

void write(const fs::path& file, const std::function<void(std::ostream&)>& content) {
  std::ofstream out(file);
  content(out);
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written");
}

void write_objects(const fs::path& file, const std::vector<NamedMesh>& objects) {
  write(file, [&](std::ostream& out) { out << obj_text(objects); });
}

void write_mesh(const fs::path& file, const std::string& name, const TriangleMesh& mesh) {
  write_objects(file, {{name, mesh, {}}});
}

/// Coefficients of friction of dry pairs: Dubbel, Taschenbuch fuer den Maschinenbau, B 15; plastics: VDI 2736.
double friction(const std::string& a, const std::string& b) {
  const auto has = [&](const char* word) {
    return a.find(word) != std::string::npos || b.find(word) != std::string::npos;
  };
  if (has("rubber")) return 0.6;
  if (has("POM")) return 0.2;
  if (has("PA 6") || has("ABS") || has("PC") || has("plastic")) return 0.3;
  if (has("alumin")) return 0.35;
  if (has("brass") || has("bronze")) return 0.19;
  return 0.15;
}

std::string contact_line(const Product& product, const Contact& contact) {
  const auto& names = product.instances;
  std::string text = names[contact.first].name + " - " + names[contact.second].name + ": ";
  switch (contact.kind) {
    case ContactKind::plane:
      text += "plane, " + number_text(contact.area_m2 * 1e6, 4) + " mm2";
      break;
    case ContactKind::cylinder_fit:
      text += contact.clearance_m < 0.0
                  ? "interference fit, " + number_text(-contact.clearance_m * 1e6, 3) + " um in the radius"
                  : "fit, clearance " + number_text(contact.clearance_m * 1e6, 3) + " um in the radius";
      break;
    case ContactKind::thread:
      text += "thread, pitch " + number_text(contact.pitch_m * 1e3, 3) + " mm";
      break;
    case ContactKind::snap:
      text += "snap";
      break;
    case ContactKind::other:
      text += contact.clearance_m < 0.0
                  ? "one inside the other, " + number_text(-contact.clearance_m * 1e3, 3) + " mm deep"
                  : "curved surfaces, " + number_text(contact.area_m2 * 1e6, 4) + " mm2";
      break;
  }
  return text;
}

}  // namespace

class CellWriter::Writer {
 public:
  Writer(const Product& product, const Hierarchy& numbers, fs::path directory)
      : product_(product),
        standing_numbers_(numbers),
        numbers_(&standing_numbers_),
        directory_(std::move(directory)),
        placed_(place(product)),
        usual_friction_(usual_friction()) {
    fs::create_directories(directory_ / "meshes");
    notes_ = product_.notes;
    note_overlaps();
    write_bodies();
  }

  void add_note(const std::string& note) { notes_.push_back(note); }

  CellFiles write_cell(const Disassembly& plan) {
    begin(plan, nullptr);
    write(result_.scenario, [&](std::ostream& out) { scenario(out, key_of(product_.name)); });
    return result_;
  }

  CellFiles write_robot_cell(const Disassembly& plan, const RobotPlan& robot) {
    begin(plan, &robot);
    const std::string name = key_of(product_.name) + "_robot";
    result_.robot_scenario = directory_ / (name + ".yaml");
    result_.robot_program = directory_ / (name + ".lua");
    write_robot();
    write(result_.robot_scenario, [&](std::ostream& out) { scenario(out, name); });
    return result_;
  }

  void remove_robot_cell() const {
    const std::string name = key_of(product_.name) + "_robot";
    for (const fs::path& file : {fs::path(name + ".yaml"), fs::path(name + ".lua"), fs::path(kGantry),
                                 fs::path(kBody), fs::path(kJaw), fs::path(kTray)})
      fs::remove(directory_ / file);
  }

 private:
  void begin(const Disassembly& plan, const RobotPlan* robot) {
    plan_ = &plan;
    robot_ = robot;
    numbers_ = &standing_numbers_;
    if (robot != nullptr) {
      Disassembly moved = plan;
      moved.order = robot->order;
      robot_numbers_ = hierarchy(product_, moved);
      numbers_ = &robot_numbers_;
    }
    result_ = {};
    result_.scenario = directory_ / (key_of(product_.name) + ".yaml");
    result_.notes = notes_;
    write_support();
  }

  void write_bodies() {
    std::set<std::string> taken;
    std::set<std::size_t> used;
    for (const Instance& instance : product_.instances) used.insert(instance.body);
    for (std::size_t b = 0; b < product_.bodies.size(); ++b) {
      const Body& body = product_.bodies[b];
      if (!used.contains(b)) {
        files_.emplace_back();
        choices_.emplace_back();
        continue;
      }
      const std::string stem = key_of(body.name);
      std::string name = stem;
      for (int i = 2; !taken.insert(name).second; ++i) name = stem + "_" + std::to_string(i);
      files_.push_back(name);
      write_mesh(directory_ / "meshes" / (name + ".obj"), name,
                 body.contact_mesh.triangles.empty() ? body.mesh : body.contact_mesh);
      choices_.push_back(choose_convex(body));
      const ConvexChoice& choice = choices_.back();
      if (choice.method != ConvexMethod::pieces) continue;
      std::vector<NamedMesh> pieces;
      for (const std::vector<Vec3>& piece : choice.pieces)
        pieces.push_back({"piece_" + std::to_string(pieces.size() + 1),
                          convex_hull_mesh(convex_hull_vertices(piece)),
                          {}});
      write_objects(directory_ / "meshes" / (name + "_convex.obj"), pieces);
    }
  }

  void write_support() {
    const Support support = support_of(product_, placed_, *plan_);
    const auto& boxes = support.boxes;
    posts_ = boxes.size() - 1;
    std::vector<NamedMesh> objects;
    for (std::size_t i = 0; i < boxes.size(); ++i)
      objects.push_back({i == 0 ? "plate" : "post_" + std::to_string(i), boxes[i], {}});
    on_pads_ = support.on_pads;
    for (std::size_t i = 0; i < on_pads_.size(); ++i) {
      objects.push_back({"pad_" + std::to_string(i + 1), support.pads[i], {}});
      result_.notes.push_back("no part or post holds " + product_.instances[on_pads_[i]].name +
                              " at level 1, as nothing that stays touches it and no place under it is free: "
                              "a pad of the support inside it does, which is assumed");
    }
    write_objects(directory_ / "meshes" / "Support.obj", objects);
  }

  /// A pad of the jaw on the +y side, and the body, both from the flange on; the tool is twice as long as its fingers.
  void write_robot() {
    const GripperSize& g = robot_->gripper;
    const double w = 0.5 * g.finger_width_m, l = g.finger_length_m;
    write_mesh(directory_ / kJaw, "jaw", box_mesh(Vec3(-w, 0.0, l), Vec3(w, g.finger_thickness_m, 2.0 * l)));
    const double half = 0.5 * g.largest_width_m + g.finger_thickness_m;
    write_mesh(directory_ / kBody, "body", box_mesh(Vec3(-2.0 * w, -half, 0.0), Vec3(2.0 * w, half, l)));
    std::vector<NamedMesh> tray{{"tray", box_mesh(robot_->tray_lower, robot_->tray_upper), {}}};
    for (const TriangleMesh& post : robot_->tray_posts)
      tray.push_back({"post_" + std::to_string(tray.size()), post, {}});
    write_objects(directory_ / kTray, tray);
    write(directory_ / kGantry, [&](std::ostream& out) { out << robot_description(*robot_); });
    write(result_.robot_program, [&](std::ostream& out) { out << robot_program(product_, *robot_); });
  }

  void robot_sections(std::ostream& out, const std::string& name) const {
    const GripperSize& g = robot_->gripper;
    std::string joints;
    for (const double q : home_joints(*robot_)) joints += (joints.empty() ? "" : ", ") + number_text(q);
    out << "  Tray: {mesh: " << kTray << (robot_->tray_posts.empty() ? "" : ", convex: objects") << "}\n\n"
        << "# Assumed: a gantry and a gripper that suit the sizes of the parts. Put your own robot in their "
           "place.\n"
        << "robots:\n  Robot1: {urdf: " << kGantry << ", initial_joints_rad: [" << joints << "]}\n\n"
        << "grippers:\n  Gripper1: {robot: Robot1, body_mesh: " << kBody << ", jaw_mesh: " << kJaw
        << ",\n    tool_center_point: {position_m: [0, 0, " << number_text(2.0 * g.finger_length_m)
        << "]}, max_width_m: " << number_text(g.largest_width_m)
        << ", initial_width_m: " << number_text(g.largest_width_m)
        << ",\n    jaw_speed_m_per_s: " << number_text(std::max(0.05, 4.0 * g.largest_width_m))
        << ", max_force_N: " << number_text(g.force_N) << ", mass_kg: 1, grasp: on_command}\n\n";
    if (!g.cups_m.empty()) out << "# For parts that the jaws cannot hold.\nvacuum_grippers:\n";
    for (std::size_t k = 0; k < g.cups_m.size(); ++k)
      out << "  Cup" << k + 1 << ": {at: Gripper1, mount: {pose: {" << pose(cup_mount(g, k))
          << "}},\n    cups: [{diameter_m: " << number_text(g.cups_m[k])
          << "}], pressure_Pa: " << number_text(g.cup_pressure_Pa)
          << ", reach_m: " << number_text(cup_reach_m(g.cups_m[k])) << "}"
          << (k + 1 == g.cups_m.size() ? "\n\n" : "\n");
    out << "controller: {program: " << name << ".lua}\n";
  }

  std::string convex_of(std::size_t body) const {
    switch (choices_[body].method) {
      case ConvexMethod::pieces:
        return ", convex: meshes/" + files_[body] + "_convex.obj";
      case ConvexMethod::vhacd:
        return ", convex: {method: vhacd, resolution: " + std::to_string(resolution()) + "}";
      case ConvexMethod::hull:
        break;
    }
    return "";
  }

  /// Voxels for V-HACD, whose time grows with them: a product of many such bodies has to load, too.
  std::int64_t resolution() const {
    constexpr std::int64_t kInAll = 1'000'000, kLeast = 30'000, kMost = 100'000;
    const auto bodies = std::count_if(choices_.begin(), choices_.end(), [](const ConvexChoice& choice) {
      return choice.method == ConvexMethod::vhacd;
    });
    return std::clamp(kInAll / std::max<std::int64_t>(bodies, 1), kLeast, kMost);
  }

  void scenario(std::ostream& out, const std::string& name) {
    out << "# " << product_.name << ", made by takt-from-cad from "
        << fs::path(product_.source).filename().string() << ".\n"
        << "# Poses, masses and meshes are those of the file; what was assumed is marked. Keys: "
           "docs/scenario_reference.md.\n";
    for (const std::string& note : result_.notes) out << "# Note: " << note << ".\n";
    if (robot_ != nullptr)
      for (const std::string& note : robot_->notes) out << "# Note: " << note << ".\n";
    out << "takt_scenario: 1\nname: " << name
        << "\nduration_s: " << (robot_ != nullptr ? number_text(program_duration_s(*robot_)) : "2") << "\n\n"
        << "processes:\n  product: {level_of_detail: 1, members: all}\n";
    advice(out);
    out << "\nsolver: {method: rk2, step_s: 0.001}\n\n"
        << "interaction:\n  allowed_position_error_m: 0.0001   # assumed: by which a part sags in the spring "
           "that holds it\n"
        << "  damping_ratio: 1.0\n\n"
        << "# At level of detail 3. The layer is assumed; friction of dry pairs: Dubbel, B 15.\n"
        << "contact:\n  defaults: {youngs_modulus_Pa: 1.0e+7, poisson_ratio: 0.3, layer_depth_m: 0.001, "
           "friction: "
        << number_text(usual_friction_, 3) << "}\n";
    pairs(out);
    overlaps(out);
    out << "\n# hierarchy: each part is held by parts of larger numbers that it touches, the base by the "
           "support. The numbers follow\n"
           "# from the order of disassembly.\nparts:\n";
    for (std::size_t i = 0; i < product_.instances.size(); ++i) part(out, i);
    out << "\ngrounds:\n  Support: {mesh: meshes/Support.obj, convex: objects}   # assumed: a plate"
        << (posts_ > 0 ? " with " + std::to_string(posts_) + " posts" : "") << " under "
        << product_.instances[plan_->base].name
        << (standing_numbers_.floating.empty() ? "\n" : " and parts without contacts to it\n");
    if (robot_ != nullptr) robot_sections(out, name);
    if (!product_.contacts.empty()) {
      out << "\n# What touches what:\n";
      for (const Contact& contact : product_.contacts)
        out << "#   " << contact_line(product_, contact) << '\n';
    }
    order(out);
    expectations(out, robot_ != nullptr);
  }

  void expectations(std::ostream& out, bool robot) const {
    out << "\n# Where the parts are at the end: "
        << (robot ? "the robot puts each one back" : "nothing moves the product")
        << ".\nexpected:\n  tolerance_m: " << number_text(kPlaceTolerance_m) << "\n  parts:\n";
    for (const Instance& one : product_.instances)
      out << "    " << one.name << ": {" << pose(one.X_WB) << "}\n";
    if (!robot) return;
    out << "\n# Exit code 3 of takt-run where one is not.\nassertions:\n";
    for (const Instance& one : product_.instances)
      out << "  " << one.name << " is in its place: {check: pose, part: " << one.name << ", pose: {"
          << pose(one.X_WB) << "}, tolerance_m: " << number_text(kPlaceTolerance_m)
          << ", tolerance_deg: " << number_text(kPlaceTolerance_deg) << "}\n";
  }

  static std::string pose(const Pose& X) {
    const Quat q = X.quaternion();
    std::string text = "position_m: " + list(X.p);
    if (std::abs(q.w()) < 1.0 - 1e-12)
      text += ", quaternion_xyzw: [" + number_text(q.x(), 15) + ", " + number_text(q.y(), 15) + ", " +
              number_text(q.z(), 15) + ", " + number_text(q.w(), 15) + "]";
    return text;
  }

  void part(std::ostream& out, std::size_t i) const {
    const Instance& instance = product_.instances[i];
    const Body& body = product_.bodies[instance.body];
    const double mass = body.material.density_kg_m3 * body.exact.volume;
    out << "  " << instance.name << ":   # " << instance.path << "; "
        << (body.material.name.empty() ? "material" : body.material.name) << ", "
        << number_text(body.material.density_kg_m3, 5) << " kg/m3"
        << (body.material.assumed ? " (assumed)" : "") << '\n';
    out << "    {mesh: meshes/" << files_[instance.body] << ".obj" << convex_of(instance.body)
        << ", mass_kg: " << number_text(mass, 8) << ", hierarchy: " << numbers_->numbers[i];
    if (body.colour)
      out << ",\n     color: [" << number_text((*body.colour)[0], 3) << ", "
          << number_text((*body.colour)[1], 3) << ", " << number_text((*body.colour)[2], 3) << ", "
          << number_text((*body.colour)[3], 3) << "]";
    const Mat3 I = mass * body.exact.G_BBcm_B;
    out << ",\n     center_of_mass_m: " << list(body.exact.p_BBcm) << ",\n     inertia_kg_m2: [";
    for (const double value : {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2)})
      out << number_text(value, kDigits) << ", ";
    out << number_text(I(1, 2), kDigits) << "]";
    out << ",\n     pose: {" << pose(instance.X_WB) << "}}\n";
  }

  void advice(std::ostream& out) const {
    const auto advised = level_advice(product_);
    out << "# Advice on the level of detail, by contact (all others: 1):\n";
    bool any = false;
    for (const LevelAdvice& one : advised) {
      if (one.level == 1) continue;
      any = true;
      const Contact& contact = product_.contacts[one.contact];
      out << "#   " << product_.instances[contact.first].name << " - "
          << product_.instances[contact.second].name << ": level " << one.level << ", " << one.reason << '\n';
    }
    if (!any) out << "#   level 1 is enough: no contact needs forces between surfaces\n";
  }

  std::string material(std::size_t i) const {
    return product_.bodies[product_.instances[i].body].material.name;
  }

  double usual_friction() const {
    std::map<double, int> count;
    for (const Contact& contact : product_.contacts)
      ++count[friction(material(contact.first), material(contact.second))];
    double best = 0.15;
    int most = 0;
    for (const auto& [value, n] : count)
      if (n > most) most = n, best = value;
    return best;
  }

  void pairs(std::ostream& out) const {
    std::set<std::pair<std::size_t, std::size_t>> done;
    bool first = true;
    for (const Contact& contact : product_.contacts) {
      const double mu = friction(material(contact.first), material(contact.second));
      if (mu == usual_friction_ || !done.insert({contact.first, contact.second}).second) continue;
      if (first) out << "  pairs:\n";
      first = false;
      out << "    - {pair: [" << product_.instances[contact.first].name << ", "
          << product_.instances[contact.second].name << "], friction: " << number_text(mu, 3) << "}\n";
    }
  }

  /// Pairs whose joint means that one part stands in the other.
  std::set<std::pair<std::size_t, std::size_t>> meant_overlaps() const {
    std::set<std::pair<std::size_t, std::size_t>> meant;
    for (const Contact& contact : product_.contacts)
      if (contact.kind == ContactKind::thread || contact.kind == ContactKind::snap ||
          (contact.kind == ContactKind::cylinder_fit && contact.clearance_m < 0.0))
        meant.insert({contact.first, contact.second});
    return meant;
  }

  void note_overlaps() {
    const auto meant = meant_overlaps();
    for (const PartOverlap& overlap : find_overlaps(product_)) {
      if (meant.count({overlap.first, overlap.second}) != 0) continue;
      overlaps_.push_back(overlap);
      notes_.push_back(product_.instances[overlap.first].name + " stands inside " +
                       product_.instances[overlap.second].name + " in the file, " +
                       number_text(1e3 * overlap.depth_m, 3) + " mm deep at " + list(overlap.point_W, 4) +
                       " m; the scenario allows it (world.allow_overlap)");
    }
  }

  /// Pairs that stand inside each other at the start.
  void overlaps(std::ostream& out) const {
    const auto meant = meant_overlaps();
    if (meant.empty() && overlaps_.empty() && on_pads_.empty()) return;
    const auto pair = [&](std::size_t a, std::size_t b) {
      return "    - [" + product_.instances[a].name + ", " + product_.instances[b].name + "]";
    };
    out << "\nworld:\n  allow_overlap:\n";
    if (!meant.empty()) out << "    # Threads, snaps and interference fits.\n";
    for (const auto& [a, b] : meant) out << pair(a, b) << '\n';
    if (!overlaps_.empty())
      out << "    # The file has these parts inside each other. Where that is a mistake, correct it in the "
             "CAD program.\n";
    for (const PartOverlap& one : overlaps_)
      out << pair(one.first, one.second) << "   # " << number_text(1e3 * one.depth_m, 3) << " mm deep\n";
    // A pad is inside whatever is inside the part around it.
    std::set<std::size_t> around(on_pads_.begin(), on_pads_.end());
    const auto add = [&](std::size_t a, std::size_t b) {
      for (const std::size_t i : on_pads_)
        if (i == a || i == b) around.insert({a, b});
    };
    for (const auto& [a, b] : meant) add(a, b);
    for (const PartOverlap& one : overlaps_) add(one.first, one.second);
    if (!on_pads_.empty()) out << "    # Pads of the support inside parts that nothing else holds.\n";
    for (const std::size_t i : around) out << "    - [" << product_.instances[i].name << ", Support]\n";
  }

  void order(std::ostream& out) const {
    out << "\n# Order of disassembly; " << product_.instances[plan_->base].name
        << " is the base and stays:\n";
    int count = 0;
    for (const RemovalStep& step : plan_->steps) {
      out << "#   " << ++count << ". " << to_string(step.loosening);
      for (const std::size_t i : step.parts) out << ' ' << product_.instances[i].name;
      out << " along " << list(step.direction_W, 3) << (step.reason.empty() ? "" : ": " + step.reason)
          << '\n';
    }
    for (const auto& group : plan_->stuck) {
      out << "#   No straight motion parts these from each other:";
      for (const std::size_t i : group) out << ' ' << product_.instances[i].name;
      out << '\n';
    }
    for (const std::size_t i : standing_numbers_.floating)
      out << "#   " << product_.instances[i].name
          << " touches no part that leaves later: at level 1 the support holds it.\n";
  }

  const Product& product_;
  const Hierarchy& standing_numbers_;
  Hierarchy robot_numbers_;   ///< by the order of its moves
  const Hierarchy* numbers_;  ///< of the present cell
  const fs::path directory_;
  const Disassembly* plan_ = nullptr;  ///< of the present cell
  const RobotPlan* robot_ = nullptr;   ///< likewise; null: without
  const std::vector<PlacedInstance> placed_;
  const double usual_friction_;        ///< of most contacts
  std::vector<std::string> files_;     ///< by body: name of its mesh file without suffix
  std::vector<ConvexChoice> choices_;  ///< by body
  std::vector<PartOverlap> overlaps_;  ///< that no joint means
  std::vector<std::string> notes_;     ///< of all cells
  std::size_t posts_ = 0;
  std::vector<std::size_t> on_pads_;  ///< instances
  CellFiles result_;
};

std::vector<LevelAdvice> level_advice(const Product& product) {
  constexpr double kTransition_m = 1e-5;
  std::vector<LevelAdvice> advice;
  for (std::size_t i = 0; i < product.contacts.size(); ++i) {
    const Contact& contact = product.contacts[i];
    LevelAdvice one{i, 1, ""};
    if (contact.kind == ContactKind::cylinder_fit && contact.clearance_m < 0.0)
      one = {i, 3,
             "interference fit of " + number_text(-contact.clearance_m * 1e6, 3) +
                 " um: its force holds the parts"};
    else if (contact.kind == ContactKind::cylinder_fit && contact.clearance_m > 0.0 &&
             contact.clearance_m < kTransition_m)
      one = {i, 3, "close fit of " + number_text(contact.clearance_m * 1e6, 3) + " um: it can jam"};
    else if (contact.kind == ContactKind::thread)
      one = {i, 3, "thread: torque and preload"};
    else if (contact.kind == ContactKind::snap)
      one = {i, 3, "snap: the force of joining"};
    advice.push_back(std::move(one));
  }
  return advice;
}

CellFiles write_cell(const Product& product, const Disassembly& plan, const Hierarchy& numbers,
                     const fs::path& directory, const RobotPlan* robot) {
  CellWriter writer(product, numbers, directory);
  const CellFiles files = writer.write_cell(plan);
  return robot == nullptr ? files : writer.write_robot_cell(plan, *robot);
}

CellWriter::CellWriter(const Product& product, const Hierarchy& numbers,
                       const std::filesystem::path& directory)
    : writer_(std::make_unique<Writer>(product, numbers, directory)) {}
CellWriter::~CellWriter() = default;

void CellWriter::add_note(const std::string& note) {
  writer_->add_note(note);
}

CellFiles CellWriter::write_cell(const Disassembly& plan) {
  return writer_->write_cell(plan);
}

void CellWriter::remove_robot_cell() {
  writer_->remove_robot_cell();
}

CellFiles CellWriter::write_robot_cell(const Disassembly& plan, const RobotPlan& robot) {
  return writer_->write_robot_cell(plan, robot);
}

}  // namespace takt::product
