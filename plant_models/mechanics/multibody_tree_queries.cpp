// Queries of a MultibodyTree besides its two dynamics: mass matrix, poses, reactions, energies.
#include "plant_models/mechanics/multibody_tree.h"

namespace takt {

using mechanics::M3;
using mechanics::S3;
using mechanics::V3;

void MultibodyTree::set_base(const Twist& V_R, const Twist& A_R, const Vec3& gravity_R, Workspace& w) const {
  w.base = {true, V3(V_R.w), V3(V_R.v), V3(A_R.w), V3(A_R.v), V3(-gravity_R)};
}

Vec3 MultibodyTree::gravity(const Workspace& w) const {
  return -minus_gravity(w).eigen();
}

void MultibodyTree::mass_matrix(MassMatrix& M, Workspace& w) const {
  const int n = joint_count();
  M.resize(n, n);
  // Composite bodies: link i with everything beyond it as one rigid body, about the origin of link i.
  struct Composite {
    double mass;
    V3 moment;
    S3 inertia;
  };
  std::array<Composite, kMax> bodies;
  for (int i = 0; i < n; ++i) {
    const Link& link = links_[static_cast<size_t>(i)];
    const auto& s = w.links[static_cast<size_t>(i)];
    bodies[static_cast<size_t>(i)] = {link.mass, s.moment, rotated(s.R, link.inertia_A)};
  }
  for (int i = n - 1; i >= 0; --i) {
    const Link& link = links_[static_cast<size_t>(i)];
    const auto& s = w.links[static_cast<size_t>(i)];
    const Composite& body = bodies[static_cast<size_t>(i)];
    if (link.parent >= 0) {
      Composite& parent = bodies[static_cast<size_t>(link.parent)];
      const V3& r = s.r;
      const V3& h = body.moment;
      const V3 k = h * 2.0 + r * body.mass;  // 2 h + m r
      parent.mass += body.mass;
      parent.moment += h + r * body.mass;
      S3& I = parent.inertia;
      I += body.inertia;
      I.xx += r.y * k.y + r.z * k.z;
      I.yy += r.x * k.x + r.z * k.z;
      I.zz += r.x * k.x + r.y * k.y;
      I.xy -= r.x * h.y + r.y * h.x + body.mass * r.x * r.y;
      I.xz -= r.x * h.z + r.z * h.x + body.mass * r.x * r.z;
      I.yz -= r.y * h.z + r.z * h.y + body.mass * r.y * r.z;
    }
    // Wrench that accelerates the composite body at one unit of joint i, carried down to the root.
    const V3& z = s.R.z;
    V3 f = link.revolute ? cross(z, body.moment) : z * body.mass;
    V3 t = link.revolute ? body.inertia * z : cross(body.moment, z);
    M(i, i) = dot(z, link.revolute ? t : f) + link.armature;
    for (int j = 0; j < i; ++j) M(i, j) = M(j, i) = 0.0;
    V3 r = s.r;
    for (int j = link.parent; j >= 0; j = links_[static_cast<size_t>(j)].parent) {
      const auto& above = w.links[static_cast<size_t>(j)];
      t += cross(r, f);
      M(i, j) = M(j, i) = dot(above.R.z, links_[static_cast<size_t>(j)].revolute ? t : f);
      r = above.r;
    }
  }
}

Pose MultibodyTree::link_pose(int link, const Workspace& w) const {
  const auto& s = w.links[static_cast<size_t>(link)];
  return {s.R.eigen() * links_[static_cast<size_t>(link)].R_AL, s.p.eigen()};
}

Twist MultibodyTree::link_twist(int link, const Workspace& w) const {
  const auto& s = w.links[static_cast<size_t>(link)];
  return {s.v.eigen(), s.w.eigen()};
}

Twist MultibodyTree::link_acceleration(int link, const Workspace& w) const {
  const auto& s = w.links[static_cast<size_t>(link)];
  return {(s.a_v - minus_gravity(w)).eigen(), s.a_w.eigen()};
}

void MultibodyTree::clear_wrenches(Workspace& w) const {
  for (int i = 0; i < joint_count(); ++i) {
    auto& s = w.links[static_cast<size_t>(i)];
    s.ext_t = s.ext_f = V3{};
  }
}

void MultibodyTree::add_wrench(int link, const Wrench& F_Lo_R, Workspace& w) const {
  auto& s = w.links[static_cast<size_t>(link)];
  s.ext_t += V3(F_Lo_R.t);
  s.ext_f += V3(F_Lo_R.f);
}

Wrench MultibodyTree::joint_wrench(int link, const Workspace& w) const {
  const auto& s = w.links[static_cast<size_t>(link)];
  V3 f = s.f, t = s.t;
  if (w.forward) {
    t += s.J * s.d_w + s.H * s.d_v;
    f += transposed_times(s.H, s.d_w) + s.M * s.d_v;
  }
  return {f.eigen(), t.eigen()};
}

Wrench MultibodyTree::base_reaction(const Workspace& w) const {
  Wrench sum;
  for (int i = 0; i < joint_count(); ++i) {
    if (links_[static_cast<size_t>(i)].parent >= 0) continue;
    const Wrench on_link = joint_wrench(i, w);
    sum.f -= on_link.f;
    sum.t -= on_link.t + w.links[static_cast<size_t>(i)].p.eigen().cross(on_link.f);
  }
  return sum;
}

double MultibodyTree::kinetic_energy(const Workspace& w) const {
  double twice = 0.0;
  for (int i = 0; i < joint_count(); ++i) {
    const Link& link = links_[static_cast<size_t>(i)];
    const auto& s = w.links[static_cast<size_t>(i)];
    const V3 w_A = transposed_times(s.R, s.w);
    const double qd = w.qd[static_cast<size_t>(i)];
    twice += link.mass * dot(s.v, s.v) + 2.0 * dot(s.v, cross(s.w, s.moment)) +
             dot(w_A, link.inertia_A * w_A) + link.armature * qd * qd;
  }
  return 0.5 * twice;
}

double MultibodyTree::potential_energy(const Workspace& w) const {
  double energy = 0.0;
  for (int i = 0; i < joint_count(); ++i) {
    const auto& s = w.links[static_cast<size_t>(i)];
    energy += dot(minus_gravity(w), s.p * links_[static_cast<size_t>(i)].mass + s.moment);
  }
  return energy;
}

}  // namespace takt
