// The part of URScript that takt runs, and how streams of it are split.
#include <gtest/gtest.h>

#include "client_lib/gateway/urscript/script.h"

namespace {

using namespace takt::urscript;

TEST(ScriptStream, SplitsProgramsAndLinesAtEveryByte) {
  const std::string text =
      "stop program\n# a comment\n\ndef a():\n  while True:\n    stopj(0.1)\n  end\nend\nset_digital_out(0, "
      "True)\n";
  const std::vector<std::string> expected{
      "stop program", "def a():\n  while True:\n    stopj(0.1)\n  end\nend", "set_digital_out(0, True)"};
  for (std::size_t cut = 0; cut <= text.size(); ++cut) {
    ScriptStream stream;
    std::vector<std::string> found;
    for (const std::string& part : {text.substr(0, cut), text.substr(cut)}) {
      stream.add(part);
      while (const auto next = stream.next()) found.push_back(*next);
    }
    ASSERT_EQ(found, expected) << "cut at byte " << cut;
  }
}

TEST(Script, ReadsCallsWithTheirArguments) {
  const Program program = parse_program(
      "def test():\n  movej([0, -1.5, 1e-3, 0, 0, 0], a=1.2, v = 0.5)\n  textmsg(\"a # b\") # c\n  "
      "movel(p[0,0,1,0,0,0])\nend\n");
  EXPECT_EQ(program.name, "test");
  EXPECT_FALSE(program.secondary);
  ASSERT_EQ(program.instructions.size(), 3U);
  const Call& move = program.instructions[0].call;
  EXPECT_EQ(std::get<std::vector<double>>(move.arguments.at(0)),
            (std::vector<double>{0, -1.5, 1e-3, 0, 0, 0}));
  EXPECT_EQ(std::get<double>(move.named.at("v")), 0.5);
  EXPECT_EQ(std::get<std::string>(program.instructions[1].call.arguments.at(0)), "a # b");
  EXPECT_EQ(std::get<PoseLiteral>(program.instructions[2].call.arguments.at(0)).values[2], 1.0);
}

TEST(Script, OlderAndNestedFormsOfClientsAreRead) {
  const Call output = parse_program("digital_out[3]=True").instructions.at(0).call;
  EXPECT_EQ(output.function, "set_digital_out");
  EXPECT_EQ(std::get<double>(output.arguments.at(0)), 3.0);
  EXPECT_TRUE(std::get<bool>(output.arguments.at(1)));
  const Call turned = parse_program("movej([d2r(-90), 0, d2r( 180 ), 0, 0, 0])").instructions.at(0).call;
  const auto& q = std::get<std::vector<double>>(turned.arguments.at(0));
  EXPECT_DOUBLE_EQ(q[0], -1.5707963267948966);
  EXPECT_DOUBLE_EQ(q[2], 3.141592653589793);
  const Call pose = parse_program("movej(get_inverse_kin(p[1,0,0,0,0,0]), a=1)").instructions.at(0).call;
  EXPECT_EQ(std::get<PoseLiteral>(pose.arguments.at(0)).values[0], 1.0);
  for (const char* text : {"digital_out[0]", "digital_out[0, 1] = True", "digital_out[0] = True x",
                           "movej([d2r(1, 0, 0, 0, 0, 0])", "movej(get_inverse_kin([1, 0, 0, 0, 0, 0]))",
                           "movej(get_inverse_kin(p[1, 0, 0, 0, 0, 0])"})
    EXPECT_THROW(parse_program(text), ScriptError) << text;
}

TEST(Script, AnUnknownFunctionIsAnErrorWithLineAndColumn) {
  try {
    parse_program("def illegal_fun():\n  calldoesntexist()\nend");
    FAIL();
  } catch (const ScriptError& error) {
    EXPECT_EQ(error.line(), 2);
    EXPECT_EQ(error.column(), 3);
    EXPECT_STREQ(error.what(), "compile_error_name_not_found:calldoesntexist:");
  }
}

TEST(Script, WhatTaktDoesNotRunIsRefused) {
  for (const char* text :
       {"def a():\n  x = 1\nend", "def a():\n  if x > 1:\n  end\nend", "def a():\n  movej(q)\nend",
        "def a():\n  stopj(0.1\nend", "def a():\n  stopj(nan)\nend", "stopj(1e300)", "stopj(-1e10)",
        "def a():\n end\nend", "def 7a():\nend", "def a():\n stopj(1)", "stopj(1) stopj(2)", "while True:\n"})
    EXPECT_THROW(parse_program(text), ScriptError) << text;
}

TEST(Script, ExternalControlIsRecognisedByItsSockets) {
  const Program program = parse_program(
      "def externalControl():\n\tMULT_jointstate = 1000000\n\tx = f(1)\n"
      "\ttraj = connect_socket_with_retry(\"10.0.0.1\", 50003, \"trajectory_socket\")\n"
      "\tcom = connect_socket_with_retry(\"10.0.0.1\", 50004, \"script_command_socket\")\n"
      "\trev = connect_socket_with_retry(\"10.0.0.1\", 50001, \"reverse_socket\")\n"
      "\t# NODE_CONTROL_LOOP_ENDS\n\ttextmsg(\"done\")\nend\n");
  ASSERT_TRUE(program.external);
  EXPECT_EQ(program.external->reverse.host, "10.0.0.1");
  EXPECT_EQ(program.external->trajectory.port, 50003);
  EXPECT_EQ(program.external->script_command.port, 50004);
  EXPECT_FALSE(program.external->answers_cancel);
  ASSERT_EQ(program.instructions.size(), 1U);
  EXPECT_EQ(program.instructions[0].call.function, "textmsg");
}

std::string register_program(const std::string& float_offset, const std::string& path) {
  return "def rtde_control():\n  global reg_offset_float = # float register offset\n" + float_offset +
         "\n  global reg_offset_int = 3\n  def exec_move_path():\n    textmsg(\"path\")\n" + path +
         "  end\n  def rtde_cmd():\n    return read_input_integer_reg(0)\n  end\n"
         "  def process_cmd():\n    x = f(1)\n  end\n  while keep_running:\n"
         "    if cmd == 24 or cmd == 9:\n      g()\n    end\n  end\nend\n";
}

TEST(Script, TheProgramOfRegistersIsRecognisedByItsFunctions) {
  const Program program = parse_program(
      register_program("24", "\tsignal_async_progress(1)\n\tmovej([0,0,0,0,0,1],a=1.2,v=0.5,r=0.02)\n"));
  ASSERT_TRUE(program.registers);
  EXPECT_EQ(program.name, "rtde_control");
  EXPECT_EQ(program.registers->first_double, 24);
  EXPECT_EQ(program.registers->first_int, 3);
  EXPECT_EQ(program.registers->realtime_commands, (std::vector<int>{24, 9}));
  ASSERT_EQ(program.registers->path.size(), 3U);
  EXPECT_EQ(program.registers->path[1].call.function, "write_output_integer_register");
  EXPECT_EQ(std::get<double>(program.registers->path[1].call.arguments.at(1)), 1.0);
  EXPECT_EQ(program.registers->path[2].call.function, "movej");
}

TEST(Script, ARegisterProgramWithoutAnOffsetOrWithAnotherPathIsRefused) {
  for (const std::string& text : {register_program("x", ""), register_program("25", ""),
                                  register_program("0", "    movej(q)\n"), register_program("-1", "")})
    EXPECT_THROW(parse_program(text), ScriptError) << text;
}

}  // namespace
