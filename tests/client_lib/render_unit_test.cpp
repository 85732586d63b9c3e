// The picture renderer: nearer surfaces hide farther ones, light and shadow are where geometry puts them, and
// libpng reads the file back as drawn.
#include "client_lib/render/renderer.h"

#include <gtest/gtest.h>
#include <png.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <stdexcept>

namespace takt::render {
namespace {

using Pixel = std::array<int, 3>;

Pixel pixel_at(const Image& image, int x, int y) {
  const std::size_t first =
      3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x));
  return {image.rgb[first], image.rgb[first + 1], image.rgb[first + 2]};
}

/// A square of side 2 * half in the plane x = `x`, seen by a camera on the x axis.
Mesh wall(double x, double half, const Color& color, double y = 0.0) {
  Mesh mesh;
  mesh.color = color;
  mesh.lit = false;
  mesh.X_WB.p = Vec3(x, y, 0.0);
  mesh.vertices = {{0.0, -half, -half}, {0.0, half, -half}, {0.0, half, half}, {0.0, -half, half}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

/// 90 degrees of view at distance 1 from the origin: the plane x = 0 shows y, z in -1..1 on 100 x 100
/// pixels.
Camera front_camera() {
  Camera camera;
  camera.eye_W = Vec3(1.0, 0.0, 0.0);
  camera.target_W = Vec3::Zero();
  camera.vertical_view_rad = 0.5 * std::numbers::pi;
  camera.width_px = 100;
  camera.height_px = 100;
  camera.samples_per_axis = 1;
  return camera;
}

const Color kRed{1.0, 0.0, 0.0}, kBlue{0.0, 0.0, 1.0};
const Pixel kRedPixel{255, 0, 0}, kBluePixel{0, 0, 255};

TEST(Render, ANearTriangleHidesAFarOneInAnyOrder) {
  const Mesh red = wall(0.5, 0.25, kRed);   // at distance 0.5: covers the middle half of the picture
  const Mesh blue = wall(0.0, 0.8, kBlue);  // at distance 1: covers 80 %
  for (const auto& meshes : {std::vector<Mesh>{red, blue}, std::vector<Mesh>{blue, red}}) {
    Scene scene;
    scene.meshes = meshes;
    const Image image = rasterise(scene, front_camera());
    EXPECT_EQ(pixel_at(image, 50, 50), kRedPixel);
    EXPECT_EQ(pixel_at(image, 26, 50), kRedPixel);
    EXPECT_EQ(pixel_at(image, 23, 50), kBluePixel);
    EXPECT_EQ(pixel_at(image, 11, 50), kBluePixel);
    EXPECT_NE(pixel_at(image, 8, 50), kBluePixel);  // background
    EXPECT_NE(pixel_at(image, 8, 50), kRedPixel);
  }
}

TEST(Render, ThePictureIsNotMirrored) {
  Scene scene;
  scene.meshes = {wall(0.0, 0.1, kRed, 0.5), wall(0.0, 0.1, kBlue)};
  scene.meshes[1].X_WB.p = Vec3(0.0, 0.0, 0.5);
  const Image image = rasterise(scene, front_camera());
  EXPECT_EQ(pixel_at(image, 75, 50), kRedPixel);   // seen from +x, +y is to the right
  EXPECT_EQ(pixel_at(image, 50, 25), kBluePixel);  // +z is up
}

TEST(Render, IntersectingWallsMeetInTheirLine) {
  // A wall through the vertical line y = 0, turned by 45 degrees: its half with y > 0 is in front of the wall
  // x = 0.
  Mesh turned = wall(0.0, 0.4, kRed);
  turned.X_WB.R = Eigen::AngleAxisd(-0.25 * std::numbers::pi, Vec3::UnitZ()).toRotationMatrix();
  Scene scene;
  scene.meshes = {wall(0.0, 0.9, kBlue), turned};
  const Image image = rasterise(scene, front_camera());
  EXPECT_EQ(pixel_at(image, 52, 50), kRedPixel);
  EXPECT_EQ(pixel_at(image, 47, 50), kBluePixel);
}

TEST(Render, ATriangleThroughTheEyePlaneIsClipped) {
  Mesh floor;
  floor.color = kRed;
  floor.lit = false;
  floor.vertices = {{-50.0, -50.0, -0.5}, {50.0, -50.0, -0.5}, {50.0, 50.0, -0.5}, {-50.0, 50.0, -0.5}};
  floor.triangles = {{0, 1, 2}, {0, 2, 3}};
  Scene scene;
  scene.meshes = {floor};
  const Image image = rasterise(scene, front_camera());
  for (int x = 0; x < 100; x += 9) {
    EXPECT_EQ(pixel_at(image, x, 99), kRedPixel);
    EXPECT_EQ(pixel_at(image, x, 53), kRedPixel);
    EXPECT_NE(pixel_at(image, x, 45), kRedPixel);
  }
}

TEST(Render, EdgesAreAntiAliased) {
  Scene scene;
  scene.background_top = scene.background_bottom = {0.0, 0.0, 0.0};
  Mesh half = wall(0.0, 2.0, {1.0, 1.0, 1.0}, 2.01);  // white right of pixel 50.5
  scene.meshes = {half};
  Camera camera = front_camera();
  camera.samples_per_axis = 4;
  const Pixel mixed = pixel_at(rasterise(scene, camera), 50, 50);
  EXPECT_EQ(mixed[0], 188);  // half the light, in sRGB
  EXPECT_EQ(pixel_at(rasterise(scene, camera), 49, 50)[0], 0);
  EXPECT_EQ(pixel_at(rasterise(scene, camera), 51, 50)[0], 255);
}

TEST(Render, LinesLieOnTheirSurfaceAndBehindOthers) {
  Scene scene;
  scene.meshes = {wall(0.0, 0.9, kBlue), wall(0.5, 0.1, {0.0, 1.0, 0.0})};
  scene.lines.push_back({Vec3(0.0, -0.8, 0.0), Vec3(0.0, 0.8, 0.0), kRed, 3.0});
  const Image image = rasterise(scene, front_camera());
  EXPECT_EQ(pixel_at(image, 20, 50), kRedPixel);
  EXPECT_EQ(pixel_at(image, 20, 54), kBluePixel);
  EXPECT_EQ(pixel_at(image, 50, 50), (Pixel{0, 255, 0}));
}

TEST(Render, TheShadowFallsAwayFromTheLight) {
  Scene scene;
  add_floor(scene, Vec3::Zero(), 4.0, 10.0);
  scene.lines.clear();
  scene.meshes.push_back(make_box(Pose{Mat3::Identity(), Vec3(0.0, 0.0, 1.0)}, Vec3(0.4, 0.4, 0.1), kRed));
  scene.towards_light_W = Vec3(1.0, 0.0, 1.0);  // shadow of the box around x = -1
  Camera camera = front_camera();
  camera.eye_W = Vec3(-0.4, 0.0, 3.0);
  camera.target_W = Vec3(-0.4, 0.0, 0.0);
  // Straight down the picture's right is world x; one pixel is 0.06 m at the floor.
  const auto brightness = [&](double x, double y) {
    const Image image = rasterise(scene, camera);
    return pixel_at(image, static_cast<int>(50 + (x + 0.4) / 0.06), static_cast<int>(50 - y / 0.06))[1];
  };
  const int in_shadow = brightness(-1.0, 0.0), in_light = brightness(-1.0, 0.8);
  EXPECT_LT(in_shadow, in_light - 40);
  scene.shadows = false;
  EXPECT_NEAR(brightness(-1.0, 0.0), brightness(-1.0, 0.8), 5);
}

TEST(Render, CapsuleAndCylinderHaveTheirVolume) {
  const auto volume = [](const Mesh& mesh) {
    double sum = 0.0;  // divergence theorem; positive only if triangles face outwards
    for (const auto& t : mesh.triangles) {
      sum += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]])) / 6.0;
    }
    return sum;
  };
  const double r = 0.1, l = 0.5, pi = std::numbers::pi;
  const Vec3 from(0.3, 0.2, 0.1), to = from + l * Vec3(1.0, 2.0, -2.0) / 3.0;
  const double capsule = volume(make_capsule(from, to, r, kRed)),
               exact = pi * r * r * l + 4.0 / 3.0 * pi * r * r * r;
  EXPECT_NEAR(capsule, exact, 0.01 * exact);
  EXPECT_NEAR(volume(make_cylinder(from, to, r, kRed)), pi * r * r * l, 0.02 * pi * r * r * l);
  EXPECT_NEAR(volume(make_box(Pose{}, Vec3(1.0, 2.0, 3.0), kRed)), 6.0, 1e-12);
  EXPECT_LT((make_capsule(from, to, r, kRed).X_WB * Vec3(0.0, 0.0, l) - to).norm(), 1e-12);
}

