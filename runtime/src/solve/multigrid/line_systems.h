// SPDX-License-Identifier: Apache-2.0
// Operators whose rows vary along some axes and are constant along others, by Fourier series along the latter.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <variant>

#include "solve/fourier/line_series.h"
#include "solve/fourier/separable.h"

namespace dpde {

class LineSystems {
 public:
  static std::optional<LineSystems> of(const StencilMatrix& matrix, const NullSpace& null_space, const Team& team) {
    if (null_space.is_empty()) {
      if (auto series = LineSeries::of(matrix, team)) return LineSystems(std::move(*series));
    }
    if (auto separable = SeparableSolver::of(matrix, null_space, team)) return LineSystems(std::move(*separable));
    return std::nullopt;
  }

  void divide(std::span<const double> b, std::span<double> x) {
    std::visit([&](auto& method) { method.divide(b, x); }, method_);
  }
  const char* reason() const {
    return std::holds_alternative<LineSeries>(method_)
               ? "coupled along one periodic axis, with the same coefficients along it: Fourier series of each line"
               : "the same coefficients along periodic axes: Fourier series, and elimination along the other axis";
  }

 private:
  template <class Method>
  explicit LineSystems(Method method) : method_(std::move(method)) {}

  std::variant<LineSeries, SeparableSolver> method_;
};

}  // namespace dpde
