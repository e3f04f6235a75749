// SPDX-License-Identifier: Apache-2.0
// What tangent and adjoint agree on before they write anything: which fields vary, how derived names are made, and
// what cannot be differentiated.
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

/// Makes x_dot or x_bar for each x, once, avoiding every name of the module. They are kept free from the beginning: a
/// local that is called t1 takes nothing from a parameter of that name.
class DerivedNames {
 public:
  DerivedNames(const stencil::Module& module, std::string suffix);
  /// The derived name of field, parameter or sum `name`, as it stands now: `rebind` changes it.
  std::string of(const std::string& name);
  /// A free name for a local, beside the names of fields, parameters and sums.
  std::string fresh(const std::string& wish) { return supply_.fresh(wish); }
  std::string fresh_kernel(const std::string& wish) { return kernels_.fresh(without_dots(wish)); }
  std::string fresh_program(const std::string& wish) { return programs_.fresh(wish); }
  /// From now on `name` stands for `derived`; returns what it stood for.
  std::string rebind(const std::string& name, std::string derived) {
    return std::exchange(derived_.at(name), std::move(derived));
  }
  const std::map<std::string, std::string>& all() const { return derived_; }
  /// Those asked for, with what they belong to.
  std::vector<Link> links(const stencil::Module& module, const stencil::Program& program, const Activity& wrt) const;

 private:
  std::string suffix_;
  NameSupply supply_, kernels_, programs_;             // kernels and programs are name spaces of their own
  std::map<std::string, std::string> kept_, derived_;  // for each field, parameter, sum and network; those asked for
};

/// Fields of `program` that depend on what is active (fixed point over its statements), and the active params.
///
/// The two fields of a swap vary together, so that the derivative of a step can be looped over like the step.
Varied find_varied(const stencil::Module& module, const stencil::Program& program, const Activity& wrt);

enum class Way { forward, reverse };
/// Reports what has no derivative: floor of something varied, a boundary that varies by a param, `+=` to a field read
/// in the same kernel. True when nothing was found.
bool check_differentiable(const stencil::Module& module, const stencil::Program& program, const Varied& varied, Way way,
                          DiagnosticSink& sink);
/// False, and an error, for the adjoint of a scatter whose target is folded onto walls that vary: not worked out (halo
/// cells that a departure point reaches beyond a varying wall would have to be sought there).
bool check_folds(const stencil::Module& module, const stencil::Program& program, const Varied& varied,
                 DiagnosticSink& sink);

/// Lets an adjoint swap and keep the bars of the states and of what is active.
void add_results(const stencil::Program& program, const Varied& varied, const Activity& wrt, DerivedNames& names,
                 stencil::Program& derived);

/// The derived field of a field that holds values of a wall; nothing where it does not vary.
using DerivedField = std::function<std::optional<std::string>(const std::string&)>;
/// The boundary of the derivative of a fill or fold: values that are the same along the wall become 0, fields derived.
std::vector<stencil::AxisBoundary> derived_sides(std::vector<stencil::AxisBoundary> axes, const DerivedField& derived);

}  // namespace dpde::adjoint
