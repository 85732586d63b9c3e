// Systems of FMUs in one file (SSP): a DC motor of two FMUs against the same FMUs, stepped here by hand; transformations,
// units, parameter sets, and what takt does not do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <numbers>

#include "server/fmu/model_description.h"
#include "server/fmu/ssp_file.h"
#include "tests/support/device_cell.h"
#include "tests/support/fmu_cell.h"
#include "tests/support/zip_file.h"

namespace takt::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string connector(const std::string& name, const std::string& kind,
                      const std::string& type = "<ssc:Real/>") {
  return "<ssd:Connector name='" + name + "' kind='" + kind + "'>" + type + "</ssd:Connector>";
}

/// A system; each text is a part of it.
struct System {
  std::string ports = connector("u", "input", "<ssc:Real unit='V'/>") +
                      connector("speed", "output", "<ssc:Real unit='rpm'/>");
  std::string winding_values =
      "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version='1.0' "
      "name='p'>"
      "<ssv:Parameters><ssv:Parameter name='R'><ssv:Real value='2'/></ssv:Parameter>"
      "<ssv:Parameter name='k'><ssv:Real value='0.5'/></ssv:Parameter>"
      "<ssv:Parameter name='colour'><ssv:String value='red'/></ssv:Parameter></ssv:Parameters>"
      "</ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></ssd:ParameterBindings>";
  std::string system_values =
      "<ssd:ParameterBindings><ssd:ParameterBinding source='resources/system.ssv'/></ssd:ParameterBindings>";
  std::string elements;  ///< besides the two
  std::string connections =
      "<ssd:Connection startElement='' startConnector='u' endElement='winding 1' endConnector='u'/>"
      "<ssd:Connection startElement='winding 1' startConnector='tau' endElement='rotor' endConnector='tau'>"
      "<ssc:LinearTransformation factor='0.5' offset='0.01'/></ssd:Connection>"
      "<ssd:Connection startElement='winding 1' startConnector='w' endElement='rotor' endConnector='w'/>"
      "<ssd:Connection startElement='rotor' startConnector='w' endConnector='speed'/>";
  std::string rest;
  std::string rotor_source = "resources/rotor.fmu";

  std::string xml() const {
    return "<?xml version='1.0' encoding='UTF-8'?>\n<ssd:SystemStructureDescription version='1.0' "
           "name='motor'"
           " xmlns:ssd='http://ssp-standard.org/SSP1/SystemStructureDescription'"
           " xmlns:ssc='http://ssp-standard.org/SSP1/SystemStructureCommon'"
           " xmlns:ssv='http://ssp-standard.org/SSP1/SystemStructureParameterValues'>\n<ssd:System "
           "name='motor'>\n"
           "<ssd:Connectors>" +
           ports + "</ssd:Connectors>\n" + system_values +
           "\n<ssd:Elements>\n<ssd:Component name='winding 1'"
           " type='application/x-fmu-sharedlibrary' source='resources/winding.fmu'><ssd:Connectors>" +
           connector("u", "input") + connector("w", "input") + connector("tau", "output") +
           connector("R", "parameter") +
           "</ssd:Connectors><ssd:ElementGeometry x1='0' y1='0' x2='1' y2='1'/>" + winding_values +
           "</ssd:Component>\n<ssd:Component name='rotor' source='" + rotor_source + "'><ssd:Connectors>" +
           connector("tau", "input") + connector("w", "output", "<ssc:Real unit='rad/s'/>") +
           "</ssd:Connectors></ssd:Component>\n" + elements + "</ssd:Elements>\n<ssd:Connections>\n" +
           connections + "\n</ssd:Connections>\n</ssd:System>\n" +
           "<ssd:Units><ssc:Unit name='rad/s'><ssc:BaseUnit rad='1' s='-1'/></ssc:Unit>"
           "<ssc:Unit name='rpm'><ssc:BaseUnit rad='1' s='-1' factor='0.10471975511965977'/></ssc:Unit>"
           "<ssc:Unit name='V'><ssc:BaseUnit kg='1' m='2' s='-3' A='-1'/></ssc:Unit></ssd:Units>" +
           rest + "</ssd:SystemStructureDescription>\n";
  }
};

