// SPDX-License-Identifier: Apache-2.0
// Kernel -> rows. Every expression is converted once, bottom up, into a Term that records whether it is uniform. A
// uniform is put into the table only where it meets a varying value, so that uniforms are as large as possible. Uniform
// factors of a product are combined, except in operands of decisions: these are computed as written, except that
// quotients by uniforms become products, and each product is Rounded.
#include "loop/from_stencil/rows.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "loop/expressions.h"
#include "stencil/build.h"
#include "stencil/space/comparisons.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/names/bound_names.h"

namespace dpde::loop {

namespace {

struct Term {
  bool uniform;
  Expr expr;  // uniform: a definition (Params, Literals, Uniforms); otherwise a row expression
};

/// The value of a numeric exponent.
std::optional<double> number(const stencil::Expr& e) {
  const Literal* literal = as<Literal>(e);
  return literal ? std::optional(literal->value) : std::nullopt;
}

bool is_reciprocal_power(const stencil::Binary& b) {
  const std::optional<double> exponent = b.op == BinaryOp::power ? number(b.right) : std::nullopt;
  return exponent && (*exponent == -0.5 || (*exponent <= -1 && *exponent >= -4 && *exponent == std::floor(*exponent)));
}

/// Converts expressions: of a row if one is given, otherwise of uniforms only.
class Converter {
 public:
  Converter(UniformTable& uniforms, Row* row, const NameSupply& names, std::set<std::string> decisive_lets)
      : uniforms_(uniforms), row_(row), names_(names), decisive_lets_(std::move(decisive_lets)) {}

  Term convert(const stencil::Expr& e) { return convert(e, decisive_); }
  Expr value(const stencil::Expr& e) { return use(convert(e)); }
  void add_let(const stencil::Let& let);
  Interp interp(const stencil::Interp& i);
  /// From now on reads of this stream give the value before the row's stores.
  void read_before_stores(int stream) { read_before_stores_.insert(stream); }

 private:
  Term convert(const stencil::Expr& e, bool decisive);
  Term convert_kind(const stencil::Expr& e);
  Expr use(const Term& term) { return term.uniform ? uniforms_.use(term.expr) : term.expr; }
  Term convert_binary(const stencil::Expr& e, const stencil::Binary& b);
  Term convert_factors(const stencil::Expr& e);
  std::optional<Term> convert_sign_or_power(const stencil::Expr& e);
  Term convert_as_written(const stencil::Expr& e);
  void add_factors(Factors& factors, const stencil::Expr& e, bool inverse);
  Term convert_in_order(const stencil::Expr& e);
  Expr divided(Expr e, const stencil::Expr& by);
  Term convert_power(const stencil::Binary& b);
  Term convert_call(const stencil::Call& c);
  Term convert_select(const stencil::Select& s);
  Expr load(const stencil::Access& access);
  Expr shared(const Expr& e, const std::string& wish);
  int add_row_let(const std::string& name, const Expr& value);

