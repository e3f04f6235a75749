// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/one_moment.h"

#include <algorithm>
#include <array>
#include <string>

#include "stencil/build.h"
#include "support/contains.h"

namespace dpde::stability {

using namespace stencil;

namespace {

/// Events compute the number of steps done, (t - t_begin)/dt, which is undefined at dt = 0.
bool divides_by_step(const Expr& e) {
  return any_part(e, [](const Expr& part) {
    const auto* b = as<Binary>(part);
    return b != nullptr && b->op == BinaryOp::divide && reads_param(b->right, "dt");
  });
}

bool compares_times(const Expr& e) {
  constexpr std::array comparisons{BinaryOp::less, BinaryOp::less_equal, BinaryOp::greater, BinaryOp::greater_equal};
  const auto* b = as<Binary>(e);
  return b != nullptr && std::ranges::find(comparisons, b->op) != comparisons.end() && reads_param(e, "t") &&
         reads_param(e, "dt") && !divides_by_step(e);
}

/// Whether it is a condition t < t_begin + ..., true only in the first steps.
bool is_before(const Expr& e, double t_begin) {
  const auto* b = as<Binary>(e);
  if (b == nullptr || b->op != BinaryOp::less) return false;
  const auto* time = as<Param>(b->left);
  const auto* bound = as<Literal>(b->right);
  return time != nullptr && time->name == "t" && bound != nullptr && bound->value <= t_begin;
}

Expr with_one_moment(const Expr& e, double t_begin) {
  if (!compares_times(e)) return map_children(e, [&](const Expr& part) { return with_one_moment(part, t_begin); });
  const Expr compared = substitute_params(e, {{"dt", 0.0}});
  return is_before(compared, t_begin) ? Expr(0.0) : compared;
}

}  // namespace

Module at_one_moment(Module module, double t_begin) {
  for (Kernel& kernel : module.kernels) {
    if (contains(signature(kernel).params, std::string("t")))
      kernel = map_expressions(kernel, [&](const Expr& e) { return with_one_moment(e, t_begin); });
  }
  return module;
}

}  // namespace dpde::stability
