// SPDX-License-Identifier: Apache-2.0
#include "driver/over_time.h"

#include "model/build.h"

namespace dpde::driver {

namespace {

struct Spread {
  double states, step;

  model::Expr operator()(const model::Expr& e) const {
    if (!model::holds_reduction(e)) return model::binary(BinaryOp::divide, e, states);
    if (const model::Reduce* reduce = std::get_if<model::Reduce>(&e->kind)) {
      switch (reduce->reduction) {
        case model::Reduce::Kind::mean: return model::binary(BinaryOp::divide, e, states);
        case model::Reduce::Kind::integral: return model::binary(BinaryOp::multiply, e, step);
        case model::Reduce::Kind::sum:
        case model::Reduce::Kind::max:
        case model::Reduce::Kind::min: return e;
      }
    }
    if (const model::Neg* neg = std::get_if<model::Neg>(&e->kind)) return model::negate((*this)(neg->operand));
    const model::Binary* b = std::get_if<model::Binary>(&e->kind);
    if (b == nullptr) return e;  // not linear in reductions: reported where it is lowered
    const bool is_sum = b->op == BinaryOp::add || b->op == BinaryOp::subtract;
    const bool left = is_sum || model::holds_reduction(b->left), right = is_sum || model::holds_reduction(b->right);
    return model::binary(b->op, left ? (*this)(b->left) : b->left, right ? (*this)(b->right) : b->right, e->origin);
  }
};

}  // namespace

model::Problem spread_over_time(model::Problem problem) {
  if (!problem.task) return problem;
  const Spread spread{problem.steps + 1.0, problem.step};
  for (model::Loss& loss : problem.task->losses) {
    if (loss.when.kind == model::When::Kind::over) loss.value = spread(loss.value);
    if (loss.when.kind == model::When::Kind::steps)
      loss.value = Spread{double(loss.when.count), problem.step}(loss.value);
  }
  for (model::Test& test : problem.task->tests) {
    if (test.when.kind == model::When::Kind::over) test.quantity.value = spread(test.quantity.value);
  }
  return problem;
}

}  // namespace dpde::driver
