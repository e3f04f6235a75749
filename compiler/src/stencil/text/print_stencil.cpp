// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/print_stencil.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "network/print_network.h"
#include "stencil/build.h"
#include "stencil/lower/custom_adjoint.h"
#include "stencil/walk.h"
#include "support/assert.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

constexpr int precedence_of_product = 5;
constexpr int precedence_of_power = 7;
constexpr int precedence_of_atom = 8;
constexpr std::string_view axis_names = "xyz";

std::string offsets_text(const Offset& offset, int rank) {
  std::vector<std::string> parts;
  for (int axis = 0; axis < rank; ++axis) {
    parts.push_back(offset[axis] > 0 ? fmt::format("+{}", offset[axis]) : fmt::format("{}", offset[axis]));
  }
  return fmt::format("[{}]", fmt::join(parts, ", "));
}

std::string access_text(const std::string& field, const Offset& offset, int rank) {
  return offset == Offset{} ? field : field + offsets_text(offset, rank);
}

/// True for a*b and a/b if the first factor is neither a number nor negated: -a*b reads back as -(a*b).
bool takes_minus_in_front(const Expr& e) {
  const Binary* b = as<Binary>(e);
  if (!b || precedence(b->op) != precedence_of_product) return false;
  const Binary* left = as<Binary>(b->left);
  if (left && precedence(left->op) == precedence_of_product) return takes_minus_in_front(b->left);
  return !is<Literal, Neg>(b->left);
}

/// A text and the precedence of its outermost operator.
struct Piece {
  std::string text;
  int binding = precedence_of_atom;
};

class ExprPrinter {
 public:
  explicit ExprPrinter(int rank) : rank_(rank) {}

  std::string text(const Expr& e, int least = 0) const {
    Piece piece = print(e);
    return piece.binding < least ? fmt::format("({})", piece.text) : piece.text;
  }

  std::string interp_text(const Interp& i) const {
    return fmt::format("{}({}, {})", interp_name(i.along), access_text(i.field, i.offset, rank_), list(i.displacement));
  }

 private:
  std::string list(const std::vector<Expr>& expressions) const {
    std::vector<std::string> texts;
    for (const Expr& e : expressions) texts.push_back(text(e));
    return fmt::format("{}", fmt::join(texts, ", "));
  }

  Piece print(const Expr& e) const {
    return match(
        e->kind,
        [](const Literal& l) {
          const bool minus = l.value < 0;
          return Piece{fmt::format("{}", l.value == 0 ? 0.0 : l.value), minus ? unary_precedence : precedence_of_atom};
        },
        [](const Param& p) { return Piece{p.name}; }, [](const Local& l) { return Piece{l.name}; },
        [&](const Access& a) { return Piece{access_text(a.field, a.offset, rank_)}; },
        [&](const Interp& i) { return Piece{interp_text(i)}; },
        [&](const Inside& i) {
          const std::string grow = i.grow == 0 ? "" : fmt::format(" grow {}", i.grow);
          return Piece{fmt::format("inside{}{}", offsets_text(i.offset, rank_), grow)};
        },
        [&](const Neg& n) {
          const bool in_front = takes_minus_in_front(n.operand);
          return Piece{fmt::format("-{}", text(n.operand, in_front ? 0 : precedence_of_power)),
                       in_front ? precedence_of_product : unary_precedence};
        },
        [&](const Binary& b) { return print_binary(b); },
        [&](const Call& c) { return Piece{fmt::format("{}({})", name_of(c.fn), list(c.arguments))}; },
        [&](const Select& s) {
          return Piece{fmt::format("if({})", list({s.condition, s.yes, s.no}))};
        });
  }

