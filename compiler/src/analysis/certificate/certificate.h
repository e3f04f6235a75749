// SPDX-License-Identifier: Apache-2.0
// Certification of derivatives on the compiled kernels. Tangent and adjoint of a whole run must agree to rounding
// (dot-product test), on the scene's grid and on small odd ones. The gradient must leave a remainder of second order
// (Taylor test). The Hessian must be symmetric, and leave a remainder of third order if the programs have no kinks, or
// else be the limit of differences of the gradient. It has its own verdict: if neither test is conclusive, the gradient
// is certified and the Hessian is not.
//
// In single precision, rounding would hide errors within these bounds. A scene with real = f32 is certified by the same
// programs in f64, whose expressions differ only in their order (regroup_updates is not used in f32). In addition,
// tangent and adjoint of the f32 programs must agree as far as f32 allows.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/certificate/taylor.h"
#include "analysis/generic_point.h"
#include "analysis/kinks_at_start.h"
#include "driver/scene/session.h"
#include "driver/scene/window_start.h"

namespace dpde::analysis {

/// One comparison of tangent and adjoint.
struct DotCase {
  std::string grid;  // "64 x 32"
  std::string what;  // number of steps, or a program
  double relative_error = 0;
  double difference = 0,
         rounding = 0;       // of the two numbers; the rounding that loss and terms may leave in it
  bool is_rounding = false;  // both numbers are only rounding: the relative error is meaningless
  double scale = 0;          // sum of the magnitudes of the adjoint's terms
  bool is_zero = false;      // both are 0: nothing was compared
};

/// Allowed difference of v.Hw and w.Hv, relative.
constexpr double largest_asymmetry = 1e-10;
bool has_slope_of_two(const std::optional<double>& slope);
/// Rounding that remains where a derivative is 0, for a loss (or terms of the derivative) of size 1.
constexpr double rounding_of_loss = 1e-15, single_rounding_of_loss = 0x1p29 * rounding_of_loss;
/// Typical size of a derivative's terms over the grids. If the derivative is 0 on one grid, as that of a difference on
/// one periodic cell, its terms there may themselves be rounding. Median, since the run on the largest grid may be
/// unstable.
double usual_scale(std::vector<double> scales);
struct SecondOrderCheck {
  std::vector<DotCase> cases;   // v.Hw against w.Hv
  std::optional<double> slope;  // of the remainder with the Hessian; absent if it is all rounding
  bool only_rounding = false;
  bool has_kinks = false;                          // abs, max, if, interpolation: the slope may be anything from 2 to 3
  std::optional<QuotientEvidence> quotients = {};  // of the gradient, if the slope is not conclusive
  double worst() const;                            // largest relative error of cases that are not rounding
  bool is_settled() const;                         // the remainder is conclusive or not needed
  bool tests_nothing() const;                      // every case is 0 or rounding
  /// Not symmetric, or differences of the gradient converge to another number.
  bool is_wrong() const;
  bool passed() const;
};
/// Tangent against adjoint of programs in single precision. Errors are relative to the larger number and to a tenth of
/// the sum of the terms' magnitudes, since rounding of terms does not shrink where they cancel.
struct SinglePrecisionCheck {
  std::vector<DotCase> cases;
  double worst() const;
  /// At most 1e-4: a rounding of 6e-8, amplified over the steps of a run like that of a state. On grids of a few cells
  /// a wrong term causes 1e-2 or more.
  bool passed() const { return worst() <= 1e-4; }
};
struct Certificate {
  std::vector<DotCase> cases;
  std::vector<std::string> skipped;  // grids without a comparison, and why
  double worst() const;              // largest relative error of cases that are not rounding; NaN without a case
  bool is_all_rounding() const;      // all derivatives are only rounding
  bool is_all_zero() const;          // all are 0: nothing was tested
  bool tests_nothing() const;        // every case is 0 or rounding
  std::optional<double> slope;       // of the remainder; absent if it is all rounding
  std::string note;                  // why the slope is absent, or where it was measured
  Point point;                       // point and direction of the remainders
  std::vector<Remainder> remainders;
  std::optional<QuotientEvidence> quotients;   // if the slope is not conclusive: see taylor.h
  std::optional<JumpOnLine> jump;              // of the loss, near the point
  bool is_jump_of_scheme = false;              // at bounds, as in maccormack: the derivative at the point is right
  std::optional<SecondOrderCheck> second;      // absent: no second derivatives
  std::optional<SinglePrecisionCheck> single;  // absent: the scene is in f64
  std::optional<SteadyAdjoint> steady = {};    // of runs until steady
  bool start_is_finite = true;  // loss and gradient at the task's start; certified is the derivative at a nearby point
  std::string jump_at_start;    // jump in the run from the task's start; "": none
  std::vector<KinkAtStart> kinks;     // kinks of the loss at the task's start
  std::vector<std::string> untested;  // unknowns without a compared derivative: it is 0 or below rounding
  driver::FirstWindow window = {};    // for a learning task: first training sample
  /// The start is finite and its divisors keep their signs, every error is at most 1e-11 or rounding, and the
  /// derivative passes the rule of taylor.h.
  bool passed() const;
  bool only_rounding = false;
};

struct CertifyOptions {
  int threads = 1;
  std::uint64_t seed = 0;
  const std::atomic<bool>* stop = nullptr;
  std::function<bool(driver::Session&, DiagnosticSink&)> judge = {};  // for data scenes: SessionOptions::judge
  std::shared_ptr<const driver::WindowStart> window = nullptr;        // start of the runs
};

/// `compiled` must have been made with `certify`, tangent and adjoint. Returns nullopt if `sink` has errors afterwards.
std::optional<Certificate> certify(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled,
                                   const CertifyOptions& options, DiagnosticSink& sink);

/// Adds the check of the same scene compiled in f32. Returns false if `sink` has errors afterwards.
bool certify_single_precision(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled,
                              const CertifyOptions& options, Certificate& certificate, DiagnosticSink& sink);

/// For hand-written programs without a scene: runs each on small grids with random values.
Certificate certify_programs(const driver::Compiled& compiled, const CertifyOptions& options);

/// Small odd grids of a rank, with extents from 1 to more than the width of stencils.
std::vector<std::vector<int>> small_grids(std::size_t rank, const std::vector<network::Network>& networks = {});
/// |a - b| relative to the larger number, or to a thousandth of `scale` (sum of magnitudes) where a and b cancel. NaN
/// if one of them is not finite.
double relative_difference(double a, double b, double scale);

}  // namespace dpde::analysis
