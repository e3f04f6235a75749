// SPDX-License-Identifier: Apache-2.0
#include "loop/share_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "loop/expressions.h"
#include "loop/walk.h"
#include "support/assert.h"
#include "support/names/name_supply.h"

namespace dpde::loop {

namespace {

bool is_value(const Expr& e) { return is<Literal, Uniform>(e); }

/// Whether both are the same uniform or bitwise the same number.
bool is_same(const Expr& a, const Expr& b) {
  const Literal *x = as<Literal>(a), *y = as<Literal>(b);
  if (x && y) return std::bit_cast<std::uint64_t>(x->value) == std::bit_cast<std::uint64_t>(y->value);
  return a == b;
}

/// `e` with `f` applied to every number and uniform, from left to right, except numeric exponents, which determine the
/// generated code.
template <class F>
Expr map_values(const Expr& e, const F& f) {
  if (is_value(e)) return f(e);
  const Binary* b = as<Binary>(e);
  if (b && b->op == BinaryOp::power && is<Literal>(b->right)) {
    return make(Binary{b->op, map_values(b->left, f), b->right});
  }
  return map_children(e, [&](const Expr& child) { return map_values(child, f); });
}

template <class F>
Row map_row_values(const Row& row, const F& f) {
  return map_expressions(row, [&](const Expr& e) { return map_values(e, f); });
}

std::vector<Expr> values_of(const Row& row) {
  std::vector<Expr> values;
  map_row_values(row, [&](const Expr& e) {
    values.push_back(e);
    return e;
  });
  return values;
}

/// Names in order of first appearance.
std::vector<std::string> fields_of(const Row& row) {
  std::vector<std::string> fields;
  const auto add = [&](const std::string& name) {
    if (std::find(fields.begin(), fields.end(), name) == fields.end()) fields.push_back(name);
  };
  for (const Stream& stream : row.streams) add(stream.field);
  for (const std::string& grid : row.grids) add(grid);
  return fields;
}

bool looks_at_axes(const Row& row) {
  return !row.scatters.empty() || any_part(row, [](const Expr& e) { return is<Inside, Interp>(e); });
}

/// The row without all that may differ between rows that share code.
Row shape_of(const Row& row) {
  Row shape = map_row_values(row, [](const Expr&) { return Expr(0.0); });
  const std::vector<std::string> fields = fields_of(row);
  const auto number_of = [&](const std::string& field) {
    return std::to_string(std::find(fields.begin(), fields.end(), field) - fields.begin());
  };
  shape.name.clear();
  if (!looks_at_axes(row)) shape.axes.clear();
  for (Stream& stream : shape.streams) stream.field = number_of(stream.field);
  for (std::string& grid : shape.grids) grid = number_of(grid);
  for (Let& let : shape.lets) let.name.clear();
  for (std::size_t s = 0; s < row.sums.size(); ++s) {
    const auto same = [&](const Sum& sum) { return sum.name == row.sums[s].name; };
    shape.sums[s].name = std::to_string(std::find_if(row.sums.begin(), row.sums.end(), same) - row.sums.begin());
  }
  return shape;
}

/// Rows of one shape.
struct Group {
  Row shape;
  std::vector<const Row*> rows;
};

std::vector<Group> groups_of(const Module& module) {
  std::vector<Group> groups;
  for (const Row& row : module.rows) {
    Row shape = shape_of(row);
    const auto found =
        std::find_if(groups.begin(), groups.end(), [&](const Group& group) { return group.shape == shape; });
    if (found != groups.end()) {
      found->rows.push_back(&row);
    } else {
      groups.push_back({std::move(shape), {&row}});
    }
  }
  return groups;
}

NameSupply names_in(const Module& module) {
  NameSupply names;
  for (const std::string& param : module.params) names.reserve(param);
  for (const UniformDef& uniform : module.uniforms) names.reserve(uniform.name);
  for (const Row& row : module.rows) {
    for (const std::string& field : fields_of(row)) names.reserve(field);
    for (const Let& let : row.lets) names.reserve(let.name);
    for (const Sum& sum : row.sums) names.reserve(sum.name);
  }
  return names;
}

/// The values that differ between the rows of a group, in slots: positions whose values agree in each row share one.
class Slots {
 public:
  explicit Slots(const std::vector<const Row*>& rows) {
    std::vector<std::vector<Expr>> values;
    for (const Row* row : rows) {
      values.push_back(values_of(*row));
      require(values.back().size() == values.front().size(), "rows of one shape have the same places");
    }
    for (std::size_t place = 0; place < values.front().size(); ++place) {
      std::vector<Expr> column;
      for (const std::vector<Expr>& of_row : values) column.push_back(of_row[place]);
      const bool differs =
          std::any_of(column.begin(), column.end(), [&](const Expr& e) { return !is_same(e, column[0]); });
      slot_of_place_.push_back(differs ? slot_of(column) : -1);
      const Uniform* uniform = as<Uniform>(column[0]);
      if (!differs && uniform) common_.insert(uniform->index);
    }
  }

