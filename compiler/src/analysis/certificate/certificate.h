// SPDX-License-Identifier: Apache-2.0
// Certification of derivatives on the compiled kernels: the tangent and the adjoint of a whole run must agree to
// rounding (dot product), on the scene's grid and on small odd ones, and the gradient must leave a remainder of second
// order (Taylor). The Hessian must be symmetric and, where the programs have no kinks, leave a remainder of third
// order, or be what differences of the gradient come to. It has a verdict of its own: where neither tells, the gradient
// is certified and the Hessian is not.
//
// In single precision rounding hides what these bounds find. The derivatives of a scene with real = f32 are certified
// as those of the same programs in f64, the same expressions but for their order (regroup_updates is left out of f32);
// beside that tangent and adjoint of the f32 programs must agree as far as floats can.
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
  std::string what;  // a number of steps, or a program
  double relative_error = 0;
  double difference = 0,
         rounding = 0;       // of the two numbers, and what rounding of the loss and of their terms may leave of it
  bool is_rounding = false;  // both are 0 but for that: the relative error says nothing
  double scale = 0;          // the sum of the magnitudes of the adjoint's terms
  bool is_zero = false;      // both are 0: nothing was compared
};

/// How far v.Hw and w.Hv may be apart.
constexpr double largest_asymmetry = 1e-10;
bool has_slope_of_two(const std::optional<double>& slope);
/// Of a loss of size 1, or of the terms of a derivative: what rounding leaves where the derivative is 0.
constexpr double rounding_of_loss = 1e-15, single_rounding_of_loss = 0x1p29 * rounding_of_loss;
/// The terms of a derivative that is 0 on one grid, as that of a difference is on a periodic cell, may be rounding
/// themselves: what they would be is seen on the other grids. The median, as on the largest the run may be unstable.
double usual_scale(std::vector<double> scales);
struct SecondOrderCheck {
  std::vector<DotCase> cases;   // v.Hw against w.Hv
  std::optional<double> slope;  // of the remainder with the Hessian; absent when it is all rounding
  bool only_rounding = false;
  bool has_kinks = false;                          // abs, max, if, interpolation: the slope may be anything from 2 to 3
  std::optional<QuotientEvidence> quotients = {};  // of the gradient, where the slope does not tell
  double worst() const;                            // largest relative error, of what is not rounding
  bool is_settled() const;                         // the remainder tells, or is not asked
  bool tests_nothing() const;                      // each case is 0, or so but for rounding
  /// Unsymmetric, or differences of the gradient agree on another number.
  bool is_wrong() const;
  bool passed() const;
};
/// Tangent against adjoint of programs in single precision. Errors are relative to the larger of the two numbers and to
/// a tenth of the sum of the terms' magnitudes: the rounding of the terms does not shrink where they cancel.
struct SinglePrecisionCheck {
  std::vector<DotCase> cases;
  double worst() const;
  /// At most 1e-4: 6e-8 a rounding, grown over the steps of a run as a state's own rounding is. A wrong term shows as
  /// 1e-2 or more on grids of a few cells.
  bool passed() const { return worst() <= 1e-4; }
};
struct Certificate {
  std::vector<DotCase> cases;
  std::vector<std::string> skipped;  // grids on which nothing could be compared, and why
  double worst() const;              // largest relative error, of what is not rounding; not a number without a case
  bool is_all_rounding() const;      // in each case: derivatives are 0 but for that
  bool is_all_zero() const;          // in each case: nothing was tested
  bool tests_nothing() const;        // each case is 0, or so but for rounding
  std::optional<double> slope;       // of the remainder; absent when it is all rounding
  std::string note;                  // why the slope is absent, or where it was measured
  Point point;                       // where the remainders are, and along what
  std::vector<Remainder> remainders;
  std::optional<QuotientEvidence> quotients;  // where the slope does not tell: see taylor.h
  std::optional<JumpOnLine> jump;             // of the loss, beside the point
  bool is_jump_of_scheme = false;  // of bounds that it keeps, as maccormack does: the derivative at the point is right
  std::optional<SecondOrderCheck> second;      // absent: there are no second derivatives
  std::optional<SinglePrecisionCheck> single;  // absent: the scene is one of f64
  std::optional<SteadyAdjoint> steady = {};    // of runs until steady
  bool start_is_finite =
      true;  // loss and gradient where the task begins; what is certified is the derivative at a point beside it
  std::string jump_at_start;          // what jumps in the run with which the task begins; "": nothing
  std::vector<KinkAtStart> kinks;     // where it begins, the loss has more than one slope
  std::vector<std::string> untested;  // unknowns by which no derivative was compared: it is 0, or below rounding
  driver::FirstWindow window = {};    // of a task that learns from trajectories: where it begins
  /// Finite and with its divisors' signs at the start, every case at most 1e-11 or rounding, and a derivative by the
  /// rule of taylor.h.
  bool passed() const;
  bool only_rounding = false;
};

struct CertifyOptions {
  int threads = 1;
  std::uint64_t seed = 0;
  const std::atomic<bool>* stop = nullptr;
  std::function<bool(driver::Session&, DiagnosticSink&)> judge = {};  // of scenes that make data: SessionOptions::judge
  std::shared_ptr<const driver::WindowStart> window = nullptr;        // where the runs begin
};

/// `compiled` was made with `certify`, tangent and adjoint. nullopt when `sink` has errors afterwards.
std::optional<Certificate> certify(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled,
                                   const CertifyOptions& options, DiagnosticSink& sink);

/// Adds the check of the same scene compiled in f32. False when `sink` has errors afterwards.
bool certify_single_precision(const SourceFile& source, std::shared_ptr<const driver::Compiled> compiled,
                              const CertifyOptions& options, Certificate& certificate, DiagnosticSink& sink);

/// Hand-written programs without a scene: each on small grids of random values.
Certificate certify_programs(const driver::Compiled& compiled, const CertifyOptions& options);

/// Small odd grids of a rank: extents from 1 up, below and above the width of stencils.
std::vector<std::vector<int>> small_grids(std::size_t rank, const std::vector<network::Network>& networks = {});
/// |a - b| relative to the larger one, and to a thousandth of the sum of magnitudes `scale` where a and b cancel;
/// NaN where one of them is not finite.
double relative_difference(double a, double b, double scale);

}  // namespace dpde::analysis
