#pragma once
// The order in which a product is taken apart; backwards it is assembled.
#include <string>
#include <vector>

#include "server/product/product.h"

namespace takt::product {

class Removal;

/// How parts are loosened.
enum class Loosening { lift, unscrew, pull, unsnap };

/// One removal: these parts leave together.
struct RemovalStep {
  std::vector<std::size_t> parts;  ///< instances
  Vec3 direction_W = Vec3::UnitZ();
  Loosening loosening = Loosening::lift;
  std::string reason;  ///< of the loosening: one phrase; empty for lift
};

struct Disassembly {
  std::size_t base = 0;            ///< the instance that stays
  std::vector<RemovalStep> steps;  ///< in their order; subassemblies are taken apart after they have left
  std::vector<std::size_t> order;  ///< instances in the order in which each is alone; the base is last
  std::vector<std::vector<std::size_t>> stuck;  ///< groups that no straight motion parts
  std::vector<std::size_t>
      on_pads;  ///< instances that the support holds although contacts or posts seem to: a run showed that they fall
};

/// The base is the heaviest instance, of about equal ones the lowest; another one of at least a quarter of its mass if
/// nothing can stand under the heaviest. Next is what leaves on its own, in this order of preference: what lets no other part
/// fall, fasteners (threads), what opens a contact rather than slides along it, along +z, along other directions, the
/// lighter one. If none can, it is the smallest group that leaves together. A part held by undercuts that cover a small
/// share of its shadow is unsnapped, the one with the smallest undercut first: the least has to give way. The contacts of that
/// pair get the kind `snap`.
Disassembly take_apart(Product& product);

/// The contact holds its first instance (else its second) against gravity.
bool carries(const Contact& contact, bool first);

/// Numbers for the partner search by order of disassembly: one more than the largest number of the touching parts that
/// leave earlier, so that each part touches one of a larger number that leaves later. Those that do not: `floating`.
struct Hierarchy {
  std::vector<int> numbers;           ///< by instance
  std::vector<std::size_t> floating;  ///< instances without a path to the base
};
Hierarchy hierarchy(const Product& product, const Disassembly& plan);

const char* to_string(Loosening loosening);
const char* to_string(ContactKind kind);

}  // namespace takt::product
