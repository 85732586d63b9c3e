#include "client_lib/gateway/rtde/server_session.h"

#include <algorithm>
#include <cmath>

namespace takt::rtde {
namespace {

constexpr std::size_t kMostRecipes = 255;
constexpr std::uint8_t kRecipe = 1;
/// So that every answer and data package fits its size of two bytes.
constexpr std::size_t kMostNames = 1000;

std::string flag(PackageType type, bool accepted) {
  return package(type, std::string(1, accepted ? '\1' : '\0'));
}

}  // namespace

std::string ServerSession::receive(std::string_view bytes) {
  std::string replies;
  splitter_.add(bytes);
  while (const auto request = splitter_.next()) replies += reply(*request);
  return replies;
}

std::string ServerSession::reply(const Package& request) {
  switch (request.type) {
    case PackageType::request_protocol_version: {
      Reader reader(request.payload);
      const int version = reader.u16();
      const bool accepted = !reader.failed() && (version == 1 || version == 2);
      if (accepted) protocol_ = version;
      return flag(request.type, accepted);
    }
    case PackageType::get_urcontrol_version: {
      std::string payload;
      for (const std::uint32_t number : {version_.major, version_.minor, version_.bugfix, version_.build})
        append(payload, number);
      return package(request.type, payload);
    }
    case PackageType::text_message:
      return {};
    case PackageType::setup_outputs:
      return set_up_outputs(request.payload);
    case PackageType::setup_inputs:
      return set_up_inputs(request.payload);
    case PackageType::start:
      started_ = !output_recipe_.empty();
      return flag(request.type, started_);
    case PackageType::pause:
      started_ = false;
      return flag(request.type, true);
    case PackageType::data_package:
      return take_data(request.payload);
  }
  return {};
}

std::string ServerSession::set_up_outputs(std::string_view payload) {
  bool valid = true;
  every_ = 1;
  if (protocol_ == 2) {
    Reader reader(payload);
    const double frequency = reader.f64();
    valid = !reader.failed() && std::isfinite(frequency) && frequency > 0.0;
    // A whole number of cycles; the slowest is one package a second.
    if (valid)
      every_ = static_cast<std::uint64_t>(
          std::clamp(std::round(1.0 / (frequency * cycle_s_)), 1.0, 1.0 / cycle_s_));
    payload = reader.rest();
  }
  std::vector<std::size_t> recipe;
  std::vector<std::string> types;
  auto names = split_names(payload);
  valid = valid && names.size() <= kMostNames;
  names.resize(std::min(names.size(), kMostNames));
  for (const std::string& name : names) {
    const auto variable = outputs_.find(name);
    if (variable) recipe.push_back(*variable);
    types.emplace_back(variable ? type_name(outputs_.variables()[*variable].type) : "NOT_FOUND");
    valid = valid && variable.has_value();
  }
  valid = valid && !recipe.empty();
  started_ = false;
  if (!valid) recipe.clear();
  output_recipe_ = std::move(recipe);
  std::string answer;
  if (protocol_ == 2) append(answer, valid ? kRecipe : std::uint8_t{0});
  return package(PackageType::setup_outputs, answer + join_names(types));
}

std::string ServerSession::set_up_inputs(std::string_view payload) {
  std::vector<std::size_t> recipe;
  std::vector<std::string> types;
  bool valid = input_recipes_.size() < kMostRecipes;
  auto names = split_names(payload);
  valid = valid && names.size() <= kMostNames;
  names.resize(std::min(names.size(), kMostNames));
  for (const std::string& name : names) {
    const auto variable = inputs_.find(name);
    if (!variable) {
      types.emplace_back("NOT_FOUND");
    } else if (!owners_.may_take(*variable, connection_)) {
      types.emplace_back("IN_USE");
    } else {
      types.emplace_back(type_name(inputs_.variables()[*variable].type));
      recipe.push_back(*variable);
      continue;
    }
    valid = false;
  }
  valid = valid && !recipe.empty();
  std::string answer;
  if (valid) {
    for (const std::size_t variable : recipe) owners_.take(variable, connection_);
    input_recipes_.push_back(std::move(recipe));
  }
  append(answer, static_cast<std::uint8_t>(valid ? input_recipes_.size() : 0));
  return package(PackageType::setup_inputs, answer + join_names(types));
}

std::string ServerSession::take_data(std::string_view payload) {
  Reader reader(payload);
  const std::size_t number = reader.u8();
  if (reader.failed() || number == 0 || number > input_recipes_.size())
    return text_message(protocol_, MessageLevel::error,
                        "A data package names no input recipe of this connection.", "takt");
  std::vector<Written> written;
  for (const std::size_t variable : input_recipes_[number - 1]) {
    if (!written.empty() && reader.rest().empty()) break;  // clients leave out the last ones (ur_rtde)
    const Value value = read(reader, inputs_.variables()[variable].type);
    written.push_back({variable, value});
  }
  if (reader.failed() || !reader.rest().empty())
    return text_message(protocol_, MessageLevel::error,
                        "A data package has not the size of its input recipe.", "takt");
  for (const Written& one : written)
    for (const double number_written : one.value.real)
      if (!std::isfinite(number_written))
        return text_message(protocol_, MessageLevel::error,
                            inputs_.variables()[one.variable].name + " is no finite number.", "takt");
  on_inputs_(written);
  return {};
}

std::string ServerSession::data(std::uint64_t cycle) const {
  if (!started_ || output_recipe_.empty() || cycle % every_ != 0) return {};
  std::string payload;
  if (protocol_ == 2) append(payload, kRecipe);
  for (const std::size_t variable : output_recipe_)
    append(payload, outputs_.variables()[variable].type, outputs_.value(variable));
  return package(PackageType::data_package, payload);
}

}  // namespace takt::rtde