  UniformTable& uniforms_;
  Row* row_;
  NameSupply names_;
  const std::set<std::string> decisive_lets_;
  bool decisive_ = false;  // while the operand of a decision is converted
  std::map<std::string, Term> lets_;
  std::vector<std::pair<Expr, int>> shared_;  // values for which a let was added
  std::set<int> read_before_stores_;
};

int Converter::add_row_let(const std::string& name, const Expr& value) {
  row_->lets.push_back({name, value});
  return static_cast<int>(row_->lets.size()) - 1;
}

void Converter::add_let(const stencil::Let& let) {
  const Term term = convert(let.value, decisive_lets_.contains(let.name));
  if (!term.uniform) {
    lets_.insert_or_assign(let.name, Term{false, make(Local{add_row_let(let.name, term.expr)})});
  } else if (is_leaf(term.expr)) {
    lets_.insert_or_assign(let.name, term);
  } else {
    lets_.insert_or_assign(let.name, Term{true, uniforms_.use(term.expr, let.name)});
  }
}

/// A leaf with the value of `e`: `e` itself or a let.
Expr Converter::shared(const Expr& e, const std::string& wish) {
  if (is_leaf(e) && wish.empty()) return e;
  for (const auto& [value, index] : shared_) {
    if (value == e) return make(Local{index});
  }
  const int index = add_row_let(names_.fresh(wish.empty() ? "base" : wish), e);
  shared_.emplace_back(e, index);
  return make(Local{index});
}

Expr Converter::load(const stencil::Access& access) {
  require(row_ != nullptr, "fields are read in rows only");
  for (std::size_t s = 0; s < row_->streams.size(); ++s) {
    const Stream& stream = row_->streams[s];
    if (stream.field != access.field || stream.offset != access.offset || stream.mode == Stream::Mode::out) continue;
    const Expr value = make(Load{static_cast<int>(s)});
    return read_before_stores_.contains(static_cast<int>(s)) ? shared(value, access.field + "_before") : value;
  }
  unreachable("every read has its stream");
}

Interp Converter::interp(const stencil::Interp& i) {
  require(row_ != nullptr, "fields are read in rows only");
  const auto found = std::find(row_->grids.begin(), row_->grids.end(), i.field);
  const int grid = static_cast<int>(found - row_->grids.begin());
  if (found == row_->grids.end()) row_->grids.push_back(i.field);
  std::vector<Expr> displacement;
  for (const stencil::Expr& d : i.displacement) displacement.push_back(use(convert(d, true)));
  return {grid, i.offset, std::move(displacement), i.along};
}

Term Converter::convert(const stencil::Expr& e, bool decisive) {
  const bool before = std::exchange(decisive_, decisive || stencil::is_decision(e));
  const Term term = convert_kind(e);
  decisive_ = before;
  return term;
}

Term Converter::convert_kind(const stencil::Expr& e) {
  return match(
      e->kind,
      [](const Literal& l) {
        return Term{true, l.value};
      },
      [&](const stencil::Param& p) {
        return Term{true, uniforms_.param(p.name)};
      },
      [&](const stencil::Local& l) {
        const auto found = lets_.find(l.name);
        require(found != lets_.end(), "a let is defined before its use");
        return found->second;
      },
      [&](const stencil::Access& a) {
        return Term{false, load(a)};
      },
      [&](const stencil::Interp& i) {
        return Term{false, make(interp(i))};
      },
      [&](const stencil::Inside& i) {
        return Term{false, make(Inside{i.offset, i.grow})};
      },
      [&](const stencil::Neg&) { return convert_factors(e); },
      [&](const stencil::Binary& b) { return convert_binary(e, b); },
      [&](const stencil::Call& c) { return convert_call(c); },
      [&](const stencil::Select& s) { return convert_select(s); });
}

Term Converter::convert_binary(const stencil::Expr& e, const stencil::Binary& b) {
  if (b.op == BinaryOp::multiply || b.op == BinaryOp::divide || is_reciprocal_power(b)) return convert_factors(e);
  if (b.op == BinaryOp::power) return convert_power(b);
  const Term left = convert(b.left);
  const Term right = convert(b.right);
  if (left.uniform && right.uniform) return {true, binary(b.op, left.expr, right.expr)};
  const Expr left_value = use(left);  // before the right one: uniforms are numbered in this order
  return {false, binary(b.op, left_value, use(right))};
}

Term rounded(const Expr& product) { return {false, make(Rounded{product})}; }

/// The factor of a product, which needs no rounding as nothing is added to it.
Expr without_rounding(const Expr& e) {
  const Rounded* rounded = as<Rounded>(e);
  return rounded ? rounded->operand : e;
}

Term reciprocal(const Term& uniform) {
  const Literal* number = as<Literal>(uniform.expr);
  if (number && std::isnormal(1 / number->value)) return {true, 1 / number->value};
  return {true, make(Binary{BinaryOp::divide, 1.0, uniform.expr})};
}

/// Converts a negation, or a power that is a quotient; nullopt for other factors.
std::optional<Term> Converter::convert_sign_or_power(const stencil::Expr& e) {
  if (const stencil::Neg* neg = as<stencil::Neg>(e)) {
    const Term operand = convert(neg->operand);
    return Term{operand.uniform, negate(operand.expr)};
  }
  const stencil::Binary& b = std::get<stencil::Binary>(e->kind);
  if (!is_reciprocal_power(b)) return std::nullopt;
  return convert(stencil::Expr({stencil::Binary{BinaryOp::divide, 1.0, stencil::power(b.left, -*number(b.right))}}));
}

Term Converter::convert_as_written(const stencil::Expr& e) {
  if (const std::optional<Term> term = convert_sign_or_power(e)) return *term;
  const stencil::Binary& b = std::get<stencil::Binary>(e->kind);
  const Term left = convert(b.left);
  const Term right = convert(b.right);
  if (left.uniform && right.uniform) return {true, make(Binary{b.op, left.expr, right.expr})};
  const Expr first = without_rounding(use(left));
  if (b.op == BinaryOp::multiply) return rounded(product({first, without_rounding(use(right))}));
  if (right.uniform) return rounded(product({first, use(reciprocal(right))}));
  return {false, make(Binary{BinaryOp::divide, first, without_rounding(right.expr)})};
}

Term Converter::convert_factors(const stencil::Expr& e) {
  if (decisive_) return convert_as_written(e);
  Factors factors;
  add_factors(factors, e, false);
  if (factors.is_uniform()) return {true, factors.definition()};
  return factors.hangs_on_order(uniforms_) ? convert_in_order(e) : Term{false, factors.varying(uniforms_)};
}

/// Products and quotients in the written order: users and derivative rules write intermediate values in f32 range.
Term Converter::convert_in_order(const stencil::Expr& e) {
  if (const std::optional<Term> term = convert_sign_or_power(e)) return *term;
  const stencil::Binary& b = std::get<stencil::Binary>(e->kind);
  const Expr first = use(convert(b.left));
  if (b.op == BinaryOp::multiply) return {false, product({first, use(convert(b.right))})};
  return {false, divided(first, b.right)};
}

/// Divides by the factors of a divisor one by one.
Expr Converter::divided(Expr e, const stencil::Expr& by) {
  const stencil::Binary* b = as<stencil::Binary>(by);
  if (b != nullptr && b->op == BinaryOp::multiply) return divided(divided(std::move(e), b->left), b->right);
  const double exponent = b != nullptr && b->op == BinaryOp::power ? number(b->right).value_or(0) : 0;
  const bool is_small = exponent == 2 || exponent == 3 || exponent == 4;
  const Term divisor = convert(is_small ? b->left : by);
  if (divisor.uniform) return product({e, use(reciprocal(is_small ? convert(by) : divisor))});
  const Expr one = is_small ? shared(divisor.expr, "") : divisor.expr;
  for (int i = 0; i < (is_small ? static_cast<int>(exponent) : 1); ++i) e = make(Binary{BinaryOp::divide, e, one});
  return e;
}

void Converter::add_factors(Factors& factors, const stencil::Expr& e, bool inverse) {
  if (const stencil::Neg* neg = as<stencil::Neg>(e)) {
    factors.negate();
    return add_factors(factors, neg->operand, inverse);
  }
  if (const stencil::Binary* b = as<stencil::Binary>(e)) {
    if (b->op == BinaryOp::multiply || b->op == BinaryOp::divide) {
      add_factors(factors, b->left, inverse);
      return add_factors(factors, b->right, inverse != (b->op == BinaryOp::divide));
    }
    if (is_reciprocal_power(*b)) return add_factors(factors, stencil::power(b->left, -*number(b->right)), !inverse);
  }
  const Term term = convert(e);
  if (!term.uniform) return factors.add_varying(term.expr, inverse);
  if (const Literal* literal = as<Literal>(term.expr)) return factors.add_number(literal->value, inverse);
  factors.add_uniform(term.expr, inverse);
}

/// x^2, x^3 and x^4 are products and x^0.5 is a root: pow costs some 50 multiplications.
Term Converter::convert_power(const stencil::Binary& b) {
  const Term base = convert(b.left);
  const Term exponent = convert(b.right);
  if (base.uniform && exponent.uniform) return {true, make(Binary{BinaryOp::power, base.expr, exponent.expr})};
  const Literal* literal = as<Literal>(exponent.expr);
  const double n = literal ? literal->value : 0;
  if (n == 0.5) return {false, make(Call{Fn::sqrt, {base.expr}})};
  if (n != 2 && n != 3 && n != 4) return {false, make(Binary{BinaryOp::power, use(base), use(exponent)})};
  const Expr x = shared(base.expr, "");
  const Expr square = product({x, x});
  const Expr result = n == 2 ? square : n == 3 ? product({x, x, x}) : product({square, square});
  return decisive_ ? rounded(result) : Term{false, result};
}

Term Converter::convert_call(const stencil::Call& c) {
  std::vector<Term> arguments;
  for (const stencil::Expr& argument : c.arguments) arguments.push_back(convert(argument));
  const bool uniform = std::all_of(arguments.begin(), arguments.end(), [](const Term& t) { return t.uniform; });
  std::vector<Expr> values;
  for (const Term& argument : arguments) values.push_back(uniform ? argument.expr : use(argument));
  return {uniform, make(Call{c.fn, std::move(values)})};
}

Term Converter::convert_select(const stencil::Select& s) {
  const Term condition = convert(s.condition);
  const Term yes = convert(s.yes);
  const Term no = convert(s.no);
  if (condition.uniform && yes.uniform && no.uniform) return {true, make(Select{condition.expr, yes.expr, no.expr})};
  return {false, make(Select{use(condition), use(yes), use(no)})};
}

/// The lets that `roots` need, directly or through other lets, in the kernel's order.
std::vector<stencil::Let> needed_lets(const stencil::Kernel& kernel, const std::vector<stencil::Expr>& roots) {
  std::set<std::string> used;
  const auto add = [&](const stencil::Expr& e) {
    if (const stencil::Local* local = as<stencil::Local>(e)) used.insert(local->name);
  };
  for (const stencil::Expr& root : roots) visit(root, add);
  std::vector<stencil::Let> needed;
  for (auto let = kernel.lets.rbegin(); let != kernel.lets.rend(); ++let) {
    if (!used.contains(let->name)) continue;
    needed.push_back(*let);
    visit(let->value, add);
  }
  std::reverse(needed.begin(), needed.end());
  return needed;
}

struct Reads {
  std::vector<std::string> fields;  // in order of first appearance
  std::map<std::string, std::set<Offset>> offsets;
};

Reads reads_of(const std::vector<stencil::Let>& lets, const std::vector<stencil::Expr>& roots) {
  Reads reads;
  const auto add = [&](const stencil::Expr& e) {
    const stencil::Access* access = as<stencil::Access>(e);
    if (!access) return;
    if (!reads.offsets.contains(access->field)) reads.fields.push_back(access->field);
    reads.offsets[access->field].insert(access->offset);
  };
  for (const stencil::Let& let : lets) visit(let.value, add);
  for (const stencil::Expr& root : roots) visit(root, add);
  return reads;
}

int stream_of_store(std::vector<Stream>& streams, const stencil::Store& store) {
  const auto same = [&](const Stream& stream) { return stream.field == store.field; };
  const auto found = std::find_if(streams.begin(), streams.end(), same);
  const int index = static_cast<int>(found - streams.begin());
  if (found == streams.end()) streams.push_back({store.field, {}, Stream::Mode::out});
  if (store.accumulate) streams[index].mode = Stream::Mode::inout;
  return index;
}

void add_read_streams(std::vector<Stream>& streams, const Reads& reads) {
  const std::size_t written = streams.size();
  const auto is_updated = [&](const std::string& field) {
    return std::any_of(streams.begin(), streams.begin() + static_cast<std::ptrdiff_t>(written),
                       [&](const Stream& s) { return s.field == field && s.mode == Stream::Mode::inout; });
  };
  const auto by_row = [](const Offset& a, const Offset& b) {
    return std::lexicographical_compare(a.rbegin(), a.rend(), b.rbegin(), b.rend());
  };
  for (const std::string& field : reads.fields) {
    const std::set<Offset>& found = reads.offsets.at(field);
    std::vector<Offset> offsets(found.begin(), found.end());
    std::sort(offsets.begin(), offsets.end(), by_row);
    const BoundName* known = find_bound_name(field);
    const bool is_even = known != nullptr && known->axis > 0;
    for (const Offset& offset : offsets) {
      if (!is_updated(field)) streams.push_back({field, offset, Stream::Mode::in, is_even});
    }
  }
}

NameSupply names_of(const stencil::Kernel& kernel) {
  NameSupply names;
  for (const stencil::Let& let : kernel.lets) names.reserve(let.name);
  const stencil::Signature s = stencil::signature(kernel);
  for (const stencil::Signature::Read& read : s.reads) names.reserve(read.field);
  for (const std::string& field : s.writes) names.reserve(field);
  for (const std::string& field : s.updates) names.reserve(field);
  return names;
}

Row store_row(const stencil::Kernel& kernel, const std::vector<Topology>& axes, UniformTable& uniforms) {
  std::vector<stencil::Expr> roots;
  for (const stencil::Store& store : kernel.stores) roots.push_back(store.value);
  for (const stencil::Sum& sum : kernel.sums) roots.push_back(sum.value);
  const std::vector<stencil::Let> lets = needed_lets(kernel, roots);

  Row row{.name = kernel.name, .rank = kernel.rank, .axes = axes};
  std::vector<int> targets;
  for (const stencil::Store& store : kernel.stores) targets.push_back(stream_of_store(row.streams, store));
  add_read_streams(row.streams, reads_of(lets, roots));

  Converter converter(uniforms, &row, names_of(kernel), stencil::decisive_lets(kernel));
  for (const stencil::Let& let : lets) converter.add_let(let);
  for (int target : targets) {
    const bool updated = row.streams[target].mode == Stream::Mode::inout;
    if (updated && roots.size() > 1) converter.read_before_stores(target);
  }
  for (std::size_t s = 0; s < kernel.stores.size(); ++s) {
    const stencil::Store& store = kernel.stores[s];
    row.stores.push_back({targets[s], store.accumulate, converter.value(store.value), store.origin});
  }
  for (const stencil::Sum& sum : kernel.sums) row.sums.push_back({sum.name, converter.value(sum.value)});
  return row;
}

Row scatter_row(const stencil::Kernel& kernel, const std::vector<Topology>& axes, UniformTable& uniforms) {
  std::vector<stencil::Expr> roots;
  for (const stencil::Scatter& scatter : kernel.scatters) {
    roots.insert(roots.end(), scatter.target.displacement.begin(), scatter.target.displacement.end());
    roots.push_back(scatter.value);
  }
  const std::vector<stencil::Let> lets = needed_lets(kernel, roots);

  Row row{.name = kernel.name + "_scatter", .rank = kernel.rank, .axes = axes};
  add_read_streams(row.streams, reads_of(lets, roots));
  Converter converter(uniforms, &row, names_of(kernel), stencil::decisive_lets(kernel));
  for (const stencil::Let& let : lets) converter.add_let(let);
  for (const stencil::Scatter& scatter : kernel.scatters) {
    Interp target = converter.interp(scatter.target);
    row.scatters.push_back({std::move(target), converter.value(scatter.value)});
  }
  return row;
}

/// Whether `later` reads (at its points or at computed positions) a field that `earlier` has written.
bool reads_results(const Row& later, const Row& earlier) {
  const auto reads = [&](const std::string& field) {
    return std::any_of(later.streams.begin(), later.streams.end(), [&](const Stream& s) { return s.field == field; }) ||
           std::find(later.grids.begin(), later.grids.end(), field) != later.grids.end();
  };
  return std::any_of(earlier.streams.begin(), earlier.streams.end(),
                     [&](const Stream& s) { return s.mode != Stream::Mode::in && reads(s.field); });
}

bool touches_targets(const Row& stores, const Row& scatters) {
  return std::any_of(scatters.scatters.begin(), scatters.scatters.end(), [&](const Scatter& scatter) {
    const std::string& target = scatters.grids[scatter.target.grid];
    return std::any_of(stores.streams.begin(), stores.streams.end(),
                       [&](const Stream& s) { return s.field == target; }) ||
           std::find(stores.grids.begin(), stores.grids.end(), target) != stores.grids.end();
  });
}

/// Removes from masks the axes along which they cannot fail; masks that always hold become the number 1.
stencil::Expr simplify_masks(const stencil::Expr& e, const std::vector<Topology>& axes, int grow) {
  const stencil::Inside* inside = as<stencil::Inside>(e);
  if (!inside) {
    return map_children(e, [&](const stencil::Expr& child) { return simplify_masks(child, axes, grow); });
  }
  Offset offset{};
  bool can_fail = false;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (axes[axis] == Topology::periodic) continue;
    offset[axis] = inside->offset[axis];
    can_fail = can_fail || grow + std::abs(offset[axis]) > inside->grow;
  }
  return can_fail ? stencil::inside(offset, inside->grow) : stencil::Expr(1.0);
}

}  // namespace

