// SPDX-License-Identifier: Apache-2.0
// Chooses a method by the properties of the operator. Common to all methods: the null space is removed before and
// after, and the residual is measured.
#include <fmt/format.h>

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "dpde/runtime/error.h"
#include "solve/operator/finite.h"
#include "solve/operator/vector_parts.h"
#include "solve/solver/linear_solver_impl.h"

namespace dpde {

namespace {

Eigen::SparseMatrix<double> columns_of(const StencilMatrix& matrix) {
  std::vector<Eigen::Triplet<double>> entries;
  for_each_entry(matrix, [&](std::size_t row, std::size_t column, double value) {
    entries.emplace_back(static_cast<int>(row), static_cast<int>(column), value);
  });
  Eigen::SparseMatrix<double> columns(matrix.size(), matrix.size());
  columns.setFromTriplets(entries.begin(), entries.end());
  return columns;
}

Eigen::Map<const Eigen::VectorXd> vector_of(std::span<const double> values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}
Eigen::Map<Eigen::VectorXd> vector_of(std::span<double> values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

const char* words_on(SmootherKind smoother) {
  switch (smoother) {
    case SmootherKind::automatic: break;
    case SmootherKind::red_black: return "smoothed by red and black cells in turns";
    case SmootherKind::jacobi: return "smoothed by Jacobi's iteration";
    case SmootherKind::chebyshev: return "smoothed by a polynomial of Chebyshev";
  }
  return "";
}

[[noreturn]] void refuse(SolverMethod method, const char* why) {
  throw Error(ErrorKind::run, fmt::format("the method {} does not fit: {}", name_of(method), why));
}

}  // namespace

Rooms::Rooms(const NullSpace& null_space, std::size_t all) : cells(all) {
  for (const auto& part : null_space.parts()) {
    covered += part.size();
    if (part.size() > 1) ++count;
  }
}

std::string Rooms::words() const {
  const bool is_whole = count == 1 && covered == cells;
  if (count == 0 || is_whole) return "";
  return count == 1 ? "; one room is cut off from the rest: there the mean is 0"
                    : fmt::format("; {} rooms are cut off from one another: the mean of each is 0", count);
}

std::string_view name_of(SolverMethod method) {
  switch (method) {
    case SolverMethod::automatic: return "automatic";
    case SolverMethod::direct: return "direct";
    case SolverMethod::tridiagonal: return "tridiagonal";
    case SolverMethod::fourier: return "fourier";
    case SolverMethod::multigrid: return "multigrid";
    case SolverMethod::cg: return "cg";
    case SolverMethod::bicgstab: return "bicgstab";
    case SolverMethod::gmres: return "gmres";
  }
  return "";
}

bool LinearSolver::Impl::try_tridiagonal() {
  if (a->size() != a->cells()[0]) return false;
  tridiagonal =
      a->with_matrix([&](const StencilMatrix& matrix) { return TridiagonalSolver::of(matrix, null_space()); });
  if (!tridiagonal) return false;
  method = SolverMethod::tridiagonal;
  reason = "one axis and three entries a row, the middle one dominant: eliminated from end to end";
  return true;
}

bool LinearSolver::Impl::try_fourier() {
  const bool is_singular = !null_space().is_empty();
  if (a->constant_rows() != nullptr) {
    fourier.emplace(*a->constant_rows(), is_singular, team);
  } else {
    a->with_matrix([&](const StencilMatrix& matrix) {
      fourier = FourierSolver::of(matrix, options.rounding, is_singular, team);
      if (!fourier) lines = LineSystems::of(matrix, null_space(), team);
    });
  }
  if (!fourier && !lines) return false;
  method = SolverMethod::fourier;
  if (fourier && options.rounding > 0x1p-30) fourier->try_floats(*a);
  if (lines) {
    reason = lines->reason();
    return true;
  }
  reason = fourier->has_walls()
               ? "the same coefficients everywhere, walls that are mirrors: Fourier series of the images"
               : "the same coefficients everywhere, periodic: Fourier series";
  return true;
}

void LinearSolver::Impl::make_direct(const char* why) {
  a->with_matrix([&](const StencilMatrix& matrix) { direct.emplace(matrix, null_space(), options.rounding); });
  method = SolverMethod::direct;
  reason = why;
}

void LinearSolver::Impl::make_iterations(VectorFunction precondition) {
  const VectorFunction multiply = [this](std::span<const double> x, std::span<double> y) {
    a->multiply(x, y, team);
    if (!null_space().is_empty()) null_space().remove(y, team);  // removes rounding, as in Multigrid::multiply
  };
  // Null-space components of corrections would grow by rounding until they dominate.
  VectorFunction project;
  if (!null_space().is_empty() && is_flexible()) {
    project = [this](std::span<const double>, std::span<double> z) { null_space().remove(z, team); };
  } else if (!null_space().is_empty()) {
    precondition = [this, inner = std::move(precondition)](std::span<const double> r, std::span<double> z) {
      inner(r, z);
      null_space().remove(z, team);
    };
  }
  if (method == SolverMethod::gmres) {
    gmres.emplace(multiply, std::move(precondition), options.tolerance, options.most_iterations, vectors_of_gmres,
                  options.rounding, is_flexible(), std::move(project), team);
  } else {
    iterations.emplace(multiply, std::move(precondition), options.tolerance, options.most_iterations,
                       std::move(project), team);
  }
}

/// For vectors in plain cell order.
void LinearSolver::Impl::size_iterations(std::size_t size) {
  if (gmres) gmres->resize(size);
  const IterationMethod of_cg = is_flexible() ? IterationMethod::flexible_cg : IterationMethod::cg;
  if (iterations) iterations->resize(size, method == SolverMethod::bicgstab ? IterationMethod::bicgstab : of_cg);
}

std::string LinearSolver::Impl::words_on_cycles(SmootherKind smoother) const {
  return fmt::format("symmetric, each cell coupled with its neighbours: multigrid cycles{}, {}{}",
                     in_floats.cycles ? " in f32" : "", words_on(smoother),
                     method == SolverMethod::cg ? ", as the preconditioner of conjugate gradients" : "");
}

/// With vectors in plain cell order, multiplied by the operator itself.
bool LinearSolver::Impl::try_floats(SolverMethod wanted) {
  in_floats.cycles = FloatCycles::of(*a, false, cycles(wanted == SolverMethod::cg), no_multigrid);
  if (!in_floats.cycles) return false;
  method = wanted;
  reason = words_on_cycles(in_floats.cycles->smoother());
  if (wanted == SolverMethod::multigrid) return true;
  make_iterations([this](std::span<const double> r, std::span<double> z) { in_floats.cycles->precondition(r, z); });
  return true;
}

bool LinearSolver::Impl::try_multigrid(SolverMethod wanted) {
  if (takes_floats() && try_floats(wanted)) return true;
  multigrid = a->visit([&](const auto& rows) {
    return Multigrid::of(rows, null_space(), cycles(wanted == SolverMethod::cg), no_multigrid);
  });
  if (!multigrid) return false;
  is_packed = true;
  method = wanted;
  reason = words_on_cycles(multigrid->smoother());
  if (wanted == SolverMethod::multigrid) {
    packed.right = Numbers(multigrid->size());
    packed.x = Numbers(multigrid->size());
    return true;
  }
  iterations.emplace([this](std::span<const double> x, std::span<double> y) { multigrid->multiply(x, y); },
                     [this](std::span<const double> r, std::span<double> z) { multigrid->cycle(r, z); },
                     options.tolerance, options.most_iterations, VectorFunction(), team);
  iterations->resize(multigrid->size(), IterationMethod::cg);
  return true;
}

/// For unsymmetric operators, in plain cell order.
void LinearSolver::Impl::precondition_by_multigrid() {
  reason += fmt::format(", preconditioned by multigrid of the symmetric part{}, {}", in_floats.cycles ? " in f32" : "",
                        words_on(in_floats.cycles ? in_floats.cycles->smoother() : multigrid->smoother()));
  if (in_floats.cycles)
    return make_iterations(
        [this](std::span<const double> r, std::span<double> z) { in_floats.cycles->precondition(r, z); });
  packed.right = Numbers(multigrid->size());
  packed.x = Numbers(multigrid->size());
  make_iterations([this](std::span<const double> r, std::span<double> z) {
    multigrid->pack_right(r, packed.right);
    multigrid->cycle(packed.right, packed.x);
    multigrid->unpack(packed.x, z);
  });
}

IterationReport LinearSolver::Impl::iterate_packed(std::span<const double> b, std::span<double> x) {
  if (iterations) {
    const SolutionOrder order{
        [this](std::span<const double> from, std::span<double> to) { multigrid->pack(from, to); },
        [this](double c, std::span<const double> p, std::span<double> to) { multigrid->unpack(p, c, true, to); }};
    multigrid->pack_right(b, iterations->room());
    return iterations->cg(iterations->room(), x, &order);
  }
  multigrid->pack_right(b, packed.right);
  multigrid->pack(x, packed.x);
  const IterationReport report =
      multigrid->iterate(packed.right, packed.x, options.tolerance, rounding_of_x(), options.most_iterations);
  multigrid->unpack(packed.x, x);
  return report;
}

/// If floats do not reach the tolerance, doubles start anew and also do later solves; their memory is allocated once.
IterationReport LinearSolver::Impl::iterate_with_floats(std::span<const double> b, std::span<double> x) {
  in_floats.cycles->begin(b);
  const IterationReport way =
      method == SolverMethod::multigrid
          ? in_floats.cycles->solve(*a, b, x, options.tolerance, rounding_of_x(), options.most_iterations)
      : method == SolverMethod::cg ? iterations->cg(b, x)
                                   : iterations->bicgstab(b, x);
  const auto is_rounding = [&] { return way.residual * norm(b, team) <= rounding_of_x() * norm(x, team); };
  if (way.converged || is_rounding() || !become_doubles()) return way;
  if (!are_finite(x, team)) std::ranges::fill(x, 0.0);
  return iterate(b, x);
}

/// Returns false if they have been tried before, or do not suit the operator.
bool LinearSolver::Impl::become_doubles() {
  if (in_floats.are_too_few) return false;
  in_floats.are_too_few = true;
  std::optional<FloatCycles> floats = std::exchange(in_floats.cycles, std::nullopt);
  if (method == SolverMethod::bicgstab) {
    make_unsymmetric(method);
    size_iterations(static_cast<std::size_t>(a->size()));
  } else if (!try_multigrid(method)) {
    in_floats.cycles = std::move(floats);
    return false;
  }
  reason += rooms.words();
  return true;
}

IterationReport LinearSolver::Impl::iterate(std::span<const double> b, std::span<double> x) {
  if (in_floats.cycles) return iterate_with_floats(b, x);
  if (is_packed) return iterate_packed(b, x);
  if (gmres) return gmres->solve(b, x);
  if (method == SolverMethod::cg) return is_flexible() ? iterations->flexible_cg(b, x) : iterations->cg(b, x);
  return iterations->bicgstab(b, x);
}

/// Pivots of a singular matrix may be 0.
bool LinearSolver::Impl::has_incomplete_factors() const {
  if (incomplete.info() != Eigen::Success) return false;
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(a->size());
  return Eigen::VectorXd(incomplete.solve(ones)).allFinite();
}

void LinearSolver::Impl::divide_by_diagonal(std::span<const double> r, std::span<double> z) const {
  const std::span<const double> divisors(diagonal.data(), r.size());
  set_each(
      team, z, [](double value, double d) { return d == 0 ? value : value / d; }, r, divisors);
}

void LinearSolver::Impl::make_unpreconditioned() {
  reason += ", without a preconditioner, as the scheme says";
  make_iterations([this](std::span<const double> r, std::span<double> z) { copy_vector(r, z, team); });
}

/// Scales the residual to root mean square 1 and back, so that the network is independent of units.
void LinearSolver::Impl::search_along(std::span<const double> r, std::span<double> z) const {
  const double size = norm(r, team) / std::sqrt(static_cast<double>(r.size()));
  copy_vector(r, z, team);
  if (search == nullptr || size == 0) return;
  set_each(
      team, z, [size](double value) { return value / size; }, z);
  (*search)(z, z);
  multiply_all(z, size, team);
}

void LinearSolver::Impl::precondition_by_network() {
  reason += fmt::format(", preconditioned by network {}", options.network);
  make_iterations([this](std::span<const double> r, std::span<double> z) { search_along(r, z); });
}

/// With conjugate gradients.
void LinearSolver::Impl::make_symmetric() {
  const bool is_plain = options.preconditioning == Preconditioning::none || is_flexible();
  if (!is_plain && try_multigrid(SolverMethod::cg)) return;
  const bool is_symmetric = a->is_symmetric(options.rounding);
  if (is_plain && !is_symmetric) refuse(SolverMethod::cg, "the operator is not symmetric");
  if (!is_plain && (options.preconditioning == Preconditioning::multigrid || !is_symmetric))
    refuse(SolverMethod::cg, no_multigrid.c_str());
  method = SolverMethod::cg;
  reason = is_flexible() ? "symmetric: flexible conjugate gradients" : "symmetric: conjugate gradients";
  if (is_flexible()) return precondition_by_network();
  if (is_plain) return make_unpreconditioned();
  reason += ", divided by the diagonal";
  make_divided_by_diagonal();
}

void LinearSolver::Impl::make_divided_by_diagonal() {
  diagonal = a->diagonal();
  make_iterations([this](std::span<const double> r, std::span<double> z) { divide_by_diagonal(r, z); });
}

void LinearSolver::Impl::make_unsymmetric(SolverMethod wanted) {
  if (null_space().is_lopsided())
    refuse(wanted,
           "the operator is singular and not symmetric (its rows sum to 0 and its columns do not, or the other way "
           "round)");
  method = wanted;
  reason = wanted == SolverMethod::gmres ? (is_flexible() ? "flexible GMRES" : "GMRES") : "not symmetric: BiCGStab";
  if (is_flexible()) return precondition_by_network();
  if (options.preconditioning == Preconditioning::none) return make_unpreconditioned();
  if (takes_floats() && wanted == SolverMethod::bicgstab)
    in_floats.cycles = FloatCycles::of(*a, true, cycles(false), no_multigrid);
  if (!in_floats.cycles) {
    multigrid = a->visit([&](const auto& rows) {
      return Multigrid::of_symmetric_part(rows, null_space(), cycles(false), no_multigrid);
    });
  }
  if (in_floats.cycles || multigrid) return precondition_by_multigrid();
  if (options.preconditioning == Preconditioning::multigrid) refuse(wanted, no_multigrid.c_str());
  incomplete.setDroptol(1e-3);
  incomplete.setFillfactor(20);
  incomplete.compute(a->with_matrix(columns_of));
  if (!has_incomplete_factors()) {
    reason += ", divided by the diagonal, as there are no incomplete factors of it";
    return make_divided_by_diagonal();
  }
  reason += ", preconditioned by incomplete factors, as cells are coupled with more than their neighbours";
  make_iterations(
      [this](std::span<const double> r, std::span<double> z) { vector_of(z) = incomplete.solve(vector_of(r)); });
}

void LinearSolver::Impl::choose() {
  switch (options.method) {
    case SolverMethod::automatic:
      if (try_tridiagonal() || try_fourier()) return;
      if (a->size() <= small_system || null_space().is_lopsided())
        return make_direct(null_space().is_lopsided() ? "singular and not symmetric: inverted as a whole"
                                                      : "a small system: sparse factors");
      if (!try_multigrid(SolverMethod::cg)) make_unsymmetric(SolverMethod::bicgstab);
      return;
    case SolverMethod::direct: return make_direct("as the scheme says");
    case SolverMethod::tridiagonal:
      if (!try_tridiagonal())
        refuse(options.method, "it is of one axis, three entries a row and a dominant middle one");
      return;
    case SolverMethod::fourier:
      if (!try_fourier())
        refuse(options.method, "the operator is not the same in all cells, with walls that are mirrors");
      return;
    case SolverMethod::multigrid:
      if (!try_multigrid(options.method)) refuse(options.method, no_multigrid.c_str());
      return;
    case SolverMethod::cg: return make_symmetric();
    case SolverMethod::bicgstab:
    case SolverMethod::gmres: return make_unsymmetric(options.method);
  }
}

LinearSolver::LinearSolver(std::shared_ptr<const GridOperator> grid_operator, SolveOptions options, const Team& team)
    : impl_(std::make_unique<Impl>(std::move(grid_operator), std::move(options), team)) {}
LinearSolver::~LinearSolver() = default;

/// A^T*(b - A*x)|. Small for a large residual if the residual is outside of the range of a singular A. Allocates
/// memory, but is only used when a solve fails.
double LinearSolver::Impl::out_of_reach(std::span<const double> b, std::span<const double> x) const {
  std::vector<double> residual(b.size()), image(b.size());
  a->multiply(x, residual);
  for (std::size_t i = 0; i < b.size(); ++i) residual[i] = b[i] - residual[i];
  a->multiply_transposed(residual, image);
  return norm(image);
}

/// b - A*x|; cycles in floats have computed it already.
double LinearSolver::Impl::left_of(std::span<const double> b, std::span<const double> x, const IterationReport& way) {
  if (is_packed && !iterations) return multigrid->residual(packed.right, packed.x);
  if (!in_floats.cycles || method != SolverMethod::multigrid) return a->residual(b, x, team);
  const double size = norm(b, team);
  return size == 0 ? way.residual : way.residual * size;
}

void LinearSolver::Impl::judge(std::span<const double> b, std::span<const double> x, const IterationReport& way,
                               SolveReport& report) {
  const double size = norm(b, team), left = left_of(b, x, way);
  report.residual = size == 0 ? left : left / size;
  if (direct && direct->is_dense()) {  // least squares: the whole residual is outside of the range
    report.is_least_squares = true;
    report.incompatible = report.residual;
    report.residual = size == 0 || left <= 1e-6 * size ? 0 : out_of_reach(b, x) / (largest_row * size);
  }
  const double by_rounding = size == 0 ? 0 : rounding_of_x() * norm(x, team) / size;
  const bool is_iterated = has_steps();
  report.bound = std::max({options.tolerance, is_iterated ? 0 : 1e-9, by_rounding});
  report.converged = std::isfinite(left) && ((is_iterated && way.converged) || report.residual <= report.bound);
  if ((fourier || lines) && report.converged && size > 0) fourier_residual = report.residual;
  report.is_singular = !report.converged && left > 1e-6 * size && out_of_reach(b, x) <= 1e-8 * largest_row * left;
}

/// Once Fourier series have given a small residual they are trusted: later solves only check for finite values.
SolveReport LinearSolver::Impl::solve_by_known_waves(std::span<const double> b, std::span<double> x) {
  fourier ? fourier->divide(b, x) : lines->divide(b, x);
  SolveReport report{.method = method,
                     .residual = *fourier_residual,
                     .incompatible = null_space().share_of_mean(b, team),
                     .converged = are_finite(x, team)};
  if (!report.converged) report.residual = NAN;
  return report;
}

template <class Real>
std::optional<SolveReport> LinearSolver::Impl::solve_rows(const ReadRowsOf<Real>& b, const WriteRowsOf<Real>& x) {
  if (!fourier || !fourier_residual || fourier->drops_waves()) return std::nullopt;
  const std::optional<PassedRows> passed = fourier->divide_rows(b, x);
  if (!passed || !passed->is_finite) return std::nullopt;
  return SolveReport{.method = method,
                     .residual = *fourier_residual,
                     .incompatible = null_space().share_of_mean(passed->read, static_cast<std::size_t>(a->size()))};
}

std::optional<SolveReport> LinearSolver::solve_rows(const ReadRowsOf<double>& b, const WriteRowsOf<double>& x) {
  return impl_->solve_rows(b, x);
}
std::optional<SolveReport> LinearSolver::solve_rows(const ReadRowsOf<float>& b, const WriteRowsOf<float>& x) {
  return impl_->solve_rows(b, x);
}
bool LinearSolver::has_floats() const { return impl_->fourier && impl_->fourier->has_floats(); }

void LinearSolver::begin(std::span<const double> b, std::span<double> guesses, std::span<double> x) {
  impl_->first_guess.find(*impl_->a, b, guesses, {impl_->options.rounding, impl_->rounding_of_x()}, x, impl_->team);
}

SolveReport LinearSolver::solve(std::span<const double> b, std::span<double> x, const VectorFunction* search) {
  Impl& own = *impl_;
  own.search = search;
  if (own.fourier_residual && !(own.fourier && own.fourier->drops_waves())) return own.solve_by_known_waves(b, x);
  SolveReport report{.method = own.method};
  if (!own.right.empty()) {
    copy_vector(b, own.right, own.team);
    report.incompatible = own.null_space().remove(own.right, own.team);
  }
  const std::span<const double> right = own.right.empty() ? b : own.right;
  IterationReport way{.converged = true};
  if (own.tridiagonal) own.tridiagonal->solve(own.right, x);
  if (own.fourier) report.incompatible = std::hypot(report.incompatible, own.fourier->solve(own.right, x));
  if (own.lines) own.lines->divide(own.right, x);
  if (own.direct) own.direct->solve(own.direct->is_dense() ? b : std::span<const double>(own.right), x);
  if (own.has_steps()) way = own.iterate(right, x);
  if (!own.fourier) own.null_space().remove(x, own.team);  // Fourier solutions have no null-space part
  report.iterations = way.iterations;
  report.unaided = way.unaided;
  own.judge(right, x, way, report);
  report.is_indefinite = way.is_indefinite && !report.converged;  // the sign in rounding is meaningless
  return report;
}
bool LinearSolver::renew(std::shared_ptr<const GridOperator> grid_operator) {
  return impl_->renew(std::move(grid_operator));
}
std::shared_ptr<const GridOperator> LinearSolver::give_operator() { return std::exchange(impl_->a, nullptr); }
void LinearSolver::keep_operator(std::shared_ptr<const GridOperator> grid_operator) {
  impl_->a = std::move(grid_operator);
}
const std::shared_ptr<const GridOperator>& LinearSolver::grid_operator() const { return impl_->a; }
bool LinearSolver::has_first_guess() const { return impl_->has_steps(); }
SolverMethod LinearSolver::method() const { return impl_->method; }
const std::string& LinearSolver::reason() const { return impl_->reason; }

}  // namespace dpde
