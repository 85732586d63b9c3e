// XML-RPC over HTTP. Expectations come from the XML-RPC specification (Winer, 1999) and RFC 9112.
#include <gtest/gtest.h>

#include "client_lib/gateway/urscript/xml_rpc.h"

namespace {

using namespace takt::rpc;
using takt::urscript::Value;
using takt::urscript::ValueError;

const std::string kHead = "HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\n";

std::string response(const std::string& value) {
  return "<?xml version='1.0'?>\n<methodResponse>\n<params>\n<param>\n<value>" + value +
         "</value>\n</param>\n</params>\n</methodResponse>\n";
}
std::string with_length(const std::string& body) {
  return kHead + "content-LENGTH:  " + std::to_string(body.size()) + "\r\n\r\n" + body;
}
std::optional<Value> result_of(const std::string& bytes, bool closed = false) {
  ReplyStream stream;
  stream.add(bytes);
  if (closed) stream.close();
  return stream.result();
}
Value value(const std::string& xml) {
  return result_of(with_length(response(xml))).value();
}
std::string problem(const std::string& bytes, bool closed = false) {
  try {
    return result_of(bytes, closed) ? "a result" : "incomplete";
  } catch (const ValueError& error) {
    return error.what();
  }
}

TEST(XmlRpc, AddressesHaveHostPortAndPath) {
  const Address all = parse_url("http://127.0.0.1:41414/RPC2"), least = parse_url("http://gripper");
  EXPECT_EQ(all.host, "127.0.0.1");
  EXPECT_EQ(all.port, 41414);
  EXPECT_EQ(all.path, "/RPC2");
  EXPECT_EQ(least.host, "gripper");
  EXPECT_EQ(least.port, 80);
  EXPECT_EQ(least.path, "/");
  for (const char* bad : {"", "gripper", "https://gripper", "http://", "http://:80",
                          "http://a:", "http://a:x", "http://a:0", "http://a:70000", "http://a/b\r\nX: y"})
    EXPECT_THROW(parse_url(bad), ValueError) << bad;
}

TEST(XmlRpc, ARequestHasEachTypeOfItsArguments) {
  const std::vector<Value> arguments{7,
                                     -0.5,
                                     2.0,
                                     true,
                                     "a<b&c",
                                     std::vector<double>{1.5},
                                     Value::pose(std::vector<double>{1, 2, 3, 4, 5, 6})};
  const std::string text = request({"host", 41414, "/RPC2"}, "grip.close", arguments);
  const std::size_t begin = text.find("\r\n\r\n") + 4;
  EXPECT_EQ(text.substr(0, 40), "POST /RPC2 HTTP/1.1\r\nHost: host:41414\r\nU");
  EXPECT_NE(text.find("\r\nContent-Length: " + std::to_string(text.size() - begin) + "\r\n"),
            std::string::npos);
  const auto number = [](const char* name, const char* digits) {
    return std::string("<member><name>") + name + "</name><value><double>" + digits +
           "</double></value></member>";
  };
  EXPECT_EQ(text.substr(begin),
            "<?xml version=\"1.0\"?>\r\n<methodCall><methodName>grip.close</methodName><params>"
            "<param><value><int>7</int></value></param>"
            "<param><value><double>-0.5</double></value></param>"
            "<param><value><double>2.0</double></value></param>"
            "<param><value><boolean>1</boolean></value></param>"
            "<param><value><string>a&lt;b&amp;c</string></value></param>"
            "<param><value><array><data><value><double>1.5</double></value></data></array></value></param>"
            "<param><value><struct>" +
                number("x", "1.0") + number("y", "2.0") + number("z", "3.0") + number("rx", "4.0") +
                number("ry", "5.0") + number("rz", "6.0") +
                "</struct></value></param></params></methodCall>\r\n");
  EXPECT_THROW(request({}, "f", std::vector<Value>{Value()}), ValueError);
}

TEST(XmlRpc, ResultsHaveTheirTypes) {
  EXPECT_EQ(value("<int>-3</int>"), Value(-3));
  EXPECT_TRUE(value("<i4> 4 </i4>").is_integer());
  EXPECT_EQ(value("<double>+1.25</double>"), Value(1.25));
  EXPECT_EQ(value("<boolean>0</boolean>"), Value(false));
  EXPECT_EQ(value("<string>a &lt; b</string>"), Value("a < b"));
  EXPECT_EQ(value("no type"), Value("no type"));
  EXPECT_TRUE(value("<nil/>").is_none());
  EXPECT_EQ(value("<array><data><value><int>1</int></value><value><int>2</int></value></data></array>"),
            Value(std::vector<double>{1, 2}));
  std::string members;
  for (const char* name : {"rz", "x", "y", "z", "rx", "ry"})
    members += std::string("<member><name>") + name + "</name><value><double>" +
               std::to_string(static_cast<int>(name[1] == 'z')) + "</double></value></member>";
  EXPECT_EQ(value("<struct>" + members + "</struct>"), Value::pose(std::vector<double>{0, 0, 0, 0, 0, 1}));
  const Value record = value("<struct><member><name>width</name><value><i4>5</i4></value></member></struct>");
  EXPECT_EQ(text_of(record), "struct(width=5)");
  EXPECT_TRUE(result_of(with_length("<methodResponse><params/></methodResponse>"))->is_none());
}

TEST(XmlRpc, AReplyComesInAnyPartsAndForms) {
  const std::string body = response("<int>5</int>");
  const std::string whole = "HTTP/1.1 100 Continue\r\n\r\n" + with_length(body);
  for (std::size_t cut = 0; cut < whole.size(); ++cut)
    ASSERT_EQ(result_of(whole.substr(0, cut)), std::nullopt) << cut;
  EXPECT_EQ(result_of(whole), Value(5));
  char size[8];
  std::snprintf(size, sizeof size, "%zx", body.size() - 10);
  const std::string chunked = kHead + "Transfer-Encoding: Chunked\r\n\r\nA\r\n" + body.substr(0, 10) +
                              "\r\n" + size + ";x=y\r\n" + body.substr(10) + "\r\n";
  EXPECT_EQ(result_of(chunked), std::nullopt);
  EXPECT_EQ(result_of(chunked + "0\r\n\r\n"), Value(5));
  EXPECT_EQ(result_of(kHead + "\r\n" + body), std::nullopt);  // its end is that of the connection
  EXPECT_EQ(result_of(kHead + "\r\n" + body, true), Value(5));
}

TEST(XmlRpc, FaultsAndWhatIsNoReplyAreNamed) {
  const std::string fault =
      "<methodResponse><fault><value><struct><member><name>faultCode</name><value><int>4</int></value></"
      "member>"
      "<member><name>faultString</name><value>Too "
      "many.</value></member></struct></value></fault></methodResponse>";
  EXPECT_EQ(problem(with_length(fault)), "the procedure reports the fault 4: Too many.");
  EXPECT_EQ(problem("HTTP/1.0 404 Not Found\r\n\r\n"), "the server answers 404 Not Found");
  EXPECT_EQ(problem(kHead, true), "the reply is no XML-RPC: the connection was closed before its end");
  EXPECT_EQ(problem("SSH-2.0-OpenSSH_9.2\r\n\r\n"), "the reply is no XML-RPC: it begins with no HTTP status");
  EXPECT_EQ(problem(with_length("<html/>")), "the reply is no XML-RPC: no <methodResponse>");
  EXPECT_EQ(problem(with_length(response("<int>x</int>"))),
            "the reply is no XML-RPC: <int> holds 'x', allowed: a number");
  EXPECT_EQ(problem(with_length(response("<double>inf</double>"))),
            "the reply is no XML-RPC: <double> holds 'inf', allowed: a number");
  EXPECT_EQ(problem(with_length(response("<blob/>"))), "the reply is no XML-RPC: unknown type <blob>");
  EXPECT_EQ(problem(kHead + "Content-Length: 99999999999\r\n\r\n"),
            "the reply is no XML-RPC: Content-Length is '99999999999'");
  EXPECT_EQ(problem(std::string(ReplyStream::kMostBytes + 1, 'x')),
            "the reply is no XML-RPC: it has more than 1048576 bytes");
  std::string deep = "<int>1</int>";
  for (int i = 0; i < 20; ++i) deep = "<array><data><value>" + deep + "</value></data></array>";
  EXPECT_EQ(problem(with_length(response(deep))),
            "the reply is no XML-RPC: values lie too deep in one another");
}

}  // namespace
