// SPDX-License-Identifier: Apache-2.0
#include "driver/compile/time_averages.h"

#include "model/build.h"

namespace dpde::driver {

namespace {

struct Spread {
  double states;
  model::Expr length;  // time that a state stands for

  /// Contribution of one state to a mean, integral or sum of a whole line.
  model::Expr counted(const model::Expr& e, model::Reduce::Kind kind) const {
    if (kind == model::Reduce::Kind::mean) return model::binary(BinaryOp::divide, e, states, e->origin);
    if (kind == model::Reduce::Kind::integral) return model::binary(BinaryOp::multiply, length, e, e->origin);
    return e;
  }

  /// Applies to each reduction its own kind.
  model::Expr by_terms(const model::Expr& e) const {
    if (!holds_any<model::Reduce>(e)) return counted(e, model::Reduce::Kind::mean);  // of a generated task
    if (const model::Reduce* reduce = as<model::Reduce>(e)) return counted(e, reduce->reduction);
    if (const model::Neg* neg = as<model::Neg>(e)) return model::negate(by_terms(neg->operand));
    const model::Binary* b = as<model::Binary>(e);
    if (b == nullptr) return e;  // never happens: losses are linear in reductions
    const bool is_sum = b->op == BinaryOp::add || b->op == BinaryOp::subtract;
    const bool left = is_sum || holds_any<model::Reduce>(b->left), right = is_sum || holds_any<model::Reduce>(b->right);
    return model::binary(b->op, left ? by_terms(b->left) : b->left, right ? by_terms(b->right) : b->right, e->origin);
  }

  void operator()(model::Expr& e, const model::When& when) const {
    e = when.counted ? counted(e, *when.counted) : by_terms(e);
  }
};

/// Trapezoidal rule: the first and the last state stand for half a step.
model::Expr length_of_state(const model::Problem& problem) {
  const double half = problem.step / 2, begin = problem.t_begin, end = begin + problem.steps * problem.step;
  const model::Expr t = model::param("t");
  const auto is_at_end = model::binary(BinaryOp::logical_or, model::binary(BinaryOp::less, t, begin + half),
                                       model::binary(BinaryOp::greater, t, end - half));
  return model::select(is_at_end, half, problem.step);
}

}  // namespace

model::Problem spread_over_time(model::Problem problem) {
  if (!problem.task) return problem;
  const Spread spread{problem.steps + 1.0, length_of_state(problem)};
  for (model::Loss& loss : problem.task->losses) {
    if (loss.of_averages) continue;
    if (loss.when.kind == model::When::Kind::over) spread(loss.value, loss.when);
    if (loss.when.kind == model::When::Kind::steps && !loss.when.is_last)
      Spread{double(loss.when.count), problem.step}(loss.value, loss.when);
  }
  for (model::Test& test : problem.task->tests) {
    if (test.when.kind == model::When::Kind::over) spread(test.quantity.value, test.when);
  }
  return problem;
}

}  // namespace dpde::driver
