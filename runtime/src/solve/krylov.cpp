// SPDX-License-Identifier: Apache-2.0
#include "solve/krylov.h"

#include <cmath>

namespace dpde {

double dot(std::span<const double> a, std::span<const double> b) {
  double lanes[4] = {};
  const std::size_t whole = a.size() / 4 * 4;
  for (std::size_t i = 0; i < whole; i += 4) {
    for (std::size_t l = 0; l < 4; ++l) lanes[l] += a[i + l] * b[i + l];
  }
  for (std::size_t i = whole; i < a.size(); ++i) lanes[0] += a[i] * b[i];
  return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

void add_multiple(double c, std::span<const double> x, std::span<double> y) {
  for (std::size_t i = 0; i < x.size(); ++i) y[i] += c * x[i];
}

double norm(std::span<const double> a) { return std::sqrt(dot(a, a)); }

void Iterations::resize(std::size_t size) {
  for (auto* vector : {&r_, &z_, &p_, &q_, &s_, &t_, &v_, &first_}) *vector = Numbers(size);
}

void Iterations::find_residual(std::span<const double> b, std::span<const double> x) {
  multiply_(x, r_);
  for (std::size_t i = 0; i < b.size(); ++i) r_[i] = b[i] - r_[i];
}

IterationReport Iterations::cg(std::span<const double> b, std::span<double> x) {
  const double size = norm(b);
  IterationReport report;
  find_residual(b, x);
  double product = 0, sign = 0;
  for (;; ++report.iterations) {
    report.residual = size == 0 ? norm(r_) : norm(r_) / size;
    report.converged = report.residual <= tolerance_;
    if (report.converged || report.iterations == most_ || !std::isfinite(report.residual)) return report;
    precondition_(r_, z_);
    const double next = dot(r_, z_), weight = product == 0 ? 0 : next / product;
    product = next;
    for (std::size_t i = 0; i < p_.size(); ++i) p_[i] = z_[i] + weight * p_[i];
    multiply_(p_, q_);
    const double curvature = dot(p_, q_);
    if (sign == 0) sign = curvature < 0 ? -1 : 1;
    report.is_indefinite = !(curvature * sign > 0);
    if (report.is_indefinite) return report;
    add_multiple(product / curvature, p_, x);
    add_multiple(-product / curvature, q_, r_);
  }
}

/// Until what is carried along as the residual is small; that drifts away from what it is.
void Iterations::bicgstab_from_here(double size, std::span<double> x, IterationReport& report) {
  std::copy_n(r_.data(), r_.size(), first_.data());
  double rho = 1, alpha = 1, omega = 1;
  for (std::size_t i = 0; i < p_.size(); ++i) p_[i] = v_[i] = 0;
  while (report.iterations < most_) {
    const double next = dot(first_, r_);
    if (next == 0 || omega == 0) return;
    const double beta = next / rho * (alpha / omega);
    rho = next;
    for (std::size_t i = 0; i < p_.size(); ++i) p_[i] = r_[i] + beta * (p_[i] - omega * v_[i]);
    precondition_(p_, z_);
    multiply_(z_, v_);
    alpha = rho / dot(first_, v_);
    for (std::size_t i = 0; i < s_.size(); ++i) s_[i] = r_[i] - alpha * v_[i];
    add_multiple(alpha, z_, x);
    precondition_(s_, z_);
    multiply_(z_, t_);
    const double length = dot(t_, t_);
    omega = length == 0 ? 0 : dot(t_, s_) / length;
    add_multiple(omega, z_, x);
    for (std::size_t i = 0; i < r_.size(); ++i) r_[i] = s_[i] - omega * t_[i];
    ++report.iterations;
    const double residual = norm(r_);
    if (residual <= 0.5 * tolerance_ * size || !std::isfinite(residual)) return;
  }
}

IterationReport Iterations::bicgstab(std::span<const double> b, std::span<double> x) {
  const double size = norm(b);
  IterationReport report;
  double before = INFINITY;
  for (;;) {
    find_residual(b, x);
    report.residual = size == 0 ? norm(r_) : norm(r_) / size;
    report.converged = report.residual <= tolerance_;
    const bool goes_on = report.residual < 0.5 * before && report.iterations < most_;
    if (report.converged || !goes_on) return report;
    before = report.residual;
    bicgstab_from_here(size, x, report);
  }
}

}  // namespace dpde
