#pragma once
// A client of a hosted service (hosted_service.h), and the expectations of tests on its replies.
#include <gtest/gtest.h>

#include <initializer_list>
#include <map>
#include <string>

#include "client_lib/client.h"
#include "tests/support/dds_service.h"

namespace takt::test {

inline constexpr Seconds kGenerous{60.0};

inline ClientOptions client_options() {
  ClientOptions options;
  options.cell = test_cell();
  options.domain = static_cast<int>(test_domain());
  options.timeout = kGenerous;
  options.liveliness_timeout = kGenerous;
  return options;
}

/// The refusal of a request that must be refused.
inline ClientError refusal(Client& cell, const std::string& name,
                           const std::map<std::string, std::string>& arguments = {}) {
  try {
    const Reply reply = cell.request(name, arguments);
    ADD_FAILURE() << name << " was done: " << reply.message;
  } catch (const ClientError& error) {
    return error;
  }
  return {ClientError::Kind::timeout, ""};
}

inline void expect_words(const std::string& text, std::initializer_list<const char*> words) {
  for (const char* word : words)
    EXPECT_NE(text.find(word), std::string::npos) << word << " is not in: " << text;
}

}  // namespace takt::test
