// The common part of all commands: connection to the cell, replies, errors.
#include <unistd.h>

#include <cstdio>

#include "client_lib/tools/takt/commands.h"

namespace takt::tool {
namespace {

const char* name_of(ClientError::Kind kind) {
  switch (kind) {
    case ClientError::Kind::timeout:
      return "timeout";
    case ClientError::Kind::not_found:
      return "not_found";
    case ClientError::Kind::invalid:
      return "invalid";
    case ClientError::Kind::refused:
      return "refused";
    case ClientError::Kind::lost:
      return "lost";
    case ClientError::Kind::transport:
      return "transport";
  }
  return "unknown";
}

std::unique_ptr<Client> connect(const ClientOptions& options) {
  try {
    return std::make_unique<Client>(options);
  } catch (const ClientError& error) {
    if (error.kind() == ClientError::Kind::not_found) throw NoCell(error.what());
    throw;
  }
}

}  // namespace

Session::Session(const Common& common) : client_(connect(common.client)) {}

void say_that_the_cell_has_gone() {
  std::fprintf(stderr, "%stakt: the cell has gone away; waiting for it (Ctrl-C ends this).\n",
               isatty(STDOUT_FILENO) != 0 ? "\n" : "");
}

int report(const Common& common, const Reply& reply) {
  if (common.json)
    print_json(nlohmann::json{{"message", reply.message}, {"values", recording::values_json(reply.values)}});
  else
    std::printf("%s\n", reply.message.c_str());
  return kOk;
}

int report_error(bool json, const std::exception& error) {
  const auto* of_client = dynamic_cast<const ClientError*>(&error);
  const bool no_cell = dynamic_cast<const NoCell*>(&error) != nullptr ||
                       (of_client != nullptr && of_client->kind() == ClientError::Kind::lost);
  if (json) {
    nlohmann::json document{{"error", error.what()}};
    document["kind"] = dynamic_cast<const NoCell*>(&error) != nullptr ? "no_cell"
                       : of_client != nullptr                         ? name_of(of_client->kind())
                                                                      : "failed";
    if (of_client != nullptr && of_client->result())
      document["result"] = static_cast<int>(of_client->result().value());
    print_json(document);
  }
  std::fprintf(stderr, "takt: %s\n", error.what());
  return no_cell ? kNoCell : kFailed;
}

}  // namespace takt::tool
