#pragma once
// The arithmetic of the multibody algorithms: vectors of three and matrices of three columns as plain
// doubles, fully inlined, with symmetric matrices stored once. The interfaces use Eigen; inside the
// algorithms its expressions of size three are too slow.
#include "plant_models/spatial.h"

namespace takt::mechanics {

struct V3 {
  double x = 0.0, y = 0.0, z = 0.0;
  V3() = default;
  constexpr V3(double x_, double y_, double z_) : x(x_), y(y_), z(z_) {}
  explicit V3(const Vec3& v) : x(v.x()), y(v.y()), z(v.z()) {}
  Vec3 eigen() const { return {x, y, z}; }
  V3& operator+=(const V3& b) { return x += b.x, y += b.y, z += b.z, *this; }
  V3& operator-=(const V3& b) { return x -= b.x, y -= b.y, z -= b.z, *this; }
};

inline V3 operator+(const V3& a, const V3& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline V3 operator-(const V3& a, const V3& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline V3 operator-(const V3& a) {
  return {-a.x, -a.y, -a.z};
}
inline V3 operator*(const V3& a, double s) {
  return {a.x * s, a.y * s, a.z * s};
}
inline double dot(const V3& a, const V3& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline V3 cross(const V3& a, const V3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Columns x, y, z.
struct M3 {
  V3 x, y, z;
  M3() = default;
  M3(const V3& x_, const V3& y_, const V3& z_) : x(x_), y(y_), z(z_) {}
  explicit M3(const Mat3& m) : x(Vec3(m.col(0))), y(Vec3(m.col(1))), z(Vec3(m.col(2))) {}
  Mat3 eigen() const {
    Mat3 m;
    m << x.eigen(), y.eigen(), z.eigen();
    return m;
  }
};

inline V3 operator*(const M3& m, const V3& v) {
  return m.x * v.x + m.y * v.y + m.z * v.z;
}
inline M3 operator*(const M3& a, const M3& b) {
  return {a * b.x, a * b.y, a * b.z};
}
/// Transposed matrix times vector.
inline V3 transposed_times(const M3& m, const V3& v) {
  return {dot(m.x, v), dot(m.y, v), dot(m.z, v)};
}

/// A symmetric matrix.
struct S3 {
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;
  S3() = default;
  S3(double xx_, double xy_, double xz_, double yy_, double yz_, double zz_)
      : xx(xx_), xy(xy_), xz(xz_), yy(yy_), yz(yz_), zz(zz_) {}
  explicit S3(const Mat3& m) : xx(m(0, 0)), xy(m(0, 1)), xz(m(0, 2)), yy(m(1, 1)), yz(m(1, 2)), zz(m(2, 2)) {}
  V3 col_x() const { return {xx, xy, xz}; }
  V3 col_y() const { return {xy, yy, yz}; }
  V3 col_z() const { return {xz, yz, zz}; }
  S3& operator+=(const S3& b) {
    xx += b.xx, xy += b.xy, xz += b.xz, yy += b.yy, yz += b.yz, zz += b.zz;
    return *this;
  }
};

inline V3 operator*(const S3& s, const V3& v) {
  return {s.xx * v.x + s.xy * v.y + s.xz * v.z, s.xy * v.x + s.yy * v.y + s.yz * v.z,
          s.xz * v.x + s.yz * v.y + s.zz * v.z};
}

/// R s R^T.
inline S3 rotated(const M3& R, const S3& s) {
  const V3 a = R * s.col_x(), b = R * s.col_y(), c = R * s.col_z();  // columns of R s
  return {a.x * R.x.x + b.x * R.y.x + c.x * R.z.x, a.x * R.x.y + b.x * R.y.y + c.x * R.z.y,
          a.x * R.x.z + b.x * R.y.z + c.x * R.z.z, a.y * R.x.y + b.y * R.y.y + c.y * R.z.y,
          a.y * R.x.z + b.y * R.y.z + c.y * R.z.z, a.z * R.x.z + b.z * R.y.z + c.z * R.z.z};
}

}  // namespace takt::mechanics
