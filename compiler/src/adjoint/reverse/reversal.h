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

  /// Gives seeds their names back: those of the interface.
  void restore_seed_names();

  /// Kernel that sets to 0 the bars of active inputs nothing contributed to.
  void finish(const std::set<std::string>& inputs);

  /// What the reverse part needs of the primal, and that part, with its fills.
  std::vector<stencil::Statement> statements(stencil::Module& kernels);

  std::vector<stencil::Statement> body;
  /// Primal fields the reverse part reads, with the index of the earliest statement whose adjoint does.
  std::map<std::string, int> needed;
  /// States whose values in all passes it reads.
  Saves saves;
  /// Where the adjoint would read beyond bounded axes what a fill has overwritten: kernels, or for a fold the program.
  /// And what of it.
  std::map<std::string, std::string> refused;
  bool has_failed = false;  // in a repeat; that was reported

 private:
  /// State of one x_bar.
  struct Bar {
    int grow = 0;            // region on which it holds values
    bool is_around = false;  // periodic halo filled since the last change
    int extent = 0;          // farther out than that they are 0; at most `grow`
  };
  stencil::Kernel kernel_called(const std::string& suffix);
  void add_seed(const std::string& field);

  /// A result that the program itself reads gets contributions beside its seed. They are added to a copy: an input is
  /// never changed, and holds values on the interior only. So does the transpose of a scatter to a result need a copy.
  void copy_seeds_read_inside();
  void reverse_fill(const stencil::Fill& fill, int index);

  /// Lets the fold give what belongs to c of mixed(a, b, c), where a or b varies, to fields of their own: the weights
  /// need it.
  std::vector<std::string> separate_values(const stencil::Fill& fill, stencil::Fold& fold);

  /// From what belongs to c on to the weights and to the field that c may be.
  void reverse_weights(const stencil::Fill& fill, const std::vector<std::string>& values, int grow, int extent,
                       int index);

  /// Bars of varied fields that nothing contributed to yet: 0, so that a fold can add to them or a fill continue them.
  void begin_bars(const std::set<std::string>& fields);
  DerivedField bar_of_wall(int grow);

  /// Under another name, as a field is filled on walls before anything reads it.
  void copy_bar(const std::string& field);

  /// The fill that transposes a fold is as wide as the halo.
  void reverse_fold(const stencil::Fold& fold);

  /// Means and sums are their own transposes. What goes to a max or min is shared by the cells that have it.
  void reverse_reduce(const stencil::Reduce& reduce, int index);

  /// The bars of inputs are written where there are none yet, else to a field of their own that is added.
  void reverse_network(const stencil::NetworkCall& call, int index);
  void reverse_transform(const stencil::Transform& transform, int index);

  /// One solve with the transposed operator, and what the coefficients of the operator get.
  void reverse_solve(const stencil::Solve& solve, int index);
  std::vector<std::string> add_same_solve(const stencil::Solve& solve, const std::vector<std::string>& seeds,
                                          int index);
  std::vector<std::string> add_transposed_solve(const stencil::Solve& solve, const std::vector<std::string>& seeds,
                                                int index);
  void reverse_coefficients(const stencil::Solve& solve, const std::vector<std::string>& multipliers, int index);

  /// Fields, and what is to be added to their bars.
  using Contributions = std::vector<std::pair<std::string, std::string>>;

  /// The bar of the field where there is none yet, else a field of its own that is added to it.
  std::string bar_to_write(const std::string& field, const std::string& wish, Contributions& to_add);
  void add_inside(const Contributions& to_add);

  /// The repeat of the adjoint of its block, from the last pass to the first. What that reads of primal states comes
  /// from stacks; what it gives to fields that are the same in all passes is added up.
  void reverse_repeat(const stencil::Repeat& repeat, int index);

  /// Adds a value, known in the interior, to a bar.
  void add_inside(const std::string& field, const stencil::Expr& value);
  void reverse_run(const stencil::Run& primal, int index);

  /// What is added to beyond the region where a bar holds values is lost.
  void contribute(const stencil::Kernel& kernel, const std::string& field, const std::map<std::string, int>& extents,
                  int target_grow);

  /// A fill around periodic axes leaves nothing of what a bar holds beyond bounded ones, and there the transpose of a
  /// scatter needs values.
  void check_halos(const stencil::Kernel& primal, const stencil::Kernel& gather, int grow);
  std::optional<stencil::Expr> seed(const std::string& field, int grow) const;

  void run(stencil::Kernel kernel, int grow);
  /// Says how a field of the reverse part goes on: around periodic axes. What it is beyond walls, the kernels know.
  void state_around(const std::string& field);
  /// Of a primal field that the reverse part reads: as the program left it, where it filled it.
  stencil::HaloRule rule_of_primal(const std::string& field) const;

  /// `own`: fields that one part of a kernel's adjoint leaves to the next.
  void note_needs(const stencil::Kernel& kernel, int index, const std::vector<std::string>& own = {});

  const stencil::Module& module_;
  const stencil::Program& program_;
  const Varied& varied_;
  DerivedNames& names_;
  stencil::Module& kernels_;
  DiagnosticSink& sink_;
  const int reach_;
  std::map<std::string, Bar> bars_;                    // primal field -> its bar, where it holds values
  std::map<std::string, const stencil::Fill*> fills_;  // of primal fields, as the program left them
  std::vector<stencil::HaloRule> halos_;               // of the reverse part's own fields
  std::set<std::string> grown_;                        // primal fields computed beyond the interior
  std::map<std::string, std::string> seed_names_;      // of the fields that copy_seeds_read_inside renamed
  std::vector<std::string> consumed_;
  std::set<std::string> stacks_;  // of the primal, that have bars
};

}  // namespace dpde::adjoint
