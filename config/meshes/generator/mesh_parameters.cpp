#include "config/meshes/generator/mesh_parameters.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <ostream>
#include <stdexcept>
#include <type_traits>
#include <variant>

#include "idl/common/parse.h"
#include "idl/common/text.h"

namespace takt::meshes {

namespace {

/// Of one of the groups; lengths in m.
struct Parameter {
  const char* name;
  std::variant<double ChainsawParameters::*, int ChainsawParameters::*, double RotorParameters::*,
               int RotorParameters::*>
      member;
  double lower, upper;
  const char* what;
};

using C = ChainsawParameters;
using R = RotorParameters;

const std::array<Parameter, 21> kParameters{{
    {"chainsaw.boss_radius", &C::boss_radius, 0.008, 0.014, "of the motor's boss (m)"},
    {"chainsaw.interference", &C::interference, -1e-3, 2e-4, "radial, boss in seat; negative: clearance (m)"},
    {"chainsaw.boss_chamfer", &C::boss_chamfer, 1e-4, 3e-3, "(m)"},
    {"chainsaw.seat_chamfer", &C::seat_chamfer, 1e-4, 3e-3, "(m)"},
    {"chainsaw.seat_depth", &C::seat_depth, 0.013, 0.020, "of the bore (m)"},
    {"chainsaw.nest_clearance", &C::nest_clearance, 1e-5, 2e-3, "of the boss in the box, per side (m)"},
    {"chainsaw.cavity_clearance", &C::cavity_clearance, 1e-4, 5e-3,
     "of the flange in the housing, radial (m)"},
    {"chainsaw.motor_facets", &C::motor_facets, 16, 400, "flats around"},
    {"chainsaw.housing_facets", &C::housing_facets, 60, 1200, "flats around"},
    {"chainsaw.contact_edge", &C::contact_edge, 2e-4, 5e-3, "of elements along the bore (m)"},
    {"rotor.radius", &R::radius, 0.09, 0.15, "of the core (m)"},
    {"rotor.height", &R::height, 0.10, 0.40, "of the core (m)"},
    {"rotor.shaft_radius", &R::shaft_radius, 0.01, 0.05, "of the core's bore (m)"},
    {"rotor.slots", &R::slots, 3, 12, "for magnets"},
    {"rotor.slot_radius", &R::slot_radius, 0.06, 0.08, "of the slots' inner faces (m)"},
    {"rotor.magnet_width", &R::magnet_width, 0.005, 0.030, "tangential (m)"},
    {"rotor.magnet_thickness", &R::magnet_thickness, 0.002, 0.010, "radial (m)"},
    {"rotor.magnet_length", &R::magnet_length, 0.01, 0.20, "(m)"},
    {"rotor.clearance", &R::clearance, -1e-4, 1e-3, "of a magnet, per side; negative: interference (m)"},
    {"rotor.contact_edge", &R::contact_edge, 5e-4, 1e-2, "of elements of magnet and slot (m)"},
    {"rotor.magnet_chamfer", &R::magnet_chamfer, 1e-4, 2e-3, "of its ends (m)"},
}};

/// Calls `use` with a reference to the value.
template <typename Parameters, typename Use>
void with_value(Parameters& parameters, const Parameter& parameter, const Use& use) {
  if (const auto* length = std::get_if<double C::*>(&parameter.member)) use(parameters.chainsaw.**length);
  if (const auto* count = std::get_if<int C::*>(&parameter.member)) use(parameters.chainsaw.**count);
  if (const auto* length = std::get_if<double R::*>(&parameter.member)) use(parameters.rotor.**length);
  if (const auto* count = std::get_if<int R::*>(&parameter.member)) use(parameters.rotor.**count);
}

}  // namespace

void set_parameter(CellParameters& parameters, const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string name = text.substr(0, equals);
  for (const Parameter& parameter : kParameters) {
    if (equals == std::string::npos || name != parameter.name) continue;
    const std::string given = text.substr(equals + 1);
    const auto value = finite_number(given);
    const bool in_range = value && *value >= parameter.lower && *value <= parameter.upper;
    const bool counts = std::holds_alternative<int C::*>(parameter.member) ||
                        std::holds_alternative<int R::*>(parameter.member);
    if (!in_range || (counts && *value != std::round(*value)))
      throw std::invalid_argument("--set " + name + ": found '" + given + "'; allowed: a " +
                                  (counts ? "whole number" : "number") + " from " +
                                  number_text(parameter.lower, 6) + " to " + number_text(parameter.upper, 6));
    with_value(parameters, parameter, [value](auto& member) {
      member = static_cast<std::remove_reference_t<decltype(member)>>(*value);
    });
    return;
  }
  throw std::invalid_argument("--set: found '" + text + "'; allowed: NAME=VALUE with NAME one of " +
                              list_names(kParameters));
}

void list_parameters(std::ostream& out, const CellParameters& parameters) {
  for (const Parameter& parameter : kParameters)
    with_value(parameters, parameter, [&](const auto& value) {
      out << parameter.name << '=' << number_text(static_cast<double>(value), 6) << "  " << parameter.what
          << ", " << number_text(parameter.lower, 6) << " to " << number_text(parameter.upper, 6) << '\n';
    });
}

}  // namespace takt::meshes
