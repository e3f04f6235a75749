// SPDX-License-Identifier: Apache-2.0
#include "loop/overwrites.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>

#include "loop/expressions.h"
#include "support/contains.h"
#include "support/match.h"
#include "support/names/name_supply.h"

namespace dpde::loop {

namespace {

/// The sweeps of a program that consists of sweeps, fills and folds only; else none. After an operation that may fail,
/// such as a solve, the state must still be available.
std::vector<const Sweep*> sweeps_of(const Program& program) {
  std::vector<const Sweep*> sweeps;
  for (const Operation& operation : program.body) {
    if (!is_one_of<Fill, Fold, Sweep>(operation)) return {};
    match_some(operation, [&](const Sweep& sweep) { sweeps.push_back(&sweep); });
  }
  return sweeps;
}

bool is_in(const Fill& fill, const std::string& field) {
  return fill.field == field || std::any_of(fill.axes.begin(), fill.axes.end(), [&](const AxisBoundary& axis) {
           return axis.low.field == field || axis.high.field == field;
         });
}

/// Whether the field is filled or used by a fill: then more of its memory is needed than the cells of the current row.
bool is_filled(const Program& program, const std::string& field) {
  const auto is_its = [&](const Fill& fill) { return is_in(fill, field); };
  bool found = std::any_of(program.prepare.begin(), program.prepare.end(), is_its);
  for (const Operation& operation : program.body) {
    match(
        operation, [&](const Fill& fill) { found = found || is_its(fill); },
        [&](const Fold& fold) { found = found || fold.field == field; },
        [&](const Sweep& sweep) { found = found || std::any_of(sweep.then.begin(), sweep.then.end(), is_its); },
        ignored<Reduce, NetworkCall, Transform, Solve, Repeat>);
  }
  return found;
}

/// Whether no other swap or result uses the memory of the two fields.
bool is_alone(const Program& program, const Swap& swap) {
  const auto mentions = [](const Swap& other, const std::string& field) {
    return other.state == field || other.next == field;
  };
  const auto inputs_end = program.fields.begin() + program.input_count;
  return std::find(program.fields.begin(), inputs_end, swap.next) == inputs_end &&
         std::find(program.fields.begin(), inputs_end, swap.state) != inputs_end &&
         !contains(program.keeps, swap.state) && !contains(program.keeps, swap.next) &&
         std::all_of(program.swaps.begin(), program.swaps.end(), [&](const Swap& other) {
           return other == swap || (!mentions(other, swap.state) && !mentions(other, swap.next));
         });
}

class Overwrites {
 public:
  explicit Overwrites(Module module) : module_(std::move(module)) {}

  Module run() {
    for (Program& program : module_.programs) {
      const std::vector<const Sweep*> sweeps = sweeps_of(program);
      for (Swap& swap : program.swaps) swap.is_over = !sweeps.empty() && marks(program, sweeps, swap);
    }
    return std::move(module_);
  }

 private:
  Row& row_of(const Sweep& sweep) {
    return *std::find_if(module_.rows.begin(), module_.rows.end(),
                         [&](const Row& row) { return row.name == sweep.row; });
  }
  bool touches(const Sweep& sweep, const std::string& field) {
    const Row& row = row_of(sweep);
    const auto is_it = [&](const std::string& name) { return sweep.binding.field(name) == field; };
    return std::any_of(row.grids.begin(), row.grids.end(), is_it) ||
           std::any_of(row.streams.begin(), row.streams.end(), [&](const Stream& s) { return is_it(s.field); });
  }

  /// Marks the swap if possible: sweeps before the one that writes `next` may read the state anywhere, that one only at
  /// its own cell, and later sweeps not at all.
  bool marks(const Program& program, const std::vector<const Sweep*>& sweeps, const Swap& swap) {
    if (!is_alone(program, swap) || is_filled(program, swap.state) || is_filled(program, swap.next)) return false;
    const auto writer =
        std::find_if(sweeps.begin(), sweeps.end(), [&](const Sweep* sweep) { return touches(*sweep, swap.next); });
    if (writer == sweeps.end() || (*writer)->grow > 0) return false;
    if (std::any_of(writer + 1, sweeps.end(), [&](const Sweep* sweep) { return touches(*sweep, swap.state); }))
      return false;
    return mark(row_of(**writer), (*writer)->binding, swap);
  }

  static bool mark(Row& row, const Binding& binding, const Swap& swap) {
    int written = -1, read = -1;
    for (std::size_t s = 0; s < row.streams.size(); ++s) {
      const Stream& stream = row.streams[s];
      const std::string& field = binding.field(stream.field);
      if (field == swap.next && stream.mode == Stream::Mode::out) written = static_cast<int>(s);
      if (field != swap.state) continue;
      if (stream.mode != Stream::Mode::in || stream.offset != Offset{} || read >= 0) return false;
      read = static_cast<int>(s);
    }
    const auto is_state = [&](const std::string& grid) { return binding.field(grid) == swap.state; };
    if (written < 0 || std::any_of(row.grids.begin(), row.grids.end(), is_state)) return false;
    const int known = row.streams[written].over;
    if (known >= 0 && known != read) return false;
    if (read >= 0 && known < 0) let_over(row, written, read);
    return true;
  }

  /// Allows `written` to share memory with `read`. Stores of a cell run in sequence, and all must use the old values.
  static void let_over(Row& row, int written, int read) {
    row.streams[written].over = read;
    std::vector<std::string> known;
    for (const Let& let : row.lets) known.push_back(let.name);
    for (const Stream& stream : row.streams) known.push_back(stream.field);
    NameSupply names;
    for (const std::string& name : known) names.reserve(name);
    const Expr before = make(Load{read}), let = make(Local{static_cast<int>(row.lets.size())});
    bool is_used = false;
    const std::function<Expr(const Expr&)> replaced = [&](const Expr& e) {
      const bool is_it = e == before;
      is_used = is_used || is_it;
      return is_it ? let : map_children(e, replaced);
    };
    if (row.stores.size() + row.sums.size() < 2) return;
    for (Store& store : row.stores) store.value = replaced(store.value);
    for (Sum& sum : row.sums) sum.value = replaced(sum.value);
    if (is_used) row.lets.push_back({names.fresh(row.streams[read].field + "_before"), before});
  }

  Module module_;
};

}  // namespace

Module find_overwrites(Module module) { return Overwrites(std::move(module)).run(); }

}  // namespace dpde::loop
