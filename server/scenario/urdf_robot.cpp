#include "server/scenario/urdf_robot.h"

#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <locale>
#include <map>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "idl/common/bounded_file.h"
#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "idl/common/utf8.h"

namespace takt {

namespace {

using tinyxml2::XMLElement;

constexpr std::array<const char*, 6> kJointTypes{"fixed",     "revolute", "continuous",
                                                 "prismatic", "floating", "planar"};

constexpr std::size_t kLargestUrdf_MB = 16;

class Reader {
 public:
  Reader(const std::filesystem::path& file, const PackageFolders& packages) {
    robot_.file = file;
    robot_.packages = packages;
  }

  UrdfRobot read() {
    read_text();
    tinyxml2::XMLDocument document;
    if (document.Parse(robot_.text.data(), robot_.text.size()) != tinyxml2::XML_SUCCESS)
      fail_at_xml(document);
    const XMLElement* robot = document.FirstChildElement("robot");
    if (robot == nullptr) fail_at_root(document.RootElement());
    require_expanded(*robot);
    require(*robot, "name", "<robot>");
    const std::string version = attribute(*robot, "version");
    if (robot->Attribute("version") != nullptr && version != "1.0" && version != "1")
      fail(*robot, "<robot>: version: found '" + version + "'; allowed: 1.0");
    for_each(*robot, "material", [&](const XMLElement& element) { read_material(element); });
    for_each(*robot, "link", [&](const XMLElement& element) { read_link(element); });
    if (robot_.links.empty()) fail(*robot, "<robot>: found no <link>; at least one is needed");
    for_each(*robot, "joint", [&](const XMLElement& element) { read_joint(element); });
    require_tree();
    return std::move(robot_);
  }

 private:
  using Names = std::map<std::string, std::size_t>;

  [[noreturn]] void fail(const XMLElement& element, const std::string& reason) const {
    robot_.fail(element.GetLineNum(), reason);
  }

  [[noreturn]] void fail_at_xml(const tinyxml2::XMLDocument& document) const {
    std::string reason = "elements are nested deeper than " + std::to_string(TINYXML2_MAX_ELEMENT_DEPTH);
    if (document.ErrorID() != tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED) {
      reason = document.ErrorName();
      if (reason.rfind("XML_ERROR_", 0) == 0) reason.erase(0, 10);
      std::replace(reason.begin(), reason.end(), '_', ' ');
      reason = "not well-formed XML: " + lower_text(reason);
    }
    robot_.fail(document.ErrorLineNum(), reason);
  }

  [[noreturn]] void fail_at_root(const XMLElement* root) const {
    if (root == nullptr) robot_.fail(0, "found no element <robot>");
    const std::string name = root->Name();
    if (name == "sdf")
      fail(*root, "found <sdf>: an SDFormat file; allowed: a URDF file, whose root element is <robot>");
    fail(*root, "found <" + name + "> as the root element; allowed: <robot>");
  }

  /// Fails for a file with macros of xacro.
  void require_expanded(const XMLElement& element) const {
    const std::string_view name = element.Name();
    if (name.starts_with("xacro:"))
      fail(element, "found <" + std::string(name) +
                        ">: the file is a xacro, from which a URDF is made; allowed: a URDF, as 'xacro " +
                        robot_.file.filename().string() + " > robot.urdf' writes it (ROS package xacro)");
    for_each(element, nullptr, [&](const XMLElement& child) { require_expanded(child); });
  }

  void read_text() {
    std::error_code error;
    if (!std::filesystem::is_regular_file(robot_.file, error)) robot_.fail(0, "there is no such file");
    FileText read = read_bounded_file(robot_.file, kLargestUrdf_MB);
    if (!read.problem.empty()) robot_.fail(0, read.problem);
    robot_.text = std::move(read.text);
    const std::string_view text = robot_.text;
    const std::size_t end = std::min(find_invalid_utf8(text), text.find('\0'));
    if (end < text.size())
      robot_.fail(1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(end), '\n')),
                  "found a byte that is not UTF-8, or zero; allowed: text in UTF-8");
  }

  template <class Function>
  static void for_each(const XMLElement& parent, const char* name, Function function) {
    const XMLElement* element = parent.FirstChildElement(name);
    for (; element != nullptr; element = element->NextSiblingElement(name)) function(*element);
  }

  std::string attribute(const XMLElement& element, const char* name) const {
    const char* value = element.Attribute(name);
    if (value == nullptr) return {};
    if (!validate_utf8(value, LineBreaks::allow))  // by a character reference
      fail(element, std::string(name) + ": found '" + utf8_sanitize(value, 100) +
                        "'; allowed: UTF-8 without control characters");
    return value;
  }

  std::string require(const XMLElement& element, const char* name, const std::string& where) const {
    std::string value = attribute(element, name);
    if (value.empty()) fail(element, where + ": " + name + ": found nothing; a text is needed");
    return value;
  }