TEST(Render, ABoxHasTwelveEdges) {
  Scene scene;
  add_edges(scene, make_box(Pose{}, Vec3(1.0, 1.0, 1.0), kRed), 0.5, kBlue, 1.0);
  EXPECT_EQ(scene.lines.size(), 12U);
}

// A prism of 24 flats: normals of its wall are radial, those of its ends along the axis.
TEST(Render, FlatsOfACylinderLookCurvedAndItsRimsSharp) {
  constexpr std::uint32_t kFlats = 24;
  Mesh prism;
  for (std::uint32_t i = 0; i < kFlats; ++i)
    for (const double z : {-1.0, 1.0}) {
      const double angle = 2.0 * std::numbers::pi * i / kFlats;
      prism.vertices.emplace_back(std::cos(angle), std::sin(angle), z);
    }
  prism.vertices.emplace_back(0.0, 0.0, 1.0);
  for (std::uint32_t i = 0; i < kFlats; ++i) {
    const std::uint32_t low = 2 * i, next = 2 * ((i + 1) % kFlats);
    prism.triangles.push_back({low, next, next + 1});
    prism.triangles.push_back({low, next + 1, low + 1});
    prism.triangles.push_back({2 * kFlats, low + 1, next + 1});
  }
  smooth(prism, 0.3);
  ASSERT_EQ(prism.normals.size(), prism.vertices.size());
  for (std::size_t t = 0; t < prism.triangles.size(); ++t)
    for (const std::uint32_t corner : prism.triangles[t]) {
      const Vec3 p = prism.vertices[corner];
      const Vec3 expected = t % 3 == 2 ? Vec3(0.0, 0.0, 1.0) : Vec3(p.x(), p.y(), 0.0);
      // Two triangles of one flat and one of its neighbour meet at a corner: a ninth of a flat's turn at most.
      EXPECT_GT(prism.normals[corner].dot(expected), std::cos(2.0 * std::numbers::pi / kFlats / 3.0));
    }
  // Below the angle between the flats it stays a prism.
  Mesh flat = prism;
  smooth(flat, 0.2);
  EXPECT_LT(flat.normals[0].dot(prism.normals[0]), 1.0 - 1e-4);
}

