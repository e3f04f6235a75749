// SPDX-License-Identifier: Apache-2.0
#include "solve/operator/krylov.h"

#include <algorithm>
#include <cmath>

#include "solve/operator/vector_parts.h"

namespace dpde {
namespace {

/// Independent partial sums do not wait for each other.
double dot_of_part(const double* a, const double* b, std::size_t size) {
  constexpr std::size_t strands = 16;
  double sums[strands] = {};
  const std::size_t whole = size / strands * strands;
  for (std::size_t i = 0; i < whole; i += strands) {
#pragma omp simd
    for (std::size_t k = 0; k < strands; ++k) sums[k] += a[i + k] * b[i + k];
  }
  for (std::size_t i = whole; i < size; ++i) sums[i - whole] += a[i] * b[i];
  double sum = 0;
  for (const double part : sums) sum += part;
  return sum;
}

}  // namespace

double dot(std::span<const double> a, std::span<const double> b, const Team& team) {
  return sum_of_parts(team, a.size(), [&](std::size_t begin, std::size_t end) {
    return dot_of_part(a.data() + begin, b.data() + begin, end - begin);
  });
}

void add_multiple(double c, std::span<const double> x, std::span<double> y, const Team& team) {
  set_each(
      team, y, [c](double value, double along) { return value + c * along; }, y, x);
}

double norm(std::span<const double> a, const Team& team) { return std::sqrt(dot(a, a, team)); }

void copy_vector(std::span<const double> from, std::span<double> to, const Team& team) {
  VectorParts(from.size()).for_each(team, [&](std::size_t begin, std::size_t end, std::int64_t) {
    std::copy(from.data() + begin, from.data() + end, to.data() + begin);
  });
}

void Iterations::resize(std::size_t size, IterationMethod method) {
  for (auto* vector : {&r_, &z_, &p_}) *vector = Numbers(size);
  q_ = Numbers(method == IterationMethod::cg ? 0 : size);
  const bool is_bicgstab = method == IterationMethod::bicgstab;
  for (auto* vector : {&s_, &t_, &v_, &first_, &best_}) *vector = Numbers(is_bicgstab ? size : 0);
}

void Iterations::find_residual(std::span<const double> b, std::span<const double> x) {
  multiply_(x, r_);
  set_each(
      team_, r_, [](double right, double image) { return right - image; }, b, r_);
}

/// A*p shares the memory of z, which is no longer needed once p is updated.
IterationReport Iterations::cg(std::span<const double> b, std::span<double> x, const SolutionOrder* order) {
  const double size = norm(b);
  IterationReport report;
  if (order != nullptr) order->pack(x, z_);
  find_residual(b, order == nullptr ? x : std::span<double>(z_));
  double product = 0, sign = 0;
  for (;; ++report.iterations) {
    report.residual = size == 0 ? norm(r_) : norm(r_) / size;
    report.converged = report.residual <= tolerance_;
    if (report.converged || report.iterations == most_) return report;
    precondition_(r_, z_);
    const double next = dot(r_, z_), weight = product == 0 ? 0 : next / product;
    product = next;
    set_each(
        team_, p_, [=](double z, double p) { return z + weight * p; }, z_, p_);
    multiply_(p_, z_);
    const double curvature = dot(p_, z_);
    if (sign == 0) sign = curvature < 0 ? -1 : 1;
    report.is_indefinite = !(curvature * sign > 0) || !std::isfinite(product / curvature);
    if (report.is_indefinite) return report;
    const double length = product / curvature;
    order == nullptr ? add_multiple(length, p_, x, team_) : order->add(length, p_, x);
    add_multiple(-length, z_, r_, team_);
  }
}

/// z = M(r); z = r if (r, z) is NaN or only rounding. The rounding is relative to M(r) before projection: if M(r) is a
/// constant only rounding is left after it.
bool Iterations::search() {
  precondition_(r_, z_);
  const double rounding = std::sqrt(static_cast<double>(r_.size())) * 0x1p-52, made = norm(z_);
  if (project_) project_(z_, z_);
  if (std::abs(dot(r_, z_)) > rounding * norm(r_) * made) return true;
  copy_vector(r_, z_, team_);
  return false;
}

/// Recomputes r = b - A*x; returns whether it is as small as the recursive residual.
bool Iterations::has_come(std::span<const double> b, std::span<const double> x) {
  find_residual(b, x);
  return norm(r_) <= tolerance_ * norm(b);
}

/// p = z + weight*p, q = A*p; returns (p, q).
double Iterations::look_along(double weight) {
  if (weight == 0) {
    copy_vector(z_, p_, team_);
  } else {
    set_each(
        team_, p_, [=](double z, double p) { return z + weight * p; }, z_, p_);
  }
  multiply_(p_, q_);
  return dot(p_, q_);
}

IterationReport Iterations::flexible_cg(std::span<const double> b, std::span<double> x) {
  const double size = norm(b), unit = size == 0 ? 1 : size;
  IterationReport report;
  find_residual(b, x);
  double curvature = 0, sign = 0, halved = INFINITY;  // halved: residual when it was last halved
  bool is_searched = true;
  for (int since = 0;; ++report.iterations) {
    report.residual = norm(r_) / unit;
    report.converged = report.residual <= tolerance_;
    bool gives_up = is_searched && report.converged && !has_come(b, x);
    report.converged = report.converged && !gives_up;
    if (report.converged || report.iterations == most_) return report;
    if (report.residual <= 0.5 * halved) {
      halved = report.residual;
      since = report.iterations;
    }
    gives_up = gives_up || (is_searched && report.iterations - since >= least_patience);
    if (gives_up) curvature = 0;  // plain conjugate gradients from here on
    is_searched = is_searched && !gives_up;
    const bool is_useful = is_searched && search();
    if (!is_searched) copy_vector(r_, z_, team_);
    report.unaided += is_useful ? 0 : 1;
    const double weight = curvature == 0 ? 0 : -dot(z_, q_) / curvature;
    curvature = look_along(weight);
    double length = dot(r_, p_) / curvature;
    const auto is_lost = [&] { return !(curvature * (sign == 0 ? curvature : sign) > 0) || !std::isfinite(length); };
    const bool is_turned = is_useful || weight != 0;
    if (is_lost() && is_turned) {  // the new part of z, or the old part of p, may be only rounding
      copy_vector(r_, z_, team_);
      report.unaided += is_useful ? 1 : 0;
      curvature = look_along(0);
      length = dot(r_, p_) / curvature;
    }
    report.is_indefinite = is_lost();
    if (report.is_indefinite) return report;
    sign = curvature;
    add_multiple(length, p_, x, team_);
    add_multiple(-length, q_, r_, team_);
  }
}

/// Returns false on breakdown; x then contains nothing that is not finite.
bool Iterations::bicgstab_step(std::span<double> x) {
  const double next = dot(first_, r_), beta = next / rho_ * (alpha_ / omega_);
  if (next == 0 || !std::isfinite(beta)) return false;
  rho_ = next;
  const auto along = [beta, omega = omega_](double r, double p, double v) { return r + beta * (p - omega * v); };
  set_each(team_, p_, along, r_, p_, v_);
  precondition_(p_, z_);
  multiply_(z_, v_);
  alpha_ = rho_ / dot(first_, v_);
  if (!std::isfinite(alpha_)) return false;
  set_each(
      team_, s_, [alpha = alpha_](double r, double v) { return r - alpha * v; }, r_, v_);
  add_multiple(alpha_, z_, x, team_);
  precondition_(s_, z_);
  multiply_(z_, t_);
  const double length = dot(t_, t_), product = dot(t_, s_);
  omega_ = length == 0 ? 0 : product / length;
  if (!std::isfinite(omega_)) return false;
  add_multiple(omega_, z_, x, team_);
  set_each(
      team_, r_, [omega = omega_](double s, double t) { return s - omega * t; }, s_, t_);
  return std::isfinite(norm(r_));
}

/// Runs until the recursive residual is small; it drifts away from the true one. x becomes the best iterate: residuals
/// rise before a breakdown, and when only rounding of a singular operator is left. Gives up if as many iterations as
/// before bring no improvement.
void Iterations::bicgstab_from_here(double size, std::span<double> x, IterationReport& report) {
  copy_vector(r_, first_, team_);
  copy_vector(x, best_, team_);
  rho_ = alpha_ = omega_ = 1;
  for (Numbers* zero : {&p_, &v_}) set_each(team_, *zero, [] { return 0.0; });
  double least = norm(r_);
  for (int made = 0, best = 0; report.iterations < most_ && made - best < std::max(least_patience, best);) {
    if (!bicgstab_step(x)) break;
    ++made;
    ++report.iterations;
    const double residual = norm(r_);
    if (residual >= least) continue;
    least = residual;
    best = made;
    copy_vector(x, best_, team_);
    if (residual <= 0.5 * tolerance_ * size) break;
  }
  copy_vector(best_, x, team_);
}

IterationReport Iterations::bicgstab(std::span<const double> b, std::span<double> x) {
  const double size = norm(b);
  IterationReport report;
  find_residual(b, x);
  report.residual = size == 0 ? norm(r_) : norm(r_) / size;
  for (;;) {
    report.converged = report.residual <= tolerance_;
    if (report.converged || report.iterations >= most_) return report;
    copy_vector(x, q_, team_);
    const double before = report.residual;
    bicgstab_from_here(size, x, report);
    find_residual(b, x);
    const double now = size == 0 ? norm(r_) : norm(r_) / size;
    if (!(now < before)) copy_vector(q_, x, team_);
    if (!(now < before)) return report;
    report.residual = now;
    if (!(now < 0.5 * before)) {
      report.converged = now <= tolerance_;
      return report;
    }
  }
}

}  // namespace dpde
