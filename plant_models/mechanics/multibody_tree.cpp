#include "plant_models/mechanics/multibody_tree.h"

#include "plant_models/mechanics/sine_cosine.h"

// Written out per link, root to tip and tip to root. Two things keep it short of Featherstone's general form:
// - Accelerations are those of the points themselves, not spatial ones: the velocity-dependent part of a
//   link's acceleration is then c_w = w_P x z qd and c_v = w_P x (w_P x r), which costs four cross products.
// - The forward pass first moves the tree with all joint accelerations zero (which includes gravity,
//   velocities and applied wrenches) and then solves for the additional acceleration by the joint forces. So
//   the articulated pass itself has no velocity-dependent terms.

namespace takt {

using mechanics::M3;
using mechanics::S3;
using mechanics::V3;

namespace {

/// m -= a b^T
inline void subtract_outer(M3& m, const V3& a, const V3& b) {
  m.x -= a * b.x;
  m.y -= a * b.y;
  m.z -= a * b.z;
}

/// s -= a b^T, where a and b are parallel
inline void subtract_outer(S3& s, const V3& a, const V3& b) {
  s.xx -= a.x * b.x, s.xy -= a.x * b.y, s.xz -= a.x * b.z;
  s.yy -= a.y * b.y, s.yz -= a.y * b.z, s.zz -= a.z * b.z;
}

/// The matrix of the cross product r x.
inline M3 cross_matrix(const V3& r) {
  return {{0.0, r.z, -r.y}, {-r.z, 0.0, r.x}, {r.y, -r.x, 0.0}};
}

/// Of a link at the base, without that of its joint.
inline void set_root_acceleration(const MultibodyTree::Workspace::Base& base, const V3& minus_gravity,
                                  MultibodyTree::Workspace::LinkState& s) {
  s.a_w = V3{};
  s.a_v = minus_gravity;
  if (!base.moves) return;
  s.a_w = base.a_w + s.c_w;
  s.a_v = base.a_v + base.minus_gravity + cross(base.a_w, s.r) + s.c_v;
}

}  // namespace

void MultibodyTree::update(const double* q, const double* qd, Workspace& w) const {
  const int n = joint_count();
  std::array<double, kMax> sines, cosines;
  mechanics::sine_cosine(q, n, sines.data(), cosines.data());
  for (int i = 0; i < n; ++i) {
    const Link& link = links_[static_cast<size_t>(i)];
    auto& s = w.links[static_cast<size_t>(i)];
    w.qd[static_cast<size_t>(i)] = qd[i];
    V3 w_P, v_P, p_P;
    M3 R;
    if (link.parent >= 0) {
      const auto& parent = w.links[static_cast<size_t>(link.parent)];
      w_P = parent.w;
      v_P = parent.v;
      p_P = parent.p;
      R = parent.R * link.R_PA;
      s.r = parent.R * link.p_PA;
    } else {
      R = link.R_PA;
      s.r = link.p_PA;
      if (w.base.moves) w_P = w.base.w, v_P = w.base.v;
    }
    if (link.revolute) {
      const double sine = sines[static_cast<size_t>(i)], cosine = cosines[static_cast<size_t>(i)];
      s.R.x = R.x * cosine + R.y * sine;
      s.R.y = R.y * cosine - R.x * sine;
      s.R.z = R.z;
      s.c_w = cross(w_P, R.z) * qd[i];
      const V3 v_r = cross(w_P, s.r);
      s.c_v = cross(w_P, v_r);
      s.w = w_P + R.z * qd[i];
      s.v = v_P + v_r;
    } else {
      s.R = R;
      s.r += R.z * q[i];
      const V3 v_r = cross(w_P, s.r), v_s = R.z * qd[i];
      s.c_w = V3{};
      s.c_v = cross(w_P, v_r + v_s + v_s);
      s.w = w_P;
      s.v = v_P + v_r + v_s;
    }
    s.p = p_P + s.r;
    s.moment = s.R * link.moment_A;
  }
}

void MultibodyTree::inverse_dynamics(const double* qdd, double* tau, Workspace& w) const {
  const int n = joint_count();
  w.forward = false;
  for (int i = 0; i < n; ++i) {
    const Link& link = links_[static_cast<size_t>(i)];
    auto& s = w.links[static_cast<size_t>(i)];
    if (link.parent >= 0) {
      const auto& parent = w.links[static_cast<size_t>(link.parent)];
      s.a_w = parent.a_w + s.c_w;
      s.a_v = parent.a_v + cross(parent.a_w, s.r) + s.c_v;
    } else {
      set_root_acceleration(w.base, minus_gravity_, s);
    }
    (link.revolute ? s.a_w : s.a_v) += s.R.z * qdd[i];
    // The tensor is constant in A: turning two vectors there and one back is less than turning the tensor.
    const V3 w_A = transposed_times(s.R, s.w), a_A = transposed_times(s.R, s.a_w);
    const V3 t_A = link.inertia_A * a_A + cross(w_A, link.inertia_A * w_A);
    s.t = s.R * t_A + cross(s.moment, s.a_v) - s.ext_t;
    s.f = s.a_v * link.mass + cross(s.a_w, s.moment) + cross(s.w, cross(s.w, s.moment)) - s.ext_f;
  }
  for (int i = n - 1; i >= 0; --i) {
    const Link& link = links_[static_cast<size_t>(i)];
    const auto& s = w.links[static_cast<size_t>(i)];
    tau[i] = dot(s.R.z, link.revolute ? s.t : s.f) + link.armature * qdd[i];
    if (link.parent < 0) continue;
    auto& parent = w.links[static_cast<size_t>(link.parent)];
    parent.t += s.t + cross(s.r, s.f);
    parent.f += s.f;
  }
}

void MultibodyTree::forward_dynamics(const double* tau, const Mask& locked, double* qdd, double* tau_lock,
                                     Workspace& w) const {
  const int n = joint_count();
  w.forward = true;
  for (int i = 0; i < n; ++i) {  // the tree with the accelerations of the locked joints alone
    const Link& link = links_[static_cast<size_t>(i)];
    auto& s = w.links[static_cast<size_t>(i)];
    if (link.parent >= 0) {
      const auto& parent = w.links[static_cast<size_t>(link.parent)];
      s.a_w = parent.a_w + s.c_w;
      s.a_v = parent.a_v + cross(parent.a_w, s.r) + s.c_v;
    } else {
      set_root_acceleration(w.base, minus_gravity_, s);
    }
    if (locked[static_cast<size_t>(i)]) (link.revolute ? s.a_w : s.a_v) += s.R.z * qdd[i];
    s.J = rotated(s.R, link.inertia_A);
    s.H = cross_matrix(s.moment);
    s.M = S3{link.mass, 0.0, 0.0, link.mass, 0.0, link.mass};
    s.t = s.J * s.a_w + cross(s.w, s.J * s.w) + cross(s.moment, s.a_v) - s.ext_t;
    s.f = s.a_v * link.mass + cross(s.a_w, s.moment) + cross(s.w, cross(s.w, s.moment)) - s.ext_f;
  }
  for (int i = n - 1; i >= 0; --i) {  // articulated inertia of the rest of the tree, free at its joints
    const Link& link = links_[static_cast<size_t>(i)];
    auto& s = w.links[static_cast<size_t>(i)];
    const V3& z = s.R.z;
    if (link.revolute) {
      s.U_t = s.J * z;
      s.U_f = transposed_times(s.H, z);
    } else {
      s.U_t = s.H * z;
      s.U_f = s.M * z;
    }
    s.inverse_D = 1.0 / (dot(z, link.revolute ? s.U_t : s.U_f) + link.armature);
    s.u = tau[i] - dot(z, link.revolute ? s.t : s.f);
    if (link.parent < 0) continue;
    S3 J = s.J, M = s.M;
    M3 H = s.H;
    V3 t = s.t, f = s.f;
    if (!locked[static_cast<size_t>(i)]) {
      const V3 g_t = s.U_t * s.inverse_D, g_f = s.U_f * s.inverse_D;
      subtract_outer(J, g_t, s.U_t);
      subtract_outer(H, g_t, s.U_f);
      subtract_outer(M, g_f, s.U_f);
      t += g_t * s.u;
      f += g_f * s.u;
    }
    // From the link's origin to the parent's: H + r x M and J + r x H^T + (H + r x M) (r x)^T.
    const V3& r = s.r;
    auto& parent = w.links[static_cast<size_t>(link.parent)];
    const M3 K{H.x + cross(r, M.col_x()), H.y + cross(r, M.col_y()), H.z + cross(r, M.col_z())};
    parent.J.xx += J.xx + r.y * H.z.x - r.z * H.y.x + r.y * K.z.x - r.z * K.y.x;
    parent.J.xy += J.xy + r.y * H.z.y - r.z * H.y.y + r.z * K.x.x - r.x * K.z.x;
    parent.J.xz += J.xz + r.y * H.z.z - r.z * H.y.z + r.x * K.y.x - r.y * K.x.x;
    parent.J.yy += J.yy + r.z * H.x.y - r.x * H.z.y + r.z * K.x.y - r.x * K.z.y;
    parent.J.yz += J.yz + r.z * H.x.z - r.x * H.z.z + r.x * K.y.y - r.y * K.x.y;
    parent.J.zz += J.zz + r.x * H.y.z - r.y * H.x.z + r.x * K.y.z - r.y * K.x.z;
    parent.H.x += K.x;
    parent.H.y += K.y;
    parent.H.z += K.z;
    parent.M += M;
    parent.t += t + cross(r, f);
    parent.f += f;
  }
  for (int i = 0; i < n; ++i) {  // accelerations
    const Link& link = links_[static_cast<size_t>(i)];
    auto& s = w.links[static_cast<size_t>(i)];
    if (link.parent >= 0) {
      const auto& parent = w.links[static_cast<size_t>(link.parent)];
      s.d_w = parent.d_w;
      s.d_v = parent.d_v + cross(parent.d_w, s.r);
    } else {
      s.d_w = V3{};
      s.d_v = V3{};
    }
    const double left = s.u - dot(s.U_t, s.d_w) - dot(s.U_f, s.d_v);
    if (locked[static_cast<size_t>(i)]) {
      tau_lock[i] = link.armature * qdd[i] - left;
    } else {
      qdd[i] = left * s.inverse_D;
      tau_lock[i] = 0.0;
      (link.revolute ? s.d_w : s.d_v) += s.R.z * qdd[i];
    }
    s.a_w += s.d_w;
    s.a_v += s.d_v;
  }
}

}  // namespace takt