const std::string kSystemSet =
    "<ssv:ParameterSet version='1.0' name='s' "
    "xmlns:ssv='http://ssp-standard.org/SSP1/SystemStructureParameterValues'>"
    "<ssv:Parameters><ssv:Parameter name='u'><ssv:Real value='12'/></ssv:Parameter>"
    "<ssv:Parameter name='winding 1.k'><ssv:Real value='0.2'/></ssv:Parameter>"
    "<ssv:Parameter name='rotor.J'><ssv:Real "
    "value='0.002'/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>";

std::shared_ptr<const CellModel> load_xml(const std::string& xml, const std::string& keys = "",
                                          const std::string& more = "",
                                          const std::string& system_set = kSystemSet,
                                          const std::vector<ZipEntry>& further = {}) {
  const TemporaryDirectory directory;
  std::vector<ZipEntry> files{{"SystemStructure.ssd", xml},
                              {"resources/system.ssv", system_set},
                              {"resources/winding.fmu", bytes_of(kTestFmus / "winding.fmu")},
                              {"resources/drive/winding.fmu", bytes_of(kTestFmus / "winding.fmu")},
                              {"resources/rotor.fmu", bytes_of(kTestFmus / "rotor.fmu")}};
  files.insert(files.end(), further.begin(), further.end());
  write_zip(directory / "motor.ssp", files);
  directory.write("cell.yaml",
                  "takt_scenario: 1\nname: ssp\nsolver: {step_s: 0.001}\nssp: {Motor: {file: motor.ssp" +
                      keys + "}}\n" + more);
  FmuLibrary library(directory.path(), kFmuHost);
  ImportOptions import;
  import.fmus = &library;
  return load_cell(directory / "cell.yaml", {}, import);
}

std::shared_ptr<const CellModel> load_system(const System& system, const std::string& keys = "",
                                             const std::string& more = "") {
  return load_xml(system.xml(), keys, more);
}

/// One of the FMUs without a cell.
struct ByHand {
  std::unique_ptr<FmuLink> link;
  std::vector<double> outputs;

  ByHand(const std::string& name, const std::map<std::string, std::string>& parameters,
         const std::vector<FmuWire>& inputs, const std::vector<FmuWire>& results) {
    FmuLibrary library(kTestFmus, kFmuHost);
    FmuRequest request;
    request.device = name;
    request.file = kTestFmus / (name + ".fmu");
    request.step_s = 0.001;
    request.parameters = parameters;
    request.inputs = inputs, request.outputs = results;
    request.place = [](const std::string& key) { return key; };
    const FmuOffer offer = library.open(request);
    outputs = offer.output_start;
    link = offer.make();
    EXPECT_EQ(link->restart(outputs), "");
  }
};

TEST(Ssp, ASystemOfTwoFmusHasTheBitsOfTheirStepsByHand) {
  DeviceCell cell(load_system({}));
  ByHand winding("winding", {{"R", "2"}, {"k", "0.2"}}, {{"", "u"}, {"", "w"}}, {{"", "tau"}});
  ByHand rotor("rotor", {{"J", "0.002"}}, {{"", "tau"}}, {{"", "w"}});
  for (int i = 0; i < 300; ++i) {
    const double torque = 0.5 * winding.outputs[0] + 0.01, speed = rotor.outputs[0];
    const double to_winding[] = {12.0, speed}, to_rotor[] = {torque};
    ASSERT_EQ(winding.link->step(1e-3 * i, 1e-3, to_winding, winding.outputs), "");
    ASSERT_EQ(rotor.link->step(1e-3 * i, 1e-3, to_rotor, rotor.outputs), "");
    ASSERT_TRUE(cell.step());
    ASSERT_EQ(cell.read("Motor_winding_1", "tau"), winding.outputs[0]) << i;
    ASSERT_EQ(cell.read("Motor_rotor", "w"), rotor.outputs[0]) << i;
    ASSERT_EQ(cell.read("Motor_rotor", "tau"), torque) << i;
    // A connector of the system follows at the beginning of the next step.
    ASSERT_NEAR(cell.read("Motor", "speed"), speed * 30.0 / std::numbers::pi, 1e-9) << i;
  }
  EXPECT_GT(rotor.outputs[0], 1.0);
}

