#include "client_lib/recording/message_json.h"

#include <cinttypes>
#include <cstdio>

namespace takt::recording {

std::string hexadecimal(std::uint64_t number) {
  char text[19];
  std::snprintf(text, sizeof text, "0x%016" PRIx64, number);
  return text;
}

void for_each_leaf(const nlohmann::json& document,
                   const std::function<void(const std::string& name, const nlohmann::json& value)>& function,
                   const std::string& name) {
  if (!document.is_structured()) return function(name, document);
  for (const auto& [key, value] : document.items())
    for_each_leaf(value, function, name.empty() ? key : name + "." + key);
}

}  // namespace takt::recording
