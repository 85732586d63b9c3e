#include "server/scenario/urdf_dynamics.h"

#include <tinyxml.h>

#include <array>
#include <cmath>
#include <limits>
#include <locale>
#include <map>
#include <sstream>
#include <system_error>

namespace takt {

namespace {

class TreeReader {
 public:
  TreeReader(const std::filesystem::path& file, const UrdfTreeOptions& options)
      : file_(file), options_(options) {}

  UrdfTree read(const std::string& text, const std::string& base_link) {
    TiXmlDocument document;  // found well-formed and without loops by read_urdf_text() or read_urdf_arm()
    document.Parse(text.c_str(), nullptr, TIXML_ENCODING_UTF8);
    const TiXmlElement* robot = document.FirstChildElement("robot");
    if (robot == nullptr) throw UrdfError(file_.string() + ": found no element <robot>");
    for (const TiXmlElement& link : children(*robot, "link")) {
      links_[attribute(link, "name")] = &link;
      require_meshes(link);
    }
    for (const TiXmlElement& joint : children(*robot, "joint")) {
      const TiXmlElement* parent = joint.FirstChildElement("parent");
      if (parent != nullptr) below_[attribute(*parent, "link")].push_back(&joint);
    }
    const auto base = links_.find(base_link);
    if (base == links_.end()) {
      std::string names;
      for (const auto& [name, unused] : links_) names += (names.empty() ? "" : ", ") + name;
      throw UrdfError(file_.string() + ": there is no link '" + base_link + "'; the file has the links " +
                      names);
    }
    add_link(base_link, -1, Pose{});
    for (size_t i = 0; i < moving_.size(); ++i) check_moving(static_cast<int>(i));
    resolve_mimics();
    return std::move(result_);
  }

 private:
  struct Moving {
    const TiXmlElement* joint = nullptr;
    const TiXmlElement* link = nullptr;
    bool has_inertial = false;
  };

  [[noreturn]] void refuse(const TiXmlElement& element, const std::string& reason) const {
    throw UrdfError(place(element) + reason);
  }

  std::string place(const TiXmlElement& element) const {
    return file_.string() + ": line " + std::to_string(element.Row()) + ", column " +
           std::to_string(element.Column()) + ": ";
  }

  static std::vector<std::reference_wrapper<const TiXmlElement>> children(const TiXmlElement& element,
                                                                          const char* name) {
    std::vector<std::reference_wrapper<const TiXmlElement>> found;
    for (const TiXmlElement* child = element.FirstChildElement(name); child != nullptr;
         child = child->NextSiblingElement(name))
      found.push_back(*child);
    return found;
  }

  static std::string attribute(const TiXmlElement& element, const char* name) {
    const char* value = element.Attribute(name);
    return value != nullptr ? value : "";
  }

  /// N finite numbers from an attribute of `element`, or `missing` where the element or the attribute is not
  /// there.
  template <size_t N>
  std::array<double, N> numbers(const TiXmlElement* element, const char* name, const std::string& who,
                                const std::array<double, N>* missing) const {
    if (element == nullptr || (element->Attribute(name) == nullptr && missing != nullptr)) return *missing;
    const std::string value = attribute(*element, name);
    std::istringstream in(value);
    in.imbue(std::locale::classic());
    std::array<double, N> result{};
    bool good = true;
    for (double& number : result) good = good && (in >> number) && std::isfinite(number);
    std::string rest;
    if (!good || (in >> rest)) {
      refuse(*element, who + ": " + name + ": found '" + value + "'; allowed: " +
                           (N == 1 ? "a finite number" : std::to_string(N) + " finite numbers"));
    }
    return result;
  }

  Vec3 vector(const TiXmlElement* element, const char* name, const std::string& who,
              const Vec3& missing) const {
    const std::array<double, 3> default_value{missing.x(), missing.y(), missing.z()};
    const auto v = numbers<3>(element, name, who, &default_value);
    return {v[0], v[1], v[2]};
  }

  double number(const TiXmlElement& element, const char* name, const std::string& who) const {
    return numbers<1>(&element, name, who, nullptr)[0];
  }
  double number(const TiXmlElement& element, const char* name, const std::string& who, double missing) const {
    const std::array<double, 1> default_value{missing};
    return numbers<1>(&element, name, who, &default_value)[0];
  }

  Pose origin_of(const TiXmlElement& element, const std::string& who) const {
    const TiXmlElement* origin = element.FirstChildElement("origin");
    return {rotation_from_rpy(vector(origin, "rpy", who + ": <origin>", Vec3::Zero())),
            vector(origin, "xyz", who + ": <origin>", Vec3::Zero())};
  }

