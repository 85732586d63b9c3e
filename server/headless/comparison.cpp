#include "server/headless/comparison.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "idl/common/parse.h"
#include "idl/common/text.h"
#include "server/headless/table.h"
#include "server/scenario/scenario_reader.h"
#include "takt_enumerations.h"

namespace takt {

namespace {

using Json = nlohmann::ordered_json;

struct NamedLimit {
  const char* name;
  double ComparisonLimits::*value;
};
constexpr std::array<NamedLimit, 8> kLimits{{{"time_s", &ComparisonLimits::time_s},
                                             {"position_m", &ComparisonLimits::position_m},
                                             {"angle_rad", &ComparisonLimits::angle_rad},
                                             {"energy", &ComparisonLimits::energy},
                                             {"torque", &ComparisonLimits::torque},
                                             {"force", &ComparisonLimits::force},
                                             {"use", &ComparisonLimits::use},
                                             {"least_force_N", &ComparisonLimits::least_force_N}}};

std::string level_of(const Json& report) {
  return "LoD " + std::to_string(report["level_of_detail"].get<int>());
}

double share(double a, double b) {
  const double larger = std::max(std::abs(a), std::abs(b));
  return larger > 0.0 ? std::abs(a - b) / larger : 0.0;
}

class Comparer {
 public:
  Comparer(const Json& a, const Json& b, const ComparisonLimits& limits) : a_(a), b_(b), limits_(limits) {}

  Comparison run() {
    compare_ends();
    compare_demands();
    compare_holders();
    compare_steps();
    compare_poses();
    compare_energies();
    compare_torques();
    compare_contacts();
    compare_margins();
    std::stable_sort(result_.differences.begin(), result_.differences.end(),
                     [](const Difference& x, const Difference& y) {
                       return x.difference * y.limit > y.difference * x.limit;
                     });
    judge();
    return std::move(result_);
  }

 private:
  void add(const std::string& of, const std::string& unit, double a, double b, double limit) {
    result_.differences.push_back({of, unit, a, b, std::abs(a - b), limit, false});
  }
  void add_share(const std::string& of, const std::string& unit, double a, double b, double difference,
                 double limit) {
    result_.differences.push_back({of, unit, a, b, difference, limit, true});
  }

  void compare_ends() {
    for (const auto& [name, report] : {std::pair{"the first run", &a_}, std::pair{"the second run", &b_}})
      if (!(*report)["fault"].is_null())
        result_.contradictions.push_back(std::string(name) +
                                         " ended early: " + (*report)["fault"].get<std::string>());
    add("simulated time", "s", a_["time"].get<double>(), b_["time"].get<double>(), limits_.time_s);
    const auto count = [](const Json& report) {
      return std::count_if(report["collisions"].begin(), report["collisions"].end(), [](const Json& c) {
        return c["kind"] == to_string(CollisionEventKind::collision);
      });
    };
    if (count(a_) != count(b_))
      result_.contradictions.push_back("collisions: " + std::to_string(count(a_)) + " and " +
                                       std::to_string(count(b_)));
  }

  void compare_demands() {
    if (!a_.contains("assertions") || !b_.contains("assertions")) return;
    for (const auto& [name, demand] : a_["assertions"].items()) {
      if (!b_["assertions"].contains(name)) continue;
      const std::string one = demand["verdict"], other = b_["assertions"][name]["verdict"];
      // A verdict `skipped` in one run must not be a failure in the other.
      const bool agree =
          one == other || (one == "skipped" && other == "passed") || (one == "passed" && other == "skipped");
      if (!agree)
        result_.contradictions.push_back("'" + name + "': " + one + " and " + other + " (" +
                                         b_["assertions"][name]["sentence"].get<std::string>() + ")");
    }
  }

