// SPDX-License-Identifier: Apache-2.0
// Runs compiled programs: fills, folds, reductions and sweeps of row functions over fields of one layout.
//
//  - run() allocates nothing, looks nothing up and takes no lock; the constructor resolves everything.
//  - Results, sums included, are bit-identical for any number of threads.
//  - The executor owns no fields: bind() every field of the program (inputs, temporaries and outputs) before run().
//    The program (and its code) must outlive the executor.
//
//   Executor step(program, layout, team);
//   step.bind(step.field_index("u"), u.base()); ...
//   step.set_param(step.param_index("dt"), 0.01); step.update_uniforms();
//   step.prepare();   // once: halos of the inputs
//   step.run();       // as often as wanted; rebind for ping-pong
#pragma once

#include <bit>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/clock.h"
#include "dpde/runtime/owned_memory.h"
#include "dpde/runtime/solve_note.h"
#include "dpde/runtime/team.h"

namespace dpde {

class Communicator;
class FieldSolve;
class Network;
class SolverStore;

/// A store for programs that run one after the other: their solves with the same operator share a solver.
std::shared_ptr<SolverStore> make_solver_store();

class Executor {
 public:
  /// `solvers`: shared by programs that run one after the other; empty: the executor has its own. `ranks`: if the
  /// layout is a subgrid; must outlive the executor. Halos at subdomain interfaces are then the neighbours' cells and
  /// sums are over all ranks, which must make the same calls.
  /// @throws Error(run) if the program's version, rank, precision or halo does not fit the layout, or if the program
  /// cannot run on several ranks.
  Executor(const dpde_program& program, const dpde_layout& layout, const Team& team = 1,
           std::shared_ptr<SolverStore> solvers = {}, Communicator* ranks = nullptr);
  ~Executor();
  Executor(Executor&&) noexcept;
  Executor& operator=(Executor&&) noexcept;

  /// -1 if the program has none of that name.
  int field_index(std::string_view name) const;
  int param_index(std::string_view name) const;
  int sum_index(std::string_view name) const;

  /// `base` points at cell (0, 0, 0) of memory with the executor's layout; doubles or floats by layout.real.
  void bind(int field, void* base) { fields_[static_cast<size_t>(field)] = base; }
  void* bound(int field) const { return fields_[static_cast<size_t>(field)]; }

  /// Weights, their rates and the arrays to which their gradients are added: doubles, in the order of the network. They
  /// must outlive the executor; call update_weights() after each change of the values.
  void bind_weights(int network, const dpde_weights& weights) { weights_[static_cast<size_t>(network)] = weights; }
  void update_weights();
  /// Null if the program does not run it through a Network object.
  Network* network(int number);

  /// Takes effect at the next update_uniforms(). All parameters are 0 at first.
  void set_param(int param, double value) {
    double& own = params_[static_cast<size_t>(param)];
    uniforms_are_stale_ =
        uniforms_are_stale_ || std::bit_cast<std::uint64_t>(own) != std::bit_cast<std::uint64_t>(value);
    own = value;
  }
  double param(int param) const { return params_[static_cast<size_t>(param)]; }
  void update_uniforms() {
    if (uniforms_are_stale_) compute_uniforms();
  }

  /// Fills the halos of the inputs (all, or of one field) as the program needs them; also at subdomain interfaces.
  void prepare();
  void prepare(int field);
  /// True when prepare() fills that field.
  bool prepares(int field) const;

  void run();

  /// Frames: for short programs run again and again with the same few bindings. A frame holds all pointers of one run:
  /// make_frame() sets frame_size() of them for the fields bound now, run_frame() is run() with a frame made before.
  /// frame_size() is 0 for programs that have none (those of 2 and 3 axes, with explicit fills, or interpreted).
  size_t frame_size() const { return frame_.size(); }
  void make_frame(void** frame) const;
  void run_frame(void* const* frame);

  /// Sweeps over large fields measure at run time which of several equivalent variants is fastest on this machine.
  /// Returns the choices, one line a sweep; "" until all have been made, or if there is nothing to choose.
  std::string tuning() const;
  /// True while a sweep is still measuring.
  bool is_tuning() const;
  /// Uses the choices of an executor of the same program and layout; text that does not fit is ignored.
  void set_tuning(std::string_view text);

  /// Allocates the stacks on which the passes of repeats store fields; otherwise the first run() does.
  void make_stacks();
  /// Memory by owner, apart from bound fields, that it holds or will hold after its first run.
  std::vector<OwnedMemory> memory() const;

  /// Statistics of the program's solves, one note for each.
  std::deque<SolveNote>& solve_notes();
  /// The linear solves for a single field, in the order in which they run. The pointers stay valid.
  std::vector<FieldSolve*> field_solves();

  /// Adds the time of each later run to *to, which must stay valid; null: stops this.
  void set_clock(RunSeconds* to) { clock_ = to; }

  /// Sums of the last run, in the order of the program's `sums`.
  std::span<const double> sums() const { return sums_; }
  /// As last computed by update_uniforms().
  std::span<const double> uniforms() const { return uniforms_; }
  /// The parameters of the program, followed by the counters.
  std::span<const double> params() const { return params_; }
  const dpde_program& program() const { return *program_; }
  const dpde_layout& layout() const { return *layout_; }

 private:
  void compute_uniforms();
  void count(size_t counter, double number);
  void run_lines(void* const* frame);

  struct Plan;
  const dpde_program* program_;
  std::unique_ptr<dpde_layout> layout_;
  std::vector<void*> fields_;
  std::vector<double> params_, uniforms_, sums_;
  std::vector<dpde_weights> weights_;
  std::vector<void*> frame_;
  bool uniforms_are_stale_ = true;
  RunSeconds* clock_ = nullptr;
  std::unique_ptr<Plan> plan_;
};

}  // namespace dpde
