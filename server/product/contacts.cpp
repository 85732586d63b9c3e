#include "server/product/contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "idl/common/text.h"
#include "server/geometry/segment_distance.h"
#include "server/product/geometry.h"
#include "server/product/names.h"
#include "server/product/overlaps.h"

namespace takt::product {

namespace {

constexpr double kParallel = 1e-4;  ///< of the sine between two directions
constexpr double kTurn = 2.0 * std::numbers::pi;

using Vec2 = Eigen::Vector2d;

double cross2(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// Area and centre of the common part of two triangles (counter-clockwise), by clipping (Sutherland, Hodgman 1974).
double common_area(const std::array<Vec2, 3>& a, const std::array<Vec2, 3>& b, Vec2& centre) {
  std::array<Vec2, 12> polygon, next;
  std::size_t count = 3;
  std::copy(a.begin(), a.end(), polygon.begin());
  for (std::size_t e = 0; e < 3 && count > 0; ++e) {
    const Vec2& from = b[e];
    const Vec2 edge = b[(e + 1) % 3] - from;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec2 &p = polygon[i], &q = polygon[(i + 1) % count];
      const double at_p = cross2(edge, p - from), at_q = cross2(edge, q - from);
      if (at_p >= 0.0) next[kept++] = p;
      if ((at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0))
        next[kept++] = p + (q - p) * (at_p / (at_p - at_q));
    }
    polygon = next;
    count = kept;
  }
  double area = 0.0;
  centre = Vec2::Zero();
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const double part = 0.5 * cross2(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
    area += part;
    centre += part * (polygon[0] + polygon[i] + polygon[i + 1]) / 3.0;
  }
  if (area > 0.0) centre /= area;
  return area;
}

/// Nominal diameters and pitches of ISO 261, coarse series (mm).
constexpr std::array<std::pair<double, double>, 19> kSeries{{{2, 0.4},
                                                             {2.5, 0.45},
                                                             {3, 0.5},
                                                             {4, 0.7},
                                                             {5, 0.8},
                                                             {6, 1.0},
                                                             {8, 1.25},
                                                             {10, 1.5},
                                                             {12, 1.75},
                                                             {14, 2.0},
                                                             {16, 2.0},
                                                             {18, 2.5},
                                                             {20, 2.5},
                                                             {22, 2.5},
                                                             {24, 3.0},
                                                             {27, 3.0},
                                                             {30, 3.5},
                                                             {36, 4.0},
                                                             {42, 4.5}}};

/// Nominal diameter and pitch (mm) of the nearest one.
const std::pair<double, double>& nearest_thread(double diameter_m) {
  const auto nearest = std::min_element(kSeries.begin(), kSeries.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.first - diameter_m * 1e3) < std::abs(b.first - diameter_m * 1e3);
  });
  return *nearest;
}

/// A shaft of nominal diameter in a hole between the minor diameter of the thread (d - 1.083 P, ISO 724) and that of the drill for
/// it (d - P).
bool is_tapped(double shaft_m, double hole_m, double pitch_m) {
  constexpr double kExact_m = 1e-5, kRounded = 0.03;  // of the pitch
  const double nominal_m = 1e-3 * nearest_thread(shaft_m).first;
  return std::abs(shaft_m - nominal_m) < kExact_m && hole_m > nominal_m - (1.083 + kRounded) * pitch_m &&
         hole_m < nominal_m - (1.0 - kRounded) * pitch_m;
}

class Finder {
 public:
  Finder(const Product& product, const ContactTolerances& tolerances)
      : product_(product), tolerances_(tolerances), placed_(place(product)) {
    for (const Instance& instance : product.instances) {
      const std::string& body = product.bodies[instance.body].name;
      insert_.push_back(is_threaded_insert(instance.name) || is_threaded_insert(body));
      nut_.push_back(is_nut(instance.name) || is_nut(body));
      fastener_.push_back(nut_.back() || is_screw(instance.name) || is_screw(body));
    }
  }

  std::vector<Contact> find() {
    for (std::size_t i = 0; i < placed_.size(); ++i)
      for (std::size_t j = i + 1; j < placed_.size(); ++j)
        if (near(placed_[i].box, placed_[j].box, tolerances_.largest_clearance_m)) find_pair(i, j);
    find_loose();
    find_embedded();
    std::sort(contacts_.begin(), contacts_.end(), [](const Contact& a, const Contact& b) {
      return std::tuple(a.first, a.second, a.kind, -a.area_m2) <
             std::tuple(b.first, b.second, b.kind, -b.area_m2);
    });
    return std::move(contacts_);
  }

