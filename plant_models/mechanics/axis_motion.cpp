#include "plant_models/mechanics/axis_motion.h"

#include <algorithm>
#include <cmath>

#include "plant_models/state_bytes.h"

namespace takt {

void AxisMotion::rest_at(double position) {
  *this = {};
  end_position_ = position;
}

void AxisMotion::add(double duration_s, double acceleration, Piece& next) {
  if (!(duration_s > 0.0)) return;
  next.a = acceleration;
  pieces_[count_++] = next;
  next.q0 += (next.v0 + 0.5 * acceleration * duration_s) * duration_s;
  next.v0 += acceleration * duration_s;
  next.t0 += duration_s;
}

void AxisMotion::move_to(double t, double target, double max_speed, const AxisLimits& limits) {
  const double goal = std::clamp(target, limits.lower, limits.upper), a = limits.acceleration;
  Piece now{t, position(t), speed(t), 0.0};
  count_ = 0;
  // Where it comes to rest if it brakes at once decides the direction.
  const double ahead = goal - (now.q0 + 0.5 * now.v0 * std::abs(now.v0) / a);
  const double sense = ahead < 0.0 ? -1.0 : 1.0;
  const double way = sense * (goal - now.q0), v0 = sense * now.v0;
  const double peak = std::min(max_speed, std::sqrt(std::max(0.0, a * way + 0.5 * v0 * v0)));
  const double gain = v0 > peak ? -a : a;  // faster than allowed: it slows down
  const double first_s = (peak - v0) / gain;
  const double cruise = way - 0.5 * (peak * peak - v0 * v0) / gain - 0.5 * peak * peak / a;
  add(first_s, sense * gain, now);
  if (peak > 0.0) add(cruise / peak, 0.0, now);
  add(peak / a, -sense * a, now);
  end_s_ = now.t0;
  end_position_ = goal;
  end_speed_ = 0.0;
}

void AxisMotion::run_at(double t, double speed_to, const AxisLimits& limits) {
  const double end = speed_to > 0.0 ? limits.upper : limits.lower;
  if (speed_to != 0.0 && std::isfinite(end)) return move_to(t, end, std::abs(speed_to), limits);
  Piece now{t, position(t), speed(t), 0.0};
  count_ = 0;
  const double change = speed_to - now.v0;
  add(std::abs(change) / limits.acceleration, change < 0.0 ? -limits.acceleration : limits.acceleration, now);
  end_s_ = now.t0;
  end_position_ = now.q0;
  end_speed_ = speed_to;
}

const AxisMotion::Piece* AxisMotion::piece(double t) const {
  if (t >= end_s_ || count_ == 0) return nullptr;
  std::size_t i = count_ - 1;
  while (i > 0 && pieces_[i].t0 > t) --i;
  return &pieces_[i];
}

double AxisMotion::position(double t) const {
  const Piece* now = piece(t);
  if (now == nullptr) return end_speed_ == 0.0 ? end_position_ : end_position_ + end_speed_ * (t - end_s_);
  const double s = t - now->t0;
  return now->q0 + (now->v0 + 0.5 * now->a * s) * s;
}

double AxisMotion::speed(double t) const {
  const Piece* now = piece(t);
  return now == nullptr ? end_speed_ : now->v0 + now->a * (t - now->t0);
}

double AxisMotion::acceleration(double t) const {
  const Piece* now = piece(t);
  return now == nullptr ? 0.0 : now->a;
}

double AxisMotion::next_corner(double t) const {
  for (std::size_t i = 0; i < count_; ++i)
    if (pieces_[i].t0 > t) return pieces_[i].t0;
  return end_s_ > t && count_ > 0 ? end_s_ : std::numeric_limits<double>::infinity();
}

void AxisMotion::save(StateWriter& out) const {
  out.put_size(count_);
  for (std::size_t i = 0; i < count_; ++i)
    out.put(pieces_[i].t0), out.put(pieces_[i].q0), out.put(pieces_[i].v0), out.put(pieces_[i].a);
  out.put(end_s_), out.put(end_position_), out.put(end_speed_);
}

void AxisMotion::load(StateReader& in) {
  count_ = in.size(kPieces, "pieces of an axis' motion");
  for (std::size_t i = 0; i < count_; ++i) {
    pieces_[i].t0 = in.number("a time of an axis");
    pieces_[i].q0 = in.number("a position of an axis");
    pieces_[i].v0 = in.number("a speed of an axis");
    pieces_[i].a = in.number("an acceleration of an axis");
  }
  end_s_ = in.number("a time of an axis");
  end_position_ = in.number("a position of an axis");
  end_speed_ = in.number("a speed of an axis");
}

}  // namespace takt
