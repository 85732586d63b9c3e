// Boxes by Bullet.
#include "tests/performance/peers.h"

#ifdef TAKT_HAVE_BULLET
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <memory>
#endif

namespace takt::bench {

#ifndef TAKT_HAVE_BULLET

Peer bullet() {
  return {"Bullet", "libbullet-dev", nullptr, {}};
}

#else

namespace {

// Bullet is designed for bodies of 0.1 to 10 m: lengths are scaled up, as its manual advises.
constexpr double kScale = 25.0;
constexpr double kMargin_m = 1e-4;

btScalar scalar(double value) {
  return static_cast<btScalar>(value);
}
btVector3 scaled(const Vec3& v) {
  return {scalar(kScale * v.x()), scalar(kScale * v.y()), scalar(kScale * v.z())};
}
btTransform scaled(const Pose& X) {
  btTransform result;
  const Mat3& R = X.R;
  result.setOrigin(scaled(X.p));
  result.setBasis({scalar(R(0, 0)), scalar(R(0, 1)), scalar(R(0, 2)), scalar(R(1, 0)), scalar(R(1, 1)),
                   scalar(R(1, 2)), scalar(R(2, 0)), scalar(R(2, 1)), scalar(R(2, 2))});
  return result;
}
Pose pose(const btTransform& X) {
  Pose result;
  for (int i = 0; i < 3; ++i) {
    result.p[i] = static_cast<double>(X.getOrigin()[i]) / kScale;
    for (int k = 0; k < 3; ++k) result.R(i, k) = static_cast<double>(X.getBasis()[i][k]);
  }
  return result;
}

struct Body {
  std::unique_ptr<btBoxShape> shape;
  std::unique_ptr<btDefaultMotionState> place;
  std::unique_ptr<btRigidBody> body;
  std::unique_ptr<btSliderConstraint> slider;
};

Body make_body(const PeerBody& from, double friction) {
  Body b;
  b.shape = std::make_unique<btBoxShape>(scaled(0.5 * from.size_m));
  b.shape->setMargin(scalar(kScale * kMargin_m));
  btVector3 inertia(0, 0, 0);
  if (from.mass_kg > 0.0) b.shape->calculateLocalInertia(scalar(from.mass_kg), inertia);
  b.place = std::make_unique<btDefaultMotionState>(scaled(from.X_WB));
  b.body = std::make_unique<btRigidBody>(
      btRigidBody::btRigidBodyConstructionInfo(scalar(from.mass_kg), b.place.get(), b.shape.get(), inertia));
  // Bullet multiplies the two sides.
  b.body->setFriction(scalar(std::sqrt(friction)));
  if (from.v_W) {
    b.body->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    b.body->setActivationState(DISABLE_DEACTIVATION);
  }
  return b;
}

std::unique_ptr<btSliderConstraint> make_slider(btRigidBody& on, btRigidBody& body, const Vec3& axis_W) {
  btMatrix3x3 along;
  const Vec3 side = axis_W.unitOrthogonal(), third = axis_W.cross(side);
  for (int i = 0; i < 3; ++i) along[i].setValue(scalar(axis_W[i]), scalar(side[i]), scalar(third[i]));
  const btTransform frame(along, body.getWorldTransform().getOrigin());
  auto slider = std::make_unique<btSliderConstraint>(on, body, on.getWorldTransform().inverse() * frame,
                                                     body.getWorldTransform().inverse() * frame, true);
  slider->setLowerLinLimit(1), slider->setUpperLinLimit(-1);
  slider->setLowerAngLimit(0), slider->setUpperAngLimit(0);
  return slider;
}

PeerEnd run_bullet_boxes(const PeerScene& scene, PeerSetting setting) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broad_phase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broad_phase, &solver, &configuration);
  world.setGravity(scaled(scene.gravity_m_per_s2));
  world.setForceUpdateAllAabbs(false);
  world.getSolverInfo().m_numIterations = setting.iterations;
  if (setting.both_directions) world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
  std::vector<Body> bodies;
  for (const PeerBody& from : scene.bodies) {
    Body& b = bodies.emplace_back(make_body(from, scene.friction));
    if (!scene.sleeping && from.mass_kg > 0.0) b.body->setActivationState(DISABLE_DEACTIVATION);
    world.addRigidBody(b.body.get());
    if (from.slides_on < 0) continue;
    b.slider = make_slider(*bodies[static_cast<std::size_t>(from.slides_on)].body, *b.body, from.axis_W);
    world.addConstraint(b.slider.get(), true);
  }
  PeerEnd end;
  end.cpu_s = run_timed(scene, setting, [&](double middle_s) {
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      const PeerBody& from = scene.bodies[k];
      if (from.v_W) {
        btTransform& X = bodies[k].place->m_graphicsWorldTrans;
        X.setOrigin(X.getOrigin() + scaled(setting.step_s * from.v_W(middle_s)));
      } else if (from.slides_on >= 0) {
        bodies[k].body->applyCentralForce(scaled(from.force_N * from.axis_W));
      }
    }
    world.stepSimulation(scalar(setting.step_s), 0);
  });
  for (const Body& b : bodies) {
    end.X_WB.push_back(pose(b.body->getWorldTransform()));
    if (b.slider) world.removeConstraint(b.slider.get());
  }
  for (const Body& b : bodies) world.removeRigidBody(b.body.get());
  return end;
}

}  // namespace

Peer bullet() {
  return {"Bullet",
          "libbullet-dev",
          run_bullet_boxes,
          {{0.004, 10},
           {0.004, 10, true},
           {0.004, 30, true},
           {0.004, 100, true},
           {0.002, 10, true},
           {0.002, 100, true},
           {0.001, 10, true},
           {0.001, 50, true}}};
}

#endif

}  // namespace takt::bench
