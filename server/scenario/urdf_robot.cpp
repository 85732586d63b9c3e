#include "server/scenario/urdf_robot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "idl/common/text.h"
#include "server/scenario/xml_file.h"

namespace takt {

namespace {

using XMLElement = XmlFile::Element;

constexpr std::array<const char*, 6> kJointTypes{"fixed",     "revolute", "continuous",
                                                 "prismatic", "floating", "planar"};

constexpr std::string_view kRoot{"robot"};
constexpr std::size_t kLargestUrdf_MB = 16;

class Reader {
 public:
  Reader(const std::filesystem::path& file, const PackageFolders& packages) : xml_(file, kLargestUrdf_MB) {
    robot_.file = file;
    robot_.packages = packages;
  }

  UrdfRobot read() {
    robot_.text = xml_.text();
    const XMLElement* robot = xml_.root();
    if (robot == nullptr || XmlFile::name(*robot) != kRoot) fail_at_root(robot);
    require_expanded(*robot);
    require(*robot, "name", "<robot>");
    const std::string version = xml_.attribute(*robot, "version");
    if (XmlFile::has(*robot, "version") && version != "1.0" && version != "1")
      fail(*robot, "<robot>: version: found '" + version + "'; allowed: 1.0");
    XmlFile::for_each(*robot, "material", [&](const XMLElement& element) { read_material(element); });
    XmlFile::for_each(*robot, "link", [&](const XMLElement& element) { read_link(element); });
    if (robot_.links.empty()) fail(*robot, "<robot>: found no <link>; at least one is needed");
    XmlFile::for_each(*robot, "joint", [&](const XMLElement& element) { read_joint(element); });
    require_tree();
    return std::move(robot_);
  }

 private:
  using Names = std::map<std::string, std::size_t>;

  [[noreturn]] void fail(const XMLElement& element, const std::string& reason) const {
    xml_.fail(element, reason);
  }

  [[noreturn]] void fail_at_root(const XMLElement* root) const {
    if (root == nullptr) robot_.fail(0, "found no element <robot>");
    const std::string name = XmlFile::name(*root);
    if (name == "sdf")
      fail(*root,
           "found <sdf>: an SDFormat file; allowed: a URDF file, whose root element is <robot>. 'takt-run "
           "from-sdf " +
               robot_.file.string() + " -o DIR' writes it as a scenario, with a URDF for each robot");
    fail(*root, "found <" + name + "> as the root element; allowed: <robot>");
  }

  /// Fails for a file with macros of xacro, with the command that expands it.
  void require_expanded(const XMLElement& robot) const {
    const XMLElement* macro = first_macro(robot);
    if (macro == nullptr) return;
    const std::filesystem::path& file = robot_.file;
    std::filesystem::path expanded = file;
    if (expanded.extension() == ".xacro") expanded.replace_extension();
    if (expanded.extension() != ".urdf") expanded.replace_extension(".urdf");
    if (expanded == file) expanded.replace_extension(".expanded.urdf");
    std::string command = "xacro " + file.string();
    XmlFile::for_each(robot, "xacro:arg", [&](const XMLElement& argument) {
      if (!XmlFile::has(argument, "default")) command += " " + xml_.attribute(argument, "name") + ":=VALUE";
    });
    fail(*macro, "found <" + XmlFile::name(*macro) +
                     ">: the file is a xacro, from which a URDF is made; allowed: a URDF, as '" + command +
                     " > " + expanded.string() + "' writes it (ROS package xacro)");
  }
  static const XMLElement* first_macro(const XMLElement& element) {
    if (XmlFile::name(element).starts_with("xacro:")) return &element;
    for (const XMLElement* child = XmlFile::child(element); child != nullptr; child = XmlFile::next(*child))
      if (const XMLElement* macro = first_macro(*child)) return macro;
    return nullptr;
  }

  std::string require(const XMLElement& element, const char* name, const std::string& where) const {
    return xml_.require(element, name, where);
  }
  const XMLElement& require_child(const XMLElement& element, const char* name,
                                  const std::string& where) const {
    return xml_.require_child(element, name, where);
  }
  template <std::size_t N>
  std::array<double, N> numbers(const XMLElement& element, const char* name, const std::string& where) const {
    return xml_.numbers<N>(element, xml_.attribute(element, name), where + ": " + name);
  }
  double number(const XMLElement& element, const char* name, const std::string& where) const {
    return numbers<1>(element, name, where)[0];
  }

  /// `missing` where the attribute is not there.
  double number(const XMLElement& element, const char* name, const std::string& where, double missing) const {
    return !XmlFile::has(element, name) ? missing : number(element, name, where);
  }
  Vec3 vector(const XMLElement& element, const char* name, const std::string& where,
              const Vec3& missing) const {
    if (!XmlFile::has(element, name)) return missing;
    const auto v = numbers<3>(element, name, where);
    return {v[0], v[1], v[2]};
  }