bool depends_on_axes(const stencil::Kernel& kernel) {
  const auto looks = [](const stencil::Expr& e) { return is<stencil::Inside, stencil::Interp>(e); };
  return !kernel.scatters.empty() || any_part(kernel, looks);
}

std::vector<Row> rows_of(const stencil::Kernel& kernel, const std::vector<Topology>& axes, int grow,
                         UniformTable& uniforms) {
  const stencil::Kernel simple =
      map_expressions(kernel, [&](const stencil::Expr& e) { return simplify_masks(e, axes, grow); });
  std::vector<Row> rows;
  if (!simple.stores.empty() || !simple.sums.empty()) rows.push_back(store_row(simple, axes, uniforms));
  if (!simple.scatters.empty()) rows.push_back(scatter_row(simple, axes, uniforms));
  // Scatters run last, but must read the fields as they were before the stores.
  if (rows.size() == 2 && reads_results(rows[1], rows[0])) {
    require(!touches_targets(rows[0], rows[1]), "stores and scatters of a kernel do not read each other's results");
    std::swap(rows[0], rows[1]);
  }
  return rows;
}

Expr uniform_definition(const stencil::Expr& e, UniformTable& uniforms) {
  const Term term = Converter(uniforms, nullptr, NameSupply(), {}).convert(e);
  require(term.uniform, "values of boundaries depend on parameters only");
  return term.expr;
}

}  // namespace dpde::loop
