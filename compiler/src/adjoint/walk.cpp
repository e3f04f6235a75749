// SPDX-License-Identifier: Apache-2.0
#include "adjoint/walk.h"

#include <algorithm>
#include <map>
#include <utility>

#include "adjoint/check/guards.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

/// Most operations of a let that is expanded where a guard must apply to its reads.
constexpr int short_let = 8;

/// Number of varying leaves: the size of an expression once its uniform factors are combined.
int point_values(const Expr& e) {
  int count = 0;
  visit(e, [&](const Expr& part) { count += is<Access, Local, Interp>(part); });
  return count;
}

bool is_leaf(const Expr& e) {
  return !any_child(e, [](const Expr&) { return true; });
}

int operations(const Expr& e) {
  int count = 0;
  visit(e, [&](const Expr& part) { count += is_leaf(part) ? 0 : 1; });
  return count;
}

class Walk {
 public:
  Walk(const Kernel& kernel, const Varied& varied, const RunContext& run, DerivedNames& names)
      : kernel_(kernel), varied_{varied.fields, varied.params, varied_locals(kernel, varied)}, names_(names) {
    terms_.lets = kernel.lets;
    for (const Let& let : kernel.lets) values_.emplace(let.name, let.value);
    push_results(run);
    for (auto let = kernel.lets.rbegin(); let != kernel.lets.rend(); ++let) push_let(*let);
    for (const auto& [field, by_offset] : reads_) {
      ReadBars& read = terms_.reads.emplace_back(ReadBars{field, {}});
      for (const auto& [k, bars] : by_offset) read.by_offset.emplace(k, sum_of(bars));
    }
    for (const auto& [name, bars] : params_) terms_.params.emplace_back(name, sum_of(bars));
  }

  WalkedBack take() { return {std::move(terms_), std::move(scatters_)}; }

 private:
  void push_results(const RunContext& run) {
    for (const Store& store : kernel_.stores) {
      if (!varied_.fields.contains(store.field)) continue;
      if (const auto seed = run.seed(store.field)) push(store.value, *seed, {});
    }
    for (const Sum& sum : kernel_.sums) push(sum.value, param(names_.of(sum.name)), {});
    for (const Scatter& scatter : kernel_.scatters) push_scatter(scatter, run);
  }

  /// Transpose of field(at d) += value: value_bar = field_bar(at d) and d_bar = value * slope of field_bar at d.
  void push_scatter(const Scatter& scatter, const RunContext& run) {
    if (!varied_.fields.contains(scatter.target.field) || !run.seed(scatter.target.field)) return;
    Interp seed = scatter.target;
    seed.field = names_.of(seed.field);
    push(scatter.value, interp(seed), {});
    push_displacements(seed, scatter.value, {});
  }

  void push_displacements(const Interp& i, const Expr& x, const Guards& guards) {
    for (size_t axis = 0; axis < i.displacement.size(); ++axis) {
      const std::optional<InterpolationBasis> derivative = derivative_of(i.along[axis]);
      if (!derivative || !is_varied(i.displacement[axis], varied_)) continue;
      Interp slope = i;
      slope.along[axis] = *derivative;
      push(i.displacement[axis], x * interp(slope), guards);
    }
  }

  void push_let(const Let& let) {
    const auto found = local_bars_.find(let.name);
    if (found == local_bars_.end()) return;
    const auto [guards, bar] = joined(found->second, let.name);
    push(let.value, is_leaf(bar) ? bar : named(bar, let.name + "_bar"), guards);
  }

  /// Combines the contributions of all uses of a let into one adjoint under one guard, which holds where any use is
  /// active. Separate walks for each set of guards would double with each level of nested selections.
  GuardedBar joined(std::vector<GuardedBar> bars, const std::string& name) {
    if (bars.size() == 1) return bars.front();
    Guards common = bars.front().guards;
    for (const GuardedBar& each : bars) {
      const auto differs = std::ranges::mismatch(common, each.guards).in1;
      common.erase(differs, common.end());
    }
    for (GuardedBar& each : bars) each.guards.erase(each.guards.begin(), each.guards.begin() + std::ssize(common));
    for (const Guard& guard : guards_of(any_of(bars), name)) common.push_back(guard);
    return {std::move(common), sum_of(bars)};
  }