TEST(Ssp, ConnectorsOfTheSystemAreSignalsForWiresAndClients) {
  DeviceCell cell(load_system({}, ", step_s: 0.002", "wires: {Motor.u: 2 * Motor_rotor.w + 3}\n"));
  EXPECT_EQ(cell.description().devices.size(), 3U);
  ASSERT_TRUE(cell.step());
  EXPECT_EQ(cell.read("Motor", "u"), 3.0);
  EXPECT_EQ(cell.read("Motor_winding_1", "u"), 3.0);
  cell.run(0.1);
  EXPECT_GT(cell.read("Motor", "u"), 3.0);
}

TEST(Ssp, ValuesThatTheFmuDoesNotHaveAreNoted) {
  std::string notes;
  const auto model = load_system({});
  for (const ImportNote& note : model->import_notes) notes += note.sentence + "\n";
  EXPECT_THAT(notes, AllOf(HasSubstr("Motor_winding_1: the FMU has no variable 'colour'"),
                           HasSubstr("Motor_rotor: FMU rotor.fmu")));
}

/// The values of the winding by other names and in other units.
std::string mapped_values(const std::string& mapping) {
  return "<ssd:ParameterBindings><ssd:ParameterBinding prefix='x.'><ssd:ParameterValues><ssv:ParameterSet "
         "version='1.0' name='p'><ssv:Parameters>"
         "<ssv:Parameter name='resistance'><ssv:Real value='2000' unit='mOhm'/></ssv:Parameter>"
         "<ssv:Parameter name='constant'><ssv:Real value='0.5'/></ssv:Parameter>"
         "<ssv:Parameter name='R'><ssv:Real value='77'/></ssv:Parameter>"
         "<ssv:Parameter name='colour'><ssv:Enumeration value='red'/></ssv:Parameter></ssv:Parameters>"
         "</ssv:ParameterSet></ssd:ParameterValues>" +
         mapping + "</ssd:ParameterBinding></ssd:ParameterBindings>";
}
const std::string kEntries =
    "<ssm:MappingEntry source='x.resistance' target='R'><ssc:LinearTransformation factor='0.001'/>"
    "</ssm:MappingEntry><ssm:MappingEntry source='x.constant' target='k'/>";
const std::string kMapping =
    "<ssm:ParameterMapping version='1.0' "
    "xmlns:ssm='http://ssp-standard.org/SSP1/SystemStructureParameterMapping' "
    "xmlns:ssc='http://ssp-standard.org/SSP1/SystemStructureCommon'>" +
    kEntries + "</ssm:ParameterMapping>";

TEST(Ssp, AMappingGivesTheValuesOfAParameterSetTheirNamesAndUnits) {
  System inside, beside;
  inside.winding_values = mapped_values("<ssd:ParameterMapping>" + kMapping + "</ssd:ParameterMapping>");
  beside.winding_values = mapped_values("<ssd:ParameterMapping source='resources/winding.ssm'/>");
  DeviceCell usual(load_system({}));
  usual.run(0.1);
  for (const System& system : {inside, beside}) {
    DeviceCell cell(load_xml(system.xml(), "", "", kSystemSet, {{"resources/winding.ssm", kMapping}}));
    cell.run(0.1);
    EXPECT_EQ(cell.read("Motor_rotor", "w"), usual.read("Motor_rotor", "w"));
  }
  EXPECT_GT(usual.read("Motor_rotor", "w"), 1.0);
}

/// Without a value of its own the parameter of the component stays.
TEST(Ssp, AParameterOfTheSystemReachesComponentsByConnections) {
  System system;
  system.winding_values.clear();
  system.ports += connector("resistance", "parameter");
  system.connections +=
      "<ssd:Connection startConnector='resistance' endElement='winding 1' endConnector='R'>"
      "<ssc:LinearTransformation factor='0.001'/></ssd:Connection>";
  const auto speed = [](const System& one, const std::string& values) {
    std::string set = kSystemSet;
    set.replace(set.find("</ssv:Parameters>"), 0, values);
    DeviceCell cell(load_xml(one.xml(), "", "", set));
    cell.run(0.1);
    return cell.read("Motor_rotor", "w");
  };
  System stated;
  const double wanted = speed(stated, "");  // R is 2, and k that of the system
  EXPECT_EQ(speed(system, "<ssv:Parameter name='resistance'><ssv:Real value='2000'/></ssv:Parameter>"),
            wanted);
  EXPECT_NE(speed(system, ""), wanted);  // R is 1, the start value of the FMU
}

