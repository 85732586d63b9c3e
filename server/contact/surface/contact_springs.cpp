#include "server/contact/surface/contact_springs.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace takt {

std::vector<double> save_springs(const std::vector<ContactSpring>& springs) {
  std::vector<double> kept;
  kept.reserve(4 * springs.size());
  for (const ContactSpring& spring : springs) {
    kept.push_back(spring.element);
    for (int k = 0; k < 3; ++k) kept.push_back(spring.anchor_T[k]);
  }
  return kept;
}

std::vector<ContactSpring> restore_springs(std::span<const double> kept, std::size_t element_count) {
  if (kept.size() % 4 != 0)
    throw std::invalid_argument("kept contact springs have 4 numbers each, but there are " +
                                std::to_string(kept.size()) + " numbers");
  std::vector<ContactSpring> springs;
  springs.reserve(kept.size() / 4);
  double last = -1.0;
  for (std::size_t i = 0; i < kept.size(); i += 4) {
    const double number = kept[i];
    if (!(number > last && number < static_cast<double>(element_count)) || number != std::floor(number))
      throw std::invalid_argument("kept contact spring " + std::to_string(i / 4) + " is of element " +
                                  std::to_string(number) + "; elements are whole numbers, ascending, below " +
                                  std::to_string(element_count));
    const Vec3 anchor(kept[i + 1], kept[i + 2], kept[i + 3]);
    if (!anchor.allFinite())
      throw std::invalid_argument("kept contact spring " + std::to_string(i / 4) +
                                  " has an anchor that is not finite");
    springs.push_back({static_cast<std::int32_t>(number), anchor});
    last = number;
  }
  return springs;
}

}  // namespace takt
