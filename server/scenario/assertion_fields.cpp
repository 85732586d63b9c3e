// The section `assertions` of scenario files.
#include <numbers>

#include "idl/common/text.h"
#include "server/fields/fields.h"
#include "server/scenario/scenario.h"

namespace takt {

namespace {
using Kind = ScenarioAssertion::Kind;

/// A bound that is infinite if the file does not state it.
void bound(Fields& f, const char* key, double& value, const char* doc) {
  std::optional<double> stated;
  if (!f.reading() && std::isfinite(value)) stated = value;
  f.field(key, stated, NumberRange{}, doc, kNotInModel);
  if (stated) value = *stated;
}
}  // namespace

void describe(Fields& f, ScenarioAssertion& s) {
  const Choice<Kind> kinds{{{"contact_force", Kind::contact_force},
                            {"pose", Kind::pose},
                            {"held_by", Kind::held_by},
                            {"energy", Kind::energy},
                            {"signal", Kind::signal},
                            {"grip_margin", Kind::grip_margin},
                            {"no_collision", Kind::no_collision}}};
  s.place = f.path();
  f.field("check", s.kind, kinds, "Kind of the check.", kRequired | kNotInModel);
  std::optional<double> time_s;
  if (!f.reading() && s.time_s >= 0.0) time_s = s.time_s;
  f.field("time_s", time_s, not_negative("s"), "When; without it: at the end.", kNotInModel);
  if (time_s) s.time_s = *time_s;
  const auto when = [&](std::vector<Kind> which, const auto& body) {
    f.when("check", kinds, s.kind, which, body);
  };
  const auto subject = [&](const char* key, const NameOf& names, const char* doc) {
    f.field(key, s.subject, names, doc, kRequired | kNotInModel);
  };
  when({Kind::contact_force}, [&] {
    f.field("pair", s.pair, NamePair{},
            "Names or patterns of two components; the largest normal force between them is checked.",
            kRequired | kNotInModel);
  });
  when({Kind::pose, Kind::held_by},
       [&] { subject("part", f.name_of({"parts"}, "a part"), "The part that is checked."); });
  when({Kind::pose}, [&] {
    f.pose("pose", s.X_WB, "Where the part must be, in the world.", kNotInModel);
    f.field("tolerance_m", s.tolerance_m, positive("m"), "Largest distance from there.",
            kRequired | kNotInModel);
    std::optional<double> angle_deg;
    if (!f.reading() && std::isfinite(s.tolerance_rad))
      angle_deg = s.tolerance_rad * 180.0 / std::numbers::pi;
    f.field("tolerance_deg", angle_deg, positive("deg"), "Largest angle from there; without it: any.",
            kNotInModel);
    if (f.reading() && angle_deg) s.tolerance_rad = *angle_deg * std::numbers::pi / 180.0;
  });
  when({Kind::held_by}, [&] {
    NameOf holders = f.name_of({"parts", "grounds", "grippers"}, "a component");
    holders.also = "nothing";
    std::string by = s.holder.empty() ? holders.also : s.holder;
    f.field("by", by, holders, "The component that must hold the part, or `nothing`.",
            kRequired | kNotInModel);
    if (f.reading()) s.holder = by == holders.also ? "" : by;
  });
  when({Kind::energy}, [&] {
    subject("of", f.name_of({"robots", "consumers"}, "a robot or device that draws energy"),
            "The robot or device whose drawn energy (J) is checked.");
  });
  when({Kind::signal}, [&] {
    subject("device", f.name_of({"devices"}, "a device"), "The device whose signal is checked.");
    f.field("signal", s.signal, Text{}, "Name of the signal.", kRequired | kNotInModel);
  });
  when({Kind::grip_margin}, [&] {
    subject("gripper", f.name_of({"grippers"}, "a gripper"),
            "The gripper whose smallest ratio of force to the force that friction needs is checked (levels "
            "of detail 1 and 2).");
  });
  when({Kind::contact_force, Kind::energy, Kind::signal, Kind::grip_margin}, [&] {
    bound(f, "above", s.lower, "Lower bound: force (N), energy (J), signal or margin.");
    bound(f, "below", s.upper, "Upper bound.");
    f.alternatives({"above", "below"}, 1, 2, "below", "neither 'above' nor 'below'",
                   "at least one of them, a number");
    f.check(s.lower <= s.upper, "above", "more than 'below'", "an interval that is not empty");
  });
}

void describe_assertions(Fields& f, Scenario& scenario) {
  f.entries("assertions", scenario.assertions,
            "Required results of the run; it ends with exit code 3 if one is missing.",
            "One demand; its name appears in the report.", kNotInModel);
  for (const ScenarioAssertion& assertion : scenario.assertions)
    f.check(assertion.kind != Kind::no_collision || scenario.collision_checking.enabled, "assertions",
            "the check no_collision of '" + assertion.name + "'",
            "this check together with a section collision_checking");
}

}  // namespace takt
