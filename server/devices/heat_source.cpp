#include "server/devices/heat_source.h"

#include <algorithm>

#include "plant_models/state_bytes.h"
#include "server/simulation/model/state_hash.h"

namespace takt {

namespace {
constexpr KindSignal kSignals[] = {
    commanded("heat", "W", "±`max_heat_W`", "heat flow into the part; negative: out of it"),
    reported("delivered", "J", "heat since the start")};
}  // namespace

void describe(Fields& f, ScenarioHeatSource& s) {
  f.field("part", s.part, f.name_of({"parts"}, "a part"), "Part with the key `heat`, which takes the heat.",
          kRequired);
  s.place_of_part = f.place("part");
  f.field("max_heat_W", s.max_heat_W, positive("W"), "Largest heat flow, in and out.");
}

void build(const ScenarioHeatSource& s, DeviceBuilder& b) {
  const int body = b.cell.description.find_component(s.part);
  if (std::none_of(b.heated.begin(), b.heated.end(), [&](const auto& part) { return part.body == body; }))
    throw ScenarioError(s.place_of_part + ": found '" + s.part +
                        "', which has no temperature; allowed: a part with the key heat, e.g. heat: "
                        "{specific_heat_J_per_kg_K: 500}");
  b.add<HeatSource>(HeatSourceParameters{static_cast<std::size_t>(body)},
                    described(kSignals, {{-s.max_heat_W, s.max_heat_W}}));
}

DeviceType heat_source_type() {
  return device_type<ScenarioHeatSource>(DeviceType::Owner::cell, "heat_sources",
                                         "Heat flows into parts that signals give.",
                                         "A heater or cooler as a signal, e.g. of an FMU.", false, kSignals);
}

void HeatSource::write_motion(double, const double*, CellMotion& motion) const {
  motion.heat[p_.body].flow_W += heat_W_;
}

void HeatSource::set_signal(double, int, double value) {
  heat_W_ = value;
}

void HeatSource::read_signals(double, const double* x, const CellMotion&, std::span<double> signals) const {
  signals[heat] = heat_W_;
  signals[delivered] = x[0];
}

std::uint64_t HeatSource::discrete_hash() const {
  StateHash hash;
  hash.add(std::span<const double>(&heat_W_, 1));
  return hash.value();
}

void HeatSource::save(StateWriter& out) const {
  out.put(heat_W_);
}

void HeatSource::load(StateReader& in) {
  heat_W_ = in.number("a heat flow");
}

}  // namespace takt
