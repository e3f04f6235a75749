// SPDX-License-Identifier: Apache-2.0
// Runs of a scene in one file: what varies from run to run, and which states are kept.
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
    double low = 0, high = 0;  // a number in between, drawn by seed, run and place in this list
    bool is_log = false;       // drawn evenly in its logarithm
    bool counts = false;       // low, low + 1, ... instead
    SourceRange range = {};
    std::vector<double> values = {};  // these instead: the next one of the first list in each run, of the second behind
                                      // each turn of the first, and so on
  };
  std::vector<Vary> vary;
  double every = 0;                   // time from frame to frame; 0: one step
  std::optional<double> from, to;     // of the frames; else the scene's own
  std::vector<ast::NamedFormula> of;  // what is kept; none: all states
  struct Grid {
    int coarsen = 1;   // cells along each axis that become one
    std::string file;  // its name
  };
  std::vector<Grid> grids;  // of the frames, a file each; one at least
  SourceRange range;        // of the block's name

  /// Of parameter `number` of the list in a run.
  double value_of(std::size_t number, int run) const;
};

/// nullopt when `sink` has errors afterwards.
std::optional<DataSet> data_set_from_ast(const ast::File& file, const std::string& name, DiagnosticSink& sink);
/// In the order of the file.
std::vector<std::string> data_set_names(const ast::File& file);

}  // namespace dpde::model