  /// Nothing is computed from meshes here, but a robot that lacks one is not the robot that was meant. Paths
  /// of ROS packages cannot be followed and are left to those who can.
  void require_meshes(const TiXmlElement& link) const {
    for (const char* kind : {"visual", "collision"}) {
      for (const TiXmlElement& element : children(link, kind)) {
        const TiXmlElement* geometry = element.FirstChildElement("geometry");
        const TiXmlElement* mesh = geometry != nullptr ? geometry->FirstChildElement("mesh") : nullptr;
        if (mesh == nullptr) continue;
        const std::string name = attribute(*mesh, "filename");
        if (name.rfind("package://", 0) == 0) continue;
        std::error_code error;
        if (!name.empty() && std::filesystem::is_regular_file(file_.parent_path() / name, error)) continue;
        refuse(*mesh, "link '" + attribute(link, "name") + "': <mesh>: filename: found '" + name +
                          "'; there is no such file beside the URDF file");
      }
    }
  }

  /// Adds `name`, which is fixed to link `joint` of the tree at X_JL, and all below it. No deeper than the
  /// file has links: there are no loops.
  void add_link(const std::string& name, int joint, const Pose& X_JL) {
    result_.frames.push_back({name, joint, X_JL});
    const auto found = links_.find(name);
    if (found != links_.end()) add_inertia(*found->second, joint, X_JL);
    for (const TiXmlElement* element : below_[name]) add_joint(*element, joint, X_JL);
  }

  void add_joint(const TiXmlElement& element, int parent, const Pose& X_JL) {
    const std::string who = "joint '" + attribute(element, "name") + "' (" + attribute(element, "type") + ")";
    const TiXmlElement* child = element.FirstChildElement("child");
    const std::string child_link = child != nullptr ? attribute(*child, "link") : "";
    const Pose X_PJ = X_JL * origin_of(element, who);
    if (attribute(element, "type") == "fixed") {
      add_link(child_link, parent, X_PJ);
      return;
    }
    const int index = result_.tree.joint_count();
    if (index == kMaxJoints) {
      refuse(element, who + ": it is moving joint number " + std::to_string(kMaxJoints + 1) + "; at most " +
                          std::to_string(kMaxJoints) + " are allowed");
    }
    TreeJoint joint;
    joint.joint = joint_of(element, who);
    joint.joint.X_PJ = X_PJ;
    joint.parent = parent;
    result_.tree.joints.push_back(joint);
    const auto link = links_.find(child_link);
    moving_.push_back({&element, link != links_.end() ? link->second : &element, false});
    add_link(child_link, index, Pose{});
  }

  JointModel joint_of(const TiXmlElement& element, const std::string& who) const {
    JointModel joint;
    joint.name = attribute(element, "name");
    const std::string type = attribute(element, "type");
    const bool continuous = type == "continuous";
    if (type != "revolute" && type != "prismatic" && !continuous)
      refuse(element, who + ": the type is not allowed; allowed: revolute, continuous, prismatic, fixed");
    joint.type = type == "prismatic" ? JointType::prismatic : JointType::revolute;
    const TiXmlElement* axis_element = element.FirstChildElement("axis");
    const Vec3 axis = vector(axis_element, "xyz", who + ": <axis>", Vec3::UnitX());
    if (!(axis.norm() > 1e-6))
      refuse(*axis_element, who + ": <axis>: xyz: found '" + attribute(*axis_element, "xyz") +
                                "'; allowed: a vector with a direction");
    joint.axis = axis.normalized();

    constexpr double kInfinite = std::numeric_limits<double>::infinity();
    const TiXmlElement* limit = element.FirstChildElement("limit");
    if (continuous && options_.limits_needed)
      refuse(element, who +
                          ": it turns without end, but limits are needed here; allowed: type revolute with "
                          "<limit lower upper velocity effort>");
    if (limit == nullptr && !continuous)
      refuse(element, who + ": found no <limit>; lower, upper, velocity and effort are needed");
    joint.lower = -kInfinite;
    joint.upper = joint.max_velocity = joint.max_effort = kInfinite;
    if (limit == nullptr) return joint;
    const std::string limits = who + ": <limit>";
    if (!continuous) {
      joint.lower = number(*limit, "lower", limits, 0.0);
      joint.upper = number(*limit, "upper", limits, 0.0);
      if (!(joint.lower < joint.upper))
        refuse(*limit, limits + ": found lower '" + attribute(*limit, "lower") + "', upper '" +
                           attribute(*limit, "upper") + "'; lower must be below upper");
    }
    joint.max_velocity = number(*limit, "velocity", limits);
    joint.max_effort = number(*limit, "effort", limits);
    if (!(joint.max_velocity > 0.0))
      refuse(*limit, limits + ": velocity: found '" + attribute(*limit, "velocity") + "'; allowed: > 0");
    if (!(joint.max_effort >= 0.0))
      refuse(*limit, limits + ": effort: found '" + attribute(*limit, "effort") + "'; allowed: >= 0");
    return joint;
  }

