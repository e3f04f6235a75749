// SPDX-License-Identifier: Apache-2.0
// A chart block: variants of a scene to run, their error norms, and the reference for comparison.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/error_norm.h"
#include "source/diagnostic.h"
#include "syntax/ast.h"

namespace dpde::model {

struct Chart {
  std::string name, scene, scheme;  // scheme "": the scene's
  enum class Reference { found, exact, manufactured, self } reference = Reference::found;
  int reference_cells = 0;  // of self: along the first axis
  struct Choices {
    std::string key;  // scheme, cells, step, fraction or a key of a scheme
    std::vector<std::string> values;
  };
  std::vector<Choices> vary;
  struct Error {
    std::string field;  // of a vector: each component
    ErrorNorm norm = ErrorNorm::l2;
    SourceRange range;  // of the field
  };
  std::vector<Error> errors;      // empty: all fields, l2
  std::optional<double> end;      // end of the run, instead of the scene's
  std::string gradient;           // the task whose gradient is compared too; "": none
  double tolerance = 0;           // 0: none
  SourceRange range;              // of the block's name
  SourceRange reference_range{};  // of the statement about the reference
};

/// nullopt if `sink` has errors afterwards. Does not check that the scene has the fields.
std::optional<Chart> chart_from_ast(const ast::File& file, const std::string& name, DiagnosticSink& sink);
/// In file order.
std::vector<std::string> chart_names(const ast::File& file);

}  // namespace dpde::model
