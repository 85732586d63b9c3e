#pragma once
// Requests as a person types them, and values of replies as text.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "server/runtime/requests/control.h"

namespace takt::test {

using TextArguments = std::vector<std::pair<std::string, std::string>>;

inline ControlRequest text_request(std::uint64_t id, const std::string& name,
                                   const TextArguments& arguments) {
  return {id, name, arguments_of_text(name, arguments)};
}

/// Empty for an unknown name.
inline std::string value_of(const ControlReply& reply, const std::string& name) {
  for (const auto& value : reply.values)
    if (value.name == name) return text_of(value.value);
  return {};
}

/// Each reply has a result that the table allows.
inline void expect_declared_result(const std::string& request, const ControlReply& reply) {
  const RequestInfo* info = find_request(request);
  if (info == nullptr) return;
  EXPECT_TRUE(std::ranges::find(info->results, reply.result) != info->results.end())
      << request << " has no result " << static_cast<int>(reply.result) << ": " << reply.message;
}

}  // namespace takt::test
