#pragma once
// The three types of component (thesis 3.2.1).
#include <cstdint>
#include <string_view>

namespace takt {

enum class ComponentType : std::uint8_t { part = 0, gripper = 1, ground = 2 };

constexpr std::string_view to_string(ComponentType type) {
  constexpr std::string_view names[] = {"Part", "Gripper", "Ground"};
  return names[static_cast<int>(type)];
}

}  // namespace takt
