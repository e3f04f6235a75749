// SPDX-License-Identifier: Apache-2.0
// Reverse mode of a program: the statements it needs again, then the transposes of all statements, last first.
#include "adjoint/adjoint.h"

#include <algorithm>

#include "adjoint/adjoint_kernel.h"
#include "adjoint/custom_adjoint_check.h"
#include "adjoint/extremes.h"
#include "adjoint/plan.h"
#include "adjoint/recomputation.h"
#include "adjoint/regions.h"
#include "adjoint/reversed_passes.h"
#include "adjoint/weights.h"
#include "stencil/as_written.h"
#include "stencil/effects.h"
#include "support/assert.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

/// Writes the reverse part of the adjoint program, statement by statement.
class Reversal {
 public:
  Reversal(const Module& module, const Program& program, const Varied& varied, DerivedNames& names, Module& kernels,
           DiagnosticSink& sink)
      : module_(module),
        program_(program),
        varied_(varied),
        names_(names),
        kernels_(kernels),
        sink_(sink),
        spoiled_(module, program),
        reach_(reach(module, program, varied)),
        filled_(filled_at_the_end(module, program)),
        grown_(grown_fields(module, program)) {
    for (const Swap& swap : program.swaps) add_seed(swap.next);
    for (const std::string& keep : program.keeps) add_seed(keep);
    copy_seeds_read_inside();
  }

  void reverse_all() {
    for (int i = static_cast<int>(program_.body.size()) - 1; i >= 0; --i) reverse(i);
  }

  void reverse(int index) {
    statement_ = index;
    match(
        program_.body[index], [&](const Fill& fill) { reverse_fill(fill, index); },
        [&](const Fold& fold) { reverse_fold(fold); }, [&](const Reduce& reduce) { reverse_reduce(reduce, index); },
        [&](const NetworkCall& call) { reverse_network(call, index); },
        [&](const Run& run) { reverse_run(run, index); }, [&](const Repeat& repeat) { reverse_repeat(repeat, index); });
  }

  /// Gives seeds their names back: those of the interface.
  void restore_seed_names() {
    for (const auto& [field, seed] : seed_names_) names_.rebind(field, seed);
  }

  /// Kernel that sets to 0 the bars of active inputs nothing contributed to.
  void finish(const std::set<std::string>& inputs) {
    Kernel zero = kernel_called("_adjoint_zero");
    for (const std::string& field : inputs) {
      if (!bars_.contains(field)) zero.stores.push_back({names_.of(field), false, 0.0, {}});
    }
    if (!zero.stores.empty()) run(std::move(zero), 0);
  }

  /// What the reverse part needs of the primal, and that part.
  std::vector<Statement> statements(Module& kernels) const {
    std::set<std::string> fields;
    for (const auto& [field, first] : needed) fields.insert(field);
    std::vector<Statement> all = recomputation(module_, program_, std::move(fields), saves, kernels);
    all.insert(all.end(), body.begin(), body.end());
    return all;
  }

  std::vector<Statement> body;
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

  Kernel kernel_called(const std::string& suffix) {
    return {names_.fresh_kernel(program_.name + suffix), static_cast<int>(program_.axes.size()), {}, {}, {}, {}};
  }

  void add_seed(const std::string& field) {
    if (varied_.fields.contains(field)) bars_[field] = {};
  }

  /// A result that the program itself reads gets contributions beside its seed. They are added to a copy: an input is
  /// never changed, and holds values on the interior only. So does the transpose of a scatter to a result need a copy.
  void copy_seeds_read_inside() {
    Kernel copy = kernel_called("_adjoint_seeds");
    const std::set<std::string> read = fields_read_inside(module_, program_);
    for (auto& [field, bar] : bars_) {
      if (!read.contains(field)) continue;
      const std::string seed = names_.of(field), total = names_.fresh(seed + "_total");
      const Expr value = access(seed);
      copy.stores.push_back({total, false, reach_ > 0 ? select(inside({}, 0), value, 0.0) : value, {}});
      seed_names_[field] = names_.rebind(field, total);
      bar.grow = reach_;
    }
    if (!copy.stores.empty()) run(std::move(copy), reach_);
  }