  int count() const { return static_cast<int>(columns_.size()); }
  /// -1: the value is the same in all rows.
  const std::vector<int>& slot_of_place() const { return slot_of_place_; }
  std::vector<Expr> of_row(std::size_t row) const {
    std::vector<Expr> values;
    for (const std::vector<Expr>& column : columns_) values.push_back(column[row]);
    return values;
  }
  /// Uniforms that all rows read at the same position.
  const std::set<int>& common() const { return common_; }

 private:
  int slot_of(const std::vector<Expr>& column) {
    const auto same = [&](const std::vector<Expr>& known) {
      return std::equal(known.begin(), known.end(), column.begin(), is_same);
    };
    const auto found = std::find_if(columns_.begin(), columns_.end(), same);
    const auto slot = static_cast<int>(found - columns_.begin());
    if (found == columns_.end()) columns_.push_back(column);
    return slot;
  }

  std::vector<int> slot_of_place_;
  std::vector<std::vector<Expr>> columns_;  // of each slot, a value for each row
  std::set<int> common_;
};

/// The first of these uniforms if they are consecutive; else nullopt.
std::optional<int> consecutive(const std::vector<Expr>& values) {
  std::optional<int> first;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Uniform* uniform = as<Uniform>(values[i]);
    if (!uniform || (first && uniform->index != *first + static_cast<int>(i))) return std::nullopt;
    if (!first) first = uniform->index;
  }
  return first;
}

class Sharing {
 public:
  explicit Sharing(Module module) : module_(std::move(module)), names_(names_in(module_)) {}

  Module run() {
    std::vector<Row> rows;
    for (const Group& group : groups_of(module_))
      rows.push_back(group.rows.size() == 1 ? *group.rows[0] : share(group));
    module_.rows = std::move(rows);
    for (Program& program : module_.programs) bind(program.body);
    return std::move(module_);
  }

 private:
  struct Use {
    std::string row;
    Binding binding;
  };

  Row share(const Group& group) {
    const Slots slots(group.rows);
    blocks_.clear();
    std::vector<int> starts;
    for (std::size_t r = 0; r < group.rows.size(); ++r)
      starts.push_back(block_of(slots.of_row(r), r == 0 ? slots.common() : std::set<int>{}));

    const Row& first = *group.rows.front();
    for (std::size_t r = 0; r < group.rows.size(); ++r) {
      uses_.emplace(group.rows[r]->name, Use{first.name, binding(first, *group.rows[r], starts[r] - starts[0])});
    }
    std::size_t place = 0;
    Row shared = map_row_values(first, [&](const Expr& e) {
      const int slot = slots.slot_of_place()[place++];
      return slot < 0 ? e : make(Uniform{starts[0] + slot});
    });
    shared.own = starts[0];
    shared.row_constant_count = slots.count();
    return shared;
  }

  static Binding binding(const Row& first, const Row& other, int own) {
    Binding result;
    const std::vector<std::string> from = fields_of(first), to = fields_of(other);
    for (std::size_t f = 0; f < from.size(); ++f) {
      if (from[f] != to[f]) result.fields.emplace(from[f], to[f]);
    }
    for (std::size_t s = 0; s < first.sums.size(); ++s) {
      if (first.sums[s].name != other.sums[s].name) result.sums.emplace(first.sums[s].name, other.sums[s].name);
    }
    result.own = own;
    return result;
  }

  /// Index of the first of consecutive uniforms with these values, none of which is in `others`.
  int block_of(const std::vector<Expr>& values, const std::set<int>& others) {
    if (values.empty()) return 0;
    const auto is_other = [&](const Expr& e) { return others.contains(std::get<Uniform>(e->kind).index); };
    const std::optional<int> there = consecutive(values);
    if (there && std::none_of(values.begin(), values.end(), is_other)) return *there;
    const auto same = [&](const auto& known) {
      return std::equal(known.first.begin(), known.first.end(), values.begin(), values.end(), is_same);
    };
    const auto found = std::find_if(blocks_.begin(), blocks_.end(), same);
    if (found != blocks_.end()) return found->second;
    const auto start = static_cast<int>(module_.uniforms.size());
    for (const Expr& value : values) {
      const Uniform* uniform = as<Uniform>(value);
      const std::string name = name_for(uniform ? module_.uniforms[uniform->index].name : "c");
      module_.uniforms.push_back({name, value});
    }
    blocks_.emplace_back(values, start);
    return start;
  }

  /// dt_1, dt_2, ...
  std::string name_for(const std::string& wish) {
    std::string name;
    do {
      name = fmt::format("{}_{}", wish, ++numbers_[wish]);
    } while (names_.is_used(name));
    names_.reserve(name);
    return name;
  }

  void bind(std::vector<Operation>& operations) const {
    for_each_kind<Sweep>(operations, [&](Sweep& sweep) { bind(sweep); });
  }

  void bind(Sweep& sweep) const {
    const auto use = uses_.find(sweep.row);
    if (use == uses_.end()) return;
    sweep.row = use->second.row;
    sweep.binding = use->second.binding;
  }

  Module module_;
  NameSupply names_;
  std::map<std::string, int> numbers_;
  std::map<std::string, Use> uses_;                        // of the rows that are shared
  std::vector<std::pair<std::vector<Expr>, int>> blocks_;  // of the current group
};

}  // namespace

Module share_rows(Module module) { return Sharing(std::move(module)).run(); }

}  // namespace dpde::loop
