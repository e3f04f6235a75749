// SPDX-License-Identifier: Apache-2.0
#include "solve/multigrid/float_cycles.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace dpde {
namespace {

/// Corrections that reduce the residual by less than a factor of 10, the usual one for a cycle in doubles, before
/// cycles in floats are given up. The first may even increase it (float_cycles.h), and the second may leave some of the
/// modes that it could not represent.
constexpr int most_misses = 3;
constexpr double usual_part = 0.1;
/// Cycles aim at this part of the tolerance, which leaves room for errors not visible in floats.
constexpr double part_of_cycles = 0.8;

/// The largest power of two below 1/size.
double factor_of(double size) { return std::isnormal(size) ? std::ldexp(1.0, -std::ilogb(size) - 1) : 1; }

}  // namespace

std::optional<FloatCycles> FloatCycles::of(const GridOperator& a, bool is_part, const MultigridOptions& options,
                                           std::string& why) {
  auto cycles = a.visit([&](const auto& rows) {
    return is_part ? MultigridOf<float>::of_symmetric_part(rows, a.null_space(), options, why)
                   : MultigridOf<float>::of(rows, a.null_space(), options, why);
  });
  if (!cycles) return std::nullopt;
  if (cycles->levels() == 1) return why = "it has one level", std::nullopt;
  return FloatCycles(std::move(*cycles), options.team);
}

FloatCycles::FloatCycles(MultigridOf<float> cycles, const Team& team)
    : cycles_(std::move(cycles)), team_(team), right_(cycles_.size()), made_(cycles_.size()) {}

void FloatCycles::begin(std::span<const double> b) { factor_ = factor_of(norm(b, team_)); }

void FloatCycles::precondition(std::span<const double> r, std::span<double> z) {
  cycles_.pack_right(r, factor_, right_);
  cycles_.cycle(right_, made_);
  cycles_.unpack(made_, 1 / factor_, false, z);
}

IterationReport FloatCycles::solve(const GridOperator& a, std::span<const double> b, std::span<double> x,
                                   double tolerance, double rounding, int most) {
  const double size = norm(b, team_), unit = size == 0 ? 1 : size;
  IterationReport report;
  const auto residual = [&](std::int64_t first, std::span<double> left) { a.residual_of_row(first, b, x, left); };
  double factor = factor_of(unit), least = INFINITY;
  for (int misses = 0;;) {
    const double packed = cycles_.pack_rows(ReadRowsOf<double>(std::ref(residual)), factor, right_);
    const double left = packed / factor;
    report.residual = left / unit;
    report.converged = report.residual <= tolerance || (report.residual <= 1e-7 && left <= rounding * norm(x, team_));
    if (report.converged || report.iterations >= most || !std::isfinite(left)) return report;
    const bool is_miss = left > usual_part * least;
    if (!is_miss) least = left;
    misses = is_miss ? misses + 1 : 0;
    if (misses == most_misses) return report;
    const IterationReport way = cycles_.iterate_from_zero(
        right_, packed, made_, part_of_cycles * tolerance / report.residual, most - report.iterations);
    report.iterations += way.iterations;
    if (!std::isfinite(way.residual)) return report;
    cycles_.unpack(made_, 1 / factor, true, x);
    factor = factor_of(left * std::max(way.residual, 0x1p-30));
  }
}

}  // namespace dpde
