#include "client_lib/gateway/ur/robot_dynamics.h"

#include <tinyxml2.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "idl/common/parse.h"

namespace takt::ur {
namespace {

using tinyxml2::XMLElement;

std::string attribute(const XMLElement* element, const char* name) {
  const char* text = element == nullptr ? nullptr : element->Attribute(name);
  return text == nullptr ? "" : text;
}

double number(const XMLElement* element, const char* name) {
  const std::string text = attribute(element, name);
  const auto value = finite_number(text);
  if (!value) throw std::invalid_argument(std::string(name) + ": found '" + text + "'; allowed: a number");
  return *value;
}

double number_or(const XMLElement* element, const char* name, double otherwise) {
  return attribute(element, name).empty() ? otherwise : number(element, name);
}

/// Zeros where the attribute is missing, as in URDF.
Vec3 vector(const XMLElement* element, const char* name, const Vec3& otherwise = Vec3::Zero()) {
  const std::string text = attribute(element, name);
  if (text.empty()) return otherwise;
  std::istringstream words(text);
  std::vector<double> values;
  for (std::string word; words >> word;)
    if (const auto value = finite_number(word)) values.push_back(*value);
  if (values.size() != 3)
    throw std::invalid_argument(std::string(name) + ": found '" + text + "'; allowed: three numbers");
  return {values[0], values[1], values[2]};
}

Pose origin_of(const XMLElement& element) {
  const XMLElement* origin = element.FirstChildElement("origin");
  return {rotation_from_rpy(vector(origin, "rpy")), vector(origin, "xyz")};
}

/// Of a joint with limits; others have words of their own.
std::optional<JointType> limited_type(const XMLElement& joint) {
  for (const EnumeratorInfo& one : kEnumeration<JointType>.enumerators)
    if (one.name == attribute(&joint, "type")) return static_cast<JointType>(one.value);
  return std::nullopt;
}

class Reader {
 public:
  Reader(const std::string& urdf, const ArmModel& arm) : arm_(arm) {
    document_.Parse(urdf.data(), urdf.size());
    robot_ = document_.Error() ? nullptr : document_.FirstChildElement("robot");
    if (robot_ == nullptr) throw std::invalid_argument("the cell describes the robot without a URDF file");
    for (const XMLElement* joint = robot_->FirstChildElement("joint"); joint != nullptr;
         joint = joint->NextSiblingElement("joint")) {
      joints_[attribute(joint, "name")] = joint;
      above_[attribute(joint->FirstChildElement("child"), "link")] = joint;
    }
  }

  /// By joint of the arm.
  std::vector<BodyInertia> inertias() const {
    std::vector<BodyInertia> found(arm_.joints.size());
    std::vector<bool> has(arm_.joints.size(), false);
    for (const XMLElement* link = robot_->FirstChildElement("link"); link != nullptr;
         link = link->NextSiblingElement("link")) {
      const XMLElement* inertial = link->FirstChildElement("inertial");
      const auto place = place_of(attribute(link, "name"));
      if (inertial == nullptr || !place) continue;
      found[place->joint] =
          combined(found[place->joint], inertia_of(*inertial), place->X_JL * origin_of(*inertial));
      has[place->joint] = true;
    }
    for (std::size_t i = 0; i < has.size(); ++i)
      if (!has[i])
        throw std::invalid_argument("the robot's URDF file has no <inertial> of the link that joint '" +
                                    arm_.joints[i].name + "' moves");
    return found;
  }

 private:
  struct Place {
    std::size_t joint;
    Pose X_JL;
  };

  static BodyInertia inertia_of(const XMLElement& inertial) {
    const XMLElement* tensor = inertial.FirstChildElement("inertia");
    BodyInertia body;
    body.mass_kg = number(inertial.FirstChildElement("mass"), "value");
    const double xy = number(tensor, "ixy"), xz = number(tensor, "ixz"), yz = number(tensor, "iyz");
    body.I_BBcm_B << number(tensor, "ixx"), xy, xz, xy, number(tensor, "iyy"), yz, xz, yz,
        number(tensor, "izz");
    return body;
  }

  /// Nothing where no joint of the arm moves the link.
  std::optional<Place> place_of(std::string link) const {
    Pose X;
    for (std::size_t above = 0; above <= joints_.size(); ++above) {
      const auto found = above_.find(link);
      if (found == above_.end()) return std::nullopt;
      const XMLElement& joint = *found->second;
      const std::string name = attribute(&joint, "name");
      for (std::size_t i = 0; i < arm_.joints.size(); ++i)
        if (arm_.joints[i].name == name) return Place{i, X};
      X = origin_of(joint) * displacement(joint) * X;
      link = attribute(joint.FirstChildElement("parent"), "link");
    }
    throw std::invalid_argument("the links of the robot's URDF file are no tree");
  }

