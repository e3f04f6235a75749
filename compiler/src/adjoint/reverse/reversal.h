// SPDX-License-Identifier: Apache-2.0
// The reverse part of an adjoint program: the transposes of all statements, last first.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "adjoint/check/regions.h"
#include "adjoint/reverse/plan.h"
#include "adjoint/reverse/recomputation.h"
#include "source/diagnostic.h"
#include "stencil/stencil.h"

namespace dpde::adjoint {

/// Writes the reverse part of the adjoint program, statement by statement.
class Reversal {
 public:
  Reversal(const stencil::Module& module, const stencil::Program& program, const Varied& varied, DerivedNames& names,
           stencil::Module& kernels, DiagnosticSink& sink);
  void reverse_all();
  void reverse(int index);

  /// Restores the names that seeds have in the interface.
  void restore_seed_names();

  /// Adds a kernel that sets the adjoints of active inputs without contributions to 0.
  void finish(const std::set<std::string>& inputs);

  /// The recomputed primal statements, followed by the reverse part with its fills.
  std::vector<stencil::Statement> statements(stencil::Module& kernels);

  std::vector<stencil::Statement> body;
  /// Primal fields that the reverse part reads, each with the index of the earliest statement whose adjoint reads it.
  std::map<std::string, int> needed;
  /// States that repeats must save, as the reverse part reads them in every pass.
  Saves saves;
  /// Kernels (for a fold: the program) whose adjoint would read, beyond bounded axes, values that a fill has
  /// overwritten; with a description of these values.
  std::map<std::string, std::string> refused;
  bool has_failed = false;  // in a repeat, with a diagnostic

 private:
  /// State of one x_bar.
  struct Bar {
    int grow = 0;            // region on which it has values
    bool is_around = false;  // periodic halo filled since the last change
    int extent = 0;          // values farther out are 0; at most `grow`
  };
  stencil::Kernel kernel_called(const std::string& suffix);
  void add_seed(const std::string& field);

  /// A result that the program itself reads gets contributions in addition to its seed. They are added to a copy, as an
  /// input is never changed and has values in the interior only. The transpose of a scatter to a result needs a copy
  /// for the same reason.
  void copy_seeds_read_inside();
  void reverse_fill(const stencil::Fill& fill, int index);

  /// If a or b of mixed(a, b, c) varies, makes the fold store the contribution to c in separate fields, which the
  /// adjoint of the weights needs. Returns these fields.
  std::vector<std::string> separate_values(const stencil::Fill& fill, stencil::Fold& fold);

  /// Passes the contributions to c on to the weights, and to the field of c if it is one.
  void reverse_weights(const stencil::Fill& fill, const std::vector<std::string>& values, int grow, int extent,
                       int index);

  /// Sets adjoints of varied fields without contributions to 0, so that a fold can add to them or a fill extend them.
  void begin_bars(const std::set<std::string>& fields);
  DerivedField bar_of_wall(int grow);

  /// Copies the adjoint to a new name: a field must be filled on walls before any read.
  void copy_bar(const std::string& field);

  /// Adds the fill that transposes a fold; it covers the whole halo.
  void reverse_fold(const stencil::Fold& fold);

  /// Means and sums are their own transposes. The adjoint of a max or min is divided among the cells with that value.
  void reverse_reduce(const stencil::Reduce& reduce, int index);

  /// Writes adjoints of inputs directly if they have no values yet; otherwise writes a separate field and adds it.
  void reverse_network(const stencil::NetworkCall& call, int index);
  void reverse_transform(const stencil::Transform& transform, int index);

  /// One solve with the transposed operator, and the adjoints of the operator's coefficients.
  void reverse_solve(const stencil::Solve& solve, int index);
  std::vector<std::string> add_same_solve(const stencil::Solve& solve, const std::vector<std::string>& seeds,
                                          int index);
  std::vector<std::string> add_transposed_solve(const stencil::Solve& solve, const std::vector<std::string>& seeds,
                                                int index);
  void reverse_coefficients(const stencil::Solve& solve, const std::vector<std::string>& multipliers, int index);

  /// Fields, each with the field to add to its adjoint.
  using Contributions = std::vector<std::pair<std::string, std::string>>;

  /// The adjoint of the field if it has no values yet, else a new field that is added to it later.
  std::string bar_to_write(const std::string& field, const std::string& wish, Contributions& to_add);
  void add_inside(const Contributions& to_add);

  /// The repeat of the adjoint of its block, from the last pass to the first. Primal states are read from stacks;
  /// contributions to fields that are the same in all passes are summed.
  void reverse_repeat(const stencil::Repeat& repeat, int index);

  /// Adds a value, known in the interior, to an adjoint.
  void add_inside(const std::string& field, const stencil::Expr& value);
  void reverse_run(const stencil::Run& primal, int index);

  /// Adds a contribution to an adjoint. Additions outside the region where the adjoint has values are lost.
  void contribute(const stencil::Kernel& kernel, const std::string& field, const std::map<std::string, int>& extents,
                  int target_grow);

  /// A fill along periodic axes overwrites an adjoint's values beyond bounded axes, which the transpose of a scatter
  /// needs.
  void check_halos(const stencil::Kernel& primal, const stencil::Kernel& gather, int grow);
  std::optional<stencil::Expr> seed(const std::string& field, int grow) const;

  void run(stencil::Kernel kernel, int grow);
  /// Adds a halo rule for a field of the reverse part along periodic axes. Its kernels set the values beyond walls.
  void state_around(const std::string& field);
  /// Halo rule of a primal field that the reverse part reads: the program's last fill, if there is one.
  stencil::HaloRule rule_of_primal(const std::string& field) const;

  /// `own`: fields that one part of a kernel's adjoint stores for the next.
  void note_needs(const stencil::Kernel& kernel, int index, const std::vector<std::string>& own = {});

  const stencil::Module& module_;
  const stencil::Program& program_;
  const Varied& varied_;
  DerivedNames& names_;
  stencil::Module& kernels_;
  DiagnosticSink& sink_;
  const int reach_;
  std::map<std::string, Bar> bars_;                    // primal field -> its adjoint, if that has values
  std::map<std::string, const stencil::Fill*> fills_;  // of primal fields, at the end of the program
  std::vector<stencil::HaloRule> halos_;               // of the reverse part's own fields
  std::set<std::string> grown_;                        // primal fields computed beyond the interior
  std::map<std::string, std::string> seed_names_;      // of the fields that copy_seeds_read_inside renamed
  std::vector<std::string> consumed_;
  std::set<std::string> stacks_;  // stacks of the primal that have adjoints
};

}  // namespace dpde::adjoint
