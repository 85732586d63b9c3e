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
               int RotorParameters::*, double ScrewParameters::*, int ScrewParameters::*,
               double GearParameters::*, int GearParameters::*, double CapScrewParameters::*,
               int CapScrewParameters::*, double LampParameters::*, int LampParameters::*>
      member;
  double lower, upper;
  const char* what;
};

using C = ChainsawParameters;
using R = RotorParameters;
using S = ScrewParameters;
using G = GearParameters;
using D = CapScrewParameters;
using L = LampParameters;

const std::array<Parameter, 55> kParameters{{
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
    {"screw.diameter", &S::diameter, 0.002, 0.1, "nominal (m)"},
    {"screw.pitch", &S::pitch, 2e-4, 0.006, "of the thread (m)"},
    {"screw.clearance", &S::clearance, -1e-4, 1e-3, "radial, between the profiles of bolt and nut (m)"},
    {"screw.length", &S::length, 0.001, 0.3, "of the bolt's thread (m)"},
    {"screw.head_height", &S::head_height, 0.001, 0.1, "(m)"},
    {"screw.across_flats", &S::across_flats, 0.003, 0.2, "of head and nut (m)"},
    {"screw.nut_height", &S::nut_height, 0.001, 0.1, "(m)"},
    {"screw.spacer_height", &S::spacer_height, 0.001, 0.2, "of the ring between head and nut (m)"},
    {"screw.contact_edge", &S::contact_edge, 2e-5, 5e-3, "of elements up and down the flanks (m)"},
    {"screw.bolt_columns", &S::bolt_columns, 12, 1200, "vertices around, a multiple of 12"},
    {"screw.nut_columns", &S::nut_columns, 12, 1200, "vertices around, a multiple of 12"},
    {"gear.module", &G::module, 2e-4, 0.02, "pitch diameter per tooth (m)"},
    {"gear.width", &G::width, 0.001, 0.2, "of the teeth (m)"},
    {"gear.bore_radius", &G::bore_radius, 5e-4, 0.2, "(m)"},
    {"gear.backlash", &G::backlash, -1e-4, 1e-3, "by which each tooth is thinner on the pitch circle (m)"},
    {"gear.pin_clearance", &G::pin_clearance, -1e-5, 1e-3, "radial, of the pin in the bore (m)"},
    {"gear.contact_edge", &G::contact_edge, 2e-5, 1e-2, "of elements along flanks and width (m)"},
    {"gear.pinion_teeth", &G::pinion_teeth, 8, 200, "(number)"},
    {"gear.wheel_teeth", &G::wheel_teeth, 8, 400, "(number)"},
    {"cap_screw.diameter", &D::diameter, 0.002, 0.1, "nominal (m)"},
    {"cap_screw.pitch", &D::pitch, 2e-4, 0.006, "of the thread (m)"},
    {"cap_screw.clearance", &D::clearance, 0.0, 1e-3, "radial, between the profiles of screw and hole (m)"},
    {"cap_screw.length", &D::length, 0.001, 0.3, "of the thread, from the head (m)"},
    {"cap_screw.head_height", &D::head_height, 0.001, 0.1, "(m)"},
    {"cap_screw.recess_across_flats", &D::recess_across_flats, 0.001, 0.1, "of the hexagon socket (m)"},
    {"cap_screw.recess_depth", &D::recess_depth, 5e-4, 0.05, "of the hexagon socket (m)"},
    {"cap_screw.bit_clearance", &D::bit_clearance, 0.0, 5e-4, "of the bit in the socket, per side (m)"},
    {"cap_screw.hole_depth", &D::hole_depth, 0.001, 0.2, "of the tapped hole (m)"},
    {"cap_screw.contact_edge", &D::contact_edge, 2e-5, 5e-3, "of elements up and down the flanks (m)"},
    {"cap_screw.columns", &D::columns, 12, 1200, "vertices around, a multiple of 12"},
    {"lamp.pitch", &L::pitch, 0.001, 0.01, "of the round thread (m)"},
    {"lamp.clearance", &L::clearance, 0.0, 1e-3, "radial, of the cap in the socket (m)"},
    {"lamp.contact_edge", &L::contact_edge, 5e-5, 5e-3, "of elements up and down the flanks (m)"},
    {"lamp.columns", &L::columns, 12, 1200, "vertices around"},
}};

/// Calls `use` with a reference to the value.
template <typename Parameters, typename Use>
void with_value(Parameters& parameters, const Parameter& parameter, const Use& use) {
  const auto in = [&](auto& group, auto length, auto count) {
    if (const auto* member = std::get_if<decltype(length)>(&parameter.member)) use(group.**member);
    if (const auto* member = std::get_if<decltype(count)>(&parameter.member)) use(group.**member);
  };
  in(parameters.chainsaw, static_cast<double C::*>(nullptr), static_cast<int C::*>(nullptr));
  in(parameters.rotor, static_cast<double R::*>(nullptr), static_cast<int R::*>(nullptr));
  in(parameters.screw, static_cast<double S::*>(nullptr), static_cast<int S::*>(nullptr));
  in(parameters.gear, static_cast<double G::*>(nullptr), static_cast<int G::*>(nullptr));
  in(parameters.cap_screw, static_cast<double D::*>(nullptr), static_cast<int D::*>(nullptr));
  in(parameters.lamp, static_cast<double L::*>(nullptr), static_cast<int L::*>(nullptr));
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
    bool counts = false;
    with_value(parameters, parameter, [&](auto& member) {
      counts = std::is_same_v<std::remove_reference_t<decltype(member)>, int>;
    });
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
