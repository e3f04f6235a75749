// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/reversal.h"

#include <algorithm>

#include "adjoint/check/extremes.h"
#include "adjoint/reverse/adjoint_kernel.h"
#include "adjoint/reverse/reversed_passes.h"
#include "adjoint/reverse/transforms.h"
#include "adjoint/reverse/weights.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/passes/place_fills.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

Reversal::Reversal(const Module& module, const Program& program, const Varied& varied, DerivedNames& names,
                   Module& kernels, DiagnosticSink& sink)
    : module_(module),
      program_(program),
      varied_(varied),
      names_(names),
      kernels_(kernels),
      sink_(sink),
      reach_(reach(module, program, varied)),
      fills_(fills_at_the_end(module, program)),
      grown_(grown_fields(module, program)) {
  for (const Swap& swap : program.swaps) add_seed(swap.next);
  for (const std::string& keep : program.keeps) add_seed(keep);
  copy_seeds_read_inside();
}

void Reversal::reverse_all() {
  for (int i = static_cast<int>(program_.body.size()) - 1; i >= 0; --i) reverse(i);
}

void Reversal::reverse(int index) {
  match(
      program_.body[index], [&](const Fill& fill) { reverse_fill(fill, index); },
      [&](const Fold& fold) { reverse_fold(fold); }, [&](const Reduce& reduce) { reverse_reduce(reduce, index); },
      [&](const NetworkCall& call) { reverse_network(call, index); },
      [&](const Transform& transform) { reverse_transform(transform, index); },
      [&](const Run& run) { reverse_run(run, index); }, [&](const Solve& solve) { reverse_solve(solve, index); },
      [&](const Repeat& repeat) { reverse_repeat(repeat, index); });
}

void Reversal::restore_seed_names() {
  for (const auto& [field, seed] : seed_names_) names_.rebind(field, seed);
}

void Reversal::finish(const std::set<std::string>& inputs) {
  Kernel zero = kernel_called("_adjoint_zero");
  for (const std::string& field : inputs) {
    if (!bars_.contains(field)) zero.stores.push_back({names_.of(field), false, 0.0, {}});
  }
  if (!zero.stores.empty()) run(std::move(zero), 0);
}

HaloRule Reversal::rule_of_primal(const std::string& field) const {
  const auto fill = fills_.find(field);
  if (fill != fills_.end()) return rule_of_fill(*fill->second);
  return {Fill{field, boundary_around(program_.axes)}, FillNeed::around};
}

std::vector<Statement> Reversal::statements(Module& kernels) {
  std::set<std::string> fields;
  std::vector<HaloRule> halos;
  for (const auto& [field, first] : needed) {
    fields.insert(field);
    if (!is_coordinate(field)) halos.push_back(rule_of_primal(field));
  }
  halos.insert(halos.end(), halos_.begin(), halos_.end());
  std::vector<Statement> all = recomputation(module_, program_, std::move(fields), saves, kernels);
  const std::size_t recomputed = all.size();
  FillPlacer placer(program_.axes, halos);
  for (const Statement& statement : all) placer.pass(module_, statement);
  for (const Statement& statement : body) placer.add(kernels_, statement, all);
  for_each_kind<Fill>(std::span(all).subspan(recomputed), [&](const Fill& fill) {
    const auto reader = needed.find(fill.field);
    if (reader == needed.end()) return;
    for (const std::string& wall : wall_fields(fill.axes)) {
      int& first = needed.try_emplace(wall, reader->second).first->second;
      first = std::min(first, reader->second);
    }
  });
  return all;
}

Kernel Reversal::kernel_called(const std::string& suffix) {
  return {names_.fresh_kernel(program_.name + suffix), static_cast<int>(program_.axes.size()), {}, {}, {}, {}};
}

void Reversal::add_seed(const std::string& field) {
  if (varied_.fields.contains(field)) bars_[field] = {};
}

