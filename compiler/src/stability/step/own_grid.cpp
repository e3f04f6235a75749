// SPDX-License-Identifier: Apache-2.0
#include "stability/step/own_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "dpde/runtime/cell_colours.h"
#include "stability/eigenvalues/eigenvalues.h"
#include "stability/frozen/scene_states.h"
#include "stability/report/known_networks.h"
#include "stability/step/compiled_tangent.h"
#include "stencil/build.h"
#include "support/contains.h"

namespace dpde::stability {

namespace {

constexpr double most_unknowns = 256, most_with_solves = 128;  // solves reach all cells: a run per cell
constexpr int first_doublings = 9, all_doublings = 18;         // of steps: 512, and a quarter of a million
constexpr int doublings_of_parts = 3;                          // of a step: eighths
constexpr double tenfold = 10, hundredfold = 100;
constexpr double rounding_of_steps = 1e-14;  // of the entries of a step's matrix
constexpr double left_out = 1e-9;            // truncation error of differences, relative to the largest rate
constexpr double sum_tolerance = 1e-9;       // of the check that colours did not mix columns
constexpr double largest_square = 1e120;     // its square does not overflow
constexpr int more_at_walls = 2;             // cells that walls may add to the stencil radius

/// The norms of g^(2^k) for k up to `most`, or fewer if the powers have converged; the last is infinite on overflow.
std::vector<double> norms_of_powers(Eigen::MatrixXd g, int most) {
  std::vector<double> norms{g.norm()};
  for (int k = 0; k < most; ++k) {
    Eigen::MatrixXd squared = g * g;
    norms.push_back(squared.norm());
    if (!(norms.back() < largest_square)) {
      norms.back() = std::numeric_limits<double>::infinity();
      break;
    }
    const bool has_settled = norms.back() < 1e-3 || (squared - g).norm() < 1e-9 * norms.back();
    if (has_settled) break;
    g = std::move(squared);
  }
  return norms;
}

SureSpectrum spectrum_of(Eigen::MatrixXd g) { return {std::move(g), SureSpectrum::Of::factors, rounding_of_steps}; }

/// The largest norm up to the power 2^k.
double largest_of(const std::vector<double>& norms, int k) {
  const auto count = std::min(norms.size(), static_cast<std::size_t>(k) + 1);
  return *std::max_element(norms.begin(), norms.begin() + static_cast<std::ptrdiff_t>(count));
}

bool reads_time(const LinearStep& linear) {
  return contains(stencil::interface_of(linear.module(), linear.program()).params, std::string("t"));
}

/// Whether the outputs of networks change with time.
bool do_networks_vary(driver::Session& session, const LinearStep& linear) {
  const auto at = [&](double part) {
    return values_of_networks(session, linear.known_networks(), time_within(session, part));
  };
  if (linear.known_networks().empty()) return false;
  const auto first = at(0);
  return at(0.5) != first || at(1) != first;
}

}  // namespace

bool is_linear(driver::Session& session, const LinearStep& linear) {
  const auto is_state = [&](const std::string& name) {
    if (linear.known_networks().contains(name)) return linear.depends_on_states(name);
    return !stencil::is_coordinate(name) && session.engine().state_index(name) >= 0;
  };
  const auto is_control = [&](const std::string& name) {
    const auto found = std::ranges::find(session.problem().coefficients, name, &model::Coefficient::name);
    return found != session.problem().coefficients.end() && found->is_control();
  };
  const bool has_other_inputs = !session.problem().controls.empty() || do_networks_vary(session, linear) ||
                                std::ranges::any_of(linear.inputs(), is_control);
  return !has_other_inputs && !linear.has_networks() && std::ranges::none_of(linear.inputs(), is_state);
}

bool is_linear_and_steady(driver::Session& session, const LinearStep& linear) {
  return !reads_time(linear) && is_linear(session, linear);
}

OwnGrid::OwnGrid(driver::Session& session, const LinearStep& linear, const FrozenPoint& point)
    : linear_(linear), point_(point), params_(point.params), memory_(initial_inputs(session, linear)) {
  for (std::size_t s = 0; s < linear.states().size(); ++s) {
    if (!linear.perturbation_of(s).empty()) active_.push_back(s);
  }
  for (const model::Axis& axis : session.axes()) topologies_.push_back(axis.topology);
}

std::optional<OwnGrid> OwnGrid::make(driver::Session& session, const LinearStep& linear, const FrozenPoint& point,
                                     double step, const Equations& equations) {
  const double unknowns =
      static_cast<double>(session.workspace().cell_count()) * static_cast<double>(linear.states().size());
  if (unknowns > (linear.solves() ? most_with_solves : most_unknowns) || !is_linear(session, linear))
    return std::nullopt;
  OwnGrid result(session, linear, point);
  const Eigen::Index size = result.cells() * static_cast<Eigen::Index>(result.active_.size());
  if (!result.applied(Eigen::VectorXd::Ones(size), step).allFinite()) return std::nullopt;
  if (equations.without_events() == nullptr) {
    result.measure_rates(step);
    return result;
  }
  OwnGrid plain(session, *equations.without_events(), point);
  plain.measure_rates(step);
  result.rate_ = plain.rate_;
  result.fastest_ = plain.fastest_;  // with events, eigenvalues of the equations cannot be identified
  result.by_events_ = std::max(0.0, std::log(eigenvalues(result.tangent(0)).cwiseAbs().maxCoeff()));
  return result;
}

Eigen::Index OwnGrid::cells() const {
  const stencil::CellIndex& cells = memory_.grid().cells;
  return static_cast<Eigen::Index>(cells[0]) * cells[1] * cells[2];
}

double OwnGrid::smooth_length(double step) const {
  if (linear_.is_semi_lagrangian()) return 0;
  for (double length = 1e-4 * step; length > 1e-11 * step; length *= 1e-3) {
    const Eigen::MatrixXd up = tangent(length), down = tangent(-length);
    if ((0.5 * (up + down) - Eigen::MatrixXd::Identity(up.rows(), up.cols())).norm() < 1e-2) return length;
  }
  return 0;
}

/// Whether a step of length 0 grows. Prescribed values are set in steps of any length. Their growth is not that of the
/// equations: the rate would rise as 1/dt.
bool OwnGrid::grows_in_no_time() const {
  const Eigen::MatrixXd g = tangent(0);
  return g.allFinite() && spectrum_of(g).are_beyond(1, 1);
}

/// If a step of length 0 is the identity, the rates are the eigenvalues of dG/d(dt) there. Multistep schemes also have
/// parasitic factors; those of the equations lie near 1 in a short step. The lengths balance rounding and truncation.
void OwnGrid::measure_rates(double step) {
  const double smooth = smooth_length(step);
  if (smooth == 0 && grows_in_no_time()) return;
  Eigen::MatrixXd matrix;
  const auto rates = [&](double length) {
    matrix = smooth > 0 ? Eigen::MatrixXd((tangent(length) - tangent(-length)) / (2 * length)) : tangent(length);
    std::vector<std::complex<double>> result;
    for (const std::complex<double> value : eigenvalues(matrix)) {
      if (smooth > 0)
        result.push_back(value);
      else if (std::abs(value - 1.0) < 0.5)
        result.push_back(std::log(value) / length);
    }
    return result;
  };
  for (const std::complex<double> rate : rates(smooth > 0 ? smooth : step / 64))
    fastest_ = std::max(fastest_, std::abs(rate));
  if (!(fastest_ > 0)) return;
  const double length = (smooth > 0 ? 1e-5 : 1e-3) / fastest_;
  std::complex<double> largest = 0;
  const std::vector<std::complex<double>> all = rates(length);
  for (const std::complex<double> rate : all) {
    if (rate.real() > largest.real()) largest = rate;
  }
  if (largest.real() == 0) return;
  const double truncation = smooth > 0 ? 0 : 10 * left_out * fastest_;  // left_out has it elsewhere
  const double uncertain =
      smooth > 0 ? left_out * sensitivity(matrix, largest)
                 : truncation + rounding_of_steps / length * sensitivity(matrix, std::exp(largest * length));
  if (largest.real() > uncertain) {
    rate_ = largest.real();
    const double decay =
        smooth > 0 ? SureSpectrum(std::move(matrix), SureSpectrum::Of::rates, left_out).boundary_within(0)
                   : std::log(spectrum_of(std::move(matrix)).boundary_within(std::exp(-truncation * length))) / length;
    growing_ = std::ranges::count_if(all, [&](auto rate) { return rate.real() > decay; });
  } else if (largest.real() > left_out * fastest_) {  // growth of the equations remains in shorter steps
    const double rate = rate_of_powers(0.1 / fastest_), by_shorter = rate > 0 ? rate_of_powers(0.05 / fastest_) : 0;
    if (by_shorter > 0.7 * rate) rate_ = by_shorter;
  }
}

/// The growth rate by powers over long times, for eigenvalues that may be rounding (as of advection to a wall). Growth
/// exp(s t) has twice the logarithm in twice the time; a drift has not.
double OwnGrid::rate_of_powers(double step) const {
  constexpr double nothing = 1e-30, told = 1e-6;
  double time = 0.5 * step, growth = 0, before = 0;
  Eigen::MatrixXd g = tangent(step);
  for (int k = 0; k < all_doublings; ++k) {
    Eigen::MatrixXd squared = g * g;
    time *= 2;
    before = std::exchange(growth, std::log(squared.norm() / g.norm()));
    if (!(squared.norm() < largest_square)) return growth / time;
    if (squared.norm() < nothing) return 0;
    g = std::move(squared);
  }
  return growth > told && growth > 1.5 * before ? growth / time : 0;
}

/// The largest norm of the first powers over the same time with steps of an eighth, or more than `enough`.
double OwnGrid::largest_of_parts(double step, double enough) const {
  constexpr int most = first_doublings + doublings_of_parts;
  const double part = std::exp2(-doublings_of_parts) * step;
  const Eigen::MatrixXd g = std::exp(-allowed(part)) * tangent(part);
  return g.norm() > enough ? g.norm() : largest_of(norms_of_powers(g, most), most);
}

/// Powers come first: most unstable steps show there, and a power costs less than to be sure of eigenvalues.
bool OwnGrid::is_stable(double step) const {
  const Eigen::MatrixXd g = tangent(step);
  if (!g.allFinite()) return false;
  const std::vector<double> norms = norms_of_powers(std::exp(-allowed(step)) * g, all_doublings);
  const double first = largest_of(norms, first_doublings);
  if (!std::isfinite(first) || !(norms.back() <= tenfold * std::exp2(first_doublings) * first)) return false;
  if (first > hundredfold * largest_of_parts(step, first / hundredfold)) return false;
  return growing_ == 0 || !spectrum_of(g).are_beyond(1, growing_ + 1);
}

double OwnGrid::sure_growth(double step) const {
  const Eigen::MatrixXd g = tangent(step);
  if (!g.allFinite()) return std::numeric_limits<double>::infinity();
  const SureSpectrum spectrum = spectrum_of(g);
  return spectrum.are_beyond(std::exp(allowed(step)), 1) ? std::log(spectrum.largest()) : 0;
}

double OwnGrid::growth(double step) const {
  const Eigen::MatrixXd g = tangent(step);
  if (!g.allFinite()) return std::numeric_limits<double>::infinity();
  double growth = eigenvalues(g).cwiseAbs().maxCoeff(), steps = 1;
  const double allowed = hundredfold * largest_of_parts(step, std::numeric_limits<double>::infinity());
  for (const double norm : norms_of_powers(g, first_doublings)) {
    if (std::isfinite(norm)) growth = std::max(growth, std::pow(norm / allowed, 1 / steps));
    steps *= 2;
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
  stencil::interpret(linear_.coupled_module(), linear_.coupled_module().programs.front(), memory, params);
  Eigen::VectorXd result(perturbations.size());
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const std::vector<double> values = memory.get(linear_.perturbation_of(active_[i]));
    std::ranges::copy(values, result.begin() + static_cast<std::ptrdiff_t>(i) * n);
  }
  return result;
}

stencil::CellIndex OwnGrid::reach(double step) const {
  const std::optional<LinearisedStep> response = linear_.response(point_, step);
  if (!response || !response->waves.empty() || linear_.couples_means()) return memory_.grid().cells;
  stencil::CellIndex reach{};
  for (const LinearForm& row : response->rows) {
    for (const LinearForm::Term& term : row.terms()) {
      const stencil::Offset offset = LinearForm::offset_of(term.key);
      for (std::size_t axis = 0; axis < reach.size(); ++axis)
        reach[axis] = std::max(reach[axis], std::abs(offset[axis]));
    }
  }
  return reach;
}

std::optional<Eigen::MatrixXd> OwnGrid::tangent_by_colours(double step) const {
  const stencil::CellIndex farthest = reach(step);
  std::array<std::int64_t, 3> counts{}, reached{};
  std::array<bool, 3> periodic{};
  for (std::size_t axis = 0; axis < counts.size(); ++axis) {
    counts[axis] = memory_.grid().cells[axis];
    reached[axis] = farthest[axis] + more_at_walls;
    periodic[axis] = axis < topologies_.size() && topologies_[axis] == Topology::periodic;
  }
  const Eigen::Index n = cells(), size = n * static_cast<Eigen::Index>(active_.size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size, size);
  for (const CellColour& colour : cell_colours(counts, periodic, reached)) {
    for (Eigen::Index first = 0; first < size; first += n) {
      Eigen::VectorXd perturbations = Eigen::VectorXd::Zero(size);
      for (const std::int64_t cell : colour.cells) perturbations[first + cell] = 1;
      const Eigen::VectorXd image = applied(perturbations, step);
      for (Eigen::Index row = 0; row < size; ++row) {
        const std::int64_t source = colour.sources[static_cast<std::size_t>(row % n)];
        if (source >= 0) result(row, first + source) = image[row];
      }
    }
  }
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> noise(-1, 1);
  const Eigen::VectorXd probe = Eigen::VectorXd::NullaryExpr(size, [&] { return noise(random); });
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
