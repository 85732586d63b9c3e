#include "client_lib/render/renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <stdexcept>

namespace takt::render {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr double kNear_m = 0.01;
constexpr int kShadowSize = 2048;
constexpr int kBandRows = 64;  ///< of the picture, drawn with all their samples at a time

using Rgb = Eigen::Array3d;

double to_linear(double s) {
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}
double to_srgb(double l) {
  return l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1.0 / 2.4) - 0.055;
}
Rgb linear(const Color& c) {
  return {to_linear(c.r), to_linear(c.g), to_linear(c.b)};
}

/// One triangle in the world with what lighting needs.
struct Face {
  std::array<Vec3, 3> p_W;
  std::array<Vec3, 3> normal_W;  // unit
  Rgb color;
  bool lit = true;
};

/// A vertex on the screen: pixels right and down, and 1 / depth, which is linear across the screen.
struct ScreenPoint {
  double x, y, inverse_depth;
};

/// Calls visit(x, y, inverse_depth) for every pixel whose centre the triangle covers. Winding does not
/// matter.
template <typename Visit>
void for_each_pixel(const std::array<ScreenPoint, 3>& t, int width, int height, Visit&& visit) {
  const double area = (t[1].x - t[0].x) * (t[2].y - t[0].y) - (t[2].x - t[0].x) * (t[1].y - t[0].y);
  if (std::abs(area) < 1e-12) return;
  const double share = 1.0 / area;
  const auto [x_low, x_high] = std::minmax({t[0].x, t[1].x, t[2].x});
  const auto [y_low, y_high] = std::minmax({t[0].y, t[1].y, t[2].y});
  if (x_high < 0.0 || y_high < 0.0 || x_low > width || y_low > height) return;
  const int x0 = static_cast<int>(std::floor(std::max(0.0, x_low)));
  const int x1 = static_cast<int>(std::ceil(std::min<double>(width, x_high)));
  const int y0 = static_cast<int>(std::floor(std::max(0.0, y_low)));
  const int y1 = static_cast<int>(std::ceil(std::min<double>(height, y_high)));
  for (int y = y0; y < y1; ++y) {
    const double py = y + 0.5;
    // Where the row meets the edges, and a pixel more: most of the box around a needle is outside.
    double from = std::numeric_limits<double>::infinity(), to = -from;
    for (std::size_t k = 0; k < 3; ++k) {
      const ScreenPoint &a = t[k], &b = t[(k + 1) % 3];
      // The ends of a level edge are on the other two.
      if (a.y == b.y || (a.y < py && b.y < py) || (a.y > py && b.y > py)) continue;
      const double crossing = a.x + (py - a.y) / (b.y - a.y) * (b.x - a.x);
      from = std::min(from, crossing), to = std::max(to, crossing);
    }
    if (!(from <= to)) continue;
    const int first = std::max(x0, static_cast<int>(std::floor(std::max(from - 1.0, 0.0))));
    const int last =
        std::min(x1, static_cast<int>(std::ceil(std::min(to + 1.0, static_cast<double>(width)))));
    for (int x = first; x < last; ++x) {
      const double px = x + 0.5;
      const double w0 = ((t[1].x - px) * (t[2].y - py) - (t[2].x - px) * (t[1].y - py)) * share;
      const double w1 = ((t[2].x - px) * (t[0].y - py) - (t[0].x - px) * (t[2].y - py)) * share;
      const double w2 = 1.0 - w0 - w1;
      if (w0 < 0.0 || w1 < 0.0 || w2 < 0.0) continue;
      visit(x, y, w0 * t[0].inverse_depth + w1 * t[1].inverse_depth + w2 * t[2].inverse_depth);
    }
  }
}

/// The camera's frame C: x right, y down, z into the picture.
struct View {
  Pose X_CW;
  double focal_px = 0.0, center_x = 0.0, center_y = 0.0;

  ScreenPoint project(const Vec3& p_C) const {
    return {center_x + focal_px * p_C.x() / p_C.z(), center_y + focal_px * p_C.y() / p_C.z(), 1.0 / p_C.z()};
  }
};