  void reverse_fill(const Fill& fill, int index) {
    const auto bar = bars_.find(fill.field);
    if (bar == bars_.end() || (bar->second.grow == 0 && !is_on_walls(fill.axes))) return;  // nothing came to the halo
    begin_bars(wall_fields(fill.axes));
    const int grow = bar->second.grow;
    const int extent = bars_[fill.field].extent;
    Fold fold{names_.of(fill.field), grow, derived_sides(fill.axes, bar_of_wall(grow))};
    const std::vector<std::string> values =
        extent > 0 || is_on_walls(fill.axes) ? separate_values(fill, fold) : std::vector<std::string>{};
    body.push_back(std::move(fold));
    if (!values.empty()) reverse_weights(fill, values, grow, extent, index);
    for (const std::string& wall : wall_fields(fill.axes)) {
      const auto of_wall = bars_.find(wall);
      if (of_wall == bars_.end()) continue;
      if (of_wall->second.grow < grow)
        refused.emplace(program_.name, wall + " at the walls of " + fill.field + " before it is folded or filled");
      of_wall->second = {of_wall->second.grow, false, std::max(of_wall->second.extent, extent)};
    }
    bars_[fill.field] = {grow, false, 0};
  }

  /// Lets the fold give what belongs to c of mixed(a, b, c), where a or b varies, to fields of their own: the weights
  /// need it.
  std::vector<std::string> separate_values(const Fill& fill, Fold& fold) {
    Kernel zero = kernel_called("_adjoint_walls_begin");
    std::vector<std::string> values;
    for (const WallSide& at : sides_with_varied_weights(fill.axes, varied_)) {
      values.push_back(names_.fresh(fill.field + "_wall_value_bar"));
      zero.stores.push_back({values.back(), false, 0.0, {}});
      side_at(fold.axes, at).value = access(values.back());
    }
    if (!values.empty()) run(std::move(zero), fold.grow);
    return values;
  }

  /// From what belongs to c on to the weights and to the field that c may be.
  void reverse_weights(const Fill& fill, const std::vector<std::string>& values, int grow, int extent, int index) {
    Kernel kernel = adjoint_of_weights(fill, values, extent, varied_, names_, bar_of_wall(grow));
    kernel.name = names_.fresh_kernel(program_.name + "_adjoint_walls");
    needed[fill.field] = index;
    run(std::move(kernel), extent);
  }

  /// Bars of varied fields that nothing contributed to yet: 0, so that a fold can add to them or a fill continue them.
  void begin_bars(const std::set<std::string>& fields) {
    Kernel zero = kernel_called("_adjoint_begin");
    for (const std::string& field : fields) {
      if (!varied_.fields.contains(field) || !bars_.emplace(field, Bar{reach_, false}).second) continue;
      zero.stores.push_back({names_.of(field), false, 0.0, {}});
    }
    if (!zero.stores.empty()) run(std::move(zero), reach_);
  }

  DerivedField bar_of_wall(int grow) {
    return [this, grow](const std::string& wall) {
      const auto bar = bars_.find(wall);
      return bar != bars_.end() && bar->second.grow >= grow ? std::optional(names_.of(wall)) : std::nullopt;
    };
  }

  /// Whether the reverse part so far reads a field.
  bool was_read(const std::string& field) const {
    return std::ranges::any_of(body, [&](const Statement& statement) {
      return match(
          statement, [&](const Fill& fill) { return wall_fields(fill.axes).contains(field); },
          [&](const Fold& fold) { return wall_fields(fold.axes).contains(field); },
          [&](const Reduce& reduce) { return reduce.field == field; },
          [&](const NetworkCall& call) { return contains(call.inputs, field) || contains(call.rates, field); },
          [&](const Run& run) { return signature(*kernels_.find_kernel(run.kernel)).find_read(field) != nullptr; },
          [&](const Repeat& repeat) { return contains(effects(kernels_, repeat).reads, field); });
    });
  }

