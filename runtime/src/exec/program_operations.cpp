// SPDX-License-Identifier: Apache-2.0
#include "exec/program_operations.h"

#include <fmt/format.h>

#include "dpde/runtime/error.h"

namespace dpde {
namespace {

class OperationMaker {
 public:
  explicit OperationMaker(const OperationSetup& setup) : setup_(setup) {}

  std::vector<Operation> make(const dpde_operation* source, int count) const {
    std::vector<Operation> made;
    for (int i = 0; i < count; ++i) {
      const dpde_operation& from = source[i];
      if (setup_.seams != nullptr) add(setup_.seams->before(from), made);
      made.push_back(make_one(from, made.empty() ? nullptr : std::get_if<FieldTransform>(&made.back().kind)));
      if (setup_.seams == nullptr) continue;
      add(setup_.seams->after(from), made);
      for (int f = 0; f < from.then_count; ++f) made.push_back({HaloFill(from.then[f], *setup_.layout, exchange())});
    }
    return made;
  }

 private:
  HaloExchange* exchange() const { return setup_.seams != nullptr ? &setup_.seams->exchange() : nullptr; }
  Communicator* ranks() const { return setup_.seams != nullptr ? &setup_.seams->exchange().ranks() : nullptr; }
  static void add(const std::vector<SeamWork>& work, std::vector<Operation>& made) {
    for (const SeamWork& one : work) made.push_back({one});
  }

  /// `before`: the transform of the operation before, if that is one.
  Operation make_one(const dpde_operation& from, FieldTransform* before) const {
    const dpde_layout& layout = *setup_.layout;
    switch (from.kind) {
      case DPDE_FILL: return {HaloFill(from.fill, layout, exchange())};
      case DPDE_FOLD: return {HaloFold(from.fill, from.grow, layout)};
      case DPDE_REDUCE: return {FieldReduction(from.reduce, layout, *setup_.team, ranks())};
      case DPDE_NETWORK: return {make_inference(from.inference)};
      case DPDE_TRANSFORM: return {FieldTransform(from.transform, layout, *setup_.team, before)};
      case DPDE_SWEEP: return {make_sweep_of(from)};
      case DPDE_SOLVE: return {make_solve(from.solve)};
      case DPDE_REPEAT: return {make_repeat(from.repeat)};
      default:
        throw Error(ErrorKind::run,
                    fmt::format("program {}: an operation of unknown kind {}", setup_.program->name, from.kind));
    }
  }

  Inference make_inference(const dpde_inference& from) const {
    return Inference(from, *setup_.program->networks[from.network]);
  }
  Sweep make_sweep_of(const dpde_operation& from) const {
    Sweep sweep = make_sweep(*setup_.program, from, *setup_.layout, setup_.team->threads());
    if (setup_.seams != nullptr && !sweep.grids.empty()) sweep.read_whole(*setup_.seams->whole());
    return sweep;
  }
  SolveOperation make_solve(const dpde_solve& from) const {
    SolveOperation made{.solve = ProgramSolve(from, *setup_.program, *setup_.layout, setup_.shelf)};
    if (from.network != nullptr) made.preconditioner = make_inference(*from.network);
    made.block = make(from.operations, from.operation_count);
    if (from.step != nullptr) made.step = make(from.step->operations, from.step->operation_count);
    return made;
  }
  RepeatOperation make_repeat(const dpde_repeat& from) const {
    RepeatOperation made{.passes = Passes(from, *setup_.stacks)};
    if (setup_.seams != nullptr) setup_.seams->begin_block();
    made.block = make(from.operations, from.operation_count);
    return made;
  }

  const OperationSetup& setup_;
};

}  // namespace

std::vector<Operation> make_operations(const OperationSetup& setup, const dpde_operation* source, int count) {
  return OperationMaker(setup).make(source, count);
}

}  // namespace dpde