  /// The same Parts go through the same hands in the same order.
  void compare_holders() {
    std::map<std::string, std::array<std::vector<const Json*>, 2>> changes;
    for (const auto& [side, report] : {std::pair{0U, &a_}, std::pair{1U, &b_}})
      for (const Json& change : (*report)["connection_changes"])
        if (change["time"].get<double>() > 0.0) changes[change["part"]][side].push_back(&change);
    const auto holder = [](const Json* change) {
      return (*change)["to"].is_null() ? std::string("nothing") : (*change)["to"].get<std::string>();
    };
    const auto listed = [&](const std::vector<const Json*>& list) {
      const std::string text = join(list, ", ", holder);
      return text.empty() ? std::string("no change") : text;
    };
    for (const auto& [part, lists] : changes) {
      const std::string one = listed(lists[0]), other = listed(lists[1]);
      if (one != other) {
        result_.contradictions.push_back(part + " is held in turn by " + one + "; in the second run by " +
                                         other);
        continue;
      }
      for (std::size_t i = 0; i < lists[0].size(); ++i)
        add(part + " held by " + holder(lists[0][i]), "s", (*lists[0][i])["time"].get<double>(),
            (*lists[1][i])["time"].get<double>(), limits_.time_s);
    }
  }

  void compare_steps() {
    const auto keyed = [](const Json& report) {
      std::map<std::string, double> durations;
      std::map<std::string, int> seen;
      for (const Json& step : report["run_metrics"]["steps"]) {
        std::string key = step["robot"].get<std::string>() + ": " + step["name"].get<std::string>();
        if (!step["named"].get<bool>()) key += ", line " + std::to_string(step["line"].get<int>());
        const int n = ++seen[key];
        durations[n > 1 ? key + " (" + std::to_string(n) + ")" : key] = step["duration"].get<double>();
      }
      return durations;
    };
    const auto a = keyed(a_), b = keyed(b_);
    for (const auto& [key, duration] : a) {
      const auto other = b.find(key);
      if (other != b.end())
        add("duration of " + key, "s", duration, other->second, limits_.time_s);
      else
        result_.contradictions.push_back("the step " + key + " is in the first run only");
    }
    for (const auto& [key, duration] : b)
      if (a.count(key) == 0)
        result_.contradictions.push_back("the step " + key + " is in the second run only");
    const Json &x = a_["run_metrics"]["cycle_time"], &y = b_["run_metrics"]["cycle_time"];
    if (x.is_number() && y.is_number())
      add("cycle time", "s", x.get<double>(), y.get<double>(), limits_.time_s);
  }

  void compare_poses() {
    for (const auto& [name, one] : a_["components"].items()) {
      if (one["type"] != to_string(ComponentType::part) || !b_["components"].contains(name)) continue;
      const Json& other = b_["components"][name];
      double square = 0.0, cosine = 0.0;
      for (const auto& [axis, value] : one["position"].items())
        square += std::pow(value.get<double>() - other["position"][axis].get<double>(), 2);
      for (const auto& [axis, value] : one["orientation"].items())
        cosine += value.get<double>() * other["orientation"][axis].get<double>();
      result_.differences.push_back(
          {"place of " + name + " at the end", "m", {}, {}, std::sqrt(square), limits_.position_m, false});
      result_.differences.push_back({"orientation of " + name + " at the end",
                                     "rad",
                                     {},
                                     {},
                                     2.0 * std::acos(std::min(1.0, std::abs(cosine))),
                                     limits_.angle_rad,
                                     false});
    }
  }

  void compare_energies() {
    for (const auto& [name, one] : a_["run_metrics"]["consumers"].items()) {
      if (!b_["run_metrics"]["consumers"].contains(name)) continue;
      const double a = one["electrical_energy"],
                   b = b_["run_metrics"]["consumers"][name]["electrical_energy"];
      add_share("energy of " + name, "J", a, b, share(a, b), limits_.energy);
    }
  }

