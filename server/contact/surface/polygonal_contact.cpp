#include "server/contact/surface/polygonal_contact.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>

#include "server/contact/surface/contact_elements.h"
#include "server/contact/surface/contact_search.h"
#include "server/contact/surface/field_elements.h"

namespace takt {
namespace {

/// A patch is held for a path of so many faces of the Target, and for this angle at most: its pieces are straight. A
/// piece of it is as long as so many faces.
constexpr double kHeldFaces = 12.0, kPieceFaces = 1.0, kMostTurn_rad = 0.3;
/// It is held for up to kLonger times as long as the one before it served, within these times, without one before it for
/// kFirstHeld_s: a search costs by the length of the motion, and motions that rattle last for a millisecond. A motion that
/// goes into the Target will not last: from where it is deeper than the margin, a patch is held for a shorter time at most.
constexpr double kFirstHeld_s = 0.01, kShortestHeld_s = 0.001, kLongestHeld_s = 0.05, kLonger = 2.0,
                 kLongestIntoTarget_s = 0.01;
/// Points of the Base are beside a held motion by no more than such an acceleration takes them in a time or in that for
/// which it is held, within a least way and a share of a face.
constexpr double kUnforeseen_m_per_s2 = 0.5, kUnforeseen_s = 0.01, kLeastMargin_m = 1e-6, kMarginFaces = 0.05;

Mat3 cross_matrix(const Vec3& a) {
  Mat3 m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

Mat3 product(const Mat3& a, const Mat3& b) {
  Mat3 c;
  c.noalias() = a.lazyProduct(b);
  return c;
}

/// Transforms from the origin and axes of B to those of T.
void move_to_target(const Pose& X_TB, Mat6& m) {
  const Mat3 R = X_TB.R, R_transposed = R.transpose();
  const Mat3 lever = cross_matrix(X_TB.p);
  const auto turned = [&](const Mat3& block) { return product(product(R, block), R_transposed); };
  const Mat3 a = turned(m.topLeftCorner<3, 3>());
  const Mat3 b = turned(m.topRightCorner<3, 3>()) - product(a, lever);
  const Mat3 c = turned(m.bottomLeftCorner<3, 3>());
  const Mat3 d = turned(m.bottomRightCorner<3, 3>()) - product(c, lever);
  m.topLeftCorner<3, 3>() = a;
  m.topRightCorner<3, 3>() = b;
  m.bottomLeftCorner<3, 3>() = c + product(lever, a);
  m.bottomRightCorner<3, 3>() = d + product(lever, b);
}

/// Of values that consist of so many numbers.
template <std::size_t kNumbers, class Value>
bool same_numbers(const Value& a, const Value& b) {
  static_assert(sizeof(Value) == kNumbers * sizeof(double));
  return std::memcmp(static_cast<const void*>(&a), static_cast<const void*>(&b), sizeof(a)) == 0;
}

/// Velocity of the material of the Target's surface at the origin of B, axes of B.
Twist surface_velocity(const RelativeMotion& motion) {
  const Mat3 R_BT = motion.X_TB.R.transpose();
  return {R_BT * motion.V_TS_T.at(motion.X_TB.p), R_BT * motion.V_TS_T.w};
}

}  // namespace

bool same_bits(const RelativeMotion& a, const RelativeMotion& b) {
  if (!same_numbers<12>(a.X_TB, b.X_TB) || !same_numbers<6>(a.V_TB_T, b.V_TB_T) ||
      a.surface_moves != b.surface_moves)
    return false;
  return !a.surface_moves || (same_numbers<12>(a.X_TS, b.X_TS) && same_numbers<6>(a.V_TS_T, b.V_TS_T));
}

RelativeMotion relative_motion(const Pose& X_WB, const Twist& V_WB, const Pose& X_WT, const Twist& V_WT) {
  const Mat3 R_TW = X_WT.R.transpose();
  const Vec3 p_TB_W = X_WB.p - X_WT.p;
  RelativeMotion motion;
  motion.X_TB.R = R_TW * X_WB.R;
  motion.X_TB.p = R_TW * p_TB_W;
  motion.V_TB_T.v = R_TW * (V_WB.v - V_WT.at(p_TB_W));
  motion.V_TB_T.w = R_TW * (V_WB.w - V_WT.w);
  return motion;
}

struct PolygonalContact::Impl {
  std::shared_ptr<const ContactSurface> base_surface, target_surface;
  const ContactSurface::Data& base;
  const ContactSurface::Data& target;
  ContactLaw law;
  std::shared_ptr<const DistanceField> field;  ///< of the Target, or null
  std::optional<ContactSearch> search;         ///< at the first pose at which the bounds meet
  std::optional<FieldElements> found;          ///< likewise, with a field
  ElementRows rows;
  std::vector<std::int32_t> filled;  ///< elements in the rows
  std::vector<ContactSpring> springs;
  /// The rows have the anchors of these elements, as of this number of losses of rows.
  std::vector<std::int32_t> anchored;
  std::size_t anchored_losses = 0;
  bool springs_changed = true;
  ContactCounts counts;
  HeldPatch patch;
  HeldMotion held;
  HeldFrom held_from;
  bool holds = false;
  bool rows_held = false;  ///< the rows are of the patch
  /// The rows are those of this pose: a linearisation follows an evaluation.
  bool rows_known = false;
  Pose rows_at;