  void add_inertia(const TiXmlElement& link, int joint, const Pose& X_JL) {
    const TiXmlElement* inertial = link.FirstChildElement("inertial");
    if (inertial == nullptr) return;
    const std::string who = "link '" + attribute(link, "name") + "': <inertial>";
    const TiXmlElement* mass = inertial->FirstChildElement("mass");
    const TiXmlElement* tensor = inertial->FirstChildElement("inertia");
    if (mass == nullptr || tensor == nullptr) refuse(*inertial, who + ": <mass> and <inertia> are needed");
    const std::string of = who + ": <inertia>";
    const double xx = number(*tensor, "ixx", of), yy = number(*tensor, "iyy", of),
                 zz = number(*tensor, "izz", of), xy = number(*tensor, "ixy", of, 0.0),
                 xz = number(*tensor, "ixz", of, 0.0), yz = number(*tensor, "iyz", of, 0.0);
    BodyInertia at_centre;
    at_centre.mass_kg = number(*mass, "value", who + ": <mass>");
    at_centre.I_BBcm_B << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    const std::string problem = inertia_problem(at_centre);
    if (!problem.empty()) refuse(at_centre.mass_kg < 0.0 ? *mass : *tensor, who + ": " + problem);
    const std::string remark = inertia_remark(at_centre);
    if (joint >= 0 && !remark.empty()) result_.remarks.push_back(place(*tensor) + who + ": " + remark);
    if (joint < 0) return;  // of the base: it does not move
    BodyInertia& sum = result_.tree.joints[static_cast<size_t>(joint)].inertia;
    sum = combined(sum, at_centre, X_JL * origin_of(*inertial, who));
    moving_[static_cast<size_t>(joint)].has_inertial = true;
  }

  void check_moving(int joint) const {
    const Moving& moving = moving_[static_cast<size_t>(joint)];
    if (!options_.inertias_needed || moving.has_inertial) return;
    const std::string who = "link '" + attribute(*moving.link, "name") + "'";
    refuse(*moving.link, who +
                             ": found no <inertial>, neither on it nor on what is fixed to it, but joint '" +
                             attribute(*moving.joint, "name") +
                             "' moves it and dynamics are needed here; needed: <inertial> with <mass> and "
                             "<inertia>");
  }

  void resolve_mimics() {
    std::map<std::string, int> index;
    for (int i = 0; i < result_.tree.joint_count(); ++i)
      index[result_.tree.joints[static_cast<size_t>(i)].joint.name] = i;
    for (int i = 0; i < result_.tree.joint_count(); ++i) {
      const TiXmlElement* joint = moving_[static_cast<size_t>(i)].joint;
      const TiXmlElement* mimic = joint->FirstChildElement("mimic");
      if (mimic == nullptr) continue;
      const std::string who = "joint '" + attribute(*joint, "name") + "': <mimic>";
      const auto source = index.find(attribute(*mimic, "joint"));
      if (source == index.end())
        refuse(*mimic, who + ": joint: found '" + attribute(*mimic, "joint") +
                           "', which is no moving joint below the base link");
      result_.mimics.push_back(
          {i, source->second, number(*mimic, "multiplier", who, 1.0), number(*mimic, "offset", who, 0.0)});
      for (int at = source->second, steps = 0; steps <= kMaxJoints; ++steps) {
        const TiXmlElement* next = moving_[static_cast<size_t>(at)].joint->FirstChildElement("mimic");
        const auto above = next != nullptr ? index.find(attribute(*next, "joint")) : index.end();
        if (above == index.end()) break;
        at = above->second;
        if (at == i) refuse(*mimic, who + ": the joints it follows lead back to it");
      }
    }
  }

  std::filesystem::path file_;
  UrdfTreeOptions options_;
  std::map<std::string, const TiXmlElement*> links_;               // by name
  std::map<std::string, std::vector<const TiXmlElement*>> below_;  // joints by parent link, order of the file
  std::vector<Moving> moving_;                                     // parallel to the joints of the tree
  UrdfTree result_;
};

}  // namespace

UrdfInertias read_urdf_inertias(const std::filesystem::path& file, const UrdfArm& urdf,
                                const std::string& base_link) {
  const UrdfTree whole = TreeReader(file, {}).read(urdf.text, base_link);
  UrdfInertias result{{}, whole.remarks};
  for (const JointModel& joint : urdf.arm.joints) {
    for (const TreeJoint& candidate : whole.tree.joints)
      if (candidate.joint.name == joint.name) result.links.push_back(candidate.inertia);
  }
  return result;
}

UrdfTree read_urdf_tree(const std::filesystem::path& file, const std::string& base_link,
                        const UrdfTreeOptions& options) {
  return TreeReader(file, options).read(read_urdf_text(file), base_link);
}

}  // namespace takt
