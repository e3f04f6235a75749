// SPDX-License-Identifier: Apache-2.0
#include "stencil/passes/displaced_values.h"

#include <algorithm>
#include <array>
#include <bit>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "stencil/build.h"
#include "stencil/passes/passes.h"
#include "stencil/space/comparisons.h"
#include "stencil/walk.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/names/name_supply.h"

namespace dpde::stencil {

namespace {

/// Cost of one more field that passes through memory, in loads and operations: see adjoint/reverse/adjoint_kernel.cpp.
constexpr int stream_cost = 12;

/// A field that saves less than 1/least_part of a point's cost is not worth its memory.
constexpr int least_part = 32;

Offset plus(const Offset& a, const Offset& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Offset minus(const Offset& a, const Offset& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

/// A value up to displacement: displaced values have the same form.
struct Form {
  struct Part {
    int form;
    Offset from;  // offset from the first read of the form to that of the part
  };
  std::vector<Part> parts;
  bool moves = false;      // it reads a field
  bool is_leaf = false;    // nothing is computed
  bool is_stored = false;  // in a field
  bool is_fit = true;      // may be stored: not a truth value, and no decision in it
  bool is_decision = false;
  std::string field;     // of a read
  Offset low{}, high{};  // bounds of all its reads, relative to the first one
};

/// A form at a point.
struct Placed {
  int form = 0;
  Offset at{};
  auto operator<=>(const Placed&) const = default;
};

/// The forms of a kernel's values, with lets substituted.
class Forms {
 public:
  explicit Forms(const std::vector<Topology>& axes) {
    const bool are_alike = std::ranges::count(axes, axes.front()) == std::ssize(axes);
    for (std::size_t axis = 0; axis < axes.size(); ++axis)
      shifts_[axis] = are_alike || axes[axis] == Topology::periodic;
  }

  Form& operator[](int form) { return forms_[static_cast<std::size_t>(form)]; }
  const Form& operator[](int form) const { return forms_[static_cast<std::size_t>(form)]; }
  int size() const { return static_cast<int>(forms_.size()); }

  void define(const Let& let) { lets_[let.name] = placed(let.value); }

  /// Excludes operands of decisions, which stay as written. Parts have smaller numbers than their wholes.
  void keep_what_decides() {
    std::vector<bool> decides(forms_.size());
    for (int form = size() - 1; form >= 0; --form) {
      if (!decides[form] && !(*this)[form].is_decision) continue;
      (*this)[form].is_fit = false;
      for (const Form::Part& part : (*this)[form].parts) decides[part.form] = true;
    }
  }

  const Placed& placed(const Expr& e) {
    const auto known = by_node_.find(&e.node());
    if (known != by_node_.end()) return known->second;
    kept_.push_back(e);
    const Placed found = find(e);
    return by_node_.emplace(&e.node(), found).first->second;
  }

  /// Centre of a form's reads, relative to its first read.
  Offset middle(int form) const {
    const Form& of = (*this)[form];
    Offset middle{};
    for (std::size_t axis = 0; axis < max_rank; ++axis) {
      const int sum = of.low[axis] + of.high[axis];
      if (shifts_[axis]) middle[axis] = (sum - (sum < 0)) / 2;
    }
    return middle;
  }

 private:
  using Key = std::vector<std::int64_t>;

  std::int64_t number_of(const std::string& name) {
    return names_.emplace(name, static_cast<std::int64_t>(names_.size())).first->second;
  }

  /// Splits an offset into its part along axes whose displacements are shared, and the rest, which belongs to the form.
  std::pair<Offset, Offset> split(const Offset& offset) const {
    Offset at{}, own{};
    for (std::size_t axis = 0; axis < max_rank; ++axis) (shifts_[axis] ? at : own)[axis] = offset[axis];
    return {at, own};
  }

  Placed find(const Expr& e) {
    if (const Local* local = as<Local>(e)) return lets_.at(local->name);
    Key key{static_cast<std::int64_t>(e->kind.index())};
    Form form;
    std::optional<Offset> at;
    describe(e, key, form, at);
    for_each_child(e, [&](const Expr& child) { add_part(placed(child), key, form, at); });
    form.is_decision = is_decision(e);
    form.is_fit = form.is_fit && !form.is_decision && !is_truth(e);
    form.is_leaf = form.parts.empty();
    const auto [known, is_new] = numbers_.emplace(std::move(key), size());
    if (is_new) forms_.push_back(std::move(form));
    return {known->second, at.value_or(Offset{})};
  }

  /// The node without its children.
  void describe(const Expr& e, Key& key, Form& form, std::optional<Offset>& at) {
    const auto say = [&](auto... words) { (key.push_back(static_cast<std::int64_t>(words)), ...); };
    const auto read = [&](const Offset& offset) {
      const auto [place, own] = split(offset);
      at = place;
      form.moves = true;
      say(own[0], own[1], own[2]);
    };
    match(
        e->kind, [&](const Literal& l) { say(std::bit_cast<std::int64_t>(l.value)); },
        [&](const Param& p) { say(number_of(p.name)); }, ignored<Local, Neg, Select>,
        [&](const Access& a) {
          say(number_of(a.field));
          form.field = a.field;
          read(a.offset);
        },
        [&](const Interp& i) {
          say(number_of(i.field), i.along[0], i.along[1], i.along[2]);
          form.is_fit = false;
          read(i.offset);
        },
        [&](const Inside& i) {
          say(i.grow);
          form.is_fit = false;
          read(i.offset);
        },
        [&](const Binary& b) { say(b.op); }, [&](const Call& c) { say(c.fn); });
  }

  void add_part(const Placed& part, Key& key, Form& form, std::optional<Offset>& at) {
    const Form& of = (*this)[part.form];
    if (of.moves && !at) at = part.at;
    const Offset from = of.moves ? minus(part.at, *at) : Offset{};
    for (const std::int64_t word :
         {std::int64_t{part.form}, std::int64_t{from[0]}, std::int64_t{from[1]}, std::int64_t{from[2]}})
      key.push_back(word);
    form.parts.push_back({part.form, from});
    form.moves = form.moves || of.moves;
    form.is_fit = form.is_fit && of.is_fit;
    for (std::size_t axis = 0; of.moves && axis < max_rank; ++axis) {
      form.low[axis] = std::min(form.low[axis], from[axis] + of.low[axis]);
      form.high[axis] = std::max(form.high[axis], from[axis] + of.high[axis]);
    }
  }

  std::array<bool, max_rank> shifts_{};
  std::vector<Form> forms_;
  std::map<Key, int> numbers_;
  std::map<std::string, std::int64_t> names_;
  std::map<std::string, Placed> lets_;
  std::unordered_map<const Node*, Placed> by_node_;
  std::vector<Expr> kept_;  // keeps the nodes of by_node_ alive
};

/// Chooses the forms to store.
class Choice {
 public:
  Choice(Forms& forms, const std::vector<Placed>& roots) : forms_(forms) {
    for (const Placed& root : roots) roots_.push_back(node_of(root));
  }

  /// The forms to store; none if storing does not halve the cost.
  std::vector<int> made() {
    const int whole = cost();
    int now = whole;
    while (const std::optional<int> form = best(now)) stored_.push_back(*form);
    if (2 * now <= whole) return stored_;
    for (const int form : stored_) forms_[form].is_stored = false;
    return {};
  }

 private:
  /// A form at a point, and its parts.
  struct Value {
    Placed placed;
    std::vector<int> parts = {};
    bool is_open = true;  // its parts are not computed yet
    int seen = 0;         // number of the last walk that visited it
  };

  int node_of(const Placed& placed) {
    const auto [known, is_new] = numbers_.emplace(placed, static_cast<int>(values_.size()));
    if (is_new) values_.push_back({placed});
    return known->second;
  }

  const std::vector<int>& parts_of(int value) {
    if (std::exchange(values_[value].is_open, false)) {
      const Placed placed = values_[value].placed;
      std::vector<int> parts;
      for (const Form::Part& part : forms_[placed.form].parts) {
        if (forms_[part.form].moves) parts.push_back(node_of({part.form, plus(placed.at, part.from)}));
      }
      values_[value].parts = std::move(parts);
    }
    return values_[value].parts;
  }

  /// Cost per point of a kernel that computes these values. Adds to `places` the number of points at which each form is
  /// needed.
  int cost_of(std::vector<int> open, std::map<int, int>* places = nullptr) {
    ++walk_;
    std::set<std::string> fields;
    std::set<int> stored;
    int total = 0;
    while (!open.empty()) {
      const int value = open.back();
      open.pop_back();
      if (std::exchange(values_[value].seen, walk_) == walk_) continue;
      const int number = values_[value].placed.form;
      const Form& form = forms_[number];
      if (!form.moves) continue;
      ++total;
      if (places != nullptr) ++(*places)[number];
      if (form.is_stored) {
        stored.insert(number);
        continue;
      }
      if (form.is_leaf) fields.insert(form.field);
      const std::vector<int>& parts = parts_of(value);
      open.insert(open.end(), parts.begin(), parts.end());
    }
    return total + stream_cost * static_cast<int>(fields.size() + stored.size());
  }

  std::vector<int> parts_of_form(int form) { return parts_of(node_of({form, {}})); }

  int cost() {
    int total = cost_of(roots_);
    for (const int form : stored_) total += 1 + stream_cost + cost_of(parts_of_form(form));
    return total;
  }

  /// The form whose storage reduces the cost most; sets `now` to the remaining cost. A form saves at most its own cost
  /// at all points but one.
  std::optional<int> best(int& now) {
    std::map<int, int> places;
    cost_of(roots_, &places);
    for (const int form : stored_) cost_of(parts_of_form(form), &places);
    std::vector<std::pair<int, int>> bounds;  // upper bound of the saving, and the form
    for (const auto& [form, count] : places) {
      const Form& of = forms_[form];
      if (of.is_leaf || of.is_stored || !of.is_fit) continue;
      bounds.emplace_back((count - 1) * cost_of(parts_of_form(form)), form);
    }
    std::ranges::sort(bounds, std::greater());
    std::optional<int> best;
    int most = now / least_part;
    const int before = now;
    for (const auto& [bound, form] : bounds) {
      if (bound < most) break;
      forms_[form].is_stored = true;
      stored_.push_back(form);
      const int saved = before - cost();
      stored_.pop_back();
      forms_[form].is_stored = false;
      if (saved < most || (saved == most && best)) continue;
      most = saved;
      now = before - saved;
      best = form;
    }
    if (best) forms_[*best].is_stored = true;
    return best;
  }

  Forms& forms_;
  std::vector<Value> values_;
  std::map<Placed, int> numbers_;
  std::vector<int> roots_;
  std::vector<int> stored_;
  int walk_ = 0;
};

/// Replaces stored forms by reads of their fields.
class Rewriting {
 public:
  struct Written {
    Expr value;
    Origin origin;
  };

  Rewriting(const Kernel& kernel, Forms& forms, const std::map<int, std::string>& fields)
      : forms_(forms), fields_(fields) {
    for (const Let& let : kernel.lets) lets_.emplace(let.name, let.value);
  }

  /// Rewrites an expression at offset 0, where lets may be used.
  Expr operator()(const Expr& e) { return written(e, true); }

  /// The formula of a form, from one of its values, with lets substituted.
  Expr definition(const Expr& e) {
    written_.clear();
    const Placed placed = forms_.placed(e);
    const Offset to_middle = minus({}, plus(placed.at, forms_.middle(placed.form)));
    return shift(parts_of(e, false), to_middle, [](const std::string& name) { return name; });
  }

  /// Finds in `e` one value of each form to be stored, and its origin.
  void find(const Expr& e, const Origin& origin, std::map<int, Written>& values) {
    if (!looked_at_.insert(&e.node()).second) return;
    if (const Local* local = as<Local>(e)) return find(lets_.at(local->name), origin, values);
    const int form = forms_.placed(e).form;
    if (fields_.contains(form)) values.emplace(form, Written{e, origin});
    for_each_child(e, [&](const Expr& child) { find(child, origin, values); });
  }

 private:
  Expr written(const Expr& e, bool keeps_lets) {
    const auto known = written_.find(&e.node());
    if (known != written_.end()) return known->second;
    const Placed placed = forms_.placed(e);
    const auto field = fields_.find(placed.form);
    const Expr found = field != fields_.end() ? access(field->second, plus(placed.at, forms_.middle(placed.form)))
                                              : parts_of(e, keeps_lets);
    return written_.emplace(&e.node(), found).first->second;
  }

  Expr parts_of(const Expr& e, bool keeps_lets) {
    const Local* local = as<Local>(e);
    if (local != nullptr) return keeps_lets ? e : written(lets_.at(local->name), false);
    return map_children(e, [&](const Expr& child) { return written(child, keeps_lets); });
  }

  Forms& forms_;
  const std::map<int, std::string>& fields_;
  std::map<std::string, Expr> lets_;
  std::unordered_map<const Node*, Expr> written_;
  std::set<const Node*> looked_at_;
};

/// Sorts kernels so that each follows those whose results it reads.
std::vector<Kernel> in_order(std::vector<Kernel> kernels) {
  std::vector<Kernel> ordered;
  while (!kernels.empty()) {
    const auto is_ready = [&](const Kernel& kernel) {
      const Signature reads = signature(kernel);
      return std::ranges::none_of(
          kernels, [&](const Kernel& other) { return reads.find_read(other.stores.front().field) != nullptr; });
    };
    const auto ready = std::ranges::find_if(kernels, is_ready);
    require(ready != kernels.end(), "stored values are made of one another");
    ordered.push_back(std::move(*ready));
    kernels.erase(ready);
  }
  return ordered;
}

}  // namespace

StoredValues with_stored_values(const Kernel& kernel, const std::vector<Topology>& axes) {
  const StoredValues as_it_is{{}, kernel};
  if (!kernel.scatters.empty() || !kernel.custom_adjoints.empty()) return as_it_is;
  Forms forms(axes);
  std::vector<Placed> roots;
  for (const Let& let : kernel.lets) forms.define(let);
  for (const Store& store : kernel.stores) roots.push_back(forms.placed(store.value));
  for (const Sum& sum : kernel.sums) roots.push_back(forms.placed(sum.value));
  forms.keep_what_decides();
  const std::vector<int> chosen = Choice(forms, roots).made();
  if (chosen.empty()) return as_it_is;
  NameSupply names;
  for (const Signature::Read& read : signature(kernel).reads) names.reserve(read.field);
  for (const Store& store : kernel.stores) names.reserve(store.field);
  std::map<int, std::string> fields;
  for (const int form : chosen) fields.emplace(form, names.fresh("shared"));
  Rewriting rewriting(kernel, forms, fields);
  std::map<int, Rewriting::Written> values;
  for (const Store& store : kernel.stores) rewriting.find(store.value, store.origin, values);
  for (const Sum& sum : kernel.sums) rewriting.find(sum.value, {}, values);
  StoredValues result = as_it_is;
  result.kernel = map_expressions(kernel, rewriting);
  for (const int form : chosen) {
    const Rewriting::Written& found = values.at(form);
    const Store store{fields.at(form), false, rewriting.definition(found.value), found.origin};
    Kernel& made = result.before.emplace_back(Kernel{"", kernel.rank, {}, {store}, {}, {}});
    made.origin.is_stored_part = true;
  }
  result.before = in_order(std::move(result.before));
  return result;
}

namespace {

/// Substitutes stored values in one program, or in a block of it.
class InPlace {
 public:
  explicit InPlace(Module& module) : module_(module) {}

  std::vector<Statement> operator()(const std::vector<Statement>& statements) {
    std::vector<Statement> body;
    for (const Statement& statement : statements) {
      const auto keep = [&](const auto& as_it_is) { body.push_back(as_it_is); };
      match(
          statement,
          [&](const Fill& fill) {
            if (!values_.contains(fill.field)) keep(fill);
          },
          [&](const OneOf<Fold, Reduce, NetworkCall, Transform> auto& same) { keep(same); },
          [&](const Run& run) {
            Kernel& kernel = *std::ranges::find(module_.kernels, run.kernel, &Kernel::name);
            kernel = map_expressions(kernel, [&](const Expr& e) { return in_place(e); });
            if (!kernel.origin.is_stored_part) return keep(run);
            std::map<std::string, Expr> lets;
            for (const Let& let : kernel.lets) lets.insert_or_assign(let.name, without_lets(let.value, lets));
            for (const Store& store : kernel.stores)
              values_.insert_or_assign(store.field, without_lets(store.value, lets));
          },
          [&](const OneOf<Solve, Repeat> auto& blocks) {
            keep(blocks);
            for_each_block(body.back(), Blocks::all, [&](auto& block) { block = InPlace(module_)(block); });
          });
    }
    return body;
  }

 private:
  /// Substitutes lets, which are local to their kernel.
  static Expr without_lets(const Expr& e, const std::map<std::string, Expr>& lets) {
    if (const Local* local = as<Local>(e)) return lets.at(local->name);
    return map_children(e, [&](const Expr& child) { return without_lets(child, lets); });
  }

  Expr in_place(const Expr& e) const {
    if (values_.empty()) return e;
    if (const Access* read = as<Access>(e)) {
      const auto known = values_.find(read->field);
      if (known == values_.end()) return e;
      return shift(known->second, read->offset, [](const std::string& name) { return name; });
    }
    return map_children(e, [&](const Expr& child) { return in_place(child); });
  }

  Module& module_;
  std::map<std::string, Expr> values_;
};

}  // namespace

Module with_values_in_place(const Module& module) {
  const bool has_any =
      std::ranges::any_of(module.kernels, [](const Kernel& kernel) { return kernel.origin.is_stored_part; });
  if (!has_any) return module;
  Module result = module;
  for (Program& program : result.programs) program.body = InPlace(result)(program.body);
  std::erase_if(result.kernels, [](const Kernel& kernel) { return kernel.origin.is_stored_part; });
  return eliminate_common_subexpressions(remove_dead_code(result));
}

}  // namespace dpde::stencil
