// Boxes by the Open Dynamics Engine.
#include "tests/performance/peers.h"

#ifdef TAKT_HAVE_ODE
#include <ode/ode.h>

#include <cmath>
#endif

namespace takt::bench {

#ifndef TAKT_HAVE_ODE

Peer ode() {
  return {"ODE", "libode-dev", nullptr, {}};
}

#else

namespace {

struct World {
  dWorldID world = dWorldCreate();
  dSpaceID space = dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
  dJointGroupID contacts = dJointGroupCreate(0);
  double friction = 0.3;

  World() = default;
  World(const World&) = delete;
  World& operator=(const World&) = delete;
  ~World() {
    dJointGroupDestroy(contacts);
    dSpaceDestroy(space);
    dWorldDestroy(world);
  }
};

void make_contacts(void* data, dGeomID a, dGeomID b) {
  constexpr int kMost = 8;
  const World& w = *static_cast<World*>(data);
  const dBodyID first = dGeomGetBody(a), second = dGeomGetBody(b);
  if (first == nullptr && second == nullptr) return;
  dContact contacts[kMost];
  const int count = dCollide(a, b, kMost, &contacts[0].geom, sizeof(dContact));
  for (int i = 0; i < count; ++i) {
    contacts[i].surface.mode = dContactApprox1;
    contacts[i].surface.mu = w.friction;
    dJointAttach(dJointCreateContact(w.world, w.contacts, &contacts[i]), first, second);
  }
}

PeerEnd run_ode_boxes(const PeerScene& scene, PeerSetting setting) {
  static const bool begun = dInitODE2(0) != 0;
  dAllocateODEDataForThread(dAllocateMaskAll);
  PeerEnd end;
  if (!begun) return end;
  World w;
  w.friction = scene.friction;
  const Vec3& g = scene.gravity_m_per_s2;
  dWorldSetGravity(w.world, g.x(), g.y(), g.z());
  dWorldSetAutoDisableFlag(w.world, scene.sleeping ? 1 : 0);
  if (setting.iterations > 0) dWorldSetQuickStepNumIterations(w.world, setting.iterations);
  std::vector<dBodyID> bodies;
  std::vector<dGeomID> geoms;
  std::vector<dJointID> sliders;
  for (const PeerBody& from : scene.bodies) {
    const Vec3 &s = from.size_m, &p = from.X_WB.p;
    const Mat3& R = from.X_WB.R;
    const dMatrix3 turn = {R(0, 0), R(0, 1), R(0, 2), 0,       R(1, 0), R(1, 1),
                           R(1, 2), 0,       R(2, 0), R(2, 1), R(2, 2), 0};
    const dGeomID geom = geoms.emplace_back(dCreateBox(w.space, s.x(), s.y(), s.z()));
    const bool moves = from.mass_kg > 0.0 || from.v_W;
    const dBodyID body = bodies.emplace_back(moves ? dBodyCreate(w.world) : nullptr);
    if (body != nullptr) {
      dGeomSetBody(geom, body);
      dBodySetPosition(body, p.x(), p.y(), p.z());
      dBodySetRotation(body, turn);
    } else {
      dGeomSetPosition(geom, p.x(), p.y(), p.z());
      dGeomSetRotation(geom, turn);
    }
    if (from.v_W) {
      dBodySetKinematic(body);
      dBodySetAutoDisableFlag(body, 0);
    } else if (body != nullptr) {
      dMass mass;
      dMassSetBoxTotal(&mass, from.mass_kg, s.x(), s.y(), s.z());
      dBodySetMass(body, &mass);
    }
    dJointID& slider = sliders.emplace_back(nullptr);
    if (from.slides_on < 0) continue;
    slider = dJointCreateSlider(w.world, nullptr);
    dJointAttach(slider, body, bodies[static_cast<std::size_t>(from.slides_on)]);
    dJointSetSliderAxis(slider, from.axis_W.x(), from.axis_W.y(), from.axis_W.z());
  }
  end.cpu_s = run_timed(scene, setting, [&](double middle_s) {
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      const PeerBody& from = scene.bodies[k];
      if (from.v_W) {
        const Vec3 v = from.v_W(middle_s);
        dBodySetLinearVel(bodies[k], v.x(), v.y(), v.z());
      } else if (sliders[k] != nullptr) {
        dJointAddSliderForce(sliders[k], from.force_N);
      }
    }
    dSpaceCollide(w.space, &w, make_contacts);
    if (setting.iterations > 0)
      dWorldQuickStep(w.world, setting.step_s);
    else
      dWorldStep(w.world, setting.step_s);
    dJointGroupEmpty(w.contacts);
  });
  for (const dGeomID geom : geoms) {
    Pose& X = end.X_WB.emplace_back();
    const dReal *p = dGeomGetPosition(geom), *R = dGeomGetRotation(geom);
    for (int i = 0; i < 3; ++i) {
      X.p[i] = p[i];
      for (int k = 0; k < 3; ++k) X.R(i, k) = R[4 * i + k];
    }
  }
  return end;
}

}  // namespace

Peer ode() {
  return {
      "ODE", "libode-dev", run_ode_boxes, {{0.004, 20}, {0.004, 0}, {0.002, 20}, {0.001, 20}, {0.001, 0}}};
}

#endif

}  // namespace takt::bench
