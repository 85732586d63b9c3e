#include "server/simulation/model/pressed_elements.h"

#include <algorithm>

#include "server/geometry/surface/element_corners.h"

namespace takt {

const std::vector<PressedPair>& PressedElements::read(const Snapshot& snapshot,
                                                      std::span<const std::size_t> pairs) {
  std::erase_if(contacts_, [&](const auto& kept) {
    return std::find(pairs.begin(), pairs.end(), kept.first) == pairs.end();
  });
  result_.clear();
  for (const std::size_t pair : pairs) {
    const ContactPairModel& model = model_.pairs[pair];
    const auto pressing = snapshot.contacts.pressing();
    if (result_.size() == kMaxPairs) break;
    if (std::none_of(pressing.begin(), pressing.end(), [&](const ContactSample& sample) {
          return sample.base == model.base && sample.target == model.target;
        }))
      continue;
    read_pair(snapshot, pair, result_.emplace_back());
  }
  return result_;
}

void PressedElements::read_pair(const Snapshot& snapshot, std::size_t pair, PressedPair& pressed) {
  const ContactPairModel& model = model_.pairs[pair];
  const auto& base_surface = model_.surfaces[static_cast<std::size_t>(model.base)];
  auto kept = contacts_.find(pair);
  if (kept == contacts_.end()) {
    PolygonalContact contact(base_surface, model_.surfaces[static_cast<std::size_t>(model.target)], model.law,
                             model_.field(model.target, model.depth));
    kept = contacts_.emplace(pair, std::move(contact)).first;
  }
  pressed.base = model.base;
  pressed.target = model.target;
  const ComponentSample& base = snapshot.components[static_cast<std::size_t>(model.base)];
  const ComponentSample& target = snapshot.components[static_cast<std::size_t>(model.target)];
  std::vector<ElementPressure> elements =
      kept->second.pressures(relative_motion(Pose::from_quaternion(base.p_WB, base.q_WB), base.V_WB,
                                             Pose::from_quaternion(target.p_WB, target.q_WB), target.V_WB));
  std::sort(elements.begin(), elements.end(), [](const ElementPressure& a, const ElementPressure& b) {
    return a.pressure_Pa != b.pressure_Pa ? a.pressure_Pa > b.pressure_Pa : a.element < b.element;
  });
  if (!elements.empty()) pressed.largest_pressure_Pa = elements.front().pressure_Pa;
  // An element may be several triangles: the strongest ones that fit.
  struct Shown {
    ElementPressure element;
    std::vector<TriangleCorners> triangles;
  };
  std::vector<Shown> shown;
  std::size_t count = 0;
  for (const ElementPressure& element : elements) {
    Shown one{element, element_triangles_B(*base_surface, static_cast<std::size_t>(element.element))};
    count += one.triangles.size();
    if (count > kMaxElements) break;
    shown.push_back(std::move(one));
  }
  pressed.omitted = elements.size() - shown.size();
  std::sort(shown.begin(), shown.end(),
            [](const Shown& a, const Shown& b) { return a.element.element < b.element.element; });
  for (const Shown& one : shown)
    for (const TriangleCorners& corners : one.triangles)
      pressed.elements.push_back({corners, one.element.pressure_Pa});
}

}  // namespace takt
