#include "server/geometry/convex/convex_parts.h"

#include <utility>

namespace takt {

namespace {

BodyBox bounding_box(const std::vector<ConvexShape>& shapes) {
  if (shapes.empty()) return {};
  Vec3 lower = shapes.front().box.center_B - shapes.front().box.half_B;
  Vec3 upper = shapes.front().box.center_B + shapes.front().box.half_B;
  for (const ConvexShape& shape : shapes) {
    lower = lower.cwiseMin(shape.box.center_B - shape.box.half_B);
    upper = upper.cwiseMax(shape.box.center_B + shape.box.half_B);
  }
  return {0.5 * (lower + upper), 0.5 * (upper - lower)};
}

}  // namespace

const std::shared_ptr<const ConvexParts::Made>& ConvexParts::none() {
  static const auto empty = std::make_shared<const Made>();
  return empty;
}

ConvexParts::ConvexParts(std::vector<ConvexShape> shapes) {
  auto made = std::make_shared<Made>();
  made->shapes = std::move(shapes);
  made->tree = ShapeTree(made->shapes);
  made->box = bounding_box(made->shapes);
  made_ = std::move(made);
}

}  // namespace takt
