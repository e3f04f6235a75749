// SPDX-License-Identifier: Apache-2.0
// Common preparation of tangent and adjoint: the fields that vary, the names of derivatives, and checks for programs
// that cannot be differentiated.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "adjoint/adjoint.h"
#include "adjoint/rules.h"
#include "stencil/build.h"
#include "support/names/name_supply.h"

namespace dpde::adjoint {

/// Makes one name x_dot or x_bar for each x, distinct from every name of the module. These names are reserved from the
/// start, so that a local t1 cannot take the derived name of a parameter t1.
class DerivedNames {
 public:
  DerivedNames(const stencil::Module& module, std::string suffix);
  /// The current derived name of field, parameter or sum `name`; `rebind` changes it.
  std::string of(const std::string& name);
  /// A free name for a local, distinct from the names of fields, parameters and sums.
  std::string fresh(const std::string& wish) { return supply_.fresh(wish); }
  std::string fresh_kernel(const std::string& wish) { return kernels_.fresh(without_dots(wish)); }
  std::string fresh_program(const std::string& wish) { return programs_.fresh(wish); }
  /// Sets the derived name of `name`; returns the previous one.
  std::string rebind(const std::string& name, std::string derived) {
    return std::exchange(derived_.at(name), std::move(derived));
  }
  const std::map<std::string, std::string>& all() const { return derived_; }
  /// The derived names that were requested, with their primal values.
  std::vector<Link> links(const stencil::Module& module, const stencil::Program& program, const Activity& wrt) const;

 private:
  std::string suffix_;
  NameSupply supply_, kernels_, programs_;             // kernels and programs are name spaces of their own
  std::map<std::string, std::string> kept_, derived_;  // reserved for each field, parameter, sum, network; requested
};

/// Fields of `program` that depend on active inputs (fixed point over its statements), and the active params.
///
/// The two fields of a swap vary together, so that the derivative of a step can be looped over like the step.
Varied find_varied(const stencil::Module& module, const stencil::Program& program, const Activity& wrt);

enum class Way { forward, reverse };
/// Reports statements without a derivative: floor of a varied value, a boundary that varies by a param, `+=` to a field
/// read in the same kernel. True if there are none.
bool check_differentiable(const stencil::Module& module, const stencil::Program& program, const Varied& varied, Way way,
                          DiagnosticSink& sink);
/// False, and an error, for the adjoint of a scatter whose target is folded onto varying boundary values: not
/// implemented (it needs the halo cells that a departure point reaches beyond such a wall).
bool check_folds(const stencil::Module& module, const stencil::Program& program, const Varied& varied,
                 DiagnosticSink& sink);

/// Adds the adjoints of states (as swaps) and of other active fields (as keeps) to the results of `derived`.
void add_results(const stencil::Program& program, const Varied& varied, const Activity& wrt, DerivedNames& names,
                 stencil::Program& derived);

/// The derived field of a field of boundary values; nullopt if it does not vary.
using DerivedField = std::function<std::optional<std::string>(const std::string&)>;
/// The boundary of the derivative of a fill or fold: constant values become 0, fields become their derivatives.
std::vector<stencil::AxisBoundary> derived_sides(std::vector<stencil::AxisBoundary> axes, const DerivedField& derived);

}  // namespace dpde::adjoint