std::string refusal_of(const System& system) {
  try {
    load_system(system);
  } catch (const ScenarioError& error) {
    return error.what();
  }
  return "accepted";
}
std::string refusal_with(std::string System::*part, const std::string& text) {
  System system;
  system.*part = text;
  return refusal_of(system);
}

TEST(Ssp, ForeignElementsAreRefusedWithTheirLineAndWhatIsAllowed) {
  const std::string file = "the SSP motor.ssp: SystemStructure.ssd, line ";
  EXPECT_THAT(
      refusal_with(&System::elements, "<ssd:Group name='inner'/>\n"),
      AllOf(HasSubstr("cell.yaml:4:"), HasSubstr(file + "9, Group: found the element 'Group' in Elements; "
                                                        "allowed: Component, System")));
  EXPECT_THAT(refusal_with(&System::elements, "<ssd:SignalDictionaryReference name='s' dictionary='d'/>\n"),
              HasSubstr("'SignalDictionaryReference' in Elements; allowed: Component"));
  EXPECT_THAT(refusal_with(&System::elements,
                           "<ssd:Component name='x' type='application/x-ssp-package' source='a.ssp'/>"),
              HasSubstr("allowed: application/x-fmu-sharedlibrary"));
  EXPECT_THAT(
      refusal_with(
          &System::elements,
          "<ssd:Component name='x' implementation='ScheduledExecution' source='resources/rotor.fmu'/>"),
      HasSubstr("found implementation='ScheduledExecution'; allowed: any, CoSimulation, or"));
  EXPECT_THAT(refusal_with(&System::elements, "<ssd:Component name='rotor' source='resources/rotor.fmu'/>"),
              HasSubstr("found two elements with the name 'rotor'"));
  EXPECT_THAT(
      refusal_with(&System::rotor_source, "http://example.org/rotor.fmu"),
      HasSubstr(
          "found the source 'http://example.org/rotor.fmu'; allowed: a file NAME.fmu that is in the SSP"));
  EXPECT_THAT(refusal_with(&System::rotor_source, "../rotor.fmu"),
              HasSubstr("found the source '../rotor.fmu'"));
  EXPECT_THAT(refusal_with(&System::rest, "<ssd:Extras/>"),
              HasSubstr("found the element 'Extras' in SystemStructureDescription; allowed: System, Units"));
  EXPECT_THAT(
      refusal_with(&System::system_values,
                   "<ssd:ParameterBindings><ssd:ParameterBinding source='resources/system.ssv'>"
                   "<ssd:Mapping/></ssd:ParameterBinding></ssd:ParameterBindings>"),
      HasSubstr(
          "found the element 'Mapping' in ParameterBinding; allowed: ParameterValues, ParameterMapping"));
}

std::string connection(const std::string& attributes, const std::string& inside = "") {
  return "<ssd:Connection " + attributes + ">" + inside + "</ssd:Connection>";
}

TEST(Ssp, WrongMappingsAreRefused) {
  const auto refused = [](const std::string& mapping) {
    return refusal_with(&System::winding_values, mapped_values(mapping));
  };
  const auto with_entry = [&](const std::string& entry) {
    return refused(
        "<ssd:ParameterMapping><ssm:ParameterMapping "
        "xmlns:ssm='http://ssp-standard.org/SSP1/SystemStructureParameterMapping'>" +
        entry + "</ssm:ParameterMapping></ssd:ParameterMapping>");
  };
  EXPECT_THAT(with_entry("<ssm:MappingEntry source='resistance' target='R'/>"),
              HasSubstr("MappingEntry: found the source 'resistance'; allowed: x.R, x.colour, x.constant, "
                        "x.resistance"));
  EXPECT_THAT(with_entry("<ssm:MappingEntry source='x.colour' target='R'><ssc:LinearTransformation/>"
                         "</ssm:MappingEntry>"),
              HasSubstr("found a transformation of 'red'; allowed: numbers"));
  EXPECT_THAT(with_entry("<ssm:MappingEntry source='x.R' target='R'><ssc:IntegerMappingTransformation/>"
                         "</ssm:MappingEntry>"),
              HasSubstr("found the element 'IntegerMappingTransformation' in MappingEntry; allowed: "
                        "LinearTransformation"));
  EXPECT_THAT(
      refused("<ssd:ParameterMapping source='resources/none.ssm'/>"),
      HasSubstr("found the source 'resources/none.ssm'; allowed: a file NAME.ssm that is in the SSP"));
}

