// Scenes of surface contact by Bullet, for comparison: rigid bodies, hence no elastic layer and no pressure.
#include "tests/performance/contact_scenes_bench.h"

#ifdef TAKT_HAVE_BULLET
#include <BulletCollision/CollisionDispatch/btInternalEdgeUtility.h>
#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <memory>
#include <vector>

#include "server/geometry/mesh/import.h"
#include "server/scenario/scenario_builder.h"
#endif

namespace takt::bench {

#ifndef TAKT_HAVE_BULLET

PeerRun run_bullet(const Scenario&, double) {
  return {false, "is not installed (libbullet-dev; ./dev bench contact does it)"};
}

#else

namespace {

// Bullet is designed for bodies of 0.1 to 10 m (contacts break at 20 mm): lengths are scaled up, as its
// manual advises.
constexpr double kScale = 25.0;
constexpr double kMargin_m = 1e-4;

/// Scaled: lengths, and with them velocities and accelerations.
btVector3 bullet(const Vec3& v) {
  const Vec3 s = kScale * v;
  return {static_cast<btScalar>(s.x()), static_cast<btScalar>(s.y()), static_cast<btScalar>(s.z())};
}

btTransform bullet(const Pose& X) {
  btTransform result;
  result.setOrigin(bullet(X.p));
  const Mat3& R = X.R;
  result.setBasis(
      {static_cast<btScalar>(R(0, 0)), static_cast<btScalar>(R(0, 1)), static_cast<btScalar>(R(0, 2)),
       static_cast<btScalar>(R(1, 0)), static_cast<btScalar>(R(1, 1)), static_cast<btScalar>(R(1, 2)),
       static_cast<btScalar>(R(2, 0)), static_cast<btScalar>(R(2, 1)), static_cast<btScalar>(R(2, 2))});
  return result;
}

struct Body {
  std::unique_ptr<btTriangleMesh> triangles;
  std::unique_ptr<btCollisionShape> shape;
  std::unique_ptr<btRigidBody> body;
};

std::unique_ptr<btTriangleMesh> triangles_of(const TriangleMesh& mesh, const Vec3& origin) {
  auto result = std::make_unique<btTriangleMesh>();
  for (const auto& t : mesh.triangles)
    result->addTriangle(bullet(mesh.vertices[static_cast<std::size_t>(t[0])] - origin),
                        bullet(mesh.vertices[static_cast<std::size_t>(t[1])] - origin),
                        bullet(mesh.vertices[static_cast<std::size_t>(t[2])] - origin));
  return result;
}

}  // namespace

PeerRun run_bullet(const Scenario& scenario, double step_s) {
  if (!scenario.robots.empty()) return {false, "-: robots with drives are not its field"};
  if (scenario.name == "press_fit") return {false, "-: rigid bodies have no interference fit"};
  if (scenario.name == "bolt_in_socket") return {false, "-: hulls of bolt and socket overlap"};
  const auto cell = build_cell(scenario);
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher);
  btDbvtBroadphase broad_phase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broad_phase, &solver, &configuration);
  world.setGravity(bullet(scenario.gravity_m_per_s2));
  const auto id_of = [&](const std::string& name) {
    return static_cast<std::size_t>(cell->description.find_component(name));
  };
  // Bullet multiplies the two sides: 1 for Grounds, the pair's with a Ground for a Part.
  const auto friction_of = [&](std::size_t component) {
    double found = 0.3;
    for (const ContactPairModel& pair : cell->contact.pairs) {
      const bool grounded =
          cell->components[static_cast<std::size_t>(pair.base)].type == ComponentType::ground ||
          cell->components[static_cast<std::size_t>(pair.target)].type == ComponentType::ground;
      if (grounded && (static_cast<std::size_t>(pair.base) == component ||
                       static_cast<std::size_t>(pair.target) == component))
        found = pair.law.friction;
    }
    return static_cast<btScalar>(found);
  };
  std::vector<Body> bodies;
  for (const ScenarioGround& ground : scenario.grounds) {
    Body b;
    b.triangles = triangles_of(import_solid(ground.mesh), Vec3::Zero());
    b.shape = std::make_unique<btBvhTriangleMeshShape>(b.triangles.get(), true);
    b.shape->setMargin(0);
    b.body = std::make_unique<btRigidBody>(
        btRigidBody::btRigidBodyConstructionInfo(0, nullptr, b.shape.get(), btVector3(0, 0, 0)));
    for (const GroundModel& model : cell->grounds)
      if (static_cast<std::size_t>(model.component) == id_of(ground.name))
        b.body->setWorldTransform(bullet(model.X_WB));
    b.body->setFriction(1);
    world.addRigidBody(b.body.get());
    bodies.push_back(std::move(b));
  }
  const std::size_t first_part = bodies.size();
  for (std::size_t i = 0; i < scenario.parts.size(); ++i) {
    const ScenarioPart& part = scenario.parts[i];
    const std::size_t id = id_of(part.name);
    const Component& component = cell->components[id];
    const Vec3 com = component.p_BBcm;
    const TriangleMesh mesh = import_solid(part.mesh);
    Body b;
    if (scenario.name == "hook_and_ring" || scenario.name == "nut_runs_down") {
      b.triangles = triangles_of(mesh, com);
      auto shape = std::make_unique<btGImpactMeshShape>(b.triangles.get());
      shape->setMargin(static_cast<btScalar>(kScale * kMargin_m));
      shape->updateBound();
      b.shape = std::move(shape);
    } else {
      auto shape = std::make_unique<btConvexHullShape>();
      for (const Vec3& v : mesh.vertices) shape->addPoint(bullet(v - com), false);
      shape->recalcLocalAabb();
      shape->optimizeConvexHull();
      shape->setMargin(static_cast<btScalar>(kScale * kMargin_m));
      b.shape = std::move(shape);
    }
    const auto mass = static_cast<btScalar>(component.mass_kg);
    btVector3 inertia(0, 0, 0);
    b.shape->calculateLocalInertia(mass, inertia);
    b.body = std::make_unique<btRigidBody>(
        btRigidBody::btRigidBodyConstructionInfo(mass, nullptr, b.shape.get(), inertia));
    for (const RigidBodyParameters& model : cell->parts) {
      if (static_cast<std::size_t>(model.body) != id) continue;
      Pose X = model.X_WB_initial;
      X.p += X.R * com;
      b.body->setWorldTransform(bullet(X));
      b.body->setLinearVelocity(bullet(model.V_WB_initial.v));
    }
    b.body->setFriction(friction_of(id));
    world.addRigidBody(b.body.get());
    bodies.push_back(std::move(b));
  }
  PeerRun result;
  result.done = true;
  const double begin = processor_s();
  const int steps = static_cast<int>(std::lround(scenario.duration_s / step_s));
  Turned turned;
  for (int i = 0; i < steps; ++i) {
    world.stepSimulation(static_cast<btScalar>(step_s), 0);
    const btMatrix3x3& R = bodies[first_part].body->getWorldTransform().getBasis();
    turned.note(std::atan2(static_cast<double>(R[1][0]), static_cast<double>(R[0][0])));
  }
  result.turned_rad = turned.rad();
  result.cpu_s = processor_s() - begin;
  for (const ExpectedPose& expected : scenario.expected) {
    for (std::size_t i = 0; i < scenario.parts.size(); ++i) {
      if (scenario.parts[i].name != expected.part) continue;
      const btTransform X = bodies[first_part + i].body->getWorldTransform();
      const btVector3 p = X * bullet(Vec3(-cell->components[id_of(expected.part)].p_BBcm));
      const Vec3 end(static_cast<double>(p.x()), static_cast<double>(p.y()), static_cast<double>(p.z()));
      result.end_error_m = std::max(result.end_error_m, (end / kScale - expected.X_WB.p).norm());
    }
  }
  for (const Body& b : bodies) world.removeRigidBody(b.body.get());
  return result;
}

#endif

}  // namespace takt::bench