View make_view(const Camera& camera) {
  if (camera.width_px <= 0 || camera.height_px <= 0 || camera.samples_per_axis <= 0) {
    throw std::invalid_argument("camera: width_px, height_px and samples_per_axis must be at least 1");
  }
  if (!(camera.vertical_view_rad > 0.0 && camera.vertical_view_rad < std::numbers::pi)) {
    throw std::invalid_argument("camera: vertical_view_rad must lie between 0 and pi");
  }
  const Vec3 gaze = camera.target_W - camera.eye_W;
  if (!(gaze.norm() > 0.0) || !gaze.allFinite()) {
    throw std::invalid_argument("camera: eye_W and target_W must be two different points");
  }
  const Vec3 z = gaze.normalized();
  Vec3 right = z.cross(Vec3::UnitZ());
  if (right.norm() < 1e-9) right = Vec3::UnitX();  // straight up or down: world x is to the right
  right.normalize();
  Mat3 R_WC;
  R_WC << right, z.cross(right), z;
  View view;
  view.X_CW = Pose{R_WC, camera.eye_W}.inverse();
  view.focal_px = 0.5 * camera.height_px / std::tan(0.5 * camera.vertical_view_rad);
  view.center_x = 0.5 * camera.width_px;
  view.center_y = 0.5 * camera.height_px;
  return view;
}

std::vector<Face> world_faces(const Scene& scene) {
  std::vector<Face> faces;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const Mesh& mesh = scene.meshes[m];
    const bool smooth = !mesh.normals.empty();
    if (smooth && mesh.normals.size() != mesh.vertices.size()) {
      throw std::invalid_argument("mesh " + std::to_string(m) +
                                  ": as many normals as vertices are needed, or none");
    }
    for (const auto& triangle : mesh.triangles) {
      Face face;
      face.color = linear(mesh.color);
      face.lit = mesh.lit;
      for (std::size_t k = 0; k < 3; ++k) {
        if (triangle[k] >= mesh.vertices.size()) {
          throw std::invalid_argument("mesh " + std::to_string(m) + ": a triangle names vertex " +
                                      std::to_string(triangle[k]) + " of " +
                                      std::to_string(mesh.vertices.size()));
        }
        face.p_W[k] = mesh.X_WB * mesh.vertices[triangle[k]];
      }
      const Vec3 normal = (face.p_W[1] - face.p_W[0]).cross(face.p_W[2] - face.p_W[0]);
      if (!(normal.norm() > 0.0)) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        face.normal_W[k] = smooth ? Vec3(mesh.X_WB.R * mesh.normals[triangle[k]]) : normal.normalized();
      }
      faces.push_back(face);
    }
  }
  return faces;
}

/// Depth of the scene seen from the light, by parallel projection.
class ShadowMap {
 public:
  ShadowMap(const std::vector<Face>& faces, const Vec3& towards_light_W) {
    const Vec3 z = -towards_light_W;
    const Vec3 x = z.unitOrthogonal();
    Mat3 R_WL;
    R_WL << x, z.cross(x), z;
    R_LW_ = R_WL.transpose();
    Eigen::AlignedBox3d box;
    for (const Face& face : faces) {
      for (const Vec3& p_W : face.p_W) box.extend(R_LW_ * p_W);
    }
    if (box.isEmpty()) box.extend(Vec3::Zero());
    low_ = box.min();
    scale_ = kShadowSize / std::max(1e-6, std::max(box.sizes().x(), box.sizes().y()));
    depth_.assign(static_cast<std::size_t>(kShadowSize) * kShadowSize, kFar);
    for (const Face& face : faces) {
      if (!face.lit) continue;
      std::array<ScreenPoint, 3> t{};
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 p_L = R_LW_ * face.p_W[k] - low_;
        t[k] = {p_L.x() * scale_, p_L.y() * scale_, p_L.z()};
      }
      for_each_pixel(t, kShadowSize, kShadowSize, [&](int u, int v, double depth) {
        float& nearest = depth_[index(u, v)];
        nearest = std::min(nearest, static_cast<float>(depth));
      });
    }
  }

  /// Share of the light that reaches a point, 0..1, averaged over a small square for soft borders.
  double lit(const Vec3& p_W, const Vec3& normal_W) const {
    const Vec3 p_L = R_LW_ * (p_W + normal_W * (1.5 / scale_)) - low_;
    const int u = static_cast<int>(p_L.x() * scale_), v = static_cast<int>(p_L.y() * scale_);
    const double bias = 2.0 / scale_;
    int seen = 0, count = 0;
    for (int dv = -2; dv <= 2; ++dv) {
      for (int du = -2; du <= 2; ++du) {
        ++count;
        const int a = u + du, b = v + dv;
        if (a < 0 || b < 0 || a >= kShadowSize || b >= kShadowSize || depth_[index(a, b)] > p_L.z() - bias)
          ++seen;
      }
    }
    return static_cast<double>(seen) / count;
  }

 private:
  static std::size_t index(int u, int v) {
    return static_cast<std::size_t>(v) * kShadowSize + static_cast<std::size_t>(u);
  }

  Mat3 R_LW_;
  Vec3 low_;
  double scale_ = 1.0;
  std::vector<float> depth_;
};