TEST(Ssp, WrongConnectionsAreRefusedWithTheirLine) {
  const auto refused = [](const std::string& text) { return refusal_with(&System::connections, text); };
  EXPECT_THAT(refused(connection("startElement='stator' startConnector='w' endConnector='speed'")),
              HasSubstr("line 11, Connection: found the element 'stator'; allowed: winding 1, rotor"));
  EXPECT_THAT(refused(connection("startElement='rotor' startConnector='phi' endConnector='speed'")),
              HasSubstr("found the connector 'phi' of rotor; allowed: tau, w"));
  EXPECT_THAT(refused(connection("startConnector='u' endElement='rotor' endConnector='w'")),
              HasSubstr("found two sources"));
  EXPECT_THAT(refused(connection("startConnector='u' endElement='winding 1' endConnector='R'")),
              HasSubstr("found the connector 'R' of the kind parameter; allowed: inputs and outputs"));
  EXPECT_THAT(
      refused(connection("startElement='rotor' startConnector='w' endConnector='speed'",
                         "<ssc:BooleanMappingTransformation/>")),
      HasSubstr(
          "found the element 'BooleanMappingTransformation' in Connection; allowed: LinearTransformation"));
  const std::string to_rotor = connection("startConnector='u' endElement='rotor' endConnector='tau'");
  EXPECT_THAT(refused(to_rotor + to_rotor),
              HasSubstr("found 'Motor_rotor.tau' again; allowed: one wire for each input"));
  EXPECT_THAT(refused(connection("startConnector='u' endConnector='speed'")),
              HasSubstr("found the units 'V' and 'rpm'; allowed: the same unit, units of the same quantity"));
  EXPECT_EQ(refused(connection("startConnector='u' endConnector='speed' suppressUnitConversion='true'")),
            "accepted");
}

/// The motor with its winding in a system of its own. `inside`: more elements and connections of that system.
std::string nested_xml(const std::string& outer_connections = "", const std::string& inner_connections = "",
                       const std::string& inner_values = "", const std::string& speed_unit = "rad/s") {
  System flat;
  const std::string whole = flat.xml();
  const std::string head = whole.substr(0, whole.find("<ssd:Elements>")),
                    tail = whole.substr(whole.find("</ssd:System>"));
  const auto real = [](const std::string& unit) { return "<ssc:Real unit='" + unit + "'/>"; };
  return head + "<ssd:Elements>\n<ssd:System name='drive'>\n<ssd:Connectors>" + connector("u", "input") +
         connector("speed", "input", real(speed_unit)) + connector("tau", "output") +
         connector("spare", "input") + connector("tap", "output") +
         "</ssd:Connectors>\n<ssd:Elements>\n<ssd:Component name='winding 1' "
         "source='resources/drive/winding.fmu'><ssd:Connectors>" +
         connector("u", "input") + connector("w", "input", real("rad/s")) + connector("tau", "output") +
         "</ssd:Connectors>" + flat.winding_values + "</ssd:Component>\n</ssd:Elements>\n" + inner_values +
         "<ssd:Connections>\n<ssd:Connection startConnector='u' endElement='winding 1' endConnector='u'/>\n"
         "<ssd:Connection startConnector='speed' endElement='winding 1' endConnector='w'/>\n"
         "<ssd:Connection startElement='winding 1' startConnector='tau' endConnector='tau'>"
         "<ssc:LinearTransformation factor='0.5'/></ssd:Connection>\n" +
         inner_connections +
         "</ssd:Connections>\n</ssd:System>\n<ssd:Component name='rotor' "
         "source='resources/rotor.fmu'><ssd:Connectors>" +
         connector("tau", "input") + connector("w", "output", real("rad/s")) +
         "</ssd:Connectors></ssd:Component>\n</ssd:Elements>\n<ssd:Connections>\n"
         "<ssd:Connection startConnector='u' endElement='drive' endConnector='u'/>\n"
         // Written from its end: the kinds say which way it goes.
         "<ssd:Connection startElement='rotor' startConnector='tau' endElement='drive' endConnector='tau'>"
         "<ssc:LinearTransformation offset='0.01'/></ssd:Connection>\n"
         "<ssd:Connection startElement='rotor' startConnector='w' endElement='drive' endConnector='speed'/>\n"
         "<ssd:Connection startElement='rotor' startConnector='w' endConnector='speed'/>\n" +
         outer_connections + "</ssd:Connections>\n" + tail;
}

