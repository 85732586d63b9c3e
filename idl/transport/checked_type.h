#pragma once
// A generated type whose decoder refuses what it cannot read. That of fastddsgen 2.3 lets all exceptions but
// one pass, through the threads of Fast DDS, which ends the process.
#include <exception>

#include "idl/transport/fastdds.h"

namespace takt {

template <typename Type>
class CheckedType : public Type {
 public:
  bool deserialize(DdsPayload payload, void* data) override {
    try {
      return Type::deserialize(payload, data);
    } catch (const std::exception&) {
      return false;
    }
  }
};

}  // namespace takt