  /// Under another name, as a field is filled on walls before anything reads it.
  void copy_bar(const std::string& field) {
    Kernel copy = kernel_called("_adjoint_copy");
    const std::string bar = names_.of(field), copied = names_.fresh(bar);
    copy.stores.push_back({copied, false, access(bar), {}});
    run(std::move(copy), bars_.at(field).grow);
    names_.rebind(field, copied);
  }

  /// The fill that transposes a fold is as wide as the halo.
  void reverse_fold(const Fold& fold) {
    if (fold.grow == 0 && !is_on_walls(fold.axes)) return;
    for (const std::string& wall : wall_fields(fold.axes)) {
      const auto of_wall = bars_.find(wall);
      if (of_wall == bars_.end()) continue;
      begin_bars({fold.field});
      if (of_wall->second.grow >= fold.grow || of_wall->second.extent == 0) continue;
      refused.emplace(program_.name, "folding " + fold.field + " onto " + wall + " before that is folded or filled");
    }
    const auto bar = bars_.find(fold.field);
    if (bar == bars_.end()) return;
    if (bar->second.extent > fold.grow)
      refused.emplace(program_.name, "reading " + fold.field + " past the reach of its fold");
    if (is_on_walls(fold.axes) && was_read(names_.of(fold.field))) copy_bar(fold.field);
    body.push_back(Fill{names_.of(fold.field), derived_sides(fold.axes, bar_of_wall(fold.grow))});
    bar->second = {fold.grow, true, fold.grow};
  }

  /// Means and sums are their own transposes. What goes to a max or min is shared by the cells that have it.
  void reverse_reduce(const Reduce& reduce, int index) {
    const auto bar = bars_.find(reduce.result);
    if (bar == bars_.end()) return;
    const std::string seed = names_.of(reduce.result);
    bars_.erase(bar);
    if (!varied_.fields.contains(reduce.field)) return;
    const bool is_mean = reduce.kind == Reduction::mean, is_extreme = dpde::adjoint::is_extreme(reduce);
    Reduce total{"", is_mean ? Reduction::mean : Reduction::sum, seed, reduce.over};
    if (!is_extreme && reach_ == 0 && !bars_.contains(reduce.field)) {
      total.result = names_.of(reduce.field);
      body.push_back(total);
      bars_[reduce.field] = {};
      return;
    }
    total.result = names_.fresh(seed + "_" + std::string(name_of(total.kind)));
    body.push_back(total);
    Expr value = access(total.result);
    if (is_extreme) {
      needed[reduce.field] = needed[reduce.result] = index;
      restore(reduce.field);
      value =
          at_extreme(reduce, value / access(add_count_of_ties(reduce, {program_, "_adjoint", names_, kernels_, body})));
    }
    add_inside(reduce.field, value);
  }

  /// The bars of inputs are written where there are none yet, else to a field of their own that is added.
  void reverse_network(const NetworkCall& call, int index) {
    NetworkCall reversed{call.network, NetworkCall::Mode::adjoint,           call.inputs, {},
                         {},           varied_.params.contains(call.network)};
    bool has_seed = false;
    for (const std::string& result : call.results) {
      const bool is_seeded = !result.empty() && bars_.erase(result) > 0;
      reversed.rates.push_back(is_seeded ? names_.of(result) : "");
      has_seed = has_seed || is_seeded;
    }
    if (!has_seed) return;
    std::vector<std::pair<std::string, std::string>> to_add;
    for (const std::string& input : call.inputs) {
      reversed.results.push_back("");
      if (!varied_.fields.contains(input)) continue;
      const bool is_new = reach_ == 0 && !bars_.contains(input);
      reversed.results.back() = is_new ? names_.of(input) : names_.fresh(names_.of(input) + "_" + call.network);
      if (is_new) bars_[input] = {};
      if (!is_new) to_add.emplace_back(input, reversed.results.back());
    }
    if (!reversed.weights && fields_written(reversed).empty()) return;
    for (const std::string& input : call.inputs) needed[input] = index;
    std::ranges::for_each(call.inputs, [&](const std::string& input) { restore(input); });
    body.push_back(reversed);
    for (const auto& [input, contribution] : to_add) add_inside(input, access(contribution));
  }

