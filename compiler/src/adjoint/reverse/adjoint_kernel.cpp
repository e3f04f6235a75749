// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/adjoint_kernel.h"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <set>
#include <unordered_map>

#include "adjoint/shared_values.h"
#include "adjoint/walk.h"
#include "stencil/lower/custom_adjoint.h"
#include "stencil/passes/passes.h"
#include "stencil/passes/polynomial.h"
#include "stencil/passes/work.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

/// Cost of one more field that passes through memory, in equivalent loads and instructions. Measured: saving 17 of them
/// per field is faster on all grids (waves of order 4 in 3-D), saving 10 only in the caches (order 2 in 3-D, order 4 in
/// 2-D).
constexpr int stream_cost = 12;

/// Operations per point: a field that saves so many is stored without a comparison of costs.
constexpr int plain_gain = 1000;

std::string shift_suffix(const Offset& k, int rank) {
  std::string suffix;
  for (int axis = 0; axis < rank; ++axis) {
    suffix += k[axis] < 0 ? "_m" : k[axis] > 0 ? "_p" : "_";
    suffix += std::to_string(std::abs(k[axis]));
  }
  return suffix;
}

Offset minus(const Offset& k) { return {-k[0], -k[1], -k[2]}; }

/// Collects the lets of a walk at several displacements.
class ShiftedLets {
 public:
  ShiftedLets(const std::vector<Let>& lets, int rank, DerivedNames& names)
      : lets_(lets), rank_(rank), names_(names), used_(lets.size()) {
    for (const Let& let : lets) index_.emplace(let.name, index_.size());
  }

  /// `e` at the point displaced by k, with its lets noted at that displacement.
  Expr at(const Expr& e, const Offset& k) {
    return shift(e, k, [&](const std::string& name) { return use(name, k); });
  }

  /// All noted lets, in an order that defines before use.
  std::vector<Let> definitions() {
    std::vector<Let> result;
    for (std::size_t i = 0; i < lets_.size(); ++i) {
      for (const auto& [k, shifted_name] : used_[i]) result.push_back({shifted_name, at(lets_[i].value, k)});
    }
    return result;
  }

 private:
  std::string use(const std::string& name, const Offset& k) {
    const std::size_t index = index_.at(name);
    const auto found = used_[index].find(k);
    if (found != used_[index].end()) return found->second;
    const std::string shifted = k == Offset{} ? name : names_.fresh(name + shift_suffix(k, rank_));
    used_[index].emplace(k, shifted);
    visit(lets_[index].value, [&](const Expr& e) {
      if (const Local* inner = as<Local>(e)) use(inner->name, k);
    });
    return shifted;
  }

  const std::vector<Let>& lets_;
  const int rank_;
  DerivedNames& names_;
  std::unordered_map<std::string, std::size_t> index_;
  std::vector<std::map<Offset, std::string>> used_;  // the names of each let
};

/// Whether terms of a read at offset k can come from points outside the primal's region.
bool needs_mask(const Offset& k, const RunContext& run) {
  for (size_t axis = 0; axis < run.axes.size(); ++axis) {
    if (run.axes[axis] == Topology::bounded && (k[axis] != 0 || run.grow != run.target_grow)) return true;
  }
  return false;
}

Expr masked(const Expr& e, const Offset& k, const RunContext& run) {
  return needs_mask(k, run) ? select(inside(minus(k), run.grow), e, 0.0) : e;
}

/// A custom adjoint's formula with the seeds of this run. If points around a point may be missing, the terms of each
/// such point are masked separately, like derived terms.
Expr given_value(const Kernel& kernel, const Expr& formula, const Varied& varied, const RunContext& run,
                 DerivedNames& names) {
  const auto is_sum = [&](const std::string& name) {
    return std::ranges::any_of(kernel.sums, [&](const Sum& sum) { return sum.name == name; });
  };
  const std::function<Expr(const Expr&)> with_seeds = [&](const Expr& e) -> Expr {
    const Access* a = as<Access>(e);
    const std::string* stored = a ? seeded_by(kernel, a->field) : nullptr;
    if (!stored) return map_children(e, with_seeds);
    if (is_sum(*stored)) return param(names.of(*stored));
    const auto seed = varied.fields.contains(*stored) ? run.seed(*stored) : std::nullopt;
    return seed ? shift(*seed, a->offset, [](const std::string& name) { return name; }) : Expr(0.0);
  };
  const std::map<Offset, Expr> terms = terms_by_seed(kernel, formula);
  if (std::none_of(terms.begin(), terms.end(), [&](const auto& term) { return needs_mask(term.first, run); }))
    return with_seeds(formula);
  Expr total = 0.0;
  for (const auto& [k, term] : terms) {
    const Expr value = with_seeds(term);
    if (!is_literal(value, 0)) total = total + masked(value, minus(k), run);
  }
  return total;
}

