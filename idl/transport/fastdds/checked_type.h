#pragma once
// A generated type whose decoder refuses what it cannot read. That of fastddsgen 2.3 lets all exceptions but
// one pass, through the threads of Fast DDS, which ends the process.
#include <exception>

#include "idl/transport/fastdds/fastdds.h"
#include "idl/transport/rtps_guard/cdr_layout.h"

namespace takt {

/// What samples of a generated ...PubSubType must look like, for types with sequences or strings that come
/// from outside (wire_shape.h). Empty: anything.
template <typename Type>
inline constexpr WireShape kWireShape{};

template <typename Type>
class CheckedType : public Type {
 public:
  bool deserialize(DdsPayload payload, void* data) override {
    try {
      if (!kWireShape<Type>.empty() && !has_shape(bytes_of(payload), kWireShape<Type>)) return false;
      return Type::deserialize(payload, data);
    } catch (const std::exception&) {
      return false;
    }
  }
};

}  // namespace takt
