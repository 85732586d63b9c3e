// glTF in several files gives what the same content gives as GLB; what a description may name beside it.
#include "server/product/gltf_files.h"

#include <gmock/gmock.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "server/geometry/mesh/glb_reader.h"
#include "server/geometry/mesh/import.h"
#include "server/product/glb_assembly.h"
#include "tests/support/glb_file.h"
#include "tests/support/temporary_directory.h"

namespace takt::product {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

class GltfFiles : public testing::Test {
 protected:
  void SetUp() override {
    const std::string glb = test::glb_cell();
    std::uint32_t length = 0;
    std::memcpy(&length, glb.data() + 12, sizeof(length));
    description_ = Json::parse(glb.substr(20, length));
    data_ = glb.substr(28 + length);
    std::filesystem::create_directories(directory_ / "cell");
  }
  std::filesystem::path file() const { return directory_ / "cell" / "cell.gltf"; }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(file().parent_path() / name, std::ios::binary) << bytes;
  }
  std::string glb_of_text(const std::string& description) const {
    std::ofstream(file()) << description;
    return glb_of_gltf(file(), 1);
  }
  std::string glb(const Json& description) const { return glb_of_text(description.dump()); }
  Json with_uri(const std::string& uri) const {
    Json result = description_;
    result["buffers"][0]["uri"] = uri;
    return result;
  }
  std::string error_of(const Json& description) const {
    try {
      glb(description);
    } catch (const MeshFault& fault) {
      return fault.what();
    }
    return "no error";
  }
  static void expect_the_cell(const std::string& glb) {
    const GlbFile file(glb), expected(test::glb_cell());
    const std::vector<NamedMesh> objects = file.objects(), others = expected.objects();
    ASSERT_EQ(objects.size(), others.size());
    ASSERT_EQ(objects.size(), 4U);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      EXPECT_EQ(objects[i].name, others[i].name);
      EXPECT_EQ(objects[i].mesh.vertices, others[i].mesh.vertices);
      EXPECT_EQ(objects[i].mesh.triangles, others[i].mesh.triangles);
    }
  }

  test::TemporaryDirectory directory_;
  Json description_;
  std::string data_;
};

TEST_F(GltfFiles, BuffersInFilesBesideItOrBelowIt) {
  write("cell.bin", data_);
  expect_the_cell(glb(with_uri("cell.bin")));
  expect_the_cell(glb(with_uri("./cell.bin")));
  write("gear box.bin", data_ + "more");
  expect_the_cell(glb(with_uri("gear%20box.bin")));
  std::filesystem::create_directories(file().parent_path() / "data");
  write("data/cell.bin", data_);
  expect_the_cell(glb(with_uri("data/cell.bin")));
  expect_the_cell(glb(with_uri("data/../cell.bin")));
}

TEST_F(GltfFiles, BuffersInTheDescription) {
  // Encoded by the tool base64 of coreutils.
  const std::string scratch = (directory_ / "b").string();
  std::ofstream(scratch, std::ios::binary) << data_;
  ASSERT_EQ(std::system(("base64 -w 0 " + scratch + " > " + scratch + ".txt").c_str()), 0);
  std::ifstream in(scratch + ".txt");
  const std::string code((std::istreambuf_iterator<char>(in)), {});
  expect_the_cell(glb(with_uri("data:application/octet-stream;base64," + code)));
  expect_the_cell(glb(with_uri("data:application/gltf-buffer;base64," + code)));
  EXPECT_THAT(error_of(with_uri("data:application/octet-stream;base64,AB*D")), HasSubstr("no base64"));
  EXPECT_THAT(error_of(with_uri("data:text/plain,abc")), HasSubstr("no base64"));
}

