// SPDX-License-Identifier: Apache-2.0
#include "stability/own_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "stability/eigenvalues.h"
#include "stencil/build.h"
#include "support/contains.h"

namespace dpde::stability {

namespace {

constexpr double most_unknowns = 256;
constexpr int doublings = 20, parts_of_short = 10;  // a short step is 2^-10 of one
constexpr double tolerated_power = 10;
constexpr double sum_tolerance = 1e-9;  // of a column that colours may have mixed up

/// The largest norm of g^(2^j) for j up to k, for each k up to `most`, or fewer where powers have settled; the last is
/// infinite where they leave all bounds.
std::vector<double> largest_powers(Eigen::MatrixXd g, int most) {
  std::vector<double> largest{g.norm()};
  for (int k = 0; k < most; ++k) {
    Eigen::MatrixXd squared = g * g;
    const double norm = squared.norm();
    largest.push_back(norm < 1e30 ? std::max(largest.back(), norm) : std::numeric_limits<double>::infinity());
    const bool has_settled = norm < 1e-3 || (squared - g).norm() < 1e-9 * norm;
    if (has_settled || !std::isfinite(largest.back())) break;
    g = std::move(squared);
  }
  return largest;
}

/// Cells that can be disturbed at once: so far from one another that no cell is reached by two.
class CellGroups {
 public:
  CellGroups(const stencil::Grid& grid, const std::vector<Topology>& topologies, const stencil::Cell& reach)
      : counts_(grid.cells), topologies_(topologies) {
    constexpr int of_walls = 2;  // what a wall may add to the reach
    for (std::size_t axis = 0; axis < strides_.size(); ++axis)
      strides_[axis] = std::min(2 * (reach[axis] + of_walls) + 1, counts_[axis]);
    stencil::for_each_cell({}, counts_, [&](const stencil::Cell& cell) { places_.push_back(cell); });
  }

  std::vector<std::vector<std::size_t>> all() const {
    std::map<stencil::Cell, std::vector<std::size_t>> groups;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      stencil::Cell colour{};
      for (std::size_t axis = 0; axis < colour.size(); ++axis) colour[axis] = colour_along(axis, places_[i][axis]);
      groups[colour].push_back(i);
    }
    std::vector<std::vector<std::size_t>> result;
    for (auto& [colour, group] : groups) result.push_back(std::move(group));
    return result;
  }

  /// For each cell the one of the group that may reach it.
  std::vector<std::size_t> nearest_of(const std::vector<std::size_t>& group) const {
    std::vector<std::size_t> result;
    for (const stencil::Cell& place : places_) {
      result.push_back(*std::ranges::min_element(group, {}, [&](std::size_t i) {
        double largest = 0;
        for (std::size_t axis = 0; axis < topologies_.size(); ++axis)
          largest = std::max(largest, distance(axis, place[axis], places_[i][axis]) / strides_[axis]);
        return largest;
      }));
    }
    return result;
  }

 private:
  /// Cells in steps of the stride have one colour, those that are left at the end of an axis their own.
  int colour_along(std::size_t axis, int cell) const {
    const int stride = strides_[axis], whole = counts_[axis] / stride * stride;
    return cell < whole ? cell % stride : stride + cell - whole;
  }
  double distance(std::size_t axis, int a, int b) const {
    const int straight = std::abs(a - b);
    return topologies_[axis] == Topology::periodic ? std::min(straight, counts_[axis] - straight) : straight;
  }

  stencil::Cell counts_, strides_{};
  const std::vector<Topology>& topologies_;
  std::vector<stencil::Cell> places_;
};

stencil::State memory_of(const driver::Session& session, const LinearStep& linear) {
  stencil::Grid grid;
  grid.rank = static_cast<int>(session.axes().size());
  for (std::size_t a = 0; a < session.axes().size(); ++a) grid.cells[a] = session.axes()[a].cells;
  int halo = 0;
  for (const auto& [field, widths] : stencil::required_halo(linear.module(), linear.program()))
    halo = std::max(halo, *std::ranges::max_element(widths));
  return {grid, halo};
}

}  // namespace

OwnGrid::OwnGrid(driver::Session& session, const LinearStep& linear, const FrozenPoint& point)
    : linear_(linear), point_(point), params_(point.params), memory_(memory_of(session, linear)) {
  for (std::size_t s = 0; s < linear.states().size(); ++s) {
    if (!linear.perturbation_of(s).empty()) active_.push_back(s);
  }
  for (const model::Axis& axis : session.axes()) topologies_.push_back(axis.topology);
  memory_.inverses = stencil::new_inverses();
  for (const std::string& input : linear.inputs()) {
    if (stencil::is_coordinate(input)) {
      const auto axis = static_cast<std::size_t>(input[0] - 'x');
      memory_.set_coordinate(static_cast<int>(axis), topologies_[axis], session.axes()[axis].low,
                             session.axes()[axis].spacing());
    } else {
      memory_.set(input, session.workspace().dense(input));
    }
  }
  params_["t"] = std::numeric_limits<double>::quiet_NaN();  // what depends on it shows
}

std::optional<OwnGrid> OwnGrid::make(driver::Session& session, const LinearStep& linear, const FrozenPoint& point,
                                     double step) {
  const auto is_state = [&](const std::string& name) {
    return !stencil::is_coordinate(name) && session.engine().state_index(name) >= 0;
  };
  const double unknowns =
      static_cast<double>(session.workspace().cell_count()) * static_cast<double>(linear.states().size());
  if (unknowns > most_unknowns || linear.has_networks() || std::ranges::any_of(linear.inputs(), is_state) ||
      !session.problem().controls.empty())
    return std::nullopt;
  OwnGrid result(session, linear, point);
  const Eigen::Index size = result.cells() * static_cast<Eigen::Index>(result.active_.size());
  if (!result.applied(Eigen::VectorXd::Ones(size), step).allFinite()) return std::nullopt;
  result.measure_short_steps(step);
  return result;
}