  Pose origin(const XMLElement& parent, const std::string& where) const {
    const XMLElement* element = XmlFile::child(parent, "origin");
    if (element == nullptr) return {};
    return {rotation_from_rpy(vector(*element, "rpy", where + ": <origin>", Vec3::Zero())),
            vector(*element, "xyz", where + ": <origin>", Vec3::Zero())};
  }

  std::string add_name(const XMLElement& element, const std::string& what, Names& names,
                       std::size_t index) const {
    std::string name = require(element, "name", "<" + what + ">");
    if (!names.emplace(name, index).second)
      fail(element, what + " '" + name + "': found a second one of this name; names must be unique");
    return name;
  }

  void read_link(const XMLElement& element) {
    UrdfLink link;
    link.line = XmlFile::line(element);
    link.name = add_name(element, "link", links_, robot_.links.size());
    const std::string where = "link '" + link.name + "': ";
    if (const XMLElement* inertial = XmlFile::child(element, "inertial"))
      link.inertial = read_inertial(*inertial, where + "<inertial>");
    XmlFile::for_each(element, "visual", [&](const XMLElement& shape) {
      link.visuals.push_back(read_shape(shape, where + "<visual>"));
    });
    XmlFile::for_each(element, "collision", [&](const XMLElement& shape) {
      link.collisions.push_back(read_shape(shape, where + "<collision>"));
    });
    robot_.links.push_back(std::move(link));
  }

  UrdfInertial read_inertial(const XMLElement& element, const std::string& where) const {
    UrdfInertial inertial;
    inertial.line = XmlFile::line(element);
    inertial.X_LC = origin(element, where);
    inertial.at_centre.mass_kg = number(require_child(element, "mass", where), "value", where + ": <mass>");
    const XMLElement& tensor = require_child(element, "inertia", where);
    const auto moment = [&](const char* name) { return number(tensor, name, where + ": <inertia>"); };
    const double xx = moment("ixx"), xy = moment("ixy"), xz = moment("ixz"), yy = moment("iyy"),
                 yz = moment("iyz"), zz = moment("izz");
    inertial.at_centre.I_BBcm_B << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    return inertial;
  }

  /// The colour of a <material>, or that of the one of its name that stands elsewhere. A picture may lack colours: what is
  /// no colour is passed over.
  std::optional<std::array<float, 3>> read_material(const XMLElement& element) {
    const std::string name = xml_.attribute(element, "name");
    std::optional<std::array<float, 3>>& known = colors_[name];
    const XMLElement* color = XmlFile::child(element, "color");
    if (color == nullptr) return name.empty() ? std::nullopt : known;
    const auto rgba = XmlFile::finite_numbers(xml_.attribute(*color, "rgba"));
    if (!rgba || rgba->size() < 3) return std::nullopt;
    std::array<float, 3> rgb{};
    for (std::size_t i = 0; i < rgb.size(); ++i)
      rgb[i] = static_cast<float>(std::clamp((*rgba)[i], 0.0, 1.0));
    known = rgb;
    return rgb;
  }

  UrdfShape read_shape(const XMLElement& element, const std::string& where) {
    const XMLElement* geometry = XmlFile::child(element, "geometry");
    const XMLElement* kind = geometry != nullptr ? XmlFile::child(*geometry) : nullptr;
    if (kind == nullptr)
      fail(element, where + ": found no geometry; allowed: <geometry> with box, cylinder, sphere or mesh");
    const std::string name = XmlFile::name(*kind), of = where + ": <" + name + ">";
    UrdfShape shape;
    shape.line = XmlFile::line(*kind);
    shape.X_LS = origin(element, where);
    if (const XMLElement* material = XmlFile::child(element, "material"))
      shape.color = read_material(*material);
    if (name == "box") {
      const auto size = numbers<3>(*kind, "size", of);
      shape.size_m = {size[0], size[1], size[2]};
    } else if (name == "sphere") {
      shape.kind = UrdfShapeKind::sphere;
      shape.radius_m = number(*kind, "radius", of);
    } else if (name == "cylinder") {
      shape.kind = UrdfShapeKind::cylinder;
      shape.radius_m = number(*kind, "radius", of);
      shape.length_m = number(*kind, "length", of);
    } else if (name == "mesh") {
      shape.kind = UrdfShapeKind::mesh;
      shape.filename = require(*kind, "filename", of);
      shape.scale = vector(*kind, "scale", of, Vec3::Ones());
    } else {
      fail(*kind, where + ": found <" + name + ">; allowed: box, cylinder, sphere, mesh");
    }
    return shape;
  }

  std::size_t read_end(const XMLElement& element, const char* end, const std::string& where) const {
    const XMLElement& child = require_child(element, end, where);
    const std::string name = require(child, "link", where + ": <" + end + ">");
    const auto link = links_.find(name);
    if (link == links_.end())
      fail(child, where + ": <" + end + ">: link: found '" + name + "', which is no link of the file");
    return link->second;
  }

