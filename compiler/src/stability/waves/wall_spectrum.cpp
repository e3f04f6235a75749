// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/wall_spectrum.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "stability/eigenvalues/eigenvalues.h"
#include "stability/frozen/fixed_part.h"
#include "stability/waves/ring_spectrum.h"
#include "stencil/build.h"
#include "stencil/interpret/interpret.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::stability {

namespace {

constexpr int fewest_along = 4;
constexpr double most_columns = 400;
constexpr std::array<int, 3> cells_along{24, 8, 5}, cells_with_networks{24, 4, 4};  // these take long

int cells_of(const std::vector<model::Axis>& axes, std::size_t axis, bool has_networks, std::size_t states) {
  int along = (has_networks ? cells_with_networks : cells_along)[axes.size() - 1];
  // Eigenvalues of matrices with more columns take seconds.
  while (along > fewest_along && std::pow(along, axes.size()) * static_cast<double>(states) > most_columns) --along;
  return std::min(axes[axis].cells, along);
}

using Names = std::map<std::string, std::string>;  // fields of a program, and their names in `whole`

/// The fields in `body` that solves or means make and whose values are known; of a solve all fields, or none.
void find_known(const std::vector<stencil::Statement>& body, const LinearStep& linear,
                const std::map<std::string, FrozenValue>& whole, Names& found) {
  const auto add = [&](const stencil::Statement& statement) {
    match(
        statement,
        [&](const stencil::Reduce& reduce) {
          if (whole.contains(reduce.result)) found.emplace(reduce.result, reduce.result);
        },
        [&](const stencil::Solve& solve) {
          if (linear.is_perturbation(solve.unknowns.front())) return;
          Names of_all;
          for (const std::string& field : solve.unknowns)
            for (const std::string& name : {field, solve.written.field})
              if (whole.contains(name)) of_all.emplace(field, name);
          if (of_all.size() == solve.unknowns.size()) found.merge(of_all);
        },
        ignored<stencil::Fill, stencil::Fold, stencil::NetworkCall, stencil::Transform, stencil::Run, stencil::Repeat>);
  };
  for_each_statement(body, add, Blocks::passes);
}

/// Removes the solves and means of these fields, and the statements that fill their halos; in repeats also those of
/// fields from outside.
void take_out(std::vector<stencil::Statement>& body, const Names& known) {
  const auto is_known = [&](const stencil::Statement& statement) {
    return match(
        statement, [&](const stencil::Fill& fill) { return known.contains(fill.field); },
        [&](const stencil::Reduce& reduce) { return known.contains(reduce.result); },
        [&](const stencil::Solve& solve) { return known.contains(solve.unknowns.front()); },
        always<false, stencil::Fold, stencil::NetworkCall, stencil::Transform, stencil::Run, stencil::Repeat>);
  };
  erase_statements(body, is_known, Blocks::passes);
}

class SmallGrid {
 public:
  SmallGrid(const LinearStep& linear, const FrozenPoint& point, const std::vector<model::Axis>& axes, double step,
            const std::map<std::string, stencil::Weights>& weights)
      : linear_(linear), program_(linear.program()), point_(point), params_(point.params), weights_(weights) {
    grid_.rank = static_cast<int>(axes.size());
    for (std::size_t a = 0; a < axes.size(); ++a)
      grid_.cells[a] = cells_of(axes, a, !weights.empty(), linear.states().size());
    params_["dt"] = step;
    find_known(program_.body, linear, point.whole, known_);
    take_out(program_.body, known_);
  }

  std::size_t unknowns() const {
    return static_cast<std::size_t>(grid_.cells[0]) * static_cast<std::size_t>(grid_.cells[1]) *
           static_cast<std::size_t>(grid_.cells[2]) * linear_.states().size();
  }
  /// The tangent, without statements whose results are known at the point.
  const stencil::Program& program() const { return program_; }
  const stencil::CellIndex& cells() const { return grid_.cells; }
  /// By machine code if `compiled` is not null.
  Eigen::MatrixXd tangent(const CompiledTangent* compiled) const {
    if (compiled != nullptr) return compiled->matrix(inputs(), params_);
    const std::size_t cells = static_cast<std::size_t>(grid_.cells[0]) * static_cast<std::size_t>(grid_.cells[1]) *
                              static_cast<std::size_t>(grid_.cells[2]);
    const std::size_t states = linear_.states().size();
    const auto size = static_cast<Eigen::Index>(cells * states);
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
    const ApartModule apart = module_of_columns();
    stencil::State memory = inputs();
    if (!apart.fixed.empty())
      stencil::interpret(apart.module, *apart.module.find_program(apart.fixed), memory, params_);
    for (std::size_t s = 0; s < states; ++s) {
      for (std::size_t c = 0; c < cells && !linear_.perturbation_of(s).empty(); ++c) {
        result.col(static_cast<Eigen::Index>(s * cells + c)) = column(apart.module, memory, s, c, cells);
      }
    }
    return result;
  }

