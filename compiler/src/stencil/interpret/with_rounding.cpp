// SPDX-License-Identifier: Apache-2.0
#include "stencil/interpret/with_rounding.h"

#include <fmt/format.h>

#include <set>
#include <string>
#include <vector>

#include "stencil/build.h"
#include "stencil/space/comparisons.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

Expr with_rounding(const Expr& e, int& nodes, double phase, double size) {
  const bool is_interp = is<Interp>(e);
  if (is_decision(e) && !is_interp) return e;
  const Expr inner =
      is_interp ? e : map_children(e, [&](const Expr& child) { return with_rounding(child, nodes, phase, size); });
  const bool rounds = is<Binary, Call>(e) || is_interp;
  if (!rounds) return inner;
  ++nodes;
  const Expr place = 100.0 * nodes * access("x") + phase * nodes;
  return inner * (1.0 + size * call(Fn::sin, {place}));
}

/// Perturbs the results of sums and means by what the order of their terms may change: a part of the sum of magnitudes
/// of the terms (N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2002, section 4.2).
class RoundedReductions {
 public:
  RoundedReductions(Module& module, double phase, double size) : module_(module), phase_(phase), size_(size) {}

  void round(std::vector<Statement>& body, int rank) {
    std::vector<Statement> result;
    for (Statement& statement : body) {
      // Operators of solves stay linear.
      for_each_block(statement, Blocks::passes, [&](std::vector<Statement>& block) { round(block, rank); });
      result.push_back(statement);
      match_some(statement, [&](const Reduce& reduce) {
        if (reduce.kind == Reduction::sum || reduce.kind == Reduction::mean) add(reduce, rank, result);
      });
    }
    body = std::move(result);
  }

 private:
  /// Before the reduction, which may overwrite its field: the sum of magnitudes. After it: the perturbation.
  void add(const Reduce& reduce, int rank, std::vector<Statement>& body) {
    ++count_;
    const std::string magnitude = fmt::format("{}_magnitude_{}", reduce.field, count_),
                      of_sum = fmt::format("{}_magnitude_{}", reduce.result, count_);
    const Expr place = reduce.over[0] ? Expr(phase_ * count_) : 100.0 * count_ * access("x") + phase_ * count_;
    Kernel before{fmt::format("magnitude_{}", count_), rank}, after{fmt::format("rounding_{}", count_), rank};
    before.stores.push_back({magnitude, false, call(Fn::abs, {access(reduce.field)}), {}});
    after.stores.push_back({reduce.result, true, size_ * call(Fn::sin, {place}) * access(of_sum), {}});
    Reduce magnitudes = reduce;
    magnitudes.field = magnitude, magnitudes.result = of_sum;
    body.insert(body.end() - 1, {Run{add_kernel(module_, before)}, magnitudes});
    body.push_back(Run{add_kernel(module_, after)});
  }

  Module& module_;
  const double phase_, size_;
  int count_ = 0;
};

}  // namespace

Module with_rounding(Module module, double phase, double size) {
  int nodes = 0;
  for (Kernel& kernel : module.kernels) {
    const std::set<std::string> decisive = decisive_lets(kernel);
    const std::vector<Let> lets = kernel.lets;
    kernel = map_expressions(kernel, [&](const Expr& value) { return with_rounding(value, nodes, phase, size); });
    for (std::size_t i = 0; i < lets.size(); ++i) {
      if (decisive.contains(lets[i].name)) kernel.lets[i] = lets[i];
    }
  }
  RoundedReductions reductions(module, phase, size);
  for (Program& program : module.programs) reductions.round(program.body, static_cast<int>(program.axes.size()));
  return module;
}

}  // namespace dpde::stencil
