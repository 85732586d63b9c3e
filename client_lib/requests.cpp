// Requests of takt::Client by name, and what a reply says of the present.
#include <algorithm>
#include <cmath>

#include "client_lib/client_impl.h"
#include "idl/common/text.h"

namespace takt {
namespace {

const Value* find(const Arguments& values, std::string_view name) {
  const auto found =
      std::ranges::find(values, name, [](const auto& one) { return std::string_view(one.name); });
  return found == values.end() ? nullptr : &found->value;
}

std::optional<std::uint64_t> number(const Arguments& values, std::string_view name) {
  const Value* value = find(values, name);
  if (value == nullptr || value->kind != ValueKind::integer) return std::nullopt;
  return static_cast<std::uint64_t>(value->integer);
}

void require_finite(const std::string& request, const Arguments& arguments) {
  const auto finite = [](double number) { return std::isfinite(number); };
  for (const auto& [name, value] : arguments)
    if (!finite(value.number) || !std::ranges::all_of(value.numbers, finite))
      throw ClientError(ClientError::Kind::invalid, "Argument '" + name + "' of '" + request + "' is '" +
                                                        text_of(value) + "'; a finite number is allowed.");
}

}  // namespace

std::string Reply::text(std::string_view name) const {
  const Value* value = find(values, name);
  return value == nullptr ? std::string() : text_of(*value);
}

void Client::Impl::apply_reply_causality(std::unique_lock<std::mutex>& lock, const std::string& request,
                                         const Arguments& values, std::uint32_t generation_before,
                                         Clock::time_point deadline) {
  // Another scenario: its description may take longer than the reply.
  if (const auto generation = number(values, "scenario_generation")) {
    if (!wait(lock, deadline, [&] { return cell && cell->scenario_generation >= *generation; }))
      throw ClientError(ClientError::Kind::timeout,
                        where() + " has done '" + request + "', but its new description has not come.");
    return;
  }
  if (cell->scenario_generation != generation_before) return;
  const auto step = number(values, "step"), epoch = number(values, "epoch");
  if (step || epoch) {
    const State* newest = state->newest();
    const std::uint32_t present = newest != nullptr ? std::max(known.first, newest->epoch) : known.first;
    known = std::max(known, {epoch ? static_cast<std::uint32_t>(*epoch) : present, step.value_or(0)});
    for (auto& [topic, reader] : topic_readers) reader->drop_older_than_known();
  }
  // A change without a step appears in the next sample; a server that ends sends no sample.
  const RequestInfo* info = find_request(request);
  const Value* now = find(values, "state");
  const bool quits = now != nullptr && text_of(*now) == to_string(SimulationState::quitting);
  if (info == nullptr || quits) return;
  if (info->renews_state) state->samples.clear();
  if (info->renews_status) status->samples.clear();
}

Reply Client::request(const std::string& name, const Arguments& arguments, std::optional<Seconds> timeout) {
  require_finite(name, arguments);
  return impl_->call(name, arguments, timeout.value_or(impl_->options.timeout));
}

Reply Client::request(const std::string& name, const std::map<std::string, std::string>& arguments,
                      std::optional<Seconds> timeout) {
  return request(name, arguments_of_text(name, {arguments.begin(), arguments.end()}), timeout);
}

}  // namespace takt