 private:
  /// By instance: it touches nothing.
  std::vector<bool> alone() const {
    std::vector<bool> result(placed_.size(), true);
    for (const Contact& contact : contacts_) result[contact.first] = result[contact.second] = false;
    return result;
  }

  /// Calls `visit(i, j)` for the pairs whose boxes are that near and of which one touches nothing.
  template <class Visit>
  void for_pairs_alone(double gap_m, Visit visit) const {
    const std::vector<bool> alone = this->alone();
    for (std::size_t i = 0; i < placed_.size(); ++i)
      for (std::size_t j = i + 1; j < placed_.size(); ++j)
        if ((alone[i] || alone[j]) && near(placed_[i].box, placed_[j].box, gap_m)) visit(i, j);
  }

  /// What touches nothing lies in its place with play: planes near it hold it.
  void find_loose() {
    plane_gap_m_ = tolerances_.largest_clearance_m;
    for_pairs_alone(plane_gap_m_, [&](std::size_t i, std::size_t j) { find_pair(i, j); });
  }

  /// What touches nothing and stands inside another part is held by it: a magnet in its pocket, a chip in its board.
  void find_embedded() {
    std::set<std::pair<std::size_t, std::size_t>> pairs;
    for_pairs_alone(0.0, [&](std::size_t i, std::size_t j) { pairs.emplace(i, j); });
    if (pairs.empty()) return;
    for (const PartOverlap& overlap : find_overlaps(product_)) {
      if (!pairs.contains({overlap.first, overlap.second})) continue;
      Contact contact;
      contact.first = overlap.first, contact.second = overlap.second;
      contact.clearance_m = -overlap.depth_m;
      contact.point_W = overlap.point_W;
      // The heavier part carries the other one.
      const bool carried = placed_[overlap.first].mass_kg < placed_[overlap.second].mass_kg;
      contact.normals_W = {carried ? Vec3(-Vec3::UnitZ()) : Vec3(Vec3::UnitZ())};
      contacts_.push_back(std::move(contact));
    }
  }

  void find_pair(std::size_t i, std::size_t j) {
    found_.clear();
    for (const PlacedFace& a : placed_[i].faces) {
      if (!near(a.box, placed_[j].box, tolerances_.largest_clearance_m)) continue;
      for (const PlacedFace& b : placed_[j].faces) {
        if (!near(a.box, b.box, tolerances_.largest_clearance_m)) continue;
        if (auto contact = touch(a, b, i, j)) add(std::move(*contact));
      }
    }
    for (Contact& contact : found_) {
      if (contact.area_m2 < tolerances_.least_area_m2) continue;
      contact.first = i, contact.second = j;
      contact.point_W /= contact.area_m2;
      contacts_.push_back(std::move(contact));
    }
  }

  /// Contacts of one kind on one plane or axis are one. `point_W` is summed with the area as weight until then.
  void add(Contact contact) {
    contact.point_W *= contact.area_m2;
    for (Contact& known : found_) {
      if (known.kind != contact.kind || known.axis_W.cross(contact.axis_W).norm() > kParallel) continue;
      const Vec3 apart = contact.point_W / contact.area_m2 - known.point_W / known.area_m2;
      const bool same =
          contact.kind == ContactKind::other ||
          (contact.kind == ContactKind::plane ? known.axis_W.dot(contact.axis_W) > 0.0 &&
                                                    std::abs(apart.dot(known.axis_W)) < 2.0 * plane_gap_m_
                                              : apart.cross(known.axis_W).norm() < 1e-3 &&
                                                    std::abs(known.clearance_m - contact.clearance_m) < 2e-5);
      if (!same) continue;
      known.area_m2 += contact.area_m2;
      known.radius_m = std::max(known.radius_m, contact.radius_m);
      known.point_W += contact.point_W;
      for (const Vec3& n : contact.normals_W) add_normal(known.normals_W, n);
      return;
    }
    found_.push_back(std::move(contact));
  }

  static void add_normal(std::vector<Vec3>& normals, const Vec3& n) {
    constexpr double kSame = 0.9998;  // 1 degree
    for (const Vec3& known : normals)
      if (known.dot(n) > kSame) return;
    normals.push_back(n);
  }

