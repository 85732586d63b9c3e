#include "server/devices/heated_part.h"

namespace takt {

namespace {
constexpr KindSignal kSignals[] = {
    reported("temperature", "degC", "of the whole part"),
    reported("heat_flow", "W",
             "into the part: from furnaces and heat sources, less the loss to the surroundings"),
    reported("energy_lost", "J", "given to the surroundings since the start")};

double surface_of(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    area += 0.5 * (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  return area;
}
}  // namespace

void describe(Fields& f, ScenarioHeat& s) {
  f.field("specific_heat_J_per_kg_K", s.specific_heat_J_per_kg_K, positive("J/(kg K)"), "Specific heat.",
          kRequired);
  f.field("temperature_degC", s.temperature_degC, kTemperature_degC,
          "Temperature at the start; without it: that of the surroundings.");
  f.field("emissivity", s.emissivity, NumberRange{.lower = 0.0, .upper = 1.0},
          "Towards a furnace around the part.");
  f.field("surface_m2", s.surface_m2, positive("m^2"), "Exposed surface; without it: that of the mesh.");
  f.field("cooling_W_per_m2_K", s.cooling_W_per_m2_K, not_negative("W/(m^2 K)"),
          "Heat transfer to the surroundings, outside of furnaces.");
}

void build(const ScenarioHeat& s, DeviceBuilder& b) {
  const auto id = static_cast<std::size_t>(b.component);
  HeatedPartParameters p;
  p.body = b.component;
  p.capacity_J_per_K = b.cell.components[id].mass_kg * s.specific_heat_J_per_kg_K;
  p.initial_K = kelvin(s.temperature_degC.value_or(b.surroundings_degC));
  p.environment_K = kelvin(b.surroundings_degC);
  p.surface_m2 = s.surface_m2.value_or(surface_of(b.meshes[id]->mesh()));
  p.cooling_W_per_m2_K = s.cooling_W_per_m2_K;
  b.add<HeatedPart>(p, described(kSignals));
  b.heated.push_back({p.body, p.surface_m2, s.emissivity});
}

DeviceType heated_part_type() {
  return device_type<ScenarioHeat>(DeviceType::Owner::part, "heat", "The part has a temperature.", "", false,
                                   kSignals);
}

void HeatedPart::initial_state(double* x) const {
  x[absolute_temperature] = p_.initial_K;
  x[lost] = 0.0;
}

void HeatedPart::write_motion(double, const double* x, CellMotion& motion) const {
  motion.heat[static_cast<std::size_t>(p_.body)] = {x[absolute_temperature], 0.0, false};
}

double HeatedPart::cooling_W(const double* x, const CellMotion& motion) const {
  if (motion.heat[static_cast<std::size_t>(p_.body)].enclosed) return 0.0;
  return p_.cooling_W_per_m2_K * p_.surface_m2 * (x[absolute_temperature] - p_.environment_K);
}

void HeatedPart::derivatives(double, const double* x, const CellMotion& motion, std::span<const Wrench>,
                             double* xdot) const {
  const double cooling = cooling_W(x, motion);
  const double flow = motion.heat[static_cast<std::size_t>(p_.body)].flow_W;
  xdot[absolute_temperature] = (flow - cooling) / p_.capacity_J_per_K;
  xdot[lost] = cooling;
}

void HeatedPart::state_scales(double* scales) const {
  scales[absolute_temperature] = 1.0;
  scales[lost] = p_.capacity_J_per_K;
}

void HeatedPart::set_signal(double, int, double) {}

void HeatedPart::read_signals(double, const double* x, const CellMotion& motion,
                              std::span<double> signals) const {
  signals[temperature] = x[absolute_temperature] - kZeroCelsius_K;
  signals[heat_flow] = motion.heat[static_cast<std::size_t>(p_.body)].flow_W - cooling_W(x, motion);
  signals[energy_lost] = x[lost];
}

}  // namespace takt
