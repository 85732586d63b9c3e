#include "server/runtime/requests/pressure_subscriptions.h"

#include <algorithm>

#include "idl/common/text.h"
#include "server/scenario/contact_pair_names.h"

namespace takt {
namespace {

/// A few, for an error text.
std::string some_pairs(const CellModel& model) {
  constexpr std::size_t most = 10;
  std::vector<std::string> names;
  for (const ContactPairModel& pair : model.contact.pairs) {
    if (names.size() == most) break;
    names.push_back(contact_pair_name(model.description, pair));
  }
  const std::size_t more = model.contact.pairs.size() - names.size();
  return join(names, ", ") + (more > 0 ? " and " + std::to_string(more) + " more" : "");
}

}  // namespace

Outcome<requests::WatchPressures> PressureSubscriptions::watch(const requests::WatchPressures& request,
                                                               std::int64_t now_ns) {
  if (model_.contact.pairs.empty())
    return Refusal{
        ControlResult::incorrect_state,
        "This scenario has no pairs in surface contact (section contact); there are no pressures."};
  std::vector<std::string> unknown;
  const std::vector<std::size_t> pairs =
      find_contact_pairs(model_.contact, model_.description, request.pairs, &unknown);
  if (!unknown.empty())
    return Refusal{ControlResult::not_found, "No pair of this cell is called '" +
                                                 join(unknown, ", ").substr(0, 200) +
                                                 "'; there are: " + some_pairs(model_).substr(0, 700) +
                                                 "; * stands for any characters."};
  const std::lock_guard lock(mutex_);
  std::erase_if(until_ns_, [&](const auto& watched) { return watched.second <= now_ns; });
  for (const std::size_t pair : pairs) {
    if (request.duration > 0.0)
      until_ns_[pair] = now_ns + static_cast<std::int64_t>(request.duration * 1e9);
    else
      until_ns_.erase(pair);
  }
  return {std::to_string(until_ns_.size()) + " of " + std::to_string(model_.contact.pairs.size()) +
              " pairs are watched; of those that press, " + std::to_string(kMaxPairs) +
              " at most are sent as contact_pressures.",
          {until_ns_.size()}};
}

bool PressureSubscriptions::watches(std::int64_t now_ns) {
  const std::lock_guard lock(mutex_);
  std::erase_if(until_ns_, [&](const auto& watched) { return watched.second <= now_ns; });
  return !until_ns_.empty();
}

const std::vector<PressedPair>& PressureSubscriptions::look(const Snapshot& snapshot,
                                                            std::int64_t (*clock_ns)()) {
  const std::int64_t began_ns = clock_ns();
  {
    const std::lock_guard lock(mutex_);
    pairs_.clear();
    for (const auto& [pair, until_ns] : until_ns_)
      if (until_ns > began_ns) pairs_.push_back(pair);
  }
  const std::vector<PressedPair>& pressed = elements_.read(snapshot, pairs_);
  due_ns_ = began_ns + std::max(kPeriod_ns, 10 * (clock_ns() - began_ns));
  return pressed;
}

}  // namespace takt
