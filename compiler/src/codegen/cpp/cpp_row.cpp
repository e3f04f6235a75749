// SPDX-License-Identifier: Apache-2.0
// The loop has no indirect calls, no remainder loop and no aliases between cells, so that g++ and clang vectorise it.
// Pointers are __restrict, except where a value may overwrite the one that it replaces. Reads of a field that differ
// only along the row share one pointer.
#include "codegen/cpp/cpp_row.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <vector>

#include "codegen/cpp/cpp_elementary.h"
#include "codegen/cpp/cpp_expression.h"
#include "codegen/cpp/cpp_helpers.h"
#include "codegen/cpp/cpp_names.h"
#include "codegen/cpp/emit_cpp.h"
#include "loop/expressions.h"
#include "loop/print_loop.h"
#include "source/utf8.h"

namespace dpde::codegen {

namespace {

constexpr std::array<char, loop::max_rank> axis_names = {'x', 'y', 'z'};
constexpr std::size_t line_width = 116;

/// head + items separated by commas + tail, broken so that lines stay short.
std::string wrapped(const std::string& head, const std::vector<std::string>& items, const std::string& tail) {
  std::string out, line = head;
  const std::string indent(std::min<std::size_t>(head.size(), 48), ' ');
  for (std::size_t i = 0; i < items.size(); ++i) {
    const std::string item = items[i] + (i + 1 == items.size() ? tail : ",");
    const bool starts_line = i == 0 || line == indent;
    if (!starts_line && line.size() + item.size() + 1 > line_width) {
      out += line + "\n";
      line = indent + item;
    } else {
      line += (i == 0 ? "" : " ") + item;
    }
  }
  return out + line + (items.empty() ? tail : "") + "\n";
}

std::string plus(const std::string& text, int offset) {
  return offset == 0 ? text : fmt::format("{} {} {}", text, offset < 0 ? '-' : '+', std::abs(offset));
}

/// Formats text as a comment: every line after "// ".
std::string commented(const std::string& text) {
  std::string out;
  for (std::size_t start = 0; start < text.size();) {
    const std::size_t end = text.find('\n', start);
    out += "// " + text.substr(start, end - start) + "\n";
    start = end + 1;
  }
  return out;
}

class RowEmitter {
 public:
  RowEmitter(const loop::Module& module, const loop::Row& row, const SourceFile* source, const std::string& linkage)
      : module_(module),
        row_(row),
        source_(source),
        linkage_(linkage),
        names_(cpp_names(module, row)),
        expression_(leaves_, module.real),
        real_(cpp_real(module.real)) {
    set_leaves();
    find_places();
  }

  std::string emit() const {
    return commented(loop::print(module_, row_)) + head() + places() + masks_of_row() + loop() + sums() + "}\n\n" +
           wrapper();
  }

 private:
  void set_leaves();
  void find_places();
  bool is_bounded(int axis) const { return row_.axes[axis] == Topology::bounded; }
  bool is_single() const { return module_.real == Precision::f32; }
  bool uses_place() const { return !masks_.empty() || uses_grids_; }
  std::string function_name() const { return cpp_identifier(row_.name) + "_cells"; }
  std::string mask_name(const loop::Inside& mask) const;
  std::string mask_test(const loop::Inside& mask, int axis) const;
  std::string row_mask(const loop::Inside& mask) const;
  std::string taps(const loop::Interp& i, const std::vector<std::string>& displacement) const;
  std::string strides() const;

  bool is_over(std::size_t stream) const;
  std::string head() const;
  std::string places() const;
  std::string masks_of_row() const;
  std::string masks_of_cell() const;
  std::string loop() const;
  std::string line_of(const loop::Store& store) const;
  std::string sums() const;
  std::string wrapper() const;