  void compare_torques() {
    for (const auto& [robot, one] : a_["run_metrics"]["robots"].items()) {
      if (!b_["run_metrics"]["robots"].contains(robot)) continue;
      const Json& others = b_["run_metrics"]["robots"][robot]["joints"];
      for (const auto& [joint, x] : one["joints"].items()) {
        if (!x.contains("largest_effort") || !others.contains(joint) ||
            !others[joint].contains("largest_effort"))
          continue;
        const double a = x["largest_effort"], b = others[joint]["largest_effort"];
        const std::string of = robot + "." + joint + " torque";
        double limit = 0.0;
        for (const Json& margin : b_["run_metrics"]["margins"])
          if (margin["of"] == of) limit = margin["limit"].get<double>();
        add_share("largest " + of, "N m", a, b, limit > 0.0 ? std::abs(a - b) / limit : share(a, b),
                  limits_.torque);
      }
    }
  }

  void compare_contacts() {
    if (!a_.contains("contacts") || !b_.contains("contacts")) return;
    std::map<std::string, std::array<double, 2>> forces;
    const auto collect = [&](const Json& report, std::size_t side) {
      for (const Json& c : report["contacts"]["largest"])
        forces[c["base"].get<std::string>() + " - " + c["target"].get<std::string>()][side] =
            c["normal_force"].get<double>();
    };
    collect(a_, 0);
    collect(b_, 1);
    for (const auto& [pair, force] : forces)
      if (std::max(force[0], force[1]) >= limits_.least_force_N)
        add_share("largest contact force " + pair, "N", force[0], force[1], share(force[0], force[1]),
                  limits_.force);
  }

  /// A value that only one of the runs has must keep a distance from its limit.
  void compare_margins() {
    const auto uses = [](const Json& report) {
      std::map<std::string, const Json*> all;
      for (const Json& margin : report["run_metrics"]["margins"])
        all[margin["of"].get<std::string>()] = &margin;
      return all;
    };
    const auto a = uses(a_), b = uses(b_);
    const auto add_alone = [&](const auto& own, const auto& other, bool first) {
      for (const auto& [of, margin] : own) {
        if (other.count(of) != 0) continue;
        const double value = (*margin)["value"], use = (*margin)["use"];
        result_.differences.push_back({"only one has: " + of, (*margin)["unit"],
                                       first ? std::optional(value) : std::nullopt,
                                       first ? std::nullopt : std::optional(value), use, limits_.use, true});
      }
    };
    add_alone(a, b, true);
    add_alone(b, a, false);
  }

  void judge() {
    const auto counting =
        static_cast<std::size_t>(std::count_if(result_.differences.begin(), result_.differences.end(),
                                               [](const Difference& d) { return d.counts(); }) +
                                 static_cast<std::ptrdiff_t>(result_.contradictions.size()));
    result_.enough = counting == 0;
    const int la = a_["level_of_detail"], lb = b_["level_of_detail"];
    const bool by_level = la != lb;
    const std::string lower = level_of(la < lb ? a_ : b_), higher = level_of(la < lb ? b_ : a_);
    if (result_.enough)
      result_.verdict = by_level ? lower + " is enough here: " + higher + " says nothing else that counts"
                                 : "Nothing that counts differs";
    else
      result_.verdict = (by_level ? lower + " is not enough here: " : std::string("The runs differ: ")) +
                        std::to_string(counting) +
                        (counting == 1 ? " difference counts" : " differences count");
  }

