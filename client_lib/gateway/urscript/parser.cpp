#include <algorithm>

#include "client_lib/gateway/urscript/lexer.h"
#include "client_lib/gateway/urscript/syntax.h"

namespace takt::urscript {
namespace {

/// Of expressions and blocks in one another.
constexpr int kMostNesting = 300, kMostOperators = 100;

class Parser {
 public:
  explicit Parser(std::string_view text) : tokens_(tokens_of(text)) {}

  Definition program() {
    skip_lines();
    if (is_keyword("def") || is_keyword("sec")) {
      const std::size_t begin = at_;
      Definition definition = define();
      skip_lines();
      if (at_end()) return definition;
      at_ = begin;  // a file of functions and statements
    }
    Definition definition;
    definition.body = block({});
    return definition;
  }

 private:
  class Nesting {
   public:
    explicit Nesting(Parser& parser) : parser_(parser) {
      if (++parser_.nesting_ > kMostNesting)
        parser_.fail("more than " + std::to_string(kMostNesting) + " expressions or blocks in one another");
    }
    ~Nesting() { --parser_.nesting_; }
    Nesting(const Nesting&) = delete;
    Nesting& operator=(const Nesting&) = delete;

   private:
    Parser& parser_;
  };

  const Token& token() const { return tokens_[at_]; }
  bool at_end() const { return token().kind == Token::Kind::end_of_text; }
  std::string shown() const {
    return token().kind == Token::Kind::end_of_line ? "end of line" : token().text.substr(0, 80);
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw ScriptError(token().line, token().column, "syntax_error: " + what);
  }
  bool is_keyword(std::string_view word) const {
    return token().kind == Token::Kind::keyword && token().text == word;
  }
  bool is_symbol(std::string_view symbol) const {
    return token().kind == Token::Kind::symbol && token().text == symbol;
  }
  bool takes_keyword(std::string_view word) { return is_keyword(word) && ++at_ > 0; }
  bool takes_symbol(std::string_view symbol) { return is_symbol(symbol) && ++at_ > 0; }
  void expect(std::string_view symbol) {
    if (!takes_symbol(symbol)) fail("'" + std::string(symbol) + "' is missing before " + shown());
  }
  std::string name(const char* what) {
    if (token().kind != Token::Kind::name) fail(std::string(what) + " is expected, found " + shown());
    return tokens_[at_++].text;
  }
  /// Members may have the names of keywords: time().sec.
  bool is_member_name() const {
    return token().kind == Token::Kind::name || token().kind == Token::Kind::keyword;
  }
  void skip_lines() {
    while (token().kind == Token::Kind::end_of_line) ++at_;
  }
  bool at_end_of_statement() const {
    return token().kind == Token::Kind::end_of_line || is_keyword("end") || is_keyword("else") ||
           is_keyword("elif");
  }

  // --- statements ---

  /// Up to one of the words, which stays; or to the end of the text.
  Statement::Block block(std::initializer_list<std::string_view> ends) {
    const Nesting nesting(*this);
    Statement::Block statements;
    for (skip_lines(); !at_end(); skip_lines()) {
      if (std::any_of(ends.begin(), ends.end(), [this](auto word) { return is_keyword(word); }))
        return statements;
      if (is_keyword("end")) fail("'end' without a block");
      statements.push_back(statement());
    }
    if (ends.size() > 0) fail("a block has no 'end'");
    return statements;
  }

  Definition define() {
    Definition definition;
    definition.line = token().line;
    definition.column = token().column;
    if (is_keyword("thread")) definition.kind = Definition::Kind::thread;
    if (is_keyword("sec")) definition.kind = Definition::Kind::secondary;
    ++at_;
    definition.name = name("the name of a function");
    expect("(");
    while (!is_symbol(")")) {
      Parameter parameter{name("the name of a parameter")};
      if (takes_symbol("=")) parameter.otherwise = expression();
      definition.parameters.push_back(std::move(parameter));
      if (!is_symbol(")")) expect(",");
    }
    expect(")");
    expect(":");
    definition.body = block({"end"});
    ++at_;
    return definition;
  }

  Statement statement() {
    Statement result;
    result.line = token().line;
    result.column = token().column;
    using Kind = Statement::Kind;
    if (is_keyword("def") || is_keyword("thread")) {
      result.kind = Kind::definition;
      result.definition = std::make_shared<const Definition>(define());
    } else if (is_keyword("sec")) {
      fail("a secondary program cannot stand in another program");
    } else if (is_keyword("for")) {
      fail("URScript has no for; while is allowed");
    } else if (takes_keyword("if")) {
      branch(result);
    } else if (takes_keyword("while")) {
      result.kind = Kind::loop;
      result.expressions.push_back(expression());
      expect(":");
      result.blocks.push_back(block({"end"}));
      ++at_;
    } else {
      simple(result);
    }
    return result;  // the next statement may stand in the same line
  }