  Impl(std::shared_ptr<const ContactSurface> b, std::shared_ptr<const ContactSurface> t, const ContactLaw& l,
       std::shared_ptr<const DistanceField> f)
      : base_surface(std::move(b)),
        target_surface(std::move(t)),
        base(base_surface->data()),
        target(target_surface->data()),
        law(l),
        field(std::move(f)) {
    // The law hardens well before the middle of a wall, beyond which the closest surface is the far side.
    for (const ContactSurface::Data* side : {&base, &target})
      if (side->wall_m > 0.0) law.linear_depth_m = std::min(law.linear_depth_m, kLinearShare * side->wall_m);
  }

  ContactSearch& begin_search() { return search ? *search : search.emplace(base, target); }
  void find_in_field(const Pose& X_TB);
  /// Thickness of the Target at a point of this depth if that is more than kPassing of it, else 0.
  double wall_beyond_m(const Vec3& x_T, const Vec3& inward_T, double depth_m) const {
    const double further_m = (1.0 / kPassing - 1.0) * depth_m;
    return target.signed_distance_m(x_T + further_m * inward_T) > 0.0 ? depth_m + further_m : 0.0;
  }
  bool boxes_apart(const Pose& X_TB) const;
  void start_holding(const HeldFrom& from);
  bool held_covers(const Pose& X_TB, double next_s, double share, double& at_s) const;
  std::size_t find_elements(const RelativeMotion& motion, const Pose& X_BT, Twist& V_B);
  /// element_forces() at this motion, after find_elements(). `jacobian` unless for the forces alone.
  ElementTotals forces(const RelativeMotion& motion, const Pose& X_BT, const Twist& V_B, ElementDetail detail,
                       ContactJacobian* jacobian);
  void set_elements(std::span<const std::int32_t> elements);
  void fill_found();
  void fill_anchors();
  Vec3 first_stretch(std::size_t row, const Vec3& v_B) const;
  void add_bends(ElementDetail detail, Mat6& K) const;
  bool evaluate(const RelativeMotion& motion, ElementDetail detail, ContactResult& result, Twist& V_B,
                ContactJacobian* jacobian);
};

bool PolygonalContact::Impl::boxes_apart(const Pose& X_TB) const {
  const Vec3& c = base.box.center_B;
  const Vec3& h = base.box.half_B;
  for (int k = 0; k < 3; ++k) {
    const double between = X_TB.R(k, 0) * c.x() + X_TB.R(k, 1) * c.y() + X_TB.R(k, 2) * c.z() + X_TB.p[k] -
                           target.box.center_B[k];
    const double reach = std::abs(X_TB.R(k, 0)) * h.x() + std::abs(X_TB.R(k, 1)) * h.y() +
                         std::abs(X_TB.R(k, 2)) * h.z() + target.box.half_B[k];
    // A pose that is not finite is apart.
    if (!(std::abs(between) <= reach)) return true;
  }
  return false;
}

/// Centroids and areas are fixed in the Base: they stay in the rows as long as the elements are the same.
void PolygonalContact::Impl::set_elements(std::span<const std::int32_t> elements) {
  using R = ElementRows;
  if (std::equal(elements.begin(), elements.end(), filled.begin(), filled.end())) return;
  filled.assign(elements.begin(), elements.end());
  rows.resize(elements.size());
  double *px = rows[R::kPx], *py = rows[R::kPy], *pz = rows[R::kPz], *area = rows[R::kArea];
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const auto e = static_cast<std::size_t>(elements[i]);
    px[i] = base.px[e], py[i] = base.py[e], pz[i] = base.pz[e], area[i] = base.area_m2[e];
  }
}

void PolygonalContact::Impl::fill_found() {
  using R = ElementRows;
  double *nx = rows[R::kNx], *ny = rows[R::kNy], *nz = rows[R::kNz];
  for (std::size_t i = 0; i < filled.size(); ++i) {
    const Vec3& m = search->normal_B(i);
    nx[i] = -m.x(), ny[i] = -m.y(), nz[i] = -m.z();
  }
  std::copy(search->depths_m().begin(), search->depths_m().end(), rows[R::kDepth]);
}

/// They stay in the rows as long as elements and springs are the same.
void PolygonalContact::Impl::fill_anchors() {
  using R = ElementRows;
  if (law.friction_law != FrictionLaw::stick) return;
  if (!springs_changed && anchored_losses == rows.losses() && anchored == filled) return;
  double *x = rows[R::kAx], *y = rows[R::kAy], *z = rows[R::kAz], *tied = rows[R::kTied];
  auto spring = springs.begin();
  for (std::size_t i = 0; i < filled.size(); ++i) {
    const std::int32_t element = filled[i];
    while (spring != springs.end() && spring->element < element) ++spring;
    const bool is_tied = spring != springs.end() && spring->element == element;
    const Vec3 anchor = is_tied ? spring->anchor_T : Vec3::Zero();
    x[i] = anchor.x(), y[i] = anchor.y(), z[i] = anchor.z(), tied[i] = is_tied ? 1.0 : 0.0;
  }
  anchored = filled;
  anchored_losses = rows.losses();
  springs_changed = false;
}

/// Where the closest point of the Target is on an edge or a vertex, the normal turns as the element moves
/// sideways by v: by v / u. The secant has the stiffness of the elastic part, so that it never drives.
void PolygonalContact::Impl::add_bends(ElementDetail detail, Mat6& K) const {
  using R = ElementRows;
  for (const ContactSearch::Bend& bend : search->bends()) {
    const std::size_t i = bend.hit;
    if (!(rows[R::kForce][i] > 0.0)) continue;
    const double k = detail == ElementDetail::tangent ? rows[R::kForce][i] / rows[R::kDepth][i]
                                                      : law.stiffness_Pa_per_m * rows[R::kArea][i];
    const Vec3 n(rows[R::kNx][i], rows[R::kNy][i], rows[R::kNz][i]);
    const Vec3 p(rows[R::kPx][i], rows[R::kPy][i], rows[R::kPz][i]);
    const Mat3 across = k * (Mat3::Identity() - n * n.transpose() - bend.edge_B * bend.edge_B.transpose());
    const Mat3 lever = cross_matrix(p);
    K.topLeftCorner<3, 3>() -= across;
    K.topRightCorner<3, 3>() += product(across, lever);
    K.bottomLeftCorner<3, 3>() -= product(lever, across);
    K.bottomRightCorner<3, 3>() += product(product(lever, across), lever);
  }
}

/// `at_s`: when the held motion is closest to the pose.
bool PolygonalContact::Impl::held_covers(const Pose& X_TB, double next_s, double share, double& at_s) const {
  if (!holds) return false;
  const double beside_m = held.beside_m(X_TB, base.box.center_B, base.radius_m, at_s);
  return beside_m <= share * held.margin_m && at_s + next_s <= held.horizon_s;
}

void PolygonalContact::Impl::find_in_field(const Pose& X_TB) {
  if (!found) found.emplace(base, *field);
  found->find(X_TB);
  found->fill(rows, filled);
}

/// Number of elements that penetrate or are held; their rows are filled.
std::size_t PolygonalContact::Impl::find_elements(const RelativeMotion& motion, const Pose& X_BT,
                                                  Twist& V_B) {
  if (!(rows_known && same_numbers<12>(motion.X_TB, rows_at))) {
    rows_known = false;
    double at_s = 0.0;
    rows_held = held_covers(motion.X_TB, 0.0, 1.0, at_s);
    if (rows_held) {
      patch.fill(held.piece(at_s), motion.X_TB, X_BT, rows, filled);
    } else {
      if (boxes_apart(motion.X_TB)) return 0;
      ++counts.searches;
      if (field != nullptr) {
        find_in_field(motion.X_TB);
      } else {
        counts.rebuilds += begin_search().find(motion.X_TB, X_BT) ? 1 : 0;
        set_elements(search->elements());
        fill_found();
      }
    }
    rows_at = motion.X_TB;
    rows_known = true;
  }
  if (filled.empty()) return 0;
  fill_anchors();
  V_B.v = X_BT.R * motion.V_TB_T.v;
  V_B.w = X_BT.R * motion.V_TB_T.w;
  return filled.size();
}

ElementTotals PolygonalContact::Impl::forces(const RelativeMotion& motion, const Pose& X_BT, const Twist& V_B,
                                             ElementDetail detail, ContactJacobian* jacobian) {
  const Pose X_BA = motion.surface_moves ? X_BT * motion.X_TS : X_BT;
  const Twist surface_B = motion.surface_moves ? surface_velocity(motion) : Twist{};
  const Twist* const surface = motion.surface_moves ? &surface_B : nullptr;
  if (detail == ElementDetail::forces) return element_forces(law, V_B, rows, X_BA, surface);
  return element_forces(law, V_B, detail, rows, X_BA, surface, jacobian->K, jacobian->D);
}

/// Stretch of a new spring with which friction stays what it is: (2.21) at the velocity v relative to the Target's surface.
Vec3 PolygonalContact::Impl::first_stretch(std::size_t row, const Vec3& v_B) const {
  using R = ElementRows;
  const Vec3 n(rows[R::kNx][row], rows[R::kNy][row], rows[R::kNz][row]);
  const Vec3 along = v_B - n.dot(v_B) * n;
  const double speed = along.norm(), area = rows[R::kArea][row];
  if (!(speed > 0.0)) return Vec3::Zero();
  const double s = std::min(1.0, speed / law.friction_velocity_m_per_s);
  const double friction = law.friction * rows[R::kForce][row] * s * (2.0 - s);
  const double by_spring = friction - law.tangential_damping_N_s_per_m3 * area * speed;
  return std::max(0.0, by_spring) / (law.tangential_stiffness_Pa_per_m * area * speed) * along;
}

bool PolygonalContact::Impl::evaluate(const RelativeMotion& motion, ElementDetail detail,
                                      ContactResult& result, Twist& V_B, ContactJacobian* jacobian) {
  ++counts.evaluations;
  result = ContactResult{};
  const Pose X_BT = motion.X_TB.inverse();
  if (find_elements(motion, X_BT, V_B) == 0) return false;
  const ElementTotals totals = forces(motion, X_BT, V_B, detail, jacobian);
  result.elastic_energy_J = found ? found->elastic_energy_J(law) : totals.elastic_energy_J;
  result.elements = static_cast<int>(totals.elements);
  if (result.elements == 0) return false;
  const Pose& X = motion.X_TB;
  result.F_B_T.f = X.R * totals.f_B;
  result.F_B_T.t = X.R * totals.t_B + X.p.cross(result.F_B_T.f);
  result.area_m2 = totals.area_m2;
  result.normal_force_N = totals.normal_force_N;
  result.friction_force_N = totals.friction_force_N;
  result.largest_pressure_Pa = totals.largest_pressure_Pa;
  result.largest_penetration_m = totals.largest_penetration_m;
  if (totals.normal_force_N > 0.0) result.p_TC = X * Vec3(totals.weighted_p_B / totals.normal_force_N);
  counts.elements += static_cast<std::uint64_t>(result.elements);
  return true;
}

PolygonalContact::PolygonalContact(std::shared_ptr<const ContactSurface> base,
                                   std::shared_ptr<const ContactSurface> target, const ContactLaw& law,
                                   const std::shared_ptr<const DistanceField>& field) {
  if (base == nullptr || target == nullptr)
    throw std::invalid_argument("a contact needs the surfaces of both sides");
  check_contact_law(law);
  impl_ = std::make_unique<Impl>(std::move(base), std::move(target), law, field);
}
PolygonalContact::~PolygonalContact() = default;
PolygonalContact::PolygonalContact(PolygonalContact&&) noexcept = default;
PolygonalContact& PolygonalContact::operator=(PolygonalContact&&) noexcept = default;

void PolygonalContact::rebind(const std::shared_ptr<const ContactSurface>& base,
                              const std::shared_ptr<const ContactSurface>& target, const ContactLaw& law,
                              const std::shared_ptr<const DistanceField>& field) {
  check_contact_law(law);
  std::destroy_at(impl_.get());
  std::construct_at(impl_.get(), base, target, law, field);
}

bool PolygonalContact::has_search() const {
  return impl_->search.has_value() || impl_->found.has_value();
}

void PolygonalContact::evaluate(const RelativeMotion& motion, ContactResult& result) {
  Twist V_B;
  impl_->evaluate(motion, ElementDetail::forces, result, V_B, nullptr);
}

void PolygonalContact::evaluate(const RelativeMotion& motion, Linearisation linearisation,
                                ContactResult& result, ContactJacobian& jacobian) {
  const bool tangent = linearisation == Linearisation::tangent;
  const ElementDetail detail = tangent ? ElementDetail::tangent : ElementDetail::secant;
  Twist V_B;
  if (!impl_->evaluate(motion, detail, result, V_B, &jacobian)) {
    jacobian.K.setZero();
    jacobian.D.setZero();
    return;
  }
  if (impl_->found)
    impl_->found->add_stiffness(detail, impl_->law, V_B, impl_->rows, jacobian.K);
  else if (!impl_->rows_held)
    impl_->add_bends(detail, jacobian.K);
  move_to_target(motion.X_TB, jacobian.K);
  move_to_target(motion.X_TB, jacobian.D);
}

bool PolygonalContact::accept(const RelativeMotion& motion) {
  Impl& m = *impl_;
  if (m.law.friction_law != FrictionLaw::stick) return false;
  Twist V_B;
  const bool found = m.find_elements(motion, motion.X_TB.inverse(), V_B) > 0;
  m.springs.clear();  // the rows have them
  if (found) {
    m.springs.reserve(m.filled.size());
    element_normal_forces(m.law, V_B, m.rows);
    slip_anchors(m.law, motion.X_TB, m.rows, motion.surface_moves ? &motion.X_TS : nullptr);
    const Pose X_ST = motion.X_TS.inverse();
    const Twist surface_B = motion.surface_moves ? surface_velocity(motion) : Twist{};
    const Twist sliding_B{V_B.v - surface_B.v, V_B.w - surface_B.w};
    using R = ElementRows;
    const double *x = m.rows[R::kAx], *y = m.rows[R::kAy], *z = m.rows[R::kAz], *tied = m.rows[R::kTied];
    for (std::size_t i = 0; i < m.filled.size(); ++i) {
      if (!(m.rows[R::kForce][i] > 0.0)) continue;
      ContactSpring& spring = m.springs.emplace_back();
      spring.element = m.filled[i];
      if (tied[i] > 0.0) {
        spring.anchor_T = Vec3(x[i], y[i], z[i]);
        continue;
      }
      const Vec3 p = m.base.point(static_cast<std::size_t>(spring.element));
      spring.anchor_T = motion.X_TB * p - motion.X_TB.R * m.first_stretch(i, sliding_B.at(p));
      if (motion.surface_moves) spring.anchor_T = X_ST * spring.anchor_T;
    }
  }
  m.springs_changed = true;
  return !m.springs.empty();
}

bool PolygonalContact::can_hold() const {
  return impl_->field == nullptr && !impl_->target.octree.empty();
}

void PolygonalContact::Impl::start_holding(const HeldFrom& from) {
  held_from = from;
  const RelativeMotion& motion = held_from.motion;
  rows_known = false;
  held.X_TB = motion.X_TB;
  held.w_T = motion.V_TB_T.w;
  held.v_T = motion.V_TB_T.at(motion.X_TB.R * base.box.center_B);
  const double speed = held.v_T.norm() + held.w_T.norm() * base.radius_m;
  // A motion that is not finite is searched at each pose.
  holds = std::isfinite(speed);
  if (!holds) return;
  const double face_m = target.face_size_m();
  const double most_s = std::clamp(held_from.most_s, kShortestHeld_s, kLongestHeld_s);
  held.horizon_s = std::min({most_s, kHeldFaces * face_m / speed, kMostTurn_rad / held.w_T.norm()});
  const auto margin_m = [face_m](double horizon_s) {
    const double unforeseen_s = std::max(kUnforeseen_s, horizon_s);
    return kLeastMargin_m +
           std::min(kMarginFaces * face_m, 0.5 * kUnforeseen_m_per_s2 * unforeseen_s * unforeseen_s);
  };
  held.margin_m = margin_m(held.horizon_s);
  const double pieces = std::ceil(held.horizon_s * speed / (kPieceFaces * face_m));
  held.pieces = static_cast<std::size_t>(std::clamp(pieces, 1.0, static_cast<double>(HeldMotion::kPieces)));
  held.piece_s = held.horizon_s / static_cast<double>(held.pieces);
  held.least_pieces =
      std::min(held.pieces, static_cast<std::size_t>(std::ceil(kLongestIntoTarget_s / held.piece_s)));
  ++counts.searches;
  begin_search().find(held, patch);
  std::size_t beside = 0;
  while (beside < held.pieces && patch.deepest_m(beside) <= held.margin_m) ++beside;
  if (beside == held.pieces) return;
  held.horizon_s =
      std::min(held.horizon_s, std::max(static_cast<double>(beside) * held.piece_s, kLongestIntoTarget_s));
  held.margin_m = margin_m(held.horizon_s);
}

bool PolygonalContact::hold(const RelativeMotion& motion, double next_s) {
  // What is beside by more than this share of the margin may leave it within the next step.
  constexpr double kShare = 0.5;
  double at_s = 0.0;
  if (!can_hold() || impl_->held_covers(motion.X_TB, next_s, kShare, at_s)) return false;
  const bool held = impl_->holds;
  impl_->holds = impl_->rows_known = false;
  if (impl_->boxes_apart(motion.X_TB)) return held;
  impl_->start_holding({motion, held ? kLonger * at_s : kFirstHeld_s});
  return true;
}

void PolygonalContact::hold_from(const HeldFrom& from) {
  if (can_hold()) impl_->start_holding(from);
}

const HeldFrom* PolygonalContact::held_from() const {
  return impl_->holds ? &impl_->held_from : nullptr;
}

void PolygonalContact::release() {
  impl_->holds = impl_->rows_known = false;
}

void PolygonalContact::reset() {
  impl_->holds = impl_->rows_known = false;
  impl_->springs.clear();
  impl_->springs_changed = true;
  if (impl_->search) impl_->search->forget();
}

std::vector<double> PolygonalContact::save() const {
  return save_springs(impl_->springs);
}

std::span<const ContactSpring> PolygonalContact::springs() const {
  return impl_->springs;
}

void PolygonalContact::restore(std::span<const double> kept) {
  impl_->springs = restore_springs(kept, impl_->base.element_count());
  impl_->springs_changed = true;
}

std::vector<ElementPressure> PolygonalContact::pressures(const RelativeMotion& motion) {
  std::vector<ElementPressure> result;
  Twist V_B;
  const Pose X_BT = motion.X_TB.inverse();
  if (impl_->find_elements(motion, X_BT, V_B) == 0) return result;
  impl_->forces(motion, X_BT, V_B, ElementDetail::forces, nullptr);
  const std::vector<std::int32_t>& hits = impl_->filled;
  using R = ElementRows;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!(impl_->rows[R::kForce][i] > 0.0)) continue;
    const std::int32_t element = hits[i];
    result.push_back({element, impl_->base.point(static_cast<std::size_t>(element)), impl_->rows[R::kArea][i],
                      impl_->rows[R::kDepth][i], impl_->rows[R::kPressure][i]});
  }
  return result;
}

