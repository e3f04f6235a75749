// SPDX-License-Identifier: Apache-2.0
#include "adjoint/check/extremes.h"

#include <cmath>
#include <limits>

#include "stencil/build.h"

namespace dpde::adjoint {

using namespace stencil;

void add_store(const std::string& field, const Expr& value, const std::string& what, const Writing& into) {
  const std::string name = into.names.fresh_kernel(into.primal.name + into.suffix + "_" + what);
  into.body.push_back(Run{name});
  into.kernels.kernels.push_back(
      {name, static_cast<int>(into.primal.axes.size()), {}, {{field, false, value, {}}}, {}, {}});
}

namespace {

/// Appends the sum of `value` over the axes of `reduce`; returns the field with the sum.
std::string add_sum(const Expr& value, const std::string& wish, const Reduce& reduce, const Writing& into) {
  const std::string each = into.names.fresh(wish), sum = into.names.fresh(wish + "_sum");
  add_store(each, value, wish, into);
  into.body.push_back(Reduce{sum, Reduction::sum, each, reduce.over});
  return sum;
}

}  // namespace

bool is_extreme(const Reduce& reduce) { return reduce.kind == Reduction::max || reduce.kind == Reduction::min; }

/// Cells whose values differ by rounding only count as tied: states that are equal except for rounding, such as mirror
/// images, have different last bits in each back end. Central differences cannot distinguish values that are closer
/// than this fraction of their size. In f32 the fraction is below the last bit; the precision is not known here.
Expr at_extreme(const Reduce& reduce, const Expr& value) {
  const double resolved = std::pow(std::numeric_limits<double>::epsilon(), 2.0 / 3);
  const Expr extreme = access(reduce.result), near = resolved * call(Fn::abs, {extreme});
  const Expr shares = reduce.kind == Reduction::max
                          ? binary(BinaryOp::greater_equal, access(reduce.field), extreme - near)
                          : binary(BinaryOp::less_equal, access(reduce.field), extreme + near);
  return select(shares, value, 0.0);
}

std::string add_count_of_ties(const Reduce& reduce, const Writing& into) {
  return add_sum(at_extreme(reduce, 1.0), "ties", reduce, into);
}

void add_tangent_of_extreme(const Reduce& reduce, const Writing& into) {
  const std::string count = add_count_of_ties(reduce, into);
  const std::string total = add_sum(at_extreme(reduce, access(into.names.of(reduce.field))), "rates", reduce, into);
  add_store(into.names.of(reduce.result), access(total) / access(count), reduce.result, into);
}

}  // namespace dpde::adjoint