void add_given(const Kernel& kernel, const Varied& varied, const RunContext& run, DerivedNames& names,
               KernelAdjoint& result) {
  for (const CustomAdjoint& given : kernel.custom_adjoints) {
    const bool is_field = varied.fields.contains(given.input);
    if (!is_field && !varied.params.contains(given.input)) continue;
    const Expr value = given_value(kernel, given.value, varied, run, names);
    if (is_literal(value, 0)) continue;
    if (!is_field) {
      result.gather.sums.push_back({names.of(given.input), value});
      continue;
    }
    result.gather.stores.push_back({names.of(given.input), run.is_initialised(given.input), value, given.origin});
    result.contributed.push_back(given.input);
  }
}

/// x_bar[i] = sum over k of (contribution of read k) at i - k.
void add_gathers(const PointTerms& terms, const RunContext& run, DerivedNames& names, ShiftedLets& lets,
                 KernelAdjoint& result) {
  for (const ReadBars& read : terms.reads) {
    Expr total = 0.0;
    for (auto term = read.by_offset.rbegin(); term != read.by_offset.rend(); ++term) {
      total = total + masked(lets.at(term->second, minus(term->first)), term->first, run);
    }
    result.gather.stores.push_back({names.of(read.field), run.is_initialised(read.field), total, {}});
    result.contributed.push_back(read.field);
  }
  for (const auto& [name, value] : terms.params) {
    result.gather.sums.push_back({names.of(name), masked(lets.at(value, {}), {}, run)});
  }
}

void add_scatters(const Kernel& kernel, const WalkedBack& walk, const RunContext& run, DerivedNames& names,
                  KernelAdjoint& result) {
  for (const Scatter& scatter : walk.scatters) {
    const std::string field = scatter.target.field;
    if (find_custom_adjoint(kernel, field)) continue;
    auto& known = result.contributed;
    if (std::find(known.begin(), known.end(), field) == known.end()) {
      known.push_back(field);
      if (!run.is_initialised(field)) result.gather.stores.push_back({names.of(field), false, 0.0, {}});
    }
    Scatter moved = scatter;
    moved.target.field = names.of(field);
    result.scatter.scatters.push_back(std::move(moved));
  }
}

/// The adjoint of one kernel without its scatters.
class Gathering {
 public:
  Gathering(const Kernel& kernel, PointTerms terms, const Varied& varied, const RunContext& run)
      : kernel_(kernel), terms_(std::move(terms)), varied_(varied), run_(run) {
    std::erase_if(terms_.reads, [&](const ReadBars& read) { return find_custom_adjoint(kernel, read.field); });
    std::erase_if(terms_.params, [&](const auto& term) { return find_custom_adjoint(kernel, term.first); });
  }

  /// One kernel, or two if it pays that the first one stores values which many terms of the other need. Kernels are
  /// written out to compare costs only in doubtful cases: a value repeated for all points of a wide stencil has
  /// millions of nodes.
  KernelAdjoint cheapest(DerivedNames& names) const {
    if (!fills_keep_what_is_stored()) return in_one_kernel(names);
    constexpr int least = 2 * stream_cost;
    SharedValues values(terms_);
    DerivedNames taken = names;  // with the names of the stored fields
    auto further = values.best(least);
    for (; further && further->operations_saved >= plain_gain; further = values.best(least))
      values.store(*further, taken.fresh("shared_bar"));
    KernelAdjoint best = written(values, names = taken);
    for (int least_cost = further ? cost(best) : 0; further; further = values.best(least)) {
      values.store(*further, taken.fresh("shared_bar"));
      DerivedNames own = taken;
      KernelAdjoint candidate = written(values, own);
      const int its_cost = cost(candidate);
      if (its_cost >= least_cost) return best;
      best = std::move(candidate);
      least_cost = its_cost;
      names = std::move(own);
    }
    return best;
  }

 private:
  KernelAdjoint written(const SharedValues& values, DerivedNames& names) const {
    return values.stored().empty() ? in_one_kernel(names) : in_two_kernels(values.terms(), values.stored(), names);
  }

  /// Whether fills keep stored values: a fill along a periodic axis overwrites a field's values beyond bounded axes.
  bool fills_keep_what_is_stored() const {
    if (run_.grow == 0 || std::ranges::count(run_.axes, Topology::bounded) == 0) return true;
    return std::ranges::all_of(terms_.reads, [&](const ReadBars& read) {
      return std::ranges::all_of(read.by_offset, [&](const auto& term) {
        for (size_t axis = 0; axis < run_.axes.size(); ++axis) {
          if (run_.axes[axis] == Topology::periodic && term.first[axis] != 0) return false;
        }
        return true;
      });
    });
  }