  void read_joint(const XMLElement& element) {
    UrdfJoint joint;
    const std::size_t index = robot_.joints.size();
    joint.line = XmlFile::line(element);
    joint.name = add_name(element, "joint", joints_, index);
    const std::string type = require(element, "type", "joint '" + joint.name + "'");
    const auto known = std::find(kJointTypes.begin(), kJointTypes.end(), type);
    if (known == kJointTypes.end())
      fail(element, "joint '" + joint.name + "': type: found '" + type +
                        "'; allowed: revolute, continuous, prismatic, fixed, floating, planar");
    joint.type = static_cast<UrdfJointType>(known - kJointTypes.begin());
    const std::string where = joint.describe();
    joint.X_PJ = origin(element, where);
    joint.parent = read_end(element, "parent", where);
    joint.child = read_end(element, "child", where);
    if (const XMLElement* axis = XmlFile::child(element, "axis"))
      joint.axis = vector(*axis, "xyz", where + ": <axis>", Vec3::UnitX());
    if (const XMLElement* limit = XmlFile::child(element, "limit"))
      joint.limit = read_limit(*limit, where + ": <limit>");
    else if (joint.type == UrdfJointType::revolute || joint.type == UrdfJointType::prismatic)
      fail(element, where + ": found no <limit>; lower, upper, velocity and effort are needed");
    if (const XMLElement* mimic = XmlFile::child(element, "mimic"))
      read_mimic(*mimic, where + ": <mimic>", joint);
    UrdfLink& child = robot_.links[joint.child];
    if (child.above)
      fail(element, "link '" + child.name + "' is the child of two joints, '" +
                        robot_.joints[*child.above].name + "' and '" + joint.name +
                        "'; a robot is a tree without loops");
    child.above = index;
    robot_.links[joint.parent].below.push_back(index);
    robot_.joints.push_back(std::move(joint));
  }

  void read_mimic(const XMLElement& element, const std::string& where, UrdfJoint& joint) const {
    joint.mimics = require(element, "joint", where);
    joint.mimic_multiplier = number(element, "multiplier", where, 1.0);
    joint.mimic_offset = number(element, "offset", where, 0.0);
  }

  UrdfLimit read_limit(const XMLElement& element, const std::string& where) const {
    return {number(element, "lower", where, 0.0), number(element, "upper", where, 0.0),
            number(element, "velocity", where, 0.0), number(element, "effort", where, 0.0),
            XmlFile::line(element)};
  }

  /// Each link has at most one joint above it, so a walk down from the one root visits all links except those
  /// of loops and below them.
  void require_tree() const {
    std::vector<std::size_t> walk;
    for (std::size_t i = 0; i < robot_.links.size(); ++i) {
      if (robot_.links[i].above) continue;
      if (!walk.empty())
        robot_.fail(robot_.links[i].line, "no joint carries link '" + robot_.links[walk[0]].name +
                                              "', and none link '" + robot_.links[i].name +
                                              "'; joints must join all links to one tree");
      walk.push_back(i);
    }
    std::vector<bool> met(robot_.links.size(), false);
    for (std::size_t i = 0; i < walk.size(); ++i) {
      met[walk[i]] = true;
      for (const std::size_t joint : robot_.links[walk[i]].below) walk.push_back(robot_.joints[joint].child);
    }
    if (walk.size() == robot_.links.size()) return;
    auto at = static_cast<std::size_t>(std::find(met.begin(), met.end(), false) - met.begin());
    const auto above = [&]() -> const UrdfJoint& { return robot_.joints[*robot_.links[at].above]; };
    for (std::size_t steps = 0; steps < robot_.links.size(); ++steps) at = above().parent;  // into the loop
    robot_.fail(above().line, "the joints above link '" + robot_.links[at].name +
                                  "' lead back to it, by joint '" + above().name +
                                  "'; a robot is a tree without loops");
  }

  const XmlFile xml_;
  UrdfRobot robot_;
  Names links_, joints_;
  std::map<std::string, std::optional<std::array<float, 3>>> colors_;  ///< of materials by name
};

}  // namespace

std::string UrdfJoint::describe() const {
  return "joint '" + name + "' (" + kJointTypes[static_cast<std::size_t>(type)] + ")";
}

std::size_t UrdfRobot::find_link(const std::string& name) const {
  for (std::size_t i = 0; i < links.size(); ++i)
    if (links[i].name == name) return i;
  fail(0, "there is no link '" + name + "'; the file has the links " + join(links, ", ", &UrdfLink::name));
}

std::string UrdfRobot::place(int line) const {
  return place_in(file, line);
}

void UrdfRobot::fail(int line, const std::string& reason) const {
  throw UrdfError(place(line) + reason);
}

UrdfRobot read_urdf(const std::filesystem::path& file, const PackageFolders& packages) {
  return Reader(file, packages).read();
}

}  // namespace takt