/// A triangle on the screen. `owner` >= 0: index of a face; <= -2: line number -owner - 2.
struct ScreenTriangle {
  std::array<ScreenPoint, 3> corners;
  int owner;
};

/// What the camera sees of faces and lines.
class Projection {
 public:
  explicit Projection(const View& view) : view_(view) {}

  void add(const std::array<Vec3, 3>& p_W, int owner) {
    std::array<Vec3, 3> p_C;
    for (std::size_t k = 0; k < 3; ++k) p_C[k] = view_.X_CW * p_W[k];
    // Clip against the near plane: up to four corners remain.
    std::array<Vec3, 4> corners;
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 &a = p_C[k], &b = p_C[(k + 1) % 3];
      if (a.z() >= kNear_m) corners[count++] = a;
      if ((a.z() >= kNear_m) != (b.z() >= kNear_m))
        corners[count++] = a + (b - a) * ((kNear_m - a.z()) / (b.z() - a.z()));
    }
    for (std::size_t k = 2; k < count; ++k) {
      triangles_.push_back(
          {{view_.project(corners[0]), view_.project(corners[k - 1]), view_.project(corners[k])}, owner});
    }
  }

  void add_line(const Line& line, int owner) {
    Vec3 a = view_.X_CW * line.from, b = view_.X_CW * line.to;
    if (a.z() < kNear_m && b.z() < kNear_m) return;
    if (a.z() < kNear_m) a += (b - a) * ((kNear_m - a.z()) / (b.z() - a.z()));
    if (b.z() < kNear_m) b += (a - b) * ((kNear_m - b.z()) / (a.z() - b.z()));
    ScreenPoint p = view_.project(a), q = view_.project(b);
    const double length = std::hypot(q.x - p.x, q.y - p.y);
    if (length < 1e-9) return;
    // Lines lie on surfaces: 0.2 % nearer to the eye they win against the surface that carries them.
    p.inverse_depth *= 1.002;
    q.inverse_depth *= 1.002;
    const double nx = -(q.y - p.y) / length * 0.5 * line.width_px,
                 ny = (q.x - p.x) / length * 0.5 * line.width_px;
    const ScreenPoint p0{p.x + nx, p.y + ny, p.inverse_depth}, p1{p.x - nx, p.y - ny, p.inverse_depth};
    const ScreenPoint q0{q.x + nx, q.y + ny, q.inverse_depth}, q1{q.x - nx, q.y - ny, q.inverse_depth};
    triangles_.push_back({{p0, p1, q1}, owner});
    triangles_.push_back({{p0, q1, q0}, owner});
  }

  /// By band of rows, in their order; with those of one row above and below, as samples are shifted by less.
  std::vector<std::vector<ScreenTriangle>> bands(int height) const {
    std::vector<std::vector<ScreenTriangle>> result(
        static_cast<std::size_t>((height + kBandRows - 1) / kBandRows));
    for (const ScreenTriangle& one : triangles_) {
      const auto& t = one.corners;
      const auto [low, high] = std::minmax({t[0].y, t[1].y, t[2].y});
      if (!(high >= -1.0 && low <= height + 1.0)) continue;
      const int last = (height - 1) / kBandRows;
      const int from = static_cast<int>(std::max(low - 1.0, 0.0)) / kBandRows;
      const int to = static_cast<int>(std::min(high + 1.0, static_cast<double>(height))) / kBandRows;
      for (int band = from; band <= std::min(to, last); ++band)
        result[static_cast<std::size_t>(band)].push_back(one);
    }
    return result;
  }

 private:
  const View& view_;
  std::vector<ScreenTriangle> triangles_;
};

