// Programs of URScript that clients send: how streams of them are split, and how those of drivers are recognised.
#include <gtest/gtest.h>

#include "client_lib/tools/takt_ur/script_functions.h"
#include "tests/gateway/urscript_host.h"

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

TEST(ScriptStream, CountsBlocksByTheirWords) {
  ScriptStream stream;
  for (const char c :
       std::string("def a(): if True: stopj(1) end end\ndef b(): x = \"end # if\"\n  $ 1 \"if end\"\n"
                   "  y = 'while' # while\n  z = t.sec + t.end\n  if x == y: halt end\nend\nstopj(2)\n"))
    stream.add(std::string(1, c));
  EXPECT_EQ(stream.next(), "def a(): if True: stopj(1) end end");
  EXPECT_EQ(stream.next(),
            "def b(): x = \"end # if\"\n  $ 1 \"if end\"\n  y = 'while' # while\n  z = t.sec + t.end\n"
            "  if x == y: halt end\nend");
  EXPECT_EQ(stream.next(), "stopj(2)");
  EXPECT_EQ(stream.next(), std::nullopt);
  EXPECT_FALSE(stream.broken());
  stream.add("def c():\n" + std::string(ScriptStream::kMostBytes, ' '));
  EXPECT_EQ(stream.next(), std::nullopt);
  EXPECT_TRUE(stream.broken());
}

std::vector<std::string> calls_of(const Code& code) {
  RecordingHost host;
  Interpreter interpreter(code, host);
  while (interpreter.advance()) ++host.cycle;
  std::vector<std::string> calls = host.calls;
  calls.insert(calls.end(), host.messages.begin(), host.messages.end());
  return calls;
}

TEST(Script, ReadsCallsWithTheirArguments) {
  const Program program = parse_program(
      "def test():\n  movej([0, -1.5, 1e-3, 0, 0, 0], a=1.2, v = 0.5)\n  textmsg(\"a # b\") # c\n  "
      "movel(p[0,0,1,0,0,0])\nend\n");
  EXPECT_EQ(program.name, "test");
  EXPECT_FALSE(program.secondary);
  EXPECT_TRUE(program.code.moves);
  EXPECT_EQ(calls_of(program.code),
            (std::vector<std::string>{"movej [0, -1.5, 0.001, 0, 0, 0] 1.2 0.5 None None",
                                      "movel p[0, 0, 1, 0, 0, 0] None None None None", "a # b"}));
}

TEST(Script, OlderAndNestedFormsOfClientsAreRead) {
  EXPECT_EQ(calls_of(parse_program("digital_out[3]=True").code),
            std::vector<std::string>{"set_digital_out 3 True"});
  EXPECT_EQ(calls_of(parse_program("movej([d2r(-90), 0, d2r( 180 ), 0, 0, 0])").code),
            std::vector<std::string>{"movej [-1.5708, 0, 3.14159, 0, 0, 0] None None None None"});
  RecordingHost host;
  host.answers["get_inverse_kin"] = std::vector<double>{1, 2, 3, 4, 5, 6};
  run_script("movej(get_inverse_kin(p[1,0,0,0,0,0]), a=1)", host);
  EXPECT_EQ(host.calls, (std::vector<std::string>{"get_inverse_kin p[1, 0, 0, 0, 0, 0] None None None None",
                                                  "movej [1, 2, 3, 4, 5, 6] 1 None None None"}));
  for (const char* text : {"digital_out[0]", "digital_out[0, 1] = True", "digital_out[0] = True x",
                           "movej([d2r(1, 0, 0, 0, 0, 0])", "movej(get_inverse_kin(p[1, 0, 0, 0, 0, 0])"})
    EXPECT_THROW(parse_program(text), ScriptError) << text;
}

TEST(Script, StatementsMayStandInOneLine) {
  // UR's manual: def myFun(): mystring = "Hello Interpreter" textmsg(mystring) end
  EXPECT_EQ(calls_of(parse_program(
                         "def t(): def f(): mystring = \"Hello Interpreter\" textmsg(mystring) end f() end")
                         .code),
            std::vector<std::string>{"Hello Interpreter"});
  EXPECT_EQ(calls_of(parse_program("stopj(1) stopj(2)").code),
            (std::vector<std::string>{"stopj 1", "stopj 2"}));
  EXPECT_EQ(calls_of(parse_program("if 1 > 2: stopj(1) else: def f(): return end f() stopj(3) end").code),
            std::vector<std::string>{"stopj 3"});
}

TEST(Script, TheControllerHasEachFunctionThatReadsOrSets) {
  using enum Function::Kind;
  for (const Function& function : functions()) {
    EXPECT_EQ(takt::ur::is_read(function.name), function.kind == solves || function.kind == reads)
        << function.name;
    EXPECT_TRUE((function.kind != sets && function.kind != reports) || takt::ur::is_set(function.name))
        << function.name;
  }
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

TEST(Script, WhatIsNoUrscriptIsRefused) {
  for (const char* text :
       {"def a():\n  x = \nend", "def a():\n  if x > 1:\n  end\nend", "def a():\n  movej(q)\nend",
        "def a(x):\nend", "def a():\n  stopj(0.1\nend", "def a():\n  stopj(nan)\nend", "stopj(1e400)",
        "def a():\n end\nend", "def 7a():\nend", "def a():\n stopj(1)", "stopj(1) 2", "while True:\n"})
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
  EXPECT_EQ(calls_of(program.code), std::vector<std::string>{"done"});
}

}  // namespace