  Piece print_binary(const Binary& b) const {
    const int own = precedence(b.op);
    int left = own, right = own + 1;  // associates to the left
    bool spaced = true;
    if (b.op == BinaryOp::power) {
      left = precedence_of_atom;
      right = precedence_of_power;
    } else if (own == precedence(BinaryOp::less)) {
      left = own + 1;  // comparisons do not chain
    }
    if (own >= precedence_of_product) {
      spaced = false;
      right = std::max(right, precedence_of_power);  // a*(-2), where a*-2 would read badly
    }
    const std::string_view gap = spaced ? " " : "";
    return {fmt::format("{}{}{}{}{}", text(b.left, left), gap, spelling(b.op), gap, text(b.right, right)), own};
  }

  int rank_;
};

/// Whether an offset, interp or inside in the body shows the number of axes.
bool shows_axes(const Kernel& kernel) {
  return !kernel.scatters.empty() || any_part(kernel, [](const Expr& e) {
    const Access* a = as<Access>(e);
    return (a && a->offset != Offset{}) || is<Interp, Inside>(e);
  });
}

void add_params_of_formulas(const Kernel& kernel, std::vector<std::string>& params) {
  for (const CustomAdjoint& given : kernel.custom_adjoints) {
    visit(given.value, [&](const Expr& e) {
      const Param* p = as<Param>(e);
      if (p && !contains(params, p->name)) params.push_back(p->name);
    });
  }
}

