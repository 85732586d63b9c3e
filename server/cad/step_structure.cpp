#include "server/cad/step_structure.h"

#include <StepBasic_Product.hxx>
#include <StepBasic_ProductDefinition.hxx>
#include <StepBasic_ProductDefinitionFormation.hxx>
#include <StepRepr_NextAssemblyUsageOccurrence.hxx>
#include <TCollection_HAsciiString.hxx>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

namespace takt::cad {

namespace {

std::string name_of(const Interface_InterfaceModel& model,
                    const Handle(StepBasic_ProductDefinition) & definition) {
  const auto formation = definition->Formation();
  const auto product =
      formation.IsNull() ? Handle(StepBasic_Product)() : Handle(StepBasic_Product)(formation->OfProduct());
  if (!product.IsNull() && !product->Name().IsNull() && product->Name()->Length() > 0)
    return product->Name()->ToCString();
  return model.StringLabel(definition)->ToCString();
}

}  // namespace

StepStructure structure_of(const Interface_InterfaceModel& model) {
  StepStructure result;
  const auto name = [&](int number) {
    return name_of(model, Handle(StepBasic_ProductDefinition)::DownCast(model.Value(number)));
  };
  std::map<int, std::vector<int>> uses;  // by number of the product definition
  for (int i = 1; i <= model.NbEntities(); ++i) {
    const auto use = Handle(StepRepr_NextAssemblyUsageOccurrence)::DownCast(model.Value(i));
    if (use.IsNull() || use->RelatingProductDefinition().IsNull() || use->RelatedProductDefinition().IsNull())
      continue;
    uses[model.Number(use->RelatingProductDefinition())].push_back(
        model.Number(use->RelatedProductDefinition()));
  }
  enum class Visit { none, open, done };
  std::map<int, Visit> visits;
  std::map<int, double> totals;  // uses in an assembly
  for (const auto& start : uses) {
    std::vector<std::pair<int, std::size_t>> way;  // assembly, and which of its uses comes next
    const auto enter = [&](int assembly) {
      visits[assembly] = Visit::open;
      way.emplace_back(assembly, 0);
    };
    if (visits[start.first] == Visit::none) enter(start.first);
    while (!way.empty()) {
      auto& [assembly, next] = way.back();
      const auto found = uses.find(assembly);
      if (found == uses.end() || next == found->second.size()) {
        visits[assembly] = Visit::done;
        double& total = totals[assembly];
        if (found != uses.end())
          for (const int used : found->second) total += 1.0 + totals[used];
        if (total > result.uses) result.uses = total, result.largest = name(assembly);
        way.pop_back();
        continue;
      }
      const int used = found->second[next++];
      if (visits[used] == Visit::open) {
        result.cyclic = name(used);
        return result;
      }
      if (visits[used] == Visit::none) enter(used);
    }
  }
  return result;
}

}  // namespace takt::cad