  const Json &a_, &b_;
  const ComparisonLimits& limits_;
  Comparison result_;
};

Json read_report(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    throw ScenarioError(file + ": cannot be read: " + std::strerror(errno) +
                        "; allowed: the report of a run");
  Json report = Json::parse(in, nullptr, false);
  if (!report.is_object() || !report.contains("scenario") || !report.contains("run_metrics"))
    throw ScenarioError(
        file + ": is no report with a section `run_metrics`; allowed: what takt-run run --report writes");
  return report;
}

}  // namespace

bool compare_files(std::ostream& out, const std::string& a, const std::string& b, const std::string& json,
                   const ComparisonLimits& limits) {
  const Json one = read_report(a), other = read_report(b);
  const Comparison comparison = compare_reports(one, other, limits);
  print_comparison(out, one, other, comparison, limits);
  if (!json.empty()) {
    std::ofstream file(json);
    file << comparison_json(comparison, limits).dump(2) << '\n';
    file.close();
    if (!file) throw std::runtime_error(json + ": cannot be written");
  }
  return comparison.enough;
}

void set_limit(ComparisonLimits& limits, const std::string& text) {
  const auto given = named_number(text);
  for (const NamedLimit& limit : kLimits) {
    if (!given || given->first != limit.name || given->second < 0.0) continue;
    limits.*limit.value = given->second;
    return;
  }
  throw ScenarioError("--limit: found '" + text + "'; allowed: NAME=VALUE with VALUE >= 0 and NAME one of " +
                      list_names(kLimits));
}

Comparison compare_reports(const Json& a, const Json& b, const ComparisonLimits& limits) {
  if (a["scenario"] != b["scenario"])
    throw ScenarioError("the reports are of two scenarios: '" + a["scenario"].get<std::string>() + "' and '" +
                        b["scenario"].get<std::string>() + "'; allowed: two runs of one scenario");
  return Comparer(a, b, limits).run();
}

void print_comparison(std::ostream& out, const Json& a, const Json& b, const Comparison& comparison,
                      const ComparisonLimits& limits) {
  constexpr std::size_t kMaxListed = 20;
  out << a["scenario"].get<std::string>() << ": " << level_of(a) << " ("
      << number_text(a["cpu_time"].get<double>(), 3) << " s of computation) and " << level_of(b) << " ("
      << number_text(b["cpu_time"].get<double>(), 3) << " s)\n";
  for (const std::string& sentence : comparison.contradictions) out << "!! " << sentence << '\n';
  Table table;
  std::size_t listed = 0, counting = 0;
  for (const Difference& d : comparison.differences) {
    if (d.counts()) ++counting;
    if (listed >= kMaxListed || (listed >= 8 && !d.counts())) continue;
    ++listed;
    const auto value = [](const std::optional<double>& v) {
      return v ? number_text(*v, 5) : std::string("-");
    };
    const auto amount = [&](double v) {
      return d.share ? number_text(100.0 * v, 4) + " %"
                     : number_text(v, 4) + (d.unit.empty() ? "" : " " + d.unit);
    };
    table.begin_row();
    table.set("", d.counts() ? "!!" : "");
    table.set("quantity", d.of + (d.unit.empty() ? "" : " (" + d.unit + ")"));
    table.set("first", value(d.a));
    table.set("second", value(d.b));
    table.set("difference", amount(d.difference));
    table.set("allowed", amount(d.limit));
  }
  out << "Largest differences (!! counts):\n";
  table.write_aligned(out);
  if (comparison.differences.size() > listed)
    out << "   and " << comparison.differences.size() - listed << " more (--report lists all)\n";
  out << "Judged by:";
  for (const NamedLimit& limit : kLimits)
    out << ' ' << limit.name << '=' << number_text(limits.*limit.value, 5);
  out << " (--limit NAME=VALUE)\n" << comparison.verdict << ".\n";
}

Json comparison_json(const Comparison& comparison, const ComparisonLimits& limits) {
  Json judged = Json::object(), all = Json::array();
  for (const NamedLimit& limit : kLimits) judged[limit.name] = limits.*limit.value;
  const auto value = [](const std::optional<double>& v) { return v ? Json(*v) : Json(nullptr); };
  for (const Difference& d : comparison.differences)
    all.push_back({{"of", d.of},
                   {"unit", d.unit},
                   {"first", value(d.a)},
                   {"second", value(d.b)},
                   {"difference", d.difference},
                   {"limit", d.limit},
                   {"share", d.share},
                   {"counts", d.counts()}});
  return {{"verdict", comparison.verdict},
          {"enough", comparison.enough},
          {"limits", std::move(judged)},
          {"contradictions", comparison.contradictions},
          {"differences", std::move(all)}};
}

}  // namespace takt
