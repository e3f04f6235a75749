// SPDX-License-Identifier: Apache-2.0
// Text with the fewest parentheses that keep the meaning; the spelling of expressions is that of the stencil level.
#include "loop/print_loop.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string_view>
#include <tuple>

#include "support/assert.h"
#include "support/match.h"
#include "support/names/wave_names.h"

namespace dpde::loop {

namespace {

constexpr int atom = 9;
constexpr int product_precedence = 5;
constexpr std::string_view axis_names = "xyz";

struct Piece {
  std::string text;
  int precedence = atom;
};

/// "[-1, 0]"; "" for the point itself.
std::string offset_text(const Offset& offset, int rank) {
  if (offset == Offset{}) return "";
  std::vector<std::string> parts;
  for (int axis = 0; axis < rank; ++axis) {
    parts.push_back(offset[axis] == 0 ? "0" : fmt::format("{:+}", offset[axis]));
  }
  return fmt::format("[{}]", fmt::join(parts, ", "));
}

std::string stream_text(const Stream& stream, int rank) { return stream.field + offset_text(stream.offset, rank); }

class ExprPrinter {
 public:
  ExprPrinter(const Module& module, const Row* row) : module_(module), row_(row) {}

  std::string text(const Expr& e, int least = 0) const {
    const Piece piece = print(e);
    return piece.precedence < least ? fmt::format("({})", piece.text) : piece.text;
  }

  std::string interp_text(const Interp& i) const {
    const std::string place = row_->grids[i.grid] + offset_text(i.offset, row_->rank);
    return fmt::format("{}({}, {})", interp_name(i.along), place, list(i.displacement));
  }

 private:
  std::string list(const std::vector<Expr>& expressions) const {
    std::vector<std::string> texts;
    for (const Expr& e : expressions) texts.push_back(text(e));
    return fmt::format("{}", fmt::join(texts, ", "));
  }

  std::string inside_text(const Inside& i) const {
    std::vector<std::string> parts;
    for (int axis = 0; axis < row_->rank; ++axis) {
      parts.push_back(i.offset[axis] == 0 ? "0" : fmt::format("{:+}", i.offset[axis]));
    }
    return fmt::format("inside[{}]{}", fmt::join(parts, ", "), i.grow == 0 ? "" : fmt::format(" grow {}", i.grow));
  }

  Piece print(const Expr& e) const {
    return match(
        e->kind,
        [](const Literal& l) {
          return Piece{fmt::format("{}", l.value), l.value < 0 ? unary_precedence : atom};
        },
        [&](const Uniform& u) { return Piece{module_.uniforms[u.index].name}; },
        [&](const Param& p) { return Piece{module_.params[p.index]}; },
        [&](const Counter& c) { return Piece{module_.counters[c.index]}; },
        [&](const Load& l) { return Piece{stream_text(row_->streams[l.stream], row_->rank)}; },
        [&](const Local& l) { return Piece{row_->lets[l.index].name}; },
        [&](const Inside& i) { return Piece{inside_text(i)}; }, [&](const Interp& i) { return Piece{interp_text(i)}; },
        [&](const Neg& n) { return print_neg(n); },
        [&](const Rounded& r) { return Piece{fmt::format("rounded({})", text(r.operand))}; },
        [&](const Binary& b) { return print_binary(b); },
        [&](const Call& c) { return Piece{fmt::format("{}({})", name_of(c.fn), list(c.arguments))}; },
        [&](const Select& s) {
          return Piece{fmt::format("if({})", list({s.condition, s.yes, s.no}))};
        });
  }

  /// Prints -(a*b) as -a*b, which is the same number.
  Piece print_neg(const Neg& n) const {
    const Piece operand = print(n.operand);
    if (operand.precedence == product_precedence) return {"-" + operand.text, product_precedence};
    return {"-" + text(n.operand, unary_precedence + 1), unary_precedence};
  }

  Piece print_binary(const Binary& b) const {
    const int own = precedence(b.op);
    const bool is_power = b.op == BinaryOp::power;
    const bool is_comparison = own == precedence(BinaryOp::less);
    const int left = is_power ? atom : is_comparison ? own + 1 : own;
    const int right = own >= product_precedence ? unary_precedence + 1 : own + 1;
    const std::string_view gap = own >= product_precedence ? "" : " ";
    return {fmt::format("{}{}{}{}{}", text(b.left, left), gap, spelling(b.op), gap, text(b.right, right)), own};
  }