  const loop::Module& module_;
  const loop::Row& row_;
  const SourceFile* source_;
  const std::string& linkage_;
  CppNames names_;
  CppLeaves leaves_;
  CppExpression expression_;
  std::string_view real_;  // type of fields and row values
  std::vector<loop::Inside> masks_;
  std::vector<std::size_t> pointers_;  // the first stream of each pointer parameter
  bool uses_grids_ = false;
};

void RowEmitter::set_leaves() {
  std::set<std::string> known;
  for (std::size_t s = 0; s < row_.streams.size(); ++s) {
    if (known.insert(names_.streams[s]).second) pointers_.push_back(s);
  }
  leaves_.uniforms = names_.uniforms;
  leaves_.lets = names_.lets;
  leaves_.elementary = cpp_elementary_prefix();
  for (std::size_t s = 0; s < row_.streams.size(); ++s) {
    const loop::Stream& stream = row_.streams[s];
    leaves_.loads.push_back(
        fmt::format("{}[{}]", names_.streams[s], stream.is_even ? "0" : plus("i", stream.offset[0])));
  }
  leaves_.inside = [this](const loop::Inside& mask) { return mask_name(mask); };
  leaves_.interp = [this](const loop::Interp& i, const std::vector<std::string>& displacement) {
    return fmt::format("dpde_interp_{}({}, {}{})", row_.rank, names_.grids[i.grid], taps(i, displacement), strides());
  };
  for (const loop::Let& let : row_.lets) leaves_.let_is_truth.push_back(expression_.is_truth(let.value));
}

void RowEmitter::find_places() {
  uses_grids_ = !row_.grids.empty();
  visit(row_, [&](const loop::Expr& e) {
    const loop::Inside* mask = as<loop::Inside>(e);
    if (mask && std::find(masks_.begin(), masks_.end(), *mask) == masks_.end()) masks_.push_back(*mask);
  });
}

// ---- positions -----------------------------------------------------------------------------------------------------

std::string RowEmitter::mask_name(const loop::Inside& mask) const {
  return fmt::format("dpde_inside{}{}", cpp_offset_suffix(mask.offset, row_.rank),
                     mask.grow == 0 ? "" : fmt::format("_grow_{}", mask.grow));
}

std::string RowEmitter::mask_test(const loop::Inside& mask, int axis) const {
  const std::string place = axis == 0 ? "first + i" : fmt::format("place_{}", axis_names[axis]);
  return fmt::format("dpde_inside({}, cells_{}, {})", plus(place, mask.offset[axis]), axis_names[axis], mask.grow);
}

/// The part of a mask that is constant along the row; "" if there is none.
std::string RowEmitter::row_mask(const loop::Inside& mask) const {
  std::vector<std::string> tests;
  for (int axis = 1; axis < row_.rank; ++axis) {
    if (is_bounded(axis)) tests.push_back(mask_test(mask, axis));
  }
  return fmt::format("{}", fmt::join(tests, " && "));
}

/// Text of the dpde_taps of every axis.
std::string RowEmitter::taps(const loop::Interp& i, const std::vector<std::string>& displacement) const {
  std::vector<std::string> texts;
  for (int axis = 0; axis < row_.rank; ++axis) {
    const std::string place = axis == 0 ? "first + i" : fmt::format("place_{}", axis_names[axis]);
    texts.push_back(fmt::format("{}(dpde_{}({}, {}, cells_{}))", cpp_taps(i.along[axis]),
                                is_bounded(axis) ? "bounded" : "periodic", plus(place, i.offset[axis]),
                                displacement[axis], axis_names[axis]));
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::string RowEmitter::strides() const {
  return row_.rank == 1 ? "" : row_.rank == 2 ? ", stride_y" : ", stride_y, stride_z";
}

std::string RowEmitter::places() const {
  std::string out;
  for (int axis = 0; axis < row_.rank; ++axis) {
    const char name = axis_names[axis];
    if (!uses_grids_ && (masks_.empty() || !is_bounded(axis))) continue;
    out += axis == 0 ? "  const int64_t first = row->first;\n"
                     : fmt::format("  const int64_t place_{0} = row->{0};\n", name);
    out += fmt::format("  const int64_t cells_{} = row->layout->global[{}];\n", name, axis);
    if (axis > 0 && uses_grids_)
      out += fmt::format("  const int64_t stride_{} = row->layout->stride[{}];\n", name, axis);
  }
  return out;
}

std::string RowEmitter::masks_of_row() const {
  std::string out;
  for (const loop::Inside& mask : masks_) {
    const std::string test = row_mask(mask);
    if (!test.empty())
      out += fmt::format("  const bool {}{} = {};\n", mask_name(mask), is_bounded(0) ? "_row" : "", test);
  }
  return out;
}

/// `&`, not `&&`: a branch here keeps g++ from vectorising the loop.
std::string RowEmitter::masks_of_cell() const {
  std::string out;
  if (!is_bounded(0)) return out;
  for (const loop::Inside& mask : masks_) {
    const std::string row_part = row_mask(mask).empty() ? "" : mask_name(mask) + "_row & ";
    out += fmt::format("    const bool {} = {}{};\n", mask_name(mask), row_part, mask_test(mask, 0));
  }
  return out;
}

// ---- the function --------------------------------------------------------------------------------------------------

std::string RowEmitter::head() const {
  std::vector<std::string> parameters = {"int64_t count"};
  if (uses_place()) parameters.push_back("const dpde_row* row");
  for (const std::size_t s : pointers_) {
    const bool is_read = row_.streams[s].mode == loop::Stream::Mode::in;
    parameters.push_back(
        fmt::format("{}{}*{} {}", is_read ? "const " : "", real_, is_over(s) ? "" : " __restrict", names_.streams[s]));
  }
  std::set<int> targets;
  for (const loop::Scatter& scatter : row_.scatters) targets.insert(scatter.target.grid);
  for (std::size_t g = 0; g < row_.grids.size(); ++g) {
    const bool is_read = !targets.contains(static_cast<int>(g));
    parameters.push_back(fmt::format("{}{}* __restrict {}", is_read ? "const " : "", real_, names_.grids[g]));
  }
  for (const int u : loop::used_uniforms(row_))
    parameters.push_back(fmt::format("const {} {}", real_, names_.uniforms[u]));
  if (!row_.sums.empty()) parameters.push_back("double* __restrict sums");
  return wrapped(fmt::format("static void {}(", function_name()), parameters, ") {");
}

/// Whether the stream may share memory with another one. `omp simd` then states that cells are independent.
bool RowEmitter::is_over(std::size_t stream) const {
  return row_.streams[stream].over >= 0 || std::ranges::any_of(row_.streams, [&](const loop::Stream& other) {
           return other.over == static_cast<int>(stream);
         });
}

std::string RowEmitter::line_of(const loop::Store& store) const {
  if (!source_ || !store.origin.range.is_known()) return "";
  return fmt::format("  // {}:{}", printable_line(source_->path_of(store.origin.range.begin)),
                     source_->locate(store.origin.range.begin).line);
}

std::string RowEmitter::loop() const {
  std::string out;
  for (const std::string& sum : names_.sums) out += fmt::format("  double {} = 0.0;\n", sum);
  const std::string reduction =
      names_.sums.empty() ? "" : fmt::format(" reduction(+ : {})", fmt::join(names_.sums, ", "));
  if (row_.scatters.empty()) out += fmt::format("#pragma omp simd{}\n", reduction);
  out += "  for (int64_t i = 0; i < count; ++i) {\n" + masks_of_cell();
  for (std::size_t l = 0; l < row_.lets.size(); ++l) {
    const bool is_truth = leaves_.let_is_truth[l];
    const loop::Expr& value = row_.lets[l].value;
    out += fmt::format("    const {} {} = {};\n", is_truth ? "bool" : real_, names_.lets[l],
                       is_truth ? expression_.truth(value) : expression_.number(value));
  }
  for (const loop::Store& store : row_.stores) {
    out += fmt::format("    {} {} {};{}\n", leaves_.loads[store.stream], store.accumulate ? "+=" : "=",
                       expression_.number(store.value), line_of(store));
  }
  for (std::size_t s = 0; s < row_.sums.size(); ++s) {
    const std::string value = expression_.number(row_.sums[s].value);
    out += fmt::format("    {} += {};\n", names_.sums[s], is_single() ? fmt::format("(double)({})", value) : value);
  }
  for (const loop::Scatter& scatter : row_.scatters) {
    std::vector<std::string> displacement;
    for (const loop::Expr& d : scatter.target.displacement) displacement.push_back(expression_.number(d));
    out += fmt::format("    dpde_scatter_{}({}, {}, {}{});\n", row_.rank, names_.grids[scatter.target.grid],
                       expression_.number(scatter.value), taps(scatter.target, displacement), strides());
  }
  return out + "  }\n";
}

std::string RowEmitter::sums() const {
  std::string out;
  for (std::size_t s = 0; s < names_.sums.size(); ++s) out += fmt::format("  sums[{}] += {};\n", s, names_.sums[s]);
  return out;
}

std::string RowEmitter::wrapper() const {
  std::vector<std::string> arguments = {"row->count"};
  if (uses_place()) arguments.push_back("row");
  for (const std::size_t s : pointers_) {
    arguments.push_back(plus(fmt::format("({}*)row->streams[{}]", real_, s), -row_.streams[s].offset[0]));
  }
  for (std::size_t g = 0; g < row_.grids.size(); ++g) arguments.push_back(fmt::format("({}*)row->grids[{}]", real_, g));
  const std::string_view rounded = is_single() ? "(float)" : "";
  for (const int u : loop::used_uniforms(row_)) {
    arguments.push_back(row_.is_own(u) ? fmt::format("{}row->own[{}]", rounded, u - row_.own)
                                       : fmt::format("{}row->uniforms[{}]", rounded, u));
  }
  if (!row_.sums.empty()) arguments.push_back("row->sums");
  return fmt::format("{} {}(const dpde_row* row) {{\n", linkage_, symbol_of(row_.name)) +
         wrapped(fmt::format("  {}(", function_name()), arguments, ");") + "}\n";
}

}  // namespace

std::string emit_cpp_row(const loop::Module& module, const loop::Row& row, const SourceFile* source,
                         const std::string& linkage) {
  return RowEmitter(module, row, source, linkage).emit();
}

}  // namespace dpde::codegen
