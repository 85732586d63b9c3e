#include "server/devices/kind_signals.h"

#include <stdexcept>

namespace takt {

std::vector<SignalDescription> described(std::span<const KindSignal> signals,
                                         std::initializer_list<SignalLimits> own) {
  std::vector<SignalDescription> result;
  const SignalLimits* next = own.begin();
  for (const KindSignal& signal : signals) {
    SignalLimits limits{signal.lower, signal.upper};
    if (signal.has_own_limits()) {
      if (next == own.end()) throw std::logic_error(std::string("no limits for the signal ") + signal.name);
      limits = *next++;
    }
    result.push_back({signal.name, signal.unit, signal.commanded, limits.lower, limits.upper, signal.type});
  }
  if (next != own.end()) throw std::logic_error("limits without a signal");
  return result;
}

}  // namespace takt
