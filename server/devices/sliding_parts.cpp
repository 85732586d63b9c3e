#include "server/devices/sliding_parts.h"

#include <algorithm>

#include "server/contact/holding/component_interaction.h"
#include "server/simulation/step/cell_plant.h"

namespace takt {

namespace {
// Slower approaches are rounding.
constexpr double kApproach_m_per_s = 1e-9;
// A penetration is undone by this share in each step.
constexpr double kCorrected = 0.1, kDeep_m = 1e-6;
}  // namespace

void SlidingParts::start(ComponentInteraction& interaction) {
  constexpr std::size_t kTouchesPerComponent = 16;
  const std::size_t count = interaction.graph().vertices.size();
  slider_of_.reserve(count);
  sliders_.reserve(count);
  touches_.reserve(kTouchesPerComponent * count);
}

void SlidingParts::find_sliders(const CellMotion& motion, const ComponentInteraction& interaction) {
  const ContactGraph& graph = interaction.graph();
  slider_of_.assign(graph.vertices.size(), -1);
  sliders_.clear();
  for (const PairConnection& pair : interaction.connections()) {
    const int part = pair.base, on = pair.connection.partner;
    const auto p = static_cast<std::size_t>(part);
    if (graph.vertices[static_cast<std::size_t>(on)].type != ComponentType::ground || graph.holds[p] != -1 ||
        interaction.partner(part) != on)
      continue;
    slider_of_[p] = static_cast<int>(sliders_.size());
    Slider& slider = sliders_.emplace_back();
    const BodyMotion& carrier = motion.carrier(on);
    slider.part = part;
    slider.u_W = slider.carried_W = carrier.V_WB.at(motion.bodies[p].p_WBcm - carrier.X_WB.p);
  }
}

void SlidingParts::find_touches(double h, const CellMotion& motion, const ComponentInteraction& interaction) {
  touches_.clear();
  for (std::size_t s = 0; s < sliders_.size(); ++s) {
    Slider& slider = sliders_[s];
    const int partner = interaction.partner(slider.part);
    for (const int other : interaction.graph().neighbours[static_cast<std::size_t>(slider.part)]) {
      const int other_slider = slider_of_[static_cast<std::size_t>(other)];
      // A pair of sliders is found at the first of the two.
      if (other == partner || (other_slider >= 0 && static_cast<std::size_t>(other_slider) < s)) continue;
      const ConvexDistance found = interaction.nearest(slider.part, other);
      if (found.distance > interaction.contact_margin_m()) continue;
      Touch touch{s, other_slider, Vec3::Zero(), found.normal_W};
      if (other_slider < 0) {
        const BodyMotion& body = motion.bodies[static_cast<std::size_t>(other)];
        touch.v_W = body.V_WB.at(found.point_B_W - body.X_WB.p);
      }
      touches_.push_back(touch);
      if (-found.distance > kDeep_m) {
        const Vec3 out_W = kCorrected * found.distance / h * found.normal_W;
        slider.correction_W += other_slider < 0 ? out_W : Vec3(0.5 * out_W);
        if (other_slider >= 0) sliders_[static_cast<std::size_t>(other_slider)].correction_W -= 0.5 * out_W;
      }
    }
  }
}

/// One pass over the contacts; `among_free`: also of two Parts of which neither is fixed. True if a velocity changed.
bool SlidingParts::resolve(bool among_free) {
  bool changed = false;
  for (const Touch& touch : touches_) {
    Slider& a = sliders_[touch.slider];
    if (touch.other < 0) {
      const double approach = (a.u_W - touch.v_W).dot(touch.n_W);
      if (!(approach > kApproach_m_per_s)) continue;
      a.u_W -= approach * touch.n_W;
      a.fixed = changed = true;
      continue;
    }
    Slider& b = sliders_[static_cast<std::size_t>(touch.other)];
    const double of_a = a.u_W.dot(touch.n_W), of_b = b.u_W.dot(touch.n_W), approach = of_a - of_b;
    if (!(approach > kApproach_m_per_s) || (!a.fixed && !b.fixed && !among_free)) continue;
    const bool a_yields = a.fixed == b.fixed ? of_a >= -of_b : b.fixed;
    if (a_yields)
      a.u_W -= approach * touch.n_W;
    else
      b.u_W += approach * touch.n_W;
    if (a.fixed || b.fixed) a.fixed = b.fixed = true;
    changed = true;
  }
  return changed;
}

bool SlidingParts::update(double h, const CellMotion& motion, CellPlant& plant,
                          ComponentInteraction& interaction) {
  const std::vector<char>& moving = plant.find_moving_grounds(motion.time_s);
  if (std::find(moving.begin(), moving.end(), 1) == moving.end()) return false;
  find_sliders(motion, interaction);
  find_touches(h, motion, interaction);
  // A stop reaches the end of a queue after so many passes.
  for (std::size_t pass = 0; pass <= sliders_.size() && resolve(false); ++pass) {
  }
  for (std::size_t pass = 0; pass <= sliders_.size() && resolve(true); ++pass) {
  }
  for (const Slider& slider : sliders_) {
    const Vec3 slide_W = slider.u_W - slider.carried_W + slider.correction_W;
    if (slide_W != Vec3::Zero()) interaction.slide(slider.part, slide_W, motion);
  }
  return false;
}

}  // namespace takt