Eigen::Index OwnGrid::cells() const {
  const stencil::Cell& cells = memory_.grid().cells;
  return static_cast<Eigen::Index>(cells[0]) * cells[1] * cells[2];
}

void OwnGrid::measure_short_steps(double step) {
  constexpr int most = 60;  // doublings: of steps however long
  short_step_ = std::exp2(-parts_of_short) * step;
  const Eigen::MatrixXd g = tangent(short_step_);
  short_powers_ = largest_powers(g, most);
  if (std::isfinite(short_powers_.back())) return;
  for (const std::complex<double> value : eigenvalues(g)) {
    if (std::abs(value - 1.0) < 0.5) rate_ = std::max(rate_, std::log(std::abs(value)) / short_step_);
  }
  short_powers_ = largest_powers(std::exp(-2 * rate_ * short_step_) * g, most);
  if (!std::isfinite(short_powers_.back())) short_powers_ = {g.norm()};  // they grow by themselves, and are no measure
}

double OwnGrid::short_power(double step) const {
  const double all = doublings + std::log2(step / short_step_);
  return short_powers_[std::min(static_cast<std::size_t>(std::max(all, 0.0)), short_powers_.size() - 1)];
}

bool OwnGrid::is_stable(double step) const {
  const Eigen::MatrixXd g = tangent(step);
  return g.allFinite() &&
         largest_powers(std::exp(-2 * rate_ * step) * g, doublings).back() <= tolerated_power * short_power(step);
}

double OwnGrid::growth(double step) const {
  Eigen::MatrixXd g = tangent(step);
  if (!g.allFinite()) return std::numeric_limits<double>::infinity();
  double growth = eigenvalues(g).cwiseAbs().maxCoeff(), steps = 1;
  for (int k = 0; k < doublings && g.norm() < 1e30; ++k, steps *= 2) {
    growth = std::max(growth, std::pow(g.norm() / (tolerated_power * short_power(step)), 1 / steps));
    g = g * g;
  }
  return growth;
}

Eigen::VectorXd OwnGrid::applied(const Eigen::VectorXd& perturbations, double step) const {
  stencil::State memory = memory_;
  stencil::Params params = params_;
  params["dt"] = step;
  const Eigen::Index n = cells();
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const auto own = perturbations.segment(static_cast<Eigen::Index>(i) * n, n);
    memory.set(linear_.perturbation_of(active_[i]), {own.begin(), own.end()});
  }
  stencil::interpret(linear_.module(), linear_.program(), memory, params);
  Eigen::VectorXd result(perturbations.size());
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const std::vector<double> values = memory.get(linear_.perturbation_of(active_[i]));
    std::ranges::copy(values, result.begin() + static_cast<std::ptrdiff_t>(i) * n);
  }
  return result;
}

stencil::Cell OwnGrid::reach(double step) const {
  const std::optional<Response> response = linear_.response(point_, step);
  if (!response || !response->waves.empty()) return memory_.grid().cells;
  stencil::Cell reach{};
  for (const Form& row : response->rows) {
    for (const Form::Term& term : row.terms()) {
      const stencil::Offset offset = Form::offset_of(term.key);
      for (std::size_t axis = 0; axis < reach.size(); ++axis)
        reach[axis] = std::max(reach[axis], std::abs(offset[axis]));
    }
  }
  return reach;
}

std::optional<Eigen::MatrixXd> OwnGrid::tangent_by_colours(double step) const {
  const CellGroups groups(memory_.grid(), topologies_, reach(step));
  const auto n = static_cast<std::size_t>(cells()), size = n * active_.size();
  const auto number = [](std::size_t i) { return static_cast<Eigen::Index>(i); };
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(number(size), number(size));
  for (const std::vector<std::size_t>& group : groups.all()) {
    const std::vector<std::size_t> nearest = groups.nearest_of(group);
    for (std::size_t s = 0; s < active_.size(); ++s) {
      Eigen::VectorXd perturbations = Eigen::VectorXd::Zero(number(size));
      for (const std::size_t i : group) perturbations[number(s * n + i)] = 1;
      const Eigen::VectorXd image = applied(perturbations, step);
      for (std::size_t row = 0; row < size; ++row)
        result(number(row), number(s * n + nearest[row % n])) = image[number(row)];
    }
  }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> noise(-1, 1);
  const Eigen::VectorXd probe = Eigen::VectorXd::NullaryExpr(number(size), [&] { return noise(random); });
  const Eigen::VectorXd image = applied(probe, step);
  if (!((result * probe - image).norm() <= sum_tolerance * image.norm())) return std::nullopt;
  return result;
}

Eigen::MatrixXd OwnGrid::tangent(double step) const {
  if (const std::optional<Eigen::MatrixXd> result = tangent_by_colours(step)) return *result;
  const Eigen::Index size = cells() * static_cast<Eigen::Index>(active_.size());
  Eigen::MatrixXd result(size, size);
  for (Eigen::Index i = 0; i < size; ++i) result.col(i) = applied(Eigen::VectorXd::Unit(size, i), step);
  return result;
}

}  // namespace dpde::stability
