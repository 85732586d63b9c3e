#include "server/simulation/model/model_hash.h"

#include "server/geometry/surface/contact_surface_data.h"
#include "server/simulation/model/model_digest.h"

namespace takt {

namespace {
/// Changes when the hash of an unchanged model changes, so that the reason is seen: 2 is that of the members
/// of structs, without lists.
constexpr int kVersion = 2;
}  // namespace

// Members that do not count, or follow from members that count.

void digest(ModelDigest& hash, const ConvexShape& shape) {
  hash << shape.vertices;
}
void digest(ModelDigest& hash, const ConvexParts& parts) {
  hash << parts.shapes();
}
void digest(ModelDigest& hash, const std::shared_ptr<const ContactSurface>& surface) {
  if (surface == nullptr) return void(hash << 0);
  const ContactSurface::Data& data = surface->data();
  hash << data.px << data.py << data.pz << data.area_m2 << data.vertices << data.faces.size();
  for (const ContactFace& face : data.faces) hash << face.vertex[0] << face.vertex[1] << face.vertex[2];
}
void digest(ModelDigest& hash, const InteractionParameters& p) {
  InteractionParameters counted = p;
  counted.exact_sleeping = true;  // the bits are the same
  hash.members(counted);
}
void digest(ModelDigest& hash, const ComponentPairs& pairs) {
  hash << pairs.size();
  for (const ComponentPair& pair : pairs) hash << pair;
}
void digest(ModelDigest& hash, const ContactPairs& pairs) {
  hash << pairs.size();
  for (const ContactPairModel& pair : pairs) {
    hash << pair.base << pair.target << pair.law << pair.friction_at_K << pair.force;
    if (pair.depth != DepthSource::polygonal) hash << pair.depth;
  }
}
void digest(ModelDigest& hash, const ContactModel& contact) {
  // Omits the evaluation of pairs and the sleeping.
  hash << contact.enabled << contact.surfaces << contact.pairs;
  for (std::size_t c = 0; c < contact.fields.size(); ++c)
    if (contact.fields[c] != nullptr) hash << c << contact.fields[c]->spacing_m();
}
void digest(ModelDigest& hash, const CheckedBody& body) {
  hash << body.name << body.robot << body.joint << body.component << body.shapes.size();
}
void digest(ModelDigest& hash, const RobotDescription& robot) {
  // The rest is in KinematicRobotParameters, or a picture.
  hash << robot.command_period_s << robot.command_deadline;
}
void digest(ModelDigest& hash, const SignalWire& wire) {
  hash << wire.to << wire.from << wire.invert << wire.test << wire.threshold << wire.factor;
  if (wire.offset != 0.0) hash << wire.offset;
}
void digest(ModelDigest& hash, const CellDescription& cell) {
  // The rest is in the model itself, or a picture.
  hash << cell.processes << cell.robots << cell.devices;
  if (!cell.wires.empty()) hash << cell.wires;
}
void digest(ModelDigest& hash, const AuxiliaryModel& entry) {
  hash << entry.name << entry.device << entry.digest;
}
void digest(ModelDigest& hash, const MechanismModel& mechanism) {
  hash << mechanism.name;  // its parameters are those of its devices
}

std::uint64_t model_hash(const CellModel& model) {
  // A new member of this struct does not compile until this function lists it.
  const auto& [description, step_s, solver, contact_solver, dynamics_solver, components, pairs, interaction,
               parts, grounds, bounds, robots, dynamics, no_dynamics, robot_levels, trajectories, grippers,
               contact, auxiliary_models, mechanisms, joined, clearance, convex_imports, import_notes,
               start_overlaps, pools] = model;
  ModelDigest hash;
  hash << kVersion << description << step_s << solver << contact_solver << dynamics_solver << components
       << pairs << interaction << parts << grounds << bounds << robots << dynamics << robot_levels
       << trajectories << grippers << contact << auxiliary_models << mechanisms << joined << clearance;
  if (!pools.empty()) hash << pools;
  return hash.value();
}

}  // namespace takt
