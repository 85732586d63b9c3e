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
  const auto stronger = [](const ElementPressure& a, const ElementPressure& b) {
    return a.pressure_Pa != b.pressure_Pa ? a.pressure_Pa > b.pressure_Pa : a.element < b.element;
  };
  const auto triangles = [&](const ElementPressure& element) {
    return element_triangles_B(*base_surface, static_cast<std::size_t>(element.element));
  };
  // An element may be several triangles: the strongest ones that fit.
  const std::size_t all = elements.size();
  std::sort(elements.begin(), elements.end(), stronger);
  std::size_t count = 0, kept_elements = 0;
  for (; kept_elements < elements.size(); ++kept_elements) {
    count += triangles(elements[kept_elements]).size();
    if (count > kMaxElements) break;
  }
  elements.resize(kept_elements);
  pressed.omitted = all - kept_elements;
  std::sort(elements.begin(), elements.end(),
            [](const ElementPressure& a, const ElementPressure& b) { return a.element < b.element; });
  for (const ElementPressure& element : elements) {
    pressed.largest_pressure_Pa = std::max(pressed.largest_pressure_Pa, element.pressure_Pa);
    for (const TriangleCorners& corners : triangles(element))
      pressed.elements.push_back({corners, element.pressure_Pa});
  }
}

}  // namespace takt