  /// The gather with all lets.
  KernelAdjoint gathered(const PointTerms& terms, DerivedNames& names) const {
    KernelAdjoint result;
    result.gather.name = names.fresh_kernel(kernel_.name + "_adjoint");
    result.gather.rank = result.shared.rank = result.scatter.rank = kernel_.rank;
    ShiftedLets lets(terms.lets, kernel_.rank, names);
    add_given(kernel_, varied_, run_, names, result);
    add_gathers(terms, run_, names, lets, result);
    result.gather.lets = lets.definitions();
    return result;
  }

  KernelAdjoint in_one_kernel(DerivedNames& names) const {
    KernelAdjoint result = gathered(terms_, names);
    result.gather = with_lets_inlined(result.gather);
    return result;
  }

  /// The first kernel stores the values of `stored`. With periodic axes it runs only as far out as the primal, since
  /// filled fields are not known farther out. If it runs as far as the second kernel, it also takes over the second
  /// kernel's stores and sums that do not read stored values.
  KernelAdjoint in_two_kernels(const PointTerms& terms, const std::vector<Let>& stored, DerivedNames& names) const {
    KernelAdjoint result = gathered(terms, names);
    Kernel& first = result.shared;
    first.name = names.fresh_kernel(kernel_.name + "_adjoint_shared");
    first.lets = terms_.lets;
    result.shared_grow = std::ranges::count(run_.axes, Topology::periodic) > 0 ? run_.grow : run_.target_grow;
    for (const Let& let : stored) {
      first.stores.push_back(
          {let.name, false, result.shared_grow == run_.grow ? let.value : masked(let.value, {}, run_), {}});
      result.stored.push_back(let.name);
    }
    if (result.shared_grow == run_.target_grow) move_what_reads_none(names_of(stored), result.gather, first);
    first = with_lets_inlined(first);
    result.gather = with_lets_inlined(result.gather);
    return result;
  }

  /// Moves stores and sums that read none of these fields from `from` to `to`.
  static void move_what_reads_none(std::set<std::string> names, Kernel& from, Kernel& to) {
    for (const Let& let : from.lets) {
      if (std::ranges::find(to.lets, let.name, &Let::name) == to.lets.end()) to.lets.push_back(let);
      if (reads(let.value, names)) names.insert(let.name);
    }
    const auto reads_none = [&](const auto& statement) { return !reads(statement.value, names); };
    std::ranges::copy_if(from.stores, std::back_inserter(to.stores), reads_none);
    std::ranges::copy_if(from.sums, std::back_inserter(to.sums), reads_none);
    std::erase_if(from.stores, reads_none);
    std::erase_if(from.sums, reads_none);
  }

  static std::set<std::string> names_of(const std::vector<Let>& lets) {
    std::set<std::string> names;
    for (const Let& let : lets) names.insert(let.name);
    return names;
  }

  /// True if `e` reads one of these fields or locals.
  static bool reads(const Expr& e, const std::set<std::string>& names) {
    return any_part(e, [&](const Expr& part) {
      const Access* a = as<Access>(part);
      const Local* l = as<Local>(part);
      return (a && names.contains(a->field)) || (l && names.contains(l->name));
    });
  }

  static int cost(const KernelAdjoint& adjoint) {
    int total = 0;
    for (const Kernel& kernel :
         eliminate_common_subexpressions(simplify({{adjoint.shared, adjoint.gather}, {}, {}})).kernels) {
      total += loads(kernel) + instructions(kernel) + stream_cost * streams(kernel);
    }
    return total;
  }

  const Kernel& kernel_;
  PointTerms terms_;
  const Varied& varied_;
  const RunContext& run_;
};

}  // namespace

KernelAdjoint adjoint_of(const Kernel& kernel, const Varied& varied, const RunContext& run, DerivedNames& names) {
  const WalkedBack walk = walk_back(kernel, varied, run, names);
  KernelAdjoint result = Gathering(kernel, walk.terms, varied, run).cheapest(names);
  add_scatters(kernel, walk, run, names, result);
  if (!result.scatter.scatters.empty()) {
    result.scatter.name = names.fresh_kernel(kernel.name + "_adjoint_scatter");
    result.scatter.lets = walk.terms.lets;
    result.scatter = with_lets_inlined(result.scatter);
  }
  return result;
}

}  // namespace dpde::adjoint
