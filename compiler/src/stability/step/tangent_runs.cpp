// SPDX-License-Identifier: Apache-2.0
#include "stability/step/tangent_runs.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <utility>

#include "stability/step/tangent_memory.h"

namespace dpde::stability {

using stencil::Params;
using stencil::State;

TangentRuns::TangentRuns(std::shared_ptr<const CompiledTangent> tangent, State inputs)
    : tangent_(std::move(tangent)), inputs_(std::move(inputs)) {}
TangentRuns::~TangentRuns() = default;
TangentRuns::TangentRuns(TangentRuns&&) noexcept = default;

/// Memory is not reused after a failed solve.
TangentMemory& TangentRuns::memory(const Params& params) const {
  if (memory_ == nullptr || !memory_->unsolved().empty()) memory_ = std::make_unique<TangentMemory>(*tangent_, inputs_);
  memory_->begin(params);
  return *memory_;
}

/// Perturbations as a matrix: rows are cells, columns are the states of the tangent.
struct TangentRuns::Columns {
  Columns(TangentMemory& of_step, const LinearStep& linear, bool of_flow) : memory(of_step), is_flow(of_flow) {
    for (std::size_t s = 0; s < linear.states().size(); ++s) {
      const int before = memory.executor().field_index(linear.perturbation_of(s)),
                behind = memory.executor().field_index(linear.result_of(s));
      if (before >= 0 && behind >= 0) states.emplace_back(before, behind);
    }
  }
  Eigen::Index count() const { return std::ssize(states); }
  /// False if a solve fails.
  bool advance(Eigen::MatrixXd& all, int steps) const {
    for (int i = 0; is_flow && i < steps; ++i) {
      if (!advance_flow(all)) return false;
    }
    return is_flow || advance_steps(all, steps);
  }

  TangentMemory& memory;
  bool is_flow;
  std::vector<std::pair<int, int>> states;  // fields of a perturbation before and after a step

 private:
  bool advance_steps(Eigen::MatrixXd& all, int steps) const {
    const auto column = [&](std::size_t s) {
      return std::span<double>(all.col(static_cast<Eigen::Index>(s)).data(), static_cast<std::size_t>(all.rows()));
    };
    for (std::size_t s = 0; s < states.size(); ++s)
      copy_in(memory.layout(), memory.executor().bound(states[s].first), column(s));
    const bool has_solutions = memory.advance(steps, states);
    for (std::size_t s = 0; s < states.size(); ++s)
      copy_out(memory.layout(), memory.executor().bound(states[s].first), column(s));
    return has_solutions;
  }
  bool advance_flow(Eigen::MatrixXd& all) const {
    constexpr int degree = 8;
    Eigen::MatrixXd term = all;
    for (int k = 1; k <= degree; ++k) {
      Eigen::MatrixXd next = term;
      if (!advance_steps(next, 1)) return false;
      term = (next - term) / k;
      all += term;
    }
    return true;
  }
};

Eigen::MatrixXd TangentRuns::applied(const Params& params, Eigen::MatrixXd perturbation) const {
  if (!Columns(memory(params), tangent_->linear(), is_flow_).advance(perturbation, 1))
    perturbation.fill(std::numeric_limits<double>::quiet_NaN());
  return perturbation;
}

TangentRuns::Repeated TangentRuns::repeated(const Params& params, int steps, double enough, int kept_steps) const {
  const Columns columns(memory(params), tangent_->linear(), is_flow_);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> noise(-1, 1);
  Eigen::MatrixXd all = Eigen::MatrixXd::NullaryExpr(cell_count(columns.memory.layout()), columns.count(),
                                                     [&](Eigen::Index, Eigen::Index) { return noise(random); });
  Eigen::MatrixXd kept;
  double growth = 0;
  std::vector<double> growths;
  for (int step = 0; step < steps; step += steps_between_growths) {
    const bool has_solutions = columns.advance(all, std::min(steps - step, steps_between_growths));
    const double norm = has_solutions ? all.norm() : std::numeric_limits<double>::infinity();
    if (!std::isfinite(norm)) {
      growth = std::numeric_limits<double>::infinity();
    } else if (step > 0) {
      growth += std::log(norm);
    }
    growths.push_back(growth);
    if (!std::isfinite(growth)) break;
    all /= norm;
    if (step + steps_between_growths == kept_steps) kept = all;
    if (growth > enough) break;
  }
  return {std::move(growths), std::move(all), std::move(kept), columns.memory.unsolved()};
}

/// Classical Gram-Schmidt, twice: after one pass rounding would split multiple eigenvalues.
KrylovSpace TangentRuns::on_krylov_space(const Params& params, const Eigen::MatrixXd& perturbation, int most) const {
  constexpr double nothing = 1e-13;  // of an image: rounding
  const Columns columns(memory(params), tangent_->linear(), is_flow_);
  KrylovSpace result{Eigen::MatrixXd::Zero(most + 1, most), 0, Eigen::MatrixXd(perturbation.size(), most)};
  Eigen::MatrixXd image = perturbation / perturbation.norm();
  for (int k = 0; k < most; ++k) {
    result.basis.col(k) = image.reshaped();
    if (!columns.advance(image, 1) || !image.allFinite()) return {};
    const double size = image.norm();
    const auto basis = result.basis.leftCols(k + 1);
    auto all = image.reshaped();
    for (int turn = 0; turn < 2; ++turn) {
      const Eigen::VectorXd shares = basis.transpose() * all;
      all.noalias() -= basis * shares;
      result.matrix.col(k).head(k + 1) += shares;
    }
    result.rest = image.norm();
    if (!(result.rest > nothing * size)) {
      result.matrix = result.matrix.topLeftCorner(k + 1, k + 1).eval();
      result.basis = result.basis.leftCols(k + 1).eval();
      return result;
    }
    result.matrix(k + 1, k) = result.rest;
    image /= result.rest;
  }
  result.matrix = result.matrix.topRows(most).eval();
  return result;
}

}  // namespace dpde::stability