  /// Guards under which `live`, which is 1 or 0, is 1. A selection between 0 and a value is itself a guard.
  Guards guards_of(Expr live, const std::string& name) {
    Guards guards;
    while (const Select* s = as<Select>(live)) {
      if (!is_literal(s->yes, 0) && !is_literal(s->no, 0)) break;
      const bool yes = is_literal(s->no, 0);
      guards.push_back({s->condition, yes});
      live = Expr(yes ? s->yes : s->no);
    }
    if (is_literal(live, 1)) return guards;
    auto known = std::ranges::find(lives_, live, &Let::value);
    if (known == lives_.end()) {
      const Expr own = named(live, name + "_live");
      known = lives_.insert(lives_.end(), {std::get<Local>(own->kind).name, live});
    }
    guards.push_back({binary(BinaryOp::greater, local(known->name), 0.0), true});
    return guards;
  }

  /// Adds a let for `e`.
  Expr named(const Expr& e, const std::string& wish) {
    const std::string name = names_.fresh(wish);
    terms_.lets.push_back({name, e});
    return local(name);
  }

  void push(const Expr& e, const Expr& x, const Guards& guards) {
    if (is_literal(x, 0) || !is_varied(e, varied_)) return;
    match(
        e->kind,  //
        ignored<Literal, Inside>, [&](const Param& p) { add(bars_of(params_, p.name), x, guards); },
        [&](const Local& l) { push_local(l, x, guards); },
        [&](const Access& a) { add(bars_of(reads_, a.field)[a.offset], x, guards); },
        [&](const Interp& i) {
          if (varied_.fields.contains(i.field)) scatters_.push_back({guarded(i, guards), guarded(x, guards)});
          push_displacements(i, x, guards);
        },
        [&](const OneOf<Neg, Binary, Call> auto&) { push_parts(e, x, guards); },
        [&](const Select& s) {
          Guards inner = guards;
          inner.push_back({s.condition, true});
          push(s.yes, x, inner);
          inner.back().yes = false;
          push(s.no, x, inner);
        });
  }

  /// Adds a use of a let, which is walked once for all its uses, with a joint guard. A short let of fields is instead
  /// expanded at each guarded use: that needs fewer reads.
  void push_local(const Local& l, const Expr& x, const Guards& guards) {
    const Expr& value = values_.at(l.name);
    if (!guards.empty() && !holds_any<Local>(value) && operations(value) <= short_let) return push(value, x, guards);
    add(local_bars_[l.name], x, guards);
  }

  static void add(std::vector<GuardedBar>& bars, const Expr& x, const Guards& guards) {
    const auto known = std::ranges::find(bars, guards, &GuardedBar::guards);
    if (known == bars.end()) {
      bars.push_back({guards, x});
    } else {
      known->bar = known->bar + x;
    }
  }

  /// The entry of `name`, in order of first appearance.
  template <class Bars>
  static Bars& bars_of(std::vector<std::pair<std::string, Bars>>& all, const std::string& name) {
    for (auto& [known, bars] : all) {
      if (known == name) return bars;
    }
    return all.emplace_back(name, Bars{}).second;
  }

  void push_parts(const Expr& e, const Expr& x, const Guards& guards) {
    int varied_children = 0;
    for_each_child(e, [&](const Expr& child) { varied_children += is_varied(child, varied_) ? 1 : 0; });
    const bool is_shared = varied_children > 1 && guards.empty() && point_values(x) > 2;
    const Expr bar = is_shared ? named(x, "bar") : x;
    int index = 0;
    for_each_child(e, [&](const Expr& child) {
      if (is_varied(child, varied_)) push(child, times_partial(e, index, bar), guards);
      ++index;
    });
  }

  PointTerms terms_;
  std::vector<Scatter> scatters_;
  const Kernel& kernel_;
  const Varied varied_;
  DerivedNames& names_;
  std::map<std::string, Expr> values_;                         // lets of the primal
  std::map<std::string, std::vector<GuardedBar>> local_bars_;  // local -> contributions of its uses, by guards
  std::vector<std::pair<std::string, std::map<Offset, std::vector<GuardedBar>>>> reads_;
  std::vector<std::pair<std::string, std::vector<GuardedBar>>> params_;
  std::vector<Let> lives_;  // joint guards of lets with several uses
};

}  // namespace

WalkedBack walk_back(const Kernel& kernel, const Varied& varied, const RunContext& run, DerivedNames& names) {
  return Walk(kernel, varied, run, names).take();
}

}  // namespace dpde::adjoint