  /// The repeat of the adjoint of its block, from the last pass to the first. What that reads of primal states comes
  /// from stacks; what it gives to fields that are the same in all passes is added up.
  void reverse_repeat(const Repeat& repeat, int index) {
    std::set<std::string> results;
    for (const Carry& carry : repeat.carries) {
      if (varied_.fields.contains(carry.next)) results.insert(carry.result);
    }
    const Effects known = effects(module_, repeat);
    const auto has_bar = [&](const std::string& field) { return bars_.contains(field); };
    const auto has_stack = [&](const Stacked& save) { return stacks_.contains(save.stack); };
    const bool has_saved = std::ranges::any_of(repeat.saves, has_stack);
    if (known.sums.empty() && !has_saved && std::ranges::none_of(results, has_bar)) return;
    begin_bars(results);
    ReversedPasses passes(repeat, known.reads, varied_, names_);
    const Program pass = pass_of(repeat, program_);
    Reversal block(module_, pass, varied_, names_, kernels_, sink_);
    block.reverse_all();
    block.finish(passes.states());
    block.restore_seed_names();
    Repeat reversed{repeat.count, block.statements(kernels_), {}, {}, {}, reversed_counter(repeat)};
    const auto is_given = [&](const std::string& field) { return block.bars_.contains(field); };
    const auto given = passes.finish(reversed, is_given, stacks_, {program_, "_adjoint", names_, kernels_, body});
    const auto [constant, differing] = passes.read_by(interface_of(kernels_, pass_of(reversed, program_)).inputs);
    for (const std::string& field : constant) needed[field] = index;
    for (const std::string& field : differing) {
      reversed.loads.push_back({field, names_.fresh(field + "_passes")});
      saves[static_cast<std::size_t>(index)].push_back(reversed.loads.back());
      // The first pass has a carried state from outside, and its stack only the place where it lies.
      const bool is_carried = std::ranges::find(repeat.carries, field, &Carry::state) != repeat.carries.end();
      if (is_carried && is_updated_behind(module_, program_, field, index)) needed[field] = index;
    }
    for (const std::string& field : spoiled_.add(effects(kernels_, reversed))) filled_.erase(field);
    body.push_back(std::move(reversed));
    for (const Carry& carry : repeat.carries) bars_.erase(carry.result);
    for (const auto& [field, bar] : given) add_inside(field, access(bar));
    refused.merge(block.refused);
    const bool is_good = passes.check(stacks_, sink_) && check_overwritten(module_, pass, block.needed, sink_);
    has_failed = has_failed || block.has_failed || !is_good;
  }

  /// Adds a value, known in the interior, to a bar.
  void add_inside(const std::string& field, const Expr& value) {
    const bool is_new = !bars_.contains(field);
    Kernel kernel = kernel_called("_adjoint_reduce");
    kernel.stores.push_back(
        {names_.of(field), !is_new, is_new && reach_ > 0 ? select(inside({}, 0), value, 0.0) : value, {}});
    run(std::move(kernel), is_new ? reach_ : 0);
    bars_.try_emplace(field, Bar{reach_}).first->second.is_around = false;
  }

