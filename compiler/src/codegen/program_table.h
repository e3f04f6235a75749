// SPDX-License-Identifier: Apache-2.0
// The C structs of kernel_abi.h for the programs of a loop module. ProgramTables owns every string and array they point
// to; the addresses stay the same for its whole life, also when it is moved.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dpde/kernel_abi.h"
#include "loop/loop.h"

namespace dpde::codegen {

/// Code of a row function.
struct RowCode {
  RowCode(dpde_row_fn function = nullptr) : row(function) {}  // NOLINT: a function is code
  dpde_row_fn row;
  std::vector<dpde_variant> variants;
};
/// By the name of the loop::Row.
using RowResolver = std::function<RowCode(const std::string& row)>;
/// Fills all uniforms of the module (order of Module::uniforms), or those that depend on a counter, from all its
/// parameters and the counters behind them (order of Module::params and Module::counters).
using ComputeUniforms = void (*)(const double* params, double* uniforms);
using Interpret = void (*)(void* context, const dpde_layout* layout, void* const* fields, const double* params,
                           const dpde_weights* weights, double* sums);

/// See dpde_link. Kinds are DPDE_LINK_FIELD, DPDE_LINK_PARAM, DPDE_LINK_SUM.
struct TableLink {
  int kind;
  std::string primal;
  int derived_kind;
  std::string derived;
};

class ProgramTables {
 public:
  /// An interpreter that needs no code passes {} and nullptr and calls set_interpreter for each program.
  ProgramTables(const loop::Module& module, const RowResolver& row_code, ComputeUniforms compute_uniforms,
                ComputeUniforms compute_counted = nullptr);
  ~ProgramTables();
  ProgramTables(ProgramTables&&) noexcept;
  ProgramTables& operator=(ProgramTables&&) noexcept;

  /// nullptr when there is no such program.
  const dpde_program* find(const std::string& name) const;
  /// Names in the order of the module.
  std::vector<std::string> names() const;
  /// Of a derivative. What the program has no field, param or sum for gets the index -1.
  void set_links(const std::string& program, const std::vector<TableLink>& links);
  void set_interpreter(const std::string& program, Interpret interpret, void* context);

 private:
  struct Strings;
  struct Table;
  std::unique_ptr<Strings> strings_;  // shared by all tables: the parameters
  std::vector<std::unique_ptr<Table>> tables_;
};

}  // namespace dpde::codegen
