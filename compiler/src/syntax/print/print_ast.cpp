// SPDX-License-Identifier: Apache-2.0
// Every item is printed on one line. A block written on one line stays so if it has no comments and fits.
#include "syntax/print/print_ast.h"

#include <fmt/format.h>

#include "support/assert.h"
#include "support/match.h"
#include "support/side_conditions.h"
#include "syntax/print/print_parts.h"

namespace dpde::ast {
namespace {

constexpr std::size_t max_columns = 120;

std::string print_definition(std::string_view keyword, const Identifier& name, const Expr& value) {
  return fmt::format("{}{} = {}", keyword, name.name, print(value));
}

// ---- items ---------------------------------------------------------------------------------------------------------
std::string print_grid(const GridItem& grid) {
  std::string text =
      fmt::format("grid {} = {} .. {}{}", grid.axis.name, print(grid.low), print(grid.high), print_unit(grid.unit));
  if (grid.cells) text += ", cells " + print(*grid.cells);
  if (grid.periodic) text += ", periodic";
  if (grid.stretched) text += ", stretched " + print(*grid.stretched);
  return text;
}

std::string print_boundary(const BoundaryItem& boundary) {
  std::string text = "boundary " + boundary.field.name;
  if (boundary.bare) return text + " = " + print(boundary.sides[0].value);
  const char* separator = ": ";
  for (const BoundarySide& side : boundary.sides) {
    text += separator + print_definition("", side.place, side.value);
    separator = ", ";
  }
  return text;
}

/// x periodic, y.low = 0; the place "all" is omitted if it is the only one.
std::string print_fill(const FillItem& fill) {
  std::string text = fmt::format("{} {}", fill.fold ? "fold" : "fill", fill.field.name);
  if (fill.grow != 0) text += fmt::format(" grow {}", fill.grow);
  const char* separator = " ";
  for (const BoundarySide& side : fill.sides) {
    const bool alone = side.place.name == "all" && fill.sides.size() == 1;
    const auto* word = std::get_if<Name>(&side.value->kind);
    const bool bare = word && (word->name == "periodic" || (alone && is_side_word(word->name)));
    text += fmt::format("{}{}{}{}", separator, alone ? "" : side.place.name + " ", bare ? "" : "= ", print(side.value));
    separator = ", ";
  }
  return text;
}

std::string print_time(const TimeItem& time) {
  std::string text = fmt::format("time {} .. {}{}", print(time.from), print(time.to), print_unit(time.unit));
  if (time.step) text += ", step " + print(*time.step);
  if (time.courant) text += ", courant " + print(*time.courant);
  if (time.speed) text += ", speed " + print(*time.speed);
  if (time.tolerance) text += ", tolerance " + print(*time.tolerance);
  if (time.absolute) text += ", absolute " + print(*time.absolute);
  if (time.first) text += ", first " + print(*time.first);
  if (time.steady) text += ", until steady " + print(*time.steady);
  return text;
}

std::string print_data(const DataItem& data) {
  std::string text = fmt::format("data {}{} = {}", data.name.name, print_placement(data.on), print(data.value));
  if (data.scene) text += " from scene " + data.scene->name;
  return text + print_unit(data.unit) + print_when(data.when);
}

std::string print_unknown(const UnknownItem& unknown) {
  std::string text = fmt::format("unknown {}{}", unknown.initial ? "initial " : "", unknown.name.name);
  if (unknown.from) text += " from " + print(*unknown.from);
  if (unknown.low && unknown.high) text += fmt::format(" in {} .. {}", print(*unknown.low), print(*unknown.high));
  return text;
}

std::string print_using(const UsingItem& use) {
  std::string text = "using " + print(use.optimiser);
  for (const Argument& option : use.options) text += fmt::format(", {} {}", option.name, print(option.value));
  return text;
}

const char* word_for(TestItem::Kind kind) {
  switch (kind) {
    case TestItem::Kind::test: return "test ";
    case TestItem::Kind::statistic: return "statistic ";
    case TestItem::Kind::spectrum: return "spectrum ";
    case TestItem::Kind::correlation: return "correlation ";
    case TestItem::Kind::growth: return "growth ";
  }
  unreachable("kind of test");
}

std::string print_test(const TestItem& test) {
  const bool is_growth = test.kind == TestItem::Kind::growth;
  std::string text = is_growth ? word_for(test.kind) + test.name.name
                               : print_definition(word_for(test.kind), test.name, test.value) + print_when(test.when);
  if (test.above) text += " above " + print(*test.above);
  if (test.on) text += " on " + print(*test.on);
  if (test.steps) text += fmt::format(" for {} steps", print(*test.steps));
  const char* separator = " beside ";
  for (const TestItem::Baseline& beside : test.beside) {
    text += separator + beside.scene.name + (beside.on ? " on " + print(*beside.on) : "");
    if (!beside.map.empty()) text += " where " + print_formulas(beside.map);
    separator = ", ";
  }
  return text;
}

std::string print_reduce(const ReduceItem& item) {
  const std::string over = item.axes.empty() ? "" : " over " + print_names(item.axes);
  return fmt::format("reduce {} = {} {}{}", item.result.name, name_of(item.kind), item.field.name, over);
}

std::string print_transform(const TransformItem& item) {
  std::string text = "transform ";
  for (const TransformItem::Term& term : item.terms) {
    if (&term != &item.terms.front()) text += ", ";
    text +=
        fmt::format("{} by {}{}", term.field.name, print(term.by), term.within_two_thirds ? " within two_thirds" : "");
  }
  return text + " to " + item.result.name;
}

std::string print_run(const RunItem& run) {
  return fmt::format("run {}{}", run.kernel.name, run.grow != 0 ? fmt::format(" grow {}", run.grow) : "");
}

std::string print_adjoint(const AdjointItem& item) {
  return fmt::format("adjoint {} {} {}", item.target.name, item.accumulate ? "+=" : "=", print(item.value));
}

std::string print_axes(const AxesItem& item) {
  std::string text;
  for (const AxesItem::Axis& axis : item.axes) {
    text += fmt::format("{}{} {}", text.empty() ? "axes " : ", ", axis.name.name,
                        axis.topology == Topology::periodic ? "periodic" : "bounded");
  }
  return text;
}

std::string print_event(const EventItem& i) {
  std::string text = i.every ? "every " + print(*i.every) : i.times.empty() ? "after step" : "at t = ";
  for (const Expr& time : i.times) text += (&time == &i.times.front() ? "" : ", ") + print(time);
  for (const EventItem::Update& update : i.updates) {
    const char* separator = &update == &i.updates.front() ? ": " : ", ";
    text +=
        fmt::format("{}{} {} {}", separator, update.field.name, update.accumulate ? "+=" : "=", print(update.value));
  }
  return text;
}

const char* word_of(ApplyItem::Mode mode) {
  switch (mode) {
    case ApplyItem::Mode::value: return "apply";
    case ApplyItem::Mode::tangent: return "tangent";
    case ApplyItem::Mode::adjoint: return "adjoint";
    case ApplyItem::Mode::second: return "second";
  }
  return "";
}

std::string print_apply(const ApplyItem& item) {
  using Mode = ApplyItem::Mode;
  std::string text = fmt::format("{} {}({})", word_of(item.mode), item.network.name, print_names(item.inputs));
  if (item.mode != Mode::value) text += " by " + print_names(item.by);
  return text + " to " + print_names(item.to) + (item.weights ? " weights" : "");
}

std::string print_layer(const LayerItem& item) {
  std::string text;
  for (const Argument& argument : item.arguments) {
    if (!text.empty()) text += ", ";
    text += (argument.name.empty() ? "" : argument.name + " = ") + print(argument.value);
  }
  if (item.parentheses) return fmt::format("{}({})", item.layer.name, text);
  return item.layer.name + (text.empty() ? "" : " ") + text;
}

std::string print_padding(const PaddingItem& item) {
  std::string text = "padding";
  for (const PaddingItem::Axis& axis : item.axes) {
    text += &axis == &item.axes.front() ? " " : ", ";
    text += (axis.name.name.empty() ? "" : axis.name.name + " ") + axis.padding.name;
  }
  return text;
}

std::string print_start(const StartItem& item) {
  std::string text = "initial ";
  if (item.method) text += item.method->name + (item.seed ? ", " : "");
  return text + (item.seed ? "seed " + print(*item.seed) : "");
}

std::string print_symmetries(const SymmetryItem& item) {
  std::string text = "symmetric";
  for (const SymmetryItem::Part& part : item.parts) {
    text += (&part == &item.parts.front() ? " " : ", ") + part.word.name;
    if (part.axis) text += (part.word.name == "rotations" ? " about " : " ") + part.axis->name;
    if (!part.inputs.empty()) text += "(" + print_names(part.inputs) + ")";
  }
  return text;
}

std::string print_vary(const VaryItem& item) {
  if (item.from) return fmt::format("vary {} from {}", item.name.name, print(*item.from));
  if (!item.low) return fmt::format("vary {} in {}", item.name.name, print_list(item.values));
  return fmt::format("vary {} in {} .. {}{}", item.name.name, print(*item.low), print(*item.high),
                     item.is_log ? " logarithmic" : "");
}

std::string print_frames(const FramesItem& item) {
  return fmt::format("frames {}every {}{}{}", item.of.empty() ? "" : fmt::format("of {} ", print_formulas(item.of)),
                     print(item.every), item.from ? " from " + print(*item.from) : "",
                     item.to ? " to " + print(*item.to) : "");
}

/// One line or several; all but the first are indented.
std::string print_repeat(const RepeatItem& repeat);

std::string print_stack(const StackItem& i) {
  return fmt::format("{} {} {} {}", i.is_save ? "save" : "load", i.field.name, i.is_save ? "in" : "from", i.stack.name);
}
std::string print_branch(const BranchItem& branch);
std::string print_solve(const SolveItem& solve);

std::string print_item(const Item& item) {
  return match(
      item.kind, [](const FieldItem& i) { return print_field(i); },
      [](const CoefficientItem& i) { return print_coefficient(i); }, [](const ParamItem& i) { return print_params(i); },
      [](const ControlItem& i) { return "control " + print_names(i.names, i.units); },
      [](const LetItem& i) { return print_definition("let ", i.name, i.value) + print_unit(i.unit); },
      [](const EquationItem& i) { return fmt::format("dt({}) = {}", i.field.name, print(i.rhs)); },
      [](const SolvedItem& i) { return print_solved(i); }, [](const ConstraintItem& i) { return print_constraint(i); },
      [](const HeldItem& i) { return print_held(i); }, [](const GridItem& i) { return print_grid(i); },
      [](const CoordinatesItem& i) { return "coordinates " + print(i.kind); },
      [](const ValueItem& i) {
        return print_definition(i.of ? i.name.name + " " : "", i.of.value_or(i.name), i.value) + print_unit(i.unit) +
               (i.every ? " every " + print(*i.every) : "");
      },
      [](const InitialItem& i) {
        return print_definition("initial ", i.field, i.value) + (i.at ? " at t = " + print(*i.at) : "") +
               (i.projected ? " projected" : "");
      },
      [](const ExactItem& i) { return print_definition("exact ", i.field, i.value); },
      [](const BoundaryItem& i) { return print_boundary(i); }, [](const TimeItem& i) { return print_time(i); },
      [](const StepItem& i) { return "step " + print(i.step); },
      [](const CellsItem& i) { return "cells " + print_list(i.counts); },
      [](const EventItem& i) { return print_event(i); },
      [](const SubcycleItem& i) { return fmt::format("subcycle {} in {}", print_names(i.fields), print(i.parts)); },
      [](const ObserveItem& i) { return print_definition("observe ", i.name, i.value) + print_unit(i.unit); },
      [](const OutputItem& i) {
        return "output " + print_names(i.fields) + (i.every ? " every " + print(*i.every) : "");
      },
      [](const DataItem& i) { return print_data(i); }, [](const UnknownItem& i) { return print_unknown(i); },
      [](const MinimiseItem& i) { return "minimise " + print(i.loss) + print_when(i.when); },
      [](const UsingItem& i) { return print_using(i); },
      [](const LearnItem& i) { return "learn " + i.network.name + (i.from ? " from " + print(*i.from) : ""); },
      [](const TestItem& i) { return print_test(i); },
      [](const AssignItem& i) {
        return fmt::format("{} {} {}", i.target.name, i.accumulate ? "+=" : "=", print(i.value));
      },
      [](const ScatterItem& i) { return fmt::format("{} += {}", print(i.target), print(i.value)); },
      [](const AdjointItem& i) { return print_adjoint(i); }, [](const FillItem& i) { return print_fill(i); },
      [](const ReduceItem& i) { return print_reduce(i); }, [](const TransformItem& i) { return print_transform(i); },
      [](const RunItem& i) { return print_run(i); },
      [](const SwapItem& i) { return fmt::format("swap {}, {}", i.state.name, i.next.name); },
      [](const StackItem& i) { return print_stack(i); }, [](const RepeatItem& i) { return print_repeat(i); },
      [](const SolveItem& i) { return print_solve(i); },
      [](const KeepItem& i) { return "keep " + print_names(i.names); }, [](const AxesItem& i) { return print_axes(i); },
      [](const ApplyItem& i) { return print_apply(i); }, [](const LayerItem& i) { return print_layer(i); },
      [](const BranchItem& i) { return print_branch(i); }, [](const PaddingItem& i) { return print_padding(i); },
      [](const StartItem& i) { return print_start(i); }, [](const SymmetryItem& i) { return print_symmetries(i); },
      [](const RealItem& i) { return "real " + i.precision.name; },
      [](const HostItem& i) { return "host weights " + print(i.weights); },
      [](const VaryItem& i) { return print_vary(i); }, [](const FramesItem& i) { return print_frames(i); },
      [](const OptionItem& i) { return i.name.name + " " + print(i.value) + (i.in ? " in " + print(*i.in) : ""); },
      [](const AccuracyItem& i) { return print_accuracy(i); },
      [](const ReferenceItem& i) { return "reference " + print(i.value); },
      [](const ChoicesItem& i) { return fmt::format("vary {} in {}", i.key.name, print_list(i.values)); },
      [](const ErrorItem& i) { return "error " + print_list(i.norms) + (i.at ? " at t = " + print(*i.at) : ""); });
}

// ---- headers -------------------------------------------------------------------------------------------------------
/// Words before and after the name: "out " and "field".
std::pair<const char*, const char*> words_of(KernelRole role) {
  switch (role) {
    case KernelRole::in: return {"", "field"};
    case KernelRole::out: return {"out ", "field"};
    case KernelRole::inout: return {"inout ", "field"};
    case KernelRole::param: return {"", "param"};
    case KernelRole::sum: return {"sum ", "param"};
  }
  unreachable("kernel role");
}

/// Adjacent parameters of the same type share it: u, v: field halo 1, nu, dt: param.
std::string print_parameters(const std::vector<KernelParameter>& parameters) {
  std::string text;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto same = [&](std::size_t j) {
      return j < parameters.size() && parameters[j].role == parameters[i].role &&
             parameters[j].halo == parameters[i].halo;
    };
    const auto [prefix, type] = words_of(parameters[i].role);
    if (i > 0) text += ", ";
    if (i == 0 || !same(i - 1)) text += prefix;
    text += parameters[i].name.name;
    if (same(i + 1)) continue;
    text += fmt::format(": {}", type);
    if (parameters[i].halo) text += fmt::format(" halo {}", *parameters[i].halo);
  }
  return text;
}

std::string print_kernel_header(const Kernel& kernel) {
  std::string text = fmt::format("kernel {}({})", kernel.name.name, print_parameters(kernel.parameters));
  if (kernel.axes) text += fmt::format(" on {} {}", *kernel.axes, *kernel.axes == 1 ? "axis" : "axes");
  return text;
}

std::string print_network_header(const Network& network) {
  std::string inputs = network.input_channels ? std::to_string(*network.input_channels) : "";
  for (const Network::Input& input : network.inputs) {
    inputs += (inputs.empty() ? "" : ", ") + input.name.name + (input.vector ? ": vector" : "");
  }
  std::string text = fmt::format("network {}({})", network.name.name, inputs);
  if (network.output_channels) text += fmt::format(" -> {}", *network.output_channels);
  if (!network.outputs.empty()) text += " -> " + print_names(network.outputs);
  return text;
}

std::string print_of(const char* keyword, const Identifier& name, std::vector<Identifier> of,
                     const std::vector<Identifier>& also, const std::optional<Identifier>& scheme) {
  of.insert(of.end(), also.begin(), also.end());
  return fmt::format("{} {} : {}{}", keyword, name.name, print_names(of), scheme ? " with " + scheme->name : "");
}

std::string print_scene(const Scene& scene) {
  if (!scene.like) return print_of("scene", scene.name, {scene.of}, scene.also, scene.scheme);
  return fmt::format("scene {} = {}{}", scene.name.name, scene.like->name,
                     scene.scheme ? " with " + scene.scheme->name : "");
}

std::string print_header(const DeclarationKind& kind) {
  return match(
      kind, [](const Model& d) { return "model " + d.name.name; }, [](const Scene& d) { return print_scene(d); },
      [](const Scheme& d) { return "scheme " + d.name.name; },
      [](const Task& d) { return print_of("task", d.name, {d.of}, {}, d.scheme); },
      [](const Kernel& d) { return print_kernel_header(d); }, [](const Program& d) { return "program " + d.name.name; },
      [](const Loop& d) { return fmt::format("loop {} in {} .. {}", d.counter.name, d.from, d.to); },
      [](const Function& d) {
        const std::string order = d.order ? fmt::format(" order {}", *d.order) : "";
        std::string text = fmt::format("{} {}({}){} = {}", d.order ? "operator" : "function", d.name.name,
                                       print_names(d.parameters), order, print(d.body));
        for (const AdjointItem& item : d.adjoints) text += "\n  " + print_adjoint(item);
        return text;
      },
      [](const Import& d) { return fmt::format("import \"{}\"", d.path); },
      [](const Network& d) { return print_network_header(d); },
      [](const DataSet& d) { return print_of("dataset", d.name, {d.of}, {}, d.scheme); },
      [](const Chart& d) { return print_of("chart", d.name, {d.of}, {}, d.scheme); });
}

// ---- blocks --------------------------------------------------------------------------------------------------------
/// One row of a block: an item, or a program in a loop.
struct Row {
  std::string text;
  Trivia trivia;
};

std::vector<Row> rows_of(const std::vector<Item>& items) {
  std::vector<Row> rows;
  for (const Item& item : items) rows.push_back({print_item(item), item.trivia});
  return rows;
}

std::vector<Row> rows_of(const DeclarationKind& kind) {
  std::vector<Row> rows;
  if (const auto* loop = std::get_if<Loop>(&kind)) {
    for (const Identifier& program : loop->body) rows.push_back({program.name, {}});
    return rows;
  }
  const std::vector<Item>* items = match(
      kind, [](const Model& d) -> const std::vector<Item>* { return &d.items; },
      [](const Scene& d) -> const std::vector<Item>* { return &d.items; },
      [](const Scheme& d) -> const std::vector<Item>* { return &d.items; },
      [](const Task& d) -> const std::vector<Item>* { return &d.items; },
      [](const Kernel& d) -> const std::vector<Item>* { return &d.items; },
      [](const Program& d) -> const std::vector<Item>* { return &d.items; },
      [](const Loop&) -> const std::vector<Item>* { unreachable("a loop has no items"); },
      [](const Function&) -> const std::vector<Item>* { unreachable("a function has no items"); },
      [](const Import&) -> const std::vector<Item>* { unreachable("an import has no items"); },
      [](const Network& d) -> const std::vector<Item>* { return &d.items; },
      [](const DataSet& d) -> const std::vector<Item>* { return &d.items; },
      [](const Chart& d) -> const std::vector<Item>* { return &d.items; });
  return rows_of(*items);
}

std::string print_comments(const std::vector<std::string>& comments, const char* indent) {
  std::string text;
  for (const std::string& comment : comments) text += comment.empty() ? "\n" : fmt::format("{}{}\n", indent, comment);
  return text;
}

std::string behind(const std::string& comment) { return comment.empty() ? "" : "  " + comment; }

/// { a; b }, or "" if the block does not fit on one line after the header.
std::string print_on_one_line(const BlockLayout& layout, const std::vector<Row>& rows, std::size_t header_size) {
  if (!layout.one_line || !layout.closing_comments.empty() || !layout.after.empty()) return {};
  std::string text;
  for (const Row& row : rows) {
    if (!row.trivia.before.empty() || !row.trivia.after.empty() || row.text.find('\n') != std::string::npos) return {};
    text += (text.empty() ? "" : "; ") + row.text;
  }
  text = text.empty() ? "{ }" : "{ " + text + " }";
  return header_size + 1 + text.size() <= max_columns ? text : "";
}

/// The header and its { ... }, without a final line break.
std::string print_block(const std::string& header, const BlockLayout& layout, const std::vector<Row>& rows) {
  const std::string line = print_on_one_line(layout, rows, header.size());
  if (!line.empty()) return fmt::format("{} {}", header, line);
  std::string text = fmt::format("{} {{{}\n", header, behind(layout.after));
  for (const Row& row : rows) {
    if (row.trivia.blank_before && &row != &rows.front()) text += '\n';
    text += print_comments(row.trivia.before, "  ");
    text += fmt::format("  {}{}\n", row.text, behind(row.trivia.after));
  }
  return text + print_comments(layout.closing_comments, "  ") + "}";
}

/// A nested block; all lines but the first are indented.
std::string print_inner_block(const std::string& header, const BlockLayout& layout, const std::vector<Item>& items) {
  const std::string block = print_comments(layout.before, "") + print_block(header, layout, rows_of(items));
  std::string text;
  for (const char c : block) {
    const bool begins_line = !text.empty() && text.back() == '\n';
    if (begins_line && c != '\n') text += "  ";
    text += c;
  }
  return text;
}

std::string print_repeat(const RepeatItem& repeat) {
  const std::string counter = repeat.counter ? repeat.counter->name + " in " : "";
  const char* from = repeat.counter && !repeat.is_backwards ? "0 .. " : "";
  const char* to = repeat.is_backwards ? " .. 0" : repeat.shared ? " shared" : "";
  const std::string block =
      print_inner_block(fmt::format("repeat {}{}{}{}", counter, from, repeat.count, to), repeat.layout, repeat.items);
  return repeat.to.empty() ? block : block + " to " + print_names(repeat.to);
}

std::string print_solve(const SolveItem& solve) {
  return print_inner_block(print_solve_head(solve), solve.layout, solve.items);
}

std::string print_branch(const BranchItem& branch) {
  const char* word = branch.join == BranchItem::Join::add ? "residual" : "skip";
  return print_inner_block(word, branch.layout, branch.items);
}

std::string print_declaration(const Declaration& declaration) {
  const std::string header = print_header(declaration.kind);
  const bool has_block =
      !std::holds_alternative<Function>(declaration.kind) && !std::holds_alternative<Import>(declaration.kind);
  if (!has_block) return header + behind(declaration.trivia.after) + "\n";
  return print_comments(declaration.layout.before, "") +
         print_block(header, declaration.layout, rows_of(declaration.kind)) + "\n";
}

}  // namespace

std::string print(const File& file) {
  std::string text;
  for (const Declaration& declaration : file.declarations) {
    if (declaration.trivia.blank_before && !text.empty()) text += '\n';
    text += print_comments(declaration.trivia.before, "");
    text += print_declaration(declaration);
  }
  return text + print_comments(file.trailing_comments, "");
}

}  // namespace dpde::ast