  const XMLElement& require_child(const XMLElement& element, const char* name,
                                  const std::string& where) const {
    const XMLElement* child = element.FirstChildElement(name);
    if (child == nullptr) fail(element, where + ": found no <" + name + ">, which is needed");
    return *child;
  }

  /// N finite numbers between white space.
  template <std::size_t N>
  std::array<double, N> numbers(const XMLElement& element, const char* name, const std::string& where) const {
    const std::string value = attribute(element, name);
    std::istringstream words(value);
    words.imbue(std::locale::classic());
    std::string word;
    std::array<double, N> result{};
    std::size_t count = 0;
    bool valid = true;
    for (; valid && words >> word; ++count) {
      const auto number = finite_number(word);
      valid = count < N && number;
      if (valid) result[count] = *number;
    }
    if (valid && count == N) return result;
    fail(element, where + ": " + name + ": found '" + value +
                      "'; allowed: " + (N == 1 ? "a finite number" : std::to_string(N) + " finite numbers"));
  }

  double number(const XMLElement& element, const char* name, const std::string& where) const {
    return numbers<1>(element, name, where)[0];
  }

  /// `missing` where the attribute is not there.
  double number(const XMLElement& element, const char* name, const std::string& where, double missing) const {
    return element.Attribute(name) == nullptr ? missing : number(element, name, where);
  }
  Vec3 vector(const XMLElement& element, const char* name, const std::string& where,
              const Vec3& missing) const {
    if (element.Attribute(name) == nullptr) return missing;
    const auto v = numbers<3>(element, name, where);
    return {v[0], v[1], v[2]};
  }

  Pose origin(const XMLElement& parent, const std::string& where) const {
    const XMLElement* element = parent.FirstChildElement("origin");
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
    link.line = element.GetLineNum();
    link.name = add_name(element, "link", links_, robot_.links.size());
    const std::string where = "link '" + link.name + "': ";
    if (const XMLElement* inertial = element.FirstChildElement("inertial"))
      link.inertial = read_inertial(*inertial, where + "<inertial>");
    for_each(element, "visual",
             [&](const XMLElement& shape) { link.visuals.push_back(read_shape(shape, where + "<visual>")); });
    for_each(element, "collision", [&](const XMLElement& shape) {
      link.collisions.push_back(read_shape(shape, where + "<collision>"));
    });
    robot_.links.push_back(std::move(link));
  }

  UrdfInertial read_inertial(const XMLElement& element, const std::string& where) const {
    UrdfInertial inertial;
    inertial.line = element.GetLineNum();
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
    const char* name = element.Attribute("name");
    std::optional<std::array<float, 3>>& known = colors_[name == nullptr ? "" : name];
    const XMLElement* color = element.FirstChildElement("color");
    if (color == nullptr) return name == nullptr ? std::nullopt : known;
    std::istringstream text(attribute(*color, "rgba"));
    text.imbue(std::locale::classic());
    std::array<float, 3> rgb{};
    for (float& part : rgb) {
      text >> part;
      part = std::clamp(part, 0.0F, 1.0F);
    }
    if (!text) return std::nullopt;
    known = rgb;
    return rgb;
  }

  UrdfShape read_shape(const XMLElement& element, const std::string& where) {
    const XMLElement* geometry = element.FirstChildElement("geometry");
    const XMLElement* kind = geometry != nullptr ? geometry->FirstChildElement() : nullptr;
    if (kind == nullptr)
      fail(element, where + ": found no geometry; allowed: <geometry> with box, cylinder, sphere or mesh");
    const std::string name = kind->Name(), of = where + ": <" + name + ">";
    UrdfShape shape;
    shape.line = kind->GetLineNum();
    shape.X_LS = origin(element, where);
    if (const XMLElement* material = element.FirstChildElement("material"))
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
    joint.line = element.GetLineNum();
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
    if (const XMLElement* axis = element.FirstChildElement("axis"))
      joint.axis = vector(*axis, "xyz", where + ": <axis>", Vec3::UnitX());
    if (const XMLElement* limit = element.FirstChildElement("limit"))
      joint.limit = read_limit(*limit, where + ": <limit>");
    else if (joint.type == UrdfJointType::revolute || joint.type == UrdfJointType::prismatic)
      fail(element, where + ": found no <limit>; lower, upper, velocity and effort are needed");
    if (const XMLElement* mimic = element.FirstChildElement("mimic"))
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
            element.GetLineNum()};
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
  return file.string() + ": " + (line > 0 ? "line " + std::to_string(line) + ": " : "");
}

void UrdfRobot::fail(int line, const std::string& reason) const {
  throw UrdfError(place(line) + reason);
}

UrdfRobot read_urdf(const std::filesystem::path& file, const PackageFolders& packages) {
  return Reader(file, packages).read();
}

}  // namespace takt