  std::optional<Contact> touch(const PlacedFace& a, const PlacedFace& b, std::size_t i, std::size_t j) const {
    const SurfaceKind ka = a.face.kind, kb = b.face.kind;
    if (ka == SurfaceKind::plane && kb == SurfaceKind::plane) return planes(a, b);
    if (ka == SurfaceKind::cylinder && kb == SurfaceKind::cylinder) return cylinders(a, b, i, j);
    if (ka == SurfaceKind::helix && kb == SurfaceKind::helix) return helices(a, b);
    if (ka == SurfaceKind::plane || kb == SurfaceKind::plane) {
      // A curved surface touches a plane in a line or point, which is no surface.
      if (ka == SurfaceKind::cylinder || kb == SurfaceKind::cylinder || ka == SurfaceKind::cone ||
          kb == SurfaceKind::cone || ka == SurfaceKind::sphere || kb == SurfaceKind::sphere)
        return std::nullopt;
    }
    return surfaces(a, b, deflection(i) + deflection(j));
  }

  double deflection(std::size_t i) const { return product_.bodies[product_.instances[i].body].deflection_m; }

  std::optional<Contact> planes(const PlacedFace& a, const PlacedFace& b) const {
    const Vec3& n = a.face.axis_B;
    if (n.dot(b.face.axis_B) > -1.0 + 0.5 * kParallel * kParallel * 100.0) return std::nullopt;
    const double gap = (b.face.point_B - a.face.point_B).dot(n);
    if (std::abs(gap) > plane_gap_m_) return std::nullopt;
    const Vec3 x = n.unitOrthogonal(), y = n.cross(x);
    const auto flat = [&](const Triangle& t) {
      std::array<Vec2, 3> p;
      for (std::size_t k = 0; k < 3; ++k) p[k] = Vec2(t[k].dot(x), t[k].dot(y));
      if (cross2(p[1] - p[0], p[2] - p[0]) < 0.0) std::swap(p[1], p[2]);
      return p;
    };
    std::vector<std::array<Vec2, 3>> others;
    for (const Triangle& t : b.triangles) others.push_back(flat(t));
    Contact contact;
    contact.kind = ContactKind::plane;
    contact.clearance_m = gap;
    contact.axis_W = n;
    contact.normals_W = {n};
    Vec2 sum = Vec2::Zero();
    for (const Triangle& t : a.triangles) {
      const auto one = flat(t);
      const Vec2 lower = one[0].cwiseMin(one[1]).cwiseMin(one[2]),
                 upper = one[0].cwiseMax(one[1]).cwiseMax(one[2]);
      for (const auto& other : others) {
        if ((other[0].cwiseMin(other[1]).cwiseMin(other[2]).array() > upper.array()).any() ||
            (other[0].cwiseMax(other[1]).cwiseMax(other[2]).array() < lower.array()).any())
          continue;
        Vec2 centre;
        const double area = common_area(one, other, centre);
        contact.area_m2 += area;
        sum += area * centre;
      }
    }
    if (!(contact.area_m2 > tolerances_.least_area_m2 * 0.1)) return std::nullopt;
    sum /= contact.area_m2;
    contact.point_W = sum.x() * x + sum.y() * y + a.face.point_B.dot(n) * n;
    return contact;
  }

  static constexpr int kAround = 72, kAlong = 24;
  static std::size_t cell_of(int around, int along) {
    return static_cast<std::size_t>(around) * kAlong + static_cast<std::size_t>(along);
  }

