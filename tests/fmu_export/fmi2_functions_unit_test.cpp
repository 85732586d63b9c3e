// The library of exported cells as importers of FMI 2.0 call it: phases, types, limits, states, messages.
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <regex>

#include "server/fmu/fmu_archive.h"
#include "server/fmu/standard/fmi2FunctionTypes.h"
#include "server/fmu_export/exporter.h"
#include "server/scenario/scenario_reader.h"
#include "tests/support/temporary_directory.h"

namespace takt {
namespace {

using testing::HasSubstr;

const std::filesystem::path kExportedLibrary =
    std::filesystem::path(TAKT_BIN_DIR).parent_path() / "lib/takt/takt_cell.so";

std::string logged_format, logged_text;

void log_message(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String message, ...) {
  std::array<char, 1000> text{};
  va_list arguments;
  va_start(arguments, message);
  std::vsnprintf(text.data(), text.size(), message, arguments);
  va_end(arguments);
  logged_format = message, logged_text = text.data();
}

template <class Type>
Type* function(const char* name) {
  void* library = ::dlopen(kExportedLibrary.c_str(), RTLD_NOW | RTLD_LOCAL);
  EXPECT_NE(library, nullptr) << ::dlerror();
  return library == nullptr ? nullptr : reinterpret_cast<Type*>(::dlsym(library, name));
}

/// Importers print the format or what it becomes.
TEST(Fmi2Functions, AMessageIsWholeWithAndWithoutFormatting) {
  const auto instantiate = function<fmi2InstantiateTYPE>("fmi2Instantiate");
  ASSERT_NE(instantiate, nullptr);
  const fmi2CallbackFunctions callbacks{&log_message, &std::calloc, &std::free, nullptr, nullptr};
  EXPECT_EQ(instantiate("one", fmi2CoSimulation, "guid", "file:///no/such/folder/of/100%25d", &callbacks,
                        fmi2False, fmi2False),
            nullptr);
  EXPECT_THAT(logged_text, HasSubstr("/no/such/folder/of/100%d"));
  EXPECT_THAT(logged_format, HasSubstr("/no/such/folder/of/100"));
}

/// A tank of Lua whose level is the integral of its inflow: inputs inflow (0), open (1); output level (2); time (3).
class Fmi2Phases : public testing::Test {
 protected:
  void SetUp() override {
    directory_.write("tank.lua",
                     "input('inflow', {lower = 0, upper = 2})\n"
                     "input('open', {type = 'boolean'})\n"
                     "differential('level', {initial = 0})\n"
                     "output('level', {state = 'level'})\n"
                     "function derivatives(t, x, inputs) return {level = inputs.inflow} end\n");
    directory_.write("cell.yaml",
                     "takt_scenario: 1\nname: tank\nsolver: {step_s: 0.01}\n"
                     "lua_devices: {Tank: {file: tank.lua}}\n");
    FmuExportOptions options;
    options.library = kExportedLibrary;
    options.file = directory_ / "tank.fmu";
    options.inputs = {"Tank.*"}, options.outputs = {"Tank.*"};
    export_fmu(read_scenario(directory_ / "cell.yaml"), options);
    unpack_fmu(options.file, directory_ / "fmu");
    std::ifstream description(directory_ / "fmu/modelDescription.xml");
    const std::string xml{std::istreambuf_iterator<char>(description), {}};
    std::smatch found;
    ASSERT_TRUE(std::regex_search(xml, found, std::regex("guid=\"([^\"]*)\"")));
    guid_ = found[1];
    one_ = instance();
    ASSERT_NE(one_, nullptr) << logged_text;
  }
  void TearDown() override {
    if (one_ != nullptr) free_instance_(one_);
  }
  fmi2Component instance() {
    return function<fmi2InstantiateTYPE>("fmi2Instantiate")(
        "one", fmi2CoSimulation, guid_.c_str(), ("file://" + (directory_ / "fmu/resources").string()).c_str(),
        &callbacks_, fmi2False, fmi2False);
  }
  void initialise(fmi2Component c, double start_s = 0.0, bool ends = false, double stop_s = 0.0) {
    ASSERT_EQ(setup_(c, fmi2False, 0.0, start_s, ends ? fmi2True : fmi2False, stop_s), fmi2OK) << logged_text;
    ASSERT_EQ(enter_(c), fmi2OK) << logged_text;
    ASSERT_EQ(exit_(c), fmi2OK) << logged_text;
  }
  fmi2Status set(fmi2ValueReference variable, double value) { return set_real_(one_, &variable, 1, &value); }
  double get(fmi2Component c, fmi2ValueReference variable) {
    double value = std::nan("");
    EXPECT_EQ(get_real_(c, &variable, 1, &value), fmi2OK) << logged_text;
    return value;
  }