  void branch(Statement& result) {
    result.kind = Statement::Kind::branch;
    do {
      result.expressions.push_back(expression());
      expect(":");
      result.blocks.push_back(block({"elif", "else", "end"}));
    } while (takes_keyword("elif"));
    if (takes_keyword("else")) {
      takes_symbol(":");
      result.blocks.push_back(block({"end"}));
    }
    if (!takes_keyword("end")) fail("'end' is expected, found " + shown());
  }

  void simple(Statement& result) {
    using Kind = Statement::Kind;
    const auto word = [&](std::string_view keyword, Kind kind) {
      if (!takes_keyword(keyword)) return false;
      result.kind = kind;
      return true;
    };
    if (word("break", Kind::loop_break) || word("continue", Kind::loop_continue)) return;
    if (word("halt", Kind::halt)) return brackets();
    if (word("return", Kind::function_return)) {
      if (!at_end_of_statement()) result.expressions.push_back(expression());
      return;
    }
    if (word("join", Kind::join) || word("kill", Kind::kill)) {
      result.expressions.push_back(expression());
      return;
    }
    if (token().kind == Token::Kind::name &&
        (token().text == "enter_critical" || token().text == "exit_critical")) {
      result.kind = token().text == "enter_critical" ? Kind::enter_critical : Kind::exit_critical;
      ++at_;
      return brackets();
    }
    if (takes_keyword("global")) result.scope = Statement::Scope::global;
    if (takes_keyword("local")) result.scope = Statement::Scope::local;
    result.expressions.push_back(expression());
    if (takes_symbol("=")) {
      result.kind = Kind::assignment;
      const Expression* target = &result.expressions.front();
      while (target->kind == Expression::Kind::index || target->kind == Expression::Kind::member)
        target = &target->operands.front();
      if (target->kind != Expression::Kind::name)
        throw ScriptError(result.line, result.column,
                          "syntax_error: allowed on the left of '=': a variable, its elements and members");
      result.expressions.push_back(expression());
      return;
    }
    const Expression::Kind kind = result.expressions.front().kind;
    if (result.scope != Statement::Scope::free ||
        (kind != Expression::Kind::call && kind != Expression::Kind::run && kind != Expression::Kind::method))
      fail("a statement is an assignment or a call");
  }

  void brackets() {
    if (takes_symbol("(")) expect(")");
  }

  // --- expressions, from weak to strong ---

  static Expression node(Expression::Kind kind, const Expression& at, std::vector<Expression> operands) {
    Expression result;
    result.kind = kind;
    result.line = at.line;
    result.column = at.column;
    result.operands = std::move(operands);
    return result;
  }
  Expression measured(Expression expression) const {
    for (const Expression& operand : expression.operands)
      expression.depth = std::max(expression.depth, 1 + operand.depth);
    if (expression.depth > kMostOperators)
      fail("more than " + std::to_string(kMostOperators) +
           " operators in one expression; a variable may hold a part of it");
    return expression;
  }
  Expression joined(Expression::Kind kind, Operator op, Expression a, Expression b) const {
    const Expression at = position_of(a);
    std::vector<Expression> operands;
    operands.push_back(std::move(a));
    operands.push_back(std::move(b));
    Expression result = node(kind, at, std::move(operands));
    result.op = op;
    return measured(std::move(result));
  }
  static Expression position_of(const Expression& a) {
    Expression at;
    at.line = a.line;
    at.column = a.column;
    return at;
  }
  Expression here() const {
    Expression at;
    at.line = token().line;
    at.column = token().column;
    return at;
  }

  Expression expression() {
    const Nesting nesting(*this);
    Expression left = conjunction();
    for (;;) {
      if (takes_keyword("or"))
        left = joined(Expression::Kind::logical_or, Operator::add, std::move(left), conjunction());
      else if (takes_keyword("xor"))
        left = joined(Expression::Kind::binary, Operator::logical_xor, std::move(left), conjunction());
      else
        return left;
    }
  }
  Expression conjunction() {
    Expression left = negation();
    while (takes_keyword("and"))
      left = joined(Expression::Kind::logical_and, Operator::add, std::move(left), negation());
    return left;
  }
  Expression negation() {
    const Nesting nesting(*this);
    skip_lines();  // an expression may go on in the next line where a value is missing
    const Expression at = here();
    if (!takes_keyword("not")) return comparison();
    Expression result = node(Expression::Kind::unary, at, {negation()});
    result.op = Operator::logical_not;
    return measured(std::move(result));
  }