std::string parameters_text(const Kernel& kernel) {
  Signature s = signature(kernel);
  add_params_of_formulas(kernel, s.params);
  std::vector<std::string> parts;
  for (const Signature::Read& read : s.reads) {
    if (contains(s.writes, read.field) || contains(s.updates, read.field)) continue;
    const int halo = *std::max_element(read.halo.begin(), read.halo.end());
    parts.push_back(fmt::format("{}: field{}", read.field, halo == 0 ? "" : fmt::format(" halo {}", halo)));
  }
  for (const std::string& field : s.writes) {
    if (!contains(s.updates, field)) parts.push_back(fmt::format("out {}: field", field));
  }
  for (const std::string& field : s.updates) parts.push_back(fmt::format("inout {}: field", field));
  for (const std::string& sum : s.sums) parts.push_back(fmt::format("sum {}: param", sum));
  if (!s.params.empty()) parts.push_back(fmt::format("{}: param", fmt::join(s.params, ", ")));
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string condition_text(const Side& side) {
  std::vector<std::string> given;
  for (const Expr* part : given_parts(side)) given.push_back(print(*part, 1));
  return condition_of(side.kind).text(given);
}

std::string side_text(const Side& side) {
  const std::string condition = condition_text(side);
  return side.on_wall ? fmt::format("on_wall({})", condition) : condition;
}

std::string boundary_text(const std::vector<AxisBoundary>& axes) {
  const auto is_periodic = [](const AxisBoundary& axis) { return axis.topology == Topology::periodic; };
  if (std::all_of(axes.begin(), axes.end(), is_periodic)) return "periodic";
  std::vector<std::string> parts;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const char name = axis_names[a];
    const std::string low = side_text(axes[a].low), high = side_text(axes[a].high);
    if (is_periodic(axes[a])) {
      parts.push_back(fmt::format("{} periodic", name));
    } else if (low == high) {
      parts.push_back(fmt::format("{} = {}", name, low));
    } else {
      parts.push_back(fmt::format("{}.low = {}, {}.high = {}", name, low, name, high));
    }
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string grow_text(int grow) { return grow == 0 ? "" : fmt::format(" grow {}", grow); }

std::string reduce_text(const Reduce& reduce, std::size_t rank) {
  std::vector<char> axes;
  for (std::size_t a = 0; a < rank; ++a) {
    if (reduce.over[a]) axes.push_back(axis_names[a]);
  }
  const std::string over = axes.size() == rank ? "" : fmt::format(" over {}", fmt::join(axes, ", "));
  return fmt::format("reduce {} = {} {}{}", reduce.result, name_of(reduce.kind), reduce.field, over);
}

std::string multiplier_text(const Multiplier& by) {
  const std::string within = by.within_two_thirds ? " within two_thirds" : "";
  if (!by.function) return print(by.factor, 1) + within;
  const auto [kind, number] = by.function;
  const std::string value = fmt::format("{}{}({})", name_of(kind), number, print(by.argument, 1));
  return value + (is_literal(by.factor, 1) ? "" : fmt::format("*({})", print(by.factor, 1))) + within;
}

std::string transform_text(const Transform& transform) {
  std::vector<std::string> terms;
  for (const Transform::Term& term : transform.terms)
    terms.push_back(fmt::format("{} by {}", term.field, multiplier_text(term.by)));
  return fmt::format("transform {} to {}", fmt::join(terms, ", "), transform.result);
}

std::string statement_text(const Statement& statement, std::size_t rank, const std::string& margin);

std::string repeat_text(const Repeat& repeat, std::size_t rank, const std::string& margin) {
  const Counter& counter = repeat.counter;
  const std::string passes = counter.name.empty()   ? fmt::format("{}", repeat.count)
                             : counter.is_backwards ? fmt::format("{} in {} .. 0", counter.name, repeat.count)
                                                    : fmt::format("{} in 0 .. {}", counter.name, repeat.count);
  std::string text = fmt::format("repeat {} {{\n", passes);
  const auto add = [&](const std::string& line) { text += margin + "  " + line + "\n"; };
  for (const TapeEntry& load : repeat.loads) add(fmt::format("load {} from {}", load.field, load.stack));
  for (const TapeEntry& save : repeat.saves) add(fmt::format("save {} in {}", save.field, save.stack));
  for (const Statement& statement : repeat.body) add(statement_text(statement, rank, margin + "  "));
  std::vector<std::string> results;
  for (const LoopCarried& carry : repeat.carries) {
    add(fmt::format("swap {}, {}", carry.state, carry.next));
    results.push_back(carry.result);
  }
  return text + margin + "}" + (results.empty() ? "" : fmt::format(" to {}", fmt::join(results, ", ")));
}

std::string solve_text(const Solve& solve, std::size_t rank, const std::string& margin) {
  std::string text =
      fmt::format("{} {} = {} for {}", solve.is_linear ? "solve" : "newton", fmt::join(solve.images, ", "),
                  fmt::join(solve.rights, ", "), fmt::join(solve.unknowns, ", "));
  if (!solve.guesses.empty()) text += fmt::format(" from {}", fmt::join(solve.guesses, ", "));
  if (solve.by.method != SolveMethod::automatic) text += fmt::format(" by {}", name_of(solve.by.method));
  if (solve.by.smoother != Smoother::automatic) text += fmt::format(" smoother {}", name_of(solve.by.smoother));
  if (solve.by.preconditioner != Preconditioner::automatic)
    text += fmt::format(" preconditioner {}", name_of(solve.by.preconditioner));
  if (const auto& call = solve.preconditioner)
    text += fmt::format(" preconditioner {}({}) to {}", call->network, fmt::join(call->inputs, ", "),
                        call->results.front());
  if (solve.by.tolerance != SolveBy{}.tolerance) text += fmt::format(" tolerance {}", solve.by.tolerance);
  if (solve.by.most_iterations != SolveBy{}.most_iterations)
    text += fmt::format(" iterations {}", solve.by.most_iterations);
  if (solve.by.warns) text += " or warn";
  text += " {\n";
  for (const Statement& statement : solve.body)
    text += margin + "  " + statement_text(statement, rank, margin + "  ") + "\n";
  return text + margin + "}";
}

/// Lines but the first begin with `margin`.
std::string statement_text(const Statement& statement, std::size_t rank, const std::string& margin) {
  return match(
      statement, [](const Fill& f) { return fmt::format("fill {} {}", f.field, boundary_text(f.axes)); },
      [](const Fold& f) { return fmt::format("fold {}{} {}", f.field, grow_text(f.grow), boundary_text(f.axes)); },
      [&](const Reduce& r) { return reduce_text(r, rank); }, [](const NetworkCall& i) { return network::text_of(i); },
      [](const Transform& t) { return transform_text(t); },
      [](const Run& r) { return fmt::format("run {}{}", r.kernel, grow_text(r.grow)); },
      [&](const Solve& s) { return solve_text(s, rank, margin); },
      [&](const Repeat& r) { return repeat_text(r, rank, margin); });
}

/// "axes x periodic, y bounded", or "" if fills show each axis' topology and kernels or fills show the number of axes.
std::string axes_text(const Program& program) {
  const auto is_halo = [](const Statement& statement) { return is_one_of<Fill, Fold>(statement); };
  const auto is_run = [](const Statement& statement) { return is_one_of<Run>(statement); };
  const bool has_fill = find_statement(program.body, is_halo) != nullptr;
  const bool has_run = find_statement(program.body, is_run) != nullptr;
  const bool all_periodic = std::count(program.axes.begin(), program.axes.end(), Topology::bounded) == 0;
  if (has_fill && (!all_periodic || has_run || program.axes.size() == 1)) return "";
  std::vector<std::string> parts;
  for (std::size_t a = 0; a < program.axes.size(); ++a) {
    parts.push_back(
        fmt::format("{} {}", axis_names[a], program.axes[a] == Topology::periodic ? "periodic" : "bounded"));
  }
  return fmt::format("axes {}", fmt::join(parts, ", "));
}

}  // namespace

std::string print(const Expr& e, int rank) { return ExprPrinter(rank).text(e); }

std::string print(const Kernel& kernel) {
  const ExprPrinter printer(kernel.rank);
  const bool tell_axes = kernel.rank > 1 && !shows_axes(kernel);
  std::string out = fmt::format("kernel {}({}){} {{\n", kernel.name, parameters_text(kernel),
                                tell_axes ? fmt::format(" on {} axes", kernel.rank) : "");
  for (const Let& let : kernel.lets) out += fmt::format("  let {} = {}\n", let.name, printer.text(let.value));
  for (const Store& store : kernel.stores) {
    out += fmt::format("  {} {} {}\n", store.field, store.accumulate ? "+=" : "=", printer.text(store.value));
  }
  for (const Sum& sum : kernel.sums) out += fmt::format("  {} += {}\n", sum.name, printer.text(sum.value));
  for (const Scatter& scatter : kernel.scatters) {
    out += fmt::format("  {} += {}\n", printer.interp_text(scatter.target), printer.text(scatter.value));
  }
  for (const CustomAdjoint& given : kernel.custom_adjoints) {
    const bool is_field = signature(kernel).find_read(given.input) != nullptr;
    out += fmt::format("  adjoint {} {} {}\n", bar_of(given.input), is_field ? "=" : "+=", printer.text(given.value));
  }
  return out + "}\n";
}

std::string print(const Program& program) {
  std::string out = fmt::format("program {} {{\n", program.name);
  const std::string axes = axes_text(program);
  if (!axes.empty()) out += fmt::format("  {}\n", axes);
  for (const Statement& statement : program.body)
    out += fmt::format("  {}\n", statement_text(statement, program.axes.size(), "  "));
  for (const Swap& swap : program.swaps) out += fmt::format("  swap {}, {}\n", swap.state, swap.next);
  if (!program.keeps.empty()) out += fmt::format("  keep {}\n", fmt::join(program.keeps, ", "));
  return out + "}\n";
}

std::string print(const Loop& loop) {
  return fmt::format("loop {} in {} .. {} {{ {} }}\n", loop.counter, loop.from, loop.to,
                     fmt::join(loop.programs, "; "));
}

std::string print(const Module& module) {
  std::vector<std::string> blocks;
  for (const network::Network& network : module.networks) blocks.push_back(network::print(network));
  for (const Kernel& kernel : module.kernels) blocks.push_back(print(kernel));
  for (const Program& program : module.programs) blocks.push_back(print(program));
  for (const Loop& loop : module.loops) blocks.push_back(print(loop));
  return fmt::format("{}", fmt::join(blocks, "\n"));
}

}  // namespace dpde::stencil