  /// Which cells of a grid around and along the axis the face covers.
  static std::vector<char> covered(const PlacedFace& f, const Vec3& origin, const Vec3& axis, double from,
                                   double to) {
    std::vector<char> cells(cell_of(kAround, 0), 0);
    const Vec3 x = axis.unitOrthogonal(), y = axis.cross(x);
    for (const Triangle& t : f.triangles) {
      std::array<Vec2, 3> p;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 r = t[k] - origin;
        p[k].x() = std::atan2(r.dot(y), r.dot(x));
        if (k > 0) p[k].x() = p[0].x() + std::remainder(p[k].x() - p[0].x(), kTurn);
        p[k].y() = r.dot(axis);
      }
      if (cross2(p[1] - p[0], p[2] - p[0]) < 0.0) std::swap(p[1], p[2]);
      const double lowest = std::min({p[0].x(), p[1].x(), p[2].x()}),
                   highest = std::max({p[0].x(), p[1].x(), p[2].x()});
      const int first = static_cast<int>(std::ceil(lowest / kTurn * kAround - 0.5));
      const int last = static_cast<int>(std::floor(highest / kTurn * kAround - 0.5));
      for (int u = first; u <= last; ++u) {
        for (int v = 0; v < kAlong; ++v) {
          const Vec2 at((u + 0.5) * kTurn / kAround, from + (to - from) * (v + 0.5) / kAlong);
          bool inside = true;
          for (std::size_t e = 0; e < 3; ++e)
            inside = inside && cross2(p[(e + 1) % 3] - p[e], at - p[e]) >= -1e-12;
          if (inside) cells[cell_of(((u % kAround) + kAround) % kAround, v)] = 1;
        }
      }
    }
    return cells;
  }

  /// Of both faces: range along the axis.
  static std::pair<double, double> range(const PlacedFace& f, const Vec3& origin, const Vec3& axis) {
    double from = 1e300, to = -1e300;
    for (const Triangle& t : f.triangles)
      for (const Vec3& p : t)
        from = std::min(from, (p - origin).dot(axis)), to = std::max(to, (p - origin).dot(axis));
    return {from, to};
  }

  /// The common cells of two faces around one axis: area, centre, and normals of the first face away from the axis
  /// (`sign` 1) or towards it.
  std::optional<Contact> around(const PlacedFace& a, const PlacedFace& b, double radius, double sign) const {
    const Vec3 origin = a.face.point_B, axis = a.face.axis_B;
    const auto [a_from, a_to] = range(a, origin, axis);
    const auto [b_from, b_to] = range(b, origin, axis);
    const double from = std::max(a_from, b_from), to = std::min(a_to, b_to);
    constexpr double kLeastLength_m = 1e-4;
    if (to - from < kLeastLength_m) return std::nullopt;
    const auto first = covered(a, origin, axis, from, to), second = covered(b, origin, axis, from, to);
    Contact contact;
    contact.axis_W = axis;
    const Vec3 x = axis.unitOrthogonal(), y = axis.cross(x);
    const double cell = kTurn * radius / kAround * (to - from) / kAlong;
    double along = 0.0;
    int count = 0;
    for (int u = 0; u < kAround; ++u) {
      bool any = false;
      for (int v = 0; v < kAlong; ++v) {
        const std::size_t k = cell_of(u, v);
        if (first[k] == 0 || second[k] == 0) continue;
        any = true;
        along += from + (to - from) * (v + 0.5) / kAlong;
        ++count;
      }
      const double angle = (u + 0.5) * kTurn / kAround;
      if (any && u % (kAround / 24) == 0)
        contact.normals_W.push_back(sign * (std::cos(angle) * x + std::sin(angle) * y));
    }
    if (count == 0) return std::nullopt;
    contact.area_m2 = cell * count;
    contact.point_W = origin + along / count * axis;
    return contact;
  }

  /// A nut on a bolt, or a screw in a hole, without modelled threads: radii differ by less than the depth of a thread, which is
  /// 0.613 of the pitch on the bolt (ISO 68-1, with the rounded root of ISO 724) and less in the hole.
  bool is_cosmetic_thread(std::size_t shaft, std::size_t hole, double clearance, double radius,
                          double pitch) const {
    constexpr double kLoose = 0.02;     // of the radius
    constexpr double kPressed = 0.015;  // of the radius: twice that of the tightest press fits of ISO 286
    constexpr double kDrawn = 0.35;     // of the radius: nuts whose hole is drawn smaller than any thread
    const double deepest_m = fastener_[shaft] && nut_[shaft] != nut_[hole]
                                 ? std::max(kDrawn * radius, deepest_thread_m(radius, pitch))
                                 : deepest_thread_m(radius, pitch);
    if (insert_[shaft] || clearance < -deepest_m || clearance > kLoose * radius + 1e-5) return false;
    const bool cuts = fastener_[shaft] && clearance < -kPressed * radius;  // a thread of its own
    return nut_[shaft] != nut_[hole] || insert_[hole] || cuts ||
           clearance < -tolerances_.largest_interference_m;
  }

  static double deepest_thread_m(double radius, double pitch) {
    constexpr double kFine = 0.13;   // of the radius
    constexpr double kDepth = 0.62;  // of the pitch
    return std::max(kDepth * pitch, kFine * radius);
  }

  std::optional<Contact> cylinders(const PlacedFace& a, const PlacedFace& b, std::size_t i,
                                   std::size_t j) const {
    if (a.face.concave == b.face.concave) return std::nullopt;
    const bool fasteners = fastener_[i] || fastener_[j];
    constexpr double kRounding_m = 5e-8;
    const auto [shaft, hole] = a.face.concave ? std::pair(b.face.radius_m, a.face.radius_m)
                                              : std::pair(a.face.radius_m, b.face.radius_m);
    double clearance = hole - shaft;
    if (std::abs(clearance) < kRounding_m) clearance = 0.0;
    const double radius = std::max(shaft, hole);
    const double pitch = 1e-3 * nearest_thread(2.0 * shaft).second;
    const std::size_t inner = a.face.concave ? j : i, outer = a.face.concave ? i : j;
    // The knurl of an insert is melted or cut into its hole.
    const double tightest_m =
        insert_[inner] ? deepest_thread_m(radius, pitch) : tolerances_.largest_interference_m;
    const bool fits = clearance <= tolerances_.largest_clearance_m && clearance >= -tightest_m;
    const bool cosmetic = (fasteners && is_cosmetic_thread(inner, outer, clearance, radius, pitch)) ||
                          (!insert_[inner] && is_tapped(2.0 * shaft, 2.0 * hole, pitch));
    if (!fits && !cosmetic) return std::nullopt;
    if (!coaxial(a.face, b.face, std::max(std::abs(clearance), 1e-5) + 1e-5)) return std::nullopt;
    auto contact = around(a, b, std::min(shaft, hole), a.face.concave ? -1.0 : 1.0);
    if (!contact) return std::nullopt;
    contact->kind = cosmetic ? ContactKind::thread : ContactKind::cylinder_fit;
    contact->clearance_m = clearance;
    contact->radius_m = radius;
    if (cosmetic) contact->pitch_m = pitch;
    return contact;
  }

  std::optional<Contact> helices(const PlacedFace& a, const PlacedFace& b) const {
    const double pitch = a.face.pitch_m;
    // The sense of a pitch does not depend on the direction of the axis.
    if (std::abs(pitch - b.face.pitch_m) > 0.02 * std::abs(pitch)) return std::nullopt;
    if (!coaxial(a.face, b.face, 3e-4)) return std::nullopt;
    const double radius = std::min(a.face.radius_m, b.face.radius_m);
    if (std::abs(a.face.radius_m - b.face.radius_m) > std::abs(pitch) * 1.2) return std::nullopt;
    auto contact = around(a, b, radius, a.face.concave ? -1.0 : 1.0);
    if (!contact) return std::nullopt;
    contact->kind = ContactKind::thread;
    contact->pitch_m = pitch;
    contact->radius_m = std::max(a.face.radius_m, b.face.radius_m);
    return contact;
  }

  std::optional<Contact> surfaces(const PlacedFace& a, const PlacedFace& b, double deflection_m) const {
    const double gap = tolerances_.surface_gap_m + deflection_m;
    Contact contact;
    contact.kind = ContactKind::other;
    Vec3 sum = Vec3::Zero(), normals = Vec3::Zero();
    for (const Triangle& t : a.triangles) {
      const Vec3 n = normal_of(t), centre = (t[0] + t[1] + t[2]) / 3.0;
      if (((centre - b.box.lower).array() < -gap).any() || ((b.box.upper - centre).array() < -gap).any())
        continue;
      for (const Triangle& other : b.triangles) {
        const Vec3 m = normal_of(other);
        if (n.dot(m) >= -0.9 * n.norm() * m.norm() ||
            point_triangle_squared_distance(centre, other) > gap * gap)
          continue;
        const double area = 0.5 * n.norm();
        contact.area_m2 += area;
        sum += area * centre;
        normals += 0.5 * n;
        if (contact.normals_W.size() < 64) add_normal(contact.normals_W, n.normalized());
        break;
      }
    }
    if (!(contact.area_m2 > 0.0)) return std::nullopt;
    contact.point_W = sum / contact.area_m2;
    const bool axial = a.face.kind == SurfaceKind::cone || a.face.kind == SurfaceKind::torus;
    contact.axis_W = axial                  ? a.face.axis_B
                     : normals.norm() > 0.0 ? Vec3(normals.normalized())
                                            : Vec3::UnitZ();
    return contact;
  }

  const Product& product_;
  const ContactTolerances& tolerances_;
  double plane_gap_m_ = tolerances_.plane_gap_m;  ///< planes further apart do not touch
  const std::vector<PlacedInstance> placed_;
  std::vector<bool> fastener_, nut_, insert_;  ///< by instance: as its name says
  std::vector<Contact> found_, contacts_;
};

}  // namespace

std::vector<Contact> find_contacts(const Product& product, const ContactTolerances& tolerances) {
  return Finder(product, tolerances).find();
}

}  // namespace takt::product