std::string nested_set() {
  std::string set = kSystemSet;
  set.replace(set.find("winding 1.k"), 11, "drive.winding 1.k");
  return set;
}

/// Values of the inner system.
std::string inner_set(const std::string& parameters) {
  return "<ssd:ParameterBindings><ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version='1.0' "
         "name='i'><ssv:Parameters>" +
         parameters +
         "</ssv:Parameters></ssv:ParameterSet></ssd:ParameterValues></ssd:ParameterBinding></"
         "ssd:ParameterBindings>";
}

TEST(Ssp, ASystemInASystemHasTheBitsOfTheFlatOne) {
  DeviceCell flat(load_system({}));
  // A value for the component within the inner system; that of the outer one wins.
  const std::string inner_values =
      inner_set("<ssv:Parameter name='winding 1.k'><ssv:Real value='0.3'/></ssv:Parameter>");
  DeviceCell nested(load_xml(nested_xml("", "", inner_values), "", "", nested_set()));
  DeviceCell in_rpm(load_xml(nested_xml("", "", "", "rpm"), "", "", nested_set()));
  EXPECT_EQ(nested.description().devices.size(), 3U);
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(flat.step());
    ASSERT_TRUE(nested.step());
    ASSERT_TRUE(in_rpm.step());
    ASSERT_EQ(nested.read("Motor_rotor", "w"), flat.read("Motor_rotor", "w")) << i;
    ASSERT_EQ(nested.read("Motor_drive_winding_1", "tau"), flat.read("Motor_winding_1", "tau")) << i;
    ASSERT_EQ(nested.read("Motor", "speed"), flat.read("Motor", "speed")) << i;
    // From rad/s to the unit of the connector on the way, and back.
    ASSERT_NEAR(in_rpm.read("Motor_drive_winding_1", "w"), flat.read("Motor_winding_1", "w"), 1e-9) << i;
  }
  EXPECT_GT(flat.read("Motor_rotor", "w"), 1.0);
}

TEST(Ssp, AConnectorOfAnInnerSystemGivesItsValueToWhatItLeadsTo) {
  const std::string from_outside =
      "<ssd:Connection startConnector='u' endElement='drive' endConnector='u'/>\n";
  const std::string five_volts = inner_set("<ssv:Parameter name='u'><ssv:Real value='5'/></ssv:Parameter>");
  // Without a connection to it: the value, through the transformation on its way.
  std::string alone = nested_xml("", "", five_volts);
  alone.erase(alone.find(from_outside), from_outside.size());
  const std::string inside = "<ssd:Connection startConnector='u' endElement='winding 1' endConnector='u'/>";
  ASSERT_NE(alone.find(inside), std::string::npos);
  DeviceCell plain(load_xml(alone, "", "", nested_set()));
  EXPECT_EQ(plain.read("Motor_drive_winding_1", "u"), 5.0);
  alone.replace(alone.find(inside), inside.size(),
                "<ssd:Connection startConnector='u' endElement='winding 1' endConnector='u'>"
                "<ssc:LinearTransformation factor='2' offset='1'/></ssd:Connection>");
  DeviceCell scaled(load_xml(alone, "", "", nested_set()));
  EXPECT_EQ(scaled.read("Motor_drive_winding_1", "u"), 11.0);
  // A value in another unit is converted ahead of the transformation.
  std::string in_mV = alone;
  const std::string five = "<ssv:Real value='5'/>",
                    stated =
                        connector("u", "input") + connector("speed", "input", "<ssc:Real unit='rad/s'/>");
  in_mV.replace(in_mV.find(five), five.size(), "<ssv:Real value='5000' unit='mV'/>");
  ASSERT_NE(in_mV.find(stated), std::string::npos);
  in_mV.replace(in_mV.find(stated), connector("u", "input").size(),
                connector("u", "input", "<ssc:Real unit='V'/>"));
  const std::string volt = "<ssc:Unit name='V'>";
  in_mV.insert(in_mV.find(volt),
               "<ssc:Unit name='mV'><ssc:BaseUnit kg='1' m='2' s='-3' A='-1' factor='0.001'/></ssc:Unit>");
  DeviceCell converted(load_xml(in_mV, "", "", nested_set()));
  EXPECT_EQ(converted.read("Motor_drive_winding_1", "u"), 11.0);
  // A connection to it wins: the system's own input has 12.
  DeviceCell connected(load_xml(nested_xml("", "", five_volts), "", "", nested_set()));
  ASSERT_TRUE(connected.step());
  ASSERT_TRUE(connected.step());
  EXPECT_EQ(connected.read("Motor_drive_winding_1", "u"), 12.0);
}