double PolygonalContact::passed_wall_m(const RelativeMotion& motion) {
  if (impl_->boxes_apart(motion.X_TB)) return 0.0;
  if (impl_->field != nullptr) {
    impl_->rows_known = false;
    impl_->find_in_field(motion.X_TB);
    Vec3 x_T, inward_T;
    const double depth_m = impl_->found->deepest_m(x_T, inward_T);
    return depth_m > 0.0 ? impl_->wall_beyond_m(x_T, inward_T, depth_m) : 0.0;
  }
  const Pose X_BT = motion.X_TB.inverse();
  ContactSearch& search = impl_->begin_search();
  impl_->rows_known = false;
  search.find(motion.X_TB, X_BT);
  const auto depths = search.depths_m();
  if (depths.empty()) return 0.0;
  const auto deepest = std::max_element(depths.begin(), depths.end());
  const auto hit = static_cast<std::size_t>(deepest - depths.begin());
  const Vec3 x_T = motion.X_TB * impl_->base.point(static_cast<std::size_t>(search.elements()[hit]));
  const Vec3 inward_T = -(motion.X_TB.R * search.normal_B(hit));
  return impl_->wall_beyond_m(x_T, inward_T, *deepest);
}

const ContactCounts& PolygonalContact::counts() const {
  return impl_->counts;
}
void PolygonalContact::set_friction(double friction) {
  impl_->law.friction = friction;
}

const ContactLaw& PolygonalContact::law() const {
  return impl_->law;
}

}  // namespace takt
