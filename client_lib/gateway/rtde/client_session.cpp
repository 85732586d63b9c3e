#include "client_lib/gateway/rtde/client_session.h"

namespace takt::rtde {
namespace {

std::string version_request() {
  std::string payload;
  append(payload, std::uint16_t{2});
  return package(PackageType::request_protocol_version, payload);
}

}  // namespace

std::string ClientSession::begin() const {
  return version_request();
}

const Value& ClientSession::value(const std::string& name) const {
  static const Value kZero{};
  const auto found = values_.find(name);
  return found == values_.end() ? kZero : found->second;
}

std::string ClientSession::receive(std::string_view bytes, const std::function<void()>& on_data) {
  std::string replies;
  splitter_.add(bytes);
  std::optional<Package> newest;
  while (failure_.empty()) {
    auto next = splitter_.next();
    if (!next) break;
    if (next->type == PackageType::data_package)
      newest = std::move(next);
    else
      replies += step(*next);
  }
  if (splitter_.broken()) fail("The controller sends bytes that are no RTDE package.");
  if (!newest || stage_ != Stage::started || !failure_.empty()) return replies;
  Reader reader(newest->payload);
  if (reader.u8() != output_recipe_) return replies;
  std::map<std::string, Value> values;
  for (std::size_t i = 0; i < outputs_.size(); ++i) values[outputs_[i]] = read(reader, output_types_[i]);
  if (reader.failed() || !reader.rest().empty()) {
    fail("A data package of the controller has not the size of its recipe.");
    return replies;
  }
  values_ = std::move(values);
  on_data();
  return replies;
}

bool ClientSession::take_types(std::string_view list, const std::vector<std::string>& names,
                               std::vector<Type>& types) {
  const auto words = split_names(list);
  if (words.size() != names.size()) {
    fail("The controller answers with " + std::to_string(words.size()) + " types for " +
         std::to_string(names.size()) + " names.");
    return false;
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto type = type_of_name(words[i]);
    if (!type) {
      fail("The controller answers " + words[i] + " for " + names[i] +
           (words[i] == "IN_USE" ? ": another RTDE client writes it."
                                 : ": its software does not have this variable."));
      return false;
    }
    types.push_back(*type);
  }
  return true;
}

std::string ClientSession::set_up_inputs() {
  if (!inputs_.empty()) {
    stage_ = Stage::inputs;
    return package(PackageType::setup_inputs, join_names(inputs_));
  }
  stage_ = Stage::start;
  return package(PackageType::start, {});
}

std::string ClientSession::step(const Package& received) {
  Reader reader(received.payload);
  if (received.type == PackageType::text_message) {
    const std::size_t size = reader.u8();
    messages_.emplace_back("The controller says: " + std::string(reader.text(size)));
    return {};
  }
  if (received.type == PackageType::request_protocol_version && stage_ == Stage::version) {
    if (reader.u8() != 1)
      return fail("The controller does not speak version 2 of RTDE; its software is too old.");
    stage_ = Stage::outputs;
    std::string payload;
    append(payload, frequency_Hz_);
    return package(PackageType::setup_outputs, payload + join_names(outputs_));
  }
  if (received.type == PackageType::setup_outputs && stage_ == Stage::outputs) {
    output_recipe_ = reader.u8();
    return take_types(reader.rest(), outputs_, output_types_) ? set_up_inputs() : std::string();
  }
  if (received.type == PackageType::setup_inputs && stage_ == Stage::inputs) {
    const std::uint8_t recipe = reader.u8();
    if (!take_types(reader.rest(), inputs_, input_types_)) return {};
    input_recipe_ = recipe;
    stage_ = Stage::start;
    return package(PackageType::start, {});
  }
  if (received.type == PackageType::start && stage_ == Stage::start) {
    if (reader.u8() != 1) return fail("The controller refuses to start its data.");
    stage_ = Stage::started;
  }
  return {};
}

std::string ClientSession::inputs(const std::vector<Value>& values) const {
  if (stage_ != Stage::started || input_recipe_ == 0 || values.size() != inputs_.size()) return {};
  std::string payload;
  append(payload, input_recipe_);
  for (std::size_t i = 0; i < values.size(); ++i) append(payload, input_types_[i], values[i]);
  return package(PackageType::data_package, payload);
}

}  // namespace takt::rtde
