// SPDX-License-Identifier: Apache-2.0
// dataset NAME : SCENE { runs 10; seed 0; vary nu in 0.01 .. 0.1; vary s from 100; frames every 0.1 from 3 to 23;
// coarsen 4; file "train.nc" }, or coarsen 4 in "train.nc"; coarsen 2 in "finer.nc"
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "model/data_set_from_ast.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "syntax/expand/arrays.h"

namespace dpde::model {

namespace {

constexpr double most_of_an_option = 1e9, most_runs = 1e5;  // each run is a separate file until all are done

class DataSetReader {
 public:
  DataSetReader(const ast::DataSet& source, Elaboration& elaboration) : source_(source), elaboration_(elaboration) {}

  DataSet read() {
    set_.name = source_.name.name;
    set_.range = source_.name.range;
    set_.scene = source_.of.name;
    if (source_.scheme) set_.scheme = source_.scheme->name;
    if (find_declaration<ast::Scene>(elaboration_.file, set_.scene) == nullptr) {
      elaboration_.sink.report("unknown-block", source_.of.range, {"scene", set_.scene},
                               did_you_mean(set_.scene, names_of<ast::Scene>(elaboration_.file)));
    }
    for (const auto& [item, range] : items_of<ast::OptionItem>(source_.items)) read_option(item, range);
    for (const auto& [item, range] : items_of<ast::FramesItem>(source_.items)) {
      refuse_second("frames", range);
      set_.every = number(item.every);
      set_.of = item.of;
      if (item.from) set_.from = number(*item.from);
      if (item.to) set_.to = number(*item.to);
      if (!(set_.every > 0))
        fail(item.every.range(), "frames every", fmt::format("must be positive, not {}", set_.every));
    }
    for (const auto& [item, range] : items_of<ast::VaryItem>(source_.items)) read_vary(item);
    if (set_.grids.empty()) set_.grids.push_back({coarsen_, file_.empty() ? set_.name + ".nc" : file_});
    return set_;
  }

 private:
  void fail(SourceRange where, const std::string& option, const std::string& what) {
    elaboration_.sink.report("bad-optimiser-option", where, {option, "dataset " + set_.name, what});
  }
  double number(const ast::Expr& e) { return evaluate(elaboration_, e, "a number of a data set").value_or(1); }

  int whole(const ast::Expr& e, const std::string& option, double least, double largest = most_of_an_option) {
    const double value = number(e);
    if (value >= least && value <= largest && value == std::floor(value)) return static_cast<int>(value);
    fail(e.range(), option,
         fmt::format("is a whole number from {} {}, not {}", least,
                     value > largest ? fmt::format("to {}", largest) : "on", value));
    return 1;
  }

  void refuse_second(const std::string& what, SourceRange range) {
    const auto [first, is_new] = seen_.emplace(what, range);
    if (!is_new) report_duplicate(elaboration_, what, range, first->second);
  }

  void read_option(const ast::OptionItem& item, SourceRange range) {
    const std::string& name = item.name.name;
    if (item.in) return read_grid(item, range);
    refuse_second(name, range);
    if (name == "runs") set_.runs = whole(item.value, name, 1, most_runs);
    if (name == "seed") set_.seed = static_cast<std::uint64_t>(whole(item.value, name, 0));
    if (name == "coarsen") coarsen_ = whole(item.value, name, 1);
    if (name == "file") file_ = file_name(item.value, name);
    if (name == "coarsen" || name == "file") refuse_mixture(name, range);
  }

  /// coarsen 2 in "finer.nc"
  void read_grid(const ast::OptionItem& item, SourceRange range) {
    set_.grids.push_back({whole(item.value, "coarsen", 1), file_name(*item.in, "coarsen ... in")});
    const std::string& file = set_.grids.back().file;
    if (std::ranges::count(set_.grids, file, &DataSet::Grid::file) > 1)
      fail(item.in->range(), "coarsen ... in", fmt::format("names {} a second time", file));
    refuse_mixture("coarsen ... in", range);
  }

  /// Refuses a mixture of the two ways to name files.
  void refuse_mixture(const std::string& option, SourceRange range) {
    const bool has_lone = seen_.contains("coarsen") || seen_.contains("file");
    if (has_lone && !set_.grids.empty())
      fail(range, option,
           "stands beside the other way to write it: coarsen N; file \"NAME.nc\" for one grid, or "
           "coarsen N in \"NAME.nc\" for each");
  }

  std::string file_name(const ast::Expr& e, const std::string& option) {
    const auto* text = std::get_if<ast::Text>(&e->kind);
    if (text && text->value.ends_with(".nc") && text->value.find('/') == std::string::npos) return text->value;
    fail(e.range(), option, "is the name of a .nc file in the folder of --out, as in file \"train.nc\"");
    return "";
  }

  void read_vary(const ast::VaryItem& item) {
    refuse_second("vary " + item.name.name, item.name.range);
    const std::string option = "vary " + item.name.name;
    DataSet::Vary vary{item.name.name, 0, 0, item.is_log, item.from.has_value(), item.name.range};
    if (item.from) vary.low = vary.high = whole(*item.from, option, 0);
    for (const ast::Expr& value : item.values) vary.values.push_back(number(value));
    if (item.low) {
      vary.low = number(*item.low), vary.high = number(*item.high);
      if (vary.low > vary.high)
        fail(item.low->range(), option, fmt::format("has no number from {} to {}", vary.low, vary.high));
      else if (vary.is_log && !(vary.low > 0))
        fail(item.low->range(), option, fmt::format("has no logarithm at {}: take a range above 0", vary.low));
    }
    set_.vary.push_back(std::move(vary));
  }

  const ast::DataSet& source_;
  Elaboration& elaboration_;
  DataSet set_;
  int coarsen_ = 1;
  std::string file_;
  std::map<std::string, SourceRange> seen_;
};

}  // namespace

double DataSet::value_of(std::size_t number, int run) const {
  const Vary& each = vary[number];
  if (each.counts) return each.low + run;
  if (!each.values.empty()) {
    std::size_t turns = static_cast<std::size_t>(run);  // number of full turns of the previous lists
    for (std::size_t i = 0; i < number; ++i) turns /= std::max<std::size_t>(1, vary[i].values.size());
    return each.values[turns % each.values.size()];
  }
  std::seed_seq words{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                      static_cast<std::uint32_t>(run), static_cast<std::uint32_t>(number)};
  std::mt19937_64 random(words);  // the standard fixes the output of both the generator and seed_seq
  const double share = static_cast<double>(random() >> 11) * 0x1p-53;
  return each.is_log ? std::exp((1 - share) * std::log(each.low) + share * std::log(each.high))
                     : each.low + (each.high - each.low) * share;
}

std::optional<DataSet> data_set_from_ast(const ast::File& file, const std::string& name, DiagnosticSink& sink) {
  const std::optional<ast::File> written = ast::with_elements(file, sink);
  if (!written) return std::nullopt;
  const ast::DataSet* source = find_declaration<ast::DataSet>(*written, name);
  const Selection nothing;
  Elaboration elaboration(*written, nothing, sink);
  DataSet set = DataSetReader(*source, elaboration).read();
  return sink.has_errors() ? std::nullopt : std::optional(std::move(set));
}

std::vector<std::string> data_set_names(const ast::File& file) { return names_of<ast::DataSet>(file); }

}  // namespace dpde::model
