// SPDX-License-Identifier: Apache-2.0
// Expressions of a .dpde file as types, and the names in them.
#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "source/source_file.h"
#include "support/match.h"
#include "support/vocabulary.h"

namespace dpde::ast {

struct Node;

/// A name that is declared or referred to, with its position; components with a dot, u.x.
struct Identifier {
  std::string name;
  SourceRange range;
};

/// Value handle of an immutable expression; never null.
class Expr {
 public:
  Expr();  // an Error node
  explicit Expr(Node node);
  const Node& node() const { return *node_; }
  const Node* operator->() const { return node_.get(); }
  SourceRange range() const;

 private:
  std::shared_ptr<const Node> node_;
};

enum class UnaryOp { negate, logical_not, magnitude };  // magnitude: |u|

struct Number {
  double value;
  std::string spelling;  // as written
};
struct Text {  // "file.npy"
  std::string value;
};
struct Name {
  std::string name;  // components with a dot, u.x
};
struct Unary {
  UnaryOp op;
  Expr operand;
};
struct Binary {
  BinaryOp op;
  Expr left, right;
};
struct Argument {
  std::string name;  // rate in rate = 5; "" if positional
  Expr value;
  SourceRange name_range = {};
};
struct Call {  // lap(u), central(2), gradient_descent(rate = 5)
  std::string callee;
  SourceRange callee_range;
  std::vector<Argument> arguments;
};
struct Tuple {  // (u, v)
  std::vector<Expr> elements;
};
/// u[+1, 0]: the field at a displacement in cells; inside[-1, 0] grow 1 has the name "inside".
struct Offsets {
  std::string name;
  std::vector<int> offsets;
  int grow = 0;           // only after inside[...]
  bool has_signs = true;  // else it may be an array element, c[1]
};
struct Component {  // grad(u).x, closure(u, v).flux; for a plain name it is part of the name
  Expr operand;
  Identifier name;
};
struct Error {};

using Kind = std::variant<Number, Text, Name, Unary, Binary, Call, Tuple, Offsets, Component, Error>;

struct Node {
  Kind kind;
  SourceRange range;
};

/// `f` on each direct part.
template <class F>
void for_each_part(const Expr& e, const F& f) {
  match(
      e->kind, ignored<Number, Text, Name, Offsets, Error>,
      [&](const OneOf<Unary, Component> auto& one) { f(one.operand); }, [&](const Binary& b) { f(b.left), f(b.right); },
      [&](const Call& c) {
        for (const Argument& argument : c.arguments) f(argument.value);
      },
      [&](const Tuple& t) {
        for (const Expr& element : t.elements) f(element);
      });
}

}  // namespace dpde::ast
