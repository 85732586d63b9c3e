// Converts a TreeModel to the constants of a MultibodyTree, and refuses unphysical ones.
#include <Eigen/Eigenvalues>
#include <cmath>
#include <locale>
#include <sstream>
#include <stdexcept>

#include "plant_models/mechanics/multibody_tree.h"

namespace takt {

using mechanics::M3;
using mechanics::S3;
using mechanics::V3;

namespace {

std::string text_of(double value) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out.precision(9);
  out << value;
  return out.str();
}

std::string text_of(const Vec3& v) {
  return "(" + text_of(v.x()) + ", " + text_of(v.y()) + ", " + text_of(v.z()) + ")";
}

/// Tensor about the origin of the frame instead of the centre of mass.
Mat3 inertia_about_origin(const BodyInertia& body) {
  const Vec3& c = body.p_BBcm_B;
  return body.I_BBcm_B + body.mass_kg * (c.squaredNorm() * Mat3::Identity() - c * c.transpose());
}

/// A rotation whose third column is `axis`; exact for the axes of the frame.
Mat3 frame_along(const Vec3& axis) {
  Eigen::Index most = 0;
  axis.cwiseAbs().maxCoeff(&most);
  const Vec3 x = Vec3::Unit((most + 1) % 3);
  Mat3 R;
  R.col(2) = axis;
  R.col(0) = (x - axis * axis.dot(x)).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return R;
}

}  // namespace

BodyInertia combined(const BodyInertia& a, const BodyInertia& b, const Pose& X_AB) {
  BodyInertia sum;
  sum.mass_kg = a.mass_kg + b.mass_kg;
  if (!(sum.mass_kg > 0.0)) return sum;
  const Vec3 p_B = X_AB * b.p_BBcm_B;
  const Vec3 d = p_B - a.p_BBcm_B;
  sum.p_BBcm_B = a.p_BBcm_B + d * (b.mass_kg / sum.mass_kg);
  const double reduced_mass = a.mass_kg * b.mass_kg / sum.mass_kg;
  const Mat3 tensor = a.I_BBcm_B + X_AB.R * b.I_BBcm_B * X_AB.R.transpose() +
                      reduced_mass * (d.squaredNorm() * Mat3::Identity() - d * d.transpose());
  sum.I_BBcm_B = 0.5 * (tensor + tensor.transpose());
  return sum;
}

std::string inertia_problem(const BodyInertia& inertia) {
  const Mat3& I = inertia.I_BBcm_B;
  if (!std::isfinite(inertia.mass_kg)) return "its mass is not finite";
  if (inertia.mass_kg < 0.0)
    return "its mass is " + text_of(inertia.mass_kg) + " kg; it must not be negative";
  if (!inertia.p_BBcm_B.allFinite()) return "its centre of mass is not finite";
  if (!I.allFinite()) return "its inertia tensor is not finite";
  const double size = I.cwiseAbs().maxCoeff();
  if (size > 0.0 && inertia.mass_kg == 0.0) return "it has an inertia tensor but no mass";
  const double rounding = 1e-9 * size;  // of figures written in a file
  if ((I - I.transpose()).cwiseAbs().maxCoeff() > rounding) return "its inertia tensor is not symmetric";
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(I, Eigen::EigenvaluesOnly);
  const Vec3 principal = eigen.eigenvalues();  // ascending
  if (principal.x() < -rounding) {
    return "its principal moments of inertia are " + text_of(principal) + " kg m^2; none may be negative";
  }
  return {};
}

std::string inertia_remark(const BodyInertia& inertia) {
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(inertia.I_BBcm_B, Eigen::EigenvaluesOnly);
  const Vec3 principal = eigen.eigenvalues();
  if (!(principal.z() > (principal.x() + principal.y()) * (1.0 + 1e-9))) return {};
  return "its principal moments of inertia are " + text_of(principal) +
         " kg m^2; no body has one that is larger than the sum of the other two";
}

MultibodyTree::MultibodyTree(TreeModel model) : model_(std::move(model)), minus_gravity_(-model_.gravity_R) {
  const int n = joint_count();
  if (n > kMax)
    throw std::invalid_argument("the tree has " + std::to_string(n) + " moving joints; at most " +
                                std::to_string(kMax) + " are allowed");
  if (!model_.gravity_R.allFinite()) throw std::invalid_argument("gravity is not finite");
  links_.reserve(model_.joints.size());
  std::vector<Mat3> frames;  // R_LA
  for (int i = 0; i < n; ++i) {
    const TreeJoint& joint = model_.joints[static_cast<size_t>(i)];
    const auto refuse = [&](const std::string& why) {
      throw std::invalid_argument("joint '" + joint.joint.name + "' (number " + std::to_string(i + 1) +
                                  "): " + why);
    };
    if (joint.parent < -1 || joint.parent >= i)
      refuse("its parent has index " + std::to_string(joint.parent) +
             "; a parent stands before its children, -1 is the base");
    const Vec3& axis = joint.joint.axis;
    if (!(std::abs(axis.norm() - 1.0) < 1e-9)) refuse("its axis " + text_of(axis) + " is not a unit vector");
    if (!joint.joint.X_PJ.R.allFinite() || !joint.joint.X_PJ.p.allFinite())
      refuse("its place in the parent is not finite");
    if (!(joint.armature >= 0.0) || !std::isfinite(joint.armature))
      refuse("the inertia of its drive is " + text_of(joint.armature) +
             "; it must be finite and not negative");
    const std::string problem = inertia_problem(joint.inertia);
    if (!problem.empty()) refuse("the link it moves is not physical: " + problem);

    Link link;
    link.parent = joint.parent;
    link.revolute = joint.joint.type == JointType::revolute;
    link.mass = joint.inertia.mass_kg;
    link.armature = joint.armature;
    const Mat3 R_LA = frame_along(axis);
    const Mat3 R_AP =
        joint.parent >= 0 ? Mat3(frames[static_cast<size_t>(joint.parent)].transpose()) : Mat3::Identity();
    frames.push_back(R_LA);
    link.R_AL = R_LA.transpose();
    link.R_PA = M3(R_AP * joint.joint.X_PJ.R * R_LA);
    link.p_PA = V3(Vec3(R_AP * joint.joint.X_PJ.p));
    link.moment_A = V3(Vec3(link.R_AL * (link.mass * joint.inertia.p_BBcm_B)));
    const Mat3 I_A = link.R_AL * inertia_about_origin(joint.inertia) * R_LA;
    link.inertia_A = S3(Mat3(0.5 * (I_A + I_A.transpose())));
    // Enough for a mass matrix that is positive definite in every position: whichever joints move, the first
    // of them towards the root moves its own link.
    const double own = (link.revolute ? link.inertia_A.zz : link.mass) + link.armature;
    if (!(own > 1e-12))
      refuse(std::string("nothing resists its motion: its link has no ") +
             (link.revolute ? "inertia about the joint's axis" : "mass") +
             " and its drive no inertia; give the link an inertia or the drive an armature");
    links_.push_back(link);
  }
}

}  // namespace takt