TEST_F(GltfFiles, SeveralBuffers) {
  // The positions in one buffer, the indices in another.
  Json two = with_uri("positions.bin");
  write("positions.bin", data_.substr(0, 48) + "xyz");
  write("indices.bin", data_.substr(48));
  two["buffers"][0]["byteLength"] = 48;
  two["buffers"].push_back({{"uri", "indices.bin"}, {"byteLength", 24}});
  two["bufferViews"][1] = {{"buffer", 1}, {"byteLength", 24}};
  expect_the_cell(glb(two));
  two["bufferViews"][1]["byteLength"] = 25;
  EXPECT_THAT(error_of(two), HasSubstr("bufferViews[1]: byteOffset 0 and byteLength 25"));
  two["bufferViews"][1] = {{"buffer", 2}, {"byteLength", 24}};
  EXPECT_THAT(error_of(two), HasSubstr("bufferViews[1]: its buffer is 2, there are 2"));
}

TEST_F(GltfFiles, NamesOfWhatLiesElsewhereAreRefused) {
  std::ofstream(directory_ / "secret.bin", std::ios::binary) << data_;
  write("cell.bin", data_);
  std::filesystem::create_symlink(directory_ / "secret.bin", file().parent_path() / "link.bin");
  for (const std::string& uri :
       {std::string("../secret.bin"), std::string("%2e%2e/secret.bin"), std::string("data/../../secret.bin"),
        (directory_ / "secret.bin").string(), (file().parent_path() / "cell.bin").string(),
        "file://" + (directory_ / "secret.bin").string(), std::string("http://127.0.0.1/cell.bin"),
        std::string("link.bin"), std::string("../cell2/cell.bin")})
    EXPECT_THAT(error_of(with_uri(uri)),
                testing::AllOf(HasSubstr("buffers[0]: its uri is '" + uri + "'"),
                               HasSubstr("allowed: a file in the folder of the glTF file or below it")));
}

TEST_F(GltfFiles, WhatIsMissingIsNamed) {
  EXPECT_THAT(error_of(with_uri("cell.bin")), HasSubstr("there is no such file beside the glTF file"));
  EXPECT_THAT(error_of(with_uri(".")), HasSubstr("there is no such file"));
  EXPECT_THAT(error_of(description_), HasSubstr("buffers[0]: it has no uri"));
  write("cell.bin", data_.substr(0, 71));
  EXPECT_THAT(error_of(with_uri("cell.bin")), HasSubstr("its byteLength is 72, but there are 71 bytes"));
  write("large.bin", std::string(3 << 20, 'x'));
  EXPECT_THAT(error_of(with_uri("large.bin")), HasSubstr("it has more than 1 MB"));
  for (const char* text : {"", "{", "[]", "3", "{\"buffers\":{}}", "{\"buffers\":[3]}",
                           "{\"bufferViews\":[3]}", "{\"bufferViews\":[{\"buffer\":-1}]}"})
    EXPECT_THROW(glb_of_text(text), MeshFault) << text;
  EXPECT_THROW(glb_of_text(std::string(100'000, '[') + std::string(100'000, ']')), MeshFault);
  std::filesystem::remove(file());
  EXPECT_THROW(glb_of_gltf(file()), MeshFault);
}

TEST_F(GltfFiles, AnAssemblyIsThatOfTheGlbFile) {
  write("cell.bin", data_);
  std::ofstream(file()) << with_uri("cell.bin").dump();
  std::ofstream(directory_ / "cell.glb", std::ios::binary) << test::glb_cell();
  const Product one = read_glb_assembly(file()), other = read_glb_assembly(directory_ / "cell.glb");
  EXPECT_EQ(one.notes, other.notes);
  EXPECT_EQ(one.source, std::filesystem::absolute(file()).string());
  ASSERT_EQ(one.instances.size(), other.instances.size());
  ASSERT_EQ(one.instances.size(), 3U);  // the mesh of the plate is open
  for (std::size_t i = 0; i < one.instances.size(); ++i) {
    EXPECT_EQ(one.instances[i].path, other.instances[i].path);
    EXPECT_EQ(one.instances[i].X_WB, other.instances[i].X_WB);
  }
  write("cell.bin", "");
  try {
    read_glb_assembly(file());
    ADD_FAILURE() << "no error";
  } catch (const MeshError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("cell.gltf: buffers[0]: its byteLength is 72, but there are 0 bytes"));
  }
}

}  // namespace
}  // namespace takt::product
