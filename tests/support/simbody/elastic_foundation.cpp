#include "tests/support/simbody/elastic_foundation.h"

#include <Simbody.h>

namespace takt::test {
namespace {

SimTK::ContactGeometry::TriangleMesh simbody_mesh(const PlainMesh& mesh) {
  SimTK::PolygonalMesh polygons;
  for (const auto& v : mesh.vertices) polygons.addVertex(SimTK::Vec3(v[0], v[1], v[2]));
  for (const auto& t : mesh.triangles) {
    SimTK::Array_<int> corners;
    for (const std::uint32_t v : t) corners.push_back(static_cast<int>(v));
    polygons.addFace(corners);
  }
  return SimTK::ContactGeometry::TriangleMesh(polygons);
}

}  // namespace

std::array<double, 6> elastic_foundation(const PlainMesh& base, const PlainMesh& target,
                                         const PlainPose& X_TB, double stiffness_Pa_per_m) {
  using namespace SimTK;
  MultibodySystem system;
  SimbodyMatterSubsystem matter(system);
  GeneralForceSubsystem forces(system);
  GeneralContactSubsystem contacts(system);
  const ContactSetIndex set = contacts.createContactSet();
  Body::Rigid body(MassProperties(1.0, Vec3(0), Inertia(1)));
  MobilizedBody::Free free(matter.Ground(), Transform(), body, Transform());
  contacts.addBody(set, matter.updGround(), simbody_mesh(target), Transform());
  contacts.addBody(set, free, simbody_mesh(base), Transform());
  ElasticFoundationForce foundation(forces, contacts, set);
  foundation.setBodyParameters(ContactSurfaceIndex(1), stiffness_Pa_per_m, 0.0, 0.0, 0.0, 0.0);
  State state = system.realizeTopology();
  Mat33 R;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) R(r, c) = X_TB.R[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  free.setQToFitTransform(state, Transform(Rotation(R, false), Vec3(X_TB.p[0], X_TB.p[1], X_TB.p[2])));
  system.realize(state, Stage::Dynamics);
  const SpatialVec F = system.getRigidBodyForces(state, Stage::Dynamics)[free.getMobilizedBodyIndex()];
  return {F[1][0], F[1][1], F[1][2], F[0][0], F[0][1], F[0][2]};
}

}  // namespace takt::test
