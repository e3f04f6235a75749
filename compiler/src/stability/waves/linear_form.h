// SPDX-License-Identifier: Apache-2.0
// Linear forms of displaced perturbations: a state after a linear step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stability {

constexpr int most_states = 64;
constexpr int most_components = 1024;  // from most_states on they are sums of waves
constexpr int farthest_offset = 4000;  // along each axis

/// A sum of perturbations: coefficients of component c at the point displaced by `offset`, sorted by key().
class LinearForm {
 public:
  struct Term {
    std::int64_t key;
    double coefficient;
  };
  LinearForm() = default;
  /// One perturbation of component c.
  explicit LinearForm(int component) : terms_{{component, 1.0}} {}

  const std::vector<Term>& terms() const { return terms_; }
  bool is_zero() const { return terms_.empty(); }
  bool is_finite() const;
  LinearForm shifted(const stencil::Offset& offset) const;
  LinearForm times(double factor) const;
  LinearForm plus(const LinearForm& other) const;
  /// With `by` added to the numbers of components that are sums of waves.
  LinearForm renumbered(int by) const;

  static std::int64_t key_of(const stencil::Offset& offset);
  static stencil::Offset offset_of(std::int64_t key);
  static int component_of(std::int64_t key);

 private:
  friend class FormSum;
  std::vector<Term> terms_;
};

/// Adds many forms. The cost of a term does not depend on their number: keys are found by hashing, and the memory is
/// reused from sum to sum.
class FormSum {
 public:
  /// The form displaced by `offset`, times the factor.
  void add(const LinearForm& form, const stencil::Offset& offset, double factor);
  /// The sum of the forms added since the last call.
  LinearForm take();

 private:
  void grow();
  std::size_t place_of(std::int64_t key) const;

  std::vector<LinearForm::Term> terms_;  // in the order in which their keys came
  std::vector<std::uint32_t> places_;    // of keys, by hashing: 0, or one more than the number of the term
  std::vector<std::size_t> taken_;       // places of the terms
};

}  // namespace dpde::stability
