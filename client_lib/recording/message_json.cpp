#include "client_lib/recording/message_json.h"

namespace takt::recording {

void for_each_leaf(const nlohmann::json& document,
                   const std::function<void(const std::string& name, const nlohmann::json& value)>& function,
                   const std::string& name) {
  if (!document.is_structured()) return function(name, document);
  for (const auto& [key, value] : document.items())
    for_each_leaf(value, function, name.empty() ? key : name + "." + key);
}

}  // namespace takt::recording
