#pragma once
// Contact pairs for tests.
#include <array>
#include <memory>

#include "server/contact/surface/polygonal_contact.h"
#include "tests/support/contact_meshes.h"

namespace takt::test {

inline std::shared_ptr<const ContactSurface> surface(const TriangleMesh& mesh, double edge_m = 0.0) {
  return std::make_shared<ContactSurface>(mesh, ContactSurfaceOptions{edge_m});
}

inline ContactLaw frictionless_law() {
  ContactParameters parameters;
  parameters.friction = 0.0;
  return contact_law(parameters);
}

inline RelativeMotion at_rest(const Vec3& p_TB, const Mat3& R_TB = Mat3::Identity()) {
  return {{R_TB, p_TB}, {}};
}

inline ContactResult evaluate(PolygonalContact& contact, const RelativeMotion& motion) {
  ContactResult result;
  contact.evaluate(motion, result);
  return result;
}

/// A block of 0.4 x 0.3 x 0.1 m whose top is at z = 0, in 24 triangles.
inline TriangleMesh floor_mesh() {
  return moved(lattice_box({0.4, 0.3, 0.1}, std::array<int, 3>{1, 1, 1}),
               {Mat3::Identity(), Vec3(0.0, 0.0, -0.05)});
}

/// The same motion a little later on the path that `displacement` (linear, angular; about the origin of T,
/// axes of T) makes; the field of velocities stays.
inline RelativeMotion displaced(const RelativeMotion& motion,
                                const Eigen::Matrix<double, 6, 1>& displacement) {
  const Vec3 a = displacement.head<3>(), w = displacement.tail<3>();
  const double angle = w.norm();
  const Mat3 turn = angle > 0.0 ? Mat3(Eigen::AngleAxisd(angle, Vec3(w / angle)).toRotationMatrix())
                                : Mat3(Mat3::Identity());
  RelativeMotion result;
  result.X_TB.R = turn * motion.X_TB.R;
  result.X_TB.p = turn * motion.X_TB.p + a;
  const Vec3 v0 = motion.V_TB_T.v - motion.V_TB_T.w.cross(motion.X_TB.p);
  result.V_TB_T.w = motion.V_TB_T.w;
  result.V_TB_T.v = v0 + motion.V_TB_T.w.cross(result.X_TB.p);
  return result;
}

inline Eigen::Matrix<double, 6, 1> stacked(const Wrench& F) {
  Eigen::Matrix<double, 6, 1> result;
  result << F.f, F.t;
  return result;
}

}  // namespace takt::test