void Reversal::copy_seeds_read_inside() {
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

void Reversal::reverse_fill(const Fill& fill, int index) {
  const auto bar = bars_.find(fill.field);
  if (bar == bars_.end() || (bar->second.grow == 0 && !is_on_walls(fill.axes))) return;  // the halo has no adjoint
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

std::vector<std::string> Reversal::separate_values(const Fill& fill, Fold& fold) {
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

void Reversal::reverse_weights(const Fill& fill, const std::vector<std::string>& values, int grow, int extent,
                               int index) {
  Kernel kernel = adjoint_of_weights(fill, values, extent, varied_, names_, bar_of_wall(grow));
  kernel.name = names_.fresh_kernel(program_.name + "_adjoint_walls");
  needed[fill.field] = index;
  run(std::move(kernel), extent);
}

void Reversal::begin_bars(const std::set<std::string>& fields) {
  Kernel zero = kernel_called("_adjoint_begin");
  for (const std::string& field : fields) {
    if (!varied_.fields.contains(field) || !bars_.emplace(field, Bar{reach_, false}).second) continue;
    zero.stores.push_back({names_.of(field), false, 0.0, {}});
  }
  if (!zero.stores.empty()) run(std::move(zero), reach_);
}

DerivedField Reversal::bar_of_wall(int grow) {
  return [this, grow](const std::string& wall) {
    const auto bar = bars_.find(wall);
    return bar != bars_.end() && bar->second.grow >= grow ? std::optional(names_.of(wall)) : std::nullopt;
  };
}

void Reversal::copy_bar(const std::string& field) {
  Kernel copy = kernel_called("_adjoint_copy");
  const std::string bar = names_.of(field), copied = names_.fresh(bar);
  copy.stores.push_back({copied, false, access(bar), {}});
  run(std::move(copy), bars_.at(field).grow);
  names_.rebind(field, copied);
}

void Reversal::reverse_fold(const Fold& fold) {
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
  if (is_on_walls(fold.axes) && is_read_by(kernels_, body, names_.of(fold.field))) copy_bar(fold.field);
  body.push_back(Fill{names_.of(fold.field), derived_sides(fold.axes, bar_of_wall(fold.grow))});
  bar->second = {fold.grow, true, fold.grow};
}

void Reversal::reverse_reduce(const Reduce& reduce, int index) {
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
    value =
        at_extreme(reduce, value / access(add_count_of_ties(reduce, {program_, "_adjoint", names_, kernels_, body})));
  }
  add_inside(reduce.field, value);
}

void Reversal::reverse_network(const NetworkCall& call, int index) {
  const bool is_tangent = call.mode == NetworkCall::Mode::tangent;
  NetworkCall reversed{call.network, is_tangent ? NetworkCall::Mode::second : NetworkCall::Mode::adjoint,
                       call.inputs,  call.rates,
                       {},           varied_.params.contains(call.network)};
  bool has_seed = false;
  for (const std::string& result : call.results) {
    const bool is_seeded = !result.empty() && bars_.erase(result) > 0;
    reversed.rates.push_back(is_seeded ? names_.of(result) : "");
    has_seed = has_seed || is_seeded;
  }
  if (!has_seed) return;
  Contributions to_add;
  for (const std::vector<std::string>* read : {&call.inputs, &call.rates}) {
    for (const std::string& field : *read) {
      reversed.results.push_back("");
      if (varied_.fields.contains(field)) reversed.results.back() = bar_to_write(field, call.network, to_add);
    }
  }
  if (!reversed.weights && fields_written(reversed).empty()) return;
  for (const std::string& field : fields_read(call)) needed[field] = index;
  body.push_back(reversed);
  add_inside(to_add);
}

void Reversal::reverse_transform(const Transform& transform, int index) {
  if (bars_.erase(transform.result) == 0) return;
  const std::string seed = names_.of(transform.result);
  Contributions to_add;
  for (Transform& to_field : transposes_of(transform, seed, varied_)) {
    to_field.result = bar_to_write(to_field.result, "waves", to_add);
    body.push_back(std::move(to_field));
  }
  for (auto& [name, slope] : slopes_of(transform, varied_)) {
    for (const Transform::Term& term : slope.terms) needed[term.field] = index;
    slope.result = names_.fresh(seed + "_by_" + name);
    Kernel sum = kernel_called("_adjoint_waves");
    sum.sums.push_back({names_.of(name), access(seed) * access(slope.result)});
    body.push_back(std::move(slope));
    run(std::move(sum), 0);
  }
  add_inside(to_add);
}

std::string Reversal::bar_to_write(const std::string& field, const std::string& wish, Contributions& to_add) {
  if (reach_ == 0 && bars_.try_emplace(field).second) return names_.of(field);
  to_add.emplace_back(field, names_.fresh(names_.of(field) + "_" + wish));
  return to_add.back().second;
}

void Reversal::add_inside(const Contributions& to_add) {
  for (const auto& [field, contribution] : to_add) add_inside(field, access(contribution));
}

void Reversal::reverse_repeat(const Repeat& repeat, int index) {
  std::set<std::string> results;
  for (const LoopCarried& carry : repeat.carries) {
    if (varied_.fields.contains(carry.next)) results.insert(carry.result);
  }
  const Effects known = effects(module_, repeat);
  const auto has_bar = [&](const std::string& field) { return bars_.contains(field); };
  const auto has_stack = [&](const TapeEntry& save) { return stacks_.contains(save.stack); };
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
    // In the first pass a carried state comes from outside; the stack holds only a reference to it.
    const bool is_carried = std::ranges::find(repeat.carries, field, &LoopCarried::state) != repeat.carries.end();
    if (is_carried && is_updated_behind(module_, program_, field, index)) needed[field] = index;
  }
  body.push_back(std::move(reversed));
  for (const LoopCarried& carry : repeat.carries) bars_.erase(carry.result);
  for (const auto& [field, bar] : given) add_inside(field, access(bar));
  refused.merge(block.refused);
  const bool is_good = passes.check(stacks_, sink_) && check_overwritten(module_, pass, block.needed, sink_);
  has_failed = has_failed || block.has_failed || !is_good;
}

void Reversal::add_inside(const std::string& field, const Expr& value) {
  const bool is_new = !bars_.contains(field);
  Kernel kernel = kernel_called("_adjoint_reduce");
  kernel.stores.push_back(
      {names_.of(field), !is_new, is_new && reach_ > 0 ? select(inside({}, 0), value, 0.0) : value, {}});
  run(std::move(kernel), is_new ? reach_ : 0);
  bars_.try_emplace(field, Bar{reach_}).first->second.is_around = false;
}

}  // namespace dpde::adjoint
