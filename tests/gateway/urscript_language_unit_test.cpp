// URScript as a language. Expectations come from UR's script manual (scoping rules, matrix and array expressions, lists and
// structs, thread scheduling) or from the closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/gateway/urscript_host.h"

namespace {

using namespace takt::urscript;
using Lines = std::vector<std::string>;

std::string program(const std::string& body) {
  return "def test():\n" + body + "\nend\n";
}
/// The text of an expression.
std::string result(const std::string& expression) {
  const Lines lines = run_script(program("  textmsg(" + expression + ")"));
  return lines.empty() ? "" : lines.front();
}
/// Line, column and message of the error that ends a program.
std::string error(const std::string& text) {
  try {
    run_script(text);
  } catch (const ScriptError& found) {
    return std::to_string(found.line()) + ":" + std::to_string(found.column()) + " " + found.what();
  }
  return "no error";
}

TEST(UrscriptLanguage, ArithmeticHasTheUsualPrecedence) {
  EXPECT_EQ(result("1+2-3"), "0");
  EXPECT_EQ(result("2+3*4"), "14");
  EXPECT_EQ(result("(1+2)*3/(4-5)"), "-9");
  EXPECT_EQ(result("5/2"), "2.5");
  EXPECT_EQ(result("2 - 3 - 4"), "-5");
  EXPECT_EQ(result("-2 * -3"), "6");
  EXPECT_EQ(result("17 % 5"), "2");
  EXPECT_EQ(result("2147483647 + 1"), "2.14748e+09");
}

TEST(UrscriptLanguage, LogicAndComparisons) {
  EXPECT_EQ(result("True or False and False"), "True");
  EXPECT_EQ(result("not (True xor True)"), "True");
  EXPECT_EQ(result("1 < 2 and 2 <= 2 and 3 > 2 and 3 >= 3 and 1 != 2 and 2 == 2.0"), "True");
  EXPECT_EQ(result("\"a\" == \"a\""), "True");
  EXPECT_EQ(result("[1, 2] == [1, 3]"), "False");
  EXPECT_EQ(result("False and 1 / 0 > 1"), "False");
}

TEST(UrscriptLanguage, MatrixAndArrayExpressionsOfTheManual) {
  EXPECT_EQ(result("[[1,2],[3,4],[5,6]] * [[10,20,30],[40,50,60]]"),
            "[[90, 120, 150], [190, 260, 330], [290, 400, 510]]");
  EXPECT_EQ(result("[[1,2],[3,4],[5,6]] * [10,20]"), "[50, 110, 170]");
  EXPECT_EQ(result("[1,2,3] * [10,20,30]"), "[10, 40, 90]");
  EXPECT_EQ(result("[10,20,30] / [1,2,3]"), "[10, 10, 10]");
  EXPECT_EQ(result("[1,2,3] + [10,20,30]"), "[11, 22, 33]");
  EXPECT_EQ(result("[10,20,30] - [1,2,3]"), "[9, 18, 27]");
  EXPECT_EQ(result("[10,20,30] % [1,2,3]"), "[0, 0, 0]");
  EXPECT_EQ(result("5 * [[1,2],[3,4],[5,6]]"), "[[5, 10], [15, 20], [25, 30]]");
  EXPECT_EQ(result("10 / [10,20,30]"), "[1, 0.5, 0.333333]");
  EXPECT_EQ(
      run_script(program("array = [1,2,3,4,5]\n a = array[0]\n array[2] = 10\n matrix = [[1,2],[3,4],[5,6]]\n"
                         " b = matrix[0,0]\n matrix[2,1] = 20\n textmsg(a, b)\n textmsg(array, matrix)")),
      (Lines{"11", "[1, 2, 10, 4, 5][[1, 2], [3, 4], [5, 20]]"}));
}

TEST(UrscriptLanguage, ScopesOfTheManual) {
  const auto scoped = [](const std::string& first, const std::string& inner) {
    return run_script("def myProg():\n " + first + "\n def myFun():\n  " + inner +
                      "\n end\n myFun()\n textmsg(a)\nend\n");
  };
  EXPECT_EQ(scoped("global a = 0", "local a = 1"), Lines{"0"});
  EXPECT_EQ(scoped("global a = 0", "a = 1"), Lines{"1"});
  EXPECT_EQ(scoped("a = 0", "a = 1"), Lines{"1"});
  EXPECT_EQ(
      run_script(
          "def myProg():\n global a = 0\n def myFun():\n  local a = 1\n  def myFun2():\n   a = 2\n  end\n"
          "  myFun2()\n  textmsg(a)\n end\n myFun()\n textmsg(a)\nend\n"),
      (Lines{"1", "2"}));
}

TEST(UrscriptLanguage, StructsAndListsOfTheManual) {
  EXPECT_EQ(run_script(program(
                "myStruct = struct(identifier1 = 1, identifier2 = 2, myMember = \"Hello structs\", "
                "listMember = [1,2,3])\n"
                "myStruct.myMember = \"Goodbye structs\"\n textmsg(myStruct.myMember)\n"
                "textmsg(myStruct.listMember[0])\n textmsg(myStruct[1])\n myStruct.listMember[2] = 7\n"
                "textmsg(myStruct.listMember)")),
            (Lines{"Goodbye structs", "1", "2", "[1, 2, 7]"}));
  EXPECT_EQ(
      run_script(program(
          "bb = make_list(length = 2, initial_value = 11, capacity = 4)\n bb.append(88)\n bb.insert(1, "
          "22.5)\n"
          "textmsg(bb.to_string(), bb.length())\n a = bb.pop()\n textmsg(a, bb.capacity())\n bb.clear()\n"
          "textmsg(bb.length())")),
      (Lines{"[11, 22.5, 11, 88]4", "884", "0"}));
  EXPECT_EQ(error("def t():\n aa = [1, 2]\n aa.append(3)\nend\n").substr(0, 20), "3:2 append: the list");
}

TEST(UrscriptLanguage, ACopyOfAStructHasItsOwnMembersAndSharesTheirNames) {
  RecordingHost host;
  Interpreter interpreter(parse_program(program(" a = struct(x = 1, y = 2)\n b = a\n b.x = 3")).code, host);
  while (interpreter.advance()) {
  }
  EXPECT_EQ(text_of(*interpreter.global("a")), "struct(x=1, y=2)");
  EXPECT_EQ(text_of(*interpreter.global("b")), "struct(x=3, y=2)");
  EXPECT_EQ(interpreter.global("a")->record()->names, interpreter.global("b")->record()->names);
}

TEST(UrscriptLanguage, TextsAsTheManualWritesThem) {
  EXPECT_EQ(result("to_str(10)"), "10");
  EXPECT_EQ(result("to_str(2.123456123456)"), "2.12346");
  EXPECT_EQ(result("to_str(p[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])"), "p[1, 2, 3, 4, 5, 6]");
  EXPECT_EQ(result("to_str([True, False, True])"), "[True, False, True]");
  EXPECT_EQ(result("str_cat(\"Hello\", \" World!\")"), "Hello World!");
  EXPECT_EQ(result("str_cat(\"a\", 1.5)"), "a1.5");
  EXPECT_EQ(result("str_sub(\"0123456789abcdefghij\", 5, 3)"), "567");
  EXPECT_EQ(result("str_find(\"Hello World!\", \"o\", 5)"), "7");
  EXPECT_EQ(result("str_find(\"Hello World!\", \"x\")"), "-1");
  EXPECT_EQ(result("str_at(\"Hello\", 4)"), "o");
  EXPECT_EQ(result("str_empty(\"\")"), "True");
  EXPECT_EQ(result("to_num(\"3.5\") + 1"), "4.5");
  EXPECT_EQ(result("integer_to_binary_list(5)[2]"), "True");
  EXPECT_EQ(result("binary_list_to_integer(integer_to_binary_list(-7))"), "-7");
}

TEST(UrscriptLanguage, EuclidFibonacciAndSorting) {
  EXPECT_EQ(run_script(program(" def gcd(a, b):\n  while b != 0:\n   r = a % b\n   a = b\n   b = r\n  end\n  "
                               "return a\n end\n textmsg(gcd(1071, 462))")),
            Lines{"21"});
  EXPECT_EQ(run_script(program(" def fib(n):\n  if n < 2:\n   return n\n  end\n  return fib(n - 1) + fib(n - "
                               "2)\n end\n textmsg(fib(15))")),
            Lines{"610"});
  std::mt19937 random(7);
  std::vector<int> numbers(40);
  for (int& number : numbers) number = static_cast<int>(random() % 1000);
  std::string list, sorted;
  for (const int number : numbers) list += (list.empty() ? "" : ", ") + std::to_string(number);
  std::sort(numbers.begin(), numbers.end());
  for (const int number : numbers) sorted += (sorted.empty() ? "" : ", ") + std::to_string(number);
  EXPECT_EQ(
      run_script(program(" a = [" + list +
                         "]\n i = 0\n while i < length(a) - 1:\n  j = 0\n  while j < length(a) - 1 - i:\n"
                         "   if a[j] > a[j + 1]:\n    t = a[j]\n    a[j] = a[j + 1]\n    a[j + 1] = t\n   "
                         "end\n   j = j + 1\n  end\n"
                         "  i = i + 1\n end\n textmsg(a)")),
      Lines{"[" + sorted + "]"});
}

TEST(UrscriptLanguage, FunctionsHaveDefaultsNamesAndResults) {
  EXPECT_EQ(run_script(program(" base = 10\n def f(a, b = base * 2, c = 3):\n  return a + b + c\n end\n "
                               "textmsg(f(1), f(1, 2))\n textmsg(f(1, c = 0))")),
            (Lines{"246", "21"}));
  // UR's libraries define such functions for robots that do not have them.
  EXPECT_EQ(
      run_script(program(" def normalize(v):\n  return v / norm(v)\n end\n textmsg(normalize([3, 4]))")),
      Lines{"[0.6, 0.8]"});
  EXPECT_EQ(result("normalize([3, 4])"), "[0.6, 0.8]");
  EXPECT_EQ(error("def t():\n def f(a):\n end\n f()\nend\n"), "4:2 f: allowed: (a), 1 of them needed");
  EXPECT_EQ(error("def t():\n def f():\n end\n x = f()\nend\n"), "4:2 the function has returned no value");
}

TEST(UrscriptLanguage, LoopsBranchesAndLabels) {
  EXPECT_EQ(run_script(program(" $ 2 \"MoveJ\"\n n = 0\n sum = 0\n while True: # all\n  n = n + 1\n  if n > "
                               "9:\n   break\n  elif n % 2 == 0:\n"
                               "   continue\n  else:\n   sum = sum + n\n  end\n end\n textmsg(sum)")),
            Lines{"25"});
}

TEST(UrscriptLanguage, ThreadsShareACounterInCriticalSections) {
  // Without the critical section the increments of both threads would be lost between the read and the write.
  const auto counted = [](const std::string& enter, const std::string& exit) {
    return run_script(program(" counter = 0\n thread count():\n  i = 0\n  while i < 20:\n   " + enter +
                              "\n   old = counter\n   sync()\n   counter = old + 1\n   " + exit +
                              "\n   i = i + 1\n  end\n end\n a = run count()\n b = run count()\n join a\n "
                              "join b\n textmsg(counter)"));
  };
  EXPECT_EQ(counted("enter_critical", "exit_critical"), Lines{"40"});
  EXPECT_EQ(counted("enter_critical()", "exit_critical()"), Lines{"40"});
  EXPECT_EQ(counted("$ 1", "$ 2"), Lines{"20"});
}

TEST(UrscriptLanguage, AThreadWithoutAWaitingCallLeavesTheCycleToOthers) {
  RecordingHost host;
  const Lines lines = run_script(program(" n = 0\n thread busy():\n  while True:\n   n = n + 1\n  end\n "
                                         "end\n t = run busy()\n sleep(0.02)\n kill t\n"
                                         " m = n\n sleep(0.02)\n textmsg(n == m, n > 100)"),
                                 host);
  EXPECT_EQ(lines, Lines{"TrueTrue"});
  EXPECT_EQ(host.cycle, 20);
  EXPECT_EQ(host.threads_ended, 2);
}

TEST(UrscriptLanguage, TheEndOfTheProgramEndsItsThreads) {
  EXPECT_EQ(
      run_script(program(
          " thread t():\n  sleep(1)\n  textmsg(\"late\")\n end\n run t()\n sleep(0.1)\n textmsg(\"end\")")),
      Lines{"end"});
  EXPECT_EQ(run_script(program(" thread t():\n  halt\n end\n run t()\n sleep(0.1)\n textmsg(\"end\")")),
            Lines{});
}

TEST(UrscriptLanguage, ThreadsAreNumbersAndZeroIsNone) {
  // As ur_rtde's program uses them.
  EXPECT_EQ(
      run_script(program(
          " moves = 0\n global t = 0\n thread f():\n  moves = moves + 1\n  t = 0\n end\n kill t\n join t\n"
          " t = run f()\n textmsg(t != 0)\n sleep(0.01)\n textmsg(t, moves)")),
      (Lines{"True", "01"}));
  EXPECT_EQ(error("def t():\n kill \"x\"\nend\n"), "2:2 type_error: a thread is expected, found a text");
}

TEST(UrscriptLanguage, ThreadsThatHaveEndedLeaveTheirPlaceToOthers) {
  RecordingHost host;
  EXPECT_EQ(
      run_script(
          program(
              " n = 0\n thread f():\n  n = n + 1\n end\n i = 0\n while i < 500:\n  t = run f()\n  join t\n"
              "  i = i + 1\n end\n textmsg(n)"),
          host),
      Lines{"500"});
  EXPECT_GE(host.cycle, 500 * 200 / Interpreter::kMostWork)
      << "a thread takes its work from the thread that starts it";
}

TEST(UrscriptLanguage, ALoopWithoutAWaitCannotFloodOrStallTheController) {
  const auto in_one_cycle = [](const std::string& body) {
    RecordingHost host;
    host.answers["get_inverse_kin"] = host.answers["get_digital_in"] = std::vector<double>(6, 0.0);
    Interpreter interpreter(parse_program(program(" while True:\n  " + body + "\n end")).code, host);
    EXPECT_TRUE(interpreter.advance());
    return host.messages.size() + host.calls.size();
  };
  EXPECT_EQ(in_one_cycle("textmsg(\"x\")"), 20U);
  EXPECT_LE(in_one_cycle("x = get_inverse_kin(p[0,0,0,0,0,0])"), 100U);
  EXPECT_LE(in_one_cycle("socket_send_string(\"x\")"), 100U);
  EXPECT_GT(in_one_cycle("x = get_digital_in(0)"), 500U);
}

TEST(UrscriptLanguage, LongValuesTakeMoreOfACycle) {
  const auto in_one_cycle = [](const std::string& before, const std::string& body) {
    RecordingHost host;
    Interpreter interpreter(
        parse_program(program(before + "\n n = 0\n sync()\n while True:\n  " + body + "\n  n = n + 1\n end"))
            .code,
        host);
    for (int cycle = 0; cycle < 10; ++cycle) {  // one of many, since the first one makes the values
      ++host.cycle;
      EXPECT_TRUE(interpreter.advance());
    }
    return interpreter.global("n")->number() / 9.0;
  };
  const std::string list = " a = make_list(2000, 1)";
  EXPECT_GT(in_one_cycle(" a = [1, 2, 3, 4, 5, 6]", "a[1] = 2"), 300.0);
  EXPECT_LT(in_one_cycle(list, "a[1] = 2"), 10.0);
  EXPECT_LT(in_one_cycle(list, "a.pop()\n  a.append(1)"), 10.0);
  EXPECT_LT(in_one_cycle(list, "b = -a"), 10.0);
  EXPECT_LT(in_one_cycle(list, "b = a.to_string()"), 10.0);
  EXPECT_LT(in_one_cycle(list, "b = to_str(a)"), 10.0);
  EXPECT_LT(in_one_cycle(list, "b = a + a"), 10.0);
  EXPECT_LT(in_one_cycle(" a = make_list(40, make_list(40, 1))", "b = a * a"), 2.0);
  EXPECT_LT(in_one_cycle("", "a = make_list(2000, 1)"), 10.0);
}

TEST(UrscriptLanguage, TextsAreFoundAsTheStandardLibraryFindsThem) {
  std::mt19937 random(5);
  const auto text_of_length = [&](std::size_t length) {
    std::string text;
    for (std::size_t i = 0; i < length; ++i) text += random() % 2 == 0 ? 'a' : 'b';
    return text;
  };
  for (int i = 0; i < 20'000; ++i) {
    const std::string text = text_of_length(random() % 30), target = text_of_length(random() % 6);
    const std::size_t from = random() % 32;
    ASSERT_EQ(position_of(text, target, from), text.find(target, from))
        << text << " " << target << " " << from;
  }
}

TEST(UrscriptLanguage, ExpressionsGoOnWhereAValueIsMissing) {
  EXPECT_EQ(run_script(program(" x = # of a client\n7\n y = x +\n  not_x(\n1)\n def not_x(a):\n  return "
                               "-\na\n end\n textmsg(x, y)")),
            Lines{"76"});
  EXPECT_EQ(error("def t():\n x =\nend\n"), "3:1 syntax_error: a value is expected, found 'end'");
}

TEST(UrscriptLanguage, ARemoteProcedureIsCalledWithItsNameAndArguments) {
  RecordingHost host;
  host.answers["HANDLE.PROCEDURE"] = 42;
  EXPECT_EQ(
      run_script(program(" grip = rpc_factory(\"xmlrpc\", \"http://127.0.0.1:41414\")\n def width(id):\n"
                         "  return grip.get_width(id, p[1,2,3,4,5,6]) + 1\n end\n grip.stop()\n"
                         " textmsg(width(7))"),
                 host),
      Lines{"43"});
  EXPECT_EQ(host.calls,
            (Lines{"HANDLE.PROCEDURE struct(type=xmlrpc, url=http://127.0.0.1:41414) stop",
                   "HANDLE.PROCEDURE struct(type=xmlrpc, url=http://127.0.0.1:41414) get_width 7 p[1, "
                   "2, 3, 4, 5, 6]"}));
  EXPECT_EQ(error("def t():\n g = struct(type=\"xmlrpc\", url=\"http://x\")\n g.close(1)\nend\n"),
            "3:2 type_error: a struct has no method close");
  EXPECT_EQ(
      error("def t():\n g = rpc_factory(\"xmlrpc\", \"http://x\")\n g.clear()\nend\n"),
      "3:2 type_error: a struct has no method clear; a remote procedure must not have a name of a list's "
      "method");
  EXPECT_EQ(error("def t():\n g = rpc_factory(\"xmlrpc\", \"ftp://x\")\nend\n"),
            "2:6 rpc_factory: found the address 'ftp://x'; allowed: \"http://HOST:PORT/PATH\"");
  EXPECT_EQ(error("def t():\n g = rpc_factory(\"soap\", \"http://x\")\nend\n"),
            "2:6 rpc_factory: found the type 'soap'; allowed: \"xmlrpc\"");
}

TEST(UrscriptLanguage, PosesFollowTheirClosedForms) {
  EXPECT_EQ(result("pose_trans(p[1,2,3,0,0,d2r(90)], p[1,0,0,0,0,0])"), "p[1, 3, 3, 0, 0, 1.5708]");
  EXPECT_EQ(result("pose_dist(pose_trans(p[1,2,3,0.1,0.2,0.3], pose_inv(p[1,2,3,0.1,0.2,0.3])), "
                   "p[0,0,0,0,0,0]) < 1e-12"),
            "True");
  EXPECT_EQ(result("interpolate_pose(p[0,0,0,0,0,0], p[2,0,0,0,0,1], 0.25)"), "p[0.5, 0, 0, 0, 0, 0.25]");
  EXPECT_EQ(result("point_dist(p[0,0,0,0,0,0], p[3,4,0,1,0,0])"), "5");
  EXPECT_EQ(result("pose_add(p[1,2,3,0,0,0], p[1,1,1,0,0,0.5])"), "p[2, 3, 4, 0, 0, 0.5]");
  EXPECT_EQ(result("pose_sub(p[2,3,4,0,0,0.5], p[1,2,3,0,0,0])"), "p[1, 1, 1, 0, 0, 0.5]");
  EXPECT_EQ(result("rotvec2rpy(rpy2rotvec([0.1, 0.2, 0.3]))"), "[0.1, 0.2, 0.3]");
  EXPECT_EQ(result("wrench_trans(p[0,1,0,0,0,0], [0,0,10,0,0,0])"), "[0, 0, 10, -10, 0, 0]");
  EXPECT_EQ(result("norm([3, 4])"), "5");
  EXPECT_EQ(result("inv([[2,0],[0,4]]) * [1,1]"), "[0.5, 0.25]");
  EXPECT_EQ(error("def t():\n x = inv([[1,2],[2,4]])\nend\n"), "2:6 inv: the matrix has no inverse");
  EXPECT_EQ(result("transpose([[1,2],[3,4]])"), "[[1, 3], [2, 4]]");
}

TEST(UrscriptLanguage, ErrorsHaveLineAndColumn) {
  EXPECT_EQ(error("def t():\n  x = y\nend\n"), "2:7 compile_error_name_not_found:y:");
  EXPECT_EQ(error("def t():\n  f()\nend\n"), "2:3 compile_error_name_not_found:f:");
  EXPECT_EQ(error("def t():\n\n  x = 1 / 0\nend\n"), "3:7 division by zero");
  EXPECT_EQ(error("def t():\n a = [1]\n a[1] = 0\nend\n"), "3:2 index 1 is out of range; allowed: 0 to 0");
  EXPECT_EQ(error("def t():\n if 1:\n end\nend\n"),
            "2:5 type_error: True or False is expected, found a number");
  EXPECT_EQ(error("def t():\n x = \"a\" + \"b\"\nend\n"), "2:6 type_error: + of a text and a text");
  EXPECT_EQ(error("def t():\n if False:\n  x = 1\n end\n y = x\nend\n"), "5:6 x has no value yet");
  EXPECT_EQ(error("def t():\n def f():\n  f()\n end\n f()\nend\n").substr(0, 4), "3:3 ");
  EXPECT_EQ(error("def t():\n x = sqrt(-1)\nend\n"), "2:6 the result is no finite number");
}

TEST(UrscriptLanguage, WhatASimulatorCannotDoIsRefusedByNameBeforeTheStart) {
  for (const Function& function : functions()) {
    if (function.kind != Function::Kind::refused) continue;
    const std::string name(function.name);
    try {
      parse_program("def t():\n  set_digital_out(0, True)\n  x = " + name + "(1)\nend\n");
      ADD_FAILURE() << name;
    } catch (const ScriptError& found) {
      EXPECT_EQ(found.line(), 3);
      EXPECT_EQ(found.column(), 7);
      EXPECT_EQ(found.what(), name + " is not supported by takt: " + std::string(function.does));
    }
  }
}

TEST(UrscriptLanguage, EveryFunctionThatComputesHasItsComputation) {
  for (const Function& function : functions()) {
    if (function.kind != Function::Kind::computes) continue;
    const std::vector<takt::urscript::Value> arguments(signature_of(function).names.size());
    try {
      compute(function, arguments);
    } catch (const ValueError&) {  // the refusal of missing arguments
    }
  }
}

TEST(UrscriptLanguage, ThePageOfFunctionsIsThatOfTheTable) {
  std::ifstream in(TAKT_SOURCE_DIR "/docs/urscript.md");
  std::stringstream page;
  page << in.rdbuf();
  EXPECT_EQ(page.str(), functions_page()) << "takt-ur functions > docs/urscript.md renews it";
}

TEST(UrscriptLanguage, MemoryAndWorkAreBounded) {
  EXPECT_NE(error("def t():\n a = \"x\"\n while True:\n  a = str_cat(a, a)\n end\nend\n").find("bytes"),
            std::string::npos);
  EXPECT_NE(error("def t():\n a = [1]\n while True:\n  a = [a, a]\n end\nend\n").find("deep"),
            std::string::npos);
  EXPECT_NE(
      error("def t():\n thread f():\n  sleep(1)\n end\n while True:\n  run f()\n end\nend\n").find("threads"),
      std::string::npos);
  EXPECT_NE(error("def t():\n def f(a):\n  b = [f([1,2,3])]\n end\n f(1)\nend\n").find("deep"),
            std::string::npos);
  EXPECT_NE(error("def t():\n x = " + std::string(5000, '(') + "1").find("in one another"),
            std::string::npos);
  std::string hoard = "def t():\n";
  for (int i = 0; i < 600; ++i)
    hoard += " v" + std::to_string(i) + " = make_list(2000, " + std::to_string(i) + ")\n";
  EXPECT_NE(error(hoard + "end\n").find("cells"), std::string::npos);
  EXPECT_EQ(error("def t():\n x = 1e300 * 1e300\nend\n"), "2:6 the result is no finite number");
  EXPECT_EQ(error("def t():\n x = 0 % 0\nend\n"), "2:6 division by zero");
  std::string sum = "0";
  for (int i = 0; i < 5000; ++i) sum += "+1";
  EXPECT_NE(error("def t():\n x = " + sum + "\nend\n").find("operators"), std::string::npos);
}

TEST(UrscriptLanguage, AMoveBehindComputationsAndOutputsIsForeseen) {
  class Ahead final : public Host {
   public:
    Interpreter* interpreter = nullptr;
    std::vector<std::string> found;
    Outcome call(const HostCall& call) override {
      if (call.function.kind != Function::Kind::moves) return {};
      const auto next = interpreter->next_move(call.thread);
      found.push_back(next ? text_of(next->arguments[0]) + "@" + std::to_string(next->line) : "none");
      return {};
    }
    std::optional<takt::urscript::Value> foresee(const Function&,
                                                 std::span<const takt::urscript::Value>) override {
      return std::nullopt;
    }
    RoutinePointer statement_ahead(std::size_t) override { return nullptr; }
    void ended(std::uint64_t) override {}
  } host;
  Interpreter interpreter(parse_program("def t():\n i = 0\n while i < 2:\n  movej([i, 0, 0, 0, 0, 0], "
                                        "r=0.1)\n  i = i + 1\n  set_digital_out(0, True)\n"
                                        " end\n if i == 2:\n  movej([i, 0, 0, 0, 0, 0])\n end\n sleep(1)\n "
                                        "movej([9, 0, 0, 0, 0, 0])\nend\n")
                              .code,
                          host);
  host.interpreter = &interpreter;
  while (interpreter.advance()) {
  }
  EXPECT_EQ(host.found, (Lines{"[1, 0, 0, 0, 0, 0]@4", "[2, 0, 0, 0, 0, 0]@9", "none", "none"}));
}

TEST(UrscriptLanguage, MutatedProgramsEndOrAreRefused) {
  const std::string seed = program(
      " global n = 0\n a = [[1,2],[3,4]]\n s = struct(x = 1, y = [1,2,3])\n def f(k, m = 2):\n  local r = "
      "k\n  while r > 0 and n < 9:\n"
      "   r = r - m\n   n = n + 1\n   a[0, 1] = r\n  end\n  return r\n end\n thread t():\n  enter_critical\n "
      " n = f(5)\n  exit_critical\n"
      " end\n h = run t()\n join h\n if f(3) == -1:\n  s.y[1] = a[1, 0] * 2\n elif not True:\n  kill h\n "
      "else:\n  textmsg(str_cat(\"n\", n))\n end\n"
      " movej(get_inverse_kin(p[0,0,1,0,0,0]), r = 0.1)\n sleep(0.01)\n");
  std::mt19937 random(24);
  const std::string letters = "()[]{}=+-*/%<>.,:#$\"\n \tpaeif0129_";
  int refused = 0, ran = 0;
  for (int i = 0; i < 3000; ++i) {
    std::string text = seed;
    for (int changes = 1 + i % 2; changes > 0; --changes) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text.erase(at, 1);
          break;
        case 1:
          text.insert(at, 1, letters[random() % letters.size()]);
          break;
        case 2:
          text[at] = letters[random() % letters.size()];
          break;
        default: {  // a line once more, elsewhere
          const std::size_t from = text.find('\n', random() % text.size()), to = text.find('\n', at);
          if (from == std::string::npos || to == std::string::npos) break;
          text.insert(to, text.substr(from, text.find('\n', from + 1) - from));
        }
      }
      if (text.empty()) text = "\n";
    }
    RecordingHost host;
    try {
      Interpreter interpreter(parse_program(text).code, host);
      for (int cycle = 0; cycle < 20 && interpreter.advance(); ++cycle) ++host.cycle;
      ++ran;
    } catch (const ScriptError& found) {
      ++refused;
      ASSERT_GE(found.line(), 1) << text;
      ASSERT_GE(found.column(), 1) << text;
    }
  }
  EXPECT_GT(refused, 300);
  EXPECT_GT(ran, 300);
}

}  // namespace