  const Module& module_;
  const Row* row_;
};

std::string stream_list(const Row& row, Stream::Mode mode, bool is_even) {
  std::vector<std::string> parts;
  for (const Stream& stream : row.streams) {
    if (stream.mode != mode || stream.is_even != is_even) continue;
    const std::string over = stream.over < 0 ? "" : " over " + row.streams[stream.over].field;
    parts.push_back(stream_text(stream, row.rank) + over);
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string axes_text(const std::vector<Topology>& axes) {
  std::vector<std::string> parts;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    parts.push_back(fmt::format("{} {}", axis_names[a], axes[a] == Topology::periodic ? "periodic" : "bounded"));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// The first condition in the table that matches the coefficients. If none does, the name of the rule with the numbers
/// of a, b and c: as for a slope about the centre of a cell, whose b is 1/h.
std::string condition_text(const Module& module, const Side& side) {
  using Part = SideCondition::Part;
  const auto uniform = [&](int index) {
    return index == uniform_zero ? "0" : index == uniform_one ? "1" : module.uniforms[index].name;
  };
  const std::string c = side.field.empty() ? uniform(side.value) : side.field;
  const std::array<std::string, 3> numbers{uniform(side.coefficients[0]), uniform(side.coefficients[1]), c};
  const SideCondition* of_rule = nullptr;
  for (const SideCondition& condition : side_condition_table()) {
    if (&condition.rule(side.rule->on_walls) != side.rule) continue;
    const std::array<Part, 3> parts{condition.a, condition.b, condition.c};
    bool is_it = true;
    std::vector<std::string> given;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts[i] == Part::given) given.push_back(numbers[i]);
      if (parts[i] != Part::given) is_it = is_it && numbers[i] == (parts[i] == Part::one ? "1" : "0");
    }
    if (is_it) return condition.text(given);
    if (of_rule == nullptr) of_rule = &condition;
  }
  require(of_rule != nullptr, "the rule of a side is one of the table");
  return fmt::format("{}({})", of_rule->word, fmt::join(numbers, ", "));
}

std::string side_text(const Module& module, const Side& side) {
  const std::string condition = condition_text(module, side);
  return side.rule->on_walls ? fmt::format("on_wall({})", condition) : condition;
}

std::string boundary_text(const Module& module, const std::vector<AxisBoundary>& axes) {
  std::vector<std::string> parts;
  bool all_periodic = true;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const char name = axis_names[a];
    if (axes[a].topology == Topology::periodic) {
      parts.push_back(fmt::format("{} periodic", name));
      continue;
    }
    all_periodic = false;
    const std::string low = side_text(module, axes[a].low), high = side_text(module, axes[a].high);
    if (low == high) {
      parts.push_back(fmt::format("{} = {}", name, low));
    } else {
      parts.push_back(fmt::format("{}.low = {}, {}.high = {}", name, low, name, high));
    }
  }
  return all_periodic ? "periodic" : fmt::format("{}", fmt::join(parts, ", "));
}

std::string fill_text(const Module& module, const Fill& fill) {
  return fmt::format("fill {} {}", fill.field, boundary_text(module, fill.axes));
}

std::string grow_text(int grow) { return grow == 0 ? "" : fmt::format(" grow {}", grow); }

/// " with u = u_2, c_1 = c_2": the replacements for the names of a shared row.
std::string binding_text(const Module& module, const Sweep& sweep) {
  std::vector<std::string> parts;
  for (const auto& names : {sweep.binding.fields, sweep.binding.sums}) {
    for (const auto& [name, bound] : names) parts.push_back(fmt::format("{} = {}", name, bound));
  }
  const Row& row = *module.find_row(sweep.row);
  for (int u = row.own; sweep.binding.own != 0 && u < row.own + row.row_constant_count; ++u) {
    parts.push_back(fmt::format("{} = {}", module.uniforms[u].name, module.uniforms[u + sweep.binding.own].name));
  }
  return parts.empty() ? "" : fmt::format(" with {}", fmt::join(parts, ", "));
}

std::string symbol_text(const Module& module, const std::vector<Monomial>& symbol) {
  std::vector<std::string> terms;
  for (const Monomial& monomial : symbol) {
    const bool is_one = monomial.uniform == uniform_one;
    std::string text = is_one ? "" : monomial.uniform == uniform_zero ? "0" : module.uniforms[monomial.uniform].name;
    for (std::size_t a = 0; a < max_rank; ++a) {
      const bool vanishes = monomial.powers[a] >= vanishes_for_shortest;
      const int power = monomial.powers[a] % vanishes_for_shortest - (vanishes ? 1 : 0);
      if (vanishes) text += fmt::format("{}ia{}0", text.empty() ? "" : "*", axis_names[a]);
      if (power > 0) text += fmt::format("{}ia{}", text.empty() ? "" : "*", axis_names[a]);
      if (power > 1) text += fmt::format("^{}", power);
    }
    terms.push_back(text.empty() ? "1" : text);
  }
  return fmt::format("{}", fmt::join(terms, " + "));
}

/// iax stands for i times the angle along x, iax0 for the same but 0 for waves of two cells.
std::string transform_text(const Module& module, const Transform& transform) {
  std::vector<std::string> terms;
  for (const auto& [field, by] : transform.terms) {
    const auto [kind, number] = by.function;
    const std::string function =
        by.function ? fmt::format("{}{}({})*", name_of(kind), number, symbol_text(module, by.argument)) : "";
    terms.push_back(fmt::format("{} by {}({}){}", field, function, symbol_text(module, by.factor),
                                by.within_two_thirds ? " within two_thirds" : ""));
  }
  return fmt::format("transform {} to {}", fmt::join(terms, ", "), transform.result);
}

std::string operation_text(const Module& module, const Operation& operation, const std::string& margin);

std::string repeat_text(const Module& module, const Repeat& repeat, const std::string& margin) {
  std::string passes = fmt::format("{}", repeat.count);
  if (repeat.counter >= 0)
    passes = fmt::format("{} in {}", module.counters[repeat.counter],
                         repeat.is_backwards ? passes + " .. 0" : "0 .. " + passes);
  std::string text = fmt::format("repeat {} {{\n", passes);
  const auto add = [&](const std::string& line) { text += margin + "  " + line + "\n"; };
  for (const TapeEntry& load : repeat.loads) add(fmt::format("load {} from {}", load.field, load.stack));
  for (const TapeEntry& save : repeat.saves) add(fmt::format("save {} in {}", save.field, save.stack));
  for (const Operation& operation : repeat.body) add(operation_text(module, operation, margin + "  "));
  for (const LoopCarried& carry : repeat.carries)
    add(fmt::format("swap {}, {} to {}", carry.state, carry.next, carry.result));
  return text + margin + "}";
}

std::string text_of(const OperatorTraits& traits) {
  return std::string(traits.is_symmetric ? " symmetric" : "") +
         (traits.takes_constants_to_zero ? " takes constants to 0" : "") + (traits.sums_to_zero ? " sums to 0" : "");
}

std::string solve_text(const Module& module, const Solve& solve, const std::string& margin) {
  const std::string warning = solve.by.warns ? " or warn" : "";
  const std::string smoother =
      (solve.by.smoother == Smoother::automatic ? "" : fmt::format(" smoother {}", name_of(solve.by.smoother))) +
      (solve.by.preconditioner == Preconditioner::automatic
           ? ""
           : fmt::format(" preconditioner {}", name_of(solve.by.preconditioner))) +
      (solve.preconditioner ? " preconditioner " + network::text_of(*solve.preconditioner) : "");
  std::string text = fmt::format("{} {} = {} for {}{} by {}{} tolerance {} iterations {}{} reach {}{} {{\n",
                                 solve.is_linear ? "solve" : "newton", fmt::join(solve.images, ", "),
                                 fmt::join(solve.rights, ", "), fmt::join(solve.unknowns, ", "),
                                 solve.guesses.empty() ? "" : fmt::format(" from {}", fmt::join(solve.guesses, ", ")),
                                 name_of(solve.by.method), smoother, solve.by.tolerance, solve.by.most_iterations,
                                 warning, fmt::join(solve.reach, ", "), text_of(solve.traits));
  const auto add_list = [&](const char* word, const std::vector<std::string>& names) {
    if (!names.empty()) text += fmt::format("{}  {} {}\n", margin, word, fmt::join(names, ", "));
  };
  add_list("coefficients", solve.coefficients);
  add_list("params", solve.params);
  for (const Operation& operation : solve.body)
    text += margin + "  " + operation_text(module, operation, margin + "  ") + "\n";
  for (const Operation& step : solve.step)
    text += margin + "  step " + operation_text(module, step, margin + "  ") + "\n";
  return text + margin + "}";
}

/// Lines but the first begin with `margin`.
std::string operation_text(const Module& module, const Operation& operation, const std::string& margin) {
  return match(
      operation, [&](const Fill& f) { return fill_text(module, f); },
      [&](const Fold& f) {
        return fmt::format("fold {}{} {}", f.field, grow_text(f.grow), boundary_text(module, f.axes));
      },
      [&](const Reduce& r) {
        std::vector<char> axes;
        for (int a = 0; a < max_rank; ++a) {
          if (r.over[static_cast<std::size_t>(a)]) axes.push_back(axis_names[a]);
        }
        return fmt::format("reduce {} = {} {} over {}", r.result, name_of(r.kind), r.field, fmt::join(axes, ", "));
      },
      [](const NetworkCall& i) { return network::text_of(i); },
      [&](const Transform& t) { return transform_text(module, t); },
      [&](const Sweep& s) {
        std::string text =
            fmt::format("sweep {}{}{}{}", s.row, binding_text(module, s), grow_text(s.grow), s.serial ? " serial" : "");
        for (const Fill& fill : s.then) text += " then " + fill_text(module, fill);
        return text;
      },
      [&](const Solve& s) { return solve_text(module, s, margin); },
      [&](const Repeat& r) { return repeat_text(module, r, margin); });
}

std::string program_text(const Module& module, const Program& program) {
  std::vector<std::string> halo;
  for (std::size_t a = 0; a < program.axes.size(); ++a) halo.push_back(fmt::format("{}", program.halo[a]));
  const auto inputs_end = program.fields.begin() + program.input_count;
  std::string out = fmt::format("program {} {{\n  axes {}\n", program.name, axes_text(program.axes));
  out += fmt::format("  inputs {}\n", fmt::join(program.fields.begin(), inputs_end, ", "));
  out += fmt::format("  fields {}\n", fmt::join(inputs_end, program.fields.end(), ", "));
  if (!program.sums.empty()) out += fmt::format("  sums {}\n", fmt::join(program.sums, ", "));
  out += fmt::format("  halo {}\n", fmt::join(halo, ", "));
  if (!program.stacks.empty()) out += fmt::format("  stacks {}\n", fmt::join(program.stacks, ", "));
  for (const Fill& fill : program.prepare) out += fmt::format("  prepare {}\n", fill_text(module, fill));
  for (const Operation& operation : program.body) out += fmt::format("  {}\n", operation_text(module, operation, "  "));
  for (const Swap& swap : program.swaps)
    out += fmt::format("  swap {}, {}{}\n", swap.state, swap.next, swap.is_over ? " over it" : "");
  if (!program.keeps.empty()) out += fmt::format("  keep {}\n", fmt::join(program.keeps, ", "));
  return out + "}\n";
}

}  // namespace

std::string print(const Module& module, const Row& row, const Expr& e) { return ExprPrinter(module, &row).text(e); }

std::string print(const Module& module, const UniformDef& uniform) {
  const std::string value = ExprPrinter(module, nullptr).text(uniform.value);
  return value == uniform.name ? value : fmt::format("{} = {}", uniform.name, value);
}

std::string print(const Module& module, const Row& row) {
  const ExprPrinter printer(module, &row);
  std::string out = fmt::format("row {} {{\n", row.name);
  const std::tuple<std::string_view, Stream::Mode, bool> modes[] = {{"out", Stream::Mode::out, false},
                                                                    {"inout", Stream::Mode::inout, false},
                                                                    {"in", Stream::Mode::in, false},
                                                                    {"once in", Stream::Mode::in, true}};
  for (const auto& [word, mode, is_even] : modes) {
    const std::string list = stream_list(row, mode, is_even);
    if (!list.empty()) out += fmt::format("  {} {}\n", word, list);
  }
  if (!row.grids.empty()) out += fmt::format("  grid {}\n", fmt::join(row.grids, ", "));
  for (const Let& let : row.lets) out += fmt::format("  let {} = {}\n", let.name, printer.text(let.value));
  for (const Store& store : row.stores) {
    out += fmt::format("  {} {} {}\n", stream_text(row.streams[store.stream], row.rank), store.accumulate ? "+=" : "=",
                       printer.text(store.value));
  }
  for (const Sum& sum : row.sums) out += fmt::format("  sum {} += {}\n", sum.name, printer.text(sum.value));
  for (const Scatter& scatter : row.scatters) {
    out += fmt::format("  {} += {}\n", printer.interp_text(scatter.target), printer.text(scatter.value));
  }
  return out + "}\n";
}

std::string print(const Module& module) {
  std::string out;
  if (module.real != Precision::f64) out += fmt::format("real {}\n", name_of(module.real));
  if (!module.params.empty()) out += fmt::format("params {}\n", fmt::join(module.params, ", "));
  if (!module.counters.empty()) out += fmt::format("counters {}\n", fmt::join(module.counters, ", "));
  for (const UniformDef& uniform : module.uniforms) out += fmt::format("uniform {}\n", print(module, uniform));
  for (const Row& row : module.rows) out += fmt::format("{}{}", out.empty() ? "" : "\n", print(module, row));
  for (const Program& program : module.programs) {
    out += fmt::format("{}{}", out.empty() ? "" : "\n", program_text(module, program));
  }
  return out;
}

}  // namespace dpde::loop
