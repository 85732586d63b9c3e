#pragma once
// The convex parts of one mesh and the hierarchy of their boxes: made once, constant, and shared by all
// components and simulations that have them.
#include <initializer_list>
#include <memory>
#include <vector>

#include "server/geometry/convex/convex_shape.h"
#include "server/geometry/convex/shape_tree.h"

namespace takt {

/// A handle: copies share the same parts.
class ConvexParts {
 public:
  ConvexParts() = default;
  // Implicit: a list of shapes is a set of parts.
  ConvexParts(std::vector<ConvexShape> shapes);  // NOLINT(google-explicit-constructor)
  ConvexParts(std::initializer_list<ConvexShape> shapes) : ConvexParts(std::vector<ConvexShape>(shapes)) {}

  const std::vector<ConvexShape>& shapes() const { return made_->shapes; }
  const ShapeTree& tree() const { return made_->tree; }
  const BodyBox& box() const { return made_->box; }  ///< bounds of all shapes

  std::size_t size() const { return shapes().size(); }
  bool empty() const { return shapes().empty(); }
  const ConvexShape& operator[](std::size_t i) const { return shapes()[i]; }
  auto begin() const { return shapes().begin(); }
  auto end() const { return shapes().end(); }

 private:
  struct Made {
    std::vector<ConvexShape> shapes;
    ShapeTree tree;
    BodyBox box;
  };
  static const std::shared_ptr<const Made>& none();

  std::shared_ptr<const Made> made_ = none();
};

}  // namespace takt