/// One pass over a band of the picture at one sample per pixel.
class Pass {
 public:
  Pass(int width, int rows)
      : width_(width),
        rows_(rows),
        inverse_depth_(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows)),
        owner_(inverse_depth_.size()) {}

  /// `dx`, `dy`: by which the picture is shifted (px); a pixel down is a row of the band, whose first is 0.
  void draw(const std::vector<ScreenTriangle>& triangles, double dx, double dy) {
    std::ranges::fill(inverse_depth_, 0.0F);
    std::ranges::fill(owner_, -1);
    for (const ScreenTriangle& triangle : triangles) {
      std::array<ScreenPoint, 3> corners = triangle.corners;
      for (ScreenPoint& corner : corners) corner.x += dx, corner.y += dy;
      for_each_pixel(corners, width_, rows_, [&](int x, int y, double inverse_depth) {
        const std::size_t pixel =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
        float& nearest = inverse_depth_[pixel];
        if (static_cast<float>(inverse_depth) > nearest) {
          nearest = static_cast<float>(inverse_depth);
          owner_[pixel] = triangle.owner;
        }
      });
    }
  }

  int owner(std::size_t pixel) const { return owner_[pixel]; }
  double depth(std::size_t pixel) const { return 1.0 / static_cast<double>(inverse_depth_[pixel]); }

 private:
  int width_, rows_;
  std::vector<float> inverse_depth_;
  std::vector<int> owner_;
};

/// Normal of a face at a point on it, by barycentric interpolation, turned to the eye.
Vec3 normal_at(const Face& face, const Vec3& p_W, const Vec3& to_eye_W) {
  const Vec3 e1 = face.p_W[1] - face.p_W[0], e2 = face.p_W[2] - face.p_W[0], d = p_W - face.p_W[0];
  const double a = e1.dot(e1), b = e1.dot(e2), c = e2.dot(e2), f = d.dot(e1), g = d.dot(e2);
  const double determinant = a * c - b * b;
  double u = 0.0, v = 0.0;
  if (determinant > 0.0) {
    u = std::clamp((c * f - b * g) / determinant, 0.0, 1.0);
    v = std::clamp((a * g - b * f) / determinant, 0.0, 1.0 - u);
  }
  const Vec3 normal =
      ((1.0 - u - v) * face.normal_W[0] + u * face.normal_W[1] + v * face.normal_W[2]).normalized();
  return normal.dot(to_eye_W) < 0.0 ? Vec3(-normal) : normal;
}

Rgb shade(const Face& face, const Vec3& p_W, const Vec3& eye_W, const Vec3& light_W,
          const ShadowMap* shadow) {
  if (!face.lit) return face.color;
  const Vec3 to_eye = (eye_W - p_W).normalized();
  const Vec3 normal = normal_at(face, p_W, to_eye);
  const double visible = shadow != nullptr ? shadow->lit(p_W, normal) : 1.0;
  const double sun = std::max(0.0, normal.dot(light_W)) * visible;
  const double sky = 0.5 + 0.5 * normal.z();              // soft light from above, weaker from below
  const double fill = std::max(0.0, normal.dot(to_eye));  // a little light from the eye shapes the shadows
  const double glint = std::pow(std::max(0.0, normal.dot((light_W + to_eye).normalized())), 40.0) * visible;
  const Rgb sun_color(0.70, 0.68, 0.64), sky_color(0.27, 0.29, 0.32), ground_color(0.15, 0.14, 0.13);
  return face.color * (sun_color * sun + sky_color * sky + ground_color * (1.0 - sky) + 0.10 * fill) +
         0.06 * glint;
}

}  // namespace

