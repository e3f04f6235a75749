// SPDX-License-Identifier: Apache-2.0
// Several runs of a scene in one file: parameters that vary between runs, and stored states.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::model {

struct DataSet {
  std::string name, scene, scheme;  // scheme "": the scene's
  int runs = 1;
  std::uint64_t seed = 0;
  struct Vary {
    std::string param;
    double low = 0, high = 0;  // uniform random number in between, from the seed, run number and position in this list
    bool is_log = false;       // uniform in the logarithm
    bool counts = false;       // low, low + 1, ... instead of random numbers
    SourceRange range = {};
    std::vector<double> values = {};  // instead of random numbers: the first list advances with each run, the second
                                      // after each full turn of the first, and so on
  };
  std::vector<Vary> vary;
  double every = 0;                   // time between frames; 0: one step
  std::optional<double> from, to;     // times of the frames; else the scene's own
  std::vector<ast::NamedFormula> of;  // stored fields; empty: all states
  struct Grid {
    int coarsen = 1;   // number of cells along each axis merged into one
    std::string file;  // the name
  };
  std::vector<Grid> grids;  // one file per grid; at least one
  SourceRange range;        // of the block's name

  /// The value of parameter `number` of the list in a run.
  double value_of(std::size_t number, int run) const;
};

/// nullopt if `sink` has errors afterwards.
std::optional<DataSet> data_set_from_ast(const ast::File& file, const std::string& name, DiagnosticSink& sink);
/// In file order.
std::vector<std::string> data_set_names(const ast::File& file);

}  // namespace dpde::model
