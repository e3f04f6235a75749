// SPDX-License-Identifier: Apache-2.0
#include <functional>

#include "model/build.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::model {

namespace {

using Parts = std::optional<LinearPart>;
using Wrap = std::function<Expr(const Expr&)>;

class Splitter {
 public:
  Splitter(const std::string& field, const Expr* value, Origin& nonlinear)
      : field_(field), value_(value), nonlinear_(nonlinear) {}

  Parts operator()(const Expr& e) {
    if (!reads(e, field_)) return LinearPart{0.0, e};
    return match(
        e->kind,
        [&](const Field&) {
          return Parts(LinearPart{value_ ? *value_ : e, 0.0});
        },
        [&](const Neg& n) { return wrapped(n.operand, [&](const Expr& x) { return negate(x, e->origin); }); },
        [&](const Binary& b) { return of_binary(b, e); },
        [&](const Select& s) { return reads(s.condition, field_) ? refuse(e) : of_select(s, e); },
        [&](const Derivative& d) {
          return wrapped(d.operand, [&](const Expr& x) { return derivative(x, d.axis, d.order, e->origin); });
        },
        [&](const Advect& a) {
          for (const Expr& along : a.velocity) {
            if (reads(along, field_)) return refuse(e);
          }
          return wrapped(a.operand, [&](const Expr& x) { return advect(a.velocity, x, e->origin); });
        },
        [&](const Shift& s) {
          return wrapped(s.operand, [&](const Expr& x) { return shift(x, s.offset, e->origin); });
        },
        [&](const Interpolate& i) {
          return wrapped(i.operand, [&](const Expr& x) { return interpolate(x, e->origin); });
        },
        [&](const BandPass&) { return refuse(e); },  // not allowed in equations
        [&](const Number&) { return refuse(e); }, [&](const Param&) { return refuse(e); },
        [&](const Coordinate&) { return refuse(e); }, [&](const Noise&) { return refuse(e); },
        [&](const Call&) { return refuse(e); }, [&](const Sample&) { return refuse(e); },
        [&](const Reduce&) { return refuse(e); }, [&](const Apply&) { return refuse(e); },
        [&](const NetworkCall&) { return refuse(e); }, [&](const Solve&) { return refuse(e); });
  }

 private:
  Parts refuse(const Expr& e) {
    nonlinear_ = e->origin;
    return std::nullopt;
  }

  Parts wrapped(const Expr& operand, const Wrap& wrap) {
    const Parts inner = (*this)(operand);
    if (!inner) return std::nullopt;
    return LinearPart{wrap(inner->part), is_literal(inner->rest, 0) ? Expr(0.0) : wrap(inner->rest)};
  }

  Parts of_binary(const Binary& b, const Expr& e) {
    const bool in_left = reads(b.left, field_), in_right = reads(b.right, field_);
    const auto with = [&](const Expr& left, const Expr& right) { return binary(b.op, left, right, e->origin); };
    switch (b.op) {
      case BinaryOp::add:
      case BinaryOp::subtract: {
        const Parts left = (*this)(b.left), right = left ? (*this)(b.right) : std::nullopt;
        if (!right) return std::nullopt;
        return LinearPart{with(left->part, right->part), with(left->rest, right->rest)};
      }
      case BinaryOp::multiply:
        if (in_left && in_right) return refuse(e);
        return in_left ? wrapped(b.left, [&](const Expr& x) { return with(x, b.right); })
                       : wrapped(b.right, [&](const Expr& x) { return with(b.left, x); });
      case BinaryOp::divide:
        if (in_right) return refuse(e);
        return wrapped(b.left, [&](const Expr& x) { return with(x, b.right); });
      case BinaryOp::power:
      case BinaryOp::less:
      case BinaryOp::less_equal:
      case BinaryOp::greater:
      case BinaryOp::greater_equal:
      case BinaryOp::equal:
      case BinaryOp::not_equal:
      case BinaryOp::logical_and:
      case BinaryOp::logical_or: return refuse(e);
    }
    unreachable("operator");
  }

  Parts of_select(const Select& s, const Expr& e) {
    const Parts yes = (*this)(s.yes), no = yes ? (*this)(s.no) : std::nullopt;
    if (!no) return std::nullopt;
    return LinearPart{select(s.condition, yes->part, no->part, e->origin),
                      select(s.condition, yes->rest, no->rest, e->origin)};
  }

  const std::string& field_;
  const Expr* value_;  // replaces the field in `part`; null: the field itself
  Origin& nonlinear_;
};

}  // namespace

std::optional<LinearPart> linear_part(const Expr& e, const std::string& field, Origin& nonlinear) {
  return Splitter(field, nullptr, nonlinear)(e);
}

std::optional<LinearPart> linear_part(const Expr& e, const std::string& field, Origin& nonlinear, const Expr& value) {
  return Splitter(field, &value, nonlinear)(e);
}

}  // namespace dpde::model