  /// Of a joint beside the arm, which stands: at zero or at the limit next to it, or where its leader leads it.
  Pose displacement(const XMLElement& joint) const {
    const double q = standing(joint, joints_.size());
    if (q == 0.0) return {};
    const Vec3 axis = vector(joint.FirstChildElement("axis"), "xyz", Vec3::UnitX()).normalized();
    if (limited_type(joint) == JointType::prismatic) return {Mat3::Identity(), q * axis};
    return {Eigen::AngleAxisd(q, axis).toRotationMatrix(), Vec3::Zero()};
  }

  double standing(const XMLElement& joint, std::size_t leaders) const {
    if (const XMLElement* mimic = joint.FirstChildElement("mimic"); mimic != nullptr && leaders > 0) {
      const auto leader = joints_.find(attribute(mimic, "joint"));
      const double q = leader == joints_.end() ? 0.0 : standing(*leader->second, leaders - 1);
      return number_or(mimic, "multiplier", 1.0) * q + number_or(mimic, "offset", 0.0);
    }
    if (!limited_type(joint)) return 0.0;
    if (std::any_of(arm_.joints.begin(), arm_.joints.end(),
                    [&](const JointModel& one) { return one.name == attribute(&joint, "name"); }))
      return 0.0;
    const XMLElement* limit = joint.FirstChildElement("limit");
    const double lower = number_or(limit, "lower", 0.0), upper = number_or(limit, "upper", 0.0);
    return std::max(lower, std::min(0.0, upper));
  }

  const ArmModel& arm_;
  tinyxml2::XMLDocument document_;
  const XMLElement* robot_ = nullptr;
  std::map<std::string, const XMLElement*> joints_, above_;  ///< by name; by the link that they carry
};

}  // namespace

RobotDynamics::RobotDynamics(const std::string& urdf, const ArmModel& arm) : X_JF_(arm.X_JF) {
  links_.gravity_R = Vec3::Zero();
  try {
    const std::vector<BodyInertia> inertias = Reader(urdf, arm).inertias();
    for (std::size_t i = 0; i < arm.joints.size(); ++i)
      links_.joints.push_back({arm.joints[i], static_cast<int>(i) - 1, inertias[i]});
    (void)MultibodyTree(links_);
  } catch (const std::invalid_argument& error) {
    problem_ = error.what();
  }
}

MultibodyTree RobotDynamics::tree(const BodyInertia& payload) const {
  if (!problem_.empty()) throw std::invalid_argument(problem_);
  if (const std::string problem = inertia_problem(payload); !problem.empty())
    throw std::invalid_argument("the payload: " + problem);
  TreeModel model = links_;
  BodyInertia& last = model.joints.back().inertia;
  last = combined(last, payload, X_JF_);
  return MultibodyTree(std::move(model));
}

Matrix6 RobotDynamics::mass_matrix(const Vector6& q, const BodyInertia& payload) const {
  const MultibodyTree arm = tree(payload);
  MultibodyTree::Workspace workspace;
  arm.update(q.data(), Vector6{}.data(), workspace);
  MultibodyTree::MassMatrix M;
  arm.mass_matrix(M, workspace);
  return M;
}

Vector6 RobotDynamics::coriolis_torques(const Vector6& q, const Vector6& qd,
                                        const BodyInertia& payload) const {
  const MultibodyTree arm = tree(payload);
  MultibodyTree::Workspace workspace;
  arm.update(q.data(), qd.data(), workspace);
  Vector6 torques{};
  arm.inverse_dynamics(Vector6{}.data(), torques.data(), workspace);
  return torques;
}

// A joint below another turns with it: d/dq_i of column j is axis_i x column_j where i is not after j. Else the moment arm
// alone changes, and the derivative is that of column i by q_j.
Matrix6 jacobian_rate(const Matrix6& J, const Vector6& qd) {
  Matrix6 rate = Matrix6::Zero();
  const auto linear = [&](Eigen::Index i) -> Vec3 { return J.block<3, 1>(0, i); };
  const auto axis = [&](Eigen::Index i) -> Vec3 { return J.block<3, 1>(3, i); };
  for (Eigen::Index j = 0; j < 6; ++j) {
    for (Eigen::Index i = 0; i < 6; ++i) {
      const double speed = qd[static_cast<std::size_t>(i)];
      const Eigen::Index first = std::min(i, j), second = std::max(i, j);
      rate.block<3, 1>(0, j) += speed * axis(first).cross(linear(second));
      if (i < j) rate.block<3, 1>(3, j) += speed * axis(i).cross(axis(j));
    }
  }
  return rate;
}

}  // namespace takt::ur
