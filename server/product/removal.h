#pragma once
// Whether one instance of a product can leave along a straight line while another one stays.
#include <map>
#include <tuple>
#include <vector>

#include "server/product/geometry.h"
#include "server/product/product.h"

namespace takt::product {

/// Blocking of pairs by contacts and by the whole way out, after Wilson and Latombe (1992): A is blocked by B along d if a
/// line parallel to d meets B beyond the first point of A on it. Lines lie on a grid of `kGrid` cells across the common
/// shadow of both; blocked cells without blocked neighbours do not count, as facets of curved surfaces and fits overlap
/// by such slivers. Small groups of such cells are looked at with a finer grid, down to what facets overlap. What threads and
/// interference fits overlap around their axis does not block along it. Results are kept.
class Removal {
 public:
  static constexpr int kGrid = 160;
  explicit Removal(const Product& product);

  /// `d`: index of a direction of directions().
  bool blocked(std::size_t a, std::size_t d, std::size_t b);
  /// What blocks A, contacts aside.
  struct Undercut {
    double share = 0.0;  ///< of A's shadow
    double area_m2 = 0.0;
  };
  Undercut undercut(std::size_t a, std::size_t d, std::size_t b);
  /// Axes of the world, normals and axes of contacts, and diagonals, each once.
  const std::vector<Vec3>& directions() const { return directions_; }
  const std::vector<PlacedInstance>& placed() const { return placed_; }

 private:
  struct Shadow {
    double area_m2 = 0.0;  ///< of the blocked cells
    bool blocks = false;
  };
  /// Threads that turn along this direction, and interference fits that are pressed along it.
  std::vector<const Contact*> joints(std::size_t a, std::size_t b, const Vec3& d) const;
  Shadow shadow(std::size_t a, const Vec3& d, std::size_t b) const;
  bool blocked_by_contact(std::size_t a, const Vec3& d, std::size_t b) const;
  double deflection(std::size_t i) const { return product_.bodies[product_.instances[i].body].deflection_m; }
  const std::vector<const Contact*>& contacts_of(std::size_t a, std::size_t b) const;

  const Product& product_;
  const std::vector<PlacedInstance> placed_;
  std::vector<Vec3> directions_;
  std::map<std::pair<std::size_t, std::size_t>, std::vector<const Contact*>> contacts_;
  std::map<std::tuple<std::size_t, std::size_t, std::size_t>, Shadow> known_;
  std::map<std::pair<std::size_t, std::size_t>, double> own_m2_;  ///< shadow of an instance along a direction
};

}  // namespace takt::product