 private:
  stencil::State inputs() const {
    stencil::State memory = memory_for(linear_, grid_);
    memory.inverses = inverses_;
    memory.weights = weights_;
    const std::size_t cells = static_cast<std::size_t>(grid_.cells[0]) * static_cast<std::size_t>(grid_.cells[1]) *
                              static_cast<std::size_t>(grid_.cells[2]);
    for (const std::string& input : linear_.inputs()) {
      if (stencil::is_coordinate(input)) {
        const auto axis = static_cast<std::size_t>(input[0] - 'x');
        // A network is not linear in the coordinates: its values at points outside of the scene would count.
        const double h = weights_.empty() ? point_.params.at("h" + input) : 0;
        memory.set_coordinate(static_cast<int>(axis), Topology::bounded,
                              point_.place[axis] - 0.5 * grid_.cells[axis] * h, h);
      } else {
        const auto known = point_.fields.find(input);
        const double value =
            known == point_.fields.end() ? std::numeric_limits<double>::quiet_NaN() : known->second.value;
        memory.set(input, std::vector<double>(cells, value));
      }
    }
    for (const auto& [field, name] : known_) set_line(memory, field, point_.whole.at(name));
    return memory;
  }

  /// The statements that depend on perturbations; results of the inputs alone are the same for all columns.
  ApartModule module_of_columns() const {
    stencil::Module module = linear_.module();
    module.programs.front() = program_;
    std::set<std::string> perturbations;
    for (std::size_t s = 0; s < linear_.states().size(); ++s) perturbations.insert(linear_.perturbation_of(s));
    return with_fixed_part_apart(std::move(module), perturbations);
  }

  Eigen::VectorXd column(const stencil::Module& module, stencil::State memory, std::size_t state, std::size_t cell,
                         std::size_t cells) const {
    for (std::size_t s = 0; s < linear_.states().size(); ++s) {
      if (linear_.perturbation_of(s).empty()) continue;
      std::vector<double> values(cells, 0.0);
      if (s == state) values[cell] = 1;
      memory.set(linear_.perturbation_of(s), values);
    }
    stencil::interpret(module, module.programs.front(), memory, params_);
    Eigen::VectorXd result = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(cells * linear_.states().size()));
    for (std::size_t s = 0; s < linear_.states().size(); ++s) {
      if (linear_.perturbation_of(s).empty()) continue;
      const std::vector<double> values = memory.get(linear_.perturbation_of(s));
      std::ranges::copy(values, result.begin() + static_cast<std::ptrdiff_t>(s * cells));
    }
    return result;
  }

  /// Sets the field linear about the point, in the halo, too: a wind then has its value of the point at the walls.
  void set_line(stencil::State& memory, const std::string& field, const FrozenValue& value) const {
    stencil::CellIndex low{}, high = grid_.cells;
    for (std::size_t axis = 0; axis < low.size(); ++axis) {
      low[axis] -= memory.halo(static_cast<int>(axis));
      high[axis] += memory.halo(static_cast<int>(axis));
    }
    stencil::for_each_cell(low, high, [&](const stencil::CellIndex& cell) {
      double& at = memory.at(field, cell) = value.value;
      for (std::size_t axis = 0; axis < low.size(); ++axis) at += value.slope[axis] * cell[axis];
    });
  }

  const LinearStep& linear_;
  stencil::Program program_;
  Names known_;
  const FrozenPoint& point_;
  stencil::Params params_;
  const std::map<std::string, stencil::Weights>& weights_;
  stencil::Grid grid_;
  std::shared_ptr<stencil::Inverses> inverses_ = stencil::new_inverses();
};

}  // namespace

Eigen::VectorXcd WallSpectrum::eigenvalues(const FrozenPoint& point, double step) const {
  constexpr std::size_t many = 48;  // columns, on two and three axes
  const SmallGrid grid(linear_, point, axes_, step, weights_);
  if (!was_tried_ && weights_.empty() && axes_.size() > 1 && grid.unknowns() >= many)
    compiled_ = CompiledTangent::make(linear_, grid.program());
  was_tried_ = true;
  const Eigen::MatrixXd tangent = grid.tangent(compiled_.get());
  if (!tangent.allFinite()) return {};
  const auto ring = std::ranges::find(axes_, Topology::periodic, &model::Axis::topology);
  if (ring != axes_.end() && axes_.size() > 1) {
    if (auto values = eigenvalues_on_ring(tangent, grid.cells(), static_cast<std::size_t>(ring - axes_.begin())))
      return *std::move(values);
  }
  return stability::eigenvalues(tangent);
}

std::vector<int> cells_between_walls(const std::vector<model::Axis>& axes, std::size_t states) {
  std::vector<int> cells;
  for (std::size_t a = 0; a < axes.size(); ++a) cells.push_back(cells_of(axes, a, false, states));
  return cells;
}

double cells_with_networks_along(const std::vector<model::Axis>& axes) {
  double cells = 1;
  for (std::size_t a = 0; a < axes.size(); ++a) cells *= cells_of(axes, a, true, 1);
  return cells;
}

}  // namespace dpde::stability
