#include "server/cad/step_densities.h"

#include <STEPConstruct_UnitContext.hxx>
#include <StepBasic_ConversionBasedUnit.hxx>
#include <StepBasic_ConversionBasedUnitAndLengthUnit.hxx>
#include <StepBasic_ConversionBasedUnitAndMassUnit.hxx>
#include <StepBasic_DerivedUnit.hxx>
#include <StepBasic_DerivedUnitElement.hxx>
#include <StepBasic_HArray1OfDerivedUnitElement.hxx>
#include <StepBasic_MeasureWithUnit.hxx>
#include <StepBasic_SiUnitAndLengthUnit.hxx>
#include <StepBasic_SiUnitAndMassUnit.hxx>
#include <StepBasic_Unit.hxx>
#include <StepRepr_MeasureRepresentationItem.hxx>
#include <TCollection_HAsciiString.hxx>
#include <cmath>

#include "idl/common/text.h"

namespace takt::cad {

namespace {

using NamedUnit = Handle(StepBasic_NamedUnit);

/// In m or g; 0: not known.
double size_of(const NamedUnit& unit, int depth = 0) {
  constexpr int kDeepest = 5;
  if (unit.IsNull() || depth > kDeepest) return 0.0;
  if (const auto si = Handle(StepBasic_SiUnit)::DownCast(unit); !si.IsNull())
    return si->HasPrefix() ? STEPConstruct_UnitContext::ConvertSiPrefix(si->Prefix()) : 1.0;
  const auto based = Handle(StepBasic_ConversionBasedUnit)::DownCast(unit);
  if (based.IsNull() || based->ConversionFactor().IsNull()) return 0.0;
  const auto factor = based->ConversionFactor();
  return factor->ValueComponent() * size_of(factor->UnitComponent().NamedUnit(), depth + 1);
}

bool is_mass(const NamedUnit& unit) {
  return unit->IsKind(STANDARD_TYPE(StepBasic_SiUnitAndMassUnit)) ||
         unit->IsKind(STANDARD_TYPE(StepBasic_ConversionBasedUnitAndMassUnit));
}

bool is_length(const NamedUnit& unit) {
  return unit->IsKind(STANDARD_TYPE(StepBasic_SiUnitAndLengthUnit)) ||
         unit->IsKind(STANDARD_TYPE(StepBasic_ConversionBasedUnitAndLengthUnit));
}

/// One of a mass and a length in g/cm^3; 0: another one.
double density_of(const StepBasic_DerivedUnit& unit) {
  double mass_g = 0.0, length_m = 0.0;
  for (int i = 1; i <= unit.NbElements(); ++i) {
    const NamedUnit one = unit.ElementsValue(i)->Unit();
    if (one.IsNull()) return 0.0;
    if (is_mass(one))
      mass_g = size_of(one);
    else if (is_length(one))
      length_m = size_of(one);
    else
      return 0.0;
  }
  return length_m > 0.0 ? mass_g / std::pow(100.0 * length_m, 3) : 0.0;
}

Handle(StepBasic_DerivedUnitElement) element(const NamedUnit& unit, double exponent) {
  Handle(StepBasic_DerivedUnitElement) made = new StepBasic_DerivedUnitElement;
  made->Init(unit, exponent);
  return made;
}

Handle(StepBasic_DerivedUnit) g_per_cm3() {
  const Handle(StepBasic_SiUnitAndMassUnit) gram = new StepBasic_SiUnitAndMassUnit;
  gram->Init(false, StepBasic_spKilo, StepBasic_sunGram);
  const Handle(StepBasic_SiUnitAndLengthUnit) centimetre = new StepBasic_SiUnitAndLengthUnit;
  centimetre->Init(true, StepBasic_spCenti, StepBasic_sunMetre);
  const Handle(StepBasic_HArray1OfDerivedUnitElement) elements =
      new StepBasic_HArray1OfDerivedUnitElement(1, 2);
  elements->SetValue(1, element(gram, 1.0));
  elements->SetValue(2, element(centimetre, -3.0));
  Handle(StepBasic_DerivedUnit) made = new StepBasic_DerivedUnit;
  made->Init(elements);
  return made;
}

}  // namespace

void state_densities_in_g_per_cm3(const Interface_InterfaceModel& model) {
  for (int i = 1; i <= model.NbEntities(); ++i) {
    const auto item = Handle(StepRepr_MeasureRepresentationItem)::DownCast(model.Value(i));
    if (item.IsNull() || item->Name().IsNull() || item->Measure().IsNull()) continue;
    if (lower_text(item->Name()->ToCString()).find("dens") == std::string::npos) continue;
    const auto measure = item->Measure();
    const auto unit = measure->UnitComponent().DerivedUnit();
    const double density = unit.IsNull() ? 0.0 : density_of(*unit);
    if (!(density > 0.0)) continue;
    measure->SetValueComponent(measure->ValueComponent() * density);
    StepBasic_Unit stated;
    stated.SetValue(g_per_cm3());
    measure->SetUnitComponent(stated);
  }
}

}  // namespace takt::cad