  using Operators = std::initializer_list<std::pair<std::string_view, Operator>>;
  template <class Next>
  Expression chain(Operators operators, const Next& next) {
    Expression left = next();
    for (;;) {
      const auto found = std::find_if(operators.begin(), operators.end(),
                                      [this](const auto& one) { return is_symbol(one.first); });
      if (found == operators.end()) return left;
      ++at_;
      left = joined(Expression::Kind::binary, found->second, std::move(left), next());
    }
  }
  Expression comparison() {
    return chain({{"==", Operator::equal},
                  {"!=", Operator::unequal},
                  {"<", Operator::less},
                  {"<=", Operator::less_equal},
                  {">", Operator::greater},
                  {">=", Operator::greater_equal}},
                 [this] { return sum(); });
  }
  Expression sum() {
    return chain({{"+", Operator::add}, {"-", Operator::subtract}}, [this] { return product(); });
  }
  Expression product() {
    return chain({{"*", Operator::multiply}, {"/", Operator::divide}, {"%", Operator::modulo}},
                 [this] { return sign(); });
  }
  Expression sign() {
    const Nesting nesting(*this);
    skip_lines();
    const Expression at = here();
    if (takes_symbol("+")) return sign();
    if (!takes_symbol("-")) return postfix();
    Expression operand = sign();
    if (operand.kind == Expression::Kind::constant && operand.constant.is_number()) {
      operand.constant = apply(Operator::negate, operand.constant);
      return operand;
    }
    Expression result = node(Expression::Kind::unary, at, {});
    result.operands.push_back(std::move(operand));
    result.op = Operator::negate;
    return measured(std::move(result));
  }

  Expression postfix() {
    Expression base = primary();
    for (;;) {
      const Expression at = position_of(base);
      if (takes_symbol("[")) {
        Expression index = node(Expression::Kind::index, at, {});
        index.operands.push_back(std::move(base));
        do index.operands.push_back(expression());
        while (takes_symbol(","));
        expect("]");
        base = measured(std::move(index));
      } else if (takes_symbol(".")) {
        Expression member = node(Expression::Kind::member, at, {});
        member.operands.push_back(std::move(base));
        if (!is_member_name()) fail("the name of a member is expected, found " + shown());
        member.name = tokens_[at_++].text;
        if (is_symbol("(")) {
          member.kind = Expression::Kind::method;
          member.names.emplace_back();
          arguments(member);
        }
        base = measured(std::move(member));
      } else {
        return base;
      }
    }
  }

  void arguments(Expression& call) {
    expect("(");
    while (!is_symbol(")")) {
      std::string given;
      if (is_member_name() && tokens_[at_ + 1].kind == Token::Kind::symbol && tokens_[at_ + 1].text == "=") {
        given = token().text;
        at_ += 2;
      }
      call.operands.push_back(expression());
      call.names.push_back(std::move(given));
      if (!is_symbol(")") && !takes_symbol(",")) fail("',' or ')' is missing before " + shown());
    }
    expect(")");
  }

  Expression primary() {
    Expression result = here();
    const Token& first = token();
    if (first.kind == Token::Kind::number) {
      result.constant = first.whole ? Value::whole(first.number) : Value(first.number);
      ++at_;
    } else if (first.kind == Token::Kind::text) {
      result.constant = first.text;
      ++at_;
    } else if (is_keyword("True") || is_keyword("true") || is_keyword("False") || is_keyword("false")) {
      result.constant = first.text == "True" || first.text == "true";
      ++at_;
    } else if (takes_symbol("(")) {
      result = expression();
      expect(")");
    } else if (is_symbol("[")) {
      elements(result, Expression::Kind::list);
    } else if (first.kind == Token::Kind::name && first.text == "p" && tokens_[at_ + 1].text == "[" &&
               tokens_[at_ + 1].kind == Token::Kind::symbol && tokens_[at_ + 1].column == first.column + 1 &&
               is_pose()) {
      ++at_;
      elements(result, Expression::Kind::pose);
    } else if (takes_keyword("run")) {
      result.kind = Expression::Kind::run;
      result.name = name("the name of a thread");
      brackets();
    } else if (first.kind == Token::Kind::name) {
      result.name = first.text;
      ++at_;
      result.kind = is_symbol("(") ? Expression::Kind::call : Expression::Kind::name;
      if (result.kind == Expression::Kind::call) arguments(result);
    } else {
      fail("a value is expected, found '" + shown() + "'");
    }
    return measured(std::move(result));
  }

  /// p[ begins a pose, unless it has one element: then it is an element of a variable p.
  bool is_pose() const {
    int depth = 0;
    for (std::size_t i = at_ + 1; i < tokens_.size(); ++i) {
      const std::string& text = tokens_[i].text;
      if (tokens_[i].kind != Token::Kind::symbol) continue;
      if (text == "[" || text == "(") ++depth;
      if ((text == "]" || text == ")") && --depth == 0) return false;
      if (text == "," && depth == 1) return true;
    }
    return true;
  }

  void elements(Expression& result, Expression::Kind kind) {
    result.kind = kind;
    expect("[");
    while (!is_symbol("]")) {
      result.operands.push_back(expression());
      if (!is_symbol("]") && !takes_symbol(",")) fail("',' or ']' is missing before " + shown());
    }
    expect("]");
  }

  std::vector<Token> tokens_;
  std::size_t at_ = 0;
  int nesting_ = 0;
};

}  // namespace

Definition parse(std::string_view text) {
  return Parser(text).program();
}

}  // namespace takt::urscript