TEST(Ssp, ModelExchangeIsReplacedByCoSimulationWithANote) {
  System system;
  std::string xml = system.xml();
  const std::string rotor = "<ssd:Component name='rotor' ";
  xml.replace(xml.find(rotor), rotor.size(), rotor + "implementation='ModelExchange' ");
  const auto model = load_xml(xml);
  const auto& notes = model->import_notes;
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const auto& note) {
    return note.sentence == "Motor_rotor: the SSP selects model exchange; the FMU runs by its co-simulation.";
  }));
}

TEST(Ssp, ValuesAreConvertedToTheUnitOfTheVariable) {
  // The winding's input has the unit V.
  const auto started = [](const std::string& unit, const std::string& units = "") {
    const auto model =
        load_xml(System{}.xml(), "", "",
                 "<ssv:ParameterSet version='1.0' name='s' "
                 "xmlns:ssv='http://ssp-standard.org/SSP1/SystemStructureParameterValues' "
                 "xmlns:ssc='http://ssp-standard.org/SSP1/SystemStructureCommon'><ssv:Parameters>"
                 "<ssv:Parameter name='winding 1.u'><ssv:Real value='1500' unit='" +
                     unit + "'/></ssv:Parameter></ssv:Parameters>" + units + "</ssv:ParameterSet>");
    return DeviceCell(model).read("Motor_winding_1", "u");
  };
  const std::string units =
      "<ssv:Units><ssc:Unit name='mV'><ssc:BaseUnit kg='1' m='2' s='-3' A='-1' factor='0.001'/></ssc:Unit>"
      "<ssc:Unit name='m'><ssc:BaseUnit m='1'/></ssc:Unit></ssv:Units>";
  EXPECT_EQ(started("V"), 1500.0);
  EXPECT_EQ(started("[V]"), 1500.0) << "as some tools write it";
  EXPECT_EQ(started("mV", units), 1.5);
  EXPECT_EQ(started("[mV]", units), 1.5);
  std::string bracketed = units;
  bracketed.replace(bracketed.find("'mV'"), 4, "'[mV]'");
  EXPECT_EQ(started("[mV]", bracketed), 1.5);
  System system;
  system.ports.replace(system.ports.find("'V'"), 3, "'[V]'");
  EXPECT_EQ(load_system(system)->description.devices[0].signals[1].unit, "V");
  for (const auto& [unit, defined] : {std::pair{"m", units}, std::pair{"mV", std::string()}}) try {
      started(unit, defined);
      ADD_FAILURE() << unit;
    } catch (const ScenarioError& error) {
      EXPECT_THAT(error.what(),
                  HasSubstr("the parameter set gives 'u' in the unit '" + std::string(unit) +
                            "'; allowed: that of the FMU, 'V', or a unit of the same quantity"));
    }
}

TEST(Ssp, MappingsWithoutASourceMapNothing) {
  // As tools write them for variables that have no value.
  const std::string mapping =
      "<ssd:ParameterMapping><ssm:ParameterMapping version='1.0' "
      "xmlns:ssm='http://ssp-standard.org/SSP1/SystemStructureParameterMapping'>"
      "<ssm:MappingEntry source='' target='rotor.J'/><ssm:MappingEntry source='rotor.J' target='rotor.J'/>"
      "</ssm:ParameterMapping></ssd:ParameterMapping>";
  EXPECT_EQ(refusal_with(&System::system_values,
                         "<ssd:ParameterBindings><ssd:ParameterBinding source='resources/system.ssv'>" +
                             mapping + "</ssd:ParameterBinding></ssd:ParameterBindings>"),
            "accepted");
}

