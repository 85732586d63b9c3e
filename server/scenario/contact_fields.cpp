// The section `contact` of scenario files, and the table of contact parameters.
#include "server/fields/fields.h"
#include "server/scenario/scenario_contact.h"

namespace takt {

namespace {

enum class Joined : bool { smaller, larger };  // of the stated values of two components

/// One row for each parameter. All else about parameters follows from it.
template <class Visit>
void visit_parameters(Visit visit) {
  using P = ContactParameters;
  constexpr auto smaller = Joined::smaller, larger = Joined::larger;
  visit("youngs_modulus_Pa", &P::youngs_modulus_Pa, positive("Pa"), smaller,
        "Young's modulus of the elastic layer.");
  visit("poisson_ratio", &P::poisson_ratio, NumberRange{.lower = 0.0, .upper = 0.499}, smaller,
        "Poisson's ratio of the elastic layer.");
  visit("layer_depth_m", &P::layer_depth_m, positive("m"), larger, "Thickness of the elastic layer.");
  visit("areal_damping_N_s_per_m3", &P::areal_damping_N_s_per_m3, not_negative("N s/m^3"), smaller,
        "Damping pressure per normal speed.");
  visit("damping_depth_m", &P::damping_depth_m, positive("m"), smaller,
        "Penetration up to which damping grows from 0.");
  visit("friction", &P::friction, not_negative(""), smaller, "Coefficient of friction.");
  visit("friction_velocity_m_per_s", &P::friction_velocity_m_per_s, positive("m/s"), smaller,
        "Sliding speed up to which regularised friction grows from 0.");
  visit("tangential_stiffness_ratio", &P::tangential_stiffness_ratio, positive(""), smaller,
        "Law `stick`: tangential over normal stiffness.");
  visit("tangential_damping_ratio", &P::tangential_damping_ratio, not_negative(""), smaller,
        "Law `stick`: tangential over normal damping.");
  visit(
      "friction_law", &P::friction_law,
      Choice<FrictionLaw>{{{"regularised", FrictionLaw::regularised}, {"stick", FrictionLaw::stick}}}, larger,
      "Stick, the default: a spring for each element, holds without creep; regularised, the default where a "
      "friction_velocity_m_per_s is stated and no gripper grips: no friction without sliding, held parts "
      "creep.");
  visit("depth", &P::depth,
        Choice<DepthSource>{{{"polygonal", DepthSource::polygonal},
                             {"distance_field", DepthSource::distance_field},
                             {"pressure_field", DepthSource::pressure_field}}},
        larger,
        "Penetration from the triangles of the target, or from its distance field with smooth normals; "
        "pressure_field: likewise, and each side yields by its own layer, at the same pressure.");
}

}  // namespace

template <class T>
std::optional<T> StatedContact::value(T ContactParameters::*parameter) const {
  std::optional<T> result;
  visit_parameters([&, bit = 1U](const char*, auto member, const auto&, Joined, const char*) mutable {
    if constexpr (std::is_same_v<decltype(member), T ContactParameters::*>)
      if (member == parameter && (stated_ & bit) != 0) result = parameters_.*member;
    bit <<= 1U;
  });
  return result;
}
template std::optional<double> StatedContact::value(double ContactParameters::*) const;
template std::optional<FrictionLaw> StatedContact::value(FrictionLaw ContactParameters::*) const;
template std::optional<DepthSource> StatedContact::value(DepthSource ContactParameters::*) const;

void StatedContact::replace_by(const StatedContact& other) {
  visit_parameters([&, bit = 1U](const char*, auto member, const auto&, Joined, const char*) mutable {
    if ((other.stated_ & bit) != 0) parameters_.*member = other.parameters_.*member;
    bit <<= 1U;
  });
  stated_ |= other.stated_;
}

StatedContact StatedContact::joined(const StatedContact& a, const StatedContact& b) {
  StatedContact result = a;
  result.replace_by(b);
  visit_parameters([&, bit = 1U](const char*, auto member, const auto&, Joined joined, const char*) mutable {
    if ((a.stated_ & b.stated_ & bit) != 0) {
      const auto [least, most] = std::minmax(a.parameters_.*member, b.parameters_.*member);
      result.parameters_.*member = joined == Joined::larger ? most : least;
    }
    bit <<= 1U;
  });
  return result;
}

void StatedContact::state(FrictionLaw law) {
  visit_parameters([&, bit = 1U](const char*, auto member, const auto&, Joined, const char*) mutable {
    if constexpr (std::is_same_v<decltype(member), FrictionLaw ContactParameters::*>)
      parameters_.*member = law, stated_ |= bit;
    bit <<= 1U;
  });
}

void describe(Fields& f, StatedContact& s) {
  visit_parameters(
      [&, bit = 1U](const char* key, auto member, const auto& rule, Joined, const char* doc) mutable {
        std::optional<std::remove_reference_t<decltype(s.parameters_.*member)>> value;
        if ((s.stated_ & bit) != 0) value = s.parameters_.*member;
        f.field(key, value, rule, doc);
        if (f.reading() && value) s.parameters_.*member = *value, s.stated_ |= bit;
        bit <<= 1U;
      });
}

namespace {

/// A list of (temperature, friction).
struct FrictionTable {
  static std::string allowed() {
    return "a list of [degC, friction] with rising temperatures and friction >= 0, e.g. [[20, 30], [280, "
           "0.6]]";
  }
  static void read(const FieldValue& value, std::vector<std::array<double, 2>>& table) {
    if (!value.node.IsSequence() || value.node.size() == 0) value.fail(describe_node(value.node), allowed());
    for (const YAML::Node& row : value.node) {
      std::array<double, 2> entry{};
      bool good = row.IsSequence() && row.size() == 2;
      for (std::size_t i = 0; good && i < 2; ++i)
        good =
            row[i].IsScalar() && YAML::convert<double>::decode(row[i], entry[i]) && std::isfinite(entry[i]);
      if (!good || entry[1] < 0.0 || (!table.empty() && entry[0] <= table.back()[0]))
        value.part(row).fail(describe_node(row), allowed());
      table.push_back(entry);
    }
  }
  static YAML::Node write(const std::vector<std::array<double, 2>>& table) {
    YAML::Node result(YAML::NodeType::Sequence);
    for (const auto& [temperature, friction] : table)
      result.push_back(Numbers{}.write({temperature, friction}));
    return result;
  }
  static KeyInfo info() {
    return {.kind = KeyInfo::Kind::list, .min_items = 1, .items = {Numbers{2}.info()}};
  }
};

Choice<ContactResampling> resampling_words() {
  return {{{"auto", ContactResampling::automatic},
           {"always", ContactResampling::always},
           {"never", ContactResampling::never}}};
}

}  // namespace

void describe(Fields& f, ScenarioContactComponent& s) {
  s.place = f.place("");
  describe(f, s.stated);
  f.field("element_edge_m", s.element_edge_m, not_negative("m"),
          "Longest edge of contact elements; along sharp rims of flat faces they are strips of an eighth of "
          "it. 0: the triangles of the mesh.");
  f.field("resample", s.resample, resampling_words(), "As `resample` of `contact`, for this component.");
  f.field("field_spacing_m", s.field_spacing_m, positive("m"),
          "As `field_spacing_m` of `contact`, for this component.");
  f.field(
      "role", s.role,
      Choice<ContactRole>{
          {{"by_rule", ContactRole::by_rule}, {"base", ContactRole::base}, {"target", ContactRole::target}}},
      "Base: the component carries the contact elements of its pairs; target: the other one does.");
}

void describe(Fields& f, ScenarioContactPair& s) {
  f.field("pair", s.pair, NamePair{}, "Names or patterns of the two components.", kRequired);
  s.place = f.place("pair");
  describe(f, s.stated);
  f.field("force", s.force,
          Choice<PairForce>{{{"contact", PairForce::contact}, {"holding_spring", PairForce::substitute}}},
          "Force between the two at level of detail 3: surface contact, or the spring of levels 1 and 2.");
  f.field("friction_at_degC", s.friction_at_degC, FrictionTable{},
          "Coefficient of friction over the temperature of the hotter of the two, one of which has `heat`.");
  f.field("base", s.base, Text{},
          "The side, one of the two names, that carries the contact elements; else a rule decides.");
  f.check(s.base.empty() || s.base == s.pair[0] || s.base == s.pair[1], "base", "'" + s.base + "'",
          "one of the two names of the pair");
}

void describe(Fields& f, ScenarioContact& s) {
  f.section("defaults", "Parameters of all pairs, as far as no more special statement exists.", s.defaults);
  f.section("grippers", "Parameters of pairs with a gripper.", s.grippers);
  f.field("element_edge_m", s.element_edge_m, not_negative("m"),
          "Longest edge of contact elements; along sharp rims of flat faces they are strips of an eighth of "
          "it. 0: the triangles of the mesh; without it: chosen by the size of each component.");
  f.field(
      "resample", s.resample, resampling_words(),
      "Contact elements are cells of a grid over each flat face, of at most half of element_edge_m, instead "
      "of pieces of the triangles; auto: where that does away with fans of slender elements, with at least "
      "as many elements, and where a face has over four times as many as 32 x 32, or 8 across a strip; not "
      "where element_edge_m is 0.");
  f.field(
      "field_spacing_m", s.field_spacing_m, positive("m"),
      "Spacing of the distance fields of targets; without it an eighth of the walls of each component, at "
      "most 1/64 of its diagonal.");
  f.field("cache_unmoved_pairs", s.cache_unmoved_pairs, Flag{},
          "A pair that has not moved is not evaluated again.", kNotInModel);
  f.field("parallel", s.parallel, Flag{}, "Pairs are evaluated by several threads, where there are any.",
          kNotInModel);
  f.entries("components", s.components,
            "Parameters of components, by name or pattern (*); a jaw is GRIPPER/left_jaw.",
            "Values of both components are joined: the smaller number, of layer depths the larger one.");
  f.list("pairs", s.pairs,
         "Parameters of pairs; of several entries that fit a pair, later ones replace earlier ones.",
         "a list of {pair: [NAME, NAME], ...}");
}

}  // namespace takt
