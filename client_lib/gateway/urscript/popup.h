#pragma once
// popup() of URScript: with blocking=True it waits until it is closed, other popups take no time.
#include <span>

#include "client_lib/gateway/urscript/functions.h"

namespace takt::urscript {

/// `arguments`: one for each parameter of the function.
inline bool is_blocking_popup(const Function& function, std::span<const Value> arguments) {
  constexpr std::size_t kBlocking = 4;
  if (function.name != "popup" || arguments.size() <= kBlocking) return false;
  const bool* blocking = arguments[kBlocking].flag();
  return blocking != nullptr && *blocking;
}

}  // namespace takt::urscript