Image rasterise(const Scene& scene, const Camera& camera) {
  const View view = make_view(camera);
  const std::vector<Face> faces = world_faces(scene);
  if (!(scene.towards_light_W.norm() > 0.0))
    throw std::invalid_argument("scene: towards_light_W must not be zero");
  const Vec3 light_W = scene.towards_light_W.normalized();
  std::optional<ShadowMap> shadow;
  if (scene.shadows) shadow.emplace(faces, light_W);
  const ShadowMap* shadow_map = shadow ? &*shadow : nullptr;

  const int width = camera.width_px, height = camera.height_px, samples = camera.samples_per_axis;
  const auto all = static_cast<std::size_t>(samples) * static_cast<std::size_t>(samples);
  std::vector<Rgb> mean(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  const Rgb top = linear(scene.background_top), bottom = linear(scene.background_bottom);
  std::vector<std::array<double, 2>> shifts;
  shifts.reserve(all);
  for (int across = 0; across < samples; ++across)
    for (int along = 0; along < samples; ++along)
      shifts.push_back({(along + 0.5) / samples - 0.5, (across + 0.5) / samples - 0.5});
  const Pose X_WC = view.X_CW.inverse();
  Projection projection(view);
  for (std::size_t k = 0; k < faces.size(); ++k) projection.add(faces[k].p_W, static_cast<int>(k));
  for (std::size_t k = 0; k < scene.lines.size(); ++k)
    projection.add_line(scene.lines[k], -2 - static_cast<int>(k));
  const auto bands = projection.bands(height);
  std::vector<Pass> passes(all, Pass(width, std::min(kBandRows, height)));
  for (int first = 0; first < height; first += kBandRows) {
    for (std::size_t s = 0; s < all; ++s)
      passes[s].draw(bands[static_cast<std::size_t>(first / kBandRows)], shifts[s][0], shifts[s][1] - first);
    std::size_t pixel = 0;
    for (int y = first; y < std::min(first + kBandRows, height); ++y) {
      const double down = (y + 0.5) / height;
      for (int x = 0; x < width; ++x, ++pixel) {
        const auto color = [&](std::size_t s) -> Rgb {
          const int owner = passes[s].owner(pixel);
          if (owner == -1) return top * (1.0 - down) + bottom * down;
          const double z = passes[s].depth(pixel);
          const Vec3 p_W = X_WC * Vec3((x + 0.5 - view.center_x - shifts[s][0]) / view.focal_px * z,
                                       (y + 0.5 - view.center_y - shifts[s][1]) / view.focal_px * z, z);
          if (owner >= 0)
            return shade(faces[static_cast<std::size_t>(owner)], p_W, camera.eye_W, light_W, shadow_map);
          // Lines take no light of their own, but on a shadowed floor they must not shine.
          const double visible = shadow ? shadow->lit(p_W, Vec3::Zero()) : 1.0;
          return linear(scene.lines[static_cast<std::size_t>(-2 - owner)].color) * (0.5 + 0.5 * visible);
        };
        // Within one face the sample in the middle is like the mean.
        const int owner = passes[0].owner(pixel);
        const bool one =
            std::ranges::all_of(passes, [&](const Pass& pass) { return pass.owner(pixel) == owner; });
        Rgb& value = mean[static_cast<std::size_t>(first) * static_cast<std::size_t>(width) + pixel];
        if (one) {
          value = color(all / 2);
          continue;
        }
        value = Rgb::Zero();
        for (std::size_t s = 0; s < all; ++s) value += color(s) / static_cast<double>(all);
      }
    }
  }

  Image image{width, height, {}};
  image.rgb.reserve(3 * mean.size());
  for (std::size_t pixel = 0; pixel < mean.size(); ++pixel) {
    if (pixel > 0 && (mean[pixel] == mean[pixel - 1]).all()) {  // as in the background
      for (int channel = 0; channel < 3; ++channel) image.rgb.push_back(image.rgb[image.rgb.size() - 3]);
      continue;
    }
    for (int channel = 0; channel < 3; ++channel) {
      const double s = to_srgb(std::clamp(mean[pixel][channel], 0.0, 1.0));
      image.rgb.push_back(static_cast<std::uint8_t>(std::lround(255.0 * s)));
    }
  }
  return image;
}

}  // namespace takt::render