  test::TemporaryDirectory directory_;
  std::string guid_;
  fmi2CallbackFunctions callbacks_{&log_message, &std::calloc, &std::free, nullptr, nullptr};
  fmi2Component one_ = nullptr;
  fmi2FreeInstanceTYPE* free_instance_ = function<fmi2FreeInstanceTYPE>("fmi2FreeInstance");
  fmi2SetupExperimentTYPE* setup_ = function<fmi2SetupExperimentTYPE>("fmi2SetupExperiment");
  fmi2EnterInitializationModeTYPE* enter_ =
      function<fmi2EnterInitializationModeTYPE>("fmi2EnterInitializationMode");
  fmi2ExitInitializationModeTYPE* exit_ =
      function<fmi2ExitInitializationModeTYPE>("fmi2ExitInitializationMode");
  fmi2TerminateTYPE* terminate_ = function<fmi2TerminateTYPE>("fmi2Terminate");
  fmi2ResetTYPE* reset_ = function<fmi2ResetTYPE>("fmi2Reset");
  fmi2DoStepTYPE* step_ = function<fmi2DoStepTYPE>("fmi2DoStep");
  fmi2SetRealTYPE* set_real_ = function<fmi2SetRealTYPE>("fmi2SetReal");
  fmi2GetRealTYPE* get_real_ = function<fmi2GetRealTYPE>("fmi2GetReal");
  fmi2SetBooleanTYPE* set_boolean_ = function<fmi2SetBooleanTYPE>("fmi2SetBoolean");
  fmi2GetIntegerTYPE* get_integer_ = function<fmi2GetIntegerTYPE>("fmi2GetInteger");
  fmi2GetFMUstateTYPE* get_state_ = function<fmi2GetFMUstateTYPE>("fmi2GetFMUstate");
  fmi2SetFMUstateTYPE* set_state_ = function<fmi2SetFMUstateTYPE>("fmi2SetFMUstate");
  fmi2FreeFMUstateTYPE* free_state_ = function<fmi2FreeFMUstateTYPE>("fmi2FreeFMUstate");
  fmi2SerializedFMUstateSizeTYPE* state_size_ =
      function<fmi2SerializedFMUstateSizeTYPE>("fmi2SerializedFMUstateSize");
  fmi2SerializeFMUstateTYPE* serialise_ = function<fmi2SerializeFMUstateTYPE>("fmi2SerializeFMUstate");
  fmi2DeSerializeFMUstateTYPE* deserialise_ =
      function<fmi2DeSerializeFMUstateTYPE>("fmi2DeSerializeFMUstate");
};

TEST_F(Fmi2Phases, CallsInTheWrongOrderAreRefusedAndChangeNothing) {
  EXPECT_EQ(step_(one_, 0.0, 0.01, fmi2True), fmi2Error);
  EXPECT_EQ(logged_text, "a step was called while the FMU is instantiated; allowed: while it is initialised");
  EXPECT_EQ(exit_(one_), fmi2Error);
  EXPECT_EQ(terminate_(one_), fmi2Error);
  initialise(one_);
  EXPECT_EQ(enter_(one_), fmi2Error);
  EXPECT_EQ(setup_(one_, fmi2False, 0.0, 0.0, fmi2False, 0.0), fmi2Error);
  EXPECT_EQ(step_(one_, 0.5, 0.01, fmi2True), fmi2Error);
  EXPECT_EQ(logged_text, "the step begins at 0.5 s; the cell is at 0 s");
  ASSERT_EQ(set(0, 1.5), fmi2OK) << logged_text;
  ASSERT_EQ(step_(one_, 0.0, 0.02, fmi2True), fmi2OK) << logged_text;
  EXPECT_NEAR(get(one_, 2), 0.03, 1e-12);
  ASSERT_EQ(terminate_(one_), fmi2OK);
  EXPECT_EQ(step_(one_, 0.02, 0.01, fmi2True), fmi2Error);
  EXPECT_EQ(set(0, 1.0), fmi2Error);
  EXPECT_THAT(logged_text, HasSubstr("while the FMU is terminated"));
  EXPECT_NEAR(get(one_, 2), 0.03, 1e-12);
  ASSERT_EQ(reset_(one_), fmi2OK);
  initialise(one_);
  EXPECT_EQ(get(one_, 2), 0.0);
}

TEST_F(Fmi2Phases, InputsHaveTheirTypesAndLimits) {
  initialise(one_);
  for (const double bad : {-0.5, 2.5, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(set(0, bad), fmi2Error) << bad;
  EXPECT_EQ(logged_text, "the input 'Tank.inflow': found inf; allowed: from 0 to 2");
  EXPECT_EQ(get(one_, 0), 0.0);
  EXPECT_EQ(set(2, 1.0), fmi2Error);
  EXPECT_EQ(logged_text, "variable 2 is no input");
  EXPECT_EQ(set(1, 1.0), fmi2Error);
  EXPECT_EQ(logged_text, "the variable 'Tank.open' is boolean; found a function for what is real");
  const fmi2ValueReference open = 1, none = 9;
  fmi2Boolean flag = 7;  // not 0: true
  EXPECT_EQ(set_boolean_(one_, &open, 1, &flag), fmi2OK) << logged_text;
  fmi2Integer whole = 0;
  EXPECT_EQ(get_integer_(one_, &none, 1, &whole), fmi2Error);
  EXPECT_EQ(logged_text, "there is no variable 9");
  ASSERT_EQ(step_(one_, 0.0, 0.01, fmi2True), fmi2OK) << logged_text;
}

TEST_F(Fmi2Phases, TheExperimentBeginsAndEndsWhenTheImporterSays) {
  initialise(one_, 3.0, true, 3.05);
  EXPECT_EQ(get(one_, 3), 3.0);
  ASSERT_EQ(set(0, 1.0), fmi2OK);
  ASSERT_EQ(step_(one_, 3.0, 0.05, fmi2True), fmi2OK) << logged_text;
  EXPECT_NEAR(get(one_, 2), 0.05, 1e-12);
  EXPECT_NEAR(get(one_, 3), 3.05, 1e-12);
  EXPECT_EQ(step_(one_, 3.05, 0.01, fmi2True), fmi2Error);
  EXPECT_EQ(logged_text, "the step ends at 3.06 s; allowed: up to the end of the experiment, 3.05 s");
}

TEST_F(Fmi2Phases, AStateCarriesThePhaseToAnotherInstance) {
  initialise(one_, 1.0);
  ASSERT_EQ(set(0, 2.0), fmi2OK);
  ASSERT_EQ(step_(one_, 1.0, 0.1, fmi2True), fmi2OK) << logged_text;
  fmi2FMUstate state = nullptr;
  ASSERT_EQ(get_state_(one_, &state), fmi2OK) << logged_text;
  std::size_t size = 0;
  ASSERT_EQ(state_size_(one_, state, &size), fmi2OK);
  std::vector<fmi2Byte> bytes(size);
  EXPECT_EQ(serialise_(one_, state, bytes.data(), size - 1), fmi2Error);
  ASSERT_EQ(serialise_(one_, state, bytes.data(), size), fmi2OK);
  EXPECT_EQ(free_state_(one_, &state), fmi2OK);
  EXPECT_EQ(state, nullptr);
  EXPECT_EQ(free_state_(one_, nullptr), fmi2OK);
  EXPECT_EQ(set_state_(one_, nullptr), fmi2Error);
  const fmi2Component other = instance();
  ASSERT_NE(other, nullptr) << logged_text;
  fmi2FMUstate copy = nullptr;
  ASSERT_EQ(deserialise_(other, bytes.data(), size, &copy), fmi2OK);
  ASSERT_EQ(set_state_(other, copy), fmi2OK) << logged_text;
  ASSERT_EQ(step_(other, 1.1, 0.1, fmi2True), fmi2OK) << logged_text;
  ASSERT_EQ(step_(one_, 1.1, 0.1, fmi2True), fmi2OK) << logged_text;
  EXPECT_EQ(get(other, 2), get(one_, 2));
  EXPECT_NEAR(get(other, 2), 0.4, 1e-12);
  bytes.resize(size / 2);
  ASSERT_EQ(deserialise_(other, bytes.data(), bytes.size(), &copy), fmi2OK);
  EXPECT_EQ(set_state_(other, copy), fmi2Error);
  EXPECT_NEAR(get(other, 2), 0.4, 1e-12);
  free_state_(other, &copy);
  free_instance_(other);
}

}  // namespace
}  // namespace takt
