#include "server/dds/ros_filters.h"

#include <algorithm>
#include <utility>

namespace takt::ros {
namespace {

namespace msg = simulation_interfaces::msg;

// Of TagsFilter.msg.
enum Mode : std::uint8_t { kAny = 0, kAll = 1 };

std::shared_ptr<const regex_t> compile(const std::string& pattern) {
  auto made = std::make_unique<regex_t>();
  if (regcomp(made.get(), pattern.c_str(), REG_EXTENDED | REG_NOSUB) != 0) return nullptr;
  return {made.release(), [](regex_t* compiled) {
            regfree(compiled);
            delete compiled;
          }};
}

}  // namespace

std::optional<Refusal> fault_of(const msg::TagsFilter& filter) {
  if (filter.filter_mode == kAny || filter.filter_mode == kAll) return std::nullopt;
  return Refusal{ControlResult::failed, "The filter_mode of tags is " + std::to_string(filter.filter_mode) +
                                            "; allowed are 0 (any of them) and 1 (all of them)."};
}

std::optional<Refusal> fault_of(const msg::EntityFilters& filters) {
  constexpr std::size_t kLongest = 200;
  if (!filters.bounds.points.empty())
    return Refusal{ControlResult::unsupported, "There is no filter by bounds here; leave it empty."};
  const std::string& pattern = filters.filter;
  if (pattern.size() > kLongest || pattern.find_first_of("{\n") != std::string::npos)
    return Refusal{ControlResult::unsupported,
                   "A filter is a POSIX extended regular expression of at most 200 characters, without "
                   "repetition counts in braces."};
  if (!EntityChoice(filters).good())
    return Refusal{ControlResult::failed,
                   "The filter '" + pattern + "' is no POSIX extended regular expression."};
  return fault_of(filters.tags);
}

bool matches(const msg::TagsFilter& filter, const std::vector<std::string>& tags) {
  const auto has = [&](const std::string& tag) {
    return std::find(tags.begin(), tags.end(), tag) != tags.end();
  };
  if (filter.tags.empty()) return true;
  return filter.filter_mode == kAll ? std::all_of(filter.tags.begin(), filter.tags.end(), has)
                                    : std::any_of(filter.tags.begin(), filter.tags.end(), has);
}

EntityChoice::EntityChoice(msg::EntityFilters filters)
    : filters_(std::move(filters)), compiled_(compile(filters_.filter)) {}

bool EntityChoice::has(const requests::EntityInfo& info) const {
  const auto& categories = filters_.categories;
  const bool of_category =
      categories.empty() || std::any_of(categories.begin(), categories.end(), [&](const auto& wanted) {
        return wanted.category == static_cast<std::uint8_t>(info.category);
      });
  if (!of_category || !matches(filters_.tags, info.tags)) return false;
  return filters_.filter.empty() ||
         (good() && regexec(compiled_.get(), info.name.c_str(), 0, nullptr, 0) == 0);
}

}  // namespace takt::ros
