#pragma once
// Discrete state of a device that enters the state hash of the cell. A plant model that has it implements this interface
// beside DeviceModel.
#include <cstdint>

namespace takt {

class HashedState {
 public:
  virtual ~HashedState() = default;
  virtual std::uint64_t discrete_hash() const = 0;
};

}  // namespace takt