  void reverse_run(const Run& primal, int index) {
    const Kernel& kernel = *module_.find_kernel(primal.kernel);
    const RunContext context{program_.axes, primal.grow, std::max(reach_, primal.grow),
                             [&](const std::string& field) { return seed(field, primal.grow); },
                             [&](const std::string& field) { return bars_.contains(field); }};
    KernelAdjoint derived = adjoint_of(kernel, varied_, context, names_);
    note_needs(derived.shared, index);
    note_needs(derived.gather, index, derived.stored);
    note_needs(derived.scatter, index);
    for (const Store& store : kernel.stores) {
      if (!store.accumulate) consumed_.push_back(store.field);
    }
    for (const Kernel* part : {&derived.shared, &derived.gather}) check_halos(kernel, *part, primal.grow);
    if (!derived.shared.stores.empty()) run(std::move(derived.shared), derived.shared_grow);
    const std::set<std::string> gathered_around = read_around(derived.gather, program_.axes);
    for (const std::string& field : derived.stored) {
      if (gathered_around.contains(field)) body.push_back(Fill{field, seed_boundary(program_.axes)});
    }
    if (!derived.gather.stores.empty() || !derived.gather.sums.empty())
      run(std::move(derived.gather), context.target_grow);
    if (!derived.scatter.scatters.empty()) run(std::move(derived.scatter), primal.grow);
    const std::map<std::string, int> extents = extents_of(kernel, primal.grow, program_.axes);
    for (const std::string& field : derived.contributed) contribute(kernel, field, extents, context.target_grow);
    for (const std::string& field : consumed_) bars_.erase(field);
    consumed_.clear();
  }

  /// What is added to beyond the region where a bar holds values is lost.
  void contribute(const Kernel& kernel, const std::string& field, const std::map<std::string, int>& extents,
                  int target_grow) {
    Bar& bar = bars_.try_emplace(field, Bar{target_grow}).first->second;
    const auto extent = extents.find(field);
    bar = {std::min(bar.grow, target_grow), false, std::max(bar.extent, extent == extents.end() ? 0 : extent->second)};
    if (bar.extent > bar.grow)
      refused.emplace(kernel.name, "reading " + field + " beyond walls before it is added to or folded");
  }

  /// A fill around periodic axes leaves nothing of what a bar holds beyond bounded ones, and there the transpose of a
  /// scatter needs values.
  void check_halos(const Kernel& primal, const Kernel& gather, int grow) {
    if (!has_bounded_axis(program_.axes)) return;
    const std::set<std::string> around = read_around(gather, program_.axes);
    for (const auto& [field, bar] : bars_) {
      if (bar.is_around || bar.grow == 0 || !around.contains(names_.of(field))) continue;
      const bool is_consumed = std::find(consumed_.begin(), consumed_.end(), field) != consumed_.end();
      const bool is_target = std::any_of(primal.scatters.begin(), primal.scatters.end(),
                                         [&](const Scatter& scatter) { return scatter.target.field == field; });
      if (grow == 0 && (bar.extent == 0 || (is_consumed && !is_target))) continue;
      refused.emplace(primal.name,
                      "reading neighbours around a periodic axis for " + field + ", which is read beyond walls");
    }
    for (const Scatter& scatter : primal.scatters) {
      const auto bar = bars_.find(scatter.target.field);
      if (bar == bars_.end() || bar->second.grow >= reach_of(scatter.target, program_.axes)) continue;
      refused.emplace(primal.name, "interp(" + bar->first + ") += before it is read around a periodic axis or folded");
    }
    for (const Signature::Read& read : signature(gather).reads) {
      const bool is_grown = grown_.contains(read.field) && !filled_.contains(read.field);
      if (!is_grown || !around.contains(read.field)) continue;
      refused.emplace(primal.name,
                      "reading " + read.field + ", computed beyond walls and not filled, beside a periodic axis");
    }
  }

  std::optional<Expr> seed(const std::string& field, int grow) const {
    const auto bar = bars_.find(field);
    if (bar == bars_.end()) return std::nullopt;
    const Expr value = access(names_.of(field));
    const bool reaches = bar->second.grow >= grow || !has_bounded_axis(program_.axes);
    return reaches ? value : select(inside({}, bar->second.grow), value, 0.0);
  }

  /// Appends a run, after the periodic fills of what it reads at offsets: bars, and primal fields that the primal
  /// itself reads at the centre only.
  void run(Kernel kernel, int grow) {
    const std::set<std::string> around = read_around(kernel, program_.axes);
    for (const auto& read : signature(kernel).reads) {
      restore(read.field);
      if (!needed.contains(read.field) || is_coordinate(read.field) || !around.contains(read.field)) continue;
      if (filled_.insert(read.field).second)
        body.push_back(Fill{read.field, primal_boundary(module_, program_, read.field)});
    }
    for (auto& [field, bar] : bars_) {
      if (bar.is_around || !around.contains(names_.of(field))) continue;
      body.push_back(Fill{names_.of(field), seed_boundary(program_.axes)});
      bar = {0, true, 0};
    }
    body.push_back(Run{kernel.name, grow});
    kernels_.kernels.push_back(std::move(kernel));
  }

