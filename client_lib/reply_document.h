#pragma once
// A text longer than one value of a reply, sent in pieces (`pieces`, document_0, document_1, ...).
#include <map>
#include <string>

namespace takt::client {

/// The pieces put together. Throws ClientError (refused) when one is missing; `request` is for its sentence.
std::string reply_document(const std::map<std::string, std::string>& values, const std::string& request);

}  // namespace takt::client