TEST(Render, AnArmReachesFromBaseToFlange) {
  ArmModel arm;
  JointModel joint;
  joint.axis = Vec3::UnitY();
  joint.X_PJ.p = Vec3(0.0, 0.0, 0.3);
  arm.joints = {joint, joint};
  arm.X_JF.p = Vec3(0.0, 0.0, 0.4);
  const std::array<double, 2> q{0.5 * std::numbers::pi, 0.0};  // up, then forward along x
  Scene scene;
  add_arm(scene, arm, q.data(), Pose{Mat3::Identity(), Vec3(0.0, 0.0, 0.7)}, kRed, kBlue);
  Eigen::AlignedBox3d box;
  for (const Mesh& mesh : scene.meshes) {
    for (const Vec3& p_B : mesh.vertices) box.extend(mesh.X_WB * p_B);
  }
  EXPECT_NEAR(box.min().z(), 0.7, 1e-9);
  EXPECT_NEAR(box.max().x(), 0.7, 0.05);  // 0.3 + 0.4, and the round end
  EXPECT_NEAR(box.max().z(), 1.0, 0.1);
}

TEST(Render, ThePngHoldsTheDrawnPixels) {
  Scene scene;
  scene.meshes = {wall(0.0, 0.5, kRed)};
  const std::string file = testing::TempDir() + "takt_render_test.png";
  render(scene, front_camera(), file);
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&header, file.c_str()), 0) << header.message;
  header.format = PNG_FORMAT_RGB;
  ASSERT_EQ(header.width, 100U);
  ASSERT_EQ(header.height, 100U);
  Image read{100, 100, std::vector<std::uint8_t>(PNG_IMAGE_SIZE(header))};
  ASSERT_NE(png_image_finish_read(&header, nullptr, read.rgb.data(), 0, nullptr), 0) << header.message;
  EXPECT_EQ(read.rgb, rasterise(scene, front_camera()).rgb);
  std::filesystem::remove(file);
}

TEST(Render, InvalidInputIsNamed) {
  const auto message = [](const Scene& scene, const Camera& camera) {
    try {
      rasterise(scene, camera);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("nothing thrown");
  };
  Scene scene;
  scene.meshes = {wall(0.0, 0.5, kRed)};
  scene.meshes[0].triangles.push_back({0, 1, 9});
  EXPECT_EQ(message(scene, front_camera()), "mesh 0: a triangle names vertex 9 of 4");
  Camera camera = front_camera();
  camera.target_W = camera.eye_W;
  EXPECT_EQ(message(Scene{}, camera), "camera: eye_W and target_W must be two different points");
  camera = front_camera();
  camera.width_px = 0;
  EXPECT_EQ(message(Scene{}, camera), "camera: width_px, height_px and samples_per_axis must be at least 1");
  EXPECT_THROW(write_png(Image{1, 1, {0, 0, 0}}, testing::TempDir() + "no_such_folder/x.png"),
               std::runtime_error);
}

}  // namespace
}  // namespace takt::render