  void restore(const std::string& field) {
    if (spoiled_.restore(field, statement_, needed, body)) filled_.insert(field);
  }

  /// `own`: fields that one part of a kernel's adjoint leaves to the next.
  void note_needs(const Kernel& kernel, int index, const std::vector<std::string>& own = {}) {
    std::set<std::string> bars(own.begin(), own.end());
    for (const auto& [primal, derived] : names_.all()) bars.insert(derived);
    for (const auto& read : signature(kernel).reads) {
      if (!bars.contains(read.field)) needed[read.field] = index;  // statements come last first
    }
  }

  const Module& module_;
  const Program& program_;
  const Varied& varied_;
  DerivedNames& names_;
  Module& kernels_;
  DiagnosticSink& sink_;
  SpoiledHalos spoiled_;
  int statement_ = 0;  // that is reversed
  const int reach_;
  std::map<std::string, Bar> bars_;                // primal field -> its bar, where it holds values
  std::set<std::string> filled_;                   // primal fields whose halo is filled
  std::set<std::string> grown_;                    // primal fields computed beyond the interior
  std::map<std::string, std::string> seed_names_;  // of the fields that copy_seeds_read_inside renamed
  std::vector<std::string> consumed_;
  std::set<std::string> stacks_;  // of the primal, that have bars
};

/// With the formulas that are given believed.
Derivative reverse(const Module& module, const std::string& name, const Activity& wrt, DiagnosticSink& sink) {
  const Program* program = module.find_program(name);
  require(program != nullptr, "adjoint of a program that is not in the module");
  const Varied varied = find_varied(module, *program, wrt);
  if (!check_differentiable(module, *program, varied, sink) || !check_folds(module, *program, varied, sink)) return {};

  DerivedNames names(module, "_bar");
  Derivative result{{}, names.fresh_program(name + "_adjoint"), {}, true};
  Module reverse_kernels;
  Reversal reversal(module, *program, varied, names, reverse_kernels, sink);
  reversal.reverse_all();
  std::set<std::string> inputs = wrt.fields;
  for (const Swap& swap : program->swaps) {
    if (varied.fields.contains(swap.state)) inputs.insert(swap.state);
  }
  reversal.finish(inputs);
  reversal.restore_seed_names();
  for (const auto& [kernel, what] : reversal.refused) {
    sink.report("no-useful-derivative", place_of(module, kernel),
                {what, "in kernel " + as_written(module, *program, kernel)},
                "store what is read in a field that is filled, and read that one without grow");
  }
  if (!check_overwritten(module, *program, reversal.needed, sink)) return {};
  if (!reversal.refused.empty() || reversal.has_failed) return {};

  Program derived{result.program, program->axes, reversal.statements(result.module), {}, {}};
  for (Kernel& kernel : reverse_kernels.kernels) {
    if (!result.module.find_kernel(kernel.name)) result.module.kernels.push_back(std::move(kernel));
  }
  add_results(*program, varied, wrt, names, derived);
  for (const std::string& network : parts_of({derived}).networks)
    add_networks(result.module, {*module.find_network(network)});
  result.module.programs.push_back(std::move(derived));
  for (const std::string& p : wrt.params) names.of(p);
  result.links = names.links(module, *program, wrt);
  return result;
}

}  // namespace

Derivative adjoint(const Module& module, const std::string& name, const Activity& wrt, DiagnosticSink& sink,
                   const Surroundings& surroundings) {
  const Program* program = module.find_program(name);
  require(program != nullptr, "adjoint of a program that is not in the module");
  if (!check_given(module, *program, find_varied(module, *program, wrt), reverse, surroundings, sink)) return {};
  return reverse(module, name, wrt, sink);
}

}  // namespace dpde::adjoint