TEST(Ssp, WrongConnectionsOfSystemsInSystemsAreRefusedWithTheirLine) {
  const auto refused = [](const std::string& xml) {
    try {
      load_xml(xml, "", "", nested_set());
    } catch (const ScenarioError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refused(nested_xml(connection("startElement='rotor' startConnector='w' endElement='drive' "
                                          "endConnector='spare'"))),
            "accepted")
      << "nothing is connected to it within";
  EXPECT_THAT(
      refused(nested_xml(connection("startElement='winding 1' startConnector='tau' endElement='rotor' "
                                    "endConnector='tau'"))),
      AllOf(HasSubstr("line 25, Connection"),
            HasSubstr("found the element 'winding 1'; allowed: drive, rotor")));
  EXPECT_THAT(refused(nested_xml(connection("startElement='rotor' startConnector='w' endElement='drive' "
                                            "endConnector='u'"))),
              AllOf(HasSubstr("line 25, Connection"),
                    HasSubstr("found the connector 'u' again; allowed: one connection to each connector")));
  EXPECT_THAT(
      refused(nested_xml("", connection("startConnector='tau' endElement='winding 1' endConnector='u'"))),
      HasSubstr("line 16, Connection: found two targets"));
  EXPECT_THAT(
      refused(nested_xml("", connection("startElement='rotor' startConnector='w' endConnector='tap'"))),
      HasSubstr("found the element 'rotor'; allowed: winding 1"));
  // An output of the inner system that its own input feeds, which that output feeds from outside.
  EXPECT_THAT(
      refused(nested_xml(
          connection("startElement='drive' startConnector='tap' endElement='drive' endConnector='spare'") +
              connection("startElement='drive' startConnector='tap' endElement='rotor' endConnector='w'"),
          connection("startConnector='spare' endConnector='tap'"))),
      HasSubstr("found two sources"));
  EXPECT_THAT(
      refused(nested_xml(
          connection("startElement='drive' startConnector='tap' endElement='drive' endConnector='spare'"),
          connection("startConnector='spare' endConnector='tap'") +
              connection("startConnector='spare' endElement='winding 1' endConnector='R'"))),
      HasSubstr("found the connector 'R' of winding 1; allowed: tau, u, w"));
  std::string without_speed = nested_xml(
      connection("startElement='drive' startConnector='tap' endElement='drive' endConnector='spare'"),
      connection("startConnector='spare' endConnector='tap'"));
  const std::string to_winding = "startConnector='speed' endElement='winding 1'";
  without_speed.replace(without_speed.find(to_winding), to_winding.size(),
                        "startConnector='spare' endElement='winding 1'");
  EXPECT_THAT(
      refused(without_speed),
      HasSubstr("line 14, Connection: found connectors of systems that lead to each other in a circle"));
}

TEST(Ssp, DamagedDescriptionsAreRefusedOrReadWhole) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "resources");
  directory.write("resources/system.ssv", kSystemSet);
  for (const char* fmu : {"resources/winding.fmu", "resources/rotor.fmu"}) directory.write(fmu, "");
  const std::string whole = System{}.xml();
  int refused = 0, read = 0;
  const auto try_it = [&](const std::string& text) {
    directory.write("SystemStructure.ssd", text);
    try {
      const FmuSystem system = read_ssp(directory.path());
      EXPECT_FALSE(system.elements.empty());
      ++read;
    } catch (const FmuError& error) {
      EXPECT_THAT(error.what(), HasSubstr("SystemStructure.ssd"));
      ++refused;
    }
  };
  for (std::size_t cut = 0; cut < whole.size() - 2; cut += 13) try_it(whole.substr(0, cut));
  EXPECT_EQ(read, 0);
  for (std::size_t at = 0; at < whole.size(); at += 7) {
    std::string text = whole;
    text[at] = static_cast<char>(text[at] ^ 0x11);
    try_it(text);
  }
  EXPECT_GT(read, 20);
  EXPECT_GT(refused, 200);
}

TEST(Ssp, IsRefusedWithoutTheOption) {
  const TemporaryDirectory directory;
  directory.write("motor.ssp", "x");
  directory.write("cell.yaml", "takt_scenario: 1\nname: ssp\nssp: {Motor: {file: motor.ssp}}\n");
  EXPECT_THAT([&] { load_cell(directory / "cell.yaml"); },
              testing::ThrowsMessage<ScenarioError>(HasSubstr("The option --allow-fmus DIR")));
  FmuLibrary library(directory.path(), kFmuHost);
  ImportOptions import;
  import.fmus = &library;
  EXPECT_THAT([&] { load_cell(directory / "cell.yaml", {}, import); },
              testing::ThrowsMessage<ScenarioError>(HasSubstr("it is no ZIP archive, as SSPs are")));
}

}  // namespace
}  // namespace takt::test
